"""Weather files for the sky tests: a small one made here, public-domain ones of EnergyPlus."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from weather_files import epw_rows


@pytest.fixture
def year() -> list[list[str]]:
    """Rows of a year, to spoil."""
    return epw_rows()


@pytest.fixture(scope="session")
def chicago() -> Path:
    """Chicago TMY3 (public domain) from the EnergyPlus package; skipped without it."""
    spec = importlib.util.find_spec("pyenergyplus")
    places = [] if spec is None else list(spec.submodule_search_locations or [])
    name = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
    found = [hit for place in places for hit in Path(place).rglob(name)]
    if not found:
        pytest.skip("the EnergyPlus package (pyenergyplus) is not installed")
    return found[0]


@pytest.fixture(scope="session")
def radiance() -> Path:
    """The folder of Radiance's programs; skipped without them."""
    spec = importlib.util.find_spec("pyradiance")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("Radiance (pyradiance) is not installed")
    return Path(next(iter(spec.submodule_search_locations))) / "bin"
