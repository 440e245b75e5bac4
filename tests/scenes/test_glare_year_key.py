"""Ratings of a year are found again for the same rooms only: joins and corrections count."""

from __future__ import annotations

import pytest

from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.year import read_year

pytestmark = pytest.mark.usefixtures("variant")


def test_corrections_beside_the_model_are_part_of_the_key(tmp_path):
    path = tmp_path / "office.ifc"
    path.write_bytes(OFFICE.read_bytes())
    options = YearOptions(path, WEATHER, VENETIAN_BLIND, spaces=("A",))
    before = read_year(options).digest
    assert read_year(options).digest == before
    path.with_suffix(".corrections.toml").write_text("surroundings = 0.9\n")
    assert read_year(options).digest != before
