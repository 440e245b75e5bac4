"""Errors of weighted sums, from batches of random numbers that go together in part."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, blocks, joined

HOURS = 200


@pytest.mark.parametrize("common", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("weighting", ["smooth", "few"])
def test_entries_that_go_together_do_so_in_a_weighted_sum(common: float, weighting: str) -> None:
    """Each hour's noise is in part that of its batch; ten of the 200 hours are summed up."""
    weights = np.linspace(0.5, 2.0, HOURS)
    if weighting == "few":
        weights[np.arange(HOURS) % 20 > 0] = 0.0
    runs = [estimate(seed, common) for seed in range(300)]
    spread = np.std([run.values @ weights for run in runs])
    stated = np.sqrt(np.mean([run.error_of(weights) ** 2 for run in runs]))
    assert stated == pytest.approx(spread, rel=0.12 if weighting == "smooth" or not common else 0.25)
    np.testing.assert_allclose(runs[0].error_of(np.ones(HOURS)), runs[0].sum_error)


def test_entries_that_share_a_number_of_rays_keep_it_in_the_sum() -> None:
    """Counts of 1,000 rays in twelve directions: their sum is certain, that of half of them not."""
    share = np.linspace(1.0, 3.0, 12) / 24
    weights = np.repeat([1.0, 0.0], 6)

    def run(seed: int) -> Estimate:
        random = np.random.default_rng(seed)
        return accumulate(lambda _: random.multinomial(1000, share) / 1000.0, stopping=Stopping(8))

    runs = [run(seed) for seed in range(300)]
    assert max(float(one.error_of(np.ones(12))) for one in runs) < 1e-9
    spread = np.std([one.values @ weights for one in runs])
    stated = np.sqrt(np.mean([one.error_of(weights) ** 2 for one in runs]))
    assert stated == pytest.approx(spread, rel=0.12)


def test_several_weights_at_once_are_as_each() -> None:
    rows = joined([estimate(seed, 0.5, rows=2) for seed in range(2)])
    weights = np.random.default_rng(1).uniform(size=(HOURS, 3))
    expected = np.stack([rows.error_of(one) ** 2 for one in weights.T], axis=1)
    np.testing.assert_allclose(rows.variances_of(weights), expected)


def test_blocks_cover_an_axis_of_any_length() -> None:
    for size in (0, 1, 3, 8, 9, 145):
        starts, sizes = blocks(size)
        assert sizes.sum() == size and (sizes > 0).all() and len(starts) == len(sizes) <= 8


def estimate(seed: int, common: float, rows: int | None = None) -> Estimate:
    """Of 200 hours about 10 to 30, a share of whose variance is common to a batch."""
    random = np.random.default_rng(seed)
    mean, size = np.linspace(10.0, 30.0, HOURS), np.linspace(1.0, 3.0, HOURS)
    shape = (HOURS,) if rows is None else (rows, HOURS)

    def batch(number: int) -> NDArray[np.float64]:
        together = np.sqrt(common) * random.normal()
        return mean + size * (together + np.sqrt(1 - common) * random.normal(size=shape))

    return accumulate(batch, stopping=Stopping(batches=8))


def test_a_night_has_no_hours_and_no_error() -> None:
    none = accumulate(lambda _: np.zeros((3, 0)), stopping=Stopping(4))
    np.testing.assert_array_equal(none.error_of(np.zeros((1, 0))), np.zeros(3))
    np.testing.assert_array_equal(none.variances_of(np.zeros((0, 2))), np.zeros((3, 2)))
    assert none.sum_error.shape == (3,)
