"""Matrices kept on disk: found again, never wrong, and resumed after a kill."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.matrices import cache as cache_module
from mitsuba_cfs.matrices.cache import BatchMean, MatrixCache, default_folder, digest
from tests.trace import rooms

BY = "mitsuba_cfs.trace.kernels.estimate"  # the module that computes what these tests keep
STATE = BatchMean(3, np.arange(6.0).reshape(2, 3), np.ones((2, 3)), np.ones((2, 3, 3)), 1.5, True)


@pytest.fixture
def cache(tmp_path) -> MatrixCache:
    return MatrixCache(tmp_path / "cache")


def batches(log: list[int], fail_at: int | None = None):
    """Batches of random numbers keyed by their number, that note themselves in `log`."""

    def batch(number: int):
        if number == fail_at:
            raise KeyboardInterrupt
        log.append(number)
        return np.random.default_rng(number).random((4, 5))

    return batch


def test_a_state_comes_back_as_it_was(cache):
    entry = cache.entry("view matrix", 1, by=BY)
    assert entry.load() is None
    entry.save(STATE)
    found = entry.load()
    assert (found.count, found.seconds, found.finished) == (3, 1.5, True)
    assert np.array_equal(found.mean, STATE.mean) and np.array_equal(found.spread, STATE.spread)
    assert list(cache.folder.iterdir()) == [entry.path]  # nothing half written stays


def test_a_finished_matrix_is_not_traced_again(cache):
    from mitsuba_cfs.trace.kernels.estimate import accumulate

    log: list[int] = []
    first, second = (accumulate(batches(log), entry=cache.entry("m", 1, by=BY)) for _ in range(2))
    assert log == list(range(16))
    assert np.array_equal(first.values, second.values)
    assert np.array_equal(first.standard_error, second.standard_error)
    accumulate(batches(log), entry=cache.entry("m", 2, by=BY))
    assert len(log) == 32


def test_a_stopped_run_goes_on_to_the_same_bits(cache):
    from mitsuba_cfs.trace.kernels.estimate import accumulate

    whole = accumulate(batches([]))
    log: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        accumulate(batches(log, fail_at=7), entry=cache.entry("m", 1, by=BY))
    resumed = accumulate(batches(log), entry=cache.entry("m", 1, by=BY))
    assert log == list(range(16))  # each batch once
    assert np.array_equal(whole.values, resumed.values)
    assert np.array_equal(whole.standard_error, resumed.standard_error)


@pytest.mark.parametrize("damage", ["short", "empty", "bits", "text"])
def test_a_damaged_file_is_ignored_and_written_anew(cache, damage):
    from mitsuba_cfs.trace.kernels.estimate import accumulate

    entry = cache.entry("m", 1, by=BY)
    whole = accumulate(batches([]), entry=entry)
    data = bytearray(entry.path.read_bytes())
    middle = len(data) // 2
    data[middle] ^= 0xFF
    entry.path.write_bytes({"short": data[:middle], "empty": b"", "bits": data, "text": b"no zip"}[damage])
    assert entry.load() is None
    again = accumulate(batches([]), entry=entry)
    assert np.array_equal(whole.values, again.values)
    assert entry.load().finished


def test_a_folder_that_cannot_be_written_costs_a_warning_only(tmp_path, caplog):
    from mitsuba_cfs.trace.kernels.estimate import accumulate

    (tmp_path / "file").write_text("in the way")
    entry = MatrixCache(tmp_path / "file").entry("m", 1, by=BY)
    result = accumulate(batches([]), entry=entry)
    assert np.array_equal(result.values, accumulate(batches([])).values)
    assert "not cached" in caplog.text


def test_the_longest_unused_files_go_first(cache):
    small = replace(cache, limit=3 * 1600)
    for number in range(6):
        entry = small.entry("m", number, by=BY)
        entry.save(STATE)
        os.utime(entry.path, (1000 + number, 1000 + number))
    small.trim()
    left = {file for file in cache.folder.iterdir()}
    assert sum(file.stat().st_size for file in left) <= small.limit
    paths = [small.entry("m", number, by=BY).path for number in range(6)]
    assert left and left == set(paths[-len(left) :])  # the newest
    oldest_left = paths[-len(left)]
    os.utime(oldest_left, (1, 1))
    replace(small, limit=0).trim(keep=oldest_left)
    assert set(cache.folder.iterdir()) == {oldest_left}


def test_small_files_go_after_larger_ones(cache):
    small = replace(cache, limit=1 << 20)
    building = small.entry("building", 1, by=BY)
    building.write({"text": np.zeros(100, dtype=np.uint8)})
    os.utime(building.path, (1, 1))
    for number in range(20):
        matrix = small.entry("m", number, by=BY)
        matrix.write({"mean": np.full((100, 100), number + 1.0)})
    assert building.path.exists() and matrix.path.exists()
    assert sum(file.stat().st_size for file in cache.folder.iterdir()) <= small.limit


def test_the_folder_is_listed_seldom_and_keeps_its_limit(cache, monkeypatch):
    """As large as a 64th of the limit, or as forty files."""
    trims, trim = [], MatrixCache.trim
    monkeypatch.setattr(MatrixCache, "trim", lambda *of, **options: (trims.append(1), trim(*of, **options)))
    cache.folder.mkdir()
    left = cache.folder / ".cfs-01234567.part.npz"
    left.touch()  # of a killed process
    first = cache.entry("m", 0, by=BY)
    first.save(STATE)
    assert len(trims) == 1 and not left.exists()  # another process may have written much
    size = first.path.stat().st_size
    small = replace(cache, limit=64 * 40 * size)
    most = 0
    for number in range(1, 3000):
        small.entry("m", number, by=BY).save(STATE)
        most = max(most, number % 100 == 0 and sum(file.stat().st_size for file in cache.folder.iterdir()))
    assert small.limit < most <= small.limit + 41 * size
    assert 70 <= len(trims) <= 80


def test_all_rooms_of_a_process_share_what_was_hashed(monkeypatch, tmp_path):
    monkeypatch.setenv("CFS_CACHE", str(tmp_path))
    assert MatrixCache.of_user().hashes is MatrixCache.of_user().hashes
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "other"))
    assert MatrixCache.of_user().folder == tmp_path / "other"


def test_a_matrix_without_batches_is_computed_once(cache):
    entry, calls = cache.entry("m", 1, by=BY), []

    def compute():
        calls.append(1)
        return np.arange(6.0).reshape(2, 3)

    first, second = (cache_module.cached_or_computed(entry, compute) for _ in range(2))
    assert np.array_equal(first, second) and len(calls) == 1
    assert np.array_equal(cache_module.cached_or_computed(None, compute), first) and len(calls) == 2


def test_zeros_take_little_space(cache):
    cells, dense = np.zeros((132, 145, 146), dtype=np.float32), np.linspace(0.1, 0.9, 10_000)
    cells[::40, ::7] = 0.25
    entry = cache.entry("cells", 1, by=BY)
    entry.write({"cells": cells, "dense": dense, "count": np.int64(3)})
    assert entry.path.stat().st_size < dense.nbytes + cells.nbytes / 50
    stored = entry.read(lambda data: {name: data[name] for name in data})
    assert np.array_equal(stored["cells"], cells) and stored["cells"].dtype == np.float32
    assert np.array_equal(stored["dense"], dense) and stored["count"] == 3
    again = cache.entry("cells", 2, by=BY)
    again.write({"cells": cells, "dense": dense, "count": np.int64(3)})
    assert again.path.read_bytes() == entry.path.read_bytes()


def test_every_input_counts():
    room, groups = rooms.test_room()
    darker = replace(room, reflectance=room.reflectance * 0.99)
    inputs = [
        (room, groups, 1, 0.5, None, "a"),
        (darker, groups, 1, 0.5, None, "a"),
        (room, rooms.skylight_room()[1], 1, 0.5, None, "a"),
        (room, groups, 2, 0.5, None, "a"),
        (room, groups, 1, 0.5, 0, "a"),
        (room, groups, 1, 0.5, None, "a", None),
        (room, [*groups, 1], 0.5, None, "a"),
    ]
    assert len({digest(*values) for values in inputs}) == len(inputs)
    assert digest(*inputs[0]) == digest(*rooms.test_room(), 1, 0.5, None, "a")
    assert digest("ab", "c") != digest("a", "bc")
    assert digest(1) != digest(1.0) != digest("1.0")
    assert len({digest(v) for v in (("1",), "('1',)", (1,), (1.0,), (True,), ("1", None))}) == 6
    with pytest.raises(ValueError, match="cannot hash"):
        digest(object())


def test_what_is_hashed_again_is_not_read_again(monkeypatch):
    """Fifteen matrices of a room have the whole building in their keys."""
    room, groups = rooms.test_room()
    fed, feed = [], cache_module._feed
    monkeypatch.setattr(cache_module, "_feed", lambda *of: (fed.append(of[1]), feed(*of)))
    hashes = cache_module.RecentHashes()
    first, again = digest("D", room, groups, 1, hashes=hashes), replace(room)
    assert any(value is room.triangles for value in fed)
    fed.clear()
    assert digest("D", room, groups, 1, hashes=hashes) == first
    assert not any(value is room.triangles for value in fed)
    for _ in range(cache_module.RECENT_HASHES + 1):  # others in between
        digest(replace(room, reflectance=room.reflectance / 2), hashes=hashes)
    assert digest("D", room, groups, 1, hashes=hashes) == first == digest("D", again, groups, 1)


def test_another_process_gets_no_objects_with_the_cache(tmp_path):
    cache, room = MatrixCache(tmp_path), rooms.test_room()[0]
    entry = cache.entry("D", room, by=BY)
    other = pickle.loads(pickle.dumps(cache))
    assert other == cache and len(pickle.dumps(cache)) < 1000
    assert other.entry("D", room, by=BY).path == entry.path


def test_the_environment_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("CFS_CACHE", str(tmp_path))
    assert default_folder() == tmp_path
    monkeypatch.delenv("CFS_CACHE")
    assert default_folder().name == "cfs"


def test_view_and_daylight_matrices_come_from_the_cache(variant, cache):
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()

    def both(samples: int):
        view = view_matrix(room, groups, [[1, 1, 1]], [[0, 0, 1]], samples=samples, cache=cache)
        daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=samples, cache=cache)
        return view, daylight

    first, second = both(64), both(64)
    assert len(list(cache.folder.iterdir())) == 2
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.values, other.values) and one.seconds == other.seconds
    both(32)
    assert len(list(cache.folder.iterdir())) == 4


def test_the_sun_and_what_is_absorbed_come_from_the_cache(variant, cache, monkeypatch):
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels import scattering
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices import adjacent
    from mitsuba_cfs.trace.sun import direct

    room, groups = rooms.test_room()
    K, few = KLEMS_FULL.size, Stopping(batches=2)

    def both(tau: float, reflectance: float):
        way = scattering.KlemsScattering(KLEMS_FULL, np.zeros((K, K)), np.full(K, tau))
        sun = direct.direct_sun_matrix(
            room,
            rooms.NOTHING,
            groups,
            [way],
            [[1.8, 1, 0.8]],
            [[0, 0, 1]],
            suns=[[0, -1, 0.6]],
            window_points=16,
            stopping=few,
            cache=cache,
        )
        absorbed = adjacent.absorption_matrix(
            room, groups, window_reflectance=[reflectance], samples=16, stopping=few, cache=cache
        )
        return sun.values, absorbed.values

    first = both(0.5, 0.1)
    with monkeypatch.context() as patch:
        for module in (direct, adjacent):
            patch.setattr(module, "TracedScene", _must_not_trace(module.TracedScene))
        assert all(np.array_equal(*pair) for pair in zip(first, both(0.5, 0.1), strict=True))
    other = both(0.6, 0.2)
    assert other[0] == pytest.approx(first[0] * 1.2) and not np.array_equal(other[1], first[1])
    with pytest.raises(ValueError, match="needs a `key`"):
        direct.direct_sun_matrix(
            room,
            rooms.NOTHING,
            groups,
            [scattering.PluginScattering(None)],
            [[1.8, 1, 0.8]],
            [[0, 0, 1]],
            suns=[[0, -1, 0.6]],
            cache=cache,
        )


def _must_not_trace(scene):
    """The scene with tables but without a mesh that a ray could meet."""

    class Untraceable(scene):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            self.scene = None

    return Untraceable


SLOW_RUN = """
    import sys, time
    from pathlib import Path
    import numpy as np
    from mitsuba_cfs import variants
    variants.activate("llvm_ad_mono")
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.trace.kernels import estimate

    estimate.SAVE_SECONDS = 0.0
    estimate.SAVE_SHARE = 0.0

    def batch(number):
        if number == 6:
            Path(sys.argv[2]).touch()
            time.sleep(60)  # the batch under way when the signal comes
        return np.random.default_rng(number).random((4, 5))

    cache = MatrixCache(Path(sys.argv[1]))
    estimate.accumulate(batch, entry=cache.entry("m", 1, by="mitsuba_cfs.trace.kernels.estimate"))
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_a_killed_process_loses_the_batch_under_way_only(cache):
    from mitsuba_cfs.trace.kernels.estimate import accumulate

    program = [sys.executable, "-c", textwrap.dedent(SLOW_RUN), str(cache.folder)]
    here = cache.folder.parent / "batch6"
    process = subprocess.Popen([*program, str(here)], cwd=Path(__file__).parents[2])
    end = time.monotonic() + 300  # of a busy machine
    while not here.exists() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    state = cache.entry("m", 1, by=BY).load()
    assert state.count == 6 and not state.finished
    log: list[int] = []
    resumed = accumulate(batches(log), entry=cache.entry("m", 1, by=BY))
    assert log == list(range(6, 16))
    assert np.array_equal(resumed.values, accumulate(batches([])).values)
