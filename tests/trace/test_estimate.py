"""Errors of weighted sums, from batches of random numbers that go together in part."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import BatchMean, CacheEntry
from mitsuba_cfs.trace.kernels.estimate import IN_CACHE, Estimate, Stopping, _with_another, accumulate, blocks, joined

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


@pytest.mark.parametrize("shape", [(3, IN_CACHE // 7), (2, 5, 3000), (7,), (0, 12), (4, 0)])
def test_batches_give_their_mean_its_error_and_the_covariance_of_blocks(shape: tuple[int, ...]) -> None:
    random = np.random.default_rng(3)
    batches = [random.uniform(size=shape) for _ in range(5)]
    found = accumulate(lambda number: batches[number], stopping=Stopping(5))
    several = np.array(batches)
    np.testing.assert_allclose(found.values, several.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found.standard_error, several.std(axis=0, ddof=1) / 5**0.5, rtol=1e-6)
    sums = np.add.reduceat(several - several.mean(axis=0), blocks(shape[-1])[0], axis=-1)
    covariance = np.einsum("n...r,n...s->...rs", sums, sums) / 20
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-9, atol=1e-12)


def test_a_state_stays_as_it_was_when_batches_follow() -> None:
    states: list[BatchMean] = []

    class Entry:
        def load(self) -> None:
            return None

        def save(self, state: BatchMean) -> None:
            states.append(state)

    def batch(number: int) -> NDArray[np.float64]:
        if number == 3:
            raise KeyboardInterrupt
        return np.full((2, 3), float(number**2))

    with pytest.raises(KeyboardInterrupt):
        accumulate(batch, entry=cast(CacheEntry, Entry()))
    (state,) = states
    assert state.count == 3 and np.allclose(state.mean, 5 / 3) and np.allclose(state.spread, 26 / 3)
    arrays = state.mean, state.spread, state.covariance
    before = [one.copy() for one in arrays]
    _with_another(np.full((2, 3), 9.0), *arrays, 3)
    assert all(map(np.array_equal, before, arrays))


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
