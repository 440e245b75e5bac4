"""Derivatives of a room's results by its inputs, one row for each pair.

Light: from the matrices of the light (`mitsuba_cfs.methods.sensitivity`).  Heat: central differences
of the heat balance, which traces nothing.  The shading states of each hour are those of the result:
what an input does by way of a control is left out.

Figures that count hours above a limit have no derivative.  They are smoothed: an hour counts by
Phi((value - limit) / width), Phi the normal distribution; `WIDTHS` has the widths.  They are columns
of the table beside the figures of the results, which count whole hours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtr

from mitsuba_cfs.glare.indices import ADAPTATION, DGP_IN_DARK, DGP_OF_CONTRAST, DGP_PER_LUX
from mitsuba_cfs.methods.light import eye_illuminance, illuminance, illuminance_with_noise, relative_error_of_mean
from mitsuba_cfs.methods.sensitivity import LightDerivative, by_ground, by_reflectances
from mitsuba_cfs.metrics.schedules import daylight_hours, lm83_hours
from mitsuba_cfs.sky.weather import Weather
from scenes.results import MELANOPIC_BY_DAY, DaylightResult, SpectralYear
from scenes.room.bands import (
    GLARE_SHARE,
    SDA_ACCEPTED,
    LightSamples,
    Margin,
    deviations,
    draws,
    lit_samples,
    provision_margin,
)
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.slats import MovedSlats
from scenes.room.zone import RoomZone, balances, climate, lamp_daylight, lamp_power, per_window
from scenes.uncertain_inputs import INPUTS
from thermal.balance import ZoneResult
from thermal.blackbox import absorbed_at_u, with_u_value
from thermal.comfort import comfort_by_outdoors, degree_hours
from thermal.zone import Gains

Array = NDArray[np.float64]
TARGET_LX = 300.0  # of daylight autonomy
HALF = 50.0  # of sDA [%]
GLARE = 0.40  # DGP from which on glare disturbs
RULES = ("lm83_accepted", "en17037_minimum", "en17037_glare")  # whose probability bands state
WIDTHS = {  # of the smoothed limits, a standard deviation
    "da300": 30.0,  # [lx]
    "sda300_50": 5.0,  # [%] of DA, besides
    "glare_hours": 0.02,  # of DGP
    "melanopic_hours": 25.0,  # [lx]
    "too_warm_hours": 0.5,  # [K]
}
UNITS = {
    "mean_illuminance_lx": "lx",
    "da300": "%",
    "sda300_50": "%",
    "glare_hours": "h",
    "melanopic_edi_mean_lx": "lx",
    "melanopic_hours": "h",
    "lighting_kwh": "kWh",
    "heating_kwh": "kWh",
    "cooling_kwh": "kWh",
    "peak_heating_w": "W",
    "peak_cooling_w": "W",
    "mean_air_c": "C",
    "highest_operative_c": "C",
    "too_warm_hours": "h",
    "degree_hours_26": "K h",
}
STEP_SHARE = 0.25  # of an input's deviation: step of the heat balance's differences


@dataclass(frozen=True, slots=True)
class Change:
    """Derivative of the light by an input, in the input's unit."""

    key: str  # of `INPUTS`
    value: float  # of the input
    illuminance: Array  # [S + 1, L] of the sensors, the eye last [lx]
    relative_error: float  # standard error over value of the sensors' mean
    step: float = 0.0  # over which counts are central differences; 0: their smoothed slope
    # [L] with the input a step lower and higher; None: by the light at the eye, the glare sources unchanged
    dgp: tuple[Array, Array] | None = None
    melanopic: Array | None = None  # [L] of melanopic EDI at the eye [lx]; None: the ratio to illuminance stays


