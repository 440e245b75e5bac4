"""A room's demand, energy and humidity, and loads of design days: sums and closed forms."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import WEATHER
from scenes.heat.design_days import design_loads
from scenes.heat.study import energy_by_month, energy_summary, room_powers
from scenes.room.heat import felt_by, outdoor_humidity, room_humidity
from scenes.room.operation_tables import ComfortTable, PlantTable
from scenes.room.zone import RoomServices, RoomZone
from tests.thermal.rooms import CONCRETE, PLASTER
from thermal.climate import no_sun
from thermal.emitters import IdealLoads
from thermal.moisture import Humidity
from thermal.records import AIR_HEAT
from thermal.ventilation import AirTransfer, SupplyAir
from thermal.zone import Gains, Layer, OpaqueSurface, Zone

HOURS = 8760
VOLUME, FLOOR, COLD = 60.0, 20.0, -12.0
HEAVY = (Layer(0.2, 0.04, 30.0, 840.0), CONCRETE)
WINDY_FILMS = 0.15  # [m2 K/W] beside 5 of the insulation


@pytest.fixture(scope="module")
def weather() -> Weather:
    return read_epw(WEATHER)


def room_of(zone: Zone, **services) -> RoomZone:
    """What energy, humidity and design days take of a room in the dark."""
    given = {"equipment": np.full(HOURS, 7.0), "vapour": np.zeros(HOURS)} | services
    dark = no_sun(HOURS, len(zone.surfaces), 0)
    return RoomZone(
        SimpleNamespace(floor_area=FLOOR),
        SimpleNamespace(zone=zone),
        replace(dark, state=np.zeros((HOURS, 0), dtype=np.int64)),
        {},
        np.zeros(HOURS, dtype=np.int64),
        np.full(HOURS, 11.0),
        np.ones(HOURS, dtype=bool),
        None,
        RoomServices(**given),
    )


def zone_of(name: str, layers: tuple[Layer, ...], outside: str, **changes) -> Zone:
    walls = (
        OpaqueSurface("wall", 20.0, layers, np.array([0.0, -1.0, 0.0]), outside),
        OpaqueSurface("floor", 20.0, (PLASTER,), np.array([0.0, 0.0, -1.0]), "adiabatic"),
    )
    return Zone(name, VOLUME, walls, (), **{"infiltration_ach": 0.0} | changes)


def test_design_loads_are_those_of_steady_rooms(weather) -> None:
    """UA dT without gains, limit and set-back, to the end of a heavy wall's warm-up; the gains."""
    hour = np.arange(HOURS) % 24
    lossy = zone_of(
        "lossy",
        HEAVY,
        "outdoor",
        bridges=10.0,
        infiltration_ach=0.5,
        supply=SupplyAir(1.0, recovery=0.8),
        gains=Gains(500.0, 100.0),
        loads=IdealLoads(np.where(hour < 6, 16.0, 21.0), 40.0, heating_limit=100.0),
    )
    sealed = zone_of(
        "sealed", (PLASTER,), "adiabatic", gains=Gains(400.0, 0.0), loads=IdealLoads(15.0, 26.0, cooling_limit=50.0)
    )
    rooms = [room_of(lossy), room_of(sealed)]
    table = design_loads(rooms, weather, outdoor_c=COLD, step_s=3600.0)
    found = table.set_index(["room", "case"])
    density = weather.pressure_pa.mean() / (287.055 * (COLD + 273.15))
    air = density * AIR_HEAT * VOLUME * (0.5 + 0.2 * 1.0) / 3600.0
    wall = 20.0 / (5.0 + CONCRETE.resistance + WINDY_FILMS)
    expected = (10.0 + air + wall) * (21.0 - COLD)
    assert found.loc[("lossy", "heating"), "peak_w"] == pytest.approx(expected, rel=0.01)
    assert found.loc[("sealed", "heating"), "peak_w"] == pytest.approx(0.0, abs=1e-6)
    cooled = found.loc[("sealed", "cooling")]
    assert cooled["peak_w"] == pytest.approx(400.0, rel=0.01)
    assert cooled["peak_w_m2"] == pytest.approx(20.0, rel=0.01)
    assert cooled["outdoor_extreme_c"] > 25.0 and cooled["day"] > "04"
    without = design_loads(rooms[1:], weather, outdoor_c=None, step_s=3600.0)
    assert without["outdoor_mean_c"].iloc[0] == pytest.approx(
        np.sort(weather.dry_bulb_c)[35], abs=0.3
    )  # 0.4 % of 8760 hours are colder


