"""Rules as data: the files, the verdicts that they give, and the faults that they name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics import en17037
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series
from scenes.comply.assess import (
    NOT_COMPUTED,
    NOT_FOR_IT,
    RoomVerdict,
    asked_of,
    assess_building,
    assess_room,
    values_of,
)
from scenes.comply.findings import EyeLight, Findings, GridLight, SeatGlare, calendar_of
from scenes.comply.needs import EyeDays
from scenes.comply.rules import NOT_MET, read_rule, rule_named, rule_names
from scenes.comply.sunlight import SunExposure
from scenes.comply.tables import missed
from scenes.comply.uses import RoomUse
from scenes.comply.view_out import ViewOut
from scenes.demo import WEATHER
from scenes.language.catalogue import TRANSLATED, in_language, translated

OFFICE = RoomUse("office", True, "")
STORE = RoomUse("storage", False, "")


@pytest.fixture(scope="module")
def calendar():
    return calendar_of(read_epw(WEATHER))


def light(open_lx, *, operated=None, direct=None, factor=None):
    open_lx = np.asarray(open_lx, dtype=np.float32)
    count = open_lx.shape[1]
    return GridLight(
        np.zeros((count, 3)),
        open_lx,
        np.zeros_like(open_lx) if direct is None else direct,
        np.zeros(count) if factor is None else np.asarray(factor),
        operated,
    )


def reached(name, findings, use=OFFICE, building=None):
    rule = read_rule(name)
    space = (building or shoebox()).spaces[0]
    values = {name: values_of(rule, findings, rule.parts)}
    return {v.criterion.key: v.reached for v in assess_room({name: rule}, values, space, use)}


@pytest.mark.parametrize("name", rule_names())
def test_each_rule_is_whole(name):
    rule = read_rule(name)
    assert rule.title and rule.edition and all(rule.source)
    keys = [criterion.key for criterion in rule.criterion]
    assert len(set(keys)) == len(keys)
    for criterion in rule.criterion:
        assert criterion.clause and all(need.words for need in criterion.needs)
        for level in criterion.level:
            assert level.over != "area mean" or len(level.needs) == 1


@pytest.mark.parametrize("language", TRANSLATED)
def test_included_and_left_out_parts_are_translated(language):
    """A German dossier has no English sentence; sources alone are quoted."""
    rules = [read_rule(name) for name in rule_names()]
    sentences = {text for rule in rules for text in (*rule.included, *rule.left_out)}
    with in_language(language):
        assert not {text for text in sentences if translated(Note(text)) == text}


def test_daylight_factors_are_those_of_table_a3(calendar):
    """London, 14,100 lx: 2.1, 3.5, 5.3 % and 0.7, 2.1, 3.5 %, as printed; half of it is enough."""
    london = replace(calendar, median_diffuse=14_100.0)
    printed = {"minimum": (2.1, 0.7), "medium": (3.5, 2.1), "high": (5.3, 3.5)}
    rule = next(c for c in read_rule("en17037").criterion if c.key == "daylight_factor")
    for level in rule.level:
        limits = [100 * need.at_least / 14_100 for need in level.needs]
        assert tuple(round(v, 1) for v in limits) == printed[level.name]
    for name, (target, least) in printed.items():
        factor = np.array([target] * 10 + [least] * 9 + [0.0]) / 100
        findings = Findings(london, light(np.zeros((8760, 20)), factor=factor + 0.0005))
        assert reached("en17037", findings)["daylight_factor"] == name
        factor[9] = least / 100  # 45 % of the area alone has the target
        findings = Findings(london, light(np.zeros((8760, 20)), factor=factor + 0.0005))
        assert reached("en17037", findings)["daylight_factor"] != name


def test_a_weather_file_without_illuminance_has_its_median_by_efficacy():
    """By the efficacy that gives Reykjavik's printed median: tests/metrics/test_outdoor.py."""
    weather = read_epw(WEATHER)
    stated = calendar_of(weather)
    derived = calendar_of(replace(weather, diffuse_horizontal_illuminance=None))
    assert stated.stated_illuminance and not derived.stated_illuminance
    assert stated.median_diffuse == 15_900.0  # of the file's column
    expected = en17037.median_diffuse(sky_series(weather).diffuse_horizontal, stated.daylight)
    assert derived.median_diffuse == expected != stated.median_diffuse


