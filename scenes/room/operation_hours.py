"""Hourly values of an operation file: gains, air, set points, shading states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_tables import OperationTables, operated_tables
from scenes.room.schedules import WEEK, scheduled_fields
from scenes.toml_file import TomlTable
from thermal.control import by_schedule
from thermal.emitters import HeatedSlab, IdealLoads
from thermal.errors import ThermalInputError
from thermal.ventilation import (
    Leakage,
    NeighbourAir,
    SupplyAir,
    WindowAiring,
    cross_flow,
    large_opening,
    single_sided,
    stack_height,
)
from thermal.zone import WindowElement

FloatArray = NDArray[np.float64]


def check_schedules(tables: OperationTables, weather: Weather, file: Path | None = None) -> None:
    """Raise `DataError` for hourly values out of bounds or set points that cross."""
    for variant in tables.variants:
        try:
            OperationHours(variant, weather).check()
        except DataError as error:
            if error.file is not None:
                raise
            raise DataError(error.message, file=file, field=error.field) from None


class OperationHours:
    """Values of a room's tables in every hour of a weather's year."""

    def __init__(self, tables: OperationTables, weather: Weather) -> None:
        first = tables.calendar.starts_on
        if first is not None:
            weather = replace(weather, first_weekday=WEEK.index(first))
        self.tables, self.weather = tables, weather

    def _of(self, part: str, key: str) -> FloatArray | float | None:
        """The values [H] of a schedule, or a constant."""
        return self.value(getattr(self.tables, part), key, part)

    def value(self, table: TomlTable, key: str, place: str) -> FloatArray | float | None:
        """The values [H] of a field of a table, or a constant; `place` is the path of the table."""
        if key not in scheduled_fields(table):
            return getattr(table, key)
        name, limits = scheduled_fields(table)[key]
        calendar = self.tables.calendar
        values = self.tables.schedules[name].hourly(self.weather, calendar.holidays)
        try:
            limits.checked(float(values.min()))
            limits.checked(float(values.max()))
        except ValueError as error:
            raise DataError(f"schedule {name!r}: {error}", field=f"{place}.{key}") from None
        return values

    def _while_occupied(self, part: str, key: str) -> FloatArray:
        """The values [H] of a schedule, or a constant in the hours with people."""
        value = self._of(part, key)
        return value if isinstance(value, np.ndarray) else value * self.present

    @cached_property
    def present(self) -> FloatArray:
        """Share of the people that is present [H]; multiplies constant gains and air."""
        value = self._of("gains", "occupied")
        if isinstance(value, np.ndarray):
            return value
        return working_hours(self.weather, *value).astype(float)

    def heat(self, floor_area: float) -> FloatArray:
        """Heat of people and equipment [H] [W]."""
        people = self._while_occupied("gains", "persons") * self.tables.gains.person_w
        return self.equipment(floor_area) + people

    def equipment(self, floor_area: float) -> FloatArray:
        """Power of equipment [H] [W]."""
        return self._while_occupied("gains", "equipment_w_m2") * floor_area

    def vapour(self) -> FloatArray:
        """Vapour of people and other sources [H] [kg/s]."""
        people = self._while_occupied("gains", "persons") * self.tables.gains.person_vapour_g_h
        return (people + self._while_occupied("gains", "vapour_g_h")) / 3.6e6

    def lamps(self, floor_area: float) -> FloatArray:
        """Power of the lamps without daylight [H] [W]."""
        return self._while_occupied("gains", "lighting_w_m2") * floor_area

    def outdoor_air(self) -> dict[str, Any]:
        """Outdoor air except through opened windows, and neighbours' air, as fields of a zone."""
        night, air = self._of("air", "night_ach"), self.tables.air
        if not isinstance(night, np.ndarray):
            night = night * working_hours(self.weather, *air.night)
        fan = SupplyAir(
            self._while_occupied("air", "ventilation_ach"),
            self._of("air", "supply_c"),
            recovery=air.heat_recovery,
            bypass_above_c=np.inf if air.bypass_above_c is None else air.bypass_above_c,
            least_c=-np.inf if air.least_supply_c is None else air.least_supply_c,
        )
        leaks = Leakage() if air.leakage is None else air.leakage.leakage()
        return {
            "infiltration_ach": self._of("air", "infiltration_ach"),
            "leakage": replace(leaks, factors=air.infiltration_factors),
            "other_air_ach": night,
            "supply": fan,
            "beside": tuple(map(self._neighbour_air, range(len(air.neighbour)))),
        }

    def _neighbour_air(self, number: int) -> NeighbourAir:
        """The air exchanged with a neighbour."""
        table, place = self.tables.air.neighbour[number], f"air.neighbour.{number}"
        beyond, share, flow = (
            self.value(table, key, place) for key in ("temperature_c", "open", "m3_h")
        )
        buoyant = 0.0
        if table.width is not None:
            buoyant = large_opening(table.width, table.height, discharge=table.discharge)
        return NeighbourAir(beyond, flow / 3600.0, buoyant, share)

    def airing(self, windows: Sequence[WindowElement]) -> WindowAiring | None:
        """Airing by opened windows; None if no window is opened."""
        table = self.tables.air.windows
        if table is None or not windows:
            return None
        share = self.value(table, "share", "air.windows")
        if not isinstance(share, np.ndarray) and table.when == "occupied":
            share = share * (self.present > 0)
        half = np.array([0.5 * w.glazing_height for w in windows])
        middle, areas = np.array([w.height for w in windows]), [w.area for w in windows]
        height = stack_height(middle - half, middle + half)
        if table.flow == "cross":
            azimuth = [np.degrees(np.arctan2(w.normal[0], w.normal[1])) for w in windows]
            wind, stack = cross_flow(areas, azimuth, height)
        else:
            wind, stack = single_sided(sum(areas), height)
        return WindowAiring(
            wind,
            stack,
            both=table.flow == "cross",
            share=share,
            open_above_c=table.open_above_c,
            close_below_c=table.close_below_c,
            least_difference=table.least_difference,
            greatest_wind=table.greatest_wind,
            least_outdoor_c=table.least_outdoor_c,
            heating_while_open=table.heating_while_open,
        )

    def states(self, count: int) -> NDArray[np.int64]:
        """Shading states of the rule "schedule" [H] for windows with `count` states."""
        control = self.tables.control
        if not isinstance(control.schedule, str):
            return by_schedule(control.schedule, len(self.weather.times))
        values = self._of("control", "schedule")
        if not np.isin(values, range(count)).all():  # of a CSV file
            message = f"schedule {control.schedule!r}: a state outside 0 to {count - 1}"
            raise DataError(message, field="control.schedule")
        return values.astype(np.int64)

    def loads(self) -> IdealLoads:
        """Set points and limits; without a set point never, without a limit unlimited."""
        infinity, stated = float("inf"), self.tables.loads
        heating, cooling = (self._of("loads", key) for key in ("heating_c", "cooling_c"))
        return IdealLoads(
            -infinity if heating is None else heating,
            infinity if cooling is None else cooling,
            stated.heating_limit_w or infinity,
            stated.cooling_limit_w or infinity,
            stated.heating_radiant,
            stated.cooling_radiant,
        )

    def slab(self, surface: str, area: float) -> HeatedSlab:
        """The heated slab of `loads.slab` in a surface of the room.

        Args: surface: its name; area: of the surface [m2].
        """
        table, place = self.tables.loads.slab, "loads.slab"
        heating, cooling = (self.value(table, k, place) for k in ("heating_c", "cooling_c"))
        return HeatedSlab(
            surface,
            table.depth,
            -np.inf if heating is None else heating,
            np.inf if cooling is None else cooling,
            table.heating_w_m2 * area,
            table.cooling_w_m2 * area,
            table.band,
        )

    def check(self) -> None:
        """Raise `DataError` for the first impossible value."""
        for place, table in operated_tables(self.tables):
            for key in scheduled_fields(table):
                self.value(table, key, place)
        try:
            self.loads()
        except ThermalInputError as error:
            raise DataError(error.message, field="loads") from None
