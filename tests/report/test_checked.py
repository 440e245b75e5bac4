"""The check of a model as data: what is doubtful of each room, by its consequence."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bim.ifc.building import read_ifc
from bim.report.issue import Effect, Issue, Phrase
from scenes.report.checked import check_record
from tests.bim.test_joining import two_rooms
from tests.report.synthetic import run_result

LOST = {"element": "Window", "area": 0.0, "room": ""}


def building():
    """Two made-up rooms."""
    return run_result(picture_size=32).building


def of_room(building, *issues, **changes):
    """The first room's record, with these issues."""
    first = replace(building.spaces[0], **changes)
    model = replace(building, spaces=(first, *building.spaces[1:]), issues=issues)
    return check_record(model, (), {}, {})["rooms"][0]


def test_rooms_with_a_walled_up_opening_are_doubtful_and_can_be_joined(tmp_path) -> None:
    model = read_ifc(two_rooms(tmp_path))
    (small,) = [one for one in model.issues if one.code == "rooms-open-to-each-other"]
    large = replace(small, values={**small.values, "area": 14.9})
    for issue, level in ((small, "minor"), (large, "serious")):
        record = check_record(replace(model, issues=(issue,)), (), {}, {})
        assert [room["doubt"] for room in record["rooms"]] == [level, level]
        (pair,) = record["open_rooms"]
        assert pair["join"] == "North + South" and pair["rooms"] == ["North", "South"]
        assert set(pair["guids"]) == {space.guid for space in model.spaces}
    assert check_record(replace(model, spaces=model.spaces[:1]), (), {}, {})["open_rooms"] == []


@pytest.mark.parametrize(("share", "level"), [(0.001, "minor"), (0.5, "serious")])
def test_lost_glass_counts_by_its_share(share, level) -> None:
    model = building()
    room = model.spaces[0]
    lost = share * sum(window.area for window in room.windows)
    issue = Issue("glass-lost", room.windows[0].guid, LOST, Effect(glass=lost))
    found = of_room(model, issue)
    assert found["doubt"] == level
    assert found["doubts"][0]["glass_m2"] == pytest.approx(lost, abs=0.01)


def test_the_gravest_reason_comes_first_and_equal_ones_are_one() -> None:
    model = building()
    room = model.spaces[0]
    trifle = Issue("glass-lost", room.windows[0].guid, LOST, Effect(glass=0.01))
    grave = Issue("spaces-overlap", room.guid, {"room": room.label, "other": "X", "volume": 2.0})
    found = of_room(model, trifle, trifle, grave)
    assert [one["level"] for one in found["doubts"]] == ["serious", "minor"]
    assert found["doubts"][0]["code"] == "spaces-overlap" and found["doubts"][1]["what"].startswith("2 times")


def test_the_volume_is_that_of_the_computation_and_a_large_cut_is_doubtful() -> None:
    model = building()
    volume = model.spaces[0].volume
    values = {"room": "A", "before": 1.5 * volume, "after": volume, "beyond": Phrase("beyond-slope")}
    cut = Issue("room-cut", model.spaces[0].guid, values)
    found = of_room(model, cut, cut=0.5 * volume, room_volume=volume)
    assert found["volume_m3"] == pytest.approx(volume, abs=0.01)
    assert found["drawn_volume_m3"] == pytest.approx(1.5 * volume, abs=0.01) and found["doubt"] == "serious"
    assert of_room(model, cut, cut=0.001 * volume, room_volume=volume)["doubt"] == "minor"
