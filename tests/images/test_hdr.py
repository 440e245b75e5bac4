"""Radiance pictures: round trips, every orientation and code, and what Radiance itself reads."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images import hdr
from mitsuba_cfs.images.hdr import Picture, luminance, read_hdr, write_hdr
from mitsuba_cfs.images.view import fisheye, parse_view

# a shared exponent leaves at least 7 bits to the largest channel, and half a step of rounding
RGBE_STEP = 1 / 256


def radiance(program: str) -> str:
    """The path of a Radiance program; the test is skipped without it."""
    pyradiance = pytest.importorskip("pyradiance")
    path = Path(pyradiance.__file__).parent / "bin" / program
    return str(path) if path.exists() else shutil.which(program) or pytest.skip(f"no {program}")


def run(program: str, *arguments: str | Path) -> bytes:
    command = [radiance(program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, check=True).stdout


def picture_pixels(height: int = 21, width: int = 33) -> np.ndarray:
    """Radiance [ny, nx, 3] with runs, noise, zeros and eleven decades of brightness."""
    random = np.random.default_rng(3)
    pixels = 10.0 ** random.uniform(-5, 6, (height, width, 3))
    pixels[5:9] = 0.25
    pixels[:, 10:14] = 0.0
    return pixels


def test_written_and_read_again(tmp_path):
    pixels, view = picture_pixels(), fisheye((1, 2, 1.2), (0.6, 0.8, 0), 33, height=21)
    path = tmp_path / "a.hdr"
    write_hdr(path, pixels, view, exposure=0.125, comments=("made by a test",))
    picture = read_hdr(path)
    assert picture.exposure == 0.125 and picture.view == view
    assert "made by a test" in picture.header
    error = np.abs(picture.pixels - pixels).max(-1)
    assert np.all(error <= RGBE_STEP * pixels.max(-1))
    assert np.all(picture.pixels[:, 10:14] == 0)


def test_truncation_of_mantissas_leaves_no_bias(tmp_path):
    cd = np.random.default_rng(1).uniform(100, 5000, (200, 200))
    write_hdr(tmp_path / "a.hdr", cd)
    # 40,000 independent roundings of at most 1/256: 1/256/sqrt(12 * 40000) = 6e-6, 5 sigma
    assert read_hdr(tmp_path / "a.hdr").luminance.mean() == pytest.approx(cd.mean(), rel=3e-5)


@pytest.mark.parametrize("width", [5, 8, 127, 128, 129, 300])
def test_run_length_code_gives_the_bytes_back(width):
    random = np.random.default_rng(width)
    pixels = random.integers(0, 256, (4, width, 4)).astype(np.uint8)
    pixels[1] = 7
    pixels[2, : width // 2] = 9
    pixels[3, ::3] = 1
    pixels[:, :, 0] |= 128  # as every normal pixel's largest mantissa; (1, 1, 1, n) means a repeat
    again = np.zeros_like(pixels)
    data = np.frombuffer(hdr.encode_scanlines(pixels), dtype=np.uint8)
    assert hdr.decode_scanlines(data, again) == 4
    assert np.array_equal(again, pixels)


def test_old_run_length_code():
    data = np.array([9, 8, 7, 130, 1, 1, 1, 2, 3, 3, 3, 140], dtype=np.uint8)
    line = np.zeros((1, 4, 4), dtype=np.uint8)
    assert hdr.decode_scanlines(data, line) == 1
    assert line[0].tolist() == [[9, 8, 7, 130]] * 3 + [[3, 3, 3, 140]]


ORIENTATIONS = [f"{y}Y 3 {x}X 9" for x in "+-" for y in "+-"]
ORIENTATIONS += [f"{x}X 9 {y}Y 3" for x in "+-" for y in "+-"]


@pytest.mark.peer
@pytest.mark.parametrize("resolution", ORIENTATIONS)
def test_every_orientation_is_set_upright_as_pvalue_does(resolution, tmp_path):
    path = tmp_path / "a.hdr"
    first, second = (int(word) for word in resolution.split()[1::2])
    stored = picture_pixels(first, second)
    body = hdr.encode_scanlines(hdr.rgbe_from_pixels(stored))
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n"
    path.write_bytes(header.encode() + body)
    lines = np.array([line.split() for line in run("pvalue", "-h", "-H", path).splitlines()], float)
    theirs = np.empty((3, 9, 3))
    theirs[2 - lines[:, 1].astype(int), lines[:, 0].astype(int)] = lines[:, 2:]
    assert np.allclose(read_hdr(path).pixels, theirs, rtol=1e-3)  # pvalue prints four digits


@pytest.mark.peer
def test_radiance_reads_what_is_written(tmp_path):
    path, view = tmp_path / "a.hdr", parse_view("-vth -vp 1 2 3 -vd 0 -1 0 -vh 180 -vv 180", 33, 21)
    write_hdr(path, picture_pixels(), view, exposure=3.5)
    assert b"VIEW= -vth -vp 1 2 3 -vd 0 -1 0" in run("getinfo", path)
    assert run("getinfo", "-d", path).split()[-4:] == [b"-Y", b"21", b"+X", b"33"]
    theirs = np.frombuffer(run("pvalue", "-h", "-H", "-o", "-df", path), "<f4").reshape(21, 33, 3)
    assert np.allclose(theirs, read_hdr(path).pixels, rtol=1e-6)  # 4-byte floats
    brightness = np.frombuffer(run("pvalue", "-h", "-H", "-o", "-b", "-df", path), "<f4")
    ours = read_hdr(path).luminance / 179
    assert np.allclose(brightness.reshape(21, 33), ours, rtol=1e-6)


@pytest.mark.peer
def test_xyz_pictures_have_the_same_luminance(tmp_path):
    path, xyz = tmp_path / "a.hdr", tmp_path / "xyz.hdr"
    pixels = np.random.default_rng(5).uniform(0.5, 1.0, (20, 30, 3))
    write_hdr(path, pixels)
    run("ra_xyze", path, xyz)
    picture = read_hdr(xyz)
    assert picture.colours == "xyz"
    # both are rounded to eight bits of the largest channel
    assert np.allclose(picture.luminance, read_hdr(path).luminance, rtol=2 * RGBE_STEP)


@pytest.mark.peer
def test_real_pictures_have_pvalues_pixels(real_data):
    for path in sorted((real_data / "hdr").glob("*.hdr")):
        picture = read_hdr(path)
        out = run("pvalue", "-h", "-H", "-o", "-df", path)
        theirs = np.frombuffer(out, "<f4").reshape(picture.pixels.shape)
        assert np.allclose(theirs, picture.pixels, rtol=1e-6), path.name
        assert picture.view is not None and picture.view.kind == "angular"


def test_exposures_multiply_and_nested_lines_do_not_count(tmp_path):
    path = tmp_path / "a.hdr"
    write_hdr(path, np.full((4, 9, 3), 8.0))
    data = path.read_bytes()
    extra = b"EXPOSURE=2\nEXPOSURE= 4.0\n\tEXPOSURE=100\n\tVIEW= -vth -vh 90 -vv 90\nFORMAT"
    path.write_bytes(data.replace(b"FORMAT", extra, 1))
    picture = read_hdr(path)
    assert picture.exposure == 8.0 and picture.view is None and picture.misplaced_exposure
    assert np.allclose(picture.pixels, 1.0, rtol=RGBE_STEP)


def test_later_view_lines_change_earlier_ones(tmp_path):
    path = tmp_path / "a.hdr"
    write_hdr(path, np.full((4, 9, 3), 8.0))
    extra = b"/usr/bin/rpict -vta -vd 1 0 0 -vh 180 -vv 180\nVIEW= -vp 3 4 5\nFORMAT"
    path.write_bytes(path.read_bytes().replace(b"FORMAT", extra, 1))
    view = read_hdr(path).view
    assert (view.kind, view.direction, view.position) == ("angular", (1, 0, 0), (3, 4, 5))
    assert (view.width, view.height) == (9, 4)


def damaged(tmp_path: Path, change) -> Path:
    path = tmp_path / "bad.hdr"
    write_hdr(path, picture_pixels())
    path.write_bytes(change(path.read_bytes()))
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: b"PNG" + data, "does not start with"),
        (lambda data: data[:40], "no end"),
        (lambda data: data[:-30], "scanline 21 of 21"),
        (lambda data: data.replace(b"-Y 21", b"-Z 21"), "resolution"),
        (lambda data: data.replace(b"-Y 21", b"-Y -1"), "resolution"),
        (lambda data: data.replace(b"FORMAT=32-bit_rle_rgbe", b"FORMAT=ascii"), "FORMAT"),
        (lambda data: data.replace(b"FORMAT", b"EXPOSURE=zero\nFORMAT", 1), "EXPOSURE"),
        (lambda data: data.replace(b"FORMAT", b"EXPOSURE=0\nFORMAT", 1), "EXPOSURE"),
    ],
)
def test_bad_files_are_named(tmp_path, change, message):
    with pytest.raises(DataError, match=message) as error:
        read_hdr(damaged(tmp_path, change))
    assert "bad.hdr" in str(error.value)


def test_missing_file_and_folder_are_named(tmp_path):
    with pytest.raises(DataError, match=r"none\.hdr.*No such file"):
        read_hdr(tmp_path / "none.hdr")
    with pytest.raises(DataError, match="cannot be written"):
        write_hdr(tmp_path / "none" / "a.hdr", np.ones((2, 2)))


@pytest.mark.parametrize("value", [np.nan, -1.0, np.inf])
def test_pixels_that_a_picture_cannot_hold_are_refused(tmp_path, value):
    with pytest.raises(ValueError, match="cannot hold"):
        write_hdr(tmp_path / "a.hdr", np.full((2, 2), value))
    assert not list(tmp_path.iterdir())


def test_luminance_of_white_is_179():
    assert luminance(np.ones(3)) == pytest.approx(179, rel=1e-12)
    assert luminance([1.0, 0, 0]) == pytest.approx(179 * 0.265, rel=1e-3)
    assert luminance(np.array([5.0, 2.0, 1.0]), "xyz") == 2.0
    assert Picture(np.ones((1, 1, 3), np.float32), None, 1.0, ()).luminance.shape == (1, 1)
