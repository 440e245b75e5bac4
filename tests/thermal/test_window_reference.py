"""The stored results of WINDOW's engine are what their generator writes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

pywincalc = pytest.importorskip("pywincalc")

from tests.conftest import WINDOW_GLAZING  # noqa: E402
from tests.validation.window_reference import write  # noqa: E402

pytestmark = pytest.mark.peer


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
