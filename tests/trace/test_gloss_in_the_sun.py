"""Gloss in the sun: mirrors and rough facades in direct matrices and in pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.gloss import mirror
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.surfaces import Surfaces
from tests.trace.gloss_scenes import (
    EYE,
    IMAGE,
    POINTS,
    SUN,
    UP,
    black_room,
    clear,
    facade,
    hidden_sun,
    lit_by,
    lobe_irradiance,
    normal_illuminance,
    one_hour,
    traced,
)

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")


def test_the_sun_in_a_mirror_is_a_sun_to_the_direct_matrix():
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = black_room(None)[0], rooms.test_room()[1]
    scattered = np.full((145, 145), 0.1)
    beam = [KlemsScattering(KLEMS_FULL, scattered, np.full(145, 0.5))]

    def matrix(outdoors, sun):
        return direct_sun_matrix(room, outdoors, groups, beam, POINTS, UP, suns=sun[None]).values

    seen, alone = matrix(facade(mirror(0.8)), SUN), matrix(rooms.NOTHING, SUN * [1, -1, 1])
    assert alone.min() > 0
    np.testing.assert_allclose(seen, 0.8 * alone, rtol=2e-3)
    assert not matrix(rooms.NOTHING, SUN).any()
    assert not matrix(hidden_sun(mirror(0.8)), SUN).any()


def test_a_mirror_behind_the_windows_sends_them_no_sun():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.specular_paths import specular_sun_paths

    _, groups = rooms.test_room()
    for shift, ways in ((0.0, 2), (30.0, 1)):  # before the window, and behind the house
        there = facade(mirror(0.8))
        there = replace(there, triangles=there.triangles + np.array([0.0, shift, 0.0]))
        assert len(specular_sun_paths(TracedScene(there, groups, windows_block=False))) == ways


def windows_in_layers(normal: np.ndarray) -> np.ndarray:
    """Panes [T, 3, 3] with a normal in three layers, one of them with panes 3 cm apart in depth."""
    random = np.random.default_rng(8)
    x = np.cross(normal, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y, panes = np.cross(normal, x), []
    for depth in (-6.0, -5.97, 0.0, 9.0):
        for u, v in random.uniform(-20, 20, (6, 2)):
            corner = depth * normal + u * x + v * y
            panes.append(rooms.quad(corner, corner + x, corner + x + 1.5 * y, corner + 1.5 * y))
    return np.concatenate(panes)


def test_no_ray_that_meets_a_mirror_passes_by_its_map():
    import mitsuba as mi

    from mitsuba_cfs.trace.kernels.sampling import vectors
    from mitsuba_cfs.trace.kernels.scene import scene_of
    from mitsuba_cfs.trace.sun.mirror_map import MirrorMaps

    normal = np.array([0.6, 0.7, 0.2])
    normal /= np.linalg.norm(normal)
    panes, random = windows_in_layers(normal), np.random.default_rng(9)
    start, way = random.uniform(-25, 25, (200_000, 3)), random.normal(size=(200_000, 3))
    way[::4] -= (way[::4] @ normal)[:, None] * normal * 0.998  # nearly along the panes
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    shares = random.dirichlet(np.full(3, 0.3), 100_000)
    aims = np.einsum("ij,ijk->ik", shares, panes[random.integers(0, len(panes), 100_000)])
    start[::2] = aims - 5 * way[::2]
    ray = mi.Ray3f(vectors(start, mi.Point3f), vectors(way))
    meets = scene_of(panes).ray_test(ray).numpy()
    others = rooms.quad((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1))
    maps = MirrorMaps([others.reshape(-1, 3), panes.reshape(-1, 3)], np.stack([[0.0, 1.0, 0.0], normal]))
    plane = mi.UInt32(np.ones(len(way), dtype=np.uint32))
    may = maps.may_meet(ray.o, ray.d, plane, mi.Bool(True), mi.Float(1e-4)).numpy()
    assert meets[::4].mean() > 0.8 and not (meets & ~may).any()
    steep = np.abs(way @ normal) > 0.05
    assert (may & ~meets)[steep & (np.arange(len(way)) % 2 > 0)].mean() < 0.02


@pytest.mark.slow
def test_five_phases_have_the_sun_of_a_mirror_facade():
    """E in a room behind clear glass by five phases against paths, an even sky and the sun."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    outdoors = facade(mirror(0.8))
    scene = cfs.DaylightScene(room, outdoors, groups, POINTS, UP)
    sky = np.tile(np.where(np.arange(2306) == 0, 200.0, 2000.0)[:, None], (1, 1))
    system = cfs.AngularOptics(np.ones(64))
    traced_scene = cfs.phase_matrices(scene, cfs.Sampling(patch_samples=2**14, sensor_samples=2**15))
    annual = one_hour(sky, SUN, 50_000.0)
    found = cfs.illuminance(cfs.phase_light(traced_scene, [[system]], annual))[:, 0]
    paths = traced(outdoors, lit_by(sky[:, 0], SUN, 50_000.0 / SUN_SOLID_ANGLE), samples=2**16)
    error = 4 * paths.standard_error / paths.values
    assert np.all(np.abs(found / paths.values - 1) < 0.02 + error), (found, paths.values)


