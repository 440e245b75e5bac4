"""Radiance matrix files: round trips, Radiance's own readers and writers, and faults."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.mtx_io import FORMATS, luminance, read_header, read_matrix, write_matrix

# rounding of each format: nine digits, float32, nothing
ROUNDING = {"ascii": 5e-9, "float": 6e-8, "double": 0.0}


def numbers(*shape) -> np.ndarray:
    """Positive and negative numbers over ten orders of magnitude, and a zero."""
    rng = np.random.default_rng(3)
    values = rng.normal(size=shape) * 10 ** rng.uniform(-5, 5, size=shape)
    values.flat[1] = 0.0
    return values


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("components", [1, 3])
def test_round_trip(tmp_path, kind, components):
    matrix, path = numbers(4, 5, components), tmp_path / "m.mtx"
    write_matrix(path, matrix, format=kind, lines=["made for a test"])
    back = read_matrix(path)
    assert back.dtype == np.float64
    np.testing.assert_allclose(back, matrix, rtol=ROUNDING[kind])
    with path.open("rb") as file:
        header = read_header(file, path)
    assert (header.rows, header.columns, header.components) == matrix.shape
    assert header.format == kind and header.lines == ("made for a test",)
    assert list(tmp_path.iterdir()) == [path]


def test_components_of_a_plain_matrix(tmp_path):
    matrix, path = numbers(3, 2), tmp_path / "m.mtx"
    write_matrix(path, matrix, format="double", components=3)
    back = read_matrix(path)
    assert back.shape == (3, 2, 3)
    for channel in range(3):
        np.testing.assert_array_equal(back[..., channel], matrix)
    np.testing.assert_allclose(luminance(back), matrix, rtol=1e-14)
    np.testing.assert_allclose(luminance([[[1.0, 0, 0], [0, 1, 0]]]), [[0.265, 0.670]])


def run(program, *options, **more):
    return subprocess.run([program, *options], capture_output=True, check=True, **more).stdout


@pytest.mark.peer
@pytest.mark.parametrize("kind", FORMATS)
def test_getinfo_reads_our_header(tmp_path, radiance, kind):
    path = tmp_path / "m.mtx"
    write_matrix(path, numbers(6, 4), format=kind, components=3)
    text = run(radiance / "getinfo", path).decode()
    for line in ("NROWS=6", "NCOLS=4", "NCOMP=3", f"FORMAT={kind}"):
        assert line in text


@pytest.mark.peer
@pytest.mark.parametrize("theirs", ["a", "f", "d"])
@pytest.mark.parametrize("kind", FORMATS)
def test_rmtxop_reads_ours_and_we_read_its(tmp_path, radiance, kind, theirs):
    """An asymmetric matrix, so that rows, columns and components cannot trade places."""
    matrix, path, out = numbers(4, 5, 3), tmp_path / "m.mtx", tmp_path / "out.mtx"
    write_matrix(path, matrix, format=kind)
    out.write_bytes(run(radiance / "rmtxop", f"-f{theirs}", "-t", path))
    # rmtxop keeps float32 inside and prints seven digits
    np.testing.assert_allclose(read_matrix(out), matrix.transpose(1, 0, 2), rtol=1e-6)


@pytest.mark.peer
@pytest.mark.parametrize("kind", FORMATS)
def test_dctimestep_multiplies_ours(tmp_path, radiance, kind):
    """Sensors x patches times patches x hours."""
    coefficients = np.abs(numbers(3, 146, 3))
    sky = np.abs(numbers(146, 4, 3))
    write_matrix(tmp_path / "dc.mtx", coefficients, format=kind)
    write_matrix(tmp_path / "sky.smx", sky, format=kind)
    product = run(radiance / "dctimestep", "-of", tmp_path / "dc.mtx", tmp_path / "sky.smx")
    (tmp_path / "e.mtx").write_bytes(product)
    expected = np.einsum("spc,phc->shc", coefficients, sky)
    np.testing.assert_allclose(read_matrix(tmp_path / "e.mtx"), expected, rtol=1e-5)  # float32


@pytest.mark.peer
@pytest.mark.parametrize("kind", ["", "-of", "-od"])
def test_reads_gendaymtx(radiance, chicago, tmp_path, kind):
    from mitsuba_cfs.sky.epw import read_epw
    from mitsuba_cfs.sky.matrix import sky_matrix

    path = tmp_path / "sky.smx"
    options = [kind] if kind else []
    path.write_bytes(run(radiance / "gendaymtx", *options, "-u", "-c", "1", "1", "1", chicago))
    ours = sky_matrix(read_epw(chicago), sun_up_only=True, sun_model="radiance")
    theirs = 179 * luminance(read_matrix(path))
    # gendaymtx prints three digits
    np.testing.assert_allclose(ours, theirs, rtol=1e-5 if kind else 5e-3, atol=1e-2)


@pytest.mark.peer
def test_other_byte_order_and_exposure(tmp_path, radiance):
    matrix = numbers(2, 3, 1)
    head = b"#?RADIANCE\nEXPOSURE=2\nNROWS=2\nNCOLS=3\nNCOMP=1\nBigEndian=1\nFORMAT=float\n\n"
    (tmp_path / "m.mtx").write_bytes(head + matrix.astype(">f4").tobytes())
    back = read_matrix(tmp_path / "m.mtx")
    np.testing.assert_allclose(back, matrix / 2, rtol=ROUNDING["float"])
    theirs = run(radiance / "rmtxop", "-fd", tmp_path / "m.mtx", "-s", "1")
    (tmp_path / "out.mtx").write_bytes(theirs)
    np.testing.assert_allclose(read_matrix(tmp_path / "out.mtx"), back, rtol=1e-6)


HEAD = "#?RADIANCE\nNROWS=2\nNCOLS=2\nNCOMP=1\nFORMAT=ascii\n\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 2 3 4", "#?RADIANCE"),
        (HEAD.replace("NROWS=2\n", "") + "1 2 3 4", "NROWS: missing"),
        (HEAD.replace("NCOLS=2", "NCOLS=two") + "1 2 3 4", "NCOLS: expected a positive"),
        (HEAD.replace("ascii", "32-bit_rle_rgbe") + "1 2 3 4", "FORMAT: expected ascii"),
        (HEAD.replace("ascii", "double") + "1 2 3 4", "ends within a number"),
        (HEAD + "1 2 3", "expected 2 x 2 x 1 values, got 3"),
        (HEAD + "1 2 3 x", "expected numbers"),
        (HEAD + "1 2 nan 4", "row 1, column 0: is not finite"),
        (HEAD.rstrip("\n"), "ends within its header"),
    ],
)
def test_faults(tmp_path, text, words):
    path = tmp_path / "bad.mtx"
    path.write_text(text)
    with pytest.raises(DataError) as caught:
        read_matrix(path)
    assert words in str(caught.value) and "bad.mtx" in str(caught.value)


def test_wrong_calls(tmp_path):
    with pytest.raises(ValueError, match="rows, columns"):
        write_matrix(tmp_path / "m.mtx", np.zeros(3))
    with pytest.raises(ValueError, match="format"):
        write_matrix(tmp_path / "m.mtx", np.zeros((2, 2)), format="rgbe")
    with pytest.raises(DataError, match="cannot be written"):
        write_matrix(tmp_path / "no" / "m.mtx", np.zeros((2, 2)))
    assert list(tmp_path.iterdir()) == []


def test_luminance_of_one_component_and_of_three():
    one = np.arange(6.0).reshape(2, 3, 1)
    np.testing.assert_array_equal(luminance(one), one[..., 0])
    np.testing.assert_allclose(luminance(np.ones((2, 1, 3)), (0.2, 0.3, 0.4)), [[0.9], [0.9]])
    for wrong in (np.ones((2, 3)), np.ones((2, 3, 2))):
        with pytest.raises(ValueError, match="1 or 3"):
            luminance(wrong)


def test_components_of_a_matrix_that_has_them_have_to_agree(tmp_path):
    write_matrix(tmp_path / "m.mtx", numbers(2, 4, 3), components=3)
    with pytest.raises(ValueError, match="expected"):
        write_matrix(tmp_path / "m.mtx", numbers(2, 4, 3), components=4)
