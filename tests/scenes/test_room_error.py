"""A room that cannot be computed is left out by name; a fault of the program is not the room's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bim.model import Space
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.progress import silent
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room
from scenes.room.windows import in_all_windows
from scenes.room.zone import zone_surfaces
from scenes.run import run as job
from scenes.run.options import JobOptions
from scenes.study import store as schedule

OPTIONS = JobOptions(OFFICE, WEATHER, cache=False, room=RoomOptions.of(sky_subdivision=1), coupled_heat=False)


def box(name: str, height: float) -> Space:
    """A room with a low window, as high as that [m]."""
    window = WindowRectangle(0.5, 0.1, 2.0, 0.4)
    (space,) = shoebox(3.0, 4.0, height, windows=(window,), name=name).spaces
    return replace(space, guid=name, windows=tuple(replace(w, guid=f"{name} {w.guid}") for w in space.windows))


def inputs_of(*spaces: Space) -> job.Inputs:
    building = replace(shoebox(), spaces=spaces)
    system = read_system(VENETIAN_BLIND)
    systems: dict = {}
    for space in spaces:
        systems |= in_all_windows(space, system)
    return job.Inputs(building, list(spaces), read_epw(WEATHER), systems, None)


def only_high_rooms_are_made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A high room is taken for computed; a low one goes the whole way."""

    def made_up(building, space, *others, **options):
        if space.name == "high":
            return space
        return compute_room(building, space, *others, **options)

    monkeypatch.setattr(job, "compute_room", made_up)


def rooms_of(inputs: job.Inputs):
    room = OPTIONS.room
    skies = skies_for(inputs.weather, room.sampling)
    return job.computed_rooms(inputs, skies, OPTIONS, silent)


def test_a_room_too_low_for_its_sensors_is_left_out(variant, monkeypatch, no_pictures) -> None:
    only_high_rooms_are_made_up(monkeypatch)
    found, issues, _ = rooms_of(inputs_of(box("low", 0.7), box("high", 2.8)))
    assert [room.name for room in found] == ["high"]
    (issue,) = issues
    assert (issue.where, issue.code) == ("low", "room-not-simulated")
    assert "no room at 0.8 m above the floor" in issue.values["reason"]
    assert issue.effect.lost == "room"


def test_the_only_room_names_itself_and_its_file(variant) -> None:
    with pytest.raises(DataError, match=r"office.ifc: space low: .*no room at 0.8 m"):
        rooms_of(inputs_of(box("low", 0.7)))


def shape_bug(*_, **__) -> None:
    np.ones(3) + np.ones(4)


def no_variant(*_, **__) -> None:
    raise DataError("no longer there", file="a.epw")


@pytest.mark.parametrize(
    ("fault", "kind", "word"), [(shape_bug, ValueError, "broadcast"), (no_variant, DataError, "no longer")]
)
def test_a_fault_of_the_program_is_no_news_about_a_room(
    variant, monkeypatch, fault: Callable, kind: type[Exception], word: str
) -> None:
    monkeypatch.setattr(job, "compute_room", fault)
    with pytest.raises(kind, match=word) as caught:
        rooms_of(inputs_of(box("one", 2.8), box("high", 2.7)))
    assert type(caught.value) is kind


def test_a_study_says_which_is_which() -> None:
    with pytest.raises(ValueError, match="broadcast") as caught:
        shape_bug()
    assert schedule.failure_line(caught.value).startswith("fault of the program: ValueError")
    assert schedule.failure_line(RoomError("space low: no room")) == "space low: no room"


def test_surfaces_that_are_no_zone_are_the_rooms_fault(variant) -> None:
    """A model whose faces enclose nothing: the heat balance's own check finds it."""
    space = replace(box("open", 2.8), volume=0.0)
    inputs, options = inputs_of(space), OPTIONS.room
    room = room_inputs(inputs.building, space, inputs.systems, inputs.weather, options)
    with pytest.raises(RoomError, match=r"space open: .*volume must be positive"):
        zone_surfaces(room)
