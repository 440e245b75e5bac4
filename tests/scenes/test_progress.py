"""What a listener to progress sees: bars that never go back, items and the time they take."""

from __future__ import annotations

import io
import itertools

import pytest
from rich.console import Console

from bim.building_file import STAGES
from bim.ifc.building import read_ifc
from mitsuba_cfs.progress import Stage, TimeLeft, in_shares, item, part, spoken_left, summed
from scenes.commands import progress_bar as compiling
from scenes.commands.progress_bar import ProgressBar
from scenes.demo import OFFICE


class Clock:
    """A time that the test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> ProgressBar:
    """A bar as on a terminal, drawn into memory."""
    bar = ProgressBar(terminal=True)
    monkeypatch.setattr(bar._bars.live, "console", Console(file=io.StringIO()))
    return bar


def bars(bar: ProgressBar) -> list[tuple[str, float]]:
    """Label and fraction of the bars that are seen."""
    return [(t.description, t.completed) for t in bar._bars.tasks if t.visible]


def test_a_bar_never_falls(drawn: ProgressBar) -> None:
    with drawn as progress:
        for told, shown in ((0.2, 0.2), (0.6, 0.6), (0.1, 0.6), (0.7, 0.7)):
            progress("sky", told)
            assert bars(progress) == [("sky", shown)]


@pytest.mark.parametrize("end", ["ticked", "left"])
def test_a_stage_that_begins_again_gets_a_bar_of_its_own(drawn: ProgressBar, end: str) -> None:
    with drawn as progress:
        progress("sky irradiance", 1.0 if end == "ticked" else 0.5)
        progress("yield", 0.5)
        progress("sky irradiance", 1.0)  # said once more that it is over: nothing new
        assert bars(progress) == [("sky irradiance", 1.0), ("yield", 0.5)]
        progress("sky irradiance", 0.25)
        shown = [("sky irradiance", 1.0), ("yield", 1.0), ("sky irradiance (2)", 0.25)]
        assert bars(progress) == shown


def test_no_order_of_calls_takes_a_tick_away(drawn: ProgressBar) -> None:
    with drawn as progress:
        before: dict[str, float] = {}
        for stage, fraction in itertools.product("abab", (0.0, 0.7, 0.3, 1.0, 0.1)):
            progress(stage, fraction)
            now = dict(bars(progress))
            assert all(now[label] >= done for label, done in before.items())
            before = now


def test_rooms_on_a_terminal_say_which_and_how_long(drawn: ProgressBar) -> None:
    drawn._clock = clock = Clock()
    drawn._left = TimeLeft(clock)
    with drawn as progress:
        progress("sky", 1.0)
        for number in (1, 2, 3):
            steps = item(progress, "room", number, 6, f"R{number}")
            steps("daylight", 0.5)
            clock.now += 80.0
            steps("daylight", 1.0)
        assert bars(progress) == [("sky", 1.0), ("room 3 of 6, about 4 min left", 2 / 6), ("R3: daylight", 1.0)]
        progress("results", 0.0)
        assert bars(progress) == [("sky", 1.0), ("6 rooms", 1.0), ("results", 0.0)]


def test_rooms_in_a_log_are_lines_from_time_to_time(capsys: pytest.CaptureFixture) -> None:
    clock = Clock()
    with ProgressBar(terminal=False, clock=clock) as progress:
        for number in (1, 2, 3, 4):
            steps = item(progress, "room", number, 4, f"R{number}")
            for fraction in (0.0, 0.5, 1.0):
                steps("light", fraction)
                clock.now += 30.0 if number < 3 else 1.0
    assert capsys.readouterr().err.splitlines() == [
        "room 1 of 4",
        "R1: light: 60.0 s",
        "room 2 of 4, about 4 min left",
        "R2: light: 60.0 s",
        "room 3 of 4, about 3 min left",
        "R3: light: 2.0 s",
        "R4: light: 2.0 s",
    ]


def test_a_long_stage_in_a_log_says_how_far_it_is(capsys: pytest.CaptureFixture) -> None:
    clock = Clock()
    with ProgressBar(terminal=False, clock=clock) as progress:
        steps = item(progress, "view", 1, 2, "desk", whole=True)
        for fraction in (0.0, 0.1, 0.2, 0.3, 1.0):
            steps("glare", fraction)
            clock.now += 40.0
    assert capsys.readouterr().err.splitlines() == [
        "view 1 of 2",
        "desk: 20 %, view 1 of 2, about 12 min left",
        "desk: 160.0 s",
    ]


def test_thousand_short_cases_do_not_fill_a_log(capsys: pytest.CaptureFixture) -> None:
    clock = Clock()
    with ProgressBar(terminal=False, clock=clock) as progress:
        for number in range(1, 1001):
            progress(Stage("", "case", number, 1000), 0.0)
            clock.now += 0.5
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "case 1 of 1000"
    assert lines[1] == "case 21 of 1000, about 8 min left"
    assert len(lines) == 50


def test_results_go_to_a_file_though_bars_are_drawn(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """`cfs run ... > log` in a terminal: rich takes stdout for the terminal's if it is let."""
    bar = ProgressBar(terminal=True)
    screen = io.StringIO()
    monkeypatch.setattr(bar._bars.live, "console", Console(file=screen, force_terminal=True))
    with bar as progress:
        progress("room", 0.5)
        print("room 1: DGP 0.3")
    assert capsys.readouterr().out == "room 1: DGP 0.3\n"
    assert "DGP" not in screen.getvalue()


