"""A mirror facade, a rough one and a glossy floor against Radiance: Ev and DGP at an eye."""

from __future__ import annotations

import pytest

from mitsuba_cfs.images.view import fisheye

pytestmark = pytest.mark.usefixtures("variant")

# Ev [lx] of `rtrace` and its standard error, by `python -m tests.validation gloss`
RTRACE = {"mirror": (8062.0, 6.1), "metal": (6998.9, 10.7), "floor": (2650.9, 2.1)}


@pytest.mark.parametrize("name", RTRACE)
def test_illuminance_at_the_eye_is_that_of_rtrace(name):
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.paths.point_in_time import point_in_time
    from tests.validation import gloss

    given, view = gloss.case(name), fisheye(gloss.EYE, gloss.DIRECTION, 50)
    found = point_in_time(
        given.lit, given.sky, [view.position], [view.direction], samples=2**18, stopping=Stopping(batches=4)
    )
    ev, error = RTRACE[name]
    noise = 4 * (found.standard_error[0] ** 2 + error**2) ** 0.5
    assert noise < 0.01 * ev
    assert abs(found.values[0] - ev) < max(noise, 0.005 * ev), (found.values, ev)


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("name", RTRACE)
def test_illuminance_and_glare_are_those_of_radiance_run_here_and_now(name, tmp_path):
    pytest.importorskip("pyradiance")
    from tests.validation.gloss import outcome

    found = outcome(name, tmp_path, size=100, points=2)
    noise = 4 * (found.ev_error**2 + found.ev_rtrace_error**2) ** 0.5
    assert abs(found.ev - found.ev_rtrace) < 0.01 * found.ev_rtrace + noise, found
    assert abs(found.dgp - found.dgp_rpict) < 0.005, found
    assert abs(found.dgp_five_phase - found.dgp_rpict) < 0.01, found