def test_rooflights_have_a_table_of_their_own(calendar):
    """500 lx on 96 % of the plane: high for no wall opening without its minimum target."""
    lux = np.full((8760, 50), 500.0)
    lux[:, :2] = 0.0
    roof = shoebox(windows=[WindowRectangle(1, 1, 2, 2, side="ceiling")])
    findings = Findings(calendar, light(lux))
    assert reached("en17037", findings, building=roof)["provision_roof"] == "medium"
    assert reached("en17037", findings, building=roof)["provision"] == NOT_FOR_IT
    assert reached("en17037", findings)["provision"] == "medium"
    assert reached("en17037", findings)["provision_roof"] == NOT_FOR_IT


@pytest.mark.parametrize(
    ("hours", "level"), [(1.49, NOT_MET), (1.5, "minimum"), (2.99, "minimum"), (3.0, "medium"), (4.0, "high")]
)
def test_levels_of_sunlight(calendar, hours, level):
    sun = SunExposure((), ((600.0, 600.0 + 60 * hours),))
    assert reached("en17037", Findings(calendar, sun=sun))["sunlight"] == level


def test_view_wants_all_three_at_one_eye(calendar):
    """Three of four eyes have the angle, two of four the distance, one both: not met."""
    angle, distance = np.array([60.0, 60, 60, 5]), np.array([3.0, 3, 90, 90])
    view = ViewOut(np.zeros((4, 3)), angle, distance, np.ones((4, 3), dtype=bool))
    assert reached("en17037", Findings(calendar, view=view))["view_out"] == NOT_MET
    wide = ViewOut(np.zeros((4, 3)), np.array([28.0, 28, 28, 5]), distance + 90, view.layers)
    assert reached("en17037", Findings(calendar, view=wide))["view_out"] == "medium"


@pytest.mark.parametrize(
    ("share", "value", "level"),
    [(0.05, 0.46, "minimum"), (0.05, 0.41, "medium"), (0.05, 0.36, "high"), (0.06, 0.46, NOT_MET)],
)
def test_levels_of_glare(calendar, share, value, level):
    """The rest of the hours is at the level's own limit, which does not count as above."""
    base = {"minimum": 0.45, "medium": 0.40, "high": 0.35}.get(level, 0.2)
    dgp = np.full(1000, base)
    dgp[: int(1000 * share)] = value
    calm = np.full(len(dgp), 0.1)
    seats = SeatGlare(np.zeros((2, 3)), np.zeros((2, 3)), np.stack([calm, dgp]), True)
    assert reached("en17037", Findings(calendar, glare=seats))["glare"] == level  # the worse seat


def test_what_was_not_computed_is_no_failure(calendar):
    found = reached("en17037", Findings(calendar))
    assert found["glare"] == found["view_out"] == found["provision"] == NOT_COMPUTED


def test_sda_is_of_operated_blinds(calendar):
    """300 lx with the blinds open in all hours, with operated ones on half of the points."""
    lux = np.full((8760, 10), 300.0, dtype=np.float32)
    operated = lux.copy()
    operated[:, 6:] = 299.0
    found = reached("lm83", Findings(calendar, light(lux, operated=operated)))
    assert found["sda"] == "nominally accepted"
    assert reached("lm83", Findings(calendar, light(lux)))["sda"] == NOT_COMPUTED


def test_clear_hours_of_the_equinoxes(calendar):
    """Two days, each with the interval before and after the clock hour."""
    hours = calendar.clear_hours(9)
    times = calendar.times[hours]
    assert len(hours) == 4 and set(times.hour) == {8, 9} and set(times.minute) == {30}
    assert {t.month for t in times} <= {3, 4, 9, 10}


