"""The view of an hour that a control function gets, and the year of states by such a function."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.progress import Progress, silent
from scenes.room.control_year import AT_A_TIME, ControlYear, StateArray, States, ZoneHeat
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.predictive import predictive_states
from scenes.room.shading import Levels, predicts, room_conditions
from scenes.room.solar import SeasonalOutdoors
from scenes.room.zone import climate
from thermal.balance import LONG_AGO, BalanceOptions, SteppedZone
from thermal.control import ROOM_QUANTITIES, Condition, WaitingRule, number_of

FloatArray = NDArray[np.float64]


class ControlHour:
    """An hour of a room as its shading control meets it: what is measured, and each state's light.

    Quantities are computed when they are read. `states` is the state of all control groups, of each
    [N], or by name; groups that are not named have their state of the hour before.
    """

    def __init__(self, run: ControlRun, index: int, previous: tuple[int, ...]) -> None:
        """Made by `controlled_states`."""
        self._run, self._year = run, run.year
        self.index = index  # of the year
        self.previous = previous  # [N] states in the hour before

    @property
    def time(self) -> pd.Timestamp:
        """Middle of the interval, local standard time."""
        return self._year.room.weather.midpoints[self.index]

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the control groups [N]."""
        return self._year.groups

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of states of each control group [N]."""
        return self._year.counts

    @property
    def combinations(self) -> StateArray:
        """All combinations of states [M, N]; `DataError` for more than 1024."""
        return self._year.combinations

    @property
    def occupied(self) -> float:
        """Share of the people that is present."""
        return float(self._year.present[self.index])

    @property
    def sun(self) -> FloatArray:
        """Direction to the sun [3]: x east, y north, z up."""
        return self._year.sun[self.index]

    @property
    def profile_deg(self) -> FloatArray:
        """Profile angle of the sun before each group [N] [deg]; 90 behind its facade."""
        return self._year.profile_deg[self.index]

    @property
    def tilts_deg(self) -> tuple[FloatArray, ...]:
        """Slat tilt of each state [J] of each group [N] [deg]; NaN without slats, or raised."""
        return self._year.tilts_deg

    @property
    def beam(self) -> FloatArray:
        """Direct irradiance of each group [N] [W/m2], with what shades it outdoors."""
        return self._year.beam[self.index]

    @property
    def irradiance(self) -> FloatArray:
        """Irradiance of each group [N] [W/m2], with what shades it outdoors."""
        return self._year.irradiance[self.index]

    @property
    def outdoor_c(self) -> float:
        """Outdoor temperature [degC]."""
        return float(self._year.outdoor_c[self.index])

    @property
    def wind_m_s(self) -> float:
        """Wind speed of the weather [m/s]."""
        return float(self._year.wind_m_s[self.index])

    @property
    def air_c(self) -> float:
        """Temperature of the room's air at the end of the hour before [degC].

        The room is balanced alone, its first day warmed up in its first states.
        """
        return self._run.before(self.index)[0]

    @property
    def operative_c(self) -> float:
        """Operative temperature of the room at the end of the hour before [degC]."""
        return self._run.before(self.index)[1]

    def sensors_lx(self, states: States) -> FloatArray:
        """Illuminance of the work plane's sensors [S] [lx] by daylight."""
        lit, chosen = self._year.lit_hour(self.index), self._states(states)
        values = self._year.sensors_lx(chosen)
        return values[:, lit].astype(float) if lit >= 0 else np.zeros(len(values))

    def work_plane_lx(self, states: States) -> float:
        """Mean of `sensors_lx` [lx]."""
        return float(self.sensors_lx(states).mean())

    def eye_lx(
        self, states: States, seat: tuple[float, float, float] | None = None, looks_deg: float | None = None
    ) -> float:
        """Vertical illuminance at the eye [lx].

        Args: seat: the eye [m]; looks_deg: azimuth of the line of sight from north by east; by
            default those of the room's view.
        """
        lit, chosen = self._year.lit_hour(self.index), self._states(states)
        return float(self._year.eye_lx(chosen, (seat, looks_deg))[lit]) if lit >= 0 else 0.0

    def dgp(
        self, states: States, seat: tuple[float, float, float] | None = None, looks_deg: float | None = None
    ) -> float:
        """DGP of the hour's picture; 0 in the dark.

        Args: as of `eye_lx`.
        """
        return self._year.dgp(self._states(states), self.index, (seat, looks_deg))

    def by_rules(self) -> tuple[int, ...]:
        """States of the control groups [N] by the rules of the operation file.

        `ControlHour.by_rules` is itself a control function: that of the file.
        """
        return self._run.by_rules(self.index)

    def _states(self, states: States) -> tuple[int, ...]:
        return self._year.combination(states, self.previous)


class ControlError(CfsError, ValueError):
    """A control function that returns no states of the room's groups."""


