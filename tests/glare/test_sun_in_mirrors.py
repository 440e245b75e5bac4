"""The sun in a mirror: a glare source of its own, whatever the pixels and by either method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.gloss import mirror, pane
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from tests.trace import rooms
from tests.trace.gloss_scenes import EYE, SUN, black_room, clear, facade, hidden_sun, lit_by

pytestmark = pytest.mark.usefixtures("variant")
LUX = np.array([50_000.0])
AHEAD = (0.0, -1.0, 0.0)
GREY = 300.0  # luminance of all that is not the sun [cd/m2]


def shown(size: int, around, view=None):
    """The sun in the pixels of a view by five phases."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.sun.picture_sun import PictureSun

    beam = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    return PictureSun(*around, rooms.test_room()[1], [beam], view or fisheye(EYE, AHEAD, size))


def traced(around):
    """The room for path tracing, behind an unglazed window."""
    from mitsuba_cfs.trace.paths.scene import PathTracingScene

    return PathTracingScene(*around, rooms.test_room()[1], [clear()])


def discs_by_paths(around, size: int = 90):
    from mitsuba_cfs.trace.paths.disc import discs_seen

    sky = lit_by(np.zeros(146), SUN, LUX[0] / SUN_SOLID_ANGLE)
    return discs_seen(traced(around), sky, fisheye(EYE, AHEAD, size))


def dgp(size: int, discs) -> float:
    return evaluate(np.full((size, size), GREY), fisheye(EYE, AHEAD, size), discs=discs).dgp


@pytest.mark.parametrize("gloss", [mirror(0.05), pane(1.52, 0.985)], ids=["mirror", "pane"])
def test_dgp_does_not_depend_on_the_pixels(gloss) -> None:
    around = black_room(None)[0], facade(gloss)
    rated = [dgp(size, shown(size, around).discs(SUN[None], LUX)[0]) for size in (60, 150, 600)]
    # the rim of a picture of 60 pixels is 0.2 % off in solid angle
    assert np.ptp(rated) < 0.001
    assert rated[0] > dgp(60, ()) + 0.1
    assert dgp(150, discs_by_paths(around)) == pytest.approx(rated[1], abs=1e-5)


def test_the_image_has_the_solid_angle_of_the_sun_and_the_luminance_of_its_reflection() -> None:
    around = black_room(None)[0], facade(mirror(0.05))
    for discs in (shown(90, around).discs(SUN[None], LUX)[0], discs_by_paths(around)):
        (image,) = discs  # the sun itself is behind the house
        assert image.solid_angle == pytest.approx(SUN_SOLID_ANGLE, rel=1e-4)
        assert image.luminance == pytest.approx(0.05 * LUX[0] / SUN_SOLID_ANGLE, rel=1e-4)
        np.testing.assert_allclose(image.direction, SUN * [1, -1, 1], atol=1e-4)


def test_a_hidden_sun_has_no_image() -> None:
    around = black_room(None)[0], hidden_sun(mirror(0.8))
    assert shown(90, around).discs(SUN[None], LUX) == [()]
    assert discs_by_paths(around) == ()


@pytest.mark.peer
def test_a_fine_picture_with_the_image_in_its_pixels_is_rated_the_same(tmp_path, evalglare) -> None:
    """evalglare of the middle 80 degrees in pixels of 0.04 degrees, 13 across the image."""
    around, size = (black_room(None)[0], facade(mirror(0.05))), 2000
    fine = shown(size, around, replace(fisheye(EYE, AHEAD, size), horizontal_deg=80, vertical_deg=80))
    values = np.full((1, len(fine.pixels)), GREY)
    fine.add_disc(values, SUN[None], LUX)
    picture = np.zeros(size * size, dtype=np.float32)
    picture[fine.pixels] = values[0]
    write_hdr(tmp_path / "fine.hdr", picture.reshape(size, size), fine.view)
    limit = 0.5 * 0.05 * LUX[0] / SUN_SOLID_ANGLE  # at the rim, half of a pixel shows the image
    discs = shown(150, around).discs(SUN[None], LUX)[0]
    found = evaluate(np.full((150, 150), GREY), fisheye(EYE, AHEAD, 150), discs=discs)
    verdict = evalglare(tmp_path / "fine.hdr", "-b", limit, "-i", found.Ev)
    # a tenth of the image's pixels are mixed at the rim: L^2 omega of the source is 8 % less
    assert found.dgp == pytest.approx(verdict.figures["dgp"], abs=0.004)
    assert dgp(150, ()) < 0.3 < verdict.figures["dgp"]
