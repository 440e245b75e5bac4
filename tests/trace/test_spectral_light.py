"""Light by channel from the photopic light, against light traced for each channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.angular import AngularTable, specular_matrices
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.spectral_factor import ANGLES, SlatLight, SpectralFactor
from mitsuba_cfs.methods.coloured_room import _by_surface, reflectance_bands
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.optics import BetweenOptics, BsdfOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.spectral_light import Detection, _modes, sky_spectra, spectral_light
from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.daylight import daylight_components
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities, visible_mean
from mitsuba_cfs.surfaces import Surfaces
from tests.trace.phase_rooms import traced

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")
CHANNELS = channels_of(3)


def tinted() -> SpectralFactor:
    """Blue glass: what it absorbs grows with the wavelength and with the way through it."""
    way = 1 / np.sqrt(1 - (np.sin(ANGLES) / 1.5) ** 2)
    passed = np.exp(-way[:, None] * (NANOMETRES - 380) / 200)
    return SpectralFactor(passed * (1 - (1 - np.cos(ANGLES)) ** 5)[:, None])


def optics(transmittance: np.ndarray, share: float = 0.1) -> BsdfOptics:
    """Glass by its transmittance at `ANGLES`, which mirrors a share of the room's light."""
    mirrored = np.full(len(ANGLES), share)
    table = AngularTable(ANGLES, transmittance * 0.9, mirrored, mirrored)
    return BsdfOptics(specular_matrices(table), angular=table)


def sky(height_deg: float = 35.0, subdivision: int = 1):
    """Four hours: clear from three sides, and overcast."""
    azimuth, height = np.radians([150.0, 180.0, 250.0, 200.0]), np.radians(height_deg)
    towards = np.stack(
        [np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.full(4, np.sin(height))], axis=1
    )
    beam, diffuse = [700.0, 800.0, 300.0, 0.0], [90.0, 100.0, 200.0, 180.0]
    return given_sky(towards, beam, diffuse, subdivision, day_of_year=80)


def channel_irradiance(light, factors, channels, rows=None) -> np.ndarray:
    """Irradiance of the sensors in each band [C, S, L]."""
    wanted = [Detection(np.eye(channels.count))]
    [found] = spectral_light(light, factors, channels, wanted, rows).received
    return found


def in_channel(whole, spectra, c: int):
    """The skies in a band of `CHANNELS`, in its power instead of light."""
    parts = CHANNELS.power(daylight_components())[:, c]
    diffuse = np.einsum("k,kpl->pl", parts, spectra.amount)
    diffuse[0] = CHANNELS.power(spectra.ground)[:, c] * spectra.ground_luminance
    beam = CHANNELS.power(spectra.sun)[:, c]
    sun = whole.sun_alone() * beam
    return replace(whole, whole=diffuse + sun, illuminance=whole.illuminance * beam, sun=sun, solar=None)


def traced_by_channel(matrices, factor, whole) -> np.ndarray:
    """Irradiance [C, S, L] with the optics of each channel traced, no factor of the visible's."""
    spectra, found = sky_spectra(whole), []
    for c in range(CHANNELS.count):
        own = in_channel(whole, spectra, c)
        system = optics(CHANNELS.mean(factor.transmittance)[:, c])
        groups = len(matrices.scene.groups)
        found.append(illuminance(phase_light(matrices, [[system]] * groups, own)))
    return np.stack(found)


@pytest.fixture(scope="module")
def corner():
    """Windows to two sides below a shade that reflects, three sensors."""
    room, groups, shade = rooms.l_shaped_room()
    points = np.array([[2.0, 1.0, 0.8], [1.0, 4.5, 0.8], [5.0, 4.5, 0.8]])
    return room, groups, shade, points


@pytest.mark.parametrize(("open_site", "most"), [(True, 2e-3), (False, 6e-3)])
def test_light_is_that_traced_for_each_channel(corner, open_site: bool, most: float) -> None:
    # Factors at the middles of sky patches (10 degrees), and means for what the shade reflects:
    # some thousandths of glass that turns by a tenth between 0 and 70 degrees
    room, groups, shade, points = corner
    exterior = Surfaces.none() if open_site else shade
    matrices = traced(room, exterior, groups, points, subdivision=1, window_parts=1)
    factor, whole = tinted(), sky()
    visible = phase_light(matrices, [[optics(factor.visible)]] * len(groups), whole)
    own = channel_irradiance(visible, [[factor]] * len(groups), CHANNELS)
    true = traced_by_channel(matrices, factor, whole)
    assert own[:, : len(points)] == pytest.approx(true, rel=most)


