"""The benchmarks: a ratio's arithmetic, the registry, a missing peer, the JSON file."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import bsdf_plugin, harness
from tests.benchmarks.__main__ import main


def comparison(**changes) -> harness.Comparison:
    ours = harness.Run("ours", "f()", 2.0, 3.0, 0.1)
    peer = harness.Run("peer", "p", 40.0, 30.0, 0.2)
    values = {"name": "one", "of": "something", "ours": ours, "peer": peer} | changes
    return harness.Comparison(**values)


@pytest.fixture
def registry(monkeypatch):
    """A registry of one benchmark that works and one whose peer is missing."""

    def missing(progress):
        raise harness.PeerMissing("Radiance is not installed")

    table = {"one": lambda progress: comparison(), "two": missing}
    monkeypatch.setattr(harness, "benchmarks", lambda: table)


def test_ratio_is_time_times_squared_error():
    assert comparison().ratio == pytest.approx(40 * 0.2**2 / (2 * 0.1**2))
    assert comparison().cpu_ratio == pytest.approx(30 * 0.2**2 / (3 * 0.1**2))
    exact = comparison(ours=harness.Run("ours", "f()", 2.0, 3.0), peer=harness.Run("peer", "p", 8.0, 6.0))
    assert (exact.ratio, exact.cpu_ratio) == (4, 2)


def test_error_is_the_root_mean_square():
    assert harness.rms_error([1.0, 2.0], [1.0, 0.0]) == pytest.approx(np.sqrt(2))


def test_time_is_that_of_the_fastest_repetition_after_a_warm_one():
    calls = []

    def work():
        calls.append(len(calls))
        time.sleep((0.5, 0.2, 0.02, 0.2)[len(calls) - 1])
        return calls[-1]

    result, seconds, processor = harness.timed(work, repeat=3)
    assert result == 3 and 0.02 <= seconds < 0.2 and processor < 0.2


def test_the_peers_processor_time_is_free_of_waiting(monkeypatch):
    """It was the sum of elapsed seconds, which other work on the machine makes longer."""
    slow = bsdf_plugin.PEER[bsdf_plugin.PEER.index("start =") :].replace(
        "    bsdf.sample(data, theta, phi, drawn, 15)", "    time.sleep(theta)"
    )
    begin = "import os, sys, time\nangles = [(0.5, 0.0)]\n"
    monkeypatch.setattr(bsdf_plugin, "PEER", begin + slow)
    share = bsdf_plugin.UNITS / (harness.THREADS * bsdf_plugin.DIRECTIONS * bsdf_plugin.DRAWN)
    elapsed, processor = bsdf_plugin.theirs(Path("none.xml"))
    assert elapsed >= 0.5 * share and processor < 0.2 * share


def test_all_modules_take_part():
    found = harness.benchmarks()
    assert {"view-matrix", "daylight-matrix-open-c1000", "direct-sun", "annual-product"} <= set(found)
    assert all(callable(benchmark) for benchmark in found.values())


def test_json_holds_every_figure_and_a_missing_peer_is_one_line(registry, tmp_path, capsys):
    file = tmp_path / "bench.json"
    assert main(["--json", str(file)]) == 0
    printed = capsys.readouterr().out
    assert "two: left out, Radiance is not installed" in printed and "ratio 80.0" in printed
    (record,) = json.loads(file.read_text())
    assert record["ratio"] == pytest.approx(80) and record["ours"]["error"] == 0.1
    assert record["machine"]["cores"] >= 1 and record["machine"]["versions"]["mitsuba"]


def test_only_peers_missing_is_a_failure(registry, capsys):
    assert main(["two"]) == 1
    assert "no benchmark could run" in capsys.readouterr().err


def test_unknown_name_and_folder_are_usage_errors(registry, capsys, tmp_path):
    with pytest.raises(SystemExit, match="2"):
        main(["three"])
    assert "there are one, two" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["--json", str(tmp_path / "no" / "x.json")])


def test_without_pyradiance_the_peer_is_missing(monkeypatch):
    from tests.benchmarks import radiance

    monkeypatch.setattr(radiance, "find_spec", lambda name: None)
    with pytest.raises(harness.PeerMissing, match="pip install"):
        radiance.environment()
