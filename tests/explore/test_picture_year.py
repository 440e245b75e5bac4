"""A year's pictures compressed and opened again: what is exact, what is near, what is left out."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView, in_picture_order
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.picture_year import year as codes
from mitsuba_cfs.picture_year import year as low_rank
from mitsuba_cfs.picture_year.year import PictureYear, picture_year
from tests.explore.synthetic import MadeUpPictures
from tests.glare.test_annual import made_up
from tests.report.synthetic import sun_directions

VIEW = fisheye((2.5, 3.0, 1.2), (0.2, -1.0, 0.0), 64)


@pytest.fixture(scope="module")
def pictures() -> MadeUpPictures:
    import pandas as pd

    suns = sun_directions(pd.date_range("2023-01-01 00:30", periods=8760, freq="h"))
    return MadeUpPictures(VIEW, suns[suns[:, 2] > 0.02][::19], 0.6)


@pytest.fixture(scope="module")
def year(pictures) -> PictureYear:
    return picture_year(pictures)


def _whole(pictures, hour: int) -> np.ndarray:
    rows, own = pictures.by_rows(np.array([hour]))
    return rows[0][pictures.shared.row] * pictures.shared.share + own[0]


def test_pictures_come_back(pictures, year) -> None:
    for hour in range(0, pictures.hours, 17):
        given, kept = _whole(pictures, hour), year.values(hour)
        # levels of the beam are 4 % apart, windows are corrected from 8 % of the logarithm on
        assert kept == pytest.approx(given, rel=0.085, abs=2.0)


def test_pictures_whose_patches_hold_the_sun_have_no_disc() -> None:
    year = picture_year(made_up())
    assert year.discs == ((),) * 9
    assert year.check is not None and year.check.compressed_dgp == pytest.approx(year.check.dgp, abs=0.002)


def test_illuminance_at_the_eye_is_kept(pictures, year) -> None:
    weight = in_picture_order(GlareView(VIEW).projected).ravel()[pictures.pixels]
    for hour in range(0, pictures.hours, 13):
        # 0.2 %: what the levels of the beam and its faint pixels may change
        assert year.values(hour) @ weight == pytest.approx(_whole(pictures, hour) @ weight, rel=2e-3)


def test_the_glare_is_that_of_the_pictures(pictures, year) -> None:
    assert year.check is not None and len(year.check.hours) == 100
    assert year.check.largest < 0.002  # what the explorer promises
    assert np.ptp(year.check.dgp) > 0.2, "the hours do not differ: nothing was compared"
    geometry = GlareView(VIEW)
    for i in (0, 50, 99):
        hour = int(year.check.hours[i])
        picture = np.zeros(VIEW.width * VIEW.height)
        picture[pictures.pixels] = _whole(pictures, hour)
        discs = pictures.discs([hour])[0]
        rated = evaluate(picture.reshape(VIEW.height, VIEW.width), geometry, discs=discs)
        assert year.check.dgp[i] == pytest.approx(rated.dgp, abs=1e-9)


def test_sharp_edges_stay_where_they_are(pictures, year) -> None:
    """The patch of sun has the pixels that it had, neither more nor less."""
    hours = [h for h in range(pictures.hours) if (pictures.by_rows(np.array([h]))[1] > 500).any()]
    for hour in hours[::29]:
        own = pictures.by_rows(np.array([hour]))[1][0]
        beam, _ = codes.unpacked(year.codes[hour], (len(pictures.pixels), len(year.window)))
        sparse = np.ones(len(own), dtype=bool)
        sparse[year.window] = False
        assert np.array_equal(beam.code > 0, sparse & (own > 2.0))


def test_patterns_of_few_causes_are_exact() -> None:
    rng = np.random.default_rng(0)
    causes, places = rng.random((40, 3)), rng.random((3, 500)) ** 4
    values = causes @ places
    found = low_rank.patterns_of(values, np.ones(500), 8)
    again = found.values(*found.amounts(values))
    assert found.rank == 3
    # steps of 0.05 % of the typical value, in three patterns
    assert np.abs(again - values).max() < 3e-3 * values.max()


def test_codes_are_small_and_come_back() -> None:
    rng = np.random.default_rng(1)
    values = np.exp(rng.normal(5, 2, 4000))
    chosen = rng.random(4000) < 0.3
    one, other = codes.coded(values, chosen), codes.coded(values, np.zeros(4000, dtype=bool))
    data = codes.packed(one, other)
    back, none = codes.unpacked(data, (4000, 4000))
    assert back.values(0.0)[chosen] == pytest.approx(values[chosen], rel=0.04)
    assert not back.values(0.0)[~chosen].any() and not none.code.any()
    assert back.values(0.0).sum() == pytest.approx(values[chosen].sum(), rel=1e-5)
    assert codes.packed(other, other) == b""
    assert len(data) < 4000 + 4 * 256