def test_a_picture_by_paths_shows_the_suns_disc_in_a_mirror():
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.trace.paths.scene import PathTracingScene
    from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

    sky = lit_by(np.zeros(146), SUN, 50_000.0 / SUN_SOLID_ANGLE)
    view = fisheye(EYE, (0.0, -1.0, 0.0), 32)
    for outdoors, expected in ((facade(mirror(0.8)), IMAGE), (hidden_sun(mirror(0.8)), 0.0)):
        lit = PathTracingScene(black_room(None)[0], outdoors, rooms.test_room()[1], [clear()])
        picture = point_in_time_picture(lit, sky, view, samples=4)
        assert normal_illuminance(picture, view) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("indoors", [False, True])
def test_a_five_phase_picture_shows_the_suns_disc_in_a_mirror(indoors):
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.sun.picture_sun import PictureSun

    room, floor = black_room(mirror(0.8))
    beam = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    eye, direction, sun = EYE, (0.0, -1.0, 0.0), SUN
    around = room, facade(mirror(0.8)), rooms.test_room()[1]
    if indoors:  # the floor shows the sun through the window
        sun = SUN * [1, -1, 1]
        around = floor, rooms.NOTHING, rooms.test_room()[1]
        eye, direction = (1.8, 3.0, 1.0), (0.0, -1.0, -1.0)
    view = fisheye(eye, direction, 64)
    shown = PictureSun(*around, [beam], view)
    values = np.zeros((1, len(shown.pixels)))
    lux = np.array([50_000.0])
    shown.add_to(values, sun[None], lux)
    assert not values.any()  # in the picture without discs
    (disc,) = shown.discs(sun[None], lux)[0]
    assert disc.luminance * disc.solid_angle == pytest.approx(IMAGE, rel=1e-4)
    assert disc.solid_angle == pytest.approx(SUN_SOLID_ANGLE, rel=1e-4)
    shown.add_disc(values, sun[None], lux)
    picture = np.zeros(view.height * view.width)
    picture[shown.pixels] = values[0]
    found = normal_illuminance(picture.reshape(view.height, view.width), view)
    assert found == pytest.approx(IMAGE, rel=0.02)  # pieces of the disc are counted whole


