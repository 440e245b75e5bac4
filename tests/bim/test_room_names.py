"""Rooms found by number, long name, both or GUID; nearest names where there is none."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from bim.names import folder_names, item_named, label_of, nearest, numbered


@dataclass(frozen=True)
class Room:
    guid: str
    name: str
    long_name: str = ""

    @property
    def label(self) -> str:
        return label_of(self.name, self.long_name, self.guid)


ROOMS = (
    Room("0aB", "01", "Wohnzimmer"),
    Room("1cD", "02", "Bad"),
    Room("2eF", "03", "Bad"),
    Room("3gH", "lab", "Lab"),
    Room("4iJ", "Lab", "Big laboratory"),
    Room("5kL", "", ""),
)


@pytest.mark.parametrize(
    ("wanted", "guid"),
    [
        ("01", "0aB"),
        ("Wohnzimmer", "0aB"),
        ("01 Wohnzimmer", "0aB"),
        ("0aB", "0aB"),
        ("wohnzimmer", "0aB"),
        ("01  WOHNZIMMER ", "0aB"),
        ("03 bad", "2eF"),
        ("lab", "3gH"),
        ("big laboratory", "4iJ"),
        ("5kL", "5kL"),
    ],
)
def test_a_room_is_found_by_what_people_call_it(wanted, guid):
    assert item_named(ROOMS, wanted, "space").guid == guid


def test_a_name_of_several_lists_them_so_that_one_can_be_chosen():
    with pytest.raises(ValueError, match="2 spaces are named 'bad': 02 Bad, 03 Bad"):
        item_named(ROOMS, "bad", "space")
    twins = (Room("a", "1", "Bad"), Room("b", "1", "Bad"))
    with pytest.raises(ValueError, match=r"1 Bad \(a\), 1 Bad \(b\)"):
        item_named(twins, "1 Bad", "space")


@pytest.mark.parametrize(
    ("name", "long_name", "label"),
    [
        ("1 - Living room", "Living room", "1 - Living room"),
        ("101", "101 Office", "101 Office"),
        ("1", "Living room", "1 Living room"),
        ("lab", "Lab", "lab Lab"),
        ("", "Bad", "Bad"),
        ("Bad", "Bad", "Bad"),
        ("Bath 1", "1 Bath", "Bath 1 1 Bath"),
        ("", "", "guid"),
    ],
)
def test_a_label_says_each_name_once(name, long_name, label):
    assert label_of(name, long_name, "guid") == label


@pytest.mark.parametrize("wanted", ["Hall", "HALL", "2", "2 Living", "Living"])
def test_a_joined_room_is_found_by_its_parts(wanted):
    rooms = (Room("a", "1 + 2", "Hall + Living"), Room("b", "3", "Bad"))
    assert item_named(rooms, wanted, "space").guid == "a"


def test_a_room_of_its_own_goes_before_a_part_of_a_joined_one():
    rooms = (Room("a", "1 + 2", "Hall + Living"), Room("b", "3", "Hall"))
    assert item_named(rooms, "Hall", "space").guid == "b"


def test_an_unknown_name_lists_the_nearest_first():
    with pytest.raises(KeyError, match="no space 'Wonzimmer'; there are: 01 Wohnzimmer, "):
        item_named(ROOMS, "Wonzimmer", "space")
    assert nearest("Window B", ["Door", "Window A", "Window B2"])[0] == "Window B2"


def test_rooms_of_one_name_have_folders_of_their_own():
    rooms = (Room("a", "1", "Bad"), Room("b", "1", "bad"), Room("c", "2", "Küche/Essen"))
    assert folder_names(rooms) == ["1_Bad_a", "1_bad_b", "2_Küche_Essen"]


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("a b a a", ["a", "b", "a 2", "a 3"]),
        ("a/a/a 2", ["a", "a 3", "a 2"]),
        ("a 2/a/a", ["a 2", "a", "a 3"]),
        ("a 2/a 2/a/a", ["a 2", "a 2 2", "a", "a 3"]),
    ],
)
def test_names_that_come_again_get_a_number_that_no_other_has(names, found):
    assert numbered(names.split("/" if "/" in names else None)) == found
