r"""A room of an IFC file by its exported folder's own run.sh, and by our matrices.

    python -m tests.validation radiance_folder FILE.ifc ROOM FOLDER \
        [--runs 3] [--indoors 5000] [--outdoors 400] [--weather CITY.epw]

V T D of each sensor under four skies that weigh directions differently; with a weather file also
the hours of three days by five phases, of the suns of MF 2.  The root mean square of the sensors'
relative differences, and the standard error of either side's mean over the runs.

Both sides have the surfaces as grey as they are light; a last run of Radiance has their colours.
What a blind passes straight on is even in a Klems patch, as Radiance reads the file; `cfs run`
takes it to be linear between the patches' middles, which the last line shows.
"""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from bim.ifc.building import read_ifc
from bim.model import Building, Space
from bim.to_radiance import FilledGroup, RadianceFiles, write_radiance
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering, sun_scattering
from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
from mitsuba_cfs.trace.matrices.view import view_matrix
from mitsuba_cfs.trace.sun.direct import direct_sun_matrix
from scenes.demo import VENETIAN_BLIND
from tests.benchmarks.radiance import environment, run

DAYS = ("3 21", "6 21", "12 21")
SUNS = 2  # MF of the sun's places: 577
LUX = "-c 47.435 119.93 11.635"  # lm/W of Radiance's three channels
LEAST = 50.0  # [lx] of a sensor's hour that is compared


class EvenBeams(KlemsScattering):
    """A Klems block whose through beam is even in a patch."""

    def __init__(self, block: KlemsScattering) -> None:
        """From the same with beams that are linear between the patches."""
        self.__dict__.update(block.__dict__)
        self.key = ("even", *block.key)
        self._beams = mi.Float(block.beams.astype(np.float32))

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return dr.gather(mi.Float, self._beams, self.bins.index(sun))


@dataclass(frozen=True)
class Room:
    """What both sides compute."""

    building: Building
    space: Space
    blind: BsdfFile
    files: RadianceFiles
    weather: Path | None  # WEA

    @classmethod
    def exported(cls, file: Path, name: str, folder: Path, weather: Path | None) -> Room:
        """A room with a blind in its windows, and its folder."""
        building = read_ifc(file)
        space = building.space(name)
        blind = read_bsdf_xml(VENETIAN_BLIND)
        filled = [FilledGroup(group, blind) for group in window_groups(space)]
        files = write_radiance(space, building, folder, filled=filled, spacing=1.0)
        return cls(building, space, blind, files, weather and three_days(weather, folder))


def three_days(weather: Path, folder: Path) -> Path:
    """The WEA file of three days of an EPW file."""
    run(f"epw2wea {weather.resolve()} year.wea", folder)
    lines = (folder / "year.wea").read_text().splitlines(keepends=True)
    hours = [line for line in lines if " ".join(line.split()[:2]) in DAYS]
    days = folder / "days.wea"
    days.write_text("".join([*lines[:6], *hours]))
    return days


def theirs(room: Room, indoors: int, outdoors: int, *, materials: str = "grey.rad") -> tuple[NDArray, NDArray | None]:
    """Coefficients [S, P] by Radiance alone, its seed the clock's, and lux [S, H] of the hours."""
    folder, call = room.files.script.parent, [str(room.files.script.resolve())]
    rays = {"INDOORS": str(indoors), "OUTDOORS": str(outdoors), "MATERIALS": materials}
    if room.weather is not None:
        call.append(str(room.weather))
        rays |= {"PHASES": "5", "SUNS": str(SUNS), "STRAIGHT": str(4 * indoors)}
    subprocess.run(call, check=True, capture_output=True, env=environment() | rays)
    text = (folder / "coefficients.mtx").read_text()
    hours = None if room.weather is None else np.loadtxt(folder / "illuminance.txt")
    return np.loadtxt(text.split("\n\n", 1)[1].splitlines()), hours


