"""A year of glare from matrices, against pictures made one by one, sensors and traced paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare import annual
from mitsuba_cfs.glare.annual import PictureMatrix, ThreePhasePictures, annual_glare, full_picture
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.view import fisheye, pixel_directions
from tests.trace import rooms

K = KLEMS_FULL.size
VIEW = fisheye((1.8, 2.5, 1.2), (0.0, -1.0, 0.0), 96)
RANDOM = np.random.default_rng(7)


def made_up(hours: int = 9) -> ThreePhasePictures:
    """Pictures whose pixels see three bright patches and weakly all others."""
    pixels = np.flatnonzero(pixel_directions(VIEW)[1])
    n = len(pixels)
    rows = RANDOM.uniform(0, 2e-4, (n // 2, 2 * K)).astype(np.float32)
    seen = np.zeros((n, 2 * K), dtype=np.float32)
    for patch, start in ((3, 2000), (40, 3000), (200, 4100)):
        seen[start : start + 40, patch] = 1
    share = 1 - seen.sum(axis=1)
    luminance = RANDOM.uniform(100, 30_000, (2, K, hours)).astype(np.float32)
    reflected = PictureMatrix(rows, np.arange(n) // 2 % len(rows), share)
    return ThreePhasePictures(VIEW, pixels, reflected, sparse.csr_array(seen), luminance)


def test_each_hour_is_rated_as_its_picture_is():
    pictures = made_up()
    found, matrix = annual_glare(pictures, threads=2), pictures.reflected
    for h in (0, 4, 8):
        whole = matrix.rows[matrix.row] * matrix.share[:, None] + pictures.seen
        values = np.asarray(whole @ pictures.luminance[:, :, h].reshape(-1))
        alone = evaluate(full_picture(values, pictures.pixels, VIEW), VIEW)
        # the products of matrices and of a matrix and a vector round differently in four bytes
        assert found.dgp[h] == pytest.approx(alone.dgp, rel=1e-5)
        assert found.ugr[h] == pytest.approx(alone.ugr, rel=1e-5)
        assert found.sources[h] == alone.count >= 1
    assert list(found.worst(2)) == list(np.argsort(found.dgp)[::-1][:2])


def test_a_matrix_on_disk_gives_the_same(tmp_path, monkeypatch):
    pictures = made_up()
    monkeypatch.setattr(annual, "ROW_BYTES", 4 * 2 * K * 1000)  # it is read in four parts
    shape = pictures.reflected.rows.shape
    rows = np.memmap(tmp_path / "rows", np.float32, "w+", shape=shape)
    rows[:] = pictures.reflected.rows
    kept = replace(pictures, reflected=replace(pictures.reflected, rows=rows))
    hours = np.arange(9)
    values = kept.values(hours)
    rounding = 2 * K * np.finfo(np.float32).eps  # of sums of so many terms in another order
    assert np.allclose(values, pictures.values(hours), rtol=rounding, atol=0)


def test_a_killed_run_goes_on_where_it_was(tmp_path):
    file = tmp_path / "glare.npy"
    pictures = made_up()
    whole = annual_glare(pictures, checkpoint=file)
    table = np.load(file)
    table[3:6] = np.nan
    np.save(file, table)
    asked = []

    class Watched:
        view, pixels, hours = VIEW, pictures.pixels, pictures.hours
        noise = pictures.noise

        @staticmethod
        def without_disc(batch):
            asked.extend(batch)
            return pictures.without_disc(batch)

    again = annual_glare(Watched, checkpoint=file)
    assert asked[:3] == [3, 4, 5]  # then the hours that are rated by halves
    assert again.dgp == pytest.approx(whole.dgp, rel=1e-6)  # BLAS rounds by the batch's size


def test_ratings_of_another_year_are_refused(tmp_path):
    file = tmp_path / "glare.npy"
    annual_glare(made_up(hours=3), checkpoint=file)
    with pytest.raises(DataError, match="another year"):
        annual_glare(made_up(hours=4), checkpoint=file)


def test_luminance_must_fit_the_matrix():
    pictures = made_up()
    with pytest.raises(ValueError, match=r"\[G, K, H\]"):
        replace(pictures, luminance=pictures.luminance[:1])


@pytest.mark.usefixtures("variant")
def test_pictures_have_the_illuminance_of_the_view_matrix():
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.pictures.annual import view_matrices

    room, groups = rooms.test_room()
    luminance = RANDOM.uniform(0, 5000, (1, K, 4)).astype(np.float32)
    matrices = view_matrices(room, groups, VIEW, samples=16)
    found = annual_glare(matrices.three_phase(luminance))
    sensor = view_matrix(room, groups, [VIEW.position], [VIEW.direction], samples=16384)
    expected = np.einsum("gk,gkh->h", sensor.values[0], luminance)
    # pixels of 1.9 degrees at the window's edge: 16 places in each, 0.2 % of the window's area
    assert found.Ev == pytest.approx(expected, rel=5e-3)


@pytest.mark.usefixtures("variant")
def test_a_small_budget_puts_the_matrix_on_disk(tmp_path):
    from mitsuba_cfs.trace.pictures.annual import view_matrices

    room, groups = rooms.test_room()
    view = fisheye(VIEW.position, VIEW.direction, 32)
    here = view_matrices(room, groups, view, samples=2)
    there = view_matrices(room, groups, view, samples=2, memory=1000, folder=tmp_path)
    assert isinstance(there.lit.rows, np.memmap) and not isinstance(here.lit.rows, np.memmap)
    # sums of the same paths, in another order
    assert np.allclose(here.lit.rows, there.lit.rows, rtol=1e-6)