def test_time_left_is_that_of_the_items_before() -> None:
    clock = Clock()
    left = TimeLeft(clock)
    assert left.seconds(Stage("a", "case", 5, 9), 0.9) is None  # four were there
    clock.now = 10.0
    assert left.seconds(Stage("a", "case", 6, 9), 0.0) == pytest.approx(40.0)
    clock.now = 15.0
    assert left.seconds(Stage("a", "case", 6, 9), 0.5) == pytest.approx(35.0)
    clock.now = 1000.0
    assert left.seconds(Stage("a", "case", 6, 9), 0.5) == 0.0


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (None, ""),
        (0.0, "about 10 s left"),
        (44.0, "about 40 s left"),
        (250.0, "about 4 min left"),
        (5600.0, "about 93 min left"),
        (8000.0, "about 2 h left"),
        (9000.0, "about 2.5 h left"),
    ],
)
def test_time_left_in_words(seconds: float | None, words: str) -> None:
    assert spoken_left(seconds) == words


def test_steps_of_known_shares_add_up() -> None:
    told: list[tuple[str, float]] = []
    steps = summed(lambda *call: told.append(call), "inputs", {"geometry": 3, "rooms": 1})
    for label in ("geometry", "rooms"):
        part(steps, 0.0, 1.0)(label, 0.5)
        steps(label, 1.0)
    assert told == [("inputs", f) for f in (0.375, 0.75, 0.875, 1.0)]


def test_reading_a_building_is_one_stage_that_does_not_fall() -> None:
    told: list[float] = []
    read_ifc(OFFICE, progress=summed(lambda _, fraction: told.append(fraction), "inputs", STAGES))
    assert told == sorted(told) and told[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("compiled_already", [True, False])
def test_the_balance_is_compiled_beside_only_where_it_must_be(
    compiled_already: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[list[str]] = []
    real = compiling.subprocess.Popen

    def begin(command, **options):
        begun.append(command)
        return real([command[0], "-c", "pass"], **options)

    monkeypatch.setattr(compiling.subprocess, "Popen", begin)
    monkeypatch.setattr("mitsuba_cfs.compiled.must_compile", lambda entry: not compiled_already)
    with compiling.compiled_beside():
        pass
    assert len(begun) == (not compiled_already)


def test_a_stage_fills_its_share() -> None:
    told = []
    steps = in_shares(lambda *now: told.append(now), {"daylight": 0.6})
    steps("daylight", 0.5)
    steps("view matrices", 0.5)
    assert told == [("daylight", 0.3), ("view matrices", 0.5)]
