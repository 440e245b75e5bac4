"""The share of the sky that walls and windows see reaches the heat balance of a room."""

from __future__ import annotations

import numpy as np
import pytest

from bim.model import Building
from bim.shoebox import Plate, WindowRectangle, shoebox
from scenes.room.inputs import room_inputs
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.room.zone import RoomZone
from tests.scenes.small_box import SMALL
from tests.validation.energyplus_twin import under_open_sky

SILL, RISE, ROOF, DEPTH = 0.5, 1.5, 2.8, 1.2


def overhung(*plates: Plate) -> Building:
    """A box, all of its walls outdoors, with a window to the south."""
    return shoebox(
        4.0,
        5.0,
        ROOF,
        windows=[WindowRectangle(0.5, SILL, 3.0, RISE, frame=0.05)],
        adjacency={"wall": "outside"},
        plates=plates,
    )


def zone_of(building: Building, glass, weather, skies) -> RoomZone:
    (space,) = building.spaces
    systems = in_all_windows(space, glass)
    return operated_zone(room_inputs(building, space, systems, weather, SMALL, skies=skies))


def test_an_overhang_hides_the_sky_from_what_is_below_it(variant, glass, weather, skies) -> None:
    roof = Plate((-900.0, ROOF), (900.0, ROOF), DEPTH)
    found = zone_of(overhung(roof), glass, weather, skies)
    down = ROOF - np.linspace(SILL, SILL + RISE, 401)
    (window,) = found.zone.windows
    # a long edge at the angle phi over the horizon leaves sin phi of the half space's sky
    assert window.sky_seen == pytest.approx(np.mean(down / np.hypot(down, DEPTH)), abs=0.02)
    seen = {(one.name.split()[0], tuple(one.normal.round())): one for one in found.zone.surfaces}
    assert 0.3 < seen["wall", (0.0, -1.0, 0.0)].sky_seen < 0.9
    assert 0.3 < seen["window", (0.0, -1.0, 0.0)].sky_seen < 0.9
    assert 0.9 < seen["wall", (1.0, 0.0, 0.0)].sky_seen < 1.0  # the long edge goes past it
    assert seen["wall", (0.0, 1.0, 0.0)].sky_seen == 1.0
    free = under_open_sky(found)
    assert {one.sky_seen for one in (*free.zone.surfaces, *free.zone.windows)} == {1.0}
    assert free.zone.name == found.zone.name


def test_with_nothing_outdoors_the_sky_is_whole(variant, glass, weather, skies) -> None:
    found = zone_of(overhung(), glass, weather, skies).zone
    assert {one.sky_seen for one in (*found.surfaces, *found.windows)} == {1.0}
