"""Parts of the picture: zones around a point, a horizontal band, a mask; and their luminance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.glare.glare_view import GlareView, in_scan_order
from mitsuba_cfs.glare.sources import Sources


@dataclass(frozen=True, slots=True)
class Zones:
    """Zones around a pixel: within half of `inner`, and from there to half of `outer`."""

    x: int  # column
    y: int  # row counted from the bottom
    inner: float  # opening angle [rad]
    outer: float | None = None  # opening angle [rad]


@dataclass(frozen=True, slots=True)
class AreaStatistics:
    """Luminance of an area: over solid angle for the average, over pixels for the rest."""

    pixels: int
    solid_angle: float  # [sr]
    average: float  # [cd/m2]
    median: float  # [cd/m2]
    deviation: float  # [cd/m2]
    percentile_75: float  # [cd/m2]
    percentile_95: float  # [cd/m2]
    smallest: float  # [cd/m2]
    largest: float  # [cd/m2]
    illuminance: float  # at the eye [lx]


def statistics(luminance: NDArray[Any], area: NDArray[Any], geometry: GlareView) -> AreaStatistics:
    """Statistics of luminance [nx, ny] over an area [nx, ny] bool, both in scan order."""
    area = area & geometry.valid
    values, weights = luminance[area], geometry.solid_angle[area]
    if not values.size:
        raise ValueError("the area holds no pixel of the view")
    ordered = np.sort(values)
    return AreaStatistics(
        pixels=values.size,
        solid_angle=float(weights.sum()),
        average=float(values @ weights / weights.sum()),
        median=float(np.median(ordered)),
        deviation=float(values.std()),
        percentile_75=_percentile(ordered, 0.75),
        percentile_95=_percentile(ordered, 0.95),
        smallest=float(ordered[0]),
        largest=float(ordered[-1]),
        illuminance=float(values @ geometry.projected[area]),
    )


def _percentile(ordered: NDArray[Any], share: float) -> float:
    """evalglare's percentile: the mean of the two values around place n x share."""
    place = ordered.size * share
    return float(ordered[int(place)] + ordered[max(int(place - 1), 0)]) / 2


def angles_to(x: int, y: int, geometry: GlareView) -> NDArray[np.float64]:
    """Angle [nx, ny] [rad] of each pixel to pixel x, y, all in scan order.

    As in `scan.near`, a pixel whose ray has a length above 1 by rounding has no angle to itself
    (NaN), and lies in no area around it.
    """
    nx, ny = geometry.valid.shape
    if not (0 <= x < nx and 0 <= y < ny):
        raise ValueError(f"position {x}, {y} lies outside the picture {nx} x {ny}")
    all_x, all_y, all_z = np.moveaxis(geometry.directions, -1, 0)
    own_x, own_y, own_z = geometry.directions[x, y]
    with np.errstate(invalid="ignore"):
        return np.arccos(all_x * own_x + all_y * own_y + all_z * own_z)


def zone_map(zones: Zones, geometry: GlareView) -> NDArray[np.int64]:
    """Zone [nx, ny] of each pixel: 1 inner, 2 outer, 0 neither."""
    opening = 2 * angles_to(zones.x, zones.y, geometry)
    inner = opening <= zones.inner
    outer = ~inner & (opening <= (zones.outer if zones.outer is not None else -1.0))
    return np.where(geometry.valid, inner + 2 * outer, 0)