def test_the_sun_on_a_rough_facade_is_seen_through_the_window():
    """Pixels of a five-phase picture against the lobe itself, one sun and a black sky."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.pictures.outdoors import outdoors

    alpha, view = 0.2, fisheye(EYE, (0.0, -1.0, 0.0), 48)
    beam = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    around = black_room(None)[0], facade(mirror(0.6, alpha)), rooms.test_room()[1]
    seen = outdoors(*around, [beam], view, subdivision=1, samples=4)
    values = np.zeros((1, seen.sky.shape[0]))
    seen.rough.add_to(values, SUN[None], np.array([50_000.0]))
    from mitsuba_cfs.images.view import pixel_directions

    directions, counts = pixel_directions(view)
    way = directions.reshape(-1, 3)[np.flatnonzero(counts.reshape(-1))]
    half = SUN - way
    along, square = half[:, 1], (half**2).sum(axis=1)
    f = 0.6 * square * np.exp(-(square / along**2 - 1) / alpha**2) / (np.pi * alpha**2 * along**4)
    whole = np.isclose(values[0], f * SUN[1] * 50_000.0, rtol=0.03)
    lit = values[0] > 0.2 * values[0].max()
    assert lit.sum() > 20 and whole[lit].mean() > 0.8  # the others lie on the window's edges


@pytest.mark.parametrize("alpha", [0.05, 0.2])
def test_window_patches_have_the_sun_of_a_rough_facade_in_its_lobe(alpha):
    """Irradiance of the window by the patches' light, against the lobe's integral."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.reflected import outdoor_light, window_shares

    outside = TracedScene(facade(mirror(0.6, alpha)), rooms.test_room()[1])
    shares = window_shares(outside, samples=1024)
    suns = np.stack([SUN, -SUN])
    [found] = outdoor_light(shares, outside, suns, np.full(2, SUN_SOLID_ANGLE))
    irradiance = KLEMS_FULL.projected_solid_angles() @ found
    # the house itself hides the sun from what of the facade lies right before its window
    assert irradiance[0] == pytest.approx(lobe_irradiance(0.6, alpha), rel=0.02)
    assert irradiance[1] == 0


def test_the_sun_on_a_smooth_mirror_is_counted_by_its_image_alone():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, reflecting_points

    normals = np.tile(np.float32([0, -1, 0]), (4096, 1))
    for gloss, diffuse, expected in ((mirror(0.8), 0.0, 0.0), (mirror(0.5), 0.3, 0.3), (mirror(0.6, 0.1), 0.3, 0.9)):
        outside = TracedScene(facade(gloss, diffuse), rooms.test_room()[1])
        start = SurfacePoints(np.zeros((4096, 3), np.float32), normals)
        whole = reflecting_points(outside, start, 0, 1)
        some = reflecting_points(outside, start, 0, 1, mirrored=True)
        assert whole.weight.mean() == pytest.approx(gloss.at_normal + diffuse, rel=1e-3)
        assert some.weight.sum() / 4096 == pytest.approx(expected, rel=0.01)  # some pass the edge


