"""Flat sheets with holes, folds and fins as periodic layers: screens, pleats, overhangs.

Fabrics of roller blinds have a BSDF from a data sheet's values at normal incidence: a share of the
beam is transmitted directly through the holes, the rest of the transmission is scattered.  Both
decrease with the angle as Kotey, Wright and Collins 2009 measured ("Determining off-normal solar
optical properties of roller blinds", ASHRAE Transactions 115(1)); that model is also ASHRAE
1311-RP's and EnergyPlus' (WindowMaterial:Shade:EquivalentLayer).  The scattered part leaves with
the same angular decrease, so that the BSDF is reciprocal; in the model itself it is diffuse.
Reflection is diffuse and does not depend on the angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.angular import ANGLES, AngularTable
from mitsuba_cfs.bsdf.blinds import extrude
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial, clear_body

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FabricBand:
    """A fabric at normal incidence in one spectral band; front is outdoors."""

    transmittance: float  # normal-hemispherical
    direct: float  # of it normal-normal
    reflectance_front: float  # normal-hemispherical
    reflectance_back: float

    def __post_init__(self) -> None:
        if not 0 <= self.direct <= self.transmittance:
            raise ValueError("expected a direct share between 0 and the transmittance")
        most = max(self.reflectance_front, self.reflectance_back)
        if min(self.reflectance_front, self.reflectance_back) < 0 or (self.transmittance + most > 1 + 1e-9):
            raise ValueError("expected transmittance and reflectance of 1 at most, together")


def fabric_transmittances(band: FabricBand, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Transmittance [..] and its direct part [..] at angles of incidence [rad]."""
    theta = np.asarray(theta, dtype=float)
    if band.direct >= 1:
        return np.ones_like(theta), np.ones_like(theta)
    thread = (band.transmittance - band.direct) / (1 - band.direct)
    power = 0.133 * (thread + 0.003) ** -0.467 if thread <= 0.33 else 0.33 * (1 - thread)
    whole = band.transmittance * np.clip(np.cos(theta), 0, 1) ** power
    closed = np.cos(band.direct * np.pi / 2)
    cut_off = np.radians(90 - 25 * closed)
    course = np.cos(np.pi / 2 * np.minimum(theta / cut_off, 1)).clip(0, 1)
    straight = np.where(theta < cut_off, band.direct * course ** (0.6 * closed**0.3), 0.0)
    return whole, np.minimum(straight, whole)


def fabric_klems(band: FabricBand, basis: KlemsBasis = KLEMS_FULL) -> KlemsBsdf:
    """The Klems matrices of a fabric: means over the patches."""
    whole, straight = fabric_transmittances(band, ANGLES)
    table, omega = AngularTable(ANGLES, whole), basis.projected_solid_angles()
    beam, scattered = (table.patch_means(basis, v) for v in (straight, whole - straight))
    tau = np.diag(beam / omega)
    if scattered.any():
        tau += np.outer(scattered, scattered) / (omega @ scattered)
    rho = np.full_like(tau, 1 / np.pi)
    front, back = band.reflectance_front * rho, band.reflectance_back * rho
    return KlemsBsdf(basis, basis, tau, tau, front, back)


def perforated_screen(
    material: SlatMaterial, *, spacing: float, openness: float, thickness: float = 0.0, segments: int = 24
) -> PeriodicLayer:
    """A sheet with round holes in a square grid.

    Args:
        spacing: distance of the holes' centres [m].
        openness: share of the area that is hole, up to pi / 4.
        thickness: of the sheet; the walls of the holes have its material [m].
        segments: corners of the polygon that represents a hole, with the area of the circle.
    """
    if not 0 < openness < np.pi / 4:
        raise ValueError(f"openness: expected above 0 and below pi / 4, got {openness}")
    if segments % 4:
        raise ValueError(f"segments: expected a multiple of 4, got {segments}")
    # the polygon's area is n / 2 sin(2 pi / n) r2
    radius = spacing * np.sqrt(2 * openness / (segments * np.sin(2 * np.pi / segments)))
    angle = 2 * np.pi * np.arange(segments) / segments + np.pi / segments
    hole = radius * np.stack([np.cos(angle), np.sin(angle)], -1)
    if np.abs(hole).max() >= spacing / 2:
        raise ValueError("the holes touch: fewer segments or a smaller openness")
    reach = spacing / 2 / np.abs(np.stack([np.cos(angle), np.sin(angle)], -1)).max(axis=1)
    rim = reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    return _with_hole(hole, rim, thickness, material, spacing)


def woven_screen(material: SlatMaterial, *, spacing: float, openness: float, thickness: float) -> PeriodicLayer:
    """Square holes between flat threads, the sheet `thickness` thick: a roller shade's fabric.

    Source: the square-mesh model of roller fabrics; openness is the direct transmittance at normal
    incidence.
    """
    if not 0 < openness < 1:
        raise ValueError(f"openness: expected above 0 and below 1, got {openness}")
    half = 0.5 * spacing * np.sqrt(openness)
    hole = half * np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=float)
    rim = 0.5 * spacing * np.sign(hole)
    return _with_hole(hole, rim, thickness, material, spacing)


