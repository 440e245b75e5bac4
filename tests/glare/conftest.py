"""evalglare from the Radiance of pyradiance, as the judge of glare."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest


@dataclass(frozen=True)
class Verdict:
    """What `evalglare -d` printed."""

    figures: dict[str, float]  # last line
    sources: np.ndarray  # [n, 22] one row a source
    output: str


@pytest.fixture(scope="session")
def radiance_bin() -> Path:
    """The folder of Radiance's programs; the test is skipped without it."""
    pyradiance = pytest.importorskip("pyradiance")
    folder = Path(pyradiance.__file__).parent / "bin"
    if not (folder / "evalglare").exists():
        pytest.skip("pyradiance without evalglare")
    return folder


@pytest.fixture(scope="session")
def evalglare(radiance_bin) -> Callable[..., Verdict]:
    """Run `evalglare -d OPTIONS PICTURE`."""

    def run(picture: Path, *options: object) -> Verdict:
        command = [radiance_bin / "evalglare", "-d", *map(str, options), picture]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.stdout, done.stderr
        return parse(done.stdout)

    return run


def parse(output: str) -> Verdict:
    lines = output.splitlines()
    first = next(i for i, line in enumerate(lines) if "No pixels" in line)
    rows = [[float(word) for word in line.split()][:22] for line in lines[first + 1 : -1]]
    names, values = lines[-1].rsplit(":", 1)
    figures = dict(zip(names.split(","), map(float, values.split()), strict=True))
    count = int(lines[first].split()[0])
    return Verdict(figures, np.array(rows).reshape(-1, 22)[:count], output)
