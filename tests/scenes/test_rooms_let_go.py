"""What was traced of a room dies with the room: a building of a hundred takes no more than one.

The collector of circular references is off: it comes by the number of objects, and a room is a few
thousand objects with hundreds of megabytes of matrices.
"""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.reflected_sun import ReflectedSun
from mitsuba_cfs.trace.kernels.scene import TracedScene
from scenes.comply.comply import lights_of
from scenes.room.inputs import room_inputs
from scenes.room.light import RoomLight, room_light
from scenes.room.options import SensorGrid
from scenes.room.room import compute_room
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import BOX, ROOM, SMALL

OF_A_ROOM = (RoomLight, PhaseMatrices, PhaseLight, PathLight, ReflectedSun)
FEW = SMALL.changed(
    sensor_samples=256,
    patch_samples=64,
    sun_points=16,
    picture_size=32,
    picture_samples=2,
    path_samples=16,
    picture_count=1,
    heat_step_s=3600.0,
)


@pytest.fixture
def made(monkeypatch) -> Iterator[list[weakref.ref]]:
    """All objects of a room that are made, without keeping them."""
    found: list[weakref.ref] = []

    def noted(original):
        def init(self, *args, **kwargs) -> None:
            found.append(weakref.ref(self))
            original(self, *args, **kwargs)

        return init

    for kind in (*OF_A_ROOM, TracedScene):
        monkeypatch.setattr(kind, "__init__", noted(kind.__init__))
    gc.collect()
    gc.disable()
    yield found
    gc.enable()


def living(made: list[weakref.ref], kinds: tuple[type, ...] = OF_A_ROOM) -> list[str]:
    objects = [ref() for ref in made]
    return [type(one).__name__ for one in objects if isinstance(one, kinds)]


def test_nothing_of_computed_rooms_is_left(variant, made, weather, skies, blind) -> None:
    """Their results are kept, as in a run; the traced scenes are not."""
    filled = in_all_windows(ROOM, blind)
    results = [compute_room(BOX, ROOM, filled, weather, FEW, skies=skies) for _ in range(2)]
    assert len(results) == 2 and not living(made)
    assert not living(made, (TracedScene,))


def test_nothing_of_a_checked_room_is_left(variant, made, weather, skies, blind, glass) -> None:
    """Light on two grids with blinds that move, as `cfs comply` asks for it."""
    filled = {window.guid: (glass, blind) for window in ROOM.windows}
    grids = [SensorGrid(spacing=1.0), SensorGrid(spacing=1.5)]
    room = room_inputs(BOX, ROOM, filled, weather, FEW, skies=skies, grids=grids)
    light = room_light(room)
    found = lights_of(room, light, {0})
    assert found[0].operated is not None and "PhaseLight" in living(made)
    del room, light
    assert not living(made)