def test_light_of_the_ground_passes_the_panes_at_its_own_angles(corner) -> None:
    # the ground is one patch, whose direction is down: at 90 degrees the panes are darkest and bluest
    room, groups, _, _ = corner
    points, normals = np.array([[2.0, 1.5, 1.6], [2.0, 1.5, 2.0]]), np.array([[0.0, -1.0, 0.0], [0.0, -0.6, -0.8]])
    matrices = traced(room, Surfaces.none(), groups, points, normals, subdivision=1, window_parts=1)
    factor, whole = tinted(), sky()
    visible = phase_light(matrices, [[optics(factor.visible)]] * len(groups), whole)
    own = channel_irradiance(visible, [[factor]] * len(groups), CHANNELS)
    assert own[:, : len(points)] == pytest.approx(traced_by_channel(matrices, factor, whole), rel=3e-3)


def test_neutral_glass_gives_the_photopic_light(corner) -> None:
    room, groups, shade, points = corner
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    factor, channels = SpectralFactor.neutral(), channels_of(81)
    light = phase_light(matrices, [[optics(np.full(len(ANGLES), 0.7))]] * len(groups), sky())
    bands = channel_irradiance(light, [[factor]] * len(groups), channels)
    lux = np.tensordot(channels.detection[0], bands, 1)
    # 2e-4: light beyond 380 to 780 nm and the cells of 5 nm
    assert lux[: len(points)] == pytest.approx(illuminance(light), rel=2e-4)


def test_states_are_those_of_their_hours(corner) -> None:
    room, groups, shade, points = corner
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    blue, grey = tinted(), SpectralFactor.neutral()
    states = [optics(blue.visible), optics(np.full(len(ANGLES), 0.3))]
    light = phase_light(matrices, [states] * len(groups), sky())
    factors = [[blue, grey]] * len(groups)
    rows = np.tile([0, 1, 0, 1], (len(groups), 1))
    mixed = channel_irradiance(light, factors, CHANNELS, rows)[0]
    for j in (0, 1):
        alone = channel_irradiance(light, factors, CHANNELS, np.full_like(rows, j))[0]
        assert mixed[:, rows[0] == j] == pytest.approx(alone[:, rows[0] == j], rel=1e-5)


def test_a_state_between_two_others_is_their_mean_in_each_channel(corner) -> None:
    room, groups, shade, points = corner
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    blue, grey = tinted(), SpectralFactor.neutral()
    low, high = optics(blue.visible), optics(np.full(len(ANGLES), 0.3))
    mirrored = np.full(len(ANGLES), 0.1)
    mean = AngularTable(ANGLES, 0.9 * (0.75 * blue.visible + 0.25 * 0.3), mirrored, mirrored)
    between = BsdfOptics(specular_matrices(mean), None, mean, BetweenOptics(low, high, 0.25))
    light = phase_light(matrices, [[low, between, high]] * len(groups), sky())
    both = SpectralFactor(0.75 * blue.transmittance + 0.25 * 0.3)
    factors = [[blue, both, grey]] * len(groups)
    own, expected = [], []
    for found, states in ((expected, (0, 2)), (own, (1,))):
        for j in states:
            rows = np.full((len(groups), 4), j)
            found.append(channel_irradiance(light, factors, CHANNELS, rows))
    assert own[0] == pytest.approx(0.75 * expected[0] + 0.25 * expected[1], rel=1e-5)


def test_a_total_is_the_sum_over_the_hours_and_a_detector_that_of_its_bands(corner) -> None:
    room, groups, shade, points = corner
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    blue, grey = tinted(), SpectralFactor.neutral()
    states = [optics(blue.visible), optics(np.full(len(ANGLES), 0.3))]
    light = phase_light(matrices, [states] * len(groups), sky())
    factors, rows = [[blue, grey]] * len(groups), np.tile([0, 1, 0, 1], (len(groups), 1))
    melanopic = CHANNELS.detection[[5]]
    wanted = [
        Detection(melanopic, slice(2)),
        Detection(melanopic, slice(2), total=True),
        Detection(np.eye(CHANNELS.count), slice(2)),
    ]
    one, total, bands = spectral_light(light, factors, CHANNELS, wanted, rows).received
    assert one == pytest.approx(np.tensordot(melanopic, bands, 1), rel=1e-5)
    assert total == pytest.approx(one.sum(axis=-1), rel=1e-5)


