"""The simple hourly method of EN ISO 13790:2008, annex C: a zone as five conductances, one mass.

It is derived from a zone's surfaces, windows and air, nothing is fitted, and serves as the model of
a controller that looks ahead: the temperature of the air and the loads of an hour are linear in the
temperature of the mass.  Deviations from the standard: the mass follows from the layers of the zone
(a tenth of a metre from inside, at most half of a construction, up to its insulation), the area of
the inside is that of the zone's faces, walls meet the temperature behind them: that of air with
the sun that they absorb, of the ground, of a neighbour; leaks have the wind of the hour and the
difference between outdoors and the nearer set point (20 and 26 degC without).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal.climate import Climate
from thermal.convection import local_wind_factor
from thermal.network import mean_height
from thermal.zone import OpaqueSurface, Zone

FloatArray = NDArray[np.float64]
SURFACE_FILM = 3.45  # h_is [W/(m2 K)] between air and surfaces, EN ISO 13790 7.2.2.2
MASS_FILM = 9.1  # h_ms [W/(m2 K)] between surfaces and mass, 12.2.2
FILMS = 0.13, 0.04  # [m2 K/W] inside and outside, EN ISO 6946
DEEPEST = 0.1  # [m] of a construction that counts as mass, EN ISO 13786 annex A
INSULATION = 0.06  # [W/(m K)] conductivity up to which a layer insulates
AIR_HEAT = 1200.0  # [J/(m3 K)]
ROOM_C = 20.0, 26.0  # air of rooms without set points, for their leaks


@dataclass(frozen=True, slots=True)
class ReducedZone:
    """A zone for the simple hourly method, in M combinations of its windows' states."""

    windows: FloatArray  # [M] H_w [W/K] with frames and bridges
    opaque: float  # H_op [W/K]
    mass: float  # C_m [J/K]
    mass_area: float  # A_m [m2]
    area: float  # A_t [m2] of all inside faces
    air: FloatArray  # [H] H_ve [W/K]
    outdoor_c: FloatArray  # [H]
    behind_c: FloatArray  # [H] behind the opaque surfaces, weighted by their conductances
    heating_c: FloatArray  # [H] set point of the air
    cooling_c: FloatArray  # [H]
    heating_limit: float  # [W]
    cooling_limit: float  # [W]


def reduced_zone(
    zone: Zone, climate: Climate, facade: FloatArray, states: NDArray[np.int64], *, terrain: str = "suburbs"
) -> ReducedZone:
    """The reduced model of a zone.

    Args:
        facade: [H, F] irradiance on the outside of its surfaces [W/m2].
        states: [M, W] combinations of the states of its windows.
        terrain: around the building, for the wind at its leaks.

    Opened windows, slabs with pipes and air of neighbours are left out.
    """
    hours, rows = climate.hours, range(len(zone.surfaces))
    u = np.array([_u_value(one) for one in zone.surfaces])
    areas = np.array([one.area for one in zone.surfaces])
    lost = np.array([one.outside in ("outdoor", "ground", "known") for one in zone.surfaces])
    behind = np.zeros(hours)
    for i in rows:
        if lost[i]:
            behind += u[i] * areas[i] * _behind(zone.surfaces[i], climate, facade[:, i])
    opaque = float((u * areas)[lost].sum())
    capacity = np.array([_capacity(one) for one in zone.surfaces])
    mass, squares = float(capacity @ areas), float(capacity**2 @ areas)
    glass = np.array(
        [sum(w.area * w.states[j].u_value for w, j in zip(zone.windows, chosen, strict=True)) for chosen in states]
    )
    frames = sum(w.frame_area * w.frame_u for w in zone.windows)
    window_area = sum(w.area + w.frame_area for w in zone.windows)
    loads = zone.loads
    return ReducedZone(
        glass + frames + zone.bridges,
        max(opaque, 1e-6),
        mass,
        mass**2 / squares if squares else float(areas.sum()),
        float(areas.sum()) + window_area,
        np.maximum(_outdoor_air(zone, climate, terrain) * AIR_HEAT, 1e-3),
        np.asarray(climate.outdoor_c, dtype=float),
        behind / opaque if opaque else np.asarray(climate.outdoor_c, dtype=float),
        _by_hour(loads.heating_c, hours),
        _by_hour(loads.cooling_c, hours),
        loads.heating_limit,
        loads.cooling_limit,
    )


def _u_value(surface: OpaqueSurface) -> float:
    return 1.0 / (sum(layer.resistance for layer in surface.layers) + sum(FILMS))


