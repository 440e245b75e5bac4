"""A room as Radiance files that `oconv`, `rfluxmtx` and `rtrace` take as they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.colours import GREY, Colour, radiance_colour
from bim.model import Building, Element, Face, Space
from bim.outdoors import before_windows
from bim.radiance_script import LUMINANCE, makefile, run_script
from bim.sensors import sensor_grid, surface_sensors, view_point
from bim.to_tracer import window_groups
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.files import write_text
from mitsuba_cfs.gloss import Gloss, radiance_material
from mitsuba_cfs.surfaces import WindowGroup

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
    fisheye = (
        f"rvu -vta -vp {_numbers(position)} -vd {_numbers(direction)} -vu 0 0 1 -vh 180 -vv 180"
    )
    view = _write(folder / "view.vf", [fisheye + "\n"])
    surfaces = _write(folder / "surfaces.pts", _surface_lines(space, spacing))
    files = {identifier(name): bsdfs.get(name) for name in windows}
    script = _write(folder / "run.sh", [run_script(files, sky_division, band)])
    script.chmod(0o755)
    _write(folder / "Makefile", [makefile(band)])
    return RadianceFiles(
        written, grey, room, scene, shades, windows, bsdfs,
        _write(folder / "systems.rad", systems), sky, sensors, view, surfaces, script,
    )  # fmt: skip


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


def _parts(
    parts: Iterable[Face | Element], materials: _Materials, *, inwards: bool, name: str = ""
) -> Iterable[str]:
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
