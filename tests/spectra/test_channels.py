"""Bands of wavelength: power, means, what detectors receive of them."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.spectra.channels import CHANNEL_SETS, Channels, channels_of
from mitsuba_cfs.spectra.daylight import daylight_components, daylight_shares, sun_spectra
from mitsuba_cfs.spectra.detectors import detected, equivalent_daylight, illuminant


def daylight() -> np.ndarray:
    """Spectra of skies from 4000 to 20000 K and of suns from 6 to 64 degrees high."""
    shares = daylight_shares(np.array([4000.0, 5000, 6500, 8000, 10000, 20000]))
    return np.concatenate([shares.T @ daylight_components(), sun_spectra([0.1, 0.3, 0.5, 0.9])])


@pytest.mark.parametrize("count", CHANNEL_SETS)
def test_power_is_complete_and_d65_exact(count: int) -> None:
    channels, spectrum = channels_of(count), illuminant("D65")
    trapezoid = np.trapezoid(spectrum, dx=1.0)
    assert channels.power(spectrum).sum() == pytest.approx(trapezoid, rel=1e-12)
    own = channels.detection @ channels.power(spectrum)
    assert own == pytest.approx(detected(spectrum), rel=1e-3)  # cells at the edges
    assert channels.mean(np.full(401, 0.4)) == pytest.approx(0.4)


@pytest.mark.parametrize(("count", "most"), [(3, 0.14), (5, 0.11), (9, 0.026), (20, 1e-3)])
def test_error_of_the_melanopic_ratio_against_every_five_nanometres(count: int, most: float) -> None:
    # docs/spectral.md states these bounds
    spectra, fine, coarse = daylight(), channels_of(81), channels_of(count)
    exact = fine.power(spectra) @ fine.detection.T
    own = coarse.power(spectra) @ coarse.detection.T
    ratios = equivalent_daylight(own[:, 5]) / own[:, 0]
    true = equivalent_daylight(exact[:, 5]) / exact[:, 0]
    assert np.abs(ratios / true - 1).max() < most


def test_spectrum_has_the_power_of_its_bands() -> None:
    channels = channels_of(9)
    power = np.linspace(1.0, 2.0, 9)
    assert channels.power(channels.spectrum(power)) == pytest.approx(power, rel=0.02)


def test_faults() -> None:
    with pytest.raises(ValueError, match="expected one of 3, 5, 9, 20, 81, got 4"):
        channels_of(4)
    with pytest.raises(ValueError, match="380 to 780"):
        Channels((400.0, 780.0))
    with pytest.raises(ValueError, match="rising"):
        Channels((380.0, 380.2, 780.0))