def test_a_sentence_names_what_is_missed_alone():
    """Half of the plane has its 310 lx; 95 % of it have 50 lx."""
    rule = read_rule("en17037")
    criterion = rule.criterion[0]
    verdict = RoomVerdict("en17037", criterion, True, ((310.0, 50.0),) * 3)
    (text,) = missed({"en17037": rule}, SimpleNamespace(verdicts=(verdict,)))
    assert text.startswith("EN 17037:2018+A1:2021, Daylight provision")
    assert "95 % of the reference plane" in text and "50 lx, required ≥ 100 lx for minimum" in text
    assert "310 lx" not in text


def test_the_clear_day_has_most_direct_sun(calendar):
    """Of 31 days about 21 March and 21 September: the 80th and the 264th day of the year."""
    days = np.reshape(read_epw(WEATHER).direct_normal, (365, 24)).sum(axis=1)
    for found, equinox in zip(calendar.clear_days, (80, 264), strict=True):
        first = equinox - 15
        assert found.day_of_year == first + int(np.argmax(days[first - 1 : equinox + 15]))


def test_option_2_counts_points_that_keep_both_hours(calendar):
    lux = np.full((8760, 10), 1000.0)
    lux[calendar.clear_hours(9), :2] = 200.0
    lux[calendar.clear_hours(15), 1:4] = 4000.0  # the mean of the two days and hours
    rule = read_rule("leed-v4.1")
    found = values_of(rule, Findings(calendar, light(lux)), frozenset({"open"}))
    (value,) = {v for need, v in found.items() if need.what == "equinox"}
    assert value == pytest.approx(0.6)


def test_breeam_counts_hours_of_the_year(calendar):
    """300 lx as a mean for 2000 hours and 90 lx at the worst point; the use decides."""
    lux = np.zeros((8760, 4))
    lux[:2000] = [390.0, 390.0, 330.0, 90.0]
    assert reached("breeam-hea01", Findings(calendar, light(lux)))["offices"] == "2 credits"
    lux[1999, 3] = 89.0  # the worst point alone
    lux[1999, :3] = 400.0
    assert reached("breeam-hea01", Findings(calendar, light(lux)))["offices"] == NOT_MET
    lux[1999] = 0.0
    found = reached("breeam-hea01", Findings(calendar, light(lux)))
    assert found["offices"] == NOT_MET and found["dwellings"] == NOT_FOR_IT


def test_sales_areas_are_counted_by_points(calendar):
    """200 lx for 2650 h on 4 of 10 points is enough, whatever the worst has; on 3 it is not."""
    shop, lux = RoomUse("retail", True, ""), np.zeros((8760, 10))
    lux[:2650, :4] = 200.0
    assert reached("breeam-hea01", Findings(calendar, light(lux)), use=shop)["sales"] == "1 credit"
    lux[2649, 3] = 199.0
    assert reached("breeam-hea01", Findings(calendar, light(lux)), use=shop)["sales"] == NOT_MET


def test_rooms_that_are_not_occupied_are_left_out(calendar):
    findings = Findings(calendar, light(np.zeros((8760, 2))))
    assert reached("leed-v4.1", findings, use=STORE)["option_1"] == NOT_FOR_IT


def test_the_building_is_a_mean_over_the_floor_area(calendar):
    """sDA 100 % on 10 m2 and 0 % on 30 m2: 25 %; a room without values leaves it open."""
    rule = read_rule("leed-v4.1")
    criterion = rule.criterion[0]
    each = rule.criterion[1]

    def room(value):
        return [
            RoomVerdict("leed-v4.1", criterion, True, ((value,),) * 3),
            RoomVerdict("leed-v4.1", each, True, ((value,),)),
        ]

    mean, all_rooms = assess_building([room(1.0), room(0.0)], [10.0, 30.0])
    assert mean.values == pytest.approx([0.25] * 3) and mean.reached == NOT_MET
    assert all_rooms.values == pytest.approx([0.25]) and all_rooms.reached == NOT_MET
    mean, all_rooms = assess_building([room(1.0), room(0.55)], [10.0, 30.0])
    assert mean.reached == "2 points" and all_rooms.reached.startswith("1 additional point")
    mean, _ = assess_building([room(1.0), room(None)], [10.0, 30.0])
    assert mean.reached == NOT_COMPUTED


