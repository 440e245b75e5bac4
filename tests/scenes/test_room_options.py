"""The choices about a room: every one has a name, and goes into the part that needs it."""

from __future__ import annotations

from dataclasses import fields

import pytest

from mitsuba_cfs.methods.scene import Sampling
from scenes.room.options import CHOICES, NAMES, Occupancy, Outputs, RoomOptions, SensorGrid, named_types

# of `Sampling`, and no choice of a user: they follow from others, or from the machine
FOLLOW = {("sampling", "picture_samples"), ("sampling", "outdoor_samples"), ("sampling", "memory")}
PARTS = {"sampling": Sampling, "grid": SensorGrid, "occupancy": Occupancy, "outputs": Outputs}


def test_every_field_of_every_part_has_one_name() -> None:
    there = {(part, one.name) for part, kind in PARTS.items() for one in fields(kind)}
    there |= {("", one.name) for one in fields(RoomOptions) if one.name not in PARTS}
    assert len(set(NAMES.values())) == len(NAMES)
    assert set(NAMES.values()) == there - FOLLOW


def test_a_choice_by_its_name_comes_back_by_it() -> None:
    full = RoomOptions()
    for name, value in full.named().items():
        if isinstance(value, int | float) and not isinstance(value, bool):
            other = CHOICES[name][0] if name in CHOICES else value + 1
            changed = full.changed(**{name: other})
            assert changed.named() == full.named() | {name: other}
    assert RoomOptions.of(**full.named()) == full
    assert set(named_types()) == set(NAMES)


def test_pictures_of_paths_take_twice_the_samples_of_a_view() -> None:
    sampling = RoomOptions.of(picture_samples=5).sampling
    assert (sampling.view_samples, sampling.picture_samples) == (5, 10)


def test_a_name_that_is_none_is_said() -> None:
    with pytest.raises(TypeError, match="sensor_space"):
        RoomOptions.of(sensor_space=1.0)


def test_annual_glare_by_paths_is_refused() -> None:
    with pytest.raises(ValueError, match="annual glare"):
        RoomOptions.of(annual_glare=True, method="point-in-time")
