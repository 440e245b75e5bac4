"""Each stage of a room is computed only where something reads it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.model import Element
from scenes.room import room as page
from scenes.room.inputs import RoomInputs, room_inputs
from scenes.room.light import room_light
from scenes.room.operation_tables import OperationTables
from scenes.room.room import StageTimes, lit_room, operated_zone
from scenes.room.solar import seasonal_outdoors
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import BOX, ROOM, SMALL

FEW = SMALL.changed(
    sensor_samples=256,
    patch_samples=64,
    sun_points=16,
    picture_size=32,
    picture_samples=2,
    picture_count=1,
    heat_step_s=3600.0,
)
WALL = np.array([[[-9, -6, 0], [12, -6, 0], [12, -6, 9]]], dtype=float)


class Computed(Exception):
    """A stage was computed."""


def computed(*_: object, **__: object) -> None:
    raise Computed


@pytest.fixture
def inputs(variant, glass, weather, skies):
    """The inputs of the small box with a glazed window."""

    def of(tables: dict | None = None, visible: float = 0.2, solar: float = 0.2) -> RoomInputs:
        opposite = Element("w", "wall", "IfcWall", WALL, visible, solar)
        operation = None if tables is None else OperationTables.model_validate(tables)
        return room_inputs(
            replace(BOX, elements=(opposite,)),
            ROOM,
            in_all_windows(ROOM, glass),
            weather,
            FEW,
            operation=operation,
            skies=skies,
        )

    return of


@pytest.mark.parametrize(
    "tables",
    [None, {}, {"gains": {"lighting_w_m2": 8, "lighting_dimmed": False}}],
    ids=["no operation", "no lamps", "lamps not dimmed"],
)
def test_heat_without_a_reader_of_daylight_traces_no_light(inputs, monkeypatch, tables) -> None:
    monkeypatch.setattr(page, "room_light", computed)
    zone = operated_zone(inputs(tables))
    assert zone.daylight is None and zone.solar.inside.any()


@pytest.mark.parametrize(
    "tables", [{"gains": {"lighting_w_m2": 8}}, {"control": {"rule": "glare"}}], ids=["dimmed lamps", "glare"]
)
def test_lamps_and_glare_read_the_light(inputs, monkeypatch, tables) -> None:
    monkeypatch.setattr(page, "room_light", computed)
    with pytest.raises(Computed):
        operated_zone(inputs(tables))


def test_both_bands_share_the_matrices_of_equal_reflectances(inputs) -> None:
    room = inputs(visible=0.3, solar=0.3)
    light = room_light(room)
    assert seasonal_outdoors(room, light).first is light.matrices
    assert seasonal_outdoors(room).first is not light.matrices
    unequal = inputs(visible=0.3, solar=0.6)
    light = room_light(unequal)
    assert seasonal_outdoors(unequal, light).first is not light.matrices


def test_no_picture_and_no_sun_without_a_reader(inputs, glass, weather, skies, monkeypatch):
    """Solar matrices wait for the zone; pictures for a request."""
    monkeypatch.setattr(page, "room_glare", computed)
    monkeypatch.setattr(page, "zone_surfaces", computed)
    monkeypatch.setattr(page, "seasonal_outdoors", lambda *_, **__: pytest.fail("traced"))
    given = (BOX, ROOM, in_all_windows(ROOM, glass), weather, FEW)
    with pytest.raises(Computed):  # at the zone, after all light
        lit_room(*given, skies=skies, pictures=False)


def test_a_stage_that_is_run_twice_takes_the_sum_of_both(monkeypatch) -> None:
    clock = iter([0.0, 1.5, 10.0, 12.0])
    monkeypatch.setattr(page.time, "monotonic", lambda: next(clock))
    times = StageTimes()
    for _ in range(2):
        with times.stage("glare"):
            pass
    assert times.seconds == {"glare": 3.5}


def test_without_pictures_none_is_rated(variant, glass, weather, skies, monkeypatch) -> None:
    monkeypatch.setattr("scenes.room.glare.rated_pictures", computed)
    given = BOX, ROOM, in_all_windows(ROOM, glass), weather
    assert not lit_room(*given, FEW.changed(picture_count=0), skies=skies).glare.pictures
    with pytest.raises(Computed):
        lit_room(*given, FEW, skies=skies)


def test_memory_is_returned_after_long_stages_alone(monkeypatch) -> None:
    returned: list[int] = []
    monkeypatch.setattr(page.variants, "return_memory", lambda: returned.append(1))
    for seconds, times in ((page.LONG / 2, 0), (2 * page.LONG, 1)):
        clock = iter([0.0, seconds])
        monkeypatch.setattr(page.time, "monotonic", lambda clock=clock: next(clock))
        with StageTimes().stage("glare"):
            pass
        assert len(returned) == times
