"""ASHRAE 140-2020 envelope cases inside the range of the standard's example programs."""

from __future__ import annotations

import pytest

from scenes.validation.ashrae140 import compare


def outside(table) -> list[str]:
    """The figures out of range."""
    return [f"{r.case} {r.output}" for r in table.itertuples() if not r.inside]


def test_basic_cases_lie_in_the_range(reference_data):
    folder = reference_data / "ashrae140"
    table = compare(folder, ["600", "900", "900FF"])
    assert len(table) == 12
    assert outside(table) == []


@pytest.mark.slow
def test_all_cases_lie_in_the_range(reference_data):
    table = compare(reference_data / "ashrae140")
    assert len(table) >= 80
    # 670 (single pane): cooling 6.624 MWh, the range ends at 6.623
    assert set(outside(table)) <= {"670 cooling"}
