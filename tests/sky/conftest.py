"""Weather files for the sky tests: a small one made here, public-domain ones of EnergyPlus."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from weather_files import epw_rows

from scenes.demo import WEATHER


@pytest.fixture
def year() -> list[list[str]]:
    """Rows of a year, to spoil."""
    return epw_rows()


@pytest.fixture(scope="session")
def chicago() -> Path:
    """Chicago TMY3 (public domain), which the demo ships."""
    return WEATHER


@pytest.fixture(scope="session")
def radiance() -> Path:
    """The folder of Radiance's programs; skipped without them."""
    spec = importlib.util.find_spec("pyradiance")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("Radiance (pyradiance) is not installed")
    return Path(next(iter(spec.submodule_search_locations))) / "bin"
