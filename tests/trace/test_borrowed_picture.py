"""Pictures through glass between rooms: closed forms, and Mitsuba's path tracer in all rooms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.kernels.sampling import spread_rays
from mitsuba_cfs.trace.kernels.scattering import AngularScattering
from tests.validation import inner_glass
from tests.validation.inner_glass import GLASS, INNER_TAU, TAU, WINDOW, walls_at

pytestmark = pytest.mark.usefixtures("variant")

FEW = Sampling(sensor_samples=256, patch_samples=512, view_samples=4, outdoor_samples=4, subdivision=1)
# [cd/m2] mean over the glass by `path`, 4,096 rays of each pixel, standard error 0.1 %:
# `test_the_glass_shows_what_paths_show`
BY_PATH = 320.7


def _view(rooms: int) -> View:
    """From 0.8 m before the last room's back wall through all windows, 30 pixels in 55 degrees."""
    eye = (2.2, walls_at(rooms)[-1] - 0.8, 1.6)
    return View("perspective", eye, (0.0, -1.0, 0.0), (0, 0, 1), 55, 55, 30, 30)


def _black(scene: DaylightScene) -> DaylightScene:
    """The same rooms, which reflect nothing."""
    dark = replace(scene.interior, reflectance=0 * scene.interior.reflectance)
    beyond = tuple(replace(one, scene=_black(one.scene)) for one in scene.adjacent)
    return replace(scene, interior=dark, adjacent=beyond)


def _picture(scene: DaylightScene, view: View, sky: AnnualSky, **options: bool) -> NDArray:
    """Luminance [ny, nx] of the last room under the first hour of a sky."""
    traced = phase_matrices(replace(scene, view=view), FEW, **options)
    dark = AngularScattering(np.zeros(2), np.zeros(2))  # the sun comes by patches
    given = MatrixOptics(INNER_TAU * np.eye(KLEMS_FULL.size), dark)
    made = pictures_in_state(phase_light(traced, [[given]], sky), np.arange(1), [0])
    picture = np.zeros(view.width * view.height)
    picture[made.pixels] = made.values(np.arange(1))[0]
    return picture.reshape(view.height, view.width)


def _within(view: View, rooms: int) -> NDArray[np.float64]:
    """How far inside each opening the ray of a pixel's middle passes [ny, nx, rooms] [m]."""
    way, _ = pixel_directions(view)
    found = []
    for number, y in enumerate(walls_at(rooms)[:-1]):
        far = (y - view.position[1]) / np.minimum(way[..., 1], -1e-9)
        x, z = (view.position[k] + far * way[..., k] for k in (0, 2))
        (x0, x1), (z0, z1) = GLASS if number else WINDOW
        found.append(np.minimum.reduce([x - x0, x1 - x, z - z0, z1 - z]))
    return np.stack(found, axis=-1)


@pytest.mark.parametrize(("rooms", "five_phase"), [(2, False), (3, True)])
def test_black_rooms_show_the_sky_in_the_window_beyond_and_nothing_else(rooms: int, *, five_phase: bool) -> None:
    """Even sky, black ground: the panes' transmittances above the horizon in the window, else 0."""
    even = inner_glass.overcast()
    even = replace(even, whole=np.where(np.arange(len(even.whole))[:, None] > 0, 1000.0, 0.0))
    view = _view(rooms)
    found = _picture(_black(inner_glass.scene(rooms)), view, even, five_phase=five_phase)
    far = view.position[1] - np.array(walls_at(rooms)[:-1])
    half = 1.1 * far * np.tan(np.radians(55 / 2)) / view.width  # of a pixel there [m]
    within = _within(view, rooms)  # pixels that show no edge of any opening
    above = pixel_directions(view)[0][..., 2] > 0  # the horizon lies between two rows of pixels
    window, outside = (within > half).all(axis=-1), (within < -half).any(axis=-1)
    shown, outside = window & above, outside | (window & ~above)
    assert shown.sum() >= 3
    assert (window & ~above).sum() >= 3
    expected = 1000.0 * TAU * INNER_TAU ** (rooms - 1)
    np.testing.assert_allclose(found[shown], expected, rtol=1e-3)
    np.testing.assert_allclose(found[outside], 0.0, atol=1e-3 * expected)


def test_the_glass_shows_as_much_as_stored_paths() -> None:
    """With what the room beyond reflects; noise of few samples 1 %."""
    view = _view(2)
    found = _picture(inner_glass.scene(2), view, inner_glass.overcast(), five_phase=False)
    glass = _within(view, 2)[..., 1] > 0.3
    assert found[glass].mean() == pytest.approx(BY_PATH, rel=0.03)


@pytest.mark.slow
def test_the_glass_shows_what_paths_show() -> None:
    view = _view(2)
    glass = _within(view, 2)[..., 1] > 0.3
    ways, _ = spread_rays(view, np.flatnonzero(glass), 64)
    rooms = inner_glass.whole_rooms(2)
    paths = inner_glass.luminance_by_path(*rooms, view.position, ways, 64)
    print(paths.mean())
    assert paths.mean() == pytest.approx(BY_PATH, rel=0.02)
    found = _picture(inner_glass.scene(2), view, inner_glass.overcast(), five_phase=False)[glass]
    assert found.mean() == pytest.approx(paths.mean(), rel=0.03)
