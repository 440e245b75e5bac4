"""V and D against rfluxmtx: the same scene, the same bins, both programs' noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from .radiance_matrices import MATRICES, POINTS, SCENES, STORED, UP, Repeated

pytestmark = pytest.mark.usefixtures("variant")


def normal_scores(ours, theirs: Repeated):
    """(mean of theirs - ours) over the error of both, as scores of a unit normal.

    Theirs are few repetitions, so the quotient has Student's distribution; its quantiles are turned
    into the normal's.  Entries known to less than 10 % are counts of few rays, not normal.
    """
    runs = theirs.runs
    mean, error = theirs.mean, theirs.deviation / np.sqrt(runs)
    own = ours.standard_error**2
    both = np.sqrt(own + error**2)
    known = (both > 0) & (both < 0.1 * ours.values)
    # Welch: degrees of freedom of the sum of two variances, theirs and ours
    freedom = (own + error**2) ** 2 / (error**4 / (runs - 1) + own**2 / (ours.batches - 1) + 1e-99)
    t = ((mean - ours.values) / np.where(both > 0, both, 1))[known]
    tail = stats.t.sf(np.abs(t), freedom[known])
    return np.sign(t) * stats.norm.isf(np.maximum(tail, 1e-12))


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
    error = 4 * np.hypot(spread, ours.sum_error.reshape(spread.shape))
    assert np.all(np.abs(total - 1) < np.maximum(error / sums, 0.005)), total


def ours(matrix: str, name: str):
    """The same matrix by our tracer."""
    from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
    from mitsuba_cfs.trace.view_matrix import view_matrix

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
    theirs, stored = (
        MATRICES[matrix](name, tmp_path),
        Repeated.read(STORED / f"{matrix}_{name}.npz"),
    )
    check(ours(matrix, name), theirs, f"{matrix}, {name}")
    # what is stored is what Radiance computes: both have the noise of their runs
    error = np.hypot(theirs.sum_deviation, stored.sum_deviation) / np.sqrt(theirs.runs)
    gap = np.abs(theirs.mean.sum(axis=-1) - stored.mean.sum(axis=-1))
    assert np.all(gap <= 5 * error + 1e-4 * stored.mean.sum(axis=-1))
