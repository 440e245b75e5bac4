"""EXR files: what is written comes back, bit by bit."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import View, fisheye
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.usefixtures("variant")


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
def test_pixels_and_view_come_back(tmp_path, shape):
    from mitsuba_cfs.images.exr import write_exr
    from tests.images.exr_reader import read_exr

    pixels = np.random.default_rng(1).lognormal(5, 4, shape).astype(np.float32)
    pixels.flat[0] = 1e9  # the sun
    view = fisheye((1.5, 2.25, 1.2), (0.6, -0.8, 0.0), width=7, height=5)
    write_exr(tmp_path / "a.exr", pixels, view, comment="made by a test")
    found, seen = read_exr(tmp_path / "a.exr")
    assert np.array_equal(found, pixels)
    assert seen == view
    assert [p.name for p in tmp_path.iterdir()] == ["a.exr"]
    write_exr(tmp_path / "b.exr", pixels)
    assert read_exr(tmp_path / "b.exr")[1] is None


def test_what_cannot_be_is_told_in_a_line(tmp_path):
    from mitsuba_cfs.images.exr import write_exr

    with pytest.raises(ValueError, match="shape"):
        write_exr(tmp_path / "a.exr", np.ones((3, 3, 2)))
    with pytest.raises(DataError, match="cannot be written"):
        write_exr(tmp_path / "none" / "a.exr", np.ones((3, 3)), View("angular"))


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="a process chooses its cores on Linux alone")
def test_a_process_with_one_core_writes_and_reads_too(tmp_path):
    """Mitsuba's OpenEXR waits for a second thread: `cfs picture` stood for ever on one core."""
    code = (
        "import os, sys\n"
        "os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
        "from mitsuba_cfs import llvm\nllvm.select_library()\n"
        "import numpy as np\n"
        "from mitsuba_cfs.images.exr import write_exr\n"
        "from tests.images.exr_reader import read_exr\n"
        "write_exr(sys.argv[1], np.ones((40, 30)))\n"
        "print(read_exr(sys.argv[1])[0].shape)\n"
    )
    line = [sys.executable, "-c", code, str(tmp_path / "a.exr")]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=True, cwd=REPOSITORY)
    assert done.stdout.split() == ["(40,", "30)"]
