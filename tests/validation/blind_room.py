"""The room of the dissertation's Table 1, its double glazing, and the slats of its blind.

Six sensors stand in the room's middle line; the facade looks to the south-west.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.glazing import roos_factor
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic
from mitsuba_cfs.surfaces import Surfaces, WindowGroup

GLASS_TRANSMITTANCE, GLASS_BACK, GLASS_FRONT = 0.55, 0.17, 0.19  # Table 1, at normal incidence
SLAT = {"depth": 0.080, "radius": 0.104, "spacing": 0.072}
SLAT_REFLECTANCE = 0.55
TILTS = {"glass": None, "5 degrees": 5.0, "40 degrees": 40.0, "70 degrees": 70.0}
BLIND_OFFSET = 0.06  # [m] middle of the slats before the glass
MARGIN = 1.5  # [m] that the slats reach beyond the window: a BSDF knows no edges


@dataclass(frozen=True)
class BlindRoom:
    """The room and its sensors."""

    interior: Surfaces
    groups: list[WindowGroup]
    points: NDArray[np.float64]  # [S, 3]
    up: NDArray[np.float64]  # [S, 3]


def test_room() -> BlindRoom:
    """The room of Table 1, its facade to the south-west."""
    building = shoebox(
        3.65,
        4.60,
        3.00,
        windows=(WindowRectangle(0.30, 0.90, 3.05, 1.70),),
        facing_deg=225.0,
        reflectance={"wall": 0.50, "ceiling": 0.80, "roof": 0.80, "floor": 0.34},
    )
    space = building.spaces[0]
    groups = window_groups(space)
    inward = -groups[0].frame[2]
    middle = groups[0].windows[0].triangles.reshape(-1, 3).mean(axis=0) * [1, 1, 0]
    points = middle + np.arange(0.6, 4.2, 0.6)[:, None] * inward + [0, 0, 0.85]
    return BlindRoom(interior_surfaces(space), groups, points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))


def glass_transmittance(cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transmittance [...] of the double glazing at the cosine of incidence."""
    return GLASS_TRANSMITTANCE * roos_factor(np.arccos(np.clip(cosine, 0, 1)), panes=2, category=4.0)


def glass_reflectance(cosine: NDArray[np.float64], normal: float) -> NDArray[np.float64]:
    """Reflectance [...], which rises from its `normal` value as the transmittance falls."""
    tau = glass_transmittance(cosine)
    return np.minimum(normal + (1 - normal) * (1 - tau / GLASS_TRANSMITTANCE), 1 - tau)


def glass_klems(basis: KlemsBasis = KLEMS_FULL) -> KlemsBsdf:
    """Klems matrices of the double glazing; reflectance rises as the transmittance falls."""
    omega = basis.projected_solid_angles()
    cosine = basis.incident_directions()[:, 2]
    tau = glass_transmittance(cosine)
    front, back = (np.diag(glass_reflectance(cosine, r) / omega) for r in (GLASS_FRONT, GLASS_BACK))
    return KlemsBsdf(basis, basis, np.diag(tau / omega), np.diag(tau / omega), front, back)


def blind_layer(tilt_deg: float, **size: float) -> PeriodicLayer:
    """The blind of 3.1.1.2 at a tilt; `size`: of `venetian_blind`."""
    material = plastic("slat", SLAT_REFLECTANCE)
    return venetian_blind(material, tilt=np.radians(tilt_deg), **SLAT, **size)


def slats(group: WindowGroup, tilt_deg: float) -> Surfaces:
    """The blind as geometry before the window, larger than it, and the wall round the window.

    The wall reflects as much as the glass, for a BSDF knows neither edges nor a wall.
    """
    local = group.windows[0].triangles.reshape(-1, 3) @ group.frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    width = high[0] - low[0] + 2 * MARGIN
    layer = blind_layer(tilt_deg, width=width)
    count = int(np.ceil((high[1] - low[1] + 2 * MARGIN) / SLAT["spacing"]))
    corner = np.array([low[0] - MARGIN, low[1] - MARGIN, high[2] + BLIND_OFFSET])
    steps = corner + np.arange(count)[:, None] * [0, SLAT["spacing"], 0]
    triangles = (layer.triangles[None] + steps[:, None, None]).reshape(-1, 3, 3)
    wall = wall_round(low, high)
    reflectance = np.repeat([SLAT_REFLECTANCE, GLASS_FRONT], [len(triangles), len(wall)])
    return Surfaces(
        np.concatenate([triangles, wall]) @ group.frame, reflectance, np.zeros(len(reflectance), dtype=np.int64)
    )


def wall_round(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [8, 3, 3] of the plane round the rectangle from `low` to `high`, 3 m wide."""
    (x0, y0, z), (x1, y1, _) = low, high
    far = 3.0
    strips = [
        (x0 - far, y0 - far, x1 + far, y0),
        (x0 - far, y1, x1 + far, y1 + far),
        (x0 - far, y0, x0, y1),
        (x1, y0, x1 + far, y1),
    ]
    corners = [[(a, b, z), (c, b, z), (c, d, z), (a, d, z)] for a, b, c, d in strips]
    return np.array([[q[i] for i in order] for q in corners for order in ((0, 1, 2), (0, 2, 3))])


def empty() -> Surfaces:
    """Nothing outdoors."""
    return Surfaces.none()
