"""Fixtures of the tests of every command that writes (`tests.scenes.writing_jobs`)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.scenes.quick_work import quick_work
from tests.scenes.small_box import blind as blind  # fixtures
from tests.scenes.small_box import glass as glass
from tests.scenes.small_box import milk as milk
from tests.scenes.small_box import skies as skies
from tests.scenes.small_box import weather as weather
from tests.scenes.writing_jobs import JOBS, Place


@pytest.fixture
def own_cache(tmp_path_factory, monkeypatch):
    """No file of the user's is touched."""
    monkeypatch.setenv("CFS_CACHE", str(tmp_path_factory.mktemp("cache")))


@pytest.fixture
def place(tmp_path, monkeypatch, own_cache) -> Callable[[str], Place]:
    """The place of a job, whose command works quickly in this process."""
    quick_work(monkeypatch.setattr)

    def of(name: str, root: Path = tmp_path) -> Place:
        for folder in ("inputs", "results"):
            (tmp_path / folder).mkdir(exist_ok=True)
        (root / "results").mkdir(exist_ok=True)
        return Place(JOBS[name], tmp_path / "inputs", root / "results" / JOBS[name].name)

    return of


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stubs of rooms' results have no arrays that a run could hold on disk."""
    from scenes.run import run as rooms

    monkeypatch.setattr(rooms.StoredArrays, "stored", lambda self, room: room)