def test_modes_of_a_deep_red_shade_leave_the_melanopic_light_as_it_is() -> None:
    # its factor above 700 nm is 1700: errors in proportion to that were 3 % of its DER (1e-4 of
    # clear glass's)
    red = np.interp(NANOMETRES, [690.0, 700.0], [0.0, 0.5])
    factors = [tinted(), SpectralFactor(tinted().transmittance * red)]
    channels = channels_of(20)
    light = channels.detection * channels.power(illuminant("D65"))  # [9, C]
    shares, modes = _modes(factors, channels)
    for factor, own in zip(factors, modes, strict=True):
        true, found = (light @ r for r in (factor.of_patches(channels).straight, shares @ own.patches.straight))
        assert found[5] / found[0] == pytest.approx(true[5] / true[0], rel=1e-3)


@pytest.mark.parametrize("see_through", [0.0, 1.0])
def test_light_through_coloured_slats_is_that_traced_for_each_channel(corner, see_through: float) -> None:
    """Half of the light passes straight on; what is scattered is red, more of it from above."""
    room, groups, shade, points = corner
    K, area = KLEMS_FULL.size, KLEMS_FULL.projected_solid_angles()
    share = np.interp(np.arange(K), [0, K - 1], [0.2, 0.5])  # scattered, of a white slat
    red = np.interp(NANOMETRES, [560.0, 620.0], [0.1, 0.8])

    def blind(colour: float) -> BsdfOptics:
        passed = np.tile(colour * share / np.pi, (K, 1))
        passed[np.arange(K), np.arange(K)] += 0.4 / area
        none = np.zeros((K, K))
        return BsdfOptics(KlemsBsdf(KLEMS_FULL, KLEMS_FULL, passed, none, none, none, see_through=see_through))

    visible = float(visible_mean(red))
    scattered = np.tile(visible * share / np.pi, (K, 1))
    factor = replace(
        SpectralFactor.neutral(), slats=SlatLight(red, (scattered / (scattered + np.diag(0.4 / area)))[None])
    )
    matrices = traced(room, shade, groups, points, subdivision=4, window_parts=1)
    whole = sky(subdivision=4)
    light = phase_light(matrices, [[blind(visible)]] * len(groups), whole)
    own = channel_irradiance(light, [[factor]] * len(groups), CHANNELS)
    spectra, found = sky_spectra(whole), []
    for c in range(CHANNELS.count):
        system = blind(float(CHANNELS.mean(red)[c]))
        found.append(illuminance(phase_light(matrices, [[system]] * len(groups), in_channel(whole, spectra, c))))
    assert own[:, : len(points)] == pytest.approx(np.stack(found), rel=2e-3)
    assert found[2].mean() / found[0].mean() > 1.2


def test_what_slats_reflect_twice_is_redder_than_what_they_reflect_once(corner) -> None:
    """Light into the upper half of the room is reflected once, into the lower half twice."""
    room, groups, shade, points = corner
    K, none = KLEMS_FULL.size, np.zeros((KLEMS_FULL.size,) * 2)
    red = np.interp(NANOMETRES, [560.0, 620.0], [0.1, 0.8])
    upwards = np.sin(KLEMS_FULL.centres()[1]) > 0

    def blind(once: float, twice: float) -> BsdfOptics:
        passed = np.tile(np.where(upwards, once, twice)[:, None] / np.pi, (1, K))
        return BsdfOptics(KlemsBsdf(KLEMS_FULL, KLEMS_FULL, passed, none, none, none, see_through=0.0))

    shares = np.array([np.tile(side[:, None], (1, K)) for side in (upwards, ~upwards)], dtype=float)
    factor = replace(SpectralFactor.neutral(), slats=SlatLight(red, shares))
    matrices = traced(room, shade, groups, points, subdivision=4, window_parts=1)
    whole = sky(subdivision=4)
    light = phase_light(matrices, [[blind(float(visible_mean(red)), float(visible_mean(red**2)))]] * len(groups), whole)
    own = channel_irradiance(light, [[factor]] * len(groups), CHANNELS)
    spectra, found = sky_spectra(whole), []
    for c in range(CHANNELS.count):
        system = blind(*(float(CHANNELS.mean(one)[c]) for one in (red, red**2)))
        found.append(illuminance(phase_light(matrices, [[system]] * len(groups), in_channel(whole, spectra, c))))
    assert own[:, : len(points)] == pytest.approx(np.stack(found), rel=2e-3)
    # no mean over the hemisphere gives both: sensors differ in colour
    ratio = found[0][..., :3] / found[2][..., :3]
    assert ratio.max() > 1.5 * ratio.min()


