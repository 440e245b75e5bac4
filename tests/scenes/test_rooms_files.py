"""Rooms' files written beside each other."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from scenes.language.catalogue import current_language, in_language
from scenes.result_folder import ResultFolder
from scenes.run import outputs
from tests.report.synthetic import run_result


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_files_of_rooms_beside_each_other(processes, tmp_path, monkeypatch):
    """The same, and each room is told of."""
    monkeypatch.setattr(outputs, "TASKS_A_PROCESS", 1)
    result, told = run_result(picture_size=60, pictures=1), []
    for name, count in (("one", 1), ("some", processes)):
        outputs.write_results(
            result,
            ResultFolder(tmp_path / name, "run"),
            processes=count,
            progress=lambda stage, share: told.append((stage, share)),
        )
    assert told == 2 * [("results", 1 / 3), ("results", 2 / 3)]
    one, some = (_files(tmp_path / name) for name in ("one", "some"))
    assert len(one) > 20
    assert one == some


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_room_that_cannot_be_written_ends_the_writing(processes, tmp_path, monkeypatch):
    """Nothing is left of it, and the fault is told as it is in this process."""
    monkeypatch.setattr(outputs, "TASKS_A_PROCESS", 1)
    result = run_result(picture_size=60, pictures=1)
    first, second = result.spaces
    (picture,) = second.glare.pictures
    picture = replace(picture, luminance=-picture.luminance)
    second = replace(second, glare=replace(second.glare, pictures=(picture,)))
    with pytest.raises(ValueError, match="cannot hold negative"):
        outputs.write_results(
            replace(result, spaces=(first, second)), ResultFolder(tmp_path / "out", "run"), processes=processes
        )
    assert list(tmp_path.iterdir()) == []


def test_pages_are_filled_while_processes_write_the_rooms(tmp_path, monkeypatch):
    """Each waits for the other to begin; captions have the page's language."""
    monkeypatch.setattr(outputs, "TASKS_A_PROCESS", 1)
    rooms, page, languages = threading.Event(), threading.Event(), []

    def write_rooms(*_: object) -> None:
        languages.append(current_language())
        rooms.set()
        assert page.wait(30)

    def write_report(_: object, path: Path) -> None:
        page.set()
        assert rooms.wait(30)
        path.write_text("a page")

    monkeypatch.setattr(outputs, "_write_rooms", write_rooms)
    with in_language("fr"):
        outputs.write_results(run_result(pictures=0), ResultFolder(tmp_path / "out", "run"), write_report, processes=2)
    assert languages == ["fr"]
    assert (tmp_path / "out" / "report.html").read_text() == "a page"


def test_a_fault_of_the_processes_is_raised_after_the_pages(tmp_path, monkeypatch):
    """And no results are left."""
    monkeypatch.setattr(outputs, "TASKS_A_PROCESS", 1)
    monkeypatch.setattr(outputs, "_write_rooms", _disk_is_full)
    with pytest.raises(OSError, match="no space left"):
        outputs.write_results(run_result(pictures=0), ResultFolder(tmp_path / "out", "run"), processes=2)
    assert list(tmp_path.iterdir()) == []


def _disk_is_full(*_: object) -> None:
    raise OSError("no space left")


def _files(folder: Path) -> dict[str, bytes]:
    """The contents of all files in a folder by their names."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}
