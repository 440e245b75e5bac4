"""Light through glass between rooms, against Mitsuba's own path tracer in all rooms at once."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.surfaces import WindowGroup, WindowSurface
from tests.validation.cut_groups import surfaces
from tests.validation.inner_glass import FIRST, GLASS, by_paths, by_phases, pooled, upright

pytestmark = pytest.mark.usefixtures("variant")

# [lx] of the sensors by `path`, mean of four seeds, standard error at most 0.6 and 1.4 % of a
# sensor: `python -m tests.validation inner_glass --paths 1048576`
PATHS = {2: [148.4, 109.7, 86.7, 74.1, 93.8], 3: [21.9, 18.0, 16.0, 16.4, 16.4]}


def test_straight_on_the_glass_has_what_the_window_before_it_has() -> None:
    """Both normal patches: nothing between, so the glass has T D of the window, and no more."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.adjacent import adjacent_daylight

    def group(name: str, y: float, place: tuple) -> WindowGroup:
        return WindowGroup(name, (WindowSurface(name, upright(y, place, north=False)),))

    wide = group("window", FIRST - 0.5, ((-3, 7), (-3, 6)))
    patches = np.arange(1.0, KLEMS_FULL.size + 1)[None, :, None]
    black = surfaces([(upright(FIRST, GLASS, north=True), 0.0)])
    glass = [group("glass", FIRST, GLASS)]
    found = adjacent_daylight(black, [wide], patches, glass, PathOptions(64, 32, Stopping(2))).values[0, :, 0]
    # up to 60 degrees every ray meets the window, which has the same patches there
    near = KLEMS_FULL.centres()[0] < np.radians(60)
    np.testing.assert_allclose(found[near], patches[0, near, 0], rtol=1e-6)


@pytest.mark.parametrize("rooms", [2, 3])
def test_the_mean_of_the_last_room_is_that_of_stored_paths(rooms: int) -> None:
    """With few samples: the mean of five sensors has a noise of 1 %."""
    few = Sampling(sensor_samples=4096, patch_samples=2048, subdivision=1)
    found = by_phases(rooms, sampling=few)
    assert found.mean() == pytest.approx(np.mean(PATHS[rooms]), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("rooms", [2, 3])
def test_the_last_room_gets_the_light_of_those_before_it(rooms: int) -> None:
    """Paths see all rooms at once, and so the light that comes back; 3 % is the bar."""
    found, noise = pooled([by_phases(rooms, seed) for seed in range(2)])
    paths, error = pooled([by_paths(rooms, 1 << 19, seed) for seed in range(2)])
    print(found, noise, paths, error, found / paths)
    assert found.mean() == pytest.approx(paths.mean(), rel=0.03)
    np.testing.assert_allclose(paths, PATHS[rooms], rtol=0.06)
    np.testing.assert_allclose(found, PATHS[rooms], rtol=0.06)
