"""A tree's crown as leaves: triangles at random in its hull, as many as pass the stated share.

Leaves of all directions that stand at random let a beam through by Beer's law along its path,

    exp(-k c),    k = n a G / V,    G = 1/2

with n leaves of area a in the volume V, c the length of the path in the crown, G the projected
share of a leaf (the mean over all directions, whatever the beam's).  The attenuation k of a month
is that whose mean over the crown's shadow, the beam level, is the month's transmittance.  Every
leaf stands in all months that have more leaves, so that a few layers of them make the year.

Source: Nilson 1971, doi:10.1016/0002-1571(71)90092-6, for the law and the random (Poisson) crown.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bim.defaults import TREE_LAYER
from bim.model import Element
from bim.rays import RayMesh, ray_mesh
from bim.shell import enclosed_volume
from bim.surroundings.objects import SurroundingObject
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import even_numbers

FloatArray = NDArray[np.float64]
# Leaves of broadleaf deciduous trees, visible 0.10 and near infrared 0.45: Oleson et al. 2013,
# "Technical description of version 4.5 of the Community Land Model", NCAR/TN-503, Table 3.1; half
# of the sun's energy is near infrared.  What leaves let through themselves (0.05, 0.25) is left out
REFLECTANCE_VISIBLE, REFLECTANCE_SOLAR = 0.10, 0.28
PROJECTED = 0.5  # share of a leaf's area that a beam sees, the mean over its directions
LEAVES, FEWEST = 4096, 256  # of a crown in the month that has most, by its distance
NEAR = 30.0  # up to which a crown has all of these [m]
BEAMS = 4096  # parallel rays whose paths in the crown are measured, from either side
MOST_FACES = 64  # that a ray may cross
TRIES = 200  # draws of points for the leaves


def crown_elements(
    crown: SurroundingObject, transmittance: Sequence[float], guid: str, distance: float
) -> list[Element]:
    """The leaves of a crown as elements, each of the months in which it stands.

    Args:
        crown: a closed mesh [m].
        transmittance: [12] mean of a level beam over the crown's shadow.
        distance: from the building [m]; far crowns have fewer and bigger leaves.

    Raises: `DataError` for a mesh that is not closed.
    """
    mesh = ray_mesh(crown.triangles)
    attenuation = np.array(_attenuations(mesh, crown.name, transmittance))
    if not attenuation.any():
        return []
    volume = abs(enclosed_volume(crown.triangles))
    most = int(np.clip(LEAVES * (NEAR / max(distance, NEAR)) ** 2, FEWEST, LEAVES))
    area = attenuation.max() * volume / (PROJECTED * most)
    counts = np.rint(most * attenuation / attenuation.max()).astype(int)
    leaves = _leaves(mesh, most, area, zlib.crc32(guid.encode()))
    found, steps = [], np.unique(np.append(counts, 0))
    for layer, (first, last) in enumerate(pairwise(steps)):
        months = tuple((np.flatnonzero(counts >= last) + 1).tolist())
        found.append(
            Element(
                f"{guid}-{layer}", crown.name, crown.ifc_class, leaves[first:last],
                REFLECTANCE_VISIBLE, REFLECTANCE_SOLAR, layer=TREE_LAYER,
                months=() if len(months) == 12 else months,
            )
        )  # fmt: skip
    return found


def _attenuations(mesh: RayMesh, name: str, transmittance: Sequence[float]) -> list[float]:
    """k [1/m] of each transmittance: exp(-k c) is that in the mean over level paths c."""
    paths = np.concatenate([_paths(mesh, axis) for axis in (0, 1)])
    if not len(paths) or not np.isfinite(paths).all():
        raise DataError(f"{name}: is no closed mesh: a crown needs an inside")

    def solved(value: float) -> float:
        if value >= 1:
            return 0.0
        dense = 1e3 / paths.mean()
        return float(brentq(lambda k: np.exp(-k * paths).mean() - value, 0.0, dense))

    known = {value: solved(value) for value in set(transmittance)}
    return [known[value] for value in transmittance]


def _paths(mesh: RayMesh, axis: int) -> FloatArray:
    """Lengths [n] [m] of rays along an axis inside a mesh, those that miss it left out.

    Infinite where more rays than a few get in and not out.
    """
    corners = mesh.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    others = [i for i in range(3) if i != axis]
    origins = np.empty((BEAMS, 3))
    origins[:, others] = low[others] + even_numbers(BEAMS) * (high - low)[others]
    origins[:, axis] = low[axis] - 1.0
    lengths, crossings = _inside(mesh, origins, np.eye(3)[axis])
    odd = crossings % 2 == 1  # through an edge or a corner
    if odd.mean() > 0.01:
        return np.array([np.inf])
    return lengths[(crossings > 0) & ~odd]


def _inside(
    mesh: RayMesh, origins: FloatArray, direction: FloatArray
) -> tuple[FloatArray, NDArray[np.int64]]:
    """How far [n] rays go inside a closed mesh [m], and how often [n] they cross it."""
    rays = np.broadcast_to(direction, origins.shape)
    t, lengths = np.zeros(len(origins)), np.zeros(len(origins))
    crossings = np.zeros(len(origins), dtype=np.int64)
    for _ in range(MOST_FACES):
        step, triangle = mesh.first_hits(origins + t[:, None] * direction, rays)
        met = triangle >= 0
        if not met.any():
            break
        step = np.where(met, step, 0.0)
        lengths += np.where(met & (crossings % 2 == 1), step + 1e-5, 0.0)
        crossings += met
        t += step + 1e-5
    return lengths, crossings


def _leaves(mesh: RayMesh, count: int, area: float, seed: int) -> FloatArray:
    """Equilateral triangles [count, 3, 3] of an area [m2], anywhere inside, turned any way."""
    rng = np.random.default_rng(seed)
    corners = mesh.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    points = np.empty((0, 3))
    for _ in range(TRIES):
        drawn = rng.uniform(low, high, (2 * count, 3))
        inside = _inside(mesh, drawn, np.array([1.0, 0.0, 0.0]))[1] % 2 == 1
        points = np.concatenate([points, drawn[inside]])
        if len(points) >= count:
            break
    points = points[:count]
    towards = rng.standard_normal((len(points), 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    along = np.cross(towards, rng.standard_normal((len(points), 3)))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(towards, along)
    radius = np.sqrt(4 * area / (3 * np.sqrt(3)))  # of the circle through the corners
    angles = 2 * np.pi / 3 * np.arange(3)
    steps = np.cos(angles)[:, None] * along[:, None] + np.sin(angles)[:, None] * across[:, None]
    return points[:, None] + radius * steps
