"""A room as Radiance files that `oconv`, `rfluxmtx` and `rtrace` take as they are.

The script beside them computes three or five phases with nothing but Radiance.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.colours import GREY, Colour, radiance_colour
from bim.model import Building, Element, Face, Space
from bim.outdoors import before_windows
from bim.sensors import sensor_grid, surface_sensors, view_point
from bim.to_tracer import window_groups
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.files import write_text
from mitsuba_cfs.gloss import Gloss, radiance_material
from mitsuba_cfs.surfaces import WindowGroup

# Source: A. McNeil, "The Three-Phase Method for Simulating Complex Fenestration with Radiance" and
# "The Five-Phase Method" (LBNL 2013), with rfluxmtx in place of rcontrib; the lm/W of Radiance's
# three channels
SCRIPT = """#!/bin/sh
# {Quantity} of the room's sensors by Radiance alone, the three- or the five-phase method:
#
#   V T D s    or    V T D s - V_d T D_d s_d + C_ds s_ds
#
#   ./run.sh                 coefficients.mtx: V T D, {unit} at each sensor by each patch's
#                            {radiance}
#   ./run.sh WEATHER.wea     also {result} [{unit}]: a row for each sensor, a column for each
#                            hour (epw2wea CITY.epw CITY.wea makes the weather)
#
# MATERIALS in their colours, or grey.rad: as grey as they are light, as cfs itself has them
# SENSORS   points and directions, default sensors.pts; surfaces.pts: on all walls
# PHASES    3, or 5: also direct.mtx, V_d T D_d, and sun_coefficients.mtx, C_ds
# INDOORS   rays from each sensor, OUTDOORS: from each direction of a window's basis
# BOUNCES   in the room and outdoors
# SUNS      Reinhart's MF of the places of the sun: 6 has 5,185
# STRAIGHT  rays from each sensor to what a window scatters of the sun
set -eu
[ $# -eq 0 ] || weather=$(realpath "$1")
cd "$(dirname "$0")"
materials=${MATERIALS:-materials.rad}
sensors=${SENSORS:-sensors.pts}
phases={phases}
indoors=${INDOORS:-20000}
outdoors=${OUTDOORS:-1000}
bounces=${BOUNCES:-8}
suns=${SUNS:-6}
straight=${STRAIGHT:-20000}
count=$(wc -l < "$sensors")
case $phases in 3|5) ;; *) echo "PHASES=$phases: 3 or 5" >&2; exit 1;; esac

# weight below which a ray ends: a hundredth of one of many
least() { echo "0.01 / $1" | awk '{ printf "%.3g", $1 / $3 }'; }
{group}groups() {
{groups}
}

oconv "$materials" room.rad > room.oct
oconv "$materials" outdoors.rad > outdoors.oct
groups "" "$bounces" "$bounces"
rmtxop -ff {sum} > whole.mtx
rmtxop -fa -c {weights} whole.mtx > coefficients.mtx

if [ "$phases" = 5 ]; then
    echo "void plastic black 0 0 5 0 0 0 0 0" > black.rad
    xform -m black room.rad | oconv black.rad - > room_direct.oct
    xform -m black outdoors.rad | oconv black.rad - > outdoors_direct.oct
    groups _direct 1 0
    rmtxop -ff {direct} > direct.mtx
    # a sun in the middle of each patch, seen through the windows' own materials; by their light
    # (-V+), since rcontrib drops coefficients below 1e-6, which is much of what a blind scatters
    echo "void light solar 0 0 3 1e6 1e6 1e6" > suns.rad
    printf 'solar source sun\\n0\\n0\\n4 ${ Dx } ${ Dy } ${ Dz } 0.533\\n' > suns.fmt
    cnt $((144 * suns * suns + 1)) |
        rcalc -e "MF:$suns" -f reinsrc.cal -e "Rbin=recno" -o suns.fmt >> suns.rad
    for one in {names}; do xform -m "system_$one" "windows_$one.rad"; done > panes.rad
    xform -m black room.rad |
        oconv black.rad systems.rad - shades.rad panes.rad suns.rad > suns.oct
    rcontrib -faf -I+ -V+ -ab 1 -ad "$straight" -lw "$(least "$straight")" \\
        -dc 1 -dt 0 -dj 0 -y "$count" \\
        -e "MF:$suns" -f reinhart.cal -b rbin -bn Nrbins -m solar suns.oct \\
        < "$sensors" | rmtxop -ff -s 1e-6 - > sun_coefficients.mtx