class FollowedCondition:
    """The level of a condition of the room's temperature, hour by hour, as the balance has it."""

    def __init__(self, condition: Condition) -> None:
        """At level 0, and since long ago."""
        self.condition, self.level, self._warm = condition, 0, False
        self._since = [LONG_AGO] * condition.levels  # rows since each level or one above was asked
        self._same_rows = LONG_AGO

    def follow(self, felt: Mapping[str, float], levels: Levels, hour: int) -> None:
        """Go on by an hour.

        Args: felt: the room's quantities at its beginning; levels: of the conditions before this.
        """
        of = self.condition
        if isinstance(of, WaitingRule):
            asked = int(of.asked[number_of([levels[one] for one in of.reads], of.reads), hour])
        else:
            value = felt[of.quantity]
            self._warm = value > of.above or (self._warm and value >= of.below)
            asked = int(self._warm)
        self._since = [0 if asked >= n else rows + 1 for n, rows in enumerate(self._since)]
        self._same_rows += 1
        wanted = max(n for n, rows in enumerate(self._since) if rows <= of.open_delay_rows)
        if wanted != self.level and self._same_rows >= of.hold_rows:
            self.level, self._same_rows = wanted, 0


class ControlRun:
    """A year of states so far; the heat balance follows as far as its temperatures are read."""

    def __init__(self, year: ControlYear) -> None:
        """Before the first hour."""
        self.year = year
        self.states: list[tuple[int, ...]] = []  # [N] of each hour so far
        self._stepped: SteppedZone | None = None
        self._felt_before: list[tuple[float, float, float, float]] = []  # each hour
        self._heat: dict[tuple[int, ...], ZoneHeat] = {}
        conditions, self._read = room_conditions(year.by_file, year.light, year.outdoors)
        self._conditions = [FollowedCondition(one) for one in conditions]
        self._followed = 0  # hours
        self._by_rules: dict[tuple[int, ...], StateArray] = {}

    def before(self, hour: int) -> tuple[float, float]:
        """Air and operative temperature at the end of the hour before [degC]."""
        air, operative, *_ = self._felt(hour)
        return air, operative

    def _felt(self, hour: int) -> tuple[float, float, float, float]:
        """The `ROOM_QUANTITIES` at the end of the hour before."""
        year = self.year
        if self._stepped is None:
            tables = year.room.operation
            self._stepped = SteppedZone(
                year.zone.zone,
                climate(year.room.weather),
                year.of_panes(year.combinations),
                step_s=year.room.options.heat_step_s,
                options=BalanceOptions(terrain="suburbs" if tables is None else tables.terrain),
            )
            heat = self._heat_of((0,) * len(year.counts))
            self._stepped.warm_up(0, heat.solar, heat.gains)
            self._felt_before.append(_felt_in(self._stepped))
        for states in self.states[len(self._felt_before) - 1 : hour]:
            heat = self._heat_of(states)
            self._stepped.advance(year.number_of(states), heat.solar, heat.gains)
            self._felt_before.append(_felt_in(self._stepped))
        return self._felt_before[hour]

    def by_rules(self, hour: int) -> tuple[int, ...]:
        """The states of the control groups [N] by the rules of the operation file."""
        while self._conditions and self._followed <= hour:
            felt = dict(zip(ROOM_QUANTITIES, self._felt(self._followed), strict=True))
            levels: dict[Condition, int] = {}
            for one in self._conditions:
                one.follow(felt, levels, self._followed)
                levels[one.condition] = one.level
            self._followed += 1
        now = {one.condition: one.level for one in self._conditions}
        key = tuple(now[one] for one in self._read)
        if key not in self._by_rules:
            planned, levels = predicts(self.year.by_file), dict(zip(self._read, key, strict=True))
            states = predictive_states(self.year) if planned else self.year.by_rules(levels)
            self._by_rules[key] = states
        return tuple(self._by_rules[key][hour].tolist())

    def _heat_of(self, states: tuple[int, ...]) -> ZoneHeat:
        if states not in self._heat:
            self._heat[states] = self.year.heat(states)
        return self._heat[states]


def _felt_in(zone: SteppedZone) -> tuple[float, float, float, float]:
    load = zone.load_w
    return zone.air_c, zone.operative_c, max(-load, 0.0), max(load, 0.0)


def controlled_states(
    room: RoomInputs, light: RoomLight, outdoors: SeasonalOutdoors, *, progress: Progress = silent
) -> StateArray:
    """The state of each window group in every hour [H, G], by a function or by plans.

    Raises: `ControlError` for a state that a group does not have, naming the hour.
    """
    hours, controller = room.skies.hours, room.controller
    year = ControlYear(room, light, outdoors)
    if controller is None:
        return predictive_states(year, progress=progress)[:, room.windows.control]
    run, followed = ControlRun(year), room.followed
    previous = (0,) * len(run.year.groups)
    for h in range(hours):
        hour = ControlHour(run, h, previous)
        states = controller(hour)
        try:
            previous = run.year.combination(states, previous)
        except ValueError as error:
            raise ControlError(f"control at {hour.time:%m-%d %H:%M}: {error}") from None
        if followed:
            previous = tuple(int(followed[c].states[h]) if c in followed else s for c, s in enumerate(previous))
        run.states.append(previous)
        if h % AT_A_TIME == 0:
            progress("control", h / hours)
    return np.array(run.states, dtype=np.int64)[:, room.windows.control]
