"""Gloss of a scene's triangles as kernel tables: specular reflectance, lobe, mirror planes."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.traced_klems import cell
from mitsuba_cfs.gloss import STEPS, Gloss
from mitsuba_cfs.surfaces import Surfaces, triangle_areas
from mitsuba_cfs.trace.kernels.sampling import vectors

SAME_PLANE = 1e-4  # of normals within a mirror plane's orientation
SMOOTHEST = 1e-3  # alpha; below it a surface is a mirror
NO_PLANE = -1


class TracedGloss:
    """Tables of gloss by triangle and by mirror plane.

    A mirror plane is an orientation and a gloss: all mirrors of one show the sun in one direction.
    """

    def __init__(self, surfaces: Surfaces, normals: NDArray[np.float64], windows: int) -> None:
        """From opaque triangles [N] with normals [N, 3], followed by `windows` glazed ones."""
        glossy = surfaces.glossy
        kinds = list(dict.fromkeys(surfaces.gloss[i] for i in glossy))
        of_surface = np.zeros(len(surfaces.gloss), dtype=np.int64)
        of_surface[glossy] = [1 + kinds.index(surfaces.gloss[i]) for i in glossy]
        kind = np.append(of_surface[surfaces.surface], np.zeros(windows, dtype=np.int64))
        table = [np.zeros(STEPS), *(_table(gloss) for gloss in kinds)]
        roughness = np.array([0.0, *(gloss.roughness for gloss in kinds)])
        roughness[roughness < SMOOTHEST] = 0.0
        planes, plane = _planes(surfaces, normals, kind[: len(surfaces.surface)])
        plane = np.append(plane, np.full(windows, NO_PLANE))
        self._kind = mi.UInt32(kind.astype(np.uint32))
        self._table = mi.Float(np.concatenate(table).astype(np.float32))
        self._normal = mi.Float(np.array([t[-1] for t in table]).astype(np.float32))
        self._roughness = mi.Float(roughness.astype(np.float32))
        self._plane = mi.Int32(plane.astype(np.int32))
        self.plane_count = len(planes)
        self.mirrors = np.flatnonzero(roughness[planes[:, 3].astype(int)] == 0)  # smooth planes
        self.normals = planes[:, :3]  # [J, 3] of the planes
        self.corners = [  # [J] of each plane's triangles, in the world
            surfaces.triangles[plane[: len(surfaces.surface)] == j].reshape(-1, 3) for j in range(len(planes))
        ]
        self._plane_normal = vectors(planes[:, :3])
        self._plane_roughness = mi.Float(roughness[planes[:, 3].astype(int)].astype(np.float32))

    def specular(self, triangle: mi.UInt32, cosine: mi.Float, active: mi.Bool) -> mi.Float:
        """Reflectance of a triangle's gloss, 0 where it has none."""
        kind = dr.gather(mi.UInt32, self._kind, triangle, active)
        place = dr.clip(cosine, 0, 1) * (STEPS - 1)
        low = cell(place, STEPS - 2)
        a, b = (dr.gather(mi.Float, self._table, kind * STEPS + low + k, active) for k in (0, 1))
        return dr.lerp(a, b, place - mi.Float(low))

    def diffuse_share(self, triangle: mi.UInt32, cosine: mi.Float, active: mi.Bool) -> mi.Float:
        """Diffuse reflectance at an angle over that at normal incidence."""
        kind = dr.gather(mi.UInt32, self._kind, triangle, active)
        rest = 1 - dr.gather(mi.Float, self._normal, kind, active)
        left = (1 - self.specular(triangle, cosine, active)) / dr.maximum(rest, 1e-6)
        return dr.select((kind > 0) & (rest > 1e-6), dr.minimum(left, 1.0), 1.0)

    def roughness(self, triangle: mi.UInt32, active: mi.Bool) -> mi.Float:
        """Ward's alpha of a triangle."""
        kind = dr.gather(mi.UInt32, self._kind, triangle, active)
        return dr.gather(mi.Float, self._roughness, kind, active)

    def plane_of(self, triangle: mi.UInt32, active: mi.Bool) -> mi.Int32:
        """The mirror plane that a triangle lies in, -1 for none."""
        return dr.gather(mi.Int32, self._plane, triangle, active)

    def plane(self, number: mi.UInt32) -> tuple[mi.Vector3f, mi.Float]:
        """Normal and roughness of a mirror plane."""
        normal = dr.gather(mi.Vector3f, self._plane_normal, number)
        return normal, dr.gather(mi.Float, self._plane_roughness, number)

    def lobe(
        self,
        triangle: mi.UInt32,
        normal: mi.Vector3f,  # that the ray sees
        direction: mi.Vector3f,  # along which the ray comes
        towards: mi.Vector3f,  # where the light comes from
        active: mi.Bool,
    ) -> mi.Float:
        """BRDF [1/sr] of a rough gloss; 0 of a mirror."""
        alpha = self.roughness(triangle, active)
        half = towards - direction
        along, square = dr.dot(half, normal), dr.squared_norm(half)
        alpha2 = dr.maximum(alpha * alpha, SMOOTHEST**2)
        tangent2 = square / dr.maximum(along * along, 1e-12) - 1
        rho = self.specular(triangle, -dr.dot(normal, direction), active)
        value = rho * square * dr.exp(-tangent2 / alpha2)
        value /= dr.pi * alpha2 * dr.maximum(along**4, 1e-12)
        before = (dr.dot(towards, normal) > 0) & (alpha > 0) & active
        return dr.select(before, value, 0.0)

    def leave(
        self,
        triangle: mi.UInt32,
        normal: mi.Vector3f,
        direction: mi.Vector3f,
        diffuse: mi.Float,  # reflectance of the diffuse part for this ray
        generator: mi.PCG32,
        active: mi.Bool,
    ) -> tuple[mi.Bool, mi.Vector3f, mi.Float]:
        """Whether a path continues by the gloss, its direction then, the weight of the chosen part.

        The part is chosen in proportion to what it reflects.
        """
        rho = self.specular(triangle, -dr.dot(normal, direction), active)
        whole = diffuse + rho
        glossy = active & (rho > 0) & (generator.next_float32() * whole >= diffuse)
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        towards, factor = reflected(normal, direction, self.roughness(triangle, active), u)
        return glossy, towards, dr.select(glossy, whole * factor, whole)


