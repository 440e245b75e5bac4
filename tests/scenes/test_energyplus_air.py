"""Leaks, heat recovery and an ideal plant as in EnergyPlus; quick twin: `test_ventilation`."""

from __future__ import annotations

import pytest


@pytest.mark.slow
def test_a_year_of_leaks_and_recovered_heat_is_as_in_energyplus() -> None:
    """The bars are those of an office with set-back (`test_schedules`)."""
    pytest.importorskip("pyenergyplus")
    from tests.validation.energyplus_air import compare

    found = compare("DOE-2", "N")
    assert found["air rmse K"] < 0.1
    for load, bar in (("heating", 0.04), ("cooling", 0.034)):
        theirs = found[f"EnergyPlus {load} kWh"]
        assert found[f"{load} kWh"] == pytest.approx(theirs, rel=bar)
