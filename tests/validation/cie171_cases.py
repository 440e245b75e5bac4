"""CIE 171:2006, tests 5.9 to 5.14: room, openings, sensors, and their light by quadrature."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from tests.validation.cie171_quadrature import (
    Array,
    Opening,
    Overhang,
    Wall,
    horizontal_illuminance,
    pane_transmittance,
    sensor_light,
    sky_luminance,
)

WIDTH, DEPTH, HEIGHT = 4.0, 4.0, 3.0  # [m]
GROUND = 0.3  # reflectance, of the shelf too
GLASS = 0.88  # transmittance of the pane at normal incidence
SKIES = (1, 5, 8, 12, 16)
SUN = np.array([0.0, 0.5, np.sqrt(0.75)])  # 60 degrees high, in the plane of symmetry
GRAZING = 75.0  # [degrees] incidence from which a sensor's light counts as grazing
WIDE = 40.0  # [m] of what has no end; more makes the tracer's offsets from surfaces larger
AWAY = 6.0  # [m] from the facade to the wall outdoors
ROWS = 25  # heights of that wall with a luminance; linear between them
LOW, HIGH = 0.25, 2.75  # [m] of the lowest and the highest sensor on a wall
UP, DOWN, INTO = ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True, slots=True)
class Case:
    """One opening of a test, with what stands before it and its sensors."""

    name: str  # as in the table of the report's figures
    opening: Opening
    glass: bool = False
    shelf: float | None = None  # [m] depth of the overhang
    wall: float | None = None  # [m] height of the wall outdoors
    points: Array = field(default_factory=lambda: np.empty((0, 3)))  # [S, 3]
    normals: Array = field(default_factory=lambda: np.empty((0, 3)))  # [S, 3]

    @property
    def label(self) -> str:
        """The name, with the parameter that it has."""
        return self.name if self.parameter is None else f"{self.name} of {self.parameter:g} m"

    @property
    def parameter(self) -> float | None:
        """What the report varies in the test [m]."""
        return self.wall if self.shelf is None else self.shelf

    @property
    def overhang(self) -> Overhang | None:
        """What hangs over the opening."""
        return None if self.shelf is None else Overhang(DEPTH, HEIGHT, self.shelf, GROUND)

    def group(self) -> WindowGroup:
        """The opening as the tracer takes it."""
        a, right, up = (np.array(v) for v in self._sides())
        corners = a, a + right, a + right + up, a + up
        triangles = np.array([[corners[i] for i in t] for t in ((0, 1, 2), (0, 2, 3))])
        return WindowGroup("opening", (WindowSurface("opening", triangles),))

    def exterior(self) -> Surfaces:
        """The black facade with the shelf or the wall before it; nothing in the other tests."""
        if self.parameter is None:
            return Surfaces.none()
        left, right = -WIDE, WIDE + WIDTH
        sill, top = self.opening.corner[2], self.opening.corner[2] + self.opening.up[2]
        near, far = self.opening.corner[0] + self.opening.right[0], self.opening.corner[0]
        walls = [(left, right, 0, sill), (left, right, top, HEIGHT)]
        walls += [(left, near, sill, top), (far, right, sill, top)]
        quads = [[(a, DEPTH, low), (b, DEPTH, low), (b, DEPTH, high), (a, DEPTH, high)] for a, b, low, high in walls]
        if self.shelf is not None:
            around = _around(left, right, DEPTH, DEPTH + self.shelf)
            quads.append([(x, y, HEIGHT) for x, y in around])
        if self.wall is not None:
            around = _around(left, right, 0.0, self.wall)
            quads.append([(x, DEPTH + AWAY, z) for x, z in around])
        triangles = np.array([[q[i] for i in t] for q in quads for t in ((0, 1, 2), (0, 2, 3))])
        surface = np.repeat(np.arange(len(quads)), 2)
        reflectance = np.where(surface == len(quads) - 1, GROUND, 0.0)
        return Surfaces(triangles.astype(float), reflectance, surface)

    def grazing(self) -> Array:
        """Whether the opening's middle is seen at grazing incidence, by sensor [S]."""
        o = self.opening
        middle = np.array(o.corner) + 0.5 * (np.array(o.right) + np.array(o.up))
        way = middle - self.points
        cosine = way @ o.normal / np.linalg.norm(way, axis=1)
        return np.degrees(np.arccos(cosine)) > GRAZING

    def quadrature(self, kind: int) -> Array:
        """Illuminance of the sensors [S] in per cent of that of the ground outdoors."""
        whole, shelf = ground_light(kind), self.overhang
        tau = (lambda cosine: pane_transmittance(cosine, GLASS)) if self.glass else None
        wall = None if self.wall is None else _wall_light(kind, self.wall)
        found = []
        for point, normal in zip(self.points, self.normals, strict=True):

            def outdoors(way: Array, point: Array = point) -> Array:
                sky = sky_luminance(kind, way, SUN) / whole
                luminance = np.where(way[..., 2] > 0, sky, GROUND / np.pi)
                if wall is not None:
                    height = point[2] + way[..., 2] / way[..., 1] * (DEPTH + AWAY - point[1])
                    on_it = (height >= 0) & (height <= wall[0][-1])
                    return np.where(on_it, np.interp(height, *wall), luminance)
                if shelf is None:
                    return luminance
                rise = np.maximum(way[..., 2], 1e-9)
                out = point[1] + way[..., 1] / rise * (shelf.height - point[2]) - shelf.facade
                hidden = (way[..., 2] > 0) & (out <= shelf.depth)
                return np.where(hidden, shelf.luminance(out) * GROUND / np.pi, luminance)

            edges = self._edges(point)
            found.append(sensor_light(point, normal, self.opening, outdoors, tau, edges))
        return 100 * np.array(found)

    def _sides(self) -> tuple[Array, Array, Array]:
        o = self.opening
        return np.array(o.corner), np.array(o.right), np.array(o.up)

    def _edges(self, point: Array) -> tuple[float, ...]:
        """Where horizon, shelf and wall end in the opening, as shares of its height."""
        o = self.opening
        if o.up[2] == 0:
            return ()
        heights = [point[2]]
        if self.shelf is not None:
            to_edge = DEPTH + self.shelf - point[1]
            rise = (DEPTH - point[1]) / to_edge * (HEIGHT - point[2])
            heights.append(point[2] + rise)
        if self.wall is not None:
            slope = (self.wall - point[2]) / (DEPTH + AWAY - point[1])
            heights.append(point[2] + slope * (DEPTH - point[1]))
        return tuple(float((z - o.corner[2]) / o.up[2]) for z in heights)


