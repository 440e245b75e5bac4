"""How honeybee and gbXML files say that rooms are used, against values by hand."""

from __future__ import annotations

import datetime
import re

import numpy as np
import pytest
from test_read_gbxml import two_rooms as gbxml_rooms

from bim.gbxml.building import read_gbxml
from bim.gbxml.document import SI
from bim.honeybee.building import read_honeybee
from bim.honeybee.use import sensible_heat
from bim.report.issue import Phrase
from bim.use import KINDS, YearSchedule, day_of_year, hourly_means
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, odd_values, refusals
from tests.bim.honeybee_models import used_model, write
from tests.issues import of_code


def of_day(schedule: YearSchedule, month: int, day: int, kind: str) -> np.ndarray:
    """Hourly values of a date that is such a day."""
    return schedule.values[day_of_year(month, day), KINDS.index(kind)]


@pytest.fixture
def building(tmp_path):
    return read_honeybee(write(used_model(), tmp_path))


def test_a_ruleset_holds_by_date_and_day(building):
    """By hand: from 8:30 on is half of the hour from 8; the first rule that holds goes."""
    share = building.uses["Office"].persons.share
    work = of_day(share, 3, 3, "tuesday")
    np.testing.assert_allclose(work[[7, 8, 9, 17, 18]], [0.1, 0.55, 1.0, 1.0, 0.2])
    np.testing.assert_allclose(of_day(share, 7, 15, "monday"), 0.5)
    np.testing.assert_allclose(of_day(share, 7, 15, "tuesday"), work)
    np.testing.assert_allclose(of_day(share, 9, 1, "monday"), work)
    assert not of_day(share, 3, 3, "sunday").any() and not of_day(share, 3, 3, "holiday").any()


def test_rules_before_the_default_may_go_over_the_years_end(tmp_path):
    model = used_model()
    rule = model["properties"]["energy"]["schedules"][0]["schedule_rules"][0]
    rule |= {"start_date": [12, 1], "end_date": [1, 31]}
    share = read_honeybee(write(model, tmp_path)).uses["Office"].persons.share
    for month, summer in ((1, True), (12, True), (2, False), (11, False)):
        assert bool(of_day(share, month, 5, "monday")[0] == 0.5) is summer


def test_values_at_fixed_intervals_are_means_of_hours(building):
    cool = building.uses["Office"].cooling_c
    assert np.ptp(cool.values) == 0 and cool.values[0, 0, 0] == 25.0


def test_fixed_values_start_on_their_date(tmp_path):
    """By hand: of a year that is no leap year, from 28 February on, a value a day."""
    model = used_model()
    held = model["properties"]["energy"]["schedules"][2]
    days = np.repeat(np.arange(20.0, 20.0 + 365 / 100, 0.01)[:365], 24)
    held |= {"timestep": 1, "start_date": [2, 28], "values": days.tolist()}
    cool = read_honeybee(write(model, tmp_path)).uses["Office"].cooling_c
    first = datetime.date(2023, 2, 28)
    for number in (0, 1, 100, 364):
        at = first + datetime.timedelta(days=number)
        assert of_day(cool, at.month, at.day, "friday")[3] == pytest.approx(20 + number / 100)


def test_loads_are_those_of_the_room_else_of_its_program(building):
    """By hand, of 40 and 32 m2; half of the gas is lost; outdoors 40 + 15 + 15 + 24 m2 of 3 m."""
    office, hall = building.uses["Office"], building.uses["Hall"]
    assert (office.persons.peak, hall.persons.peak) == pytest.approx((4.0, 3.2))
    assert office.person_w == pytest.approx(90.0)  # 120 W, a quarter latent
    assert office.person_vapour_g_h == pytest.approx(30.0 / 2.43e6 * 3.6e6)
    assert (office.lighting_w.peak, hall.lighting_w.peak) == pytest.approx((120.0, 256.0))
    noon = of_day(office.equipment_w.share, 3, 3, "tuesday")[12]
    assert office.equipment_w.peak * noon == pytest.approx(40 * (5.0 + 2.0 * 0.5))
    assert office.infiltration_m3_s.peak == pytest.approx(3e-4 * (40 + 15 + 15 + 24))
    assert office.infiltration_factors == (0.6, 0.0, 0.2, 0.0)
    assert office.ventilation_m3_s.peak == pytest.approx(0.01 * 4 + 1e-4 * 40)
    assert office.heat_recovery == 0.7 and office.heating_limit_w == 900.0
    assert np.unique(office.heating_c.values) == 21.0


