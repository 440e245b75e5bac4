"""Predictive control of a room: states, lamps, heating and cooling of the hours ahead.

Light of each combination of states is that of the matrices, heat that of a reduced model of the
room's zone (`thermal.reduced`), glare the DGP of the pictures that plans choose:
until it is rated, its part of vertical illuminance stands for it, which is its least value, so that
no combination is left out for a proxy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.indices import DGP_IN_DARK, DGP_PER_LUX
from mitsuba_cfs.progress import Progress, silent
from scenes.room.control_year import ControlYear
from scenes.room.operation import OperationHours
from scenes.room.operation_tables import OperationTables
from scenes.room.shading_by_light import Seat, view_taken
from scenes.room.shading_rules import ShadingRule
from scenes.room.zone import climate, lamp_daylight
from thermal.predictive import Forecast, PredictedHours, PredictedYear, noisy_forecast, predicted_year
from thermal.reduced import ReducedZone, reduced_zone

FloatArray = NDArray[np.float64]
LIMIT = 0.40  # DGP, the default of `limit_dgp`
PENALTY = 1e7  # [Wh] for each unit of DGP above the limit: before any energy
FIXED = 1e9  # [Wh] of a state other than that of a group which several rooms share: before any glare
CLOSED = 0.1  # [Wh] of an hour with all groups closed: of equal plans the more open one
# Least DGP by Ev: without sources, less 5 % for the noise of Ev
LEAST = 0.95 * DGP_PER_LUX, DGP_IN_DARK
BY_EYE = 6.2e-5, 0.184  # of AFC's glare term by Ev, after Wienold 2009, equation of DGPs
SIGMAS = 2.0  # standard errors of the tracing by which the DGP of a picture stays below the limit
ROUNDS = 25  # of plans, each with the glare of those before
FEW = 0.005  # share of the occupied hours with unrated glare at which plans end


def predictive_states(year: ControlYear, *, progress: Progress = silent) -> NDArray[np.int64]:
    """States of the control groups in every hour [H, N], by plans of the hours ahead.

    Plans are repeated until the glare of nearly all that they choose in occupied hours has been
    rated, first those of single hours, which cost a fraction of a day's; the last one chooses
    among what has been rated.

    Raises: `DataError` for weather in other steps than hours.
    """
    tables = year.room.operation
    rule = next(one for one in year.room.control.rules if one.rule == "predictive")
    if tables is None:
        raise ValueError("predictive control needs the tables of an operation")
    if year.room.weather.step_h != 1.0:
        message = "plans are of hours: the weather has steps of "
        message += f"{60 * year.room.weather.step_h:g} minutes"
        raise DataError(message, element=year.room.space.label, field="control.rule")
    planner = Planner(year, tables, rule)
    for ahead in (1, tables.control.predictive.horizon_h):
        for number in range(ROUNDS):
            progress("plans", number / ROUNDS)
            plan = planner.plan(ahead)
            if planner.rate(plan.states) <= FEW * len(planner.used):
                break
    return year.combinations[planner.plan(of_rated=True).states]


class Planner:
    """Plans of a room's year, with the glare of the combinations that were rated so far."""

    def __init__(self, year: ControlYear, tables: OperationTables, rule: ShadingRule) -> None:
        """Before any plan."""
        self._year, self._table = year, tables.control.predictive
        self._seat: Seat = (rule.seat, rule.looks_deg)
        self._limit = LIMIT if rule.limit_dgp is None else rule.limit_dgp
        combinations = [tuple(row) for row in year.combinations.tolist()]
        self._combinations = combinations
        self.zone, self._hours = predicted_hours(year, tables)
        count = year.room.skies.hours
        groups = np.arange(len(year.counts))
        self._hidden = view_taken(year.room, groups, year.combinations)  # [M]
        self.used = np.flatnonzero((year.present > 0) & (year.lit_hours >= 0))
        eye = np.stack([year.room.skies.whole_year(year.eye_lx(one, self._seat)) for one in combinations], 1)
        by_picture = self._table.glare == "DGP"
        slope, least = LEAST if by_picture else BY_EYE
        self.glare = np.where(eye > 0, slope * eye + least, 0.0)  # [H, M]
        self.rated = np.full((count, len(combinations)), not by_picture)

    def plan(self, ahead: int | None = None, *, of_rated: bool = False) -> PredictedYear:
        """The year that the plans carry out.

        Args:
            ahead: hours that are planned; by default those of the table.
            of_rated: in occupied hours choose among combinations whose glare was rated.
        """
        table = self._table
        forecast = Forecast(shift=24 if table.forecast == "yesterday" else 0)
        if table.forecast == "error":
            forecast = noisy_forecast(
                len(self.glare),
                table.horizon_h,
                sun_error=table.sun_error,
                temperature_error_k=table.temperature_error_k,
                seed=table.seed,
            )
        penalty = np.zeros_like(self.glare)
        penalty[self.used] = PENALTY * np.maximum(self.glare[self.used] - self._limit, 0.0)
        if of_rated:
            penalty[self.used] += np.where(self.rated[self.used], 0.0, 2 * PENALTY)
        penalty[self.used] += table.view_wh * self._hidden
        for c, shared in self._year.room.followed.items():
            other = self._year.combinations[:, c] != shared.states[:, None]
            penalty += np.where(other, FIXED, 0.0)
        most = np.maximum(np.array(self._year.counts) - 1, 1)
        penalty += CLOSED * (self._year.combinations / most).mean(axis=1)
        hours = PredictedHours(
            self._hours.sun,
            self._hours.daylight,
            self._hours.lamps,
            self._hours.zones,
            self._hours.internal,
            penalty,
            self._year.counts,
            table.move_wh,
        )
        weights = table.heating_weight, table.cooling_weight, table.lighting_weight
        return predicted_year(self.zone, hours, ahead=ahead or table.horizon_h, forecast=forecast, weights=weights)

    def rate(self, states: NDArray[np.int64]) -> int:
        """Rate the glare of the states [H] of occupied hours; returns how many were not known.

        A combination that glares says the same of those that are more open in each group and give
        the eye more light, before they are rated.
        """
        used = self.used[~self.rated[self.used, states[self.used]]]
        numbers = states[used]
        order = self._year.combinations
        for number in np.unique(numbers):
            hours = used[numbers == number]
            values = self._year.dgp_of(self._combinations[number], hours, self._seat, sigmas=SIGMAS)
            more_open = np.flatnonzero((order <= order[number]).all(axis=1))
            for hour, value in zip(hours.tolist(), values.tolist(), strict=True):
                least = self.glare[hour, number]
                self.glare[hour, number], self.rated[hour, number] = value, True
                if value > self._limit:
                    same = more_open[(self.glare[hour, more_open] >= least) & ~self.rated[hour, more_open]]
                    self.glare[hour, same] = np.maximum(self.glare[hour, same], value)
        return len(used)