def _around(left: float, right: float, low: float, high: float) -> list[tuple[float, float]]:
    return [(left, low), (right, low), (right, high), (left, high)]


def cases() -> list[Case]:
    """Tests 5.9 to 5.14 with all their sensors."""
    heights, depths = np.arange(HIGH, 0, -0.5), np.arange(0.25, DEPTH, 0.5)
    wall = [((2.0, 0.0, z), INTO) for z in heights]
    floor = [((2.0, y, 0.0), UP) for y in depths]
    ceiling = [((2.0, y, HEIGHT), DOWN) for y in depths]
    found = []
    for size in (1, 4):
        low = 2 - size / 2
        hole = Opening((low, low, HEIGHT), (size, 0, 0), (0, size, 0))
        for number, glass in (("5.9", False), ("5.10", True)):
            name = f"{number} roof opening {size}x{size}{', glass' * glass}"
            found.append(_case(name, hole, wall + floor, glass))
    for width, height, sill in ((2, 1, 1), (4, 3, 0)):
        hole = Opening((2 + width / 2, DEPTH, sill), (-width, 0, 0), (0, 0, height))
        for number, glass in (("5.11", False), ("5.12", True)):
            name = f"{number} facade opening {width}x{height}{', glass' * glass}"
            found.append(_case(name, hole, wall + floor + ceiling, glass))
    hole = Opening((3, DEPTH, 1), (-2, 0, 0), (0, 0, 1))
    for depth in (0.5, 2.0):
        found.append(_case("5.13 facade 2x1, overhang", hole, floor, shelf=depth))
    for high in (3.0, 6.0, 9.0):
        found.append(_case("5.14 facade 2x1, wall 6 m away, height", hole, floor, wall=high))
    return sorted(found, key=lambda case: [int(n) for n in case.name.split()[0].split(".")])


@cache
def ground_light(kind: int) -> float:
    """Illuminance of the ground outdoors by a sky, for a zenith of 1."""
    return horizontal_illuminance(kind, SUN)


@cache
def _wall_light(kind: int, height: float) -> tuple[Array, Array]:
    """Heights [m] and luminances of the wall outdoors, for an illuminance of 1 on the ground."""
    heights = np.linspace(0.0, height, ROWS)
    wall = Wall(HEIGHT, AWAY, GROUND)
    return heights, wall.luminance(kind, SUN, GROUND, heights)


def _case(
    name: str,
    hole: Opening,
    sensors: list,
    glass: bool = False,
    *,
    shelf: float | None = None,
    wall: float | None = None,
) -> Case:
    points, normals = (np.array([s[i] for s in sensors], dtype=float) for i in (0, 1))
    return Case(name, hole, glass, shelf, wall, points, normals)


def cie_sky(subdivision: int) -> AnnualSky:
    """The five skies as hours, for 100 lx on the ground outdoors."""
    patches = ReinhartSky(subdivision)
    whole = np.stack([cie_patches(k, patches, 100.0, sun=SUN, ground_reflectance=GROUND) for k in SKIES], axis=1)
    count = len(SKIES)
    return AnnualSky(whole, np.tile(SUN, (count, 1)), np.zeros(count), np.arange(count), count, 0 * whole)


def reported(file: Path) -> Iterator[tuple[str, float | None, int, Array]]:
    """Name, parameter, sky and values [per cent] of the rows of the report's figures."""
    with open(file, encoding="utf-8") as lines:
        for row in list(csv.reader(lines, delimiter="\t"))[1:]:
            if row[2] != "any":
                values = np.array([float(v) for v in row[3:] if v])
                yield row[0], float(row[1]) if row[1] else None, int(row[2]), values