def ours(room: Room, seed: int, *, even: bool = True) -> tuple[NDArray, NDArray | None]:
    """The same by our matrices; the skies are Radiance's.

    Args: even: whether a blind's through beams are even in a patch; else linear between them.
    """
    inside, outside = interior_surfaces(room.space), exterior_surfaces(room.building, room.space)
    groups, rows = window_groups(room.space), np.loadtxt(room.files.sensors)
    visible, sensors = room.blind.bands["Visible"], (rows[:, :3], rows[:, 3:])
    passed = visible.transmission_front * visible.basis_in.projected_solid_angles()

    def product(**depth: int) -> NDArray:
        view = view_matrix(inside, groups, *sensors, samples=20_000, seed=seed, **depth)
        options = {"samples": 2_000, "subdivision": 1, "seed": seed, **depth}
        daylight = daylight_matrix(outside, groups, **options)
        return np.einsum("sgk,kj,gjp->sp", view.values, passed, daylight.values)

    whole = product()
    if room.weather is None:
        return whole, None
    block = sun_scattering(visible)
    assert isinstance(block, KlemsScattering)
    block = EvenBeams(block) if even else block
    suns = direct_sun_matrix(
        inside, outside, groups, [block] * len(groups), *sensors, suns=ReinhartSky(SUNS).directions[1:], seed=seed
    ).values
    sky, direct, places = (_sky(room, options) for options in ("-m 1", "-m 1 -d", f"-m {SUNS} -5 0.533 -d"))
    return whole, whole @ sky - product(max_depth=1) @ direct + suns @ places[1:]


def _sky(room: Room, options: str) -> NDArray[np.float64]:
    """Luminance of the patches [P, H] by `gendaymtx`."""
    command = f"gendaymtx {options} days.wea | rmtxop -fa {LUX} - | getinfo -"
    return np.loadtxt(run(command, room.files.script.parent).decode().splitlines())


def main(
    file: Path,
    name: str,
    folder: Path,
    *,
    runs: int = 3,
    indoors: int = 5000,
    outdoors: int = 400,
    weather: Annotated[Path | None, "EPW; the hours of three days besides"] = None,
) -> None:
    """Print the comparison."""
    room = Room.exported(file, name, folder, weather)
    radiance = [theirs(room, indoors, outdoors) for _ in range(runs)]
    found = [ours(room, seed) for seed in range(runs)]
    a, b = (np.array([whole for whole, _ in each]) for each in (found, radiance))
    print(f"{room.space.label}: {a.shape[1]} sensors, {os.cpu_count()} cores")
    patches = np.arange(a.shape[2])
    skies = {
        "uniform, with the ground": patches >= 0,
        "half of the patches": patches % 30 < 15,
        "the other half": patches % 30 >= 15,
        "the ground alone": patches == 0,
    }
    for label, sky in skies.items():
        _print(label, a @ sky.astype(float), b @ sky.astype(float))
    if room.weather is not None:
        a, b = (np.array([hours for _, hours in each]) for each in (found, radiance))
        bright = b.mean(axis=0) > LEAST
        _print(f"{bright.sum()} sensor-hours by five phases", a[:, bright], b[:, bright])
        linear = np.array([ours(room, seed, even=False)[1] for seed in range(runs)])
        _print("the same, beams between patches", linear[:, bright], b[:, bright])
    rays = indoors, outdoors
    coloured = [theirs(room, *rays, materials="materials.rad") for _ in range(runs)]
    b = np.array([whole.sum(axis=1) for whole, _ in coloured])
    _print("uniform, in colours", np.array([whole.sum(axis=1) for whole, _ in found]), b)


def _print(name: str, a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """A line of the table; a: ours, b: Radiance's [runs, n]."""
    difference = _rms(a.mean(axis=0) / b.mean(axis=0) - 1)
    noises = [_rms(x.std(axis=0, ddof=1) / x.mean(axis=0)) / len(x) ** 0.5 for x in (a, b)]
    ratio = a.mean(axis=0).sum() / b.mean(axis=0).sum()
    print(f"| {name} | {100 * difference:.2f} % | {100 * noises[1]:.2f} % | {100 * noises[0]:.2f} % | {ratio:.4f} |")


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
