"""The order of the files of a run: what takes long is begun first."""

from __future__ import annotations

from types import SimpleNamespace

from tests.conftest import REPOSITORY, pytest_collection_modifyitems


def item(path: str, *marks: str) -> SimpleNamespace:
    return SimpleNamespace(path=path, get_closest_marker=lambda name: name in marks or None)


def test_files_with_an_early_test_come_first_and_stay_whole():
    items = [item("a"), item("b"), item("b", "early"), item("c", "slow"), item("d", "early")]
    pytest_collection_modifyitems(items)
    assert [one.path for one in items] == ["b", "b", "d", "a", "c"]


def test_the_runs_of_the_makefile_keep_this_order():
    """pytest-xdist would hand out files by how many tests they have."""
    assert "--dist loadfile --no-loadscope-reorder" in (REPOSITORY / "Makefile").read_text()
