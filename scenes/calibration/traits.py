"""What of a room, its system and its suns a method's error goes by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.bsdf.resample import klems_of
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup

FIELD = 90.0  # [degrees] from the line of sight, that an eye sees
SKY = ReinhartSky(1)  # directions that stand for the sky
DARKEST = 3.0  # decades
LEAST_BEAM = 1e-3  # share: below it there is none
SCALES = (
    1.0,
    1.0,
    0.5,
    0.5,
    0.25,
    0.5,
)  # of each trait: a difference that large is as good as another


@dataclass(frozen=True, slots=True)
class Traits:
    """The traits of one system in one room under some suns."""

    beam: float  # decades that the straight beam's share lies above `LEAST_BEAM`: 0 to 3
    spread: float  # [rad] that light is turned by, root mean square of what is scattered
    dark: float  # decades that the transmittance of diffuse light lies below 1
    tree: float  # 1: a tensor tree is known; 0: Klems matrices alone
    sun: float  # share of the rated hours whose sun shines in a window of the field of view
    obstruction: float  # share of the sky before the windows that is hidden

    def place(self) -> NDArray[np.float64]:
        """The traits over their scales [6]: methods err alike where these lie near."""
        return np.array(astuple(self)) / SCALES


def system_traits(bsdf: Bsdf) -> tuple[float, float, float, float]:
    """Beam, spread, dark and tree of a system, of diffuse light from outdoors."""
    tree = isinstance(bsdf, TensorTreeBsdf)
    klems: KlemsBsdf = klems_of(bsdf)
    basis = klems.basis_in
    omega = basis.projected_solid_angles()
    peak = through_peak(klems.filled().transmission_front, basis)
    beam, scattered = omega @ peak.transmittance, peak.scattered * omega * omega[:, None]
    whole = beam + scattered.sum()
    if not whole > 0:
        return 0.0, 0.0, DARKEST, float(tree)
    turned = basis.outgoing_directions() @ -basis.incident_directions().T
    angle = np.arccos(np.clip(turned, -1, 1))
    spread = np.sqrt((scattered * angle**2).sum() / max(scattered.sum(), 1e-12 * whole))
    spread = float(spread) if scattered.sum() > 1e-3 * whole else 0.0
    dark = float(min(np.log10(omega.sum() / whole), DARKEST))
    above = float(np.log10(max(beam / whole, LEAST_BEAM) / LEAST_BEAM))
    return above, spread, dark, float(tree)


def sun_in_view(
    groups: Sequence[WindowGroup],
    eye: ArrayLike,
    direction: ArrayLike,
    suns: NDArray[np.float64],
    shining: NDArray[np.bool_],
) -> float:
    """Share of the hours whose sun shines and stands in a window before the eye.

    What stands outdoors is left to `hidden_sky`.

    Args: suns: [H, 3] directions; shining: [H].
    """
    ahead = shining & (suns @ np.asarray(direction, float) > np.cos(np.radians(FIELD)))
    met = np.zeros(len(suns), dtype=bool)
    for group in groups:
        for window in group.windows:
            outward = suns @ window.normal > 0
            met |= outward & _meets(np.asarray(eye, float), suns, window.triangles)
    return float(np.mean(met & ahead)) if len(suns) else 0.0


def hidden_sky(groups: Sequence[WindowGroup], exterior: Surfaces) -> float:
    """Share of the sky that surfaces hide from the windows' middles, by projected solid angle."""
    if not len(exterior.triangles):
        return 0.0
    up = SKY.directions[1:]
    hidden, whole = 0.0, 0.0
    for group in groups:
        for window in group.windows:
            weight = SKY.solid_angles[1:] * np.maximum(up @ window.normal, 0) * window.area
            middle = window.triangles.reshape(-1, 3).mean(axis=0) + 1e-3 * window.normal
            seen = weight > 0
            meets = _meets(middle, up[seen], exterior.triangles)
            hidden, whole = hidden + weight[seen][meets].sum(), whole + weight.sum()
    return float(hidden / whole) if whole > 0 else 0.0


def _meets(
    start: NDArray[np.float64], ways: NDArray[np.float64], triangles: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether rays from a point along `ways` [N, 3] meet any triangle [T, 3, 3]."""
    a, b, c = (triangles[:, i] for i in range(3))
    first, second, to_start = b - a, c - a, start - a
    found = np.zeros(len(ways), dtype=bool)
    across = np.cross(to_start, first)
    for i, way in enumerate(ways):
        normal = np.cross(way, second)
        scale = (first * normal).sum(-1)
        flat = np.abs(scale) < 1e-12
        scale = np.where(flat, 1.0, scale)
        u = (to_start * normal).sum(-1) / scale
        v = across @ way / scale
        t = (second * across).sum(-1) / scale
        found[i] = bool(np.any(~flat & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)))
    return found
