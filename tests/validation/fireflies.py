r"""Fireflies: pixels of five-phase pictures that shine above what path-traced pictures show there.

    python -m tests.validation fireflies --weather CITY.epw \
        [--ifc HOUSE.ifc [--space NAME]] [--geneva FOLDER] [--hours 67] [--size 160] [--json FILE]

Random hours of a year in which the sun's beam falls on a window, of up to three scenes behind clear
glass: a box under an overhang with sunlit ground and a house across the street; a room of an IFC
file; the Geneva office of raytraverse.  Each pixel is held against the brightest of its 3 x 3
neighbourhood in a picture by paths with twice as many pixels across, both without the sun's disc.
A pixel is a firefly above 1.5 times that.  The pixels of a picture by paths share what varies
slowly, which is wrong in corners: what comes near the limit is looked at again, and once more, by
paths of each pixel's own.

    python -m tests.validation fireflies --weather CITY.epw --walls

What the side wall of the box has straight from its window, by the window's Klems patches as in the
pictures, over the same point by point, at distances from the window's plane and heights.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import bim
import mitsuba_cfs as cfs
from bim.building_file import chosen_spaces
from bim.sensors import view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.methods.coefficients import group_coefficients
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.methods.point_in_time import path_picture
from scenes.cost import room as box
from scenes.input_files import read_building
from tests.validation import geneva_scene as geneva

LIMIT = 1.5  # times the brightest of the neighbourhood
FINER = 2  # times as many pixels across in the pictures by paths
# ratio above which pixels have paths of their own; how many
LOOKS = ((1.15, 256), (1.3, 2048), (1.4, 16384))
LEAST_BEAM = 5000.0  # [lx] normal to the sun, of the hours that are drawn
BRIGHT = 2000.0  # [cd/m2] evalglare's threshold
DARK = 0.1  # [cd/m2] below it nothing shines
DISTANCES, HEIGHTS = (0.05, 0.15, 0.3, 0.6, 1.5), (0.5, 1.2, 2.2)  # of the wall's points [m]
WALL_HOURS = 6
GLASS = [0.0, 0.6, 0.6, 0.6, 0.6]  # transmittance at even steps of the cosine


@dataclass(frozen=True, slots=True)
class LitScene:
    """A scene, what fills its windows, and the sky of each hour that is drawn."""

    name: str
    scene: cfs.DaylightScene
    systems: list[list[cfs.AngularOptics]]
    sky_of: Callable[[NDArray[np.int64] | None], cfs.AnnualSky]  # None: all with the sun up

    def drawn(self, hours: int, seed: int) -> cfs.AnnualSky:
        """The skies of random hours in which the beam falls on a window."""
        whole = self.sky_of(None)
        normals = [group.frame[2] for group in self.scene.groups]
        before = np.any([whole.direction @ n > 0.05 for n in normals], axis=0)
        shining = np.flatnonzero(before & (whole.illuminance > LEAST_BEAM))
        chosen = np.random.default_rng(seed).permutation(shining)[:hours]
        return self.sky_of(whole.lit[np.sort(chosen)])


@dataclass(frozen=True, slots=True)
class Found:
    """One scene's hours."""

    worst: NDArray[np.float64]  # [H] the largest ratio of each
    beyond: NDArray[np.int64]  # [H] pixels above the limit
    bright: NDArray[np.int64]  # [H] of these, the ones that evalglare might take for a source
    pixels: int  # in all hours together
    looked: NDArray[np.int64]  # [H] pixels held against paths of their own
    noise: NDArray[np.float64]  # [H] of the brightest around these, its mean

    def line(self) -> str:
        """The row of the table."""
        return (
            f"{len(self.worst)} hours, {self.pixels:,} pixels | worst {self.worst.max():.2f} | "
            f"{self.beyond.sum()} beyond {LIMIT} in {(self.beyond > 0).sum()} hours, "
            f"{self.bright.sum()} of them above {BRIGHT:.0f} cd/m2 | "
            f"{self.looked.sum()} by paths of their own, "
            f"noise of the brightest around {100 * self.noise.mean():.1f} %"
        )


