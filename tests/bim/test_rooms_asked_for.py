"""A wrong name of a room is refused before geometry is read; a name that may be right is not."""

from __future__ import annotations

import pytest

from bim.building_file import ReadOptions, check_room_names, named_spaces, read_building_file
from mitsuba_cfs.errors import DataError
from scenes.demo import OFFICE


class _Read(Exception):
    """The reader comes to the geometry."""


@pytest.fixture
def no_geometry(monkeypatch) -> None:
    def begun(*_, **options) -> None:
        raise _Read

    monkeypatch.setattr("bim.ifc.source.read_shapes", begun)


def asked_for(*rooms: str) -> None:
    read_building_file(OFFICE, ReadOptions(rooms=rooms))


@pytest.mark.parametrize("wrong", ["nowhere", "Southern", "", "AB", "office", "Wall"])
@pytest.mark.usefixtures("no_geometry")
def test_a_wrong_name_is_refused_before_geometry(wrong) -> None:
    """The command took 18 s to say it of a building of 73 rooms."""
    with pytest.raises(DataError, match="no space"):
        asked_for("South office", wrong)


@pytest.mark.parametrize(
    "room", ["A", "south  OFFICE", "20B6FKss9Pix5t4FsUrS_W", "A South office", "A + B", "20B6FKss9Pix5t4FsUrS_W-581"]
)
@pytest.mark.usefixtures("no_geometry")
def test_a_name_like_one_of_the_file_is_decided_by_its_rooms(room) -> None:
    with pytest.raises(_Read):
        asked_for(room)


# a part of a name, and a name of something else in the file, were left to the reader
@pytest.mark.parametrize("wrong", ["nowhere", "Nowhere ö", "office", "Wall", "Window 1"])
def test_a_wrong_name_is_refused_before_the_reader_is_loaded(wrong) -> None:
    with pytest.raises(DataError, match=f"no space '{wrong}'") as early:
        check_room_names([OFFICE], ["South office", wrong])
    with pytest.raises(DataError) as late:
        asked_for(wrong)
    assert str(early.value) == str(late.value)


@pytest.mark.parametrize("room", ["south  OFFICE", "A South office", "A + B", "Büro A"])
def test_a_name_that_may_be_right_is_left_to_the_reader(room) -> None:
    check_room_names([OFFICE], [room])


@pytest.mark.usefixtures("no_geometry")
def test_without_names_everything_is_read() -> None:
    with pytest.raises(_Read):
        asked_for()


def test_the_message_is_that_of_the_rooms(no_geometry, monkeypatch) -> None:
    with pytest.raises(DataError) as early:
        asked_for("nowhere")
    monkeypatch.undo()
    with pytest.raises(DataError) as late:
        named_spaces(read_building_file(OFFICE), ["nowhere"], OFFICE)
    assert str(early.value) == str(late.value)


@pytest.mark.parametrize("room", ["Büro", "büro", "K1 Büro", "K1", "Bob's zone", "3vB2YO$MX4xv5uCqZZG05x"])
def test_a_name_that_a_file_states_needs_no_model(room, tmp_path, monkeypatch) -> None:
    """Every run with a room would open the model twice."""

    def opened(*_) -> None:
        raise AssertionError("opened")

    monkeypatch.setattr("bim.ifc.project.open_all", opened)
    file = tmp_path / "house.ifc"
    file.write_text(
        "#1= IFCSPACE('3vB2YO$MX4xv5uCqZZG05x',$,'K1','a; (description)',$,$,$,'B\\X2\\00FC\\X0\\ro',.ELEMENT.);\n"
        "#2=IFCZONE('0vB2YO$MX4xv5uCqZZG05x',$,'Bob''s zone',$,$);\n"
    )
    check_room_names([file], [room])
    with pytest.raises(AssertionError, match="opened"):
        check_room_names([file], [f"{room} 2"])
