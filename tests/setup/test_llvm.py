"""Which LLVM library is chosen, on folders of files that only have the names of libraries."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mitsuba_cfs import llvm, variants
from mitsuba_cfs.errors import VariantError

linux_only = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ELF and ldconfig are Linux")


@pytest.fixture(autouse=True)
def no_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a setting of the user's; what a test selects is undone after it."""
    monkeypatch.setenv(llvm.VARIABLE, "")


def _library(folder: Path, name: str, content: bytes = b"") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / name
    file.write_bytes(content)
    return file


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("lib/libLLVM.so.19.1", (19, 1)),
        ("lib/libLLVM-14.so.1", (14,)),
        ("lib/libLLVM-15.0.7.so", (15, 0, 7)),
        ("lib/libLLVM-17.so", (17,)),
        ("lib/llvm-18/lib/libLLVM.so", (18,)),
        ("opt/llvm@20/lib/libLLVM.dylib", (20,)),
        ("Cellar/llvm/19.1.7/lib/libLLVM.dylib", (19, 1, 7)),
        ("lib/libLLVM.so", ()),
    ],
)
def test_version_is_told_by_names(tmp_path: Path, name: str, version: tuple[int, ...]) -> None:
    file = tmp_path / name
    assert llvm.version_of(_library(file.parent, file.name)) == version


def test_version_of_a_link_is_that_of_its_target(tmp_path: Path) -> None:
    target = _library(tmp_path / "llvm-19", "libLLVM.so.19.1")
    link = tmp_path / "libLLVM.so"
    link.symlink_to(target)
    assert llvm.version_of(link) == (19, 1)


def test_windows_version_is_that_of_its_headers(tmp_path: Path) -> None:
    (tmp_path / "root" / "lib" / "clang" / "19").mkdir(parents=True)
    assert llvm.version_of(_library(tmp_path / "root" / "bin", "LLVM-C.dll")) == (19,)


@pytest.mark.parametrize("version", ["13", "14", "15", "16"])
def test_library_that_aborts_is_rejected_with_its_reason(tmp_path: Path, version: str) -> None:
    _library(tmp_path, f"libLLVM-{version}.so.1")
    (found,) = llvm.candidates([tmp_path], x86=True)
    assert not found.usable
    assert "x86" in found.reason or "older" in found.reason
    assert llvm.select_library([tmp_path], x86=True) is None
    assert not os.environ[llvm.VARIABLE]


def test_best_library_comes_first(tmp_path: Path) -> None:
    for name in ("libLLVM-14.so.1", "libLLVM-15.so.1", "libLLVM-17.so.1", "libLLVM.so.19.1"):
        _library(tmp_path, name)
    order = [found.version for found in llvm.candidates([tmp_path], x86=True)]
    assert order == [(19, 1), (17,), (15,), (14,)]
    assert llvm.select_library([tmp_path], x86=True) == tmp_path / "libLLVM.so.19.1"
    assert os.environ[llvm.VARIABLE] == str(tmp_path / "libLLVM.so.19.1")


def test_old_library_serves_on_other_processors_than_x86(tmp_path: Path) -> None:
    _library(tmp_path, "libLLVM-15.so.1")
    assert llvm.select_library([tmp_path], x86=False) == tmp_path / "libLLVM-15.so.1"


def test_what_is_chosen_survives_a_minimum_of_an_array() -> None:
    """Each library of this machine that counts as usable, whatever its processor is."""
    usable = [found for found in llvm.candidates() if found.usable]
    code = "import drjit.llvm as dr; import drjit; "
    code += "print(drjit.minimum(drjit.arange(dr.Float, 1000) + 0.5, 0.25)[999])"
    for found in usable:
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            env=os.environ | {llvm.VARIABLE: str(found.path)},
        )
        assert done.stdout.strip() == "0.25", (found, done.stderr[-300:])


def test_links_to_one_library_count_once(tmp_path: Path) -> None:
    target = _library(tmp_path, "libLLVM.so.19.1")
    (tmp_path / "libLLVM-19.so").symlink_to(target)
    assert len(llvm.candidates([tmp_path])) == 1


def test_other_files_are_no_libraries(tmp_path: Path) -> None:
    for name in ("libLLVMX86Desc.so", "libLLVMSupport.a", "libLLVM-19.txt", "libclang.so.19"):
        _library(tmp_path, name)
    assert llvm.candidates([tmp_path]) == []


@linux_only
def test_library_of_another_processor_is_rejected(tmp_path: Path) -> None:
    arm = b"\x7fELF\x01" + b"\0" * 13 + b"\x28\0"  # 32 bit, ARM
    _library(tmp_path, "libLLVM.so.19.1", arm)
    (found,) = llvm.candidates([tmp_path], x86=True)
    assert not found.usable
    assert "another processor" in found.reason


def test_the_users_own_setting_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _library(tmp_path, "libLLVM.so.19.1")
    monkeypatch.setenv(llvm.VARIABLE, "/somewhere/libLLVM-14.so.1")
    assert llvm.select_library([tmp_path]) == Path("/somewhere/libLLVM-14.so.1")
    assert os.environ[llvm.VARIABLE] == "/somewhere/libLLVM-14.so.1"


def test_nothing_found_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variants.llvm, "select_library", lambda: None)
    monkeypatch.setattr(variants.llvm, "candidates", list)
    with pytest.raises(VariantError, match="apt-get install libllvm19") as caught:
        variants.choose()
    assert "\n" not in str(caught.value)
    assert variants.choose(vectorised=False).variant == variants.SCALAR


def test_missing_file_in_the_setting_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(llvm.VARIABLE, "/nowhere/libLLVM.so.19")
    assert variants.llvm_fault() == f"{llvm.VARIABLE}=/nowhere/libLLVM.so.19 is no such file"