def light_sensitivities(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    daylight: DaylightResult,
    year: pd.DataFrame | None = None,
    spectral: SpectralYear | None = None,
    *,
    slats: Sequence[MovedSlats] = (),
) -> tuple[pd.DataFrame, LightSamples | None]:
    """Derivatives of the room's light by its inputs, see `sensitivity_table`; samples for bands, if asked for.

    Args:
        state: [H, G] of the shading.
        slats: the room with other slats, see `room_slats`.
        year: `annual_glare`; None: no hours of glare.
        spectral: None: no melanopic light.
    """
    figures = _LightFigures(room, light, state, daylight, year, spectral)
    wanted = {"glare": year is not None, "melanopic": spectral is not None}
    changes = list(light_changes(room, light, state, slats=slats, **wanted))
    table = pd.concat([figures.rows(one) for one in changes if one.key != "tracing"], ignore_index=True)
    samples = None
    if room.options.outputs.bands:
        drawn = draws(deviations(room.operation), room.options.sampling.seed)
        samples = figures.samples(changes, drawn)
    return table, samples


def light_changes(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    *,
    slats: Sequence[MovedSlats] = (),
    glare: bool = False,
    melanopic: bool = False,
) -> Iterator[Change]:
    """What the light of a room depends on, and how.

    Args: slats: the room with other slats; glare, melanopic: whether DGP and melanopic EDI are derived by these.
    """
    rows, scene = light.states(state), light.scene
    lit = _of_all(light, rows)
    groups, interior = scene.by_groups, scene.interior
    if groups is None:
        raise ValueError("the room was not traced for sensitivities: RoomOptions.of(sensitivities=True)")
    plane = slice(0, len(scene.points) - room.other_sensors)

    def change(key: str, value: float, of: LightDerivative, per: float) -> Change:
        mean = of.illuminance[plane].sum(axis=1).mean()
        # sensors share paths: their errors are taken as one
        error = of.error_of_sum[plane].mean()
        return Change(key, value, of.illuminance / per, float(error / abs(mean)) if mean else 0.0)

    for number, (name, of) in enumerate(zip(groups.names, by_reflectances(light.light, rows), strict=True)):
        some = groups.number[interior.surface] == number
        if not some.any():
            continue
        mean = float(np.average(interior.reflectance[some], weights=interior.areas[some]))
        if mean > 0:
            yield change(f"reflectance_{name}", mean, of, mean)
    albedo = float(np.mean(room.weather.albedo))
    if albedo > 0:
        yield change("reflectance_ground", albedo, by_ground(light.light, rows), albedo)
    values, noise = illuminance_with_noise(light.light, rows)
    relative = float(relative_error_of_mean(values, noise)[plane].mean())
    yield Change("transmittance_percent", 100.0, lit / 100.0, relative)
    yield Change("sky_percent", 100.0, lit / 100.0, relative)
    # sensors share paths: their errors are taken as one
    errors = np.append(relative_error_of_mean(values, noise), relative)
    yield Change("tracing", 0.0, lit * errors[:, None], 0.0)
    for one in slats:
        of_dgp = one.dgp(state) if glare else None
        of_melanopic = one.melanopic_slope(state) if melanopic else None
        yield Change(one.key, one.value, one.slope(state), relative, one.step, of_dgp, of_melanopic)
    tilt = None if any(one.key == "tilt_deg" for one in slats) else _by_tilt(room, light, rows)
    if tilt is not None:
        value, derivative = tilt
        yield Change("tilt_deg", value, derivative, relative)


def _of_all(light: RoomLight, rows: NDArray[np.int64]) -> Array:
    """Illuminance of the sensors, the eye last [S + 1, L] [lx]."""
    return np.concatenate([illuminance(light.light, rows), eye_illuminance(light.light, rows)[None]])


