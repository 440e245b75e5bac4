"""Path-traced pictures have the illuminance of a path-traced sensor at the same eye."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.view import fisheye
from tests.trace import rooms

pytestmark = pytest.mark.usefixtures("variant")


def test_what_stands_outdoors_is_lit_by_the_sky_and_not_by_the_sun_alone():
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.scattering import AngularBeam
    from mitsuba_cfs.trace.paths.point_in_time import point_in_time
    from mitsuba_cfs.trace.paths.scene import PathOptics, PathTracingScene, Sky
    from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

    interior, groups = rooms.test_room()
    hidden = rooms.quad((-50, -4, -50), (50, -4, -50), (50, -4, 50), (-50, -4, 50))
    system = PathOptics(None, AngularBeam(np.full(16, 0.8)))
    room = PathTracingScene(interior, rooms.surfaces([(hidden, 0.5)]), groups, [system])
    sky = Sky(np.full(146, 2000.0), (0.0, 0.5, 0.5), 0.0)
    view = fisheye((1.8, 2.0, 1.2), (0.0, -1.0, 0.0), 100)
    picture = evaluate(point_in_time_picture(room, sky, view, samples=8), view)
    sensor = point_in_time(room, sky, [view.position], [view.direction], samples=8192, stopping=Stopping(batches=8))
    # noise of both below 0.4 %; pixels of 1.8 degrees show the window's edges to 1 %
    assert picture.Ev == pytest.approx(sensor.values[0], rel=0.025)
