"""Rooms' files written beside each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

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


def _files(folder: Path) -> dict[str, bytes]:
    """The contents of all files in a folder by their names."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}
