"""A BSDF between the directions that a goniophotometer measured.

Outgoing light: linear in the triangles that the measured directions form on the disk of direction
cosines, the nearest value beyond them.  Incident light: the three measured directions round the
one asked for by azimuth and radius (the two next to it where the sample looks the same turned),
each pattern moved on
the disk by as much as what goes straight on, and a mirror's reflection, moves from the one to the
other.  A move on that disk keeps the flux; what leaves it is made up for, as each incident
direction sends on the share that lies linearly between those measured.

The measured azimuths say what symmetry is taken, as in Radiance's `pabopto2bsdf`: one is an
isotropic sample, a quarter or half of them one that looks the same in a mirror.

Source: Ward, Kurt and Bonneel 2014, "Reducing anisotropic BSDF measurement to common practice",
Workshop on Material Appearance Modeling, for the task and the symmetries; they carry patterns
over by optimal transport, which follows lobes that move otherwise too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KlemsBasis
from mitsuba_cfs.bsdf.measured_file import Measurement
from mitsuba_cfs.bsdf.tensor_tree import square_to_disk
from mitsuba_cfs.errors import DataError

if TYPE_CHECKING:
    from scipy.spatial import Delaunay

FloatArray = NDArray[np.float64]
PIXELS = 256  # of a pattern's image along an axis: half a degree at normal incidence
SHARE_CELLS = 128  # along an axis, for the shares of light
POINTS = 2400  # of incident light in all patches or cells
OUTGOING = 2.5  # times as many of outgoing light: a pattern's cost is its move more than its points
SAME = 1e-6  # on the disk
MIRROR_TOLERANCE = 0.02  # of a measured direction from the mirror's plane, on the disk
NEIGHBOURS = 16  # of a fit for the noise, which has six coefficients
MEDIAN_CHI2 = 0.4549  # of one squared normal deviate
MIRRORS = {
    "isotropic": [(1, 1)],
    "anisotropic": [(1, 1)],
    "bilateral, left and right": [(1, 1), (-1, 1)],
    "bilateral, up and down": [(1, 1), (1, -1)],
    "quadrilateral": [(1, 1), (-1, 1), (1, -1), (-1, -1)],
}


@dataclass(frozen=True)
class Pattern:
    """Outgoing light of one block for one incident direction, on the disk of direction cosines."""

    path: Path  # of the first file
    incident: FloatArray  # [2] x, y of the unit vector towards the light
    outgoing: FloatArray  # [N, 2] x, y of the measured directions
    values: FloatArray  # [N, bands] BSDF [1/sr]

    @cached_property
    def image(self) -> FloatArray:
        """BSDF [bands, PIXELS, PIXELS] [1/sr] at uniform steps of y and x from -1 to 1."""
        from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
        from scipy.spatial import QhullError

        axis = np.linspace(-1, 1, PIXELS)
        y, x = np.meshgrid(axis, axis, indexing="ij")
        try:
            image = LinearNDInterpolator(self.outgoing, self.values)(x, y)
        except QhullError:
            raise DataError("the outgoing directions lie on one line", file=self.path) from None
        beyond = ~np.isfinite(image[..., 0])
        image[beyond] = NearestNDInterpolator(self.outgoing, self.values)(x[beyond], y[beyond])
        return np.moveaxis(image, -1, 0)

    def at(self, disk: FloatArray) -> FloatArray:
        """BSDF [bands, ..] [1/sr] at points [.., 2] of the plane, the rim's beyond the disk."""
        from scipy.ndimage import map_coordinates

        radius = np.maximum(np.linalg.norm(disk, axis=-1, keepdims=True), 1.0)
        pixel = np.moveaxis((disk / radius + 1) * (0.5 * (PIXELS - 1)), -1, 0)[::-1]
        return np.stack([map_coordinates(band, pixel, order=1) for band in self.image])

    @cached_property
    def share(self) -> FloatArray:
        """Share [bands] of the light that is scattered."""
        return np.pi * self.at(_disk_points(SHARE_CELLS)).mean(axis=1)

    def noise(self) -> tuple[float, float]:
        """Standard deviation of a value, relative to it, and of the share; of the last band but X.

        From the residual of each value to a quadratic fit of its neighbours: features narrower
        than a few steps of the measurement count as noise.
        """
        from scipy.spatial import cKDTree

        tree, values = cKDTree(self.outgoing), self.values[:, min(1, self.values.shape[1] - 1)]
        if len(values) <= NEIGHBOURS:
            return np.nan, np.nan
        near = tree.query(self.outgoing, NEIGHBOURS)[1]
        x, y = np.moveaxis(self.outgoing[near] - self.outgoing[:, None], -1, 0)
        scale = np.maximum(np.hypot(x, y).max(axis=1, keepdims=True), SAME)
        x, y = x / scale, y / scale
        terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
        # the first row of the pseudo-inverse is the fit at the direction itself, weight by weight
        weights = np.linalg.pinv(terms)[:, 0]
        fit = (weights * values[near]).sum(axis=1)
        own = np.where(near == np.arange(len(near))[:, None], weights, 0).sum(axis=1)
        left = (values - fit) ** 2 / np.maximum(1 - own, SAME)
        bright = fit > 0
        if not bright.any():
            return np.nan, np.nan
        relative = float(np.sqrt(np.median(left[bright] / fit[bright] ** 2) / MEDIAN_CHI2))
        nearest = tree.query(_disk_points(SHARE_CELLS))[1]
        areas = np.pi * np.bincount(nearest, minlength=len(values)) / SHARE_CELLS**2
        return relative, relative * float(np.sqrt(((areas * values) ** 2).sum()))