def test_a_room_without_a_system_is_not_kept_at_its_set_points(building):
    hall = building.uses["Hall"]
    assert hall.heating_c is None and hall.cooling_c is None and not hall.ventilation_m3_s.peak
    (points,) = of_code(building, "set-points-without-system")
    assert points.values["rooms"] == ("Hall",)
    (water,) = (i for i in of_code(building, "load-not-used") if i.values["rooms"] == ("Office",))
    assert water.values["load"] == Phrase("service_hot_water")


def test_dry_heat_of_people_is_energyplus_own():
    """Engineering Reference, "People": 120 W at 24 degC, its equation by hand; 0 and all."""
    assert sensible_heat(120.0) == pytest.approx(69.5, abs=0.1)
    assert sensible_heat(120.0, 36.0) < 30 < 95 < sensible_heat(120.0, 15.0)


def test_parts_of_hours_are_means():
    np.testing.assert_allclose(hourly_means([0, 7.25], [0.0, 4.0])[6:9], [0.0, 3.0, 4.0])
    for starts in ([1.0], [0.0, 0.0], [0.0, 24.0], []):
        with pytest.raises(ValueError, match="rising times"):
            hourly_means(starts, [1.0] * len(starts))


def test_odd_schedules_and_loads_give_one_line(tmp_path):
    refused = 0
    for content in odd_values(used_model(), 120):
        try:
            read_honeybee(write(content, tmp_path))
        except DataError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 10


USE = """
<Schedule id="s" type="Fraction"><Name>Office</Name>
 <YearSchedule id="y1"><BeginDate>2019-01-01</BeginDate><EndDate>2019-06-30</EndDate>
  <WeekScheduleId weekScheduleIdRef="w"/></YearSchedule>
 <YearSchedule id="y2"><BeginDate>2019-07-01</BeginDate><EndDate>2019-12-31</EndDate>
  <WeekScheduleId weekScheduleIdRef="w2"/></YearSchedule></Schedule>
<WeekSchedule id="w"><Day dayType="All" dayScheduleIdRef="half"/>
 <Day dayType="Weekday" dayScheduleIdRef="day"/></WeekSchedule>
<WeekSchedule id="w2"><Day dayType="All" dayScheduleIdRef="half"/>
 <Day dayType="CoolingDesignDay" dayScheduleIdRef="day"/></WeekSchedule>
<DaySchedule id="half"><ScheduleValue>0.5</ScheduleValue></DaySchedule>
<DaySchedule id="day"><ScheduleValue>0</ScheduleValue><ScheduleValue>1</ScheduleValue>
 </DaySchedule>
<Schedule id="t" type="Temp"><YearSchedule id="y3"><WeekScheduleId weekScheduleIdRef="w3"/>
 </YearSchedule></Schedule>
<WeekSchedule id="w3"><Day dayType="All" dayScheduleIdRef="warm"/></WeekSchedule>
<DaySchedule id="warm"><ScheduleValue>21</ScheduleValue></DaySchedule>
<Zone id="z" heatSchedIdRef="t"><DesignCoolT unit="F">77</DesignCoolT>
 <OAFlowPerPerson unit="CFM">20</OAFlowPerPerson></Zone>
"""
LOADS = """<PeopleNumber unit="SquareMPerPerson">10</PeopleNumber>
<PeopleHeatGain unit="BtuPerHourPerson" heatGainType="Total">450</PeopleHeatGain>
<PeopleHeatGain unit="BtuPerHourPerson" heatGainType="Sensible">250</PeopleHeatGain>
<LightPowerPerArea unit="WattPerSquareFoot">1</LightPowerPerArea>
<EquipPowerPerArea unit="WattPerSquareMeter">7</EquipPowerPerArea>
<InfiltrationFlowPerArea unit="LPerSecPerSquareM">0.2</InfiltrationFlowPerArea>"""


