"""What five-phase pictures show of the sun outdoors and reflected indoors, against paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.images.view import fisheye, pixel_directions
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.methods.point_in_time import path_picture
from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.sky.sun import direction
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.pixel_rows import Tiles, smoothing, surroundings
from tests.trace import rooms

pytestmark = [pytest.mark.early, pytest.mark.usefixtures("variant")]

GROUND, FACADE = 0.3, 0.6
SIZE = 240  # [px] tiles of four are 3 degrees wide
FINER = 2  # times as many pixels across in the judge's pictures
VIEW = fisheye((1.8, 1.0, 1.5), (0.0, -1.0, 0.0), SIZE)


def street() -> Surfaces:
    """Ground before the house and its wall, a facade across the street, a wall in the sun."""
    return rooms.surfaces(
        [
            (rooms.quad((-9, -9, -0.5), (12, -9, -0.5), (12, -0.2, -0.5), (-9, -0.2, -0.5)), GROUND),
            (rooms.quad((-9, -9, -0.5), (-9, -9, 4), (12, -9, 4), (12, -9, -0.5)), FACADE),
            (rooms.quad((-9, 0.02, -0.5), (12, 0.02, -0.5), (12, 0.02, 4), (-9, 0.02, 4)), 0.1),
            (rooms.quad((6, -9, -0.5), (6, -9, 3), (6, -1, 3), (6, -1, -0.5)), FACADE),
        ]
    )


def sky(hours=1):
    """A clear sky, the sun in the south-west."""
    sun = direction(np.radians(np.linspace(40, 55, hours)), np.radians(np.linspace(215, 230, hours)))
    return given_sky(sun, np.full(hours, 800.0), np.full(hours, 90.0), day_of_year=172)


def lights(hours=1, samples=8):
    """The same room by five phases and by paths, behind clear glass."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    scene = cfs.DaylightScene(room, street(), groups, view=VIEW)
    finer = replace(scene, view=replace(VIEW, width=FINER * SIZE, height=FINER * SIZE))
    glass = cfs.AngularOptics([0.0, 0.6, 0.6, 0.6, 0.6])
    phases = cfs.daylight(scene, [[glass]], sky(hours), needs=["DGP"])
    chosen = cfs.Sampling(picture_samples=samples)
    return phases, cfs.PathLight(finer, [[glass]], sky(hours), chosen)


def both(hours=1, samples=8):
    """Pictures [h, ny, nx] by five phases, and finer ones by paths, without the sun's disc."""
    phases, paths = lights(hours, samples)
    made = pictures_in_state(phases, np.arange(hours), [0])
    values = made.without_disc(np.arange(hours))[0]
    found = np.stack([full_picture(row, made.pixels, VIEW) for row in values])
    return found, np.stack([path_picture(paths, h, disc=False) for h in range(hours)])


def coarse(picture, of):
    """Pixels [h, ny, nx] from the finer ones: their mean or another figure."""
    return of(picture.reshape(-1, SIZE, FINER, SIZE, FINER), axis=(2, 4))


def brightest(picture):
    """The largest of the finer pixels in the 3 x 3 neighbourhood of each pixel."""
    largest = coarse(picture, np.max)
    moved = [np.roll(largest, (j, i), (1, 2)) for j in (-1, 0, 1) for i in (-1, 0, 1)]
    return np.max(moved, axis=0)


def shown(where) -> np.ndarray:
    """Pixels that show a part of the street through the window: `where(points [.., 3])`."""
    towards, counts = pixel_directions(VIEW)
    return counts & where(np.asarray(VIEW.position), towards)


def on_ground(eye, towards):
    """Sunlit ground well inside the window's opening."""
    down = towards[..., 2] < -0.05
    t = np.where(down, (-0.5 - eye[2]) / np.where(down, towards[..., 2], -1), 0)
    point = eye + towards * t[..., None]
    pane = eye + towards * (-eye[1] / np.minimum(towards[..., 1], -1e-6))[..., None]
    opening = (np.abs(pane[..., 0] - 1.8) < 1.2) & (pane[..., 2] > 1.05)
    return down & opening & (point[..., 1] > -6) & (point[..., 0] < 2) & (point[..., 0] > -5)


@pytest.mark.slow
def test_no_pixel_shines_above_what_paths_show():
    """Sun on the ground, on a wall, from both on a facade in the shade, and in the room."""
    found, paths = both(3, samples=32)
    # finer ones: a strip of sun narrower than a pixel is all of a pixel whose middle lies in it
    assert np.all(found <= 1.5 * brightest(paths))


def test_the_sun_on_the_ground_is_that_of_paths():
    """Its noise too, so that no pixel of it shines out."""
    found, paths = both()
    assert np.all((found <= 1.5 * brightest(paths))[:, shown(on_ground)])
    ground = shown(on_ground)
    assert np.count_nonzero(ground) > 100
    for ours, theirs in zip(found, coarse(paths, np.mean), strict=True):
        # paths: 72 in each pixel and the sun by its own ray; a pixel's mean is good to 1 %
        assert ours[ground].mean() == pytest.approx(theirs[ground].mean(), rel=0.01)
        assert ours[ground].std() < 1.2 * theirs[ground].std() + 0.02 * theirs[ground].mean()