def _by_tilt(room: RoomInputs, light: RoomLight, rows: NDArray[np.int64]) -> tuple[float, Array] | None:
    """Mean tilt and derivative by it [S + 1, L]: from the states next to that of each hour.

    Groups are turned one after the other; hours with a state without a tilt have no derivative. None
    where no group has two states with tilts.
    """
    total, tilts = np.zeros((len(light.scene.points) + 1, rows.shape[1])), []
    for g, states in enumerate(room.windows.systems):
        tilt = np.array([np.nan if one.tilt_deg is None else one.tilt_deg for one in states])
        known = np.flatnonzero(~np.isnan(tilt))
        if len(known) < 2:
            continue
        low, high = np.arange(len(states)), np.arange(len(states))
        low[known[1:]], high[known[:-1]] = known[:-1], known[1:]
        step = np.nan_to_num(tilt[high] - tilt[low])
        row = np.minimum(rows[g], len(states) - 1)
        ends = []
        for moved in (high, low):
            other = rows.copy()
            other[g] = moved[row]
            ends.append(_of_all(light, other))
        per = step[row]
        total += np.divide(ends[0] - ends[1], per, out=np.zeros_like(total), where=per != 0)
        tilts += tilt[row][~np.isnan(tilt[row])].tolist()
    return (float(np.mean(tilts)), total) if tilts else None


def bell(values: Array, limit: float | Array, width: float) -> Array:
    """Derivative of Phi((value - limit) / width) by the value."""
    x = (values - limit) / width
    density: Array = np.exp(-0.5 * x * x) / (width * np.sqrt(2 * np.pi))
    return density


def count_slope(values: Array, slope: Array, limit: float, width: float, step: float) -> Array:
    """Derivative of Phi((value - limit) / width) by an input by which the values have a slope.

    Args: step: of the input, for a central difference; 0: none.
    """
    if step <= 0:
        return bell(values, limit, width) * slope
    high, low = (ndtr((values + by * slope - limit) / width) for by in (step, -step))
    difference: Array = (high - low) / (2 * step)
    return difference


