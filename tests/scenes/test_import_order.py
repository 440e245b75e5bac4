"""What fills a window, one room, a run: each knows those before it and none after it."""

from __future__ import annotations

from pathlib import Path

import pytest

from mitsuba_cfs.source_code import import_closure

SCENES = Path(__file__).parents[2] / "scenes"
LATER = {"fenestration": ("scenes.room", "scenes.run"), "room": ("scenes.run",)}


def modules(package: str) -> tuple[str, ...]:
    return tuple(f"scenes.{package}.{path.stem}" for path in (SCENES / package).glob("[!_]*.py"))


@pytest.mark.parametrize("package", LATER)
def test_no_module_imports_what_stands_on_it(package: str) -> None:
    assert len(modules(package)) > 3
    found = import_closure(modules(package))
    assert not [name for name in found if f"{name}.".startswith(tuple(f"{n}." for n in LATER[package]))]