def _capacity(surface: OpaqueSurface) -> float:
    """Heat capacity of the inside of a construction [J/(m2 K)]."""
    left = min(DEEPEST, 0.5 * sum(layer.thickness for layer in surface.layers))
    if surface.outside == "adiabatic":
        left = DEEPEST
    total = 0.0
    for layer in reversed(surface.layers):
        if layer.conductivity <= INSULATION or left <= 0:
            break
        depth = min(left, layer.thickness)
        total += depth * layer.density * layer.heat_capacity
        left -= depth
    return total


def _behind(surface: OpaqueSurface, climate: Climate, facade: FloatArray) -> FloatArray:
    """Temperature behind a surface [H] [degC]; outdoors with the sun that it absorbs."""
    if surface.outside == "ground":
        return np.asarray(climate.ground_c, dtype=float)
    if surface.outside == "known":
        values = np.atleast_1d(np.asarray(surface.beyond_c, dtype=float))
        per_hour = max(len(values) // climate.hours, 1)
        return np.broadcast_to(values[per_hour - 1 :: per_hour], (climate.hours,))
    return climate.outdoor_c + surface.absorptance_out * FILMS[1] * facade


def _outdoor_air(zone: Zone, climate: Climate, terrain: str) -> FloatArray:
    """Outdoor air [H] [m3/s], that of a fan less its heat recovery."""
    hours, leaks = climate.hours, zone.leakage
    changes = _by_hour(zone.other_air_ach, hours)
    if zone.supply is not None:
        changes = changes + _by_hour(zone.supply.ach, hours) * (1.0 - zone.supply.recovery)
    heating, cooling = (_by_hour(v, hours) for v in (zone.loads.heating_c, zone.loads.cooling_c))
    outdoor = np.asarray(climate.outdoor_c, dtype=float)
    lower, upper = (
        np.where(np.isfinite(limit), limit, otherwise)
        for limit, otherwise in zip((heating, cooling), ROOM_C, strict=True)
    )
    gap = np.abs(np.clip(outdoor, lower, np.maximum(lower, upper)) - outdoor)
    wind = climate.wind_speed * local_wind_factor(mean_height(zone), terrain)
    a, b, c, d = leaks.factors
    changes = changes + _by_hour(zone.infiltration_ach, hours) * (a + b * gap + c * wind + d * wind**2)
    by_test = np.hypot(leaks.stack * gap**leaks.stack_exponent, leaks.wind * wind**leaks.wind_exponent)
    return changes * zone.volume / 3600.0 + by_test


def _by_hour(values: FloatArray | float, hours: int) -> FloatArray:
    """Hourly values [H] of a constant, or of hours or steps."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 0:
        return np.full(hours, float(array))
    return array[:: max(len(array) // hours, 1)].copy()


@compiled()
def responses(
    air: float,
    windows: float,
    opaque: float,
    mass: float,
    mass_area: float,
    area: float,
    outdoor_c: float,
    behind_c: float,
    internal: float,
    sun: float,
    out: NDArray[np.float64],
) -> None:
    """Write how air and mass follow from the mass before, and from heating, into out [6].

    Air [degC] = out0 + out1 T + out2 P, mass at the end of the hour = out3 + out4 T + out5 P, with
    the mass T before and the power P of heating; equations C.1 to C.11 of the standard.
    """
    to_mass, to_air = MASS_FILM * mass_area, SURFACE_FILM * area
    em = 1.0 / max(1.0 / opaque - 1.0 / to_mass, 1e-6)
    h1 = 1.0 / (1.0 / air + 1.0 / to_air)
    h2 = h1 + windows
    h3 = 1.0 / (1.0 / h2 + 1.0 / to_mass)
    air_gain = 0.5 * internal
    rest = 0.5 * internal + sun
    mass_gain = mass_area / area * rest
    surface_gain = (1.0 - mass_area / area - windows / (MASS_FILM * area)) * rest
    store = mass / 3600.0
    below = store + 0.5 * (h3 + em)
    whole = mass_gain + em * behind_c
    whole += h3 / h2 * (surface_gain + windows * outdoor_c + h1 * (air_gain / air + outdoor_c))
    out[3] = whole / below
    out[4] = (store - 0.5 * (h3 + em)) / below
    out[5] = h3 * h1 / (h2 * air) / below
    # surfaces and air with the mean of the mass
    s = to_mass + windows + h1
    s0 = surface_gain + windows * outdoor_c + h1 * (outdoor_c + air_gain / air)
    down = to_air + air
    out[0] = (to_air * (to_mass * 0.5 * out[3] + s0) / s + air * outdoor_c + air_gain) / down
    out[1] = to_air * to_mass * 0.5 * (1.0 + out[4]) / s / down
    out[2] = (to_air * (to_mass * 0.5 * out[5] + h1 / air) / s + 1.0) / down