def _disk_points(cells: int) -> FloatArray:
    """Middles [cells^2, 2] of equal areas of the disk."""
    return square_to_disk(_even_points(cells**2))


def patterns_of(measurements: Sequence[Measurement], block: str) -> list[Pattern]:
    """The patterns of one block; those of one incident direction are put together.

    Directions that were measured several times have the mean of their values.
    """
    front, transmits = block.endswith("front"), block.startswith("transmission")
    parts: dict[tuple[float, float], list[Measurement]] = {}
    for measured in measurements:
        if (measured.incident[2] > 0) != front:
            continue
        kept = ((measured.outgoing[:, 2] > 0) == front) != transmits
        if kept.any():
            x, y = np.round(measured.incident[:2] / SAME) * SAME + 0.0
            outgoing, values = measured.outgoing[kept], measured.values[kept]
            parts.setdefault((x, y), []).append(replace(measured, outgoing=outgoing, values=values))
    patterns = []
    for incident, part in parts.items():
        outgoing = np.concatenate([measured.outgoing[:, :2] for measured in part])
        values = np.concatenate([measured.values for measured in part])
        step = np.round(outgoing / SAME)
        once, group = np.unique(step, axis=0, return_inverse=True)
        count = np.bincount(group)
        mean = [np.bincount(group, band) / count for band in values.T]
        patterns.append(Pattern(part[0].path, np.array(incident), once * SAME, np.stack(mean, axis=-1)))
    return patterns


def symmetry_of(patterns: Sequence[Pattern]) -> str:
    """The symmetry, a key of `MIRRORS`, that the azimuths of the incident light imply."""
    points = np.array([pattern.incident for pattern in patterns])
    points = points[np.hypot(*points.T) > MIRROR_TOLERANCE]
    units = points / np.linalg.norm(points, axis=1, keepdims=True)
    if not len(units) or (units @ units[0]).min() > 1 - MIRROR_TOLERANCE**2:
        return "isotropic"
    x, y = (len(set(np.sign(c[np.abs(c) > MIRROR_TOLERANCE]))) <= 1 for c in points.T)
    if x and y:
        return "quadrilateral"
    if x:
        return "bilateral, left and right"
    return "bilateral, up and down" if y else "anisotropic"


