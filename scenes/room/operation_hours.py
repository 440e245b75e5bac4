"""What an operation file says of a room in every hour: gains, air, set points, states."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_tables import PARTS, OperationTables
from scenes.room.schedules import WEEK, scheduled_fields
from thermal.control import by_schedule
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError

FloatArray = NDArray[np.float64]


def check_schedules(tables: OperationTables, weather: Weather, file: Path | None = None) -> None:
    """Raise `DataError` where hourly values are out of bounds or set points cross."""
    for variant in tables.variants:
        try:
            OperationHours(variant, weather).check()
        except DataError as error:
            if error.file is not None:
                raise
            raise DataError(error.message, file=file, field=error.field) from None


class OperationHours:
    """What the tables of a room say of every hour of a weather's year."""

    def __init__(self, tables: OperationTables, weather: Weather) -> None:
        first = tables.calendar.starts_on
        if first is not None:
            weather = replace(weather, first_weekday=WEEK.index(first))
        self.tables, self.weather = tables, weather

    def _of(self, part: str, key: str) -> FloatArray | float | None:
        """The values [H] of a schedule, or the number that stands in its place."""
        table = getattr(self.tables, part)
        if key not in scheduled_fields(table):
            return getattr(table, key)
        name, limits = scheduled_fields(table)[key]
        calendar = self.tables.calendar
        values = self.tables.schedules[name].hourly(self.weather, calendar.holidays)
        try:
            limits.checked(float(values.min()))
            limits.checked(float(values.max()))
        except ValueError as error:
            raise DataError(f"schedule {name!r}: {error}", field=f"{part}.{key}") from None
        return values

    def _while_occupied(self, part: str, key: str) -> FloatArray:
        """The values [H]: a schedule's own, or a number in the hours with people."""
        value = self._of(part, key)
        return value if isinstance(value, np.ndarray) else value * self.present

    @cached_property
    def present(self) -> FloatArray:
        """Share of the people that is there [H]; numbers stated for all hours go with it."""
        value = self._of("gains", "occupied")
        if isinstance(value, np.ndarray):
            return value
        return working_hours(self.weather, *value).astype(float)

    def heat(self, floor_area: float) -> FloatArray:
        """Heat of people and equipment [H] [W]."""
        people = self._while_occupied("gains", "persons") * self.tables.gains.person_w
        return self._while_occupied("gains", "equipment_w_m2") * floor_area + people

    def lamps(self, floor_area: float) -> FloatArray:
        """Power of the lamps without daylight [H] [W]."""
        return self._while_occupied("gains", "lighting_w_m2") * floor_area

    def air_changes(self) -> FloatArray:
        """Outdoor air [H] [1/h]."""
        night = self._of("air", "night_ach")
        if not isinstance(night, np.ndarray):
            night = night * working_hours(self.weather, *self.tables.air.night)
        fan = self._while_occupied("air", "ventilation_ach")
        return self._of("air", "infiltration_ach") + night + fan

    def states(self, count: int) -> NDArray[np.int64]:
        """Shading states of the rule "schedule" [H], of windows that have so many."""
        control = self.tables.control
        if not isinstance(control.schedule, str):
            return by_schedule(control.schedule, len(self.weather.times))
        values = self._of("control", "schedule")
        if not np.isin(values, range(count)).all():  # of a file: stated ones are checked before
            message = f"schedule {control.schedule!r}: a state outside 0 to {count - 1}"
            raise DataError(message, field="control.schedule")
        return values.astype(np.int64)

    def loads(self) -> IdealLoads:
        """Set points and limits; none stated means never, and without limit."""
        infinity, stated = float("inf"), self.tables.loads
        heating, cooling = (self._of("loads", key) for key in ("heating_c", "cooling_c"))
        return IdealLoads(
            -infinity if heating is None else heating,
            infinity if cooling is None else cooling,
            stated.heating_limit_w or infinity,
            stated.cooling_limit_w or infinity,
        )

    def check(self) -> None:
        """Raise `DataError` for the first value that cannot be."""
        for part in PARTS:
            for key in scheduled_fields(getattr(self.tables, part)):
                self._of(part, key)
        try:
            self.loads()
        except ThermalInputError as error:
            raise DataError(error.message, field="loads") from None