def test_cold_day_has_the_air_of_a_working_day(weather) -> None:
    """The year may begin with a holiday, without a fan; the load to be met is a working day's."""
    ach = np.repeat(np.where(np.arange(365) % 7 == 0, 0.0, 1.0), 24)
    zone = zone_of("office", (PLASTER,), "adiabatic", supply=SupplyAir(ach), loads=IdealLoads(20.0, 30.0))
    table = design_loads([room_of(zone)], weather, outdoor_c=COLD, step_s=3600.0)
    density = weather.pressure_pa.mean() / (287.055 * (COLD + 273.15))
    expected = density * AIR_HEAT * VOLUME / 3600.0 * 32.0
    assert table["peak_w"].iloc[0] == pytest.approx(expected, rel=0.01)


PARTS = {"heating": 100.0, "cooling": 31.0, "coil": 17.0}


def powers_of(weather, slab: float, plant: PlantTable | None = None) -> pd.DataFrame:
    """The powers of a room whose every part is another constant."""
    one = np.ones(HOURS)
    parts = {name: value * one for name, value in PARTS.items()}
    result = SimpleNamespace(**parts, slab=slab * one, fan_air=0.05 * one)
    humidity = Humidity(0.0 * one, 0.5 * one, 3.0 * one, 5.0 * one)
    room = room_of(zone_of("a", HEAVY, "outdoor"), fan_w_m3_s=1000.0)
    return room_powers(room, result, humidity, weather, plant or PlantTable())


def test_heat_and_cold_are_sums_of_all_that_the_plant_gives(weather) -> None:
    heated = powers_of(weather, 40.0).iloc[0]
    assert heated["heat"] == 100.0 + 17.0 + 40.0 + 3.0  # air, coil, slab, vapour
    assert heated["cold"] == 31.0 + 5.0
    cooled = powers_of(weather, -40.0).iloc[0]
    assert cooled["heat"] == 100.0 + 17.0 + 3.0
    assert cooled["cold"] == 31.0 + 40.0 + 5.0
    assert (cooled["slab heating"], cooled["slab cooling"]) == (0.0, 40.0)


def test_final_and_primary_energy(weather) -> None:
    plant = PlantTable(heating_cop=4.0, cooling_cop=3.0, heating_factor=1.8, electricity_factor=2.0)
    table = powers_of(weather, 40.0, plant)
    row = table.iloc[0]
    assert row["final heating"] == 160.0 / 4.0
    assert row["electricity cooling"] == pytest.approx(36.0 / 3.0)
    assert row["electricity fans"] == 50.0
    electricity = 12.0 + 50.0 + 11.0 + 7.0
    assert row["primary"] == pytest.approx(1.8 * 40.0 + 2.0 * electricity)
    months, year = energy_by_month(table, FLOOR), energy_summary(table, FLOOR)
    assert months["heat [kWh]"].loc[2] == pytest.approx(160.0 * 28 * 24 / 1e3)
    assert months["heat [kWh/m2]"].sum() == pytest.approx(160.0 * HOURS / 1e3 / FLOOR)
    assert year["electricity_kwh"] == pytest.approx(electricity * HOURS / 1e3)
    assert (year["peak_heat_w"], year["peak_cold_w"]) == (160.0, 36.0)


def test_air_between_rooms_carries_vapour_one_way(weather) -> None:
    rooms = [
        room_of(zone_of("a", HEAVY, "outdoor"), vapour=np.full(HOURS, 1e-4)),
        room_of(zone_of("b", HEAVY, "outdoor")),
    ]
    one = np.ones(HOURS)
    air = SimpleNamespace(air_c=20.0 * one, outdoor_air=0.02 * one)
    moved = [AirTransfer("a", "b", 0.02)]
    still = room_humidity(rooms, [air, air], weather)
    moist = room_humidity(rooms, [air, air], weather, transfers=moved)
    np.testing.assert_array_equal(moist[0].ratio, still[0].ratio)
    density = weather.pressure_pa / (287.055 * (weather.dry_bulb_c + 273.15))
    more = 1e-4 / (density * 0.02)  # of a above outdoors; b takes as much air from outdoors
    winter = slice(24, 31 * 24)  # in summer vapour condenses
    found = (moist[1].ratio - still[1].ratio)[winter].mean()
    assert found == pytest.approx(more[winter].mean() / 2.0, rel=0.02)
    np.testing.assert_allclose(still[1].ratio.mean(), outdoor_humidity(weather).mean(), rtol=0.02)


def test_a_person_is_in_the_rooms_humidity_but_for_one_stated(weather) -> None:
    one = np.ones(3)
    result = SimpleNamespace(air_c=26.0 * one, mrt_c=26.0 * one)
    humidity = Humidity(0.0 * one, np.array([0.2, 0.5, 0.8]), 0.0 * one, 0.0 * one)
    own = felt_by(ComfortTable(), result, humidity)
    stated = felt_by(ComfortTable(humidity=50.0), result, humidity)
    assert (np.diff(own["pmv"]) > 0.05).all() and (np.diff(stated["pmv"]) == 0.0).all()
    assert own["pmv"][1] == stated["pmv"][1]
    np.testing.assert_allclose(stated["relative_humidity_percent"], [20.0, 50.0, 80.0])
