"""Relative transmittance of systems by wavelength band."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.detectors import NANOMETRES


def test_a_shade_of_any_scale_is_the_same_and_a_neutral_one_is_one() -> None:
    red = np.where(NANOMETRES > 600, 0.8, 0.1)
    channels = channels_of(9)
    one, tenth = (SpectralFactor.of_panes((), k * red).of_patches(channels) for k in (1, 0.1))
    np.testing.assert_allclose(one, tenth, rtol=1e-12)
    assert one[-1].min() > 1 > one[0].max()
    np.testing.assert_allclose(SpectralFactor.neutral().of_patches(channels), 1.0, atol=1e-9)


def test_a_shade_that_passes_nothing_gives_no_nan() -> None:
    opaque = SpectralFactor.of_panes((), np.zeros(len(NANOMETRES)))
    channels = channels_of(5)
    assert np.isfinite(opaque.of_angles(channels)).all()
    assert np.isfinite(opaque.of_patches(channels)).all()
