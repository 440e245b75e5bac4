"""V and D against rfluxmtx: the same scene, the same bins, both programs' noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests import radiance

from . import rooms

pytest.importorskip("pyradiance")
pytestmark = [pytest.mark.peer, pytest.mark.usefixtures("variant")]

SCENES = {
    "room": lambda: (*rooms.test_room(), rooms.obstruction()),
    "L": rooms.l_shaped_room,
    "skylight": lambda: (*rooms.skylight_room(), rooms.NOTHING),
}
POINTS = np.array([[1.0, 1.2, 0.85], [2.2, 2.6, 0.85], [3.0, 2.9, 0.85]])
RAYS = 4000  # of a Klems patch
RUNS = 10  # repetitions of Radiance, for its error


def normal_scores(ours, values):
    """(mean of theirs - ours) over the error of both, as scores of a unit normal.

    Theirs are few repetitions, so the quotient has Student's distribution; its quantiles are turned
    into the normal's.  Entries known to less than 10 % are counts of few rays, not normal.
    """
    runs = len(values)
    mean, error = values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(runs)
    own = ours.standard_error**2
    both = np.sqrt(own + error**2)
    known = (both > 0) & (both < 0.1 * ours.values)
    # Welch: degrees of freedom of the sum of two variances, theirs and ours
    freedom = (own + error**2) ** 2 / (error**4 / (runs - 1) + own**2 / (ours.batches - 1) + 1e-99)
    t = ((mean - ours.values) / np.where(both > 0, both, 1))[known]
    tail = stats.t.sf(np.abs(t), freedom[known])
    return np.sign(t) * stats.norm.isf(np.maximum(tail, 1e-12))


def check(ours, theirs, axis: int, name: str):
    z = normal_scores(ours, theirs)
    total = theirs.mean(axis=0).sum(axis=axis) / ours.values.sum(axis=axis)
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
    spread = theirs.sum(axis=axis + 1).std(axis=0, ddof=1) / np.sqrt(len(theirs))
    error = 4 * np.hypot(spread, ours.sum_error.reshape(spread.shape))
    assert np.all(np.abs(total - 1) < np.maximum(error / ours.values.sum(axis=axis), 0.005)), total


@pytest.mark.parametrize("name", SCENES)
def test_view_matrix(name, tmp_path):
    from mitsuba_cfs.trace.view_matrix import view_matrix

    surfaces, groups, _ = SCENES[name]()
    up = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
    ours = view_matrix(surfaces, groups, POINTS, up, samples=16384)
    radiance.write_surfaces(surfaces, tmp_path / "room.rad")
    theirs = []
    for g, group in enumerate(groups):
        radiance.write_group(group, tmp_path / f"group{g}.rad")
        command = (
            f"rfluxmtx -faf -I+ -n 2 -ab 10 -ad 12000 -lw 1e-6 -y {len(POINTS) * RUNS} "
            f"- group{g}.rad room.rad"  # the other windows are holes, as good as black
        )
        text = radiance.sensors_text(np.tile(POINTS, (RUNS, 1)), np.tile(up, (RUNS, 1)))
        out = radiance.read_float_matrix(radiance.run(command, tmp_path, text))
        theirs.append(out.reshape(RUNS, len(POINTS), 145))
    check(ours, np.stack(theirs, axis=2), 2, f"V, {name}")


def with_black_windows(outside, groups):
    """What stands outdoors and the windows, 2 mm behind the plane that the rays start on.

    What comes back to a window is absorbed, as in ours: without it, it would pass through the room.
    """
    if not len(outside.triangles):
        return outside
    panes = [(w.triangles - 2e-3 * w.normal, 0.0) for g in groups for w in g.windows]
    old = [(outside.triangles[[i]], r) for i, r in enumerate(outside.reflectance)]
    return rooms.surfaces(old + panes)


@pytest.mark.parametrize("name", SCENES)
def test_daylight_matrix(name, tmp_path):
    from mitsuba_cfs.trace.daylight_matrix import daylight_matrix

    _, groups, outside = SCENES[name]()
    ours = daylight_matrix(outside, groups, subdivision=1, samples=8192)
    radiance.write_surfaces(with_black_windows(outside, groups), tmp_path / "outdoors.rad")
    radiance.write_sky(tmp_path / "sky.rad", 1)
    theirs = []
    for g, group in enumerate(groups):
        radiance.write_group(group, tmp_path / f"group{g}.rad")
        # rfluxmtx's rays start with the same random numbers in each run: only another count of
        # them, and so another division of the patch, makes a repetition
        runs = [
            f"rfluxmtx -ff -n 2 -ab 4 -ad 1 -lw 1e-6 -c {RAYS + 41 * i} "
            f"group{g}.rad sky.rad outdoors.rad"
            for i in range(RUNS)
        ]
        runs = [radiance.read_float_matrix(radiance.run(command, tmp_path)) for command in runs]
        theirs.append(np.stack(runs))
    check(ours, np.stack(theirs, axis=1), 2, f"D, {name}")