def predicted_hours(year: ControlYear, tables: OperationTables) -> tuple[ReducedZone, PredictedHours]:
    """The reduced zone of a room, and what acts on it in each combination of states, no glare."""
    room = year.room
    hours, zone = OperationHours(tables, room.weather), year.zone.zone
    windows = year.of_panes(year.combinations)
    sun, daylight = [], []
    lamp_zones = tables.gains.zones
    areas = np.array([window.area for window in zone.windows])
    for states, chosen in zip(map(tuple, year.combinations.tolist()), windows, strict=True):
        solar, *_ = year.sun_by_states.of(year.of_windows(states).tolist())
        systems = [window.states[j] for window, j in zip(zone.windows, chosen, strict=True)]
        outer, middle, inner = np.array([one.inward_shares() for one in systems]).reshape(-1, 3).T
        absorbed = solar.absorbed_outer * outer + solar.absorbed_inner * inner
        if solar.absorbed_middle is not None:
            absorbed = absorbed + solar.absorbed_middle * middle
        sun.append(solar.inside.sum(axis=1) + absorbed @ areas)
        plane = np.zeros((len(lamp_zones), room.skies.hours))
        if tables.gains.dims:
            lit = room.skies.whole_year(year.sensors_lx(states)).T
            plane = lamp_daylight(tables, year.light.scene.points[: lit.shape[1]], lit)
        daylight.append(plane.T)
    reduced = reduced_zone(zone, climate(room.weather), solar.facade, windows, terrain=tables.terrain)
    area = room.space.floor_area
    lamps, other = hours.lamps(area), hours.heat(area) + tables.gains.lighting_standby_w_m2 * area
    return reduced, PredictedHours(
        np.stack(sun, axis=1),
        np.stack(daylight, axis=1),
        lamps,
        tuple((share, one.dimming) for share, one, _ in lamp_zones),
        np.broadcast_to(other, lamps.shape).copy(),
        np.zeros((1, 1)),
    )
