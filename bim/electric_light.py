"""Illuminance of a room's sensors by luminaires: direct, and by the room's diffuse reflections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.rays import RayMesh, ray_mesh
from bim.to_tracer import furnished_surfaces
from mitsuba_cfs.metrics.photometry import Photometry

FloatArray = NDArray[np.float64]
PATHS = 512  # of each sensor
BOUNCES = 12
CLEAR = 1e-4  # [m] of a path off a surface


@dataclass(frozen=True, slots=True)
class Luminaire:
    """A luminaire in a room: a point."""

    photometry: Photometry
    position: tuple[float, float, float]  # [m]
    turned_deg: float = 0.0  # of C0 from +x, anticlockwise

    def illuminance(self, points: FloatArray, normals: FloatArray, mesh: RayMesh) -> FloatArray:
        """Direct illuminance [S] [lx]: I cos / d^2 where nothing is between.

        Args: points, normals: [S, 3].
        """
        to = np.asarray(self.position) - points
        distance = np.maximum(np.linalg.norm(to, axis=1), 1e-6)
        direction = to / distance[:, None]
        cosine = np.maximum(np.sum(direction * normals, axis=1), 0.0)
        angle = np.radians(self.turned_deg)
        x, y, z = -direction.T
        frame = np.stack([np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x, z], 1)
        lit = self.photometry.intensity(frame) * cosine / distance**2
        used = np.flatnonzero(lit > 0)
        hit, _ = mesh.first_hits(points[used] + CLEAR * normals[used], direction[used])
        lit[used] *= hit > distance[used] - 2 * CLEAR
        return lit


@dataclass(frozen=True, slots=True)
class LampLight:
    """Illuminance of sensors by all luminaires at full power."""

    direct: FloatArray  # [S] [lx]
    reflected: FloatArray  # [S] [lx]
    standard_error: float  # of the mean of the sensors [lx], from the paths

    @property
    def mean(self) -> float:
        """Mean of the sensors [lx]."""
        return float((self.direct + self.reflected).mean())


def lamp_light(
    space: Space,
    luminaires: Sequence[Luminaire],
    points: FloatArray,
    normals: FloatArray | None = None,
    *,
    paths: int = PATHS,
    seed: int = 0,
) -> LampLight:
    """Light of luminaires on sensors of a room, level ones by default.

    Reflections are followed backwards from the sensors, cosine by cosine, and lit at every surface
    by all luminaires.  Glass is black; surfaces are diffuse; the housing hides nothing.

    Args: points: [S, 3] [m]; normals: [S, 3].
    """
    surfaces = furnished_surfaces(space, "visible")
    triangles = np.asarray(surfaces.triangles, dtype=float)
    reflectance = np.asarray(surfaces.reflectance, dtype=float)
    edges = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    faces = edges / np.maximum(np.linalg.norm(edges, axis=1), 1e-12)[:, None]
    mesh = ray_mesh(triangles)
    towards = np.tile([0.0, 0.0, 1.0], (len(points), 1)) if normals is None else normals

    def lit(at: FloatArray, normals: FloatArray) -> FloatArray:
        parts = (one.illuminance(at, normals, mesh) for one in luminaires)
        return np.sum([*parts, np.zeros(len(at))], axis=0)

    random = np.random.default_rng(seed)
    at, normal = np.repeat(points, paths, axis=0), np.repeat(towards, paths, axis=0)
    weight, own = np.ones(len(at)), np.arange(len(at))
    gathered = np.zeros(len(at))
    for _ in range(BOUNCES):
        direction = _cosine(normal, random)
        distance, hit = mesh.first_hits(at + CLEAR * normal, direction)
        going = hit >= 0
        at, direction, hit = at[going], direction[going], hit[going]
        distance, own, weight = distance[going], own[going], weight[going]
        weight = weight * reflectance[hit]
        at = at + normal[going] * CLEAR + distance[:, None] * direction
        normal = faces[hit] * -np.sign(np.sum(faces[hit] * direction, axis=1))[:, None]
        gathered[own] += weight * lit(at, normal)
        if not len(own):
            break
    by_sensor = gathered.reshape(len(points), paths)
    error = float(by_sensor.mean(axis=0).std(ddof=1) / np.sqrt(paths)) if paths > 1 else np.inf
    return LampLight(lit(points, towards), by_sensor.mean(axis=1), error)


def _cosine(normals: FloatArray, random: np.random.Generator) -> FloatArray:
    """Directions [R, 3] around normals [R, 3] with the density of the cosine."""
    ball = random.standard_normal(normals.shape)
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    sums = normals + ball
    result: FloatArray = sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-9)[:, None]
    return result