def used_gbxml() -> str:
    """The rooms of which the office has loads, a zone and schedules."""
    refers = 'zoneIdRef="z" peopleScheduleIdRef="s" lightScheduleIdRef="s"'
    text = gbxml_rooms()
    start = text.index('<Space id="Office"')
    end = text.index(">", start)
    text = f"{text[:end]} {refers}>{LOADS}{text[end + 1 :]}"
    return text.replace("</gbXML>", f"{USE}</gbXML>")


def test_spaces_and_zones_of_gbxml_state_their_use(tmp_path):
    """By hand: 40 m2, 4 people; 1 Btu/h = 0.29307 W; 1 ft2 = 0.092903 m2; 77 F = 25 C."""
    path = tmp_path / "used.xml"
    path.write_text(used_gbxml())
    uses = read_gbxml(path).uses
    use = uses["Office"]
    assert "Hall" not in uses
    assert use.persons.peak == pytest.approx(4.0)
    assert use.person_w == pytest.approx(250 * 0.29307107)
    assert use.person_vapour_g_h == pytest.approx(200 * 0.29307107 / 2.43e6 * 3.6e6)
    assert use.lighting_w.peak == pytest.approx(40 / 0.09290304)
    assert use.equipment_w.peak == 280 and use.equipment_w.share is None
    assert use.infiltration_m3_s.peak == pytest.approx(2e-4 * (40 + 15 + 15 + 24))
    assert use.ventilation_m3_s.peak == pytest.approx(4 * 20 * 4.71947443e-4)
    assert np.unique(use.heating_c.values) == 21 and np.unique(use.cooling_c.values) == 25
    share = use.persons.share
    np.testing.assert_allclose(of_day(share, 3, 3, "friday")[[11, 12]], [0, 1])
    assert np.unique(of_day(share, 3, 3, "sunday")) == 0.5
    assert np.unique(of_day(share, 8, 3, "friday")) == 0.5


@pytest.mark.parametrize(
    ("old", "new", "where", "reason", "lost"),
    [
        ("WattPerSquareFoot", "Candles", "Space Office", "unit 'Candles'", "lighting_w"),
        ('weekScheduleIdRef="w2"', 'weekScheduleIdRef="w9"', "YearSchedule y2", "no WeekSchedule", "persons"),
        ('dayType="Weekday"', 'dayType="Payday"', "WeekSchedule w", "'Payday'", None),
        ("2019-07-01", "2019-02-31", "YearSchedule y2", "expected YYYY-MM-DD", None),
        ('unit="F"', 'unit="Re"', "Zone z", "temperature unit 'Re'", "cooling_c"),
        ("<ScheduleValue>21</ScheduleValue>", "", "DaySchedule warm", "holds 0", "heating_c"),
    ],
)
def test_a_use_that_cannot_be_read_is_an_issue_and_the_rest_is_used(tmp_path, old, new, where, reason, lost):
    path = tmp_path / "used.xml"
    text = used_gbxml()
    assert old in text
    path.write_text(text.replace(old, new))
    building = read_gbxml(path)
    issues = [one for one in building.issues if one.code == "value-not-read"]
    assert where in {one.where for one in issues}
    assert any(reason in one.values["reason"] for one in issues)
    (use,) = building.uses.values()
    if lost is not None:
        assert getattr(use, lost) is None
    assert use.equipment_w is not None


def test_a_flow_in_cubic_metres_a_second_is_read(tmp_path):
    """The unit of two of the format's own test models."""
    text = used_gbxml().replace(
        '<PeopleNumber unit="SquareMPerPerson">10</PeopleNumber>',
        '<PeopleNumber unit="SquareMPerPerson">10</PeopleNumber>'
        '<InfiltrationFlowPerArea unit="CubicMPerSecPerSquareM">0.0003</InfiltrationFlowPerArea>',
    )
    path = tmp_path / "used.xml"
    path.write_text(text)
    building = read_gbxml(path)
    ((guid, use),) = building.uses.items()
    (space,) = [one for one in building.spaces if one.guid == guid]
    outside = sum(face.area for face in space.faces if face.adjacency == "outside")
    outside += sum(window.area for window in space.windows)
    assert use.infiltration_m3_s.peak == pytest.approx(0.0003 * outside)


