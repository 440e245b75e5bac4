"""WINDOW's engine as a source of the Blackbox' data: the reference double glazing, made anew."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pywincalc = pytest.importorskip("pywincalc")

from scenes.evidence.validation.window_reference import layers, write  # noqa: E402
from tests.conftest import WINDOW_GLAZING  # noqa: E402
from thermal.iso15099 import iso15099_data  # noqa: E402

pytestmark = pytest.mark.peer


def test_reference_glazing_comes_out_of_its_layers():
    panes, gaps = layers("dgu")
    data = iso15099_data(panes, gaps, angles_deg=(0.0, 30.0, 60.0))
    stored = json.loads((WINDOW_GLAZING / "blackbox_dgu.json").read_text())
    angular = {row["theta"]: row for row in stored["angular"]}
    # the same engine and layers: only the glazing's height and rounding differ
    assert data.u_value == pytest.approx(stored["U"][0]["U"], rel=2e-3)
    assert data.r_inner == pytest.approx(stored["U"][0]["R_i"], rel=5e-3)
    for i, theta in enumerate((0, 30, 60)):
        assert data.transmittance[i] == pytest.approx(angular[theta]["tau"], abs=2e-3)
        assert data.g_value[i] == pytest.approx(angular[theta]["g"], abs=5e-3)
    fit = json.loads((WINDOW_GLAZING / "blackbox_R.json").read_text())["dgu_fit"]
    mean, difference = np.array([0.0, 10.0, 25.0]), np.array([10.0, 20.0, 5.0])
    x = mean - 10
    c = fit
    stored_c = c[0] + c[1] * x + c[2] * difference + c[3] * difference**2
    stored_c = stored_c + c[4] * x * difference + c[5] * x**2
    # two fits of 1.3 % rms each to nearly the same points
    np.testing.assert_allclose(data.resistance.at(mean, difference), 1 / stored_c, rtol=0.02)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """What the generator writes now."""
    folder = tmp_path_factory.mktemp("window")
    write(["dgu"], folder)
    return folder


NAMES = ("blackbox_dgu.json", "blackbox_R.json", "blackbox_back.json")


def numbers(data: object, other: object, at: str = "") -> Iterator[tuple[str, float, float]]:
    """Every number of the first with its place, and the one that the second has there."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from numbers(value, other[key], f"{at}.{key}")
    elif isinstance(data, list):
        for i, (value, others) in enumerate(zip(data, other, strict=True)):
            yield from numbers(value, others, f"{at}[{i}]")
    elif isinstance(data, int | float):
        yield at, data, other


@pytest.mark.parametrize("name", NAMES)
def test_the_stored_files_are_what_the_generator_writes(written, name):
    ours, stored = (json.loads((f / name).read_text()) for f in (written, WINDOW_GLAZING))
    found = list(numbers(ours, stored))
    assert len(found) >= 4
    for at, value, kept in found:
        assert value == pytest.approx(kept, rel=1e-6, abs=1e-9), at


@pytest.mark.parametrize("name", NAMES)
def test_the_generator_writes_what_others_computed(written, reference_data, name):
    theirs = json.loads((reference_data / "energyplus" / name).read_text())
    for at, value, other in numbers(json.loads((written / name).read_text()), theirs):
        assert value == pytest.approx(other, rel=1e-6, abs=1e-9), at
