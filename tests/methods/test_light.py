"""Light and matrices as values: what another eye or other outdoors share, and wrong calls."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.glare import glare_with, hourly_glare, pictures, rated_pictures
from mitsuba_cfs.methods.light import (
    SeasonalLight,
    daylight,
    eye_illuminance,
    illuminance,
    illuminance_with_error,
    illuminance_with_noise,
    illuminance_with_systems,
    with_view,
)
from mitsuba_cfs.methods.optics import AngularOptics, BsdfOptics
from mitsuba_cfs.methods.phase_matrices import phase_matrices, with_outdoors
from mitsuba_cfs.methods.reflected_sun import reflected_sun
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.sun_by_patches import sunny_hour_dgp_error, sunny_hour_error
from mitsuba_cfs.sky.annual import given_sky
from scenes.demo import VENETIAN_BLIND
from tests.trace import rooms

pytestmark = pytest.mark.usefixtures("variant")

FEW = Sampling(
    sensor_samples=64,
    patch_samples=64,
    sun_points=16,
    view_samples=1,
    outdoor_samples=1,
    hour_samples=16,
    picture_samples=1,
    subdivision=1,
    window_parts=1,
)
SKY = given_sky([[0.0, -0.8, 0.6]], [800.0], [90.0], 1, day_of_year=172)
VIEW = fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), 24)
POINTS, UP = np.array([[1.8, 1.0, 0.8], [1.8, 3.0, 0.8]]), np.tile([0.0, 0.0, 1.0], (2, 1))


def scene(view=VIEW) -> DaylightScene:
    room, groups = rooms.test_room()
    return DaylightScene(room, rooms.obstruction(), groups, POINTS, UP, view)


def glass() -> list[list[AngularOptics]]:
    return [[AngularOptics([0.0, 0.7, 0.7])]]


@pytest.mark.parametrize("method", ["three-phase", "five-phase", "point-in-time"])
def test_without_a_view_the_eye_and_its_glare_are_refused(method) -> None:
    """The last sensor's illuminance was given for the eye's."""
    light = daylight(scene(view=None), glass(), SKY, method=method, sampling=FEW)
    assert illuminance(light).shape == (2, 1)
    calls = (
        eye_illuminance,
        hourly_glare,
        lambda one: hourly_glare(one, "sDGP"),
        lambda one: hourly_glare(one, "eDGP"),
        lambda one: pictures(one, [0]),
        lambda one: rated_pictures(one, [0]),
    )
    for call in calls:
        with pytest.raises(ValueError, match="no view"):
            call(light)


def test_paths_of_an_eye_have_a_quarter_of_a_sensors_noise() -> None:
    """With as few paths as a sensor, the DGP of an hour by its illuminance was up to 13 % too high."""
    at_eye = replace(scene(), points=np.atleast_2d(VIEW.position), normals=np.atleast_2d(VIEW.direction))
    by_eye, by_sensor = [], []
    for seed in range(16):
        paths = replace(FEW, hour_samples=256, seed=seed)
        light = daylight(at_eye, glass(), SKY, method="point-in-time", sampling=paths)
        by_eye.append(eye_illuminance(light)[0])
        by_sensor.append(illuminance(light)[0, 0])
    noise = np.std(by_eye, ddof=1), np.std(by_sensor, ddof=1)
    assert np.mean(by_eye) == pytest.approx(np.mean(by_sensor), abs=3 * noise[1] / 4)
    assert noise[0] < 0.5 * noise[1]


def test_another_eye_shares_what_depends_on_the_windows_alone() -> None:
    light = daylight(scene(), glass(), SKY, sampling=FEW)
    other = with_view(light, replace(VIEW, position=(1.0, 3.0, 1.2)))
    assert other.matrices.daylight is light.matrices.daylight
    assert other.matrices.sensors is None and light.matrices.sensors is not None
    eyes = eye_illuminance(light), eye_illuminance(other)
    assert eyes[0] != pytest.approx(eyes[1], rel=0.01)
    alone = daylight(other.scene, glass(), SKY, sampling=FEW)
    np.testing.assert_array_equal(eyes[1], eye_illuminance(alone))
    with pytest.raises(FrozenInstanceError):
        light.sky = SKY


def test_other_outdoors_share_what_is_indoors() -> None:
    matrices = phase_matrices(scene(), FEW)
    free = replace(scene(), exterior=rooms.NOTHING)
    other = with_outdoors(matrices, free)
    assert other.sensors is matrices.sensors and other.parts is matrices.parts
    assert other.daylight.values.sum() > 1.05 * matrices.daylight.values.sum()
    np.testing.assert_array_equal(other.daylight.values, phase_matrices(free, FEW).daylight.values)


def test_what_is_not_needed_is_not_traced_and_comes_out_the_same_later() -> None:
    bare = daylight(scene(), glass(), SKY, sampling=FEW, needs=())
    assert bare.matrices.sensors is None and bare.matrices.view is None and bare.sensors is None
    whole = daylight(scene(), glass(), SKY, sampling=FEW, needs=("illuminance", "DGP"))
    assert whole.matrices.view is not None
    for one, other in zip(illuminance_with_error(bare), illuminance_with_error(whole), strict=True):
        np.testing.assert_array_equal(one, other)
    # the view's paths carry the hour's luminance, in float32, in place of a column for each patch
    assert hourly_glare(bare).dgp == pytest.approx(hourly_glare(whole).dgp, abs=1e-6)


def test_three_phases_say_how_far_their_blurred_sun_is_off() -> None:
    light, sharp = (
        daylight(scene(view=None), glass(), SKY, method=method, sampling=FEW)
        for method in ("three-phase", "five-phase")
    )
    blurred, at_sun = illuminance(light), illuminance(sharp)
    expected = np.abs(blurred - at_sun)[:, 0] / blurred[:, 0]
    assert expected.max() > 0.2  # a spot of sun lies or does not lie on the sensor
    np.testing.assert_allclose(sunny_hour_error(light, None, blurred), expected, rtol=1e-6)
    assert not sunny_hour_error(sharp, None, at_sun).any()


def test_three_phases_say_how_far_their_dgp_is_off() -> None:
    light, sharp = (
        daylight(scene(), glass(), SKY, method=method, sampling=FEW) for method in ("three-phase", "five-phase")
    )
    blurred, at_sun = (hourly_glare(one).dgp for one in (light, sharp))
    off = abs(blurred - at_sun)[0]
    assert off > 0.01
    assert sunny_hour_dgp_error(light, blurred) == pytest.approx(off, rel=1e-6)
    assert sunny_hour_dgp_error(sharp, at_sun) == 0.0


@pytest.mark.parametrize("method", ["three-phase", "five-phase", "point-in-time"])
def test_the_noise_of_all_hours_is_the_error_of_their_mean(method) -> None:
    days = given_sky(
        [[0.0, -0.8, 0.6], [0.6, -0.5, 0.62], [0.0, -0.6, 0.8]],
        [800.0, 300.0, 0.0],
        [90.0, 120.0, 60.0],
        1,
        day_of_year=172,
    )
    light = daylight(scene(), glass(), days, method=method, sampling=FEW)
    lux, noise = illuminance_with_noise(light)
    whole = noise(np.ones_like(lux)).standard_error()
    np.testing.assert_allclose(whole, noise(None).standard_error(), rtol=1e-4)
    first, second = (noise(np.tile(one, (2, 1))).standard_error() for one in np.eye(3)[:2])
    assert np.all(first > 0) and not np.allclose(first, second)
    if method == "point-in-time":
        return
    seasons = SeasonalLight((light,), days, np.zeros(3, dtype=np.int64))
    of_seasons = illuminance_with_noise(seasons)[1](np.ones_like(lux))
    np.testing.assert_allclose(of_seasons.standard_error(), whole, rtol=1e-6)


def test_each_hour_of_path_tracing_has_the_error_of_its_spread_over_seeds() -> None:
    days = given_sky([[0.0, -0.8, 0.6], [0.0, -0.6, 0.8]], [800.0, 0.0], [90.0, 60.0], 1, day_of_year=172)
    values, stated = [], []
    for seed in range(60):
        sampling = replace(FEW, seed=seed)
        light = daylight(scene(), glass(), days, method="point-in-time", sampling=sampling)
        lux, noise = illuminance_with_noise(light)
        values.append(lux[0])
        stated.append([noise(np.tile(hour, (2, 1))).standard_error()[0] for hour in np.eye(2)])
    spread = np.std(values, axis=0, ddof=1) / np.mean(values, axis=0)
    assert not 0.6 < spread[0] / spread[1] < 1.7  # so one relative error of both would be wrong
    root = np.sqrt(np.mean(np.square(stated), axis=0)) / np.mean(values, axis=0)
    # Student's factor of 15 degrees of freedom is 1.06; 60 seeds tell a spread to 9 %
    np.testing.assert_allclose(root / spread, 1.06, rtol=0.3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sensor_samples", -1),
        ("patch_samples", 0),
        ("subdivision", 0),
        ("seed", -1),
        ("window_parts", -2),
        ("memory", -1.0),
    ],
)
def test_a_sampling_that_cannot_be_is_refused(name, value) -> None:
    with pytest.raises(ValueError, match=name):
        Sampling(**{name: value})


@pytest.mark.parametrize("state", [-1, 2])
def test_a_state_that_no_group_has_is_refused(state) -> None:
    light = daylight(scene(), [[*glass()[0], AngularOptics([0.0, 0.1])]], SKY, sampling=FEW)
    for call in (illuminance, eye_illuminance, hourly_glare):
        with pytest.raises(ValueError, match=f"state {state}: expected 0 to 1"):
            call(light, state=np.array([state]))


def test_hours_and_systems_that_cannot_be_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"systems\[0\]: expected a list of states"):
        daylight(scene(), glass()[0], SKY, sampling=FEW)
    with pytest.raises(ValueError, match=r"systems\[0\]"):
        daylight(scene(), [[]], SKY, sampling=FEW, method="point-in-time")
    with pytest.raises(ValueError, match="points and normals: expected finite"):
        replace(scene(), points=POINTS * np.nan)
    light = daylight(scene(), glass(), SKY, sampling=FEW)
    for call in (pictures, rated_pictures):
        with pytest.raises(ValueError, match="hours: expected numbers from 0 to 0"):
            call(light, [1])
    with pytest.raises(ValueError, match="hours: expected numbers"):
        hourly_glare(light, hours=[-1])


def test_optics_go_to_another_process_after_their_use() -> None:
    leaves = TensorTree(4, np.ones(16, dtype=np.int64), np.full(16, 0.1))
    tree = BsdfOptics(TensorTreeBsdf(transmission_front=leaves, transmission_back=leaves))
    known = BsdfOptics(read_bsdf_xml(VENETIAN_BLIND).band("Visible")), glass()[0][0], tree
    for optics in known:
        _ = optics.paths, optics.scattering
        again = pickle.loads(pickle.dumps(optics))
        np.testing.assert_array_equal(again.transmission, optics.transmission)


def test_states_of_all_hours_are_those_of_the_lit_hours() -> None:
    sky = replace(SKY, hours=8760, lit=np.array([4001]))
    light = daylight(scene(), [[*glass()[0], AngularOptics([0.0, 0.1])]], sky, sampling=FEW)
    year = np.arange(sky.hours) % 2
    dim = illuminance(light, year)
    np.testing.assert_array_equal(dim, illuminance(light, year[sky.lit]))
    assert (dim < illuminance(light)).all()
    with pytest.raises(ValueError, match="whole numbers"):
        illuminance(light, np.full(len(sky.lit), np.nan))
    with pytest.raises(ValueError, match="of the year"):
        illuminance(light, np.zeros(sky.hours + 1, dtype=int))


def test_other_systems_take_the_reflected_sun_of_the_light(monkeypatch) -> None:
    """It depends on the outdoors alone, and was traced again for each system."""
    sky = given_sky(
        [[0.0, -0.8, 0.6], [0.3, -0.7, 0.6], [0.0, 0.6, 0.8]], [800.0, 0.0, 800.0], [90.0] * 3, 1, day_of_year=172
    )
    light = daylight(scene(), glass(), sky, sampling=FEW)
    hours, other = np.array([0, 1, 2]), [[AngularOptics([0.0, 0.4, 0.4])]]
    expected = illuminance(daylight(light.scene, other, sky, sampling=FEW))
    traced = reflected_sun(light.matrices, sky.part(hours[1:]))
    part = light.reflected.part(hours[1:])
    np.testing.assert_array_equal(part.shining, traced.shining)
    assert part.shining.tolist() == [1] and part.before[0].any()
    np.testing.assert_array_equal(part.before, traced.before)
    monkeypatch.setattr("mitsuba_cfs.methods.phase_light.reflected_sun", None)
    lit = illuminance_with_systems(light, other, hours[1:])
    np.testing.assert_allclose(lit, expected[:, hours[1:]], rtol=1e-7)


def test_other_systems_keep_each_hours_state() -> None:
    sky = given_sky([[0.0, -0.8, 0.6], [0.3, -0.7, 0.6]], [800.0] * 2, [90.0] * 2, 1, day_of_year=172)
    one, other = (
        [[AngularOptics([0.0, first, first]), AngularOptics([0.0, second, second])]]
        for first, second in ((0.7, 0.3), (0.5, 0.1))
    )
    light, changed = (daylight(scene(), each, sky, sampling=FEW) for each in (one, other))
    state, hours = np.array([[0, 1]]), np.array([1])
    lit = illuminance_with_systems(light, other, hours, state)
    np.testing.assert_allclose(lit, illuminance(changed, state)[:, hours], rtol=1e-6)
    dgp, eye = glare_with(light, other, hours, state=state)
    expected = hourly_glare(changed, "DGP", state, hours=hours)
    assert (dgp, eye) == (pytest.approx(expected.dgp), pytest.approx(expected.Ev))
