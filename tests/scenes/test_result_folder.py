"""A folder of results cut off at every step, and files that are whole or not there."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import TEMPORARY, check_file, remove_stale, replacing, temporary_folder, write_text
from scenes.result_folder import CASES, MARK, FolderMark, ResultFolder, remove_results
from tests.conftest import REPOSITORY


def write(folder: Path, **files: str) -> None:
    """Results of these files in the place of earlier ones."""
    with ResultFolder(folder, "test").replaced() as place:
        for name, text in files.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_text(text)


def content(folder: Path) -> dict[str, str]:
    return {p.name: p.read_text() for p in folder.iterdir() if p.name != MARK}


def test_new_results_replace_the_files_of_the_earlier_and_no_others(tmp_path):
    out = tmp_path / "deep" / "out"
    write(out, a="1", b="1")
    (out / "mine").write_text("mine")
    write(out, b="2", c="2")
    assert content(out) == {"b": "2", "c": "2", "mine": "mine"}
    assert not [p for p in tmp_path.rglob(".*")]


def test_an_error_leaves_the_earlier_results(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), ResultFolder(out, "test").replaced():
        raise ZeroDivisionError
    assert not out.exists()
    write(out, a="1")
    with pytest.raises(ZeroDivisionError), ResultFolder(out, "test").replaced() as place:
        (place / "a").write_text("2")
        raise ZeroDivisionError
    assert content(out) == {"a": "1"}


def test_results_in_folders_replace_those_in_folders(tmp_path):
    out = tmp_path / "out"
    write(out, **{"room/first/a": "1", "room/b": "1"})
    write(out, **{"room/first/a": "2", "room/first/c": "2", "other/deep/d": "2"})
    files = {p.relative_to(out).as_posix(): p.read_text() for p in out.rglob("*") if p.is_file()}
    assert files.pop(MARK)
    assert files == {"room/first/a": "2", "room/first/c": "2", "other/deep/d": "2"}


def test_a_folder_that_another_makes_in_the_meantime_is_used_and_keeps_its_files(tmp_path):
    out = tmp_path / "out"
    with ResultFolder(out, "test").replaced() as place:
        (place / "a").write_text("1")
        out.mkdir()
        (out / "mine").write_text("mine")
    assert content(out) == {"a": "1", "mine": "mine"}


def test_folders_have_the_rights_of_every_new_folder(tmp_path):
    (tmp_path / "plain").mkdir()
    write(tmp_path / "out", **{"room/a": "1"})
    for folder in (tmp_path / "out", tmp_path / "out" / "room"):
        assert folder.stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize(("format_", "program"), [(2, "mitsuba-cfs"), (1, "another")])
def test_only_a_mark_of_this_program_and_format_is_one(tmp_path, format_, program):
    mark = {"program": "mitsuba-cfs", "format": 1, "command": "test", "files": [], "removed": []}
    (tmp_path / MARK).write_text(json.dumps(mark))
    assert FolderMark.read(tmp_path) == FolderMark("test")
    (tmp_path / MARK).write_text(json.dumps(mark | {"format": format_, "program": program}))
    assert FolderMark.read(tmp_path) is None


def test_what_a_killed_process_had_not_finished_is_removed(tmp_path):
    """A temporary folder without a mark, one of a new result beside it, and a file."""
    out = tmp_path / "out"
    write(out, a="1")
    for folder in (out, tmp_path):
        (folder / ".cfs-0123abcd.part").mkdir()
        (folder / ".cfs-0123abcd.part" / "b").write_text("half")
    (out / ".cfs-0123abce.part.csv").write_text("half")
    (out / ".cfs-0123abc.part").write_text("another program's")
    ResultFolder(out, "test")
    assert content(out) == {"a": "1", ".cfs-0123abc.part": "another program's"}
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_an_error_names_the_users_folder(tmp_path):
    """Not the temporary one that the file was in; other files and errors stay."""
    out = tmp_path / "out"
    for inside, named in (("a", out / "a"), ("room/a", out / "room" / "a")):
        with pytest.raises(DataError) as error, ResultFolder(out, "test").replaced() as place:
            raise DataError("is odd", file=place / inside, element="line 2", field="x")
        assert str(error.value) == f"{named}: line 2: x: is odd"
        with pytest.raises(DataError) as error, ResultFolder(out, "test").replaced() as place:
            (place / inside / "no").read_text()
        assert str(error.value) == f"{named / 'no'}: cannot be written: No such file or directory"
    for file in (tmp_path / "input", None):
        with pytest.raises(DataError) as error, ResultFolder(out, "test").replaced():
            raise DataError("is odd", file=file)
        assert error.value.file == file
    with pytest.raises(FileNotFoundError), ResultFolder(out, "test").replaced():
        (tmp_path / "input").read_text()
    with pytest.raises(OSError, match="of a library"), ResultFolder(out, "test").replaced():
        raise OSError("of a library")


CUT = """
import os, sys
from pathlib import Path
from tests.scenes.test_result_folder import write
moves = 0
def cut(self, target, move=Path.replace):
    global moves
    moves += 1
    if moves > int(sys.argv[2]):
        os.kill(os.getpid(), 9)
    return move(self, target)