def test_a_facade_in_the_shade_has_the_suns_light_from_the_ground():
    """Its own light is that of the sky and of what the sunlit ground sends to it."""
    found, paths = both()
    towards, _ = pixel_directions(VIEW)
    t = (-9 - VIEW.position[1]) / np.minimum(towards[..., 1], -1e-6)
    point = np.asarray(VIEW.position) + towards * t[..., None]
    facade = (np.abs(point[..., 0] - 0) < 4) & (point[..., 2] > 1.0) & (point[..., 2] < 3.5)
    pane = np.asarray(VIEW.position) - towards * (VIEW.position[1] / towards[..., 1])[..., None]
    facade &= (np.abs(pane[..., 0] - 1.8) < 1.2) & (towards[..., 1] < -0.1)
    assert np.count_nonzero(facade) > 40
    assert found[0][facade].mean() == pytest.approx(coarse(paths, np.mean)[0][facade].mean(), rel=0.03)


def test_the_beam_that_the_room_reflects_has_the_suns_own_angle():
    """Ev of pictures of the back wall, to which all light is reflected, against paths."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    view = fisheye((1.8, 4.0, 1.2), (0.0, 1.0, 0.0), 96)
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=view)
    steps = np.linspace(0, 1, 64)
    glass = cfs.AngularOptics(0.6 * (1 - (1 - steps) ** 5))
    sun = direction(np.radians([50.0, 70.0, 77.0]), np.radians([180.0, 180.0, 180.0]))
    sun = np.vstack([sun, direction(np.radians(30.0), np.radians(258.0))])  # 78 degrees aside
    hours = given_sky(sun, np.full(4, 900.0), np.full(4, 40.0), day_of_year=172)
    light = cfs.daylight(scene, [[glass]], hours, needs=["DGP"])
    paths = cfs.PathLight(scene, [[glass]], hours, cfs.Sampling(hour_samples=65_536))
    truth = cfs.eye_illuminance(paths)
    # the beam lies on ten to fifty of the elements, four places on each: 3 %
    assert cfs.hourly_glare(light).Ev == pytest.approx(truth, rel=0.05)
    pictures = pictures_in_state(light, np.arange(4), [0])
    assert pictures.without_disc(np.arange(4))[1] == [()] * 4


def test_smoothing_keeps_what_is_even_and_what_there_is():
    random = np.random.default_rng(4)
    tiles = Tiles(2, 40)
    row, column = np.divmod(np.arange(400), 20)
    shown = random.random(400) < 0.7  # holes, and tiles without neighbours
    face = (column > 11).astype(int)
    keys = tiles.key(column, row, face)[shown]
    order = np.argsort(keys)
    count = random.uniform(0.1, 4.0, len(keys))
    smooth = smoothing(surroundings(tiles, keys[order]), count)
    assert smooth @ np.ones(len(keys)) == pytest.approx(np.ones(len(keys)), abs=1e-12)
    assert count @ smooth == pytest.approx(count, rel=1e-3)
    noise = random.normal(size=len(keys))
    assert np.std(smooth @ noise) < 0.5 * np.std(noise)
    across = smooth[np.ix_(face[shown][order] == 0, face[shown][order] == 1)]
    assert abs(across).sum() == 0


def test_smoothing_is_the_product_of_its_balanced_steps():
    tiles, random = Tiles(2, 40), np.random.default_rng(6)
    row, column = np.divmod(np.flatnonzero(random.random(400) < 0.8), 20)
    keys = np.sort(tiles.key(column, row, 0))
    count, close = random.uniform(0.1, 4.0, len(keys)), random.random(len(keys)) < 0.2
    expected = np.eye(len(keys))
    for number, near in enumerate(one.toarray() for one in surroundings(tiles, keys)):
        if number:  # the tiles beside another surface stay as they are
            near[close], near[:, close] = 0.0, 0.0
            near[close, close] = 1.0
        x = np.ones(len(keys))
        for _ in range(1000):
            x = np.sqrt(x / (near @ (count * x)))
        weights = x[:, None] * near * x * count
        expected = weights / weights.sum(axis=1, keepdims=True) @ expected
    found = smoothing(surroundings(tiles, keys), count, close).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_a_face_is_what_one_surface_shows_in_one_direction():
    from mitsuba_cfs.trace.kernels.pixel_rows import FACE_STEPS, face_numbers
    from mitsuba_cfs.trace.kernels.scene import TracedScene

    random = np.random.default_rng(7)
    corners, surface = random.integers(-1, 2, (500, 3, 3)).astype(float), random.integers(0, 5, 500)
    tracer = TracedScene(Surfaces(corners, np.full(500, 0.5), surface), centre=np.zeros(3))
    number, normal = face_numbers(tracer), tracer.normal.numpy().T
    table = np.column_stack([tracer.surface.numpy(), np.round(normal * FACE_STEPS)])
    _, expected = np.unique(table, axis=0, return_inverse=True)
    np.testing.assert_array_equal(number, expected.reshape(-1))
    assert tracer.derived(face_numbers) is tracer.derived(face_numbers)


def test_the_matrices_of_a_view_are_found_again_with_their_elements(tmp_path):
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    view = fisheye(VIEW.position, VIEW.direction, 32)
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=view)
    cache = cfs.MatrixCache(tmp_path)
    first, again = (cfs.phase_matrices(scene, needs=["DGP"], cache=cache).view for _ in range(2))
    assert first is not again and len(list(tmp_path.rglob("view-*.npz"))) == 2
    random, shares = np.random.default_rng(0), first.sunlit.mean
    light = [random.random((part.shape[1], 3), np.float32) for part in (shares.share, shares.near)]
    np.testing.assert_array_equal(shares.rows(*light), again.sunlit.mean.rows(*light))
    np.testing.assert_array_equal(first.sunlit.mean.places.point, again.sunlit.mean.places.point)
    np.testing.assert_array_equal(first.indirect.rows, again.indirect.rows)
