"""What a command says of its inputs before anything is traced."""

from __future__ import annotations

import pytest

from bim.shoebox import WindowRectangle, shoebox
from scenes.fenestration.systems import WindowOverrides
from scenes.input_files import InputFiles
from scenes.input_options import NO_OPTIONS
from scenes.inputs import inputs_of
from scenes.room.operation import read_operation

RULE = '[control]\nrule = "irradiance"\nclose_above = 200.0\n'
NO_EFFECT = "Every window has one state: the rules of [control] have no effect."


@pytest.mark.parametrize(
    ("text", "states", "said"),
    [
        (RULE, 1, 1),
        (RULE, 2, 0),
        ("[gains]\nperson_w = 2\n", 1, 0),
        (RULE.replace("[control]", '[[rooms]]\nspaces = ["shoebox"]\n[rooms.control]'), 1, 1),
        ('[[rooms]]\nspaces = ["shoebox"]\n[rooms.gains]\nperson_w = 1\n', 1, 0),
    ],
)
def test_rules_for_windows_of_one_state_are_named(text, states, said, weather, blind, tmp_path) -> None:
    path = tmp_path / "operation.toml"
    path.write_text(text)
    box = shoebox(3.0, 4.0, windows=[WindowRectangle(0.5, 1.0, 2.0, 1.5)])
    files = InputFiles(weather, WindowOverrides((blind,) * states), read_operation(path))
    assert inputs_of(box, NO_OPTIONS, files).notes.count(NO_EFFECT) == said