class TracedPanes:
    """Tables of the panes between rooms by triangle."""

    def __init__(self, surfaces: Surfaces, windows: int) -> None:
        """From triangles [N], followed by `windows` glazed ones."""
        kinds = list(dict.fromkeys(filter(None, surfaces.transmittance)))
        of_surface = np.zeros(int(surfaces.surface.max(initial=-1)) + 1, dtype=np.int64)
        for number, values in enumerate(surfaces.transmittance[: len(of_surface)]):
            of_surface[number] = 1 + kinds.index(values) if values else 0
        kind = np.append(of_surface[surfaces.surface], np.zeros(windows, dtype=np.int64))
        even = np.linspace(0.0, 1.0, STEPS)
        table = [np.interp(even, np.linspace(0.0, 1.0, len(one)), one) for one in kinds]
        self._kind = mi.UInt32(kind.astype(np.uint32))
        self._table = mi.Float(np.concatenate([np.zeros(STEPS), *table]).astype(np.float32))

    def is_pane(self, triangle: mi.UInt32, active: mi.Bool) -> mi.Bool:
        """Whether a triangle transmits."""
        return dr.gather(mi.UInt32, self._kind, triangle, active) > 0

    def transmittance(self, triangle: mi.UInt32, cosine: mi.Float, active: mi.Bool) -> mi.Float:
        """Transmittance of a triangle, 0 where it is opaque."""
        kind = dr.gather(mi.UInt32, self._kind, triangle, active)
        place = dr.clip(cosine, 0, 1) * (STEPS - 1)
        low = cell(place, STEPS - 2)
        a, b = (dr.gather(mi.Float, self._table, kind * STEPS + low + k, active) for k in (0, 1))
        return dr.lerp(a, b, place - mi.Float(low))


def reflected(
    normal: mi.Vector3f, direction: mi.Vector3f, alpha: mi.Float, u: mi.Point2f
) -> tuple[mi.Vector3f, mi.Float]:
    """A direction of Ward's lobe for light along `direction`, and f cos / density for rho = 1.

    Facets have the density exp(-tan2 / alpha2); the factor is 2 / (1 + cos_i / cos_o).
    """
    facet, _ = facets(normal, alpha, u)
    towards = direction - facet * (2 * dr.dot(direction, facet))
    cosine = dr.dot(towards, normal)
    factor = 2.0 / (1.0 - dr.dot(direction, normal) / dr.maximum(cosine, 1e-6))
    return towards, dr.select(cosine > 0, factor, 0.0)


def facets(normal: mi.Vector3f, alpha: mi.Float, u: mi.Point2f) -> tuple[mi.Vector3f, mi.Float]:
    """A normal of a rough surface's facets, and its cosine to the surface's own."""
    tangent = alpha * dr.sqrt(-dr.log(dr.maximum(1.0 - u.x, 1e-12)))
    cosine = dr.rsqrt(dr.fma(tangent, tangent, 1.0))
    s, c = dr.sincos(2 * dr.pi * u.y)
    local = mi.Vector3f(tangent * cosine * c, tangent * cosine * s, cosine)
    return mi.Frame3f(normal).to_world(local), cosine


def facet_density(cosine: mi.Float, alpha: mi.Float) -> mi.Float:
    """Density [1/sr] of `facets` at a cosine to the surface's normal."""
    alpha2 = dr.maximum(alpha * alpha, SMOOTHEST**2)
    cosine2 = dr.maximum(cosine * cosine, 1e-9)
    return dr.exp(-(1 / cosine2 - 1) / alpha2) / (dr.pi * alpha2 * cosine2 * dr.sqrt(cosine2))


def _table(gloss: Gloss) -> NDArray[np.float64]:
    """Reflectance [STEPS] by cosine of incidence."""
    return gloss.reflectance(np.linspace(0.0, 1.0, STEPS))


def _planes(
    surfaces: Surfaces, normals: NDArray[np.float64], kind: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Normal and gloss [J, 4] of each mirror plane, and the plane [N] of each triangle."""
    glossy = np.flatnonzero(kind)
    up = normals[glossy]
    # the half of the sphere that a normal is turned to; a level plane's is not left to rounding
    side = up @ [1.0, np.sqrt(2.0) * 1e-1, np.sqrt(3.0) * 1e1]
    up = up * np.where(side < 0, -1.0, 1.0)[:, None]
    steps = np.round(up / (2 * SAME_PLANE)).astype(np.int64)
    keys = np.column_stack([steps, kind[glossy]])
    planes, number = np.unique(keys, axis=0, return_inverse=True)
    number = number.reshape(-1)
    area = triangle_areas(surfaces.triangles[glossy])
    mean = np.stack([np.bincount(number, up[:, i] * area, len(planes)) for i in range(3)], axis=1)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    plane = np.full(len(kind), NO_PLANE)
    plane[glossy] = number
    return np.column_stack([mean, planes[:, 3]]), plane
