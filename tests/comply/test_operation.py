"""`cfs comply --operation`: the states of the file move the blinds where glare and temperatures are judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply import comply
from scenes.comply.files import ComplyFiles, read_files
from scenes.comply.options import ComplyOptions
from scenes.comply.rules import read_rule
from scenes.comply.uses import read_uses
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.resolver import WindowOverrides
from scenes.input_files import InputFiles
from scenes.room.operation import Operation, read_operation
from tests.scenes.small_box import FEW
from tests.scenes.test_shared_groups import BUILDING, SUN

RULE = "passivhaus"  # temperatures of living rooms
GLAZING = Path(VENETIAN_BLIND).with_name("glazing.xml")


@pytest.fixture
def judged(variant, tmp_path, monkeypatch):
    """The states [H, W] by room in which temperatures are judged, and the result."""

    def of(control: dict | None, *, turned: bool = False):
        lines = "\n".join(f"{key} = {value!r}" for key, value in (control or {}).items())
        file = tmp_path / "blinds.toml"
        states = "".join(f'[[system]]\nbsdf = "{path}"\n' for path in (GLAZING, VENETIAN_BLIND))
        file.write_text(f"{states}[control]\n{lines}\n")
        operation: Operation = read_operation(file)
        overrides = WindowOverrides(states=operation.systems)
        if control is None:
            operation = None
        spaces = [replace(space, name=f"Bedroom {space.name}") for space in BUILDING.spaces]
        building = replace(BUILDING, spaces=tuple(spaces[::-1] if turned else spaces))
        seen, heat_of = {}, comply.room_heat

        def noted(room, light, state, **options):
            seen[room.space.guid] = state[:, room.windows.group], room.operation
            return heat_of(room, light, state, **options)

        monkeypatch.setattr(comply, "room_heat", noted)
        options = ComplyOptions(None, WEATHER, standards=(RULE,), room=FEW)
        inputs = InputFiles(read_epw(WEATHER), overrides, operation)
        files = ComplyFiles(inputs, {RULE: read_rule(RULE)}, read_uses(), None, None, 13.0, "assumed")
        return seen, comply.check_rooms(building, options, files)

    return of


def test_the_control_of_the_file_moves_the_blinds(judged) -> None:
    """One state for a group of several rooms; gains and air stay those of the rule."""
    seen, result = judged({**SUN, "across": "building"})
    near, far = seen["near-guid"][0], seen["far-guid"][0]
    assert np.array_equal(near, far) and 0.05 < near.mean() < 0.5
    assert seen["near-guid"][1].gains.equipment_w_m2 == 2.1
    text = "\n".join(result.assumptions)
    assert "LM-83" not in text
    other, _ = judged({**SUN, "across": "building"}, turned=True)
    assert np.array_equal(other["near-guid"][0], near)


def test_closed_blinds_keep_rooms_cooler(judged) -> None:
    def share(control) -> float:
        _, result = judged(control)
        (verdict,) = result.rooms[0].verdicts
        return float(next(iter(verdict.values[0])))

    open_all, shut = share({"rule": "always", "state": 0}), share({"rule": "always", "state": 1})
    assert shut < open_all


def test_a_closed_state_beside_an_operation_is_refused(tmp_path) -> None:
    file = tmp_path / "o.toml"
    file.write_text(f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n')
    closed = Path(VENETIAN_BLIND)
    options = ComplyOptions(OFFICE, WEATHER, standards=(RULE,), operation=file, closed=closed)
    with pytest.raises(DataError, match="has the closed state"):
        read_files(options)
