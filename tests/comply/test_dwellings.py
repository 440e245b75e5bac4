"""Sunlight of EN 17037: asked of one habitable room of a dwelling, of wards, not of offices."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bim.model import Building, SpaceGroup
from bim.shoebox import shoebox
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply.assess import NOT_FOR_IT, assess_room, values_of
from scenes.comply.dwellings import dwelling_words, dwellings_of, judged
from scenes.comply.findings import Findings, calendar_of
from scenes.comply.outputs import answers
from scenes.comply.results import CheckedRoom
from scenes.comply.rules import NOT_MET, read_rule
from scenes.comply.sunlight import SunExposure
from scenes.comply.tables import building_table, missed
from scenes.comply.uses import RoomUse
from scenes.demo import WEATHER

RULES = {"en17037": read_rule("en17037")}


@pytest.fixture(scope="module")
def calendar():
    return calendar_of(read_epw(WEATHER))


def checked(calendar, *rooms):
    """Rooms of 10 m2 each: name, use, dwelling, hours of sun; as checked by EN 17037."""
    found = []
    for name, use, dwelling, hours in rooms:
        sun = SunExposure((), ((600.0, 600.0 + 60 * hours),))
        rule = RULES["en17037"]
        values = {"en17037": values_of(rule, Findings(calendar, sun=sun), rule.parts)}
        space = replace(shoebox().spaces[0], name=name, long_name="")
        of = RoomUse(use, True, "", dwelling=dwelling)
        verdicts = tuple(assess_room(RULES, values, space, of))
        found.append(CheckedRoom(space, of, verdicts, None, sun, None))
    return judged(found)


def of_building(verdicts, key):
    return next(v for v in verdicts if v.criterion.key == key)


def misses(rooms):
    return {r.space.name: [text for text in missed(RULES, r) if "Exposure" in text] for r in rooms}


def test_one_sunny_room_is_enough_for_its_dwelling(calendar):
    """A has a sunny living room and a dark bedroom, B two dark rooms and a sunny kitchen."""
    rooms, verdicts = checked(
        calendar,
        ("A1", "living", "A", 3.2),
        ("A2", "bedroom", "A", 0.0),
        ("B1", "living", "B", 1.4),
        ("B2", "bedroom", "B", 0.2),
        ("B3", "kitchen", "B", 5.0),
    )
    verdict = of_building(verdicts, "sunlight_dwellings")
    assert verdict.values == pytest.approx([0.5, 0.5, 0.0])
    assert verdict.rooms == 4 and verdict.reached == NOT_MET
    found = misses(rooms)
    assert not found["A1"] and not found["A2"] and not found["B3"]
    assert len(found["B1"]) == len(found["B2"]) == 1
    assert "one habitable room of each dwelling" in found["B1"][0]


def test_rooms_of_no_dwelling_are_asked_one_by_one(calendar):
    """A pass for a whole house by its one sunny room would be ours, not the file's."""
    rooms, verdicts = checked(calendar, ("1", "living", "", 4.5), ("2", "bedroom", "", 1.0), ("3", "bedroom", "A", 2.0))
    assert of_building(verdicts, "sunlight_dwellings").values == pytest.approx([2 / 3, 1 / 3, 1 / 3])
    assert [bool(text) for text in misses(rooms).values()] == [False, True, False]
    named, alone = dwelling_words(rooms)
    assert "dwellings are A (3)" in named and "--uses" in named
    assert "without a named dwelling are assessed individually: 1, 2" in alone


def _answer(rooms, verdicts) -> str:
    """The sentence on the sunlight of dwellings."""
    result = SimpleNamespace(rooms=rooms, verdicts=verdicts, rules=RULES, weather=None)
    return next(text for title, text in answers(result) if "dwelling" in title)


def test_a_house_whose_dwelling_is_not_named_has_its_level_as_one_dwelling_too(calendar):
    rooms, verdicts = checked(calendar, ("Schlafen", "bedroom", "", 2.0), ("Wohnen", "living", "", 4.5))
    text = _answer(rooms, verdicts)
    assert text.startswith("Minimum. No dwelling is named, and each room is taken as one; if all rooms are one ")
    assert "dwelling: high (Wohnen)." in text
    named = checked(calendar, ("Schlafen", "bedroom", "House", 2.0), ("Wohnen", "living", "House", 4.5))
    assert _answer(*named).startswith("High.") and "No dwelling" not in _answer(*named)


def test_offices_have_hours_and_miss_nothing_wards_are_asked_each(calendar):
    rooms, verdicts = checked(
        calendar,
        ("office", "office", "", 0.0),
        ("lit", "office", "", 4.0),
        ("ward", "ward", "", 1.0),
        ("play", "nursery", "", 2.0),
    )
    found = misses(rooms)
    assert not found["office"] and not found["lit"] and not found["play"] and found["ward"]
    levels = [{v.criterion.key: v.reached for v in room.verdicts if "sunlight" in v.criterion.key} for room in rooms]
    assert [one["sunlight"] for one in levels] == [NOT_MET, "high", NOT_FOR_IT, NOT_FOR_IT]
    assert [one["sunlight_wards"] for one in levels][2:] == [NOT_MET, "minimum"]
    assert of_building(verdicts, "sunlight_wards").values[0] == pytest.approx(0.5)
    table = building_table(SimpleNamespace(verdicts=verdicts), "en17037")
    titles = [row[0] for row in table.rows if "sunlight" in row[0]]
    assert titles == ["Exposure to sunlight, patient rooms and playrooms"]
    assert not list(dwelling_words(rooms))


def _zoned(*zones: SpaceGroup) -> Building:
    return Building("house", (), zones=zones)


def test_zones_of_the_model_are_dwellings():
    named = _zoned(SpaceGroup("Wohnung 2", "", ("a", "b")), SpaceGroup("Heizkreis", "", ("a", "b", "c")))
    assert dwellings_of(named) == {"a": "Wohnung 2", "b": "Wohnung 2"}
    plain = _zoned(SpaceGroup("Top 1", "", ("a",)), SpaceGroup("HVAC 1", "", ("a", "b")))
    assert dwellings_of(plain) == {"a": "Top 1"}
    by_kind = _zoned(SpaceGroup("WE 01", "Apartment", ("a",)), SpaceGroup("Block", "", ("a", "b")))
    assert dwellings_of(by_kind) == {"a": "WE 01"}