def thread_screen(material: SlatMaterial, *, diameter: float, spacing: float, segments: int = 16) -> PeriodicLayer:
    """Round upright threads before round level ones, on a square grid.

    Args:
        diameter: of a thread [m].
        spacing: distance of the threads' axes [m].
        segments: corners of the polygon that represents a thread, with its width.
    """
    if not 0 < diameter < spacing:
        raise ValueError(f"diameter: expected above 0 and below {spacing}, got {diameter}")
    angle = 2 * np.pi * np.arange(segments) / segments
    outline = diameter / 2 * np.stack([np.cos(angle), np.sin(angle)], -1)
    edges = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    level = extrude(edges + np.array([spacing / 2, -diameter / 2]), spacing)
    upright = extrude(edges + np.array([spacing / 2, diameter / 2]), spacing)[..., [1, 0, 2]]
    triangles = np.concatenate([level, upright])
    # every triangle's front outdoors: of a thread's two halves these are the outside and the inside
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    inwards = np.cross(u, v)[:, 2] < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    kind = np.zeros(len(triangles), dtype=np.int64)
    return PeriodicLayer(triangles, kind, (material,), (spacing, spacing))


def _with_hole(
    hole: NDArray[np.float64], rim: NDArray[np.float64], thickness: float, material: SlatMaterial, spacing: float
) -> PeriodicLayer:
    """A sheet with a hole in each period, from the corners of the hole and of the period [n, 2]."""
    face = _ring(hole, rim, spacing / 2)
    faces = [np.concatenate([face, np.full((*face.shape[:2], 1), z)], -1) for z in _faces(thickness)]
    if thickness > 0:
        faces.append(_walls(hole, thickness))
    return _sheet(np.concatenate(faces), material, spacing)


def pleated_shade(material: SlatMaterial, *, depth: float, spacing: float) -> PeriodicLayer:
    """A fabric folded to and fro, `spacing` from fold to fold of one side and `depth` deep [m]."""
    edges = np.array([[[0.0, 0.0], [spacing / 2, depth]], [[spacing / 2, depth], [spacing, 0.0]]])
    triangles = extrude(edges, max(spacing, depth))
    return PeriodicLayer(
        triangles, np.zeros(len(triangles), dtype=np.int64), (material,), (max(spacing, depth), spacing)
    )


def prism_panel(index: float, *, pitch: float, angle: float, thickness: float, channels: int = 1) -> PeriodicLayer:
    """A clear panel, flat outside, with horizontal prisms towards the room.

    Args:
        pitch: height of a prism [m].
        angle: of its long face against the pane; the panel is thinner going down [rad].
        thickness: of the panel where it is thinnest [m].
    """
    if not 0 <= angle < np.pi / 2:
        raise ValueError(f"angle: expected 0 to below a right angle, got {angle}")
    drop = pitch * np.tan(angle)
    # (y, z) edges whose extruded triangles have their normals outwards: exterior, room, level
    edges = [[[pitch, 0.0], [0.0, 0.0]], [[0.0, -thickness], [pitch, -thickness - drop]]]
    if drop > 0:
        edges.append([[pitch, -thickness - drop], [pitch, -thickness]])
    triangles = extrude(np.array(edges), max(pitch, thickness + drop))
    material = clear_body("clear", index, channels=channels)
    return PeriodicLayer(
        triangles, np.zeros(len(triangles), dtype=np.int64), (material,), (max(pitch, thickness + drop), pitch)
    )


def _sheet(triangles: NDArray[Any], material: SlatMaterial, spacing: float) -> PeriodicLayer:
    """The layer of a cell drawn round the origin."""
    return PeriodicLayer(
        triangles + np.array([spacing / 2, spacing / 2, 0.0]),
        np.zeros(len(triangles), dtype=np.int64),
        (material,),
        (spacing, spacing),
    )


def _faces(thickness: float) -> tuple[float, ...]:
    return (0.0,) if thickness == 0 else (thickness / 2, -thickness / 2)


def _ring(inner: NDArray[Any], outer: NDArray[Any], half: float) -> NDArray[np.float64]:
    """Triangles [.., 3, 2] between a hole's outline and the square cell's border."""
    triangles = []
    count = len(inner)
    for a in range(count):
        b = (a + 1) % count
        triangles += [[inner[a], outer[a], outer[b]], [inner[a], outer[b], inner[b]]]
        corner = half * np.sign(outer[a] + outer[b])
        if not (np.isclose(outer[a], outer[b]).any() or np.isclose(corner, outer[a]).all()):
            triangles.append([outer[a], corner, outer[b]])
    return np.array(triangles)


def _walls(outline: NDArray[Any], thickness: float) -> NDArray[np.float64]:
    """Triangles of the walls of a hole, from one face to the other."""
    top = np.concatenate([outline, np.full((len(outline), 1), thickness / 2)], -1)
    bottom = top * [1, 1, -1]
    next_top, next_bottom = np.roll(top, -1, axis=0), np.roll(bottom, -1, axis=0)
    return np.concatenate([np.stack([top, bottom, next_bottom], 1), np.stack([top, next_bottom, next_top], 1)])
