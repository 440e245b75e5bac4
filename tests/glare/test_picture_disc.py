"""The rays of pixels that meet the sun's disc."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.trace.sun import pixels as sun_pixels


def test_rays_do_not_depend_on_how_many_are_tried_at_a_time(monkeypatch):
    view = fisheye((0, 0, 0), (0, 1, 0), 40)
    pixels = np.arange(15 * 40 + 16, 15 * 40 + 26)
    suns = np.tile([0.0, np.cos(0.35), np.sin(0.35)], (len(pixels), 1))
    whole = sun_pixels.disc_rays(view, pixels, suns, np.radians(4.5))
    assert set(whole[0]) == {3, 4}  # of two blocks
    monkeypatch.setattr(sun_pixels, "RAYS", 4 * 64**2)
    for a, b in zip(whole, sun_pixels.disc_rays(view, pixels, suns, np.radians(4.5)), strict=True):
        np.testing.assert_array_equal(a, b)