class ScatteringInterpolant:
    """BSDF of one block for any incident direction, from the patterns that were measured."""

    def __init__(self, patterns: Sequence[Pattern]) -> None:
        self.patterns, self.symmetry = list(patterns), symmetry_of(patterns)
        mirrors = np.array(MIRRORS[self.symmetry], dtype=float)
        points = np.concatenate([p.incident * mirrors for p in patterns])
        once = np.unique(np.round(points, 4) + 0.0, axis=0, return_index=True)[1]
        self.points = points[once]  # [P, 2] of incident light
        self.mirrors = np.tile(mirrors, (len(patterns), 1))[once]
        self.sources = np.repeat(np.arange(len(patterns)), len(mirrors))[once]

    def grid(self, levels: int, *, points: int = POINTS) -> FloatArray:
        """Means [bands, 2^n, 2^n, 2^n, 2^n] [1/sr] over the cells of a tensor tree of rank 4.

        Axes are those of `TensorTree`; `points` as in `matrix`.
        """
        cells = 1 << levels
        corners = np.stack(np.meshgrid(*[np.arange(cells)] * 2, indexing="ij"), -1).reshape(-1, 1, 2)
        disk_in, disk_out = (
            square_to_disk((corners + _even_points(total / cells**2)) / cells) for total in (points, OUTGOING * points)
        )
        means = self._means(disk_in, disk_out, np.full(cells**2, np.pi / cells**2))
        return means.swapaxes(1, 2).reshape(-1, cells, cells, cells, cells)

    def matrix(self, basis: KlemsBasis, *, points: int = POINTS) -> FloatArray:
        """Means [bands, K out, K in] [1/sr] over pairs of Klems patches.

        Args: points: of incident light in all patches, at least four in each; each is met by all
            points of outgoing light, so that a lobe narrower than a patch is always sampled.
        """
        disk_in, disk_out = (
            _patch_points(basis, _even_points(total / basis.size)) for total in (points, OUTGOING * points)
        )
        return self._means(disk_in, disk_out, basis.projected_solid_angles())

    def _means(self, disk_in: FloatArray, disk_out: FloatArray, areas: FloatArray) -> FloatArray:
        """Means [bands, H, G] [1/sr] over pairs of parts of the disk.

        Args: disk_in: [G, n, 2] points of each part of incident light; disk_out: [H, m, 2] of
            outgoing light; areas: [H] of these parts on the disk.
        """
        parts, count = disk_out.shape[:2]
        outgoing, each = disk_out.reshape(-1, 2), np.repeat(areas / count, count)
        total = np.zeros((self.patterns[0].values.shape[1], parts, len(disk_in)))
        for number, inside in enumerate(disk_in):
            for point in inside:
                value = self._pattern_at(point, outgoing, each)
                total[:, :, number] += value.reshape(-1, parts, count).mean(axis=-1)
        return np.maximum(total / disk_in.shape[1], 0.0)

    def _pattern_at(self, disk_in: FloatArray, disk_out: FloatArray, areas: FloatArray) -> FloatArray:
        """BSDF [bands, N] [1/sr] for one incident direction, scaled to its share of light.

        `disk_in` [2] and `disk_out` [N, 2] in the axes of trees and Klems bases; `areas` [N] of
        the disk that each point represents.
        """
        incident, outgoing = disk_in * [1.0, -1.0], disk_out * [-1.0, 1.0]
        value: FloatArray = np.zeros((self.patterns[0].values.shape[1], len(outgoing)))
        share = np.zeros(len(value))
        for pattern, weight, turn in self._neighbours(incident):
            moved = outgoing + incident - turn @ pattern.incident
            value += weight * pattern.at(moved @ turn)
            share += weight * pattern.share
        sampled = value @ areas
        return value * np.divide(share, sampled, out=np.ones_like(share), where=sampled > 0)[:, None]

    def _neighbours(self, incident: FloatArray) -> list[tuple[Pattern, float, FloatArray]]:
        """Patterns to mix for a point [2] of the disk: each with its weight and turn [2, 2]."""
        if self.symmetry == "isotropic":
            return self._turned(incident)
        corners, weights = self._corners(incident)
        return [
            (self.patterns[self.sources[c]], float(w), np.diag(self.mirrors[c]))
            for c, w in zip(corners, weights, strict=True)
            if w > 0
        ]

    def _turned(self, incident: FloatArray) -> list[tuple[Pattern, float, FloatArray]]:
        """The two patterns next in polar angle, turned to the azimuth of the light."""
        radii = np.hypot(*self.points.T)
        order = np.argsort(radii)
        place = np.interp(np.hypot(*incident), radii[order], np.arange(len(order)))
        low, rest = int(place), place - int(place)
        chosen = [(order[low], 1 - rest)] + ([(order[low + 1], rest)] if rest > 0 else [])
        azimuth = np.arctan2(incident[1], incident[0])
        widest = self.points[order[-1]]  # normal incidence has no azimuth: the others' is its own
        turned = []
        for index, weight in chosen:
            turn = azimuth - np.arctan2(widest[1], widest[0])
            matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
            turned.append((self.patterns[self.sources[index]], float(weight), matrix))
        return turned

    def _corners(self, point: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """The measured points round a point of the disk and their weights; the rim's beyond it."""
        triangles, numbers = self._triangles
        place = np.array([np.arctan2(point[1], point[0]), np.hypot(*point)])
        place[1] = np.clip(place[1], *self._radii)
        simplex = int(triangles.find_simplex(place))
        if simplex >= 0:
            affine = triangles.transform[simplex]
            two = affine[:2] @ (place - affine[2])
            return numbers[triangles.simplices[simplex]], np.append(two, 1 - two.sum())
        edges = triangles.convex_hull
        a, b = triangles.points[edges[:, 0]], triangles.points[edges[:, 1]]
        along = ((place - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
        along = np.clip(along, 0, 1)
        nearest = np.argmin(np.linalg.norm(a + along[:, None] * (b - a) - place, axis=-1))
        return numbers[edges[nearest]], np.array([1 - along[nearest], along[nearest]])

    @property
    def _radii(self) -> tuple[float, float]:
        radii = np.hypot(*self.points.T)
        return float(radii.min()), float(radii.max())

    @cached_property
    def _triangles(self) -> tuple[Delaunay, NDArray[np.int64]]:
        """Triangles of azimuth and radius, all round and a turn more; the measured point of each.

        On the disk itself triangles of a few azimuths would leave out what lies between these near
        the rim.  Normal incidence is repeated at each azimuth of the others.
        """
        from scipy.spatial import Delaunay, QhullError

        radii, azimuths = np.hypot(*self.points.T), np.arctan2(*self.points.T[::-1])
        tilted = np.flatnonzero(radii > SAME)
        numbers, places = tilted, np.stack([azimuths, radii], axis=-1)[tilted]
        for upright in np.flatnonzero(radii <= SAME):
            around = np.unique(azimuths[tilted].round(6))
            numbers = np.append(numbers, np.full(len(around), upright))
            places = np.concatenate([places, np.stack([around, np.zeros(len(around))], axis=-1)])
        turns = [places + np.array([turn, 0.0]) for turn in (-2 * np.pi, 0.0, 2 * np.pi)]
        try:
            if len(np.unique(azimuths[tilted].round(6))) < 2:
                raise QhullError
            return Delaunay(np.concatenate(turns)), np.tile(numbers, 3)
        except QhullError:
            raise DataError(
                f"{len(self.patterns)} incident directions on one line: measure other azimuths",
                file=self.patterns[0].path,
            ) from None


def _even_points(count: float) -> FloatArray:
    """Points [n^2, 2] of the unit square, about `count` and at least four."""
    side = max(2, round(np.sqrt(count)))
    axis = (np.arange(side) + 0.5) / side
    return np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)


def _patch_points(basis: KlemsBasis, square: FloatArray) -> FloatArray:
    """Points [K, n, 2] on the disk of each patch, uniform in its area, of points [n, 2] in 0..1."""
    theta, phi = basis.angles_within(np.arange(basis.size)[:, None], *square.T)
    return np.sin(theta)[..., None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
