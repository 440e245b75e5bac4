"""Reflectance of surfaces by wavelength."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.colour import reflectance_of_colour, relative_rgb, with_visible
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities


@pytest.mark.parametrize("linear", [(0.5, 0.5, 0.5), (0.6, 0.05, 0.03), (0.3, 0.2, 0.1), (0.02, 0.1, 0.5)])
def test_a_colour_under_d65_is_that_colour(linear) -> None:
    spectrum = reflectance_of_colour(linear)
    assert spectrum.min() >= 0 and spectrum.max() <= 1
    observer = illuminant("D65")[:, None] * sensitivities()[-3:].T
    x, y, z = spectrum @ (observer / observer.sum(axis=0))
    # of colours over their luminance; the authors' fit is for their own tables of D65
    assert y * relative_rgb(x, y, z) == pytest.approx(linear, abs=4e-3)


def test_grey_has_no_colour_and_the_visible_reflectance_is_kept() -> None:
    assert np.ptp(reflectance_of_colour((0.4, 0.4, 0.4))) < 1e-5  # digits of the tables
    weight = illuminant("D65") * sensitivities()[0]
    shape = np.interp(NANOMETRES, [380.0, 780.0], [2.0, 9.0])
    found = with_visible(np.stack([shape, np.ones_like(shape)]), np.array([0.3, 0.7]))
    assert found @ weight / weight.sum() == pytest.approx([0.3, 0.7])
    bright = with_visible(shape, 0.8)  # would be 1.26 at 780 nm
    assert bright @ weight / weight.sum() == pytest.approx(0.8) and bright.max() == pytest.approx(1.0)
