"""Relative transmittance of systems by wavelength band."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.angular import AngularTable, specular_matrices
from mitsuba_cfs.bsdf.colour import RGB_TO_XYZ
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_factor import ANGLES, SlatLight, SpectralFactor
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, diffuse_reflectance
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, visible_mean


def test_a_shade_of_any_scale_is_the_same_and_a_neutral_one_is_one() -> None:
    red = np.where(NANOMETRES > 600, 0.8, 0.1)
    channels = channels_of(9)
    one, tenth = (SpectralFactor.of_panes((), k * red).of_patches(channels).straight for k in (1, 0.1))
    np.testing.assert_allclose(one, tenth, rtol=1e-12)
    assert one[-1].min() > 1 > one[0].max()
    np.testing.assert_allclose(SpectralFactor.neutral().of_patches(channels).straight, 1.0, atol=1e-9)


def test_a_shade_that_passes_nothing_gives_no_nan() -> None:
    opaque = SpectralFactor.of_panes((), np.zeros(len(NANOMETRES)))
    channels = channels_of(5)
    assert np.isfinite(opaque.of_angles(channels)).all()
    assert np.isfinite(opaque.of_patches(channels).straight).all()


def test_light_between_a_coloured_shade_and_glass_has_its_colour() -> None:
    tau, rho = np.full(2, 0.8), np.full(2, 0.1)
    pane = SpectralPane("grey", np.array([300.0, 2500.0]), tau, rho, rho, 0.004)
    shade = np.where(NANOMETRES < 550, 0.05, 0.4)
    back = diffuse_reflectance([pane], NANOMETRES)
    assert back == pytest.approx(back[0]) and 0.1 < back[0] < 0.2  # grazing light is reflected more
    without = SpectralFactor.of_panes([pane], shade).transmittance
    own = SpectralFactor.of_panes([pane], shade, shade).transmittance
    assert own / without == pytest.approx(np.broadcast_to(1 / (1 - shade * back), own.shape))


def test_colour_of_glass_as_seen() -> None:
    assert SpectralFactor.neutral().rgb() == pytest.approx(np.ones((len(ANGLES), 3)), abs=2e-3)
    red = np.where(NANOMETRES > 600, 0.5, 0.1)
    own = SpectralFactor.of_panes((), red).rgb()[0]
    assert own[0] > 1.5 > 1 > own[1] and own @ RGB_TO_XYZ[1] == pytest.approx(1.0)
    # by the same path as light: a tinted system passes the tint times the visible band
    table = AngularTable(ANGLES, np.full(len(ANGLES), 0.2))
    system = BsdfOptics(
        specular_matrices(
            replace(table, reflectance_front=np.zeros(len(ANGLES)), reflectance_back=np.zeros(len(ANGLES)))
        ),
        angular=table,
    )
    passed = system.tinted(ANGLES, np.full(len(ANGLES), own[0])).transmission
    assert np.diag(passed) == pytest.approx(own[0] * np.diag(system.transmission), rel=1e-3)


def test_slats_colour_what_they_reflect_by_the_number_of_reflections() -> None:
    channels, red = channels_of(81), np.where(NANOMETRES > 600, 0.4, 0.1)
    slats = SlatLight(red, np.full((2, KLEMS_FULL.size, KLEMS_FULL.size), 0.3))
    factor = replace(SpectralFactor.neutral(), slats=slats)
    straight, reflected = factor.of_patches(channels)
    assert straight == pytest.approx(np.ones_like(straight))
    once, twice = reflected[..., 0]
    ratio = visible_mean(red) ** 2 / visible_mean(red**2)
    assert twice[[0, -1]] == pytest.approx(once[[0, -1]] ** 2 * ratio)
    assert once[-1] / once[0] == pytest.approx(4.0) and twice[-1] / twice[0] == pytest.approx(16.0)
    assert visible_mean(red) < 0.16 < 0.4 < once[-1] * visible_mean(red) + 1e-3
    # in visible light all of them are 1
    weights = channels.detection[0] * channels.power(illuminant("D65"))
    assert reflected @ np.ones(KLEMS_FULL.size) @ weights == pytest.approx(KLEMS_FULL.size * weights.sum(), rel=2e-3)
    assert factor.of_angles(channels)[1:, :, 0] == pytest.approx(reflected[..., 0])
