"""Light that windows reflect outdoors and that what stands before them sends back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import normalize
from mitsuba_cfs.methods.coefficients import reflected_shares
from mitsuba_cfs.methods.light import daylight_coefficients, eye_illuminance, illuminance, illuminance_with_error
from mitsuba_cfs.methods.phase_light import illuminance_of_all, phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.reflected_sun import reflected_sun, replaced_before, replaced_luminance
from mitsuba_cfs.methods.window_reflection import by_way_of_outdoors, returned_from_outdoors
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import WindowGroup, WindowSurface

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
OMEGA = KLEMS_FULL.projected_solid_angles()


def small(name: str, centre, normal) -> WindowGroup:
    """An upright window of a decimetre."""
    side = 0.05 * np.cross([0.0, 0.0, 1.0], normal)
    up = np.array([0.0, 0.0, 0.05])
    middle = np.asarray(centre, dtype=float)
    corners = [middle + a * side + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return WindowGroup(name, (WindowSurface(name, rooms.quad(*corners)),))


def test_windows_that_face_each_other_see_what_leaves_towards_them() -> None:
    """The patches are those that a file names them by: aside, and one window above the other."""
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.adjacent import outdoor_exchange

    far = rooms.surfaces([(rooms.quad((0, 9, 9), (1, 9, 9), (1, 9, 8), (0, 9, 8)), 0.0)])
    places = np.array([[0.0, 0.0, 1.0], [1.0, -0.8, 1.6]])
    groups = [small("north", places[0], [0, -1, 0]), small("south", places[1], [0, 1, 0])]
    found = outdoor_exchange(far, groups, PathOptions(4096, 16)).values.reshape(2, K, 2, K)
    for here, there in ((0, 1), (1, 0)):
        way = normalize(places[there] - places[here])
        came, went = np.unravel_index(np.argmax(found[here, :, there]), (K, K))
        towards = groups[here].frame @ way
        left = groups[there].frame @ -way
        assert KLEMS_FULL.incident_directions()[came] @ towards > np.cos(np.radians(12))
        assert KLEMS_FULL.outgoing_directions(front=True)[went] @ left > np.cos(np.radians(12))
        # the other's share of the view by areas and distance, over that of all patches
        distance2 = ((places[there] - places[here]) ** 2).sum()
        share = 0.01 * towards[2] * left[2] / distance2 / np.pi
        seen = OMEGA @ found[here, :, there].sum(axis=1) / np.pi
        assert seen == pytest.approx(share, rel=0.15)
        assert not found[here, :, here].any()


def test_all_that_leaves_into_a_white_box_comes_back() -> None:
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.adjacent import outdoor_exchange

    box = rooms.surfaces(
        [
            (rooms.quad((-1, -2, 0), (3, -2, 0), (3, -2, 3), (-1, -2, 3)), 1.0),
            (rooms.quad((-1, -2, 0), (3, -2, 0), (3, 0, 0), (-1, 0, 0)), 1.0),
            (rooms.quad((-1, -2, 3), (3, -2, 3), (3, 0, 3), (-1, 0, 3)), 1.0),
            (rooms.quad((-1, -2, 0), (-1, 0, 0), (-1, 0, 3), (-1, -2, 3)), 1.0),
            (rooms.quad((3, -2, 0), (3, 0, 0), (3, 0, 3), (3, -2, 3)), 1.0),
        ]
    )
    pane = rooms.quad((-1, 0, 0), (3, 0, 0), (3, 0, 3), (-1, 0, 3))
    groups = [WindowGroup("front", (WindowSurface("front", pane),))]
    found = outdoor_exchange(box, groups, PathOptions(256, 64)).values
    assert found.sum(axis=2) == pytest.approx(1.0, abs=0.12)
    assert OMEGA @ found[0].sum(axis=1) / np.pi == pytest.approx(1.0, rel=0.01)


def mirroring(front: float, back: float = 0.0):
    """Glass of 0.6 that mirrors so much outdoors and into the room."""
    from mitsuba_cfs.bsdf.klems import KlemsBsdf
    from mitsuba_cfs.methods.optics import BsdfOptics

    through, outdoors, inwards = (np.diag(share / OMEGA) for share in (0.6, front, back))
    return BsdfOptics(KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, outdoors, inwards))


def between_fins():
    """A room, bright walls 1 m long to both sides of its window, and an eye."""
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.methods.scene import DaylightScene

    room, groups = rooms.test_room()
    corners = np.concatenate([w.triangles for w in groups[0].windows]).reshape(-1, 3)
    (x0, y, z0), (x1, _, z1) = corners.min(axis=0), corners.max(axis=0)
    fins = [
        (rooms.quad((x, y, z0), (x, y - 1, z0), (x, y - 1, z1 + 1), (x, y, z1 + 1)), 0.8)
        for x in (x0 - 0.02, x1 + 0.02)
    ]
    points = np.array([[1.8, 1.0, 0.8], [0.8, 2.5, 0.8]])
    view = fisheye((1.8, 2.0, 1.2), (0.0, -1.0, 0.0), 30)
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    return DaylightScene(room, rooms.surfaces(fins), groups, points, up, view)


def hours(subdivision: int) -> AnnualSky:
    """Two hours: the sun aside, and a sky without."""
    sky, sun = ReinhartSky(subdivision), np.array([[0.6, -0.6, 0.53], [0.0, -0.8, 0.6]])
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    whole = np.full((sky.size, 2), 3000.0)
    alone = np.zeros_like(whole)
    stands = sky.index(sun[:1])[0]
    alone[stands, 0] = 5e4 / sky.solid_angles[stands]
    return AnnualSky(whole + alone, sun, np.array([5e4, 0.0]), np.arange(2), 8760, sun=alone)


def by_phases(scene, front: float, *, five_phase: bool, subdivision: int = 1):
    """The light of the hours behind panes that mirror so much outdoors."""
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=16_384, patch_samples=8_192, subdivision=subdivision)
    traced = phase_matrices(scene, few, five_phase=five_phase)
    return phase_light(traced, [[mirroring(front)]], hours(subdivision))


@pytest.mark.parametrize("five_phase", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_panes_light_the_fins_beside_them_in_sensors_and_pictures(five_phase) -> None:
    """What the eye gains is what its picture gains; the daylight coefficients have it too."""
    from mitsuba_cfs.glare.annual import full_picture
    from mitsuba_cfs.glare.evaluation import evaluate

    scene = between_fins()
    gains = []
    for front in (0.0, 0.4):
        light = by_phases(scene, front, five_phase=five_phase)
        shown = pictures_in_state(light, np.arange(2), [0])
        pictures = [full_picture(p, shown.pixels, scene.view) for p in shown.values(np.arange(2))]
        seen = [evaluate(p, scene.view).Ev for p in pictures]
        gains.append((illuminance(light), eye_illuminance(light), np.array(seen)))
        if not five_phase:
            factor = daylight_coefficients(light) @ light.sky.whole
            np.testing.assert_allclose(factor, illuminance(light), rtol=1e-5)
    inside, eye, picture = (more - bare for bare, more in zip(*gains, strict=True))
    assert (inside / gains[0][0]).min() > 0.01
    np.testing.assert_allclose(picture, eye, rtol=0.1)


def test_the_sun_on_the_fins_comes_to_panes_hour_by_hour_as_in_their_sum() -> None:
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=256, patch_samples=256, subdivision=1, window_parts=1)
    traced = phase_matrices(replace(between_fins(), view=None), few)
    sun = reflected_sun(traced, hours(1))
    found = replaced_before(sun, np.eye(K), np.array([1, 0]))
    assert found[:, 1].max() > 100 and not found[:, 0].any()
    every = np.array([True, True])
    on_patches = sun.sky.totals(every)[1][:, None]
    whole = replaced_luminance(sun, every[:, None], on_patches)
    np.testing.assert_allclose(found.sum(axis=1), whole.ravel(), rtol=1e-4, atol=0.1)


def test_an_hour_alone_is_what_it_is_among_others() -> None:
    """What windows send out and get back goes from hours on; that of sensors, from these on."""
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=256, patch_samples=256, subdivision=1, window_parts=2, view_samples=1)
    light = phase_light(phase_matrices(between_fins(), few), [[mirroring(0.4)]], hours(1))
    every = np.arange(2)
    whole = pictures_in_state(light, every, [0]).values(every)
    for some in ([1], [0], [1, 0]):
        hour = pictures_in_state(light, np.array(some), [0])
        found = hour.values(np.arange(len(some)))
        np.testing.assert_allclose(found, whole[some], rtol=1e-4, atol=1e-3 * whole.mean())
    optics, sky = light.optics([0]), np.random.default_rng(0).random((2 * K, 3))
    exchange = light.matrices.outdoor_exchange.values
    shares = reflected_shares(light.matrices, optics).before
    expected = by_way_of_outdoors(exchange, optics, shares) @ sky
    assert expected.min() > 0
    returned = returned_from_outdoors(exchange, optics, sky)
    np.testing.assert_allclose(shares @ returned, expected, rtol=1e-9)


def test_the_reflection_in_windows_is_computed_once_for_a_state(monkeypatch) -> None:
    """For the hours, their error, the daylight factor and the eye, of all sensors or of one."""
    from mitsuba_cfs.methods import coefficients
    from mitsuba_cfs.methods.light import daylight_coefficients, eye_illuminance, illuminance_with_error
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=256, patch_samples=256, subdivision=1, window_parts=2)
    light = phase_light(phase_matrices(between_fins(), few), [[mirroring(0.4, 0.1)]], hours(1))
    calls, reflection = [], coefficients.sensor_reflection

    def counted(*inputs):
        calls.append(inputs)
        return reflection(*inputs)

    monkeypatch.setattr(coefficients, "sensor_reflection", counted)
    lit, _ = illuminance_with_error(light)
    daylight_coefficients(light)
    eye = eye_illuminance(light)
    assert len(calls) == 1
    whole = illuminance_of_all(light, None)
    np.testing.assert_allclose(whole, np.concatenate([lit, eye[None]]), rtol=1e-5)


def test_each_hour_has_the_reflection_of_its_own_state() -> None:
    """Among hours of other states as with its system alone."""
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=256, patch_samples=256, subdivision=1, window_parts=2)
    states = [mirroring(0.4, 0.1), mirroring(0.0, 0.4)]
    traced = phase_matrices(replace(between_fins(), view=None), few)
    sky = hours(1).part([0, 1, 1, 0])
    alone = [illuminance(phase_light(traced, [[one]], sky)) for one in states]
    light = phase_light(traced, [states], sky)
    assert np.abs(alone[0] / alone[1] - 1).min() > 0.003
    for chosen in ([0, 1, 0, 1], [1, 1, 0, 1], [1, 1, 1, 1]):
        expected = np.stack([alone[j][:, h] for h, j in enumerate(chosen)], axis=1)
        np.testing.assert_allclose(illuminance(light, np.array(chosen)), expected, rtol=1e-9)


def test_totals_of_some_hours_are_theirs_whatever_was_asked_for_before() -> None:
    sky = hours(1)
    for some in ([True, True], [True, False], [True, True], [False, True]):
        whole, sun, rest = sky.totals(np.array(some))
        np.testing.assert_allclose(whole, sky.whole[:, some].sum(axis=1))
        np.testing.assert_allclose(sun, sky.sun[:, some].sum(axis=1))
        np.testing.assert_allclose(rest, whole - sun, rtol=1e-9)


@pytest.mark.parametrize("shares", [(0.4, 0.0), (0.0, 0.4)], ids=["outdoors", "room"])
def test_the_stated_error_has_the_noise_of_what_windows_send_one_another(shares) -> None:
    """All else is that of one seed; the spread over 24 seeds by chi-square, one time in 1,000."""
    from mitsuba_cfs.methods.scene import Sampling

    scene, seeds = replace(between_fins(), view=None), 24
    few = Sampling(sensor_samples=8192, patch_samples=512, subdivision=1, window_parts=1)
    first = phase_matrices(scene, few, five_phase=False)

    def light(seed: int, *mirrors: float):
        traced = replace(first, sampling=replace(few, seed=seed))
        return phase_light(traced, [[mirroring(*mirrors)]], hours(1))

    runs = [light(seed, *shares) for seed in range(seeds)]
    found = np.stack([illuminance(run).mean(axis=1) for run in runs])
    said = np.stack([illuminance_with_error(run)[1] for run in runs]) * found
    black = light(0, 0.0)
    others = illuminance_with_error(black)[1] * illuminance(black).mean(axis=1)
    expected = (said**2).mean(axis=0) - others**2
    spread = (seeds - 1) * found.var(axis=0, ddof=1) / expected
    low, high = stats.chi2.ppf([0.0005, 0.9995], seeds - 1)
    print(spread / (seeds - 1), np.sqrt(expected) / found.mean(axis=0))
    assert np.all((low < spread) & (spread < high))


@pytest.mark.slow
def test_panes_light_the_fins_beside_them_as_paths_have_it() -> None:
    """The gain of two sensors; the sun's mirror image is as wide as a window patch, 15 degrees."""
    from mitsuba_cfs.methods.scene import Sampling

    scene = replace(between_fins(), view=None)
    few, found = Sampling(hour_samples=524_288, subdivision=4), {}
    for front in (0.0, 0.4):
        paths = PathLight(scene, [[mirroring(front)]], hours(4), few)
        phases = by_phases(scene, front, five_phase=True, subdivision=4)
        found[front] = illuminance(paths), illuminance(phases)
    by_paths, by_five = (found[0.4][i] - found[0.0][i] for i in (0, 1))
    print("gain", by_paths / found[0.0][0], by_five / found[0.0][1])
    assert (by_paths / found[0.0][0]).min() > 0.015
    np.testing.assert_allclose(by_five[:, 1], by_paths[:, 1], rtol=0.1)
    np.testing.assert_allclose(by_five[:, 0], by_paths[:, 0], rtol=0.3)
