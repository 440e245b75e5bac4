"""A building that was read is read again only where its files, options or readers changed."""

from __future__ import annotations

import shutil
import time
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import bim.building_file
from bim.building_file import READER, ReadOptions, _NotStored, _restored, read_building_file, stored
from bim.shoebox import shoebox
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.processes import ProcessEnded, each_apart
from mitsuba_cfs.source_code import import_closure
from scenes.cli import run
from scenes.demo import OFFICE


def same(a: object, b: object) -> bool:
    """Whether two objects have the same values, to the last bit, and are of the same types."""
    if type(a) is not type(b):
        return False
    if is_dataclass(a):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=True) and b.flags.writeable
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    return bool(a == b)


@pytest.fixture
def office(tmp_path) -> Path:
    return shutil.copy(OFFICE, tmp_path / "office.ifc")


@pytest.fixture
def cache(tmp_path) -> MatrixCache:
    return MatrixCache(tmp_path / "cache")


@pytest.fixture
def reads(monkeypatch) -> list[Path]:
    """The files that the IFC reader reads."""
    read, files = bim.building_file._read_ifc, []

    def noted(path, options, progress):
        files.append(path)
        return read(path, options, progress)

    kind = replace(bim.building_file.IFC, reader=noted)
    monkeypatch.setattr(bim.building_file, "IFC", kind)
    monkeypatch.setattr(bim.building_file, "_format", lambda path: kind)
    return files


def test_a_building_comes_out_of_the_cache_as_it_was_read(office, cache, reads) -> None:
    first, again = (read_building_file(office, cache=cache) for _ in range(2))
    assert reads == [office]
    assert same(first, again) and again is not first
    assert same(again, read_building_file(office)) and len(reads) == 2
    by_value = {id(face.construction) for space in first.spaces for face in space.faces}
    restored = {id(face.construction) for space in again.spaces for face in space.faces}
    assert len(restored) == len(by_value)  # one object for all faces that share one


def test_other_contents_corrections_and_options_are_read_again(office, cache, reads) -> None:
    read_building_file(office, cache=cache)
    read_building_file(office, ReadOptions(furniture=True), cache=cache)
    assert len(reads) == 2
    office.with_suffix(".corrections.toml").write_text("north = 30.0\n")
    turned = read_building_file(office, cache=cache)
    assert len(reads) == 3 and any(one.code == "corrections-used" for one in turned.issues)
    text = office.read_text().replace("'South office'", "'Bureau'")
    office.write_text(text)
    assert any("Bureau" in s.label for s in read_building_file(office, cache=cache).spaces)
    assert len(reads) == 4


def test_a_file_that_changes_while_it_is_read_is_not_stored(office, cache, monkeypatch) -> None:
    read = bim.building_file._read_ifc

    def changing(path, options, progress):
        building = read(path, options, progress)
        office.write_text(office.read_text() + "\n")
        return building

    kind = replace(bim.building_file.IFC, reader=changing)
    monkeypatch.setattr(bim.building_file, "IFC", kind)
    monkeypatch.setattr(bim.building_file, "_format", lambda path: kind)
    read_building_file(office, cache=cache)
    assert not list(cache.folder.glob("building-*"))


def test_a_building_that_lacks_what_a_process_did_not_finish_is_not_stored(office, cache, monkeypatch) -> None:
    read = bim.building_file._read_ifc

    def interrupted(path, options, progress):
        assert isinstance(each_apart(time.sleep, [60.0], limit_s=0.2)[0], ProcessEnded)
        return read(path, options, progress)

    kind = replace(bim.building_file.IFC, reader=interrupted)
    monkeypatch.setattr(bim.building_file, "IFC", kind)
    monkeypatch.setattr(bim.building_file, "_format", lambda path: kind)
    read_building_file(office, cache=cache)
    assert not list(cache.folder.glob("building-*"))


def test_the_sources_that_read_and_store_are_in_the_key() -> None:
    assert {"bim.ifc.building", "bim.building_file"} <= import_closure((READER,))


def test_a_damaged_file_of_the_cache_is_read_from_its_source(office, cache, reads) -> None:
    first = read_building_file(office, cache=cache)
    [file] = cache.folder.glob("building-*")
    other = bytearray(file.read_bytes())
    other[other.index(b"PK\x01\x02") + 10] ^= 0xFF  # method of compression
    for content in (b"", file.read_bytes()[:-400], other):
        file.write_bytes(content)
        assert same(first, read_building_file(office, cache=cache))
    np.savez(file, text=np.frombuffer(b'[["record", 0], [["Popen", 1]], []]', np.uint8), values=[])
    assert same(first, read_building_file(office, cache=cache)) and len(reads) == 5


@pytest.mark.parametrize("more", [["check"], ["export", "--gltf", "office.glb"]])
def test_commands_read_again_with_no_cache(office, tmp_path, monkeypatch, more) -> None:
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    for option, stored_files in (["--no-cache"], 0), ([], 1):
        assert run([*more, str(office), *option]) == 0
        assert len([*tmp_path.glob("cache/building-*")]) == stored_files


def test_an_object_that_is_no_record_is_not_stored() -> None:
    building = shoebox()
    assert same(building, _restored(stored(building)))
    with pytest.raises(_NotStored):
        stored(replace(building, name=np.float64(1.0)))