def test_en_17037_is_for_occupied_rooms(calendar):
    """Its scope: rooms that people use regularly; a store fails nothing."""
    findings = Findings(calendar, light(np.zeros((8760, 2))), sun=SunExposure((), ()))
    assert set(reached("en17037", findings, use=STORE).values()) == {NOT_FOR_IT}
    assert reached("en17037", findings)["sunlight"] == NOT_MET


def test_what_the_rules_of_a_room_ask():
    """Nobody rates the glare of a store, nor the heat of a corridor: both take long."""
    rules = {name: read_rule(name) for name in ("en17037", "din4108-2")}
    space = shoebox().spaces[0]
    assert asked_of(rules, space, OFFICE) == {"open", "view", "sun", "glare", "heat"}
    assert asked_of(rules, space, STORE) == frozenset()
    assert "heat" not in asked_of(rules, space, RoomUse("workshop", True, ""))


def test_a_share_of_the_floor_area(calendar):
    """BREEAM: 80 % of the area of the offices."""
    criterion = read_rule("breeam-hea01").criterion[0]

    def room(hours):
        return [RoomVerdict("breeam-hea01", criterion, True, ((hours, 3000.0),))]

    (verdict,) = assess_building([room(2000.0), room(1999.0)], [80.0, 20.0])
    assert verdict.values == pytest.approx([0.8]) and verdict.reached == "2 credits"
    (verdict,) = assess_building([room(2000.0), room(1999.0)], [79.0, 21.0])
    assert verdict.reached == NOT_MET


FILE = """
title = "Own"
edition = "1"
source = ["mine"]
grid = {{height = 0.8, margin = 0.5}}
[[criterion]]
key = "a"
title = "A"
clause = "1"
[[criterion.level]]
name = "yes"
{level}
"""


@pytest.mark.parametrize(
    ("level", "said"),
    [
        ('needs = [{what = "sun_hours", at_least = 2, at_most = 3}]', "either at_least or at_most"),
        ('needs = [{what = "sun_hours"}]', "either at_least or at_most"),
        ('needs = [{what = "sun_hours", at_leats = 2}]', "at_leats: no such key"),
        ('needs = [{what = "moon_hours", at_least = 2}]', "criterion.0.level.0.needs.0"),
        ('over = "area of rooms"\nneeds = [{what = "sun_hours", at_least = 2}]', "share belong"),
        ("needs = []", "at least 1 entries"),
    ],
)
def test_a_fault_of_a_rule_file_is_one_line(tmp_path, level, said):
    path = tmp_path / "own.toml"
    path.write_text(FILE.format(level=level))
    with pytest.raises(DataError, match=r"own\.toml") as fault:
        read_rule(str(path))
    assert said in str(fault.value)