def overhang(weather: cfs.Weather, size: int) -> LitScene:
    """A box whose window has an overhang, sunlit ground and a house across the street before it."""
    outdoors = [
        (0.2, [(-9, -9, -0.5), (12, -9, -0.5), (12, -0.2, -0.5), (-9, -0.2, -0.5)]),
        (0.5, [(-9, -9, -0.5), (-9, -9, 4), (12, -9, 4), (12, -9, -0.5)]),
        (0.6, [(0, -1, 2.8), (0, 0, 2.8), (box.WIDTH, 0, 2.8), (box.WIDTH, -1, 2.8)]),
        (0.1, [(-9, 0.02, -0.5), (12, 0.02, -0.5), (12, 0.02, 4), (-9, 0.02, 4)]),
    ]
    quads = [np.array([[a, b, c], [a, c, d]], float) for _, (a, b, c, d) in outdoors]
    rho = np.repeat([rho for rho, _ in outdoors], 2)
    exterior = cfs.Surfaces(np.concatenate(quads), rho, np.repeat(np.arange(len(quads)), 2))
    view = cfs.fisheye((1.8, 1.0, 1.5), (0.0, -1.0, 0.0), size)
    scene = cfs.DaylightScene(box.room(), exterior, box.window_groups(), view=view)
    return LitScene("box under an overhang", scene, [[glass()]], _year(weather))


def ifc_room(file: Path, space: str | None, weather: cfs.Weather, size: int) -> LitScene:
    """A room of an IFC file, seen from its middle to its window."""
    building = read_building(file)
    found = chosen_spaces(building, () if space is None else (space,), file)[0]
    groups = window_groups(found)
    scene = cfs.DaylightScene(
        interior_surfaces(found, "visible"),
        exterior_surfaces(building, found, "visible"),
        groups,
        view=cfs.fisheye(*view_point(found, 1.2), size),
    )
    return LitScene(f"{file.stem}, {found.label}", scene, [[glass()]] * len(groups), _year(weather))


def office(folder: Path, size: int) -> LitScene:
    """The Geneva office, its first view."""
    solid = bim.opaque_surfaces(geneva.scene(folder, "01_glz"))
    groups, systems = geneva.window_groups(folder, "01_glz")
    scene = cfs.DaylightScene(solid, solid, groups, view=geneva.view(folder, 1, size))

    def sky_of(hours: NDArray[np.int64] | None) -> cfs.AnnualSky:
        all_hours = geneva.reference(folder, "01_glz", 1).hour
        return geneva.sky(folder, all_hours if hours is None else hours)

    return LitScene("Geneva office", scene, systems, sky_of)


def glass() -> cfs.AngularOptics:
    """Clear glass."""
    return cfs.AngularOptics(GLASS)


def _year(weather: cfs.Weather) -> Callable[[NDArray[np.int64] | None], cfs.AnnualSky]:
    return lambda hours: cfs.annual_sky(weather, hours=hours)


def held(lit: LitScene, hours: int, *, samples: int, seed: int = 0) -> Found:
    """Hold five-phase pictures of random hours against those by paths."""
    sky, view = lit.drawn(hours, seed), lit.scene.view
    light = cfs.phase_light(cfs.phase_matrices(lit.scene), lit.systems, sky)
    finer = replace(view, width=FINER * view.width, height=FINER * view.height)
    paths = cfs.PathLight(replace(lit.scene, view=finer), lit.systems, sky)
    pictures = pictures_in_state(light, np.arange(len(sky.lit)), [0] * len(lit.systems))
    found = []
    for hour in range(len(sky.lit)):
        values = pictures.without_disc(np.array([hour]))[0][0]
        ours = full_picture(values, pictures.pixels, view)
        first = path_picture(paths, hour, disc=False, samples=samples, seed=seed)
        ratio, count, noise = _ratio(ours, brightest(first)), 0, 0.0
        for i, (least, more) in enumerate(LOOKS):
            again = np.flatnonzero(ratio > least)
            if len(again):
                around, off = looked_at(paths, hour, again, samples=more, seed=2 * seed + i)
                ratio.flat[again] = _ratio(ours.flat[again], around)
                count, noise = max(count, len(again)), float((off / around).mean())
        beyond = ratio > LIMIT
        bright = int((ours[beyond] > BRIGHT).sum())
        found.append((float(ratio.max()), int(beyond.sum()), bright, count, noise))
        where = [divmod(int(i), view.width) for i in np.flatnonzero(beyond)]
        print(f"{lit.name} hour {sky.lit[hour]}: {found[-1]} {where}", file=sys.stderr, flush=True)
    worst, over, bright, looked, noise = map(np.array, zip(*found, strict=True))
    count = len(pictures.pixels) * len(sky.lit)
    return Found(worst, over, bright, count, looked, noise)