import mitsuba_cfs.files
write(Path(sys.argv[1]), a="1", b="1", c="1") if sys.argv[2] == "0" else None
Path.replace = cut
write(Path(sys.argv[1]), b="2", c="2", d="2")
"""


@pytest.mark.parametrize("moves", range(6))
def test_a_kill_between_two_files_is_made_good_by_the_next_run(tmp_path, moves):
    """The mark inside the finished results is written by the first move, files by the next."""
    out = tmp_path / "out"
    write(out, a="1", b="1", c="1")
    (out / "mine").write_text("mine")
    done = subprocess.run([sys.executable, "-c", CUT, str(out), str(moves)], cwd=REPOSITORY, check=False)
    old = {"a": "1", "b": "1", "c": "1", "mine": "mine"}
    new = {"b": "2", "c": "2", "d": "2", "mine": "mine"}
    assert (done.returncode == -9) == (moves < 5)
    ResultFolder(out, "test")  # what the next run does first
    assert content(out) == (old if moves == 0 else new)
    assert json.loads((out / MARK).read_text())["files"] == sorted(set(content(out)) - {"mine"})


@pytest.mark.parametrize("name", ["../mine", "/mine", "sub/../../mine", ""])
def test_a_mark_cannot_lead_out_of_its_folder(tmp_path, name):
    (tmp_path / "mine").write_text("mine")
    out = tmp_path / "out"
    write(out, a="1")
    record = json.loads((out / MARK).read_text())
    record["files"].append(name)
    (out / MARK).write_text(json.dumps(record))
    with pytest.raises(DataError, match="holds other files"):
        write(out, a="2")
    assert (tmp_path / "mine").is_file()


def test_a_link_inside_does_not_lead_to_removal_elsewhere(tmp_path):
    out = tmp_path / "out"
    write(out, **{"room/a": "1"})
    (out / "room").rename(tmp_path / "elsewhere")
    (out / "room").symlink_to(tmp_path / "elsewhere")
    write(out, b="2")
    assert (tmp_path / "elsewhere" / "a").read_text() == "1"


def test_a_file_is_the_old_one_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    path.chmod(0o600)
    with pytest.raises(ZeroDivisionError), replacing(path) as part:
        part.write_text("half")
        assert path.read_text() == "old"
        remove_stale(tmp_path)  # another process: this one is held
        assert part.is_file()
        raise ZeroDivisionError
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"] and path.read_text() == "old"
    write_text(path, "new")
    assert path.read_text() == "new" and path.stat().st_mode & 0o777 == 0o600


def test_a_temporary_file_has_a_name_that_the_next_run_removes(tmp_path):
    with replacing(tmp_path / "a.csv") as part:
        assert TEMPORARY.fullmatch(part.name) and part.suffix == ".csv"
    with pytest.raises(DataError, match="is odd"), replacing(tmp_path / "a.csv") as part:
        part.unlink()  # a writer that clears away before it gives up
        raise DataError("is odd", file=part)


def test_a_device_is_written_to_as_it_is():
    write_text("/dev/null", "gone")
    assert Path("/dev/null").is_char_device()


def test_an_error_that_is_not_of_the_file_comes_through(tmp_path):
    with pytest.raises(FileNotFoundError, match="input"), replacing(tmp_path / "a"):
        open(tmp_path / "input")
    with pytest.raises(RuntimeError, match="of a library"), replacing(tmp_path / "a"):
        raise RuntimeError("of a library")
    with pytest.raises(DataError, match="no such folder"):
        check_file(tmp_path / "no" / "a")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("damage", [b"", b"\x93NUMPY\x01", bytes(5000), None])
def test_cut_off_ratings_are_made_again_with_a_note(tmp_path, caplog, damage):
    from mitsuba_cfs.glare.annual import FIGURES, finished_glare

    keep = tmp_path / "ratings.npy"
    np.save(keep, np.ones((9, len(FIGURES))))
    assert finished_glare(keep, 9) is not None
    keep.write_bytes(keep.read_bytes()[:-100] if damage is None else damage)
    assert finished_glare(keep, 9) is None
    assert "rated again" in caplog.text and str(keep) in caplog.text
    keep.write_text("a letter")
    with pytest.raises(DataError, match="is not a file of glare ratings"):
        finished_glare(keep, 9)
    assert keep.read_text() == "a letter"


def test_matrices_on_a_full_disk_are_one_error_and_no_bus_error(tmp_path):
    """A map of a file without blocks ends the process where it is first written to."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom mitsuba_cfs import variants\n"
        "variants.activate()\n"
        "from mitsuba_cfs.trace.pictures.annual import _storage\n"
        "_storage((4096, 1024), True, Path(sys.argv[1]))[:] = 1\n"
    )
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "none", str(tmp_path)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no disk can be mounted here")
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, str(tmp_path)], cwd=REPOSITORY, capture_output=True, text=True, check=False
        )
    finally:
        subprocess.run(["umount", "-l", str(tmp_path)], check=False)
    assert done.returncode == 1 and "the disk is full" in done.stderr, done


