"""`cfs doctor`: what it prints, and that no LLVM library can take it down."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from mitsuba_cfs import llvm
from scenes.commands import doctor, self_test


def _doctor(**environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from scenes.cli import main; main(['doctor'])"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
        timeout=180,
    )


def test_self_test_passes_here() -> None:
    done = _doctor()
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1]
    assert last.startswith("self-test")
    assert "passed" in last
    for word in ("python", "mitsuba", "LLVM", "GPU", "peer", "variant"):
        assert any(line.startswith(word) for line in done.stdout.splitlines()), word


def test_missing_library_is_said_last_with_what_to_do() -> None:
    done = _doctor(**{llvm.VARIABLE: "/nowhere/libLLVM.so.19", "CUDA_VISIBLE_DEVICES": ""})
    assert done.returncode == 1
    assert "scalar_rgb" in done.stdout
    assert len(done.stderr.splitlines()) == 1
    assert "only slow single images work" in done.stderr
    assert "apt-get install libllvm19" in done.stderr


def test_a_missing_package_is_said_last_with_what_to_do(monkeypatch, capsys) -> None:
    from scenes.cli import run

    installed = doctor._version
    gone = lambda name: None if name == "shapely" else installed(name)  # noqa: E731
    monkeypatch.setattr(doctor, "_version", gone)
    monkeypatch.setattr(doctor, "self_test", lambda: "self-test: No module named 'shapely'")
    assert run(["doctor"]) == 1
    said = capsys.readouterr()
    assert said.err == "error: not installed: shapely; pip install shapely\n"
    assert any(line.split() == ["shapely", "MISSING"] for line in said.out.splitlines())


def test_library_that_aborts_is_one_line() -> None:
    """With a real LLVM that aborts, where this machine has one."""
    aborting = [found for found in llvm.candidates() if "aborts" in found.reason]
    if not aborting:
        pytest.skip("no LLVM 15 or 16 on this machine, or no x86")
    done = _doctor(**{llvm.VARIABLE: str(aborting[0].path), "CUDA_VISIBLE_DEVICES": ""})
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert "aborted by signal" in done.stderr
    assert "apt-get install libllvm19" in done.stderr


def test_result_that_misses_the_closed_form_fails(monkeypatch, capsys) -> None:
    """A self-test that cannot fail would tell nothing: give it a wrong closed form."""
    answer = '{"variant": "v", "reason": "r", "rays": 9, "traced": 0.8, "expected": 0.9, '
    answer += '"agrees": false, "seconds": 0.1}'
    done = subprocess.CompletedProcess([], 0, stdout=answer + "\n", stderr="")
    monkeypatch.setattr(doctor.subprocess, "run", lambda *_, **__: done)
    assert doctor.self_test().startswith("self-test: the traced rays miss the closed form; ")
    assert "FAILED" in capsys.readouterr().out


def test_view_factor_is_that_of_a_numerical_integral() -> None:
    """F = integral of cos(a) cos(b) / (pi r^2) over the square, by midpoints."""
    side, distance, count = 1.0, 0.5, 1000
    x = (np.arange(count) + 0.5) / count * 2 * side - side
    r2 = x[:, None] ** 2 + x[None, :] ** 2 + distance**2
    cell = (2 * side / count) ** 2
    integral = np.sum(distance**2 / (math.pi * r2**2)) * cell
    # midpoint rule: the error is of the order of (cell width / distance)^2 = 2e-5
    assert self_test.view_factor(side, distance) == pytest.approx(integral, rel=2e-5)
    assert self_test.view_factor(1e6, 1.0) == pytest.approx(1.0, abs=1e-6)
