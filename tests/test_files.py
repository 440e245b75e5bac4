"""Files that are replaced whole: what is written, and which failure is told as whose."""

from __future__ import annotations

import errno
import os

import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import TEMPORARY, replacing, unnamed_file, wrong_encoding


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\nb\n\xe4c", "line 3: byte 0xe4 is not UTF-8; save the file with encoding UTF-8"),
        (b'<?xml encoding="utf-8"?>\n\xfc', "line 2: byte 0xfc is not UTF-8; save the file with encoding UTF-8"),
        (b'<?xml encoding="ISO-8859-1"?>\n\xfc', None),
        ("gr\u00fcn".encode(), None),
    ],
)
def test_a_text_that_is_not_utf_8_is_told_by_line_and_byte(content, said) -> None:
    assert wrong_encoding(content) == said


def test_an_unnamed_file_has_the_size_asked_for(tmp_path) -> None:
    with unnamed_file(5000, "a matrix", tmp_path) as file:
        assert os.fstat(file.fileno()).st_size == 5000
        assert not list(tmp_path.iterdir())


def test_an_interruption_leaves_though_the_temporary_is_gone(tmp_path) -> None:
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "a.txt") as part:
        part.unlink()
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("other", ["elsewhere/.cfs-01234567.part", "another.txt"])
def test_a_failure_of_another_file_is_not_told_as_of_this_one(tmp_path, other) -> None:
    (tmp_path / "elsewhere").mkdir()
    full = OSError(errno.ENOSPC, "No space left on device", str(tmp_path / other))
    with pytest.raises(OSError) as caught, replacing(tmp_path / "a.txt"):
        raise full
    assert caught.value is full


def test_a_failure_of_its_temporary_is_told_of_the_file(tmp_path) -> None:
    with (
        pytest.raises(DataError, match=r"a.txt: cannot be written: the disk is full"),
        replacing(tmp_path / "a.txt") as part,
    ):
        assert TEMPORARY.fullmatch(part.name)
        raise OSError(errno.ENOSPC, "No space left on device", str(part))
    assert not list(tmp_path.iterdir())