class _LightFigures:
    """The figures of a room's light, smoothed, and their derivatives by that of the illuminance."""

    def __init__(
        self,
        room: RoomInputs,
        light: RoomLight,
        state: NDArray[np.int64],
        daylight: DaylightResult,
        year: pd.DataFrame | None,
        spectral: SpectralYear | None,
    ) -> None:
        self._room, self._lit = room, light.light.sky.lit
        count = len(light.scene.points) - room.other_sensors
        self._plane = slice(0, count)
        self._values = daylight.illuminance[self._lit].T.astype(float)  # [S, L]
        counted = room.skies.once(lm83_hours, room.weather)
        self._counted, self._hours = counted[self._lit], int(counted.sum())
        self._da = self._autonomy(self._values)
        self._eye = light.eye(state).astype(float)
        self._year = None if year is None else year.iloc[self._lit]
        self._used = room.occupied[self._lit]
        self._spectral = None if spectral is None else spectral.eye.iloc[self._lit]
        self._daylight = daylight

    def _autonomy(self, values: Array) -> Array:
        """Smoothed DA of each sensor [S] [%] by illuminance [S, L]."""
        smooth = ndtr((values - TARGET_LX) / WIDTHS["da300"]) * self._counted
        share: Array = 100.0 * smooth.sum(axis=1) / self._hours
        return share

    def rows(self, change: Change) -> pd.DataFrame:
        """The rows of one input."""
        found = [(figure, *pair) for figure, pair in self._derivatives(change)]
        return sensitivity_table(
            change.key, change.value, [(name, value, by, abs(by) * change.relative_error) for name, value, by in found]
        )

    def _derivatives(self, change: Change) -> Iterator[tuple[str, tuple[float, float]]]:
        of_plane, of_eye = change.illuminance[self._plane], change.illuminance[-1]
        hours, step_h = self._room.skies.hours, self._room.weather.step_h
        yield "mean_illuminance_lx", (self._values.sum(axis=1).mean() / hours, of_plane.sum(axis=1).mean() / hours)
        step = change.step
        slope = count_slope(self._values, of_plane, TARGET_LX, WIDTHS["da300"], step) * self._counted
        of_sensors = 100.0 * slope.sum(axis=1) / self._hours
        yield "da300", (float(self._da.mean()), float(of_sensors.mean()))
        width = WIDTHS["sda300_50"]
        if step > 0:
            low, high = (
                ndtr((self._autonomy(self._values + by * of_plane) - HALF) / width).mean() for by in (-step, step)
            )
            area = float(high - low) / (2 * step)
        else:
            area = float((bell(self._da, HALF, width) * of_sensors).mean())
        yield "sda300_50", (100.0 * float(ndtr((self._da - HALF) / width).mean()), 100.0 * area)
        if self._year is not None:
            dgp, by_eye = dgp_and_slope(self._year["dgp"].to_numpy(float), self._year["ev"].to_numpy(float))
            width, used = WIDTHS["glare_hours"], self._used
            value = step_h * ndtr((dgp - GLARE) / width)[used].sum()
            if change.dgp is None:
                of_hours = count_slope(dgp, by_eye * of_eye, GLARE, width, step)
            else:
                low, high = (ndtr((end - GLARE) / width) for end in change.dgp)
                of_hours = (high - low) / (2 * step)
            yield "glare_hours", (value, step_h * float(of_hours[used].sum()))
        if self._spectral is not None:
            seen = self._spectral["melanopic_edi_lx"].to_numpy(float)
            ratio = np.divide(seen, self._eye, out=np.zeros_like(seen), where=self._eye > 0)
            by = ratio * of_eye if change.melanopic is None else change.melanopic
            width, used = WIDTHS["melanopic_hours"], self._used
            yield "melanopic_edi_mean_lx", (seen[used].mean(), float(by[used].mean()))
            value = step_h * ndtr((seen - MELANOPIC_BY_DAY) / width)[used].sum()
            of_hours = count_slope(seen, by, MELANOPIC_BY_DAY, width, step)
            yield "melanopic_hours", (value, step_h * float(of_hours[used].sum()))
        tables = self._room.operation
        if tables is not None and tables.gains.dims:
            powers = [self._lamps(sign * change.illuminance, change) for sign in (1.0, -1.0)]
            yield "lighting_kwh", (self._lamps(None, change), (powers[0] - powers[1]) / (2 * self._step(change)))

    def samples(self, changes: Sequence[Change], drawn: Mapping[str, Array]) -> LightSamples:
        """The figures of light for drawn inputs."""
        room, sensors = self._room, len(self._values)
        slopes = {one.key: np.concatenate([one.illuminance[self._plane], one.illuminance[-1:]]) for one in changes}
        whole = np.concatenate([self._values, self._eye[None]])
        of_year = room.skies.once(daylight_hours, room.weather)
        half, half_hours = of_year[self._lit], int(of_year.sum())
        found: dict[str, list[Array]] = {}
        blocks = chain([whole[None]], lit_samples(whole, slopes, drawn))  # as computed first
        for block in blocks:
            for name, values in self._counts(block, sensors, half, half_hours).items():
                found.setdefault(name, []).append(values)
        every = {name: np.concatenate(values) for name, values in found.items()}
        margins = {name: Margin(v[1:], float(v[0])) for name, v in every.items() if name in RULES}
        figures = {name: (UNITS[name], float(v[0]), v[1:]) for name, v in every.items() if name not in RULES}
        return LightSamples(figures, margins)

    def _counts(
        self, lit: NDArray[np.floating], sensors: int, half: NDArray[np.bool_], half_hours: int
    ) -> dict[str, Array]:
        """Figures and margins of rules [n] by the illuminance of the sensors and the eye [n, S + 1, L]."""
        room, plane, eye = self._room, lit[:, :sensors], lit[:, -1].astype(float)
        step_h, used = room.weather.step_h, self._used
        autonomy = 100.0 * (plane[..., self._counted] >= TARGET_LX).sum(axis=-1) / self._hours
        spatial = 100.0 * (autonomy >= HALF).mean(axis=-1)
        found = {
            "mean_illuminance_lx": plane.sum(axis=-1, dtype=float).mean(axis=-1) / room.skies.hours,
            "da300": autonomy.mean(axis=-1),
            "sda300_50": spatial,
            "lm83_accepted": spatial - SDA_ACCEPTED,
            "en17037_minimum": provision_margin(plane, half, half_hours),
        }
        if self._year is not None:
            dgp, by_eye = dgp_and_slope(self._year["dgp"].to_numpy(float), self._year["ev"].to_numpy(float))
            moved = dgp + by_eye * (eye - self._eye)
            above = (moved > GLARE)[:, used].sum(axis=-1)
            found["glare_hours"] = step_h * above
            found["en17037_glare"] = GLARE_SHARE - 100.0 * above / max(int(room.occupied.sum()), 1)
        if self._spectral is not None:
            seen = self._spectral["melanopic_edi_lx"].to_numpy(float)
            moved = seen * np.divide(eye, self._eye, out=np.ones_like(eye), where=self._eye > 0)
            found["melanopic_edi_mean_lx"] = moved[:, used].mean(axis=-1)
            found["melanopic_hours"] = step_h * (moved >= MELANOPIC_BY_DAY)[:, used].sum(axis=-1)
        return found

    def _step(self, change: Change) -> float:
        return STEP_SHARE * INPUTS[change.key].deviation

    def _lamps(self, derivative: Array | None, change: Change) -> float:
        """Electricity of the lamps [kWh] where the daylight is a step of the input brighter."""
        room, lit = self._room, self._daylight.illuminance.astype(float)
        if derivative is not None:
            moved = room.skies.whole_year(derivative[self._plane]).T * self._step(change)
            lit = np.maximum(lit + moved, 0.0)
        tables = room.operation
        if tables is None:
            return 0.0
        daylight = lamp_daylight(tables, self._daylight.points, lit)
        power = lamp_power(tables, room.space.floor_area, room.weather, daylight)
        return float(power.sum() * room.weather.step_h / 1e3)