def test_a_mirror_floor_absorbs_what_it_does_not_mirror():
    """In a black room: the floor keeps 0.6 of what meets it first, the others 0.4."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix

    black, floor = black_room(mirror(0.4))
    _, groups = rooms.test_room()
    options = {"samples": 512, "stopping": Stopping(batches=2)}
    dull, mirrored = (absorption_matrix(r, groups, **options).values[0] for r in (black, floor))
    np.testing.assert_allclose(mirrored[:, 0], 0.6 * dull[:, 0], rtol=1e-5)
    np.testing.assert_allclose(mirrored.sum(axis=1), 1.0, rtol=1e-5)
    assert mirrored[:, 1].sum() > dull[:, 1].sum()  # the ceiling has it


def street(own: float, opposite: float) -> tuple[Surfaces, np.ndarray]:
    """Mirrors above the window and opposite, and a sun that reaches the window by both alone."""
    wall = rooms.quad((-400, 0.01, 3.1), (400, 0.01, 3.1), (400, 0.01, 60), (-400, 0.01, 60))
    across = rooms.quad((-400, -10, -50), (400, -10, -50), (400, -10, 15), (-400, -10, 15))
    glosses = (mirror(own), mirror(opposite))
    numbers = np.array([0, 0, 1, 1])
    both = Surfaces(np.concatenate([wall, across]), np.zeros(4), numbers, (), glosses)
    return both, np.array([0.1, -1.0, 1.0]) / np.linalg.norm([0.1, -1.0, 1.0])


@pytest.mark.parametrize(("own", "opposite"), [(0.8, 0.8), (0.8, 0.5)], ids=["alike", "unlike"])
def test_the_sun_by_two_mirrors_lights_sensors(own, opposite):
    """The direct-sun matrix and paths: both reflectances times the sun without the street."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = black_room(None)[0], rooms.test_room()[1]
    outdoors, sun = street(own, opposite)
    beam = [KlemsScattering(KLEMS_FULL, np.full((145, 145), 0.1), np.full(145, 0.5))]

    def matrix(outdoors):
        return direct_sun_matrix(room, outdoors, groups, beam, POINTS, UP, suns=sun[None]).values

    alone = matrix(rooms.NOTHING)
    assert alone.min() > 0
    np.testing.assert_allclose(matrix(outdoors), own * opposite * alone, rtol=4e-3)
    sky = lit_by(np.zeros(146), sun, 50_000.0 / SUN_SOLID_ANGLE)
    some = POINTS[1:2], UP[1:2]  # in the patch of sun
    bare, found = (
        traced(o, sky, interior=room, samples=4096, points=some[0], normals=some[1]).values
        for o in (rooms.NOTHING, outdoors)
    )
    assert bare[0] > 1_000
    np.testing.assert_allclose(found, own * opposite * bare, rtol=0.02)


def test_a_picture_shows_the_sun_by_two_mirrors():
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.paths.disc import discs_seen
    from mitsuba_cfs.trace.paths.scene import PathTracingScene
    from mitsuba_cfs.trace.sun.picture_sun import PictureSun

    outdoors, sun = street(0.8, 0.5)
    room, groups = black_room(None)[0], rooms.test_room()[1]
    view = fisheye((1.8, 0.6, 1.4), (0.0, -1.0, 0.0), 64)
    beam = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    by_phases = PictureSun(room, outdoors, groups, [beam], view).discs(sun[None], np.ones(1))[0]
    sky = lit_by(np.zeros(146), sun, 1 / SUN_SOLID_ANGLE)
    by_paths = discs_seen(PathTracingScene(room, outdoors, groups, [clear()]), sky, view)
    for (disc,) in (by_phases, by_paths):
        assert disc.luminance * SUN_SOLID_ANGLE == pytest.approx(0.4, rel=1e-3)
        np.testing.assert_allclose(disc.direction, sun, atol=1e-3)


@pytest.mark.parametrize("method", ["five-phase", "point-in-time"])
def test_the_sun_in_a_mirror_is_a_glare_source_whatever_the_pixel(method):
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.methods.glare import rated_pictures
    from mitsuba_cfs.methods.light import daylight
    from mitsuba_cfs.methods.optics import AngularOptics
    from mitsuba_cfs.methods.scene import DaylightScene, Sampling
    from mitsuba_cfs.sky.annual import given_sky

    sky = given_sky(SUN[None], [800.0], [90.0], 1, day_of_year=172)
    few = Sampling(
        patch_samples=256,
        sun_points=16,
        view_samples=1,
        outdoor_samples=1,
        picture_samples=1,
        subdivision=1,
        window_parts=1,
    )
    room, groups = rooms.test_room()
    dgp = []
    for size in (40, 160):
        view = fisheye(EYE, (0.0, -1.0, 0.0), size)
        scene = DaylightScene(room, facade(mirror(0.1)), groups, POINTS[:1], UP[:1], view)
        light = daylight(scene, [[AngularOptics([0.0, 0.7, 0.7])]], sky, method=method, sampling=few)
        [(_, rated)] = rated_pictures(light, [0])
        assert rated.dgp > 0.35  # 0.25 without the sun's image
        dgp.append(rated.dgp)
    assert dgp[0] == pytest.approx(dgp[1], abs=0.01)