def _ratio(ours: NDArray[np.float64], around: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of what shines to the brightest around it."""
    return np.where(ours > DARK, ours / np.maximum(around, DARK), 0.0)


def looked_at(
    paths: cfs.PathLight, hour: int, pixels: NDArray[np.int64], *, samples: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The brightest of the finer pixels around some pixels [n], each by its own paths; its noise.

    One half of the paths says which is the brightest, the other how bright it is: the largest of
    many noisy values would be too large.
    """
    width = paths.scene.eye.width
    row, column = np.divmod(pixels, width // FINER)
    down, across = np.divmod(np.arange((3 * FINER) ** 2), 3 * FINER)
    down, across = (FINER * a[:, None] + b - FINER for a, b in ((row, down), (column, across)))
    around = np.clip(down, 0, width - 1) * width + np.clip(across, 0, width - 1)
    options = {"samples": samples // 2, "tile": 1, "pixels": np.unique(around), "disc": False}
    halves = [path_picture(paths, hour, seed=1000 + 2 * seed + i, **options) for i in range(2)]
    first, second = (half.ravel()[around] for half in halves)
    every = np.arange(len(pixels))
    of_first, of_second = first[every, second.argmax(axis=1)], second[every, first.argmax(axis=1)]
    return (of_first + of_second) / 2, np.abs(of_first - of_second) / 2


def brightest(finer: NDArray[np.float64]) -> NDArray[np.float64]:
    """The largest of the finer pixels in the 3 x 3 neighbourhood of each pixel [ny, nx]."""
    ny, nx = (n // FINER for n in finer.shape)
    largest = finer.reshape(ny, FINER, nx, FINER).max(axis=(1, 3))
    around = [np.roll(largest, (j, i), (0, 1)) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    return np.max(around, axis=0)


def beside_window(lit: LitScene, hours: int) -> Iterator[str]:
    """Direct light by patches over that point by point, least to most of some hours: table rows."""
    points = np.array([[1e-3, y, z] for y in DISTANCES for z in HEIGHTS])
    around = lit.scene.interior, lit.scene.exterior, lit.scene.groups
    scene = cfs.DaylightScene(*around, points, np.tile([1.0, 0, 0], (len(points), 1)))
    chosen = cfs.Sampling(patch_samples=4096, sensor_samples=16384, window_parts=1)
    sky = lit.drawn(hours, 0)
    matrices = cfs.phase_matrices(scene, chosen)
    ((group,),) = group_coefficients(matrices, lit.systems)
    exact = group.straight.values.values
    patches = (matrices.direct_sensors[:, 0] * group.beam) @ matrices.daylight.values[0]
    ratio = (patches @ sky.without_sun()) / (exact @ sky.without_sun())
    for row, y in zip(ratio.reshape(len(DISTANCES), len(HEIGHTS), -1), DISTANCES, strict=True):
        yield f"| {y} | " + " | ".join(f"{r.min():.2f} to {r.max():.2f}" for r in row) + " |"


def main(
    *,
    weather: Path,
    ifc: Path | None = None,
    space: str | None = None,
    geneva_: Path | None = None,
    hours: Annotated[int, "of each scene"] = 67,
    size: Annotated[int, "[px]"] = 160,
    samples: Annotated[int, "of each pixel by paths, shared"] = 16,
    seed: int = 0,
    json_: Path | None = None,
    walls: Annotated[bool, "the wall beside the box's window"] = False,
) -> None:
    """Hold the scenes that files are given for, and print the table."""
    weather = cfs.read_epw(weather)
    if walls:
        print("\n".join(beside_window(overhang(weather, size), WALL_HOURS)))
        return
    scenes = [overhang(weather, size)]
    if ifc:
        scenes.append(ifc_room(ifc, space, weather, size))
    if geneva_:
        scenes.append(office(geneva_, size))
    rows = {}
    for lit in scenes:
        found = held(lit, hours, samples=samples, seed=seed)
        rows[lit.name] = {name: getattr(found, name).tolist() for name in ("worst", "beyond", "bright", "looked")}
        print(f"| {lit.name} | {found.line()} |", flush=True)
    if json_:
        json_.write_text(json.dumps(rows))