def split_by_zone(
    sources: Sources, zones: Zones, luminance: NDArray[Any], geometry: GlareView
) -> tuple[Sources, NDArray[np.int64]]:
    """Sources cut at the zones' borders, and the zone [n] of each.

    Those outside the zones keep their order and come first; the others follow in the order in which
    the scan meets them.
    """
    where = zone_map(zones, geometry)
    flat, zone = sources.labels.ravel(), where.ravel()
    lit = np.flatnonzero(flat)
    pair = flat[lit].astype(np.int64) * 3 + zone[lit]
    pairs, first = np.unique(pair, return_index=True)
    outside = pairs % 3 == 0
    order = np.argsort(np.where(outside, pairs - np.iinfo(np.int64).max // 2, first))
    number = np.empty(len(pairs), dtype=np.int64)
    number[order] = np.arange(len(pairs))
    numbers = number[np.searchsorted(pairs, pair)]
    labels = np.zeros(flat.size, dtype=np.int32)
    labels[lit] = numbers + 1
    omega, light = geometry.solid_angle.ravel()[lit], luminance.ravel()[lit]
    x, y = np.divmod(lit, luminance.shape[1])
    at_eye = light * geometry.projected.ravel()[lit]

    def total(weights: NDArray[np.float64]) -> NDArray[Any]:
        return np.bincount(numbers, weights, minlength=len(pairs))

    flux = total(omega * light)
    cut = Sources(
        labels=labels.reshape(luminance.shape),
        pixels=total(np.ones(lit.size)),
        solid_angle=total(omega),
        luminance=flux / total(omega),
        x=total(omega * light * x) / flux,
        y=total(omega * light * y) / flux,
        illuminance=total(at_eye),
    )
    return cut, (pairs % 3)[order]


def band(angle: float, geometry: GlareView) -> NDArray[np.bool_]:
    """Pixels [nx, ny] within `angle` [rad] of the middle row, measured along each column."""
    middle = (geometry.valid.shape[1] - 1) // 2
    row = geometry.directions[:, middle]
    dot = np.einsum("xyk,xk->xy", geometry.directions, row)
    within = np.arccos(np.clip(dot, -1.0, 1.0)) <= angle
    within[:, middle] = True
    return within


def mask_area(mask: ArrayLike, geometry: GlareView) -> NDArray[np.bool_]:
    """Pixels [nx, ny] of a mask picture's luminance [ny, nx]: those above 0.1 cd/m2."""
    mask = np.asarray(mask)
    expected = (geometry.view.height, geometry.view.width)
    if mask.shape != expected:
        raise ValueError(f"a mask of shape {mask.shape} for a picture of {expected}")
    return in_scan_order(mask) > 0.1


def pgsv_contrast(window: AreaStatistics, mean_luminance: float) -> float:
    """PGSV by contrast, the mask being the window.

    3.2 log L_w - 0.64 log w + (0.79 log w - 0.61) log L_b - 8.2, L_b = (2 pi L - L_w w)/(2 pi - w).

    Source: Tokura, Iwata and Shukuya (1996), as in evalglare.
    """
    omega = window.solid_angle
    background = _around(window, mean_luminance)
    if background <= 0:
        return -math.inf if background == 0 else math.nan
    return (
        3.2 * math.log10(window.average)
        - 0.64 * math.log10(omega)
        + (0.79 * math.log10(omega) - 0.61) * math.log10(background)
        - 8.2
    )


def pgsv_saturation(illuminance: float) -> float:
    """PGSV by saturation: 3.3 - 3.87/(1 + (E_v/(1250 pi))^1.7). Source: as above."""
    return 3.3 - (0.57 + 3.3) / (1 + (illuminance / math.pi / 1250) ** 1.7)


def pgsv(window: AreaStatistics, mean_luminance: float, illuminance: float, task: float) -> float:
    """PGSV: by contrast where L_w/L_b exceeds E_v/(pi L_task), else by saturation."""
    background = _around(window, mean_luminance)
    if background > 0 and window.average / background > illuminance / (math.pi * task):
        return pgsv_contrast(window, mean_luminance)
    return pgsv_saturation(illuminance)


def _around(window: AreaStatistics, mean_luminance: float) -> float:
    """Average luminance [cd/m2] of a hemisphere without the window."""
    total = 2 * math.pi * mean_luminance - window.average * window.solid_angle
    return total / (2 * math.pi - window.solid_angle)
