"""Blinds by group, sDA, ASE and provision against honeybee-radiance-postprocess's figures."""

from __future__ import annotations

import json

import pytest

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from tests.validation.peer_states import STORED, figures, rooms

POINTS = 0.1  # percentage points


@pytest.fixture(scope="module")
def found():
    weather = read_epw(WEATHER)
    return {room.name: figures(room, weather) for room in rooms(weather)}


def test_rooms_with_states_are_those_of_the_peer(found):
    peer = json.loads(STORED.read_text())
    assert found.keys() == peer.keys()
    for name, parts in peer.items():
        for part, values in parts.items():
            assert found[name][part] == pytest.approx(values, abs=POINTS), (name, part)


def test_the_rooms_ask_something(found):
    """Neither all nor nothing, and different from room to room."""
    sda = {round(one["states"]["sda"], 1) for one in found.values()}
    assert len(sda) == len(found) and min(sda) > 1 and max(sda) < 99
    assert sum(0 < one["states"]["ase"] < 100 for one in found.values()) >= 3
