"""Uses of rooms: what the file says, the mapping file, and what is assumed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from scenes.comply.uses import UNKNOWN, read_uses

SPACE = shoebox().spaces[0]


def use(long_name="", texts=(), *, file=None, **more):
    space = replace(SPACE, name=more.pop("name", "1.01"), long_name=long_name, **more)
    return read_uses(file).of(space, texts)


@pytest.mark.parametrize(
    ("name", "key", "occupied"),
    [
        ("Büro Meier", "office", True),
        ("BUERO", "office", True),
        ("Besprechungsraum II", "meeting", True),
        ("WC Herren", "sanitary", False),
        ("Flur EG West", "circulation", False),
        ("Treppenhaus", "circulation", False),
        ("Wohnzimmer", "living", True),
        ("Labor K1", "laboratory", True),
        ("Sejour", "living", True),
        ("séjour", "living", True),
        ("Swimming", UNKNOWN, True),  # no word inside another
        ("Badminton", UNKNOWN, True),  # short words stand alone
    ],
)
def test_uses_by_name(name, key, occupied):
    found = use(name)
    assert (found.key, found.occupied, found.assumed) == (key, occupied, True)


def test_what_the_file_says_goes_before_names():
    found = use("Büro", [("Pset_SpaceOccupancyRequirements.OccupancyType", "Meeting room")])
    assert (found.key, found.assumed) == ("meeting", False)
    assert "OccupancyType" in found.source
    assert use("Büro", type_name="Classroom").key == "classroom"


def test_a_mapping_file_goes_before_all(tmp_path):
    path = tmp_path / "uses.toml"
    path.write_text('[rooms]\n"1.01" = "ward"\n[[use]]\nkey = "vault"\noccupied = false\nwords = ["gold"]\n')
    found = use("Büro", [("ObjectType", "Office")], file=path)
    assert (found.key, found.occupied, found.assumed) == ("ward", True, False)
    assert "uses.toml" in found.source
    assert use("Gold", file=path, name="2").occupied is False


def test_a_fault_of_the_mapping_file_is_one_line(tmp_path):
    path = tmp_path / "uses.toml"
    path.write_text('[[use]]\nkey = "a"\noccupyed = true')
    with pytest.raises(DataError, match=r"uses.toml: use.0.occupyed: no such key; did you mean"):
        read_uses(path)


def test_dwellings_are_named_in_the_mapping_file(tmp_path):
    """By numbers that begin alike, or one by one."""
    path = tmp_path / "uses.toml"
    path.write_text('[dwellings]\nEast = ["A1*", "A2*"]\nWest = ["B101", "Studio"]\n')
    assert use("Living room", file=path, name="A102").dwelling == "East"
    assert use("Living room", file=path, name="B101").dwelling == "West"
    assert use("Studio", file=path, name="C7").dwelling == "West"
    assert use("Living room", file=path, name="B1012").dwelling == ""
    assert use("Living room", file=path, name="A102").key == "living"
    assert use("Living room").dwelling == ""


def test_a_stated_use_is_a_key_or_has_its_word(tmp_path):
    path = tmp_path / "uses.toml"
    path.write_text('[rooms]\n"A0" = "Living room"\n"A1" = "bedroom"\n', "utf-8")
    uses = read_uses(path)
    assert [uses._named(uses.rooms[name]).key for name in ("A0", "A1")] == ["living", "bedroom"]
    path.write_text('[rooms]\n"A0" = "quiddity"\n', "utf-8")
    with pytest.raises(DataError, match=r"rooms: expected a use, one of .*living.*'quiddity'"):
        read_uses(path)
