"""Systems of a study that name their windows: who gets which, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from mitsuba_cfs.errors import DataError
from scenes.demo import WEATHER
from scenes.heat.files import read_files
from scenes.heat.study import study_inputs
from scenes.heat.study_file import read_study

BOX = """
[box]
width = 4.0
depth = 5.0
height = 3.0
window = [
    {{ x = 0.2, sill = 1.0, width = 1.0, height = 1.0 }},
    {{ x = 1.5, sill = 1.0, width = 1.0, height = 1.0 }},
    {{ x = 1.0, sill = 1.0, width = 1.0, height = 1.0, side = "left" }},
]
{systems}
"""
PANE = "[[system.layers]]\nthickness = {}\nconductivity = 1.0\nsolar = [0.8, 0.08, 0.08]\n"


def system(millimetres: int, *names: str) -> str:
    """A [[system]] of a pane of that thickness, of windows of these names."""
    windows = f"windows = {list(names)}\n" if names else ""
    return "[[system]]\n" + windows + PANE.format(millimetres / 1000)


def filled(folder: Path, *systems: str) -> list[tuple[str, ...]]:
    """The names of the states of each window."""
    path = folder / "study.toml"
    path.write_text(f'weather = "{WEATHER}"\n' + BOX.format(systems="".join(systems)))
    study = read_study(path)
    inputs = study_inputs(study, read_files(study))
    windows = [window for space in inputs.spaces for window in space.windows]
    return [tuple(state.name for state in inputs.systems[window.guid]) for window in windows]


def test_named_windows_have_their_own_states_and_the_rest_the_others(tmp_path: Path) -> None:
    found = filled(tmp_path, system(4), system(6, "window 2"), system(8, "window 2"))
    assert found == [("panes 4 mm",), ("panes 6 mm", "panes 8 mm"), ("panes 4 mm",)]
    two = system(6, "window 1", "room-window-2")
    assert filled(tmp_path, two, system(4, "window 2")) == [("panes 6 mm",), ("panes 4 mm",), ("panes 6 mm",)]


@pytest.mark.parametrize(
    ("systems", "said"),
    [
        ((system(4), system(6, "windw 2")), "'windw 2'; there are window 1, window 2, window 3"),
        ((system(4, "window 1"),), "window window 2, window 3: box: a box holds no"),
        (
            (system(4), system(6, "window 1"), system(8, "window 1", "window 2")),
            "'window 1' is named with other windows too",
        ),
    ],
)
def test_what_no_window_or_too_many_systems_have_is_named(systems: tuple[str, ...], said: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=said):
        filled(tmp_path, *systems)


def test_a_control_names_no_more_states_than_a_window_has(tmp_path: Path) -> None:
    """Three tables, but two states at most."""
    path = tmp_path / "study.toml"
    systems = system(4) + system(6, "window 2") + system(8, "window 2")
    control = f'[control]\nrule = "schedule"\nschedule = {[2] * 24}\n'
    path.write_text(f'weather = "{WEATHER}"\n' + BOX.format(systems=systems) + control)
    with pytest.raises(DataError, match="control"):
        read_study(path)