def dgp_and_slope(dgp: Array, eye: Array) -> tuple[Array, Array]:
    """DGP and its derivative by the vertical illuminance, the glare sources unchanged.

        DGP = c1 E_v + c2 log10(1 + sum L^2 omega / (E_v^1.87 P^2)) + c3

    The sum follows from DGP and E_v.  Windows, which are the sources, do not change with the room's
    reflectances; with the light through them they do, and the derivative is then too low.
    """
    dgp, eye = np.nan_to_num(dgp), np.maximum(np.nan_to_num(eye), 1.0)
    contrast = np.maximum((dgp - DGP_IN_DARK - DGP_PER_LUX * eye) / DGP_OF_CONTRAST, 0.0)
    ratio = 10.0**contrast
    slope = DGP_PER_LUX - DGP_OF_CONTRAST / np.log(10.0) * (ratio - 1.0) / ratio * ADAPTATION / eye
    return dgp, slope


def sensitivity_table(key: str, value: float, figures: Iterable[tuple[str, float, float, float]]) -> pd.DataFrame:
    """Rows of one input.

    Columns: input, input_value, input_unit, figure, figure_value (smoothed), figure_unit, derivative
    (per unit of the input), standard_error (of that, by tracing), deviation (usual, of the input),
    effect (derivative times deviation), smoothing (width of a smoothed limit).

    Args: figures: name, value, derivative and its standard error.
    """
    one = INPUTS[key]
    rows = [
        {
            "input": key,
            "input_value": value,
            "input_unit": one.unit,
            "figure": name,
            "figure_value": float(figure),
            "figure_unit": UNITS[name],
            "derivative": float(by),
            "standard_error": float(error),
            "deviation": one.deviation,
            "effect": float(by) * one.deviation,
            "smoothing": WIDTHS.get(name, 0.0),
        }
        for name, figure, by, error in figures
    ]
    return pd.DataFrame(rows)


def _with_g(room: RoomZone, by: float) -> RoomZone:
    """The room whose windows let in other heat of the sun, in the ratio of the g-value."""
    factor = 1.0 + by / _g_value(room)
    solar = room.solar

    def scaled(values: Array | None) -> Array | None:
        return None if values is None else values * factor

    return replace(
        room,
        solar=replace(
            solar,
            absorbed_outer=solar.absorbed_outer * factor,
            absorbed_inner=solar.absorbed_inner * factor,
            inside=solar.inside * factor,
            window_inside=scaled(solar.window_inside),
            absorbed_middle=scaled(solar.absorbed_middle),
        ),
    )


def _g_value(room: RoomZone) -> float:
    return float(np.mean([float(one["g_value"]) for one in room.fenestration]))