def coloured(room: Surfaces) -> np.ndarray:
    """Reflectance of the surfaces [F, N]: a wall of red paint, a floor of wood, the others neutral."""
    visible = np.zeros(int(room.surface.max()) + 1)
    visible[room.surface] = room.reflectance
    spectra = np.repeat(visible[:, None], len(NANOMETRES), axis=1)
    spectra[4:6] = np.interp(NANOMETRES, [570.0, 620.0], [0.05, 0.7])  # the walls towards x = 4
    spectra[12:14] = np.interp(NANOMETRES, [380.0, 780.0], [0.08, 0.5])  # the floor
    return spectra


def test_bands_of_reflectance_interpolate_the_light_of_a_room(corner) -> None:
    # The light of a sphere of these surfaces after any number of reflections is known
    room, channels = corner[0], channels_of(81)
    visible, reflectance, area = _by_surface(room, coloured(room), channels)
    bands = reflectance_bands(visible, reflectance, area, channels)
    assert len(bands.reflectance) < 10

    def light(values: np.ndarray) -> np.ndarray:
        mean = area @ values / area.sum()
        return 1 + 0.3 * values[5] + mean / (1 - mean)

    whole = light(reflectance)
    response = channels.detection / channels.detection.max(axis=1, keepdims=True)
    missed = np.abs(bands.shares @ light(bands.reflectance.T) / whole - 1)
    assert (missed * response).max() < 2e-3
    assert np.abs(light(visible) / whole - 1).max() > 0.2
    neutral = np.repeat(visible[:, None], channels.count, axis=1)
    assert len(reflectance_bands(visible, neutral, area, channels).reflectance) == 1


@pytest.mark.parametrize("open_site", [True, False])
def test_light_of_a_coloured_room_is_that_traced_for_each_channel(corner, open_site: bool) -> None:
    room, groups, shade, points = corner
    exterior, channels = Surfaces.none() if open_site else shade, channels_of(9)
    whole, spectra = sky(), coloured(room)
    system = [[optics(np.full(len(ANGLES), 0.7))]] * len(groups)

    def light(reflectance: np.ndarray):
        interior = replace(room, reflectance=reflectance[room.surface])
        matrices = traced(interior, exterior, groups, points, subdivision=1, window_parts=1)
        return phase_light(matrices, system, whole)

    visible = illuminant("D65") * sensitivities()[0]
    neutral = [[SpectralFactor.neutral()]] * len(groups)
    of_visible = light(spectra @ visible / visible.sum())
    wanted = [Detection(np.eye(channels.count))]
    found, grey = (
        spectral_light(of_visible, neutral, channels, wanted, reflectance=colour).received[0]
        for colour in (spectra, None)
    )
    means = channels.mean(spectra)
    for c in range(channels.count):
        one = light(means[:, c])
        true = spectral_light(one, neutral, channels, [Detection(np.eye(channels.count)[[c]])]).received[0][0]
        # 0.2, 0.2 and 1.1 %: standard deviation of the sensors over seeds, most of it shared
        for s, sigma in enumerate((0.002, 0.002, 0.011)):
            assert found[c][s] == pytest.approx(true[s], rel=4 * sigma), (c, s)
    assert np.abs(found / grey - 1).max() > 0.1


def test_windows_mirror_the_light_of_a_room_by_wavelength(corner) -> None:
    room, groups, _, points = corner
    channels, whole = channels_of(9), sky()
    mirrored = np.interp(NANOMETRES, [480.0, 600.0], [0.02, 0.6])  # red seen from the room
    weight = illuminant("D65") * sensitivities()[0]
    visible = float(mirrored @ weight / weight.sum())
    matrices = traced(room, Surfaces.none(), groups, points, subdivision=1, window_parts=1)
    neutral = SpectralFactor.neutral()
    red = replace(neutral, mirrored=mirrored)

    def light(share: float):
        return phase_light(matrices, [[optics(np.full(len(ANGLES), 0.4), share)]] * len(groups), whole)

    found, grey = (channel_irradiance(light(visible), [[one]] * len(groups), channels) for one in (red, neutral))
    for c, share in enumerate(channels.mean(mirrored)):
        true = channel_irradiance(light(share), [[neutral]] * len(groups), channels)[c]
        assert found[c] == pytest.approx(true, rel=3e-3), c  # bands leave out 1e-3 of each reflection
    assert np.abs(found / grey - 1).max() > 0.01
