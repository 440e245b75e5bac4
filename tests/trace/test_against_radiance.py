"""V and D against rfluxmtx: the same scene, the same bins, both programs' noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from .radiance_matrices import MATRICES, POINTS, SCENES, STORED, UP, Repeated

pytestmark = pytest.mark.usefixtures("variant")


def normal_scores(ours, theirs: Repeated):
    """(mean of theirs - ours) over the error of both, as scores of a unit normal, of each entry.

    Entries known to less than 10 % are counts of few rays, not normal: they are left out.
    """
    own, error = ours.standard_error, theirs.deviation / np.sqrt(theirs.runs)
    both = np.hypot(own, error)
    known = (both > 0) & (both < 0.1 * ours.values)
    gap = theirs.mean - ours.values
    return scores(gap[known], own[known], error[known], (ours.batches, theirs.runs))


def scores(gap, own, error, repetitions: tuple[int, int]):
    """Gaps over the error of both as scores of a unit normal.

    The errors are known from few repetitions, so the quotient has Student's distribution (Welch:
    degrees of freedom of the sum of two variances); its quantiles are turned into the normal's.
    """
    variance, (mine, runs) = own**2 + error**2, repetitions
    freedom = variance**2 / (error**4 / (runs - 1) + own**4 / (mine - 1) + 1e-99)
    tail = stats.t.sf(np.abs(gap) / np.sqrt(np.maximum(variance, 1e-18)), freedom)
    return np.sign(gap) * stats.norm.isf(np.maximum(tail, 1e-12))


def check(ours, theirs: Repeated, name: str):
    z = normal_scores(ours, theirs)
    sums = ours.values.sum(axis=-1)
    total = theirs.mean.sum(axis=-1) / sums
    print(
        f"{name}: {len(z)} entries, mean z {z.mean():.3f}, rms z {np.sqrt(np.mean(z**2)):.3f}, "
        f"beyond 1.96: {100 * np.mean(np.abs(z) > 1.96):.1f} %, beyond 3.29: "
        f"{100 * np.mean(np.abs(z) > 3.29):.2f} %, totals {total.min():.4f} to {total.max():.4f}"
    )
    assert len(z) > 100
    # entries of one row go together a little: three times the error of independent ones
    allowed = 3 * 4 / np.sqrt(len(z))
    assert abs(z.mean()) < allowed
    assert 1 - allowed < np.sqrt(np.mean(z**2)) < 1 + allowed
    assert np.mean(np.abs(z) > 1.96) < 0.05 + allowed / 2
    spread = theirs.sum_deviation / np.sqrt(theirs.runs)
    own = ours.sum_error.reshape(spread.shape)
    z = scores((total - 1) * sums, own, spread, (ours.batches, theirs.runs))
    assert np.all((np.abs(z) < 4) | (np.abs(total - 1) < 0.005)), total


def ours(matrix: str, name: str):
    """The same matrix by our tracer."""
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    surfaces, groups, outside = SCENES[name]()
    if matrix == "view":
        return view_matrix(surfaces, groups, POINTS, UP, samples=16384)
    return daylight_matrix(outside, groups, subdivision=1, samples=8192)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("matrix", MATRICES)
def test_matrices_are_those_of_radiance(matrix, name):
    stored = Repeated.read(STORED / f"{matrix}_{name}.npz")
    check(ours(matrix, name), stored, f"{matrix}, {name}")


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("matrix", MATRICES)
def test_matrices_are_those_of_radiance_run_here_and_now(matrix, name, tmp_path):
    pytest.importorskip("pyradiance")
    theirs, stored = (MATRICES[matrix](name, tmp_path), Repeated.read(STORED / f"{matrix}_{name}.npz"))
    check(ours(matrix, name), theirs, f"{matrix}, {name}")
    # what is stored is what Radiance computes: both have the noise of their runs
    error = np.hypot(theirs.sum_deviation, stored.sum_deviation) / np.sqrt(theirs.runs)
    gap = np.abs(theirs.mean.sum(axis=-1) - stored.mean.sum(axis=-1))
    assert np.all(gap <= 5 * error + 1e-4 * stored.mean.sum(axis=-1))