def test_an_input_inside_is_refused_but_for_a_folder_that_is_added_to(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(DataError, match="is or contains the input"):
        ResultFolder(out, "test", inputs=[None, out / "model.ifc"])
    ResultFolder(out, "test", inputs=[out / "model.ifc"], adding=True)
    ResultFolder(out, "test", inputs=[tmp_path / "model.ifc"])


def test_files_of_others_are_found_beside_a_temporary_of_another_process(tmp_path):
    (tmp_path / "mine").touch()
    with temporary_folder(tmp_path), pytest.raises(DataError, match="holds other files"):
        ResultFolder(tmp_path, "test")
    ResultFolder(tmp_path, "test", among=True)


def test_what_is_written_early_stays_until_the_results(tmp_path):
    out = tmp_path / "out"
    ResultFolder(out, "test").early({"a": "begun"})
    assert content(out) == {"a": "begun"}
    ResultFolder(out, "test").early({"a": "begun again"})
    assert content(out) == {"a": "begun again"}
    write(out, a="1", b="1")
    ResultFolder(out, "test").early({"a": "begun"})  # not over results
    assert content(out) == {"a": "1", "b": "1"}
    write(out, a="1")
    (out / "mine").write_text("mine")
    with pytest.raises(DataError, match="holds mine, which no earlier run wrote"):
        ResultFolder(out, "test").early({"a": "begun", "mine": "begun"})
    assert content(out) == {"a": "1", "mine": "mine"}


def test_checkpoints_lie_in_the_folder(tmp_path):
    cases = ResultFolder(tmp_path / "out", "test").checkpoints(CASES)
    assert cases == tmp_path / "out" / CASES and cases.is_dir()


def test_a_folder_of_results_that_others_have_a_file_for_goes_beside(tmp_path):
    out = tmp_path / "out"
    write(out, a="1")
    (out / "room").write_text("mine")
    with pytest.raises(DataError, match="holds room/b, which no earlier run wrote; the new results are in results-1"):
        write(out, **{"room/b": "2"})
    assert (out / "room").read_text() == "mine" and (out / "a").read_text() == "1"
    assert (out / "results-1" / "room" / "b").read_text() == "2"


def test_folders_that_are_empty_without_earlier_results_go(tmp_path):
    out = tmp_path / "out"
    write(out, **{"room/first/a": "1"})
    (out / "empty").mkdir()
    write(out, b="2")
    assert sorted(path.name for path in out.iterdir()) == ["b", MARK, "empty"]


def test_results_are_removed_with_their_cases_and_files_of_others_stay(tmp_path):
    out = tmp_path / "out"
    write(out, **{"a": "1", "room/b": "1"})
    (out / CASES).mkdir()
    (out / CASES / "c.npz").touch()
    remove_results(out)
    assert not out.exists()
    write(out, a="1")
    (out / "mine").write_text("mine")
    remove_results(out)
    assert content(out) == {"mine": "mine"}
    write(out, a="2")  # its mark is still there
    assert content(out) == {"a": "2", "mine": "mine"}
    with pytest.raises(DataError, match="is no folder of results"):
        remove_results(tmp_path)


def test_results_of_other_inputs_are_replaced_only_where_asked_for(tmp_path: Path) -> None:
    """A command replaces its results of the same inputs; those of another building or rule stay."""
    out = tmp_path / "out"
    house, other, again = tmp_path / "house.ifc", tmp_path / "other.ifc", tmp_path / "second" / "house.ifc"

    def folder(*inputs: Path, rules: tuple[str, ...] = ("en17037",), replacing: bool = False) -> ResultFolder:
        return ResultFolder(out, "test", inputs=[*inputs, None], rules=rules, replacing=replacing)

    def write(results: ResultFolder, text: str) -> None:
        with results.replaced() as place:
            (place / "dossier").write_text(text)

    folder(house).early({"plan": "begun"})  # a plan is no result
    write(folder(other), "first")
    write(folder(other), "second")
    for call, words in (
        (lambda: folder(house), "holds results of other.ifc, not of house.ifc"),
        (lambda: folder(other, rules=("lm83",)), "holds results of en17037, not of lm83"),
        (lambda: folder(other, house), "holds results without house.ifc"),
        (lambda: folder(other, rules=()), "holds results with en17037"),
    ):
        with pytest.raises(DataError, match=words + ": name another folder, or add --replace"):
            call()
    assert (out / "dossier").read_text() == "second"
    write(folder(house, replacing=True), "third")
    with pytest.raises(DataError, match=r"of \.\./house.ifc, not of \.\./second/house.ifc"):
        folder(again)
    shutil.move(out, tmp_path / "moved" / "out")
    out = tmp_path / "moved" / "out"
    folder(tmp_path / "moved" / "house.ifc")  # moved with its inputs