def test_an_own_rule_file_is_read(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(FILE.format(level='needs = [{what = "sun_hours", at_least = 2}]'))
    assert read_rule(str(path)).criterion[0].level[0].name == "yes"
    with pytest.raises(DataError, match="no rule 'en17073'"):
        read_rule("en17073")


@pytest.mark.parametrize(
    "written, rule",
    [
        ("EN 17037", "en17037"),
        ("DIN 4108-2", "din4108-2"),
        ("WELL v2", "well-v2"),
        ("LEED", "leed-v4.1"),
        ("LM-83", "lm83"),
    ],
)
def test_a_standard_is_named_as_it_is_written(written, rule):
    assert rule_named(written) == rule
    assert read_rule(written) == read_rule(rule)


@pytest.mark.parametrize(
    "written, said", [("WELL", "may be each of well-v2, well-v2-l03"), ("LM-83-23", "no rule"), ("--", "no rule")]
)
def test_a_name_that_means_no_single_rule_is_refused(written, said):
    with pytest.raises(DataError, match=said):
        rule_named(written)


def test_size_of_a_cell():
    """EN 12464-1 tabulates p: 0.5 m at 1 m, 1.0 m at 2.7 m, 2.5 m at 10 m, 5 m at 27 m... 10 m."""
    for d, p in ((1.0, 0.5), (10.0, 2.5), (100.0, 10.0), (1000.0, 10.0)):
        assert en17037.greatest_cell(d, 0.9 * d) == pytest.approx(p)
    assert en17037.greatest_cell(10.0, 1.0) == pytest.approx(0.5)
    assert en17037.greatest_cell(1.0, 10.0) == pytest.approx(0.5)
    with pytest.raises(ValueError, match="two sides"):
        en17037.greatest_cell(1.0, 0.0)


def eye_light(calendar, melanopic, lamps=None):
    """Light at the eye of a day's 24 values, every day, used from 8 to 18 o'clock."""
    day = np.tile(np.asarray(melanopic, dtype=float), 365)
    hour = np.tile(np.arange(24), 365)
    both = None if lamps is None else np.array([lamps, lamps], dtype=float)
    return Findings(calendar, eye=EyeLight(np.stack([day, day]), both, (hour >= 8) & (hour < 18)))


def test_light_at_the_eye_lasts_without_a_break(calendar):
    """Two hours on end; an interruption, an hour before use and one too few do not count."""
    kept = [0] * 9 + [400, 400] + [0] * 13
    broken = [400] * 9 + [0, 400, 0, 400] + [0] * 11
    assert reached("ul-24480", eye_light(calendar, kept))["day"] == "about 350 lx (warm light)"
    assert reached("ul-24480", eye_light(calendar, [v * 0.6 for v in kept]))["day"] == "about 200 lx (cool light)"
    assert reached("ul-24480", eye_light(calendar, broken))["day"] == NOT_MET
    all_day, most = [300] * 24, [300] * 17 + [100] * 7
    assert reached("din-ts-67600", eye_light(calendar, all_day))["day"] != NOT_MET
    assert reached("din-ts-67600", eye_light(calendar, most))["day"] == NOT_MET


def test_melanopic_light_of_lamps_needs_their_spectrum(calendar):
    assert reached("well-v2-l03", eye_light(calendar, [900] * 24))["l03"] == NOT_COMPUTED
    assert reached("well-v2-l03", eye_light(calendar, [900] * 24, 100.0))["l03"] == NOT_MET
    assert reached("well-v2-l03", eye_light(calendar, [0] * 24, 140.0))["l03"] == "1 point"
    assert reached("well-v2-l03", eye_light(calendar, [0] * 24, 260.0))["l03"] == "3 points"
    late = EyeDays(what="eye_days", lux=100, hours=2, begins_by=10, at_least=1.0)
    assert late.value(eye_light(calendar, [0] * 10 + [200] * 14)) == 1.0
    assert late.value(eye_light(calendar, [0] * 11 + [200] * 13)) == 0.0


@pytest.mark.parametrize(
    ("written", "rule"),
    [
        ("LM-83-12", "lm83"),
        ("IES LM-83-12", "lm83"),
        ("EN 17037:2018+A1:2021", "en17037"),
        ("EN 17037:2018", "en17037"),
    ],
)
def test_an_edition_is_a_name_of_its_rule(written, rule):
    assert rule_named(written) == rule


@pytest.mark.parametrize(
    ("written", "here"), [("LEED v5", "leed-v4.1"), ("ANSI/IES LM-83-22", "lm83"), ("BREEAM v7", "breeam-hea01")]
)
def test_a_later_edition_is_said_not_to_be_included(written, here):
    with pytest.raises(DataError, match=f"not included: neither its text .* {here} is the latest edition here"):
        rule_named(written)