def test_random_bytes_of_gbxmls_use_give_one_line(tmp_path):
    path = tmp_path / "spoilt.xml"
    text = used_gbxml()
    start = text.index("<Schedule ")
    spoilt = (text[:start].encode() + tail for tail in mutations(text[start:].encode(), 60))
    refused = refusals(path, spoilt, read_gbxml)
    assert refused > 20


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("LPerSecPerSquareM", 1e-3),
        ("CFMPerSquareFoot", 5.08e-3),  # 0.3048 m a minute: 0.3048 / 60
        ("CubicMPerHourPerSquareM", 1 / 3600),
        ("CubicMPerSecPerSquareM", 1.0),
    ],
)
def test_flows_per_area_have_the_sizes_of_their_units(unit, factor):
    """A foot of air a minute through each area; its units inverted gave 116 times as much."""
    assert SI["InfiltrationFlowPerArea"][unit] == pytest.approx(factor, rel=1e-6)
    assert SI["OAFlowPerArea"][unit] == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize("changes", [0.0, 0.005, 2.0])
def test_air_changes_of_gbxml_are_of_the_rooms_volume(tmp_path, changes):
    """40 m2 of 3 m: so many times 120 m3 an hour, in place of what the zone states by person."""
    people = '<PeopleNumber unit="SquareMPerPerson">10</PeopleNumber>'
    path = tmp_path / "used.xml"
    stated = f"{people}<AirChangesPerHour>{changes}</AirChangesPerHour>"
    path.write_text(used_gbxml().replace(people, stated))
    building = read_gbxml(path)
    (use,) = building.uses.values()
    assert "value-not-read" not in {one.code for one in building.issues}
    assert use.ventilation_m3_s.peak == pytest.approx(changes * 120.0 / 3600.0)


@pytest.mark.parametrize(("unit", "area"), [("SquareMPerPerson", 10.0), ("SquareFtPerPerson", 0.9290304)])
def test_the_floor_of_a_person_has_a_unit(tmp_path, unit, area):
    """10 square feet are 0.929 m2."""
    path = tmp_path / "used.xml"
    path.write_text(used_gbxml().replace('"SquareMPerPerson">10', f'"{unit}">10'))
    building = read_gbxml(path)
    ((guid, use),) = building.uses.items()
    (space,) = [one for one in building.spaces if one.guid == guid]
    assert use.persons.peak == pytest.approx(space.floor_area / area)


@pytest.mark.parametrize(("unit", "text"), [("C", "25"), ("F", "77"), ("K", "298.15"), ("R", "536.67")])
def test_a_design_temperature_has_a_unit(tmp_path, unit, text):
    path = tmp_path / "used.xml"
    path.write_text(used_gbxml().replace('unit="F">77', f'unit="{unit}">{text}'))
    (use,) = read_gbxml(path).uses.values()
    assert use.cooling_c.values == pytest.approx(25.0)


@pytest.mark.parametrize(("kinds", "is_split"), [("Total", False), ("Total Sensible", True), ("Sensible", True)])
def test_heat_of_people_that_is_not_split_is_named(tmp_path, kinds, is_split):
    path, text = tmp_path / "used.xml", used_gbxml()
    for kind in {"Total", "Sensible"} - set(kinds.split()):
        text = re.sub(rf'<PeopleHeatGain[^>]*"{kind}">[^<]*</PeopleHeatGain>', "", text)
    path.write_text(text)
    building = read_gbxml(path)
    assert is_split != ("heat-gain-not-split" in {one.code for one in building.issues})
    (use,) = building.uses.values()
    assert (use.person_w is not None) == is_split