def _u_value(room: RoomZone) -> float:
    return float(np.mean([float(one["u_value"]) for one in room.fenestration]))


def _zone(room: RoomZone, **changes: Any) -> RoomZone:
    return replace(room, room=replace(room.room, zone=replace(room.zone, **changes)))


def _with_u(room: RoomZone, by: float) -> RoomZone:
    solar, windows = room.solar, []
    outer, inner = (np.array(values, dtype=float) for values in (solar.absorbed_outer, solar.absorbed_inner))
    for number, window in enumerate(room.zone.windows):
        moved = tuple(with_u_value(one, one.u_value + by) for one in window.states)
        state, states = np.zeros(len(outer), dtype=np.int64), per_window(solar, room.zone).state
        if states is not None:
            state = np.repeat(states[:, number], len(outer) // len(states))
        for j, (one, other) in enumerate(zip(window.states, moved, strict=True)):
            rows = np.flatnonzero(state == j), number
            outer[rows], inner[rows] = absorbed_at_u(one, other, outer[rows], inner[rows])
        windows.append(replace(window, states=moved))
    changed = replace(room, solar=replace(solar, absorbed_outer=outer, absorbed_inner=inner))
    return _zone(changed, windows=tuple(windows))


def _with_gains(room: RoomZone, by: float) -> RoomZone:
    factor, gains = 1.0 + by / 100.0, room.zone.gains
    return _zone(room, gains=Gains(np.asarray(gains.convective) * factor, np.asarray(gains.radiant) * factor))


def _with_infiltration(room: RoomZone, by: float) -> RoomZone:
    return _zone(room, infiltration_ach=np.asarray(room.zone.infiltration_ach) * (1.0 + by / 100.0))


def _with_heating(room: RoomZone, by: float) -> RoomZone:
    loads = room.zone.loads
    return _zone(room, loads=replace(loads, heating_c=np.asarray(loads.heating_c) + by))


def _with_cooling(room: RoomZone, by: float) -> RoomZone:
    loads = room.zone.loads
    return _zone(room, loads=replace(loads, cooling_c=np.asarray(loads.cooling_c) + by))


MOVES: dict[str, Callable[[RoomZone, float], RoomZone]] = {
    "g_value": _with_g,
    "u_value": _with_u,
    "gains_percent": _with_gains,
    "infiltration_percent": _with_infiltration,
    "heating_set_c": _with_heating,
    "cooling_set_c": _with_cooling,
}


def moved_room(room: RoomZone, key: str, by: float) -> RoomZone:
    """A room with an input changed by so much, in all its alternatives of shading."""
    moved = MOVES[key](room, by)
    if room.alternatives is None:
        return moved
    rooms = tuple(MOVES[key](one, by) for one in room.alternatives.rooms)
    return replace(moved, alternatives=replace(room.alternatives, rooms=rooms))


def heat_inputs(rooms: Sequence[RoomZone]) -> list[str]:
    """The inputs of `MOVES` that some of the rooms have."""
    has = {
        "g_value": any(room.fenestration for room in rooms),
        "u_value": any(room.fenestration for room in rooms),
        "gains_percent": any(np.any(np.asarray(r.zone.gains.convective) > 0) for r in rooms),
        "infiltration_percent": any(np.any(np.asarray(r.zone.infiltration_ach) > 0) for r in rooms),
        "heating_set_c": any(np.any(np.isfinite(r.zone.loads.heating_c)) for r in rooms),
        "cooling_set_c": any(np.any(np.isfinite(r.zone.loads.cooling_c)) for r in rooms),
    }
    return [key for key in MOVES if has[key]]


def input_value(room: RoomZone, key: str) -> float:
    """The value of an input of the heat balance, for the table."""
    zone = room.zone
    if key in ("g_value", "u_value"):
        if not room.fenestration:
            return 0.0
        return _g_value(room) if key == "g_value" else _u_value(room)
    if key in ("heating_set_c", "cooling_set_c"):
        points = np.asarray(zone.loads.heating_c if key == "heating_set_c" else zone.loads.cooling_c, dtype=float)
        finite = points[np.isfinite(points)] if points.ndim else points[None][np.isfinite(points[None])]
        return float(finite.mean()) if finite.size else 0.0
    return 100.0


def heat_sensitivities(
    rooms: Sequence[RoomZone],
    weather: Weather,
    step_s: float,
    *,
    terrain: str = "suburbs",
    air_links: Array | None = None,
    moved: Sequence[tuple[Sequence[RoomZone], Sequence[RoomZone]]] = (),
) -> list[pd.DataFrame]:
    """Derivatives of each room's temperatures and loads: an input is moved in all rooms together.

    Central differences over `STEP_SHARE` of the input's deviation to either side.

    Args: moved: the rooms with each of their `moved_inputs` a step lower and higher.
    """

    def figures(moved: Sequence[RoomZone]) -> list[dict[str, float]]:
        results = balances(moved, weather, step_s, terrain=terrain, air_links=air_links)
        return [heat_figures(one, result, weather) for one, result in zip(moved, results, strict=True)]

    base = figures(rooms)
    tables: list[list[pd.DataFrame]] = [[] for _ in rooms]
    for key in heat_inputs(rooms):
        step = STEP_SHARE * INPUTS[key].deviation
        of_windows = key in ("g_value", "u_value")
        ends = [
            figures([r if of_windows and not r.fenestration else moved_room(r, key, by) for r in rooms])
            for by in (step, -step)
        ]
        for table, room, value, up, down in zip(tables, rooms, base, *ends, strict=True):
            of_figures = [(name, value[name], (up[name] - down[name]) / (2 * step), 0.0) for name in value]
            table.append(sensitivity_table(key, input_value(room, key), of_figures))
    for key, (low, high) in zip(moved_inputs(rooms), moved, strict=True):
        for table, room, value, down, up in zip(tables, rooms, base, figures(low), figures(high), strict=True):
            for one in room.moved:
                if one.key == key:
                    of_figures = [(name, value[name], (up[name] - down[name]) / (2 * one.step), 0.0) for name in value]
                    table.append(sensitivity_table(key, one.value, of_figures))
    return [pd.concat(table, ignore_index=True) for table in tables]


def moved_inputs(rooms: Sequence[RoomZone]) -> list[str]:
    """The inputs of the slats that some of the rooms have."""
    return list(dict.fromkeys(one.key for room in rooms for one in room.moved))


def rooms_at_ends(rooms: Sequence[RoomZone]) -> Iterator[tuple[list[RoomZone], list[RoomZone]]]:
    """The rooms with each of their `moved_inputs` a step lower and higher; a room without it as it is."""
    for key in moved_inputs(rooms):
        ends = [next(((one.low, one.high) for one in room.moved if one.key == key), (room, room)) for room in rooms]
        yield [low for low, _ in ends], [high for _, high in ends]


def heat_figures(room: RoomZone, result: ZoneResult, weather: Weather) -> dict[str, float]:
    """Smoothed figures of a year of heat."""
    step_h, used = weather.step_h, room.occupied
    outdoor_c = climate(weather).outdoor_c
    comfort = comfort_by_outdoors(result.operative_c, outdoor_c, "ASHRAE 55 80 %", per_day=weather.per_day)
    warm = ndtr((result.operative_c - comfort.high_c) / WIDTHS["too_warm_hours"]) * comfort.applicable
    figures = {
        "mean_air_c": float(result.air_c.mean()),
        "highest_operative_c": float(result.operative_c.max()),
        "too_warm_hours": float(warm[used].sum() * step_h),
        "degree_hours_26": degree_hours(result.operative_c[used], 26.0, step_h=step_h),
    }
    loads = room.zone.loads
    for name, power, points in (
        ("heating", result.heating, loads.heating_c),
        ("cooling", result.cooling, loads.cooling_c),
    ):
        if np.any(np.isfinite(points)):
            figures[f"{name}_kwh"] = float(power.sum() * step_h / 1e3)
            figures[f"peak_{name}_w"] = float(power.max())
    return figures
