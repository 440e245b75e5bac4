"""View factors of a room's surfaces, among each other and from a person, by tracing rays."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.surfaces import Surfaces, points_on_triangles
from mitsuba_cfs.trace.kernels.sampling import vectors
from mitsuba_cfs.trace.kernels.scene import SceneCache

FloatArray = NDArray[np.float64]
ROOT = 1.1673039782614187  # of x^5 = x + 1
# Projected area factors of a seated person: ahead and behind, to the sides, up and down (ISO 7726)
SEATED = (0.30, 0.30, 0.22, 0.22, 0.18, 0.18)


def view_factors(surfaces: Surfaces, *, samples: int = 16384, seed: int = 0) -> FloatArray:
    """View factors F [N, N]: share of the diffuse radiation of surface i that reaches surface j.

    Args:
        surfaces: every part of the enclosure, windows included, its triangles counter-clockwise
            seen from outside the room; `surfaces.surface` numbers the N parts.
        samples: rays from each part, rounded up to a power of two; the error of a factor is below
            sqrt(F (1 - F) / samples).

    Returns: [N, N]; a row sums to 1 in a closed room, to less where rays leave through a gap.
    """
    N = int(surfaces.surface.max()) + 1
    plan = _Plan(samples, seed)
    origins, directions = [], []
    for i in range(N):
        corners = surfaces.triangles[surfaces.surface == i]
        if not len(corners):
            raise ValueError(f"surface {i} of {N} has no triangle")
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        u = plan.numbers(i)
        points, chosen = points_on_triangles(corners, u)
        origins.append(points)
        frames = np.stack([window_frame(-n) for n in normal])
        directions.append(_cosine(frames[chosen], u[:, 2:]))
    hits = _hits(surfaces, np.concatenate(origins), np.concatenate(directions))
    return _shares(hits.reshape(N, plan.count), N)


def person_view_factors(
    surfaces: Surfaces, place: ArrayLike, facing: ArrayLike, *, samples: int = 16384, seed: int = 0
) -> FloatArray:
    """View factors [N] from a seated person to the parts of a room: ISO 7726's six planes.

    F = sum over the planes of their projected area factors times F(plane, part), over the sum of
    the factors: ahead and behind 0.30, to the sides 0.22, up and down 0.18.

    Args: place: [3] of the person [m]; facing: [3] horizontal; the rest as for `view_factors`.

    Source: ISO 7726:1998, annex B.
    """
    ahead = np.asarray(facing, dtype=float) * [1.0, 1.0, 0.0]
    if not np.linalg.norm(ahead) > 0:
        raise ValueError(f"facing: expected a horizontal direction, got {facing}")
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    up = np.array([0.0, 0.0, 1.0])
    planes = (ahead, -ahead, side, -side, up, -up)
    plan = _Plan(samples, seed)
    rays = np.concatenate([_cosine(window_frame(n)[None], plan.numbers(k)[:, 2:]) for k, n in enumerate(planes)])
    N = int(surfaces.surface.max()) + 1
    origins = np.broadcast_to(np.asarray(place, dtype=float), rays.shape)
    shares = _shares(_hits(surfaces, origins, rays).reshape(6, plan.count), N)
    return np.array(SEATED) @ shares / sum(SEATED)


def sky_shares(
    surfaces: Surfaces,
    points: ArrayLike,
    normals: ArrayLike,
    *,
    samples: int = 4096,
    seed: int = 0,
    scenes: SceneCache | None = None,
) -> FloatArray:
    """Sky view of planes outdoors [S] over that without obstructions.

    The view factor to the sky over (1 + cos tilt) / 2; 1 where a plane looks straight down.

    Args:
        surfaces: all that stands outdoors.
        points: [S, K, 3] places of each plane [m]; normals: [S, 3].
        samples: rays from each plane, rounded up to a power of two.
        scenes: that have the mesh of the surfaces, or get it.
    """
    points, normals = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
    S, K = points.shape[:2]
    if not S or not len(surfaces.triangles):
        return np.ones(S)
    plan = _Plan(samples, seed)
    rays = [_cosine(window_frame(n)[None], plan.numbers(k)[:, 2:]) for k, n in enumerate(normals)]
    places = points[:, np.arange(plan.count) % K]
    hits = _hits(surfaces, places.reshape(-1, 3), np.concatenate(rays), scenes).reshape(S, -1)
    up = np.stack(rays)[..., 2] > 0
    free, sky = (up & (hits < 0)).sum(axis=1), up.sum(axis=1)
    return np.where(sky > 0, free / np.maximum(sky, 1), 1.0)


class _Plan:
    """Low-discrepancy numbers, shifted at random for every part.

    Their errors are those of scrambled Sobol' numbers (a closed box of six faces: RMS 6.7e-4 and
    6.8e-4 at 16384), whose module takes half a second to import.

    Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018): multiples
    of the powers of 1/x with x^5 = x + 1; Cranley and Patterson 1976 (random shift).
    """

    def __init__(self, samples: int, seed: int) -> None:
        if samples < 1:
            raise ValueError(f"samples: expected at least 1, got {samples}")
        self._seed = seed
        self.count = 2 ** int(np.ceil(np.log2(samples)))
        self._steps = np.arange(self.count)[:, None] * ROOT ** -np.arange(1.0, 5.0)

    def numbers(self, part: int) -> FloatArray:
        """Numbers [n, 4] in [0, 1) of one part."""
        shift = np.random.default_rng([self._seed, part]).random(4)
        return (shift + self._steps) % 1.0


def _cosine(frames: FloatArray, u: FloatArray) -> FloatArray:
    """Cosine-distributed directions [n, 3] about the third row of frames [n or 1, 3, 3]."""
    radius, angle = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    local = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u[:, 0])], axis=1)
    return np.einsum("ni,nij->nj", local, np.broadcast_to(frames, (len(u), 3, 3)))


def _hits(
    surfaces: Surfaces, origins: FloatArray, directions: FloatArray, scenes: SceneCache | None = None
) -> NDArray[np.int64]:
    """The part that each ray meets first, -1 for none."""
    centre = surfaces.triangles.mean(axis=(0, 1))
    tracer = (SceneCache() if scenes is None else scenes).of_surfaces(surfaces, centre)
    towards = vectors(directions)
    start = vectors(origins - centre, mi.Point3f) + towards * tracer.epsilon
    hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(start, towards), coherent=False)
    is_hit = hit.is_valid()
    part = dr.gather(mi.UInt32, tracer.surface, hit.prim_index, is_hit)
    return dr.select(is_hit, mi.Int32(part), -1).numpy().astype(np.int64)


def _shares(hits: NDArray[np.int64], parts: int) -> FloatArray:
    """Shares [R, N] of the rays [R, n] that end on each part."""
    return np.stack([np.bincount(row[row >= 0], minlength=parts) for row in hits]) / hits.shape[1]