fi
if [ $# -gt 0 ]; then
    gendaymtx -m {division} {output}-of "$weather" | rmtxop -ff whole.mtx . - > hours.mtx
    if [ "$phases" = 5 ]; then
        gendaymtx -m {division} {output}-d -of "$weather" |
            rmtxop -ff direct.mtx . - > direct_hours.mtx
        gendaymtx -m "$suns" {output}-5 0.533 -d -of "$weather" |
            rmtxop -ff sun_coefficients.mtx . - > sun_hours.mtx
        rmtxop -ff hours.mtx + -s -1 direct_hours.mtx + sun_hours.mtx > five.mtx
        mv five.mtx hours.mtx
    fi
    rmtxop -fa -c {efficacy} hours.mtx | getinfo - > {result}
fi
"""
MAKEFILE = """# make                 coefficients.mtx, with PHASES=5 also sun_coefficients.mtx
# make WEATHER=FILE.wea [PHASES=5]   {result}; see run.sh
PHASES ?= 3
export PHASES
RESULT = $(if $(WEATHER),{result},$(if $(filter 5,$(PHASES)),sun_)coefficients.mtx)
SCENE = run.sh materials.rad grey.rad room.rad outdoors.rad shades.rad sky.rad systems.rad
all: $(RESULT)
$(RESULT): $(SCENE) $(wildcard windows_* *.pts) $(WEATHER)
\t./run.sh $(abspath $(WEATHER))
.PHONY: all
"""
NO_BSDF = """#!/bin/sh
echo "no BSDF is known of the windows {names}: put windows_NAME.xml beside this script, run" >&2
echo "cfs ifc attach, and export again" >&2
exit 1
"""
GROUP = """# coefficients of one group of windows: view matrix, daylight matrix, and both with its
# BSDF between them; $2: name of the scenes and results, $3, $4: bounces in the room and outdoors
group() {
    rfluxmtx -faf -I+ -ab "$3" -ad "$indoors" -lw "$(least "$indoors")" -y "$count" \\
        - "windows_$1.rad" -i "room$2.oct" < "$sensors" > "view$2_$1.mtx"
    rfluxmtx -ffa -ab "$4" -ad 16 -lw 1e-4 -c "$outdoors" \\
        "windows_$1.rad" sky.rad -i "outdoors$2.oct" > "daylight$2_$1.mtx"
    rmtxop -ff "view$2_$1.mtx" . "windows_$1.xml" . "daylight$2_$1.mtx" > "part$2_$1.mtx"
}
"""
NO_WINDOW = """# a room without windows: what slits of its drawing let in, which ought to be nothing
group() {
    rfluxmtx -faf -I+ -ab 2 -ad 1024 -lw 1e-4 -y "$count" - sky.rad -i room.oct < "$sensors" |
        rmtxop -ff - > "part$2_$1.mtx"
}
"""
LUMINANCE = (0.265, 0.67, 0.065)  # of Radiance's red, green and blue
BANDS = {  # what the script's words stand for
    "visible": {
        "{Quantity}": "Illuminance",
        "{unit}": "lx",
        "{radiance}": "luminance [cd/m2]",
        "{result}": "illuminance.txt",
        "{output}": "",
        "{weights}": "0.265 0.67 0.065",
        "{efficacy}": "47.435 119.93 11.635",
    },
    "solar": {
        "{Quantity}": "Irradiance",
        "{unit}": "W/m2",
        "{radiance}": "radiance [W/(m2 sr)]",
        "{result}": "irradiance.txt",
        "{output}": "-O1 ",
        "{weights}": "0.265 0.67 0.065",
        "{efficacy}": "0.265 0.67 0.065",
    },
}


def makefile(band: str) -> str:
    """The Makefile beside the script."""
    return _filled(MAKEFILE, BANDS[band])


def run_script(groups: Mapping[str, Path | None], division: int, band: str) -> str:
    """The shell script of a folder.

    Args:
        groups: name of each group's files and its BSDF, where it is known.
        division: of the sky, Reinhart's MF.
        band: "visible" or "solar".
    """
    unknown = [name for name, bsdf in groups.items() if bsdf is None]
    if unknown:
        return NO_BSDF.format(names=", ".join(unknown))
    names = list(groups) or ["none"]
    calls = "\n".join(f'    group {name} "$@"' for name in names)
    sums = (" + ".join(f"part{kind}_{name}.mtx" for name in names) for kind in ("", "_direct"))
    filled = dict(zip(("{sum}", "{direct}"), sums, strict=True))
    filled |= {"{group}": GROUP, "{phases}": "${PHASES:-3}"}
    if not groups:
        filled |= {"{group}": NO_WINDOW, "{phases}": "3"}
    filled |= {"{groups}": calls, "{names}": " ".join(groups), "{division}": str(division)}
    return _filled(SCRIPT, filled | BANDS[band])


def _filled(text: str, words: Mapping[str, str]) -> str:
    for place, word in words.items():
        text = text.replace(place, word)
    return text


SKY = """# receivers of daylight: the ground, then the sky in Reinhart's patches
#@rfluxmtx h=u u=Y
void glow ground_glow
0
0
4 1 1 1 0
ground_glow source ground
0
0
4 0 0 -1 180

#@rfluxmtx h=r{division} u=Y
void glow sky_glow
0
0
4 1 1 1 0
sky_glow source sky
0
0
4 0 0 1 180
"""


@dataclass(frozen=True, slots=True)
class FilledGroup:
    """A window group and what is known of its fenestration."""

    group: WindowGroup
    bsdf: BsdfFile | None = None  # on Klems patches: the T of the matrices
    fine: BsdfFile | None = None  # for the sun alone, such as a tensor tree; else the same

    def as_solar(self) -> FilledGroup:
        """The same with its solar band in place of the visible one."""
        solar = [
            None
            if one is None or "Solar" not in one.bands
            else BsdfFile({"Visible": one.bands["Solar"]}, f"{one.name}, solar")
            for one in (self.bsdf, self.fine)
        ]
        return FilledGroup(self.group, *solar)


@dataclass(frozen=True, slots=True)
class RadianceFiles:
    """What `write_radiance` wrote."""

    materials: Path  # of both scenes, in their colours
    grey: Path  # the same without colours
    room: Path  # opaque boundary of the room
    outdoors: Path  # the surroundings
    shades: Path  # the part of them outside the windows, black
    windows: dict[str, Path]  # group name -> glass with its rfluxmtx comment, normals into the room
    bsdfs: dict[str, Path]  # group name -> BSDF XML, the T of `dctimestep`, where it is known
    systems: Path  # the groups' materials for the sun, with their BSDFs
    sky: Path  # ground and sky as rfluxmtx receivers
    sensors: Path  # x y z dx dy dz on each line
    view: Path  # fisheye view file
    surfaces: Path  # as the sensors: on every face of the room, looking into it
    script: Path  # illuminance by Radiance alone


def write_radiance(
    space: Space,
    building: Building,
    folder: str | PathLike[str],
    *,
    band: str = "visible",
    sky_division: int = 1,
    spacing: float = 0.5,
    height: float = 0.8,
    margin: float = 0.5,
    filled: Sequence[FilledGroup] | None = None,
) -> RadianceFiles:
    """Write the room, its surroundings, window groups, sensors and a view into a folder.

    `run.sh` there computes the sensors' illuminance with Radiance alone, by three or five phases;
    `make` runs it again where a file is newer than its results.  A room without windows has none.
    The view matrix of a group is
    `rfluxmtx -I+ -faa - windows_<group>.rad -i room.oct < sensors.pts`, its daylight matrix
    `rfluxmtx windows_<group>.rad sky.rad -i outdoors.oct`, with room.oct made of materials and room
    and outdoors.oct of materials and outdoors.

    Args:
        band: "visible", or "solar": reflectances without colour, the windows' solar BSDF where
            Radiance looks for a visible one, and irradiance.
        sky_division: Reinhart division MF of sky.rad, 1 for Tregenza's 145 patches.
        spacing, height, margin: of the sensor grid [m], see `sensor_grid`.
        filled: the window groups with their BSDFs; by default the orientations, without.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    own = {window.guid for window in space.windows}
    outdoors = [element for element in building.elements if element.guid not in own]
    materials = _Materials(band)
    inside = [*_parts(space.faces, materials, inwards=True)]
    inside += _parts(space.furniture, materials, inwards=False, name="furniture")
    room = _write(folder / "room.rad", inside)
    scene = _write(folder / "outdoors.rad", _parts(outdoors, materials, inwards=False))
    before = before_windows(outdoors, space.windows)
    black = (_polygon("black", f"shade.{i}", triangle) for i, triangle in enumerate(before))
    shades = _write(folder / "shades.rad", black)
    written = _write(folder / "materials.rad", materials.lines(coloured=band == "visible"))
    grey = _write(folder / "grey.rad", materials.lines())
    windows, bsdfs, systems = {}, {}, []
    for given in map(FilledGroup, window_groups(space)) if filled is None else filled:
        known = given if band == "visible" else given.as_solar()
        name = identifier(known.group.name)
        glass = _window_group(name, [w.triangles for w in known.group.windows])
        windows[known.group.name] = _write(folder / f"windows_{name}.rad", glass)
        if known.bsdf is not None:
            bsdfs[known.group.name] = folder / f"windows_{name}.xml"
            write_bsdf_xml(known.bsdf, bsdfs[known.group.name])
            systems.append(_system(known, name, folder))
    sky = _write(folder / "sky.rad", [SKY.format(division=sky_division)])
    points, directions = sensor_grid(space, spacing, height, margin)
    rows = np.concatenate([points, directions], axis=1)
    sensors = _write(folder / "sensors.pts", (_numbers(row) + "\n" for row in rows))
    position, direction = view_point(space)
    fisheye = f"rvu -vta -vp {_numbers(position)} -vd {_numbers(direction)} -vu 0 0 1 -vh 180 -vv 180"
    view = _write(folder / "view.vf", [fisheye + "\n"])
    surfaces = _write(folder / "surfaces.pts", _surface_lines(space, spacing))
    files = {identifier(name): bsdfs.get(name) for name in windows}
    script = _write(folder / "run.sh", [run_script(files, sky_division, band)])
    script.chmod(0o755)
    _write(folder / "Makefile", [makefile(band)])
    return RadianceFiles(
        written,
        grey,
        room,
        scene,
        shades,
        windows,
        bsdfs,
        _write(folder / "systems.rad", systems),
        sky,
        sensors,
        view,
        surfaces,
        script,
    )


def _system(known: FilledGroup, name: str, folder: Path) -> str:
    """A group's material as a ray to the sun meets it; its peak straight on is Radiance's."""
    data = folder / f"windows_{name}.xml"
    if known.fine is not None:
        data = folder / f"windows_{name}_fine.xml"
        write_bsdf_xml(known.fine, data)
    up = _numbers(known.group.frame[1])
    return f"void aBSDF system_{name}\n5 ./{data.name} {up} .\n0\n0\n\n"


def _surface_lines(space: Space, spacing: float) -> Iterable[str]:
    """Sensors on the faces of a room, in their order, those that a grid point lies on."""
    for face in space.faces:
        points, directions = surface_sensors(face, (spacing, spacing, spacing))
        yield from (_numbers(row) + "\n" for row in np.concatenate([points, directions], axis=1))


def identifier(name: str) -> str:
    """A name that Radiance takes: no blanks, no quotes, ASCII."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name) or "part"


def _write(path: Path, parts: Iterable[str]) -> Path:
    write_text(path, "".join(parts), encoding="ascii")
    return path


class _Materials:
    """Materials of a band by what they reflect, diffusely and like a mirror, and their hue."""

    def __init__(self, band: str) -> None:
        self._band = band
        self._names: dict[tuple[float, Gloss | None, Colour], str] = {}

    def of(self, part: Face | Element) -> str:
        """Name of a part's material."""
        key = part.reflectance(self._band), part.gloss, part.hue
        number = len(self._names)
        glossy = "" if part.gloss is None else f"_gloss_{number}"
        coloured = "" if part.hue == GREY else f"_colour_{number}"
        return self._names.setdefault(key, f"diffuse_{key[0]:.6f}{glossy}{coloured}")

    def lines(self, *, coloured: bool = False) -> Iterable[str]:
        """The materials that have been asked for, in their colours or as grey as they are light."""
        for (value, gloss, hue), name in sorted(self._names.items(), key=lambda item: item[1]):
            colour = radiance_colour(value, hue if coloured else GREY, LUMINANCE)
            yield radiance_material(name, colour, gloss) + "\n"


def _parts(parts: Iterable[Face | Element], materials: _Materials, *, inwards: bool, name: str = "") -> Iterable[str]:
    """Polygons of faces or elements; faces are turned to look into the room."""
    for number, part in enumerate(parts):
        triangles = part.triangles[:, ::-1] if inwards else part.triangles
        material = materials.of(part)
        whole = f"{name}{identifier(part.name)}.{number}"
        for index, triangle in enumerate(triangles):
            yield _polygon(material, f"{whole}.{index}", triangle)


def _window_group(name: str, windows: list[NDArray[np.float64]]) -> Iterable[str]:
    """The group's glass as one rfluxmtx surface: Klems full basis, up is up, normals inwards."""
    normal = np.cross(windows[0][0, 1] - windows[0][0, 0], windows[0][0, 2] - windows[0][0, 0])
    level = abs(normal[2]) > 0.99996 * np.linalg.norm(normal)  # as mitsuba_cfs.directions
    yield f"#@rfluxmtx h=kf u={'Y' if level else 'Z'}\n"
    yield f"void glow glass_{name}\n0\n0\n4 1 1 1 0\n\n"
    for number, triangles in enumerate(windows):
        for index, triangle in enumerate(triangles[:, ::-1]):
            yield _polygon(f"glass_{name}", f"window_{name}.{number}.{index}", triangle)


def _polygon(material: str, name: str, triangle: NDArray[np.float64]) -> str:
    corners = "\n".join(_numbers(corner) for corner in triangle)
    return f"{material} polygon {name}\n0\n0\n9\n{corners}\n\n"


def _numbers(values: NDArray[np.float64]) -> str:
    return " ".join(f"{value:.6f}" for value in values)
