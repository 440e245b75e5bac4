"""The sun that surfaces reflect to windows and sensors, by shadow rays from shared places."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import direct_sun, illuminance, illuminance_with_error
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface

from . import rooms
from .test_subdivision import clear_glass, overhang

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
LUX = 80_000.0


def towards(altitude_deg: float, azimuth_deg: float) -> np.ndarray:
    """The sun [3]; azimuth from south to east."""
    a, z = np.radians(altitude_deg), np.radians(azimuth_deg)
    return np.array([np.cos(a) * np.sin(z), -np.cos(a) * np.cos(z), np.sin(a)])


def sun_alone(direction: np.ndarray) -> AnnualSky:
    """One hour of a black sky with the sun."""
    sky = ReinhartSky(1)
    patches = np.zeros((sky.size, 1))
    nearest = 1 + int(np.argmax(sky.directions[1:] @ direction))
    patches[nearest] = LUX / sky.solid_angles[nearest]
    return AnnualSky(patches, direction[None], np.array([LUX]), np.arange(1), 1, patches)


def scene(exterior: Surfaces):
    from mitsuba_cfs.methods.scene import DaylightScene

    interior, groups = rooms.test_room()
    points = np.array([[1.8, y, 0.8] for y in (0.5, 1.5, 4.0)])
    return DaylightScene(interior, exterior, groups, points, np.tile([0.0, 0.0, 1.0], (3, 1)))


def both(exterior: Surfaces, sky: AnnualSky, sensor_samples: int = 32_768):
    """Five phases without the direct sun, the same by paths, and the error of these [S]."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.scene import Sampling

    system = [[BsdfOptics(clear_glass())]]
    chosen = Sampling(sensor_samples=sensor_samples, patch_samples=4096, subdivision=1, hour_samples=65_536)
    light = phase_light(phase_matrices(scene(exterior), chosen), system, sky)
    paths, error = illuminance_with_error(PathLight(scene(exterior), system, sky, chosen))
    direct = direct_sun(light)[:, 0]
    return illuminance(light)[:, 0] - direct, paths[:, 0] - direct, error * paths[:, 0]


def agrees(found, expected, error) -> None:
    """Within three standard errors of the paths, and of five phases: 3 % and 3 lx of 80,000."""
    noise = np.sqrt(error**2 + (0.03 * expected) ** 2 + 3.0**2)
    assert np.all(np.abs(found - expected) < 3 * noise), found / expected


def test_a_wide_wall_in_the_sun_has_the_same_luminance_in_all_patches():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.reflected import outdoor_light, window_shares

    far = rooms.quad((-1e3, -4, -1e3), (1e3, -4, -1e3), (1e3, -4, 1e3), (-1e3, -4, 1e3))
    outside = TracedScene(rooms.surfaces([(far, 0.4)]), rooms.test_room()[1])
    suns = np.array([towards(30, 180), towards(60, 150), towards(30, 0)])  # the last behind it
    [found] = outdoor_light(window_shares(outside, samples=64), outside, suns, np.full(3, LUX))
    expected = 0.4 / np.pi * LUX * np.maximum(suns[:, 1], 0)
    off = found.reshape(K, 3) - expected
    # the window hides the sun from as much of the wall as it is large itself
    steep = KLEMS_FULL.centres()[0] < np.radians(80)
    assert np.all(np.abs(np.median(off[steep], axis=0)) < 1e-4 * LUX)
    assert np.all(off[steep] < 1e-4 * LUX)
    assert np.all(off[steep].mean(axis=0) > -0.06 * expected.max())
    assert np.all(found.reshape(K, 3)[:, 2] == 0)


def test_each_place_stands_for_those_of_its_own_face():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.reflected import outdoor_light, window_shares

    # a floor and a wall that meet: only the floor is in the sun, and only patches below see it
    wall = rooms.quad((-40, -4, 0), (40, -4, 0), (40, -4, 60), (-40, -4, 60))
    floor = rooms.quad((-40, -4, 0), (40, -4, 0), (40, 0, 0), (-40, 0, 0))
    surfaces = rooms.surfaces([(wall, 1e-3), (floor, 0.5)])
    outside = TracedScene(surfaces, rooms.test_room()[1])
    sun = np.array([[0.0, 0.0, 1.0]])
    shares = window_shares(outside, samples=256)
    found = outdoor_light(shares, outside, sun, np.array([LUX]))[0][:, 0]
    down = (KLEMS_FULL.incident_directions() @ rooms.test_room()[1][0].frame)[:, 2]
    sunlit, dark = found[down < -0.75], found[down > 0.3]
    assert sunlit == pytest.approx(0.5 / np.pi * LUX, rel=0.01)
    assert dark.max() < 1e-3 * sunlit.mean()  # the wall's own thousandth of it


def test_a_row_with_little_light_has_as_many_places_as_one_with_much():
    """A sensor in the depth had a twentieth of the places of one by the window, and their noise."""
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints
    from mitsuba_cfs.trace.sun.reflected import PLACES, SunShares, _Met

    count = 8192
    points = np.random.default_rng(0).random((2 * count, 3)) * [1, 1, 0]
    points[count:, 0] += 5.0
    up = np.tile(np.float32([0, 0, 1]), (2 * count, 1))
    row, weight = np.repeat([0, 1], count), np.repeat([1.0, 0.02], count)
    found = SunShares.of([_Met(row, weight, SurfacePoints(points.astype(np.float32), up), [])], 2, 0)
    assert found.share.sum(axis=1) == pytest.approx([count, 0.02 * count])
    assert np.diff(found.share.indptr) == pytest.approx([PLACES / 2, PLACES / 2], rel=0.05)


def test_fewer_points_of_the_sun_are_fewer_places_outdoors_with_the_same_light():
    """A quick run asks at an eighth of them; what they say together has the same mean."""
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.reflected import outdoor_light, window_shares

    floor = rooms.quad((-40, -40, -2), (40, -40, -2), (40, 0, -2), (-40, 0, -2))
    outside = TracedScene(rooms.surfaces([(floor, 0.5)]), rooms.test_room()[1])
    suns = np.array([towards(40, 180), towards(60, 120)])
    found = []
    for places in (1024, 128):
        several = window_shares(outside, samples=32, places=places, seeds=range(4))
        assert all(0.8 * places < s.places.size <= places + 26 for s in several)
        light = outdoor_light(several, outside, suns, np.full(2, LUX))
        found.append(np.mean(light, axis=(0, 1)))
    np.testing.assert_allclose(*found, rtol=0.02)


def test_runs_in_one_launch_have_the_light_that_each_has_alone(monkeypatch):
    """Batches share launches, as many as fit; the random numbers of each are its own."""
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun import reflected as module
    from mitsuba_cfs.trace.sun import sun_at_points

    outside = TracedScene(overhang(2.0), rooms.test_room()[1])
    suns, lux = np.array([towards(40, 180), towards(60, 120), towards(30, 50)]), np.full(3, LUX)
    seeds, options = (0, 3, 4), {"samples": 4, "places": 64}
    alone = [module.window_shares(outside, seeds=[seed], **options)[0] for seed in seeds]
    each = [module.outdoor_light([one], outside, suns, lux)[0] for one in alone]
    assert all(one.any() for one in each) and not np.array_equal(*each[:2])
    for lanes in (sun_at_points.LANES, 2 * K * 4, 100):  # all, two and one in a launch, hours apart
        monkeypatch.setattr(sun_at_points, "LANES", lanes)
        together = module.window_shares(outside, seeds=seeds, **options)
        light = module.outdoor_light(together, outside, suns, lux)
        np.testing.assert_array_equal(light, each)


def test_what_stands_before_the_sun_leaves_a_floor_dark():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.reflected import outdoor_light, window_shares

    floor = rooms.quad((-40, -40, 0), (40, -40, 0), (40, 0, 0), (-40, 0, 0))
    roof = rooms.quad((-60, -60, 30), (60, -60, 30), (60, 60, 30), (-60, 60, 30))
    outside = TracedScene(rooms.surfaces([(floor, 0.5), (roof, 0.0)]), rooms.test_room()[1])
    suns = np.array([[0.0, 0.0, 1.0], towards(1, 0)])  # the second shines in below the roof
    shares = window_shares(outside, samples=16)
    [found] = outdoor_light(shares, outside, suns, np.full(2, LUX))
    assert np.all(found[:, 0] == 0) and found[:, 1].max() > 100


@pytest.mark.slow
@pytest.mark.parametrize("sun", [towards(45, 10), towards(30, 50)], ids=["high", "aside"])
def test_the_sun_reflected_below_an_overhang_is_that_of_paths(sun):
    # the sensor by the window has 9 % of noise with a sixteenth of these samples (four seeds)
    found, expected, error = both(overhang(2.0), sun_alone(sun), 524_288)
    agrees(found, expected, error)


def square(k: int, at: float) -> np.ndarray:
    """A side of a cube of 3 m, across axis k."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float) * 3
    return rooms.quad(*np.insert(corners, k, at, axis=1))


def hole() -> WindowGroup:
    """A square metre in the cube's side y = 0."""
    corners = rooms.quad((1, 1e-3, 1), (2, 1e-3, 1), (2, 1e-3, 2), (1, 1e-3, 2))
    return WindowGroup("south", (WindowSurface("hole", corners),))


def test_a_room_keeps_the_flux_of_a_beam_and_reflects_it_as_a_furnace_does():
    """A closed room of one reflectance: rho / (1 - rho) of the flux over its area, on average."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.sunlit_cells import Beam
    from mitsuba_cfs.trace.sun.sunlit_sensors import CELL_RAYS, room_cells, room_light, shares_and_derivatives

    room = rooms.surfaces([(square(k, at), 0.6) for k in range(3) for at in (0.0, 3.0)])
    group = hole()
    inside, outside = TracedScene(room, [group]), TracedScene(rooms.NOTHING, [group])
    cells, rng = room_cells(inside), np.random.default_rng(1)
    assert cells[1].starts.size == cells[1].cells.size * CELL_RAYS
    for part in (cells[0], cells[1].cells):
        assert part.area.sum() == pytest.approx(2 * 54, rel=1e-3)  # either side
    # sensors evenly over the surfaces, facing inwards: their mean is the room's
    n = 128
    places = rng.random((6 * n, 3)) * 2.99 + 0.005
    side, normals = np.repeat(np.arange(6), n), np.zeros((6 * n, 3))
    places[np.arange(6 * n), side // 2] = np.where(side % 2, 2.995, 0.005)
    normals[np.arange(6 * n), side // 2] = np.where(side % 2, -1.0, 1.0)
    share = shares_and_derivatives(cells, inside, (places, normals), samples=256)[0]
    sun = towards(40, 20)[None]
    way = BsdfOptics(clear_glass()).scattering
    [lux] = room_light([share], Beam((inside, outside), 0, way).flux(cells[0], sun), np.array([LUX]))
    flux = 0.8 * LUX * -sun[0, 1] * 1.0
    wall = TracedScene(rooms.surfaces([(9 * square(1, 0.0) - 12, 0.0)]), [group])
    [hidden] = room_light([share], Beam((inside, wall), 0, way).flux(cells[0], sun), np.array([LUX]))
    assert np.all(hidden == 0)
    # light that the black hole of 1 m2 in 54 takes: twice, as it hides the wall behind it
    assert lux.mean() == pytest.approx(0.6 / (1 - 0.6 * (1 - 1 / 54)) * flux / 54, rel=0.03)


def test_few_rays_of_a_sensor_ask_for_few_from_the_cells_with_the_same_light():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.sunlit_sensors import CELL_LEAST, CELL_RAYS, room_cells, shares_and_derivatives

    room = rooms.surfaces([(square(k, at), 0.6) for k in range(3) for at in (0.0, 3.0)])
    inside = TracedScene(room, [hole()])
    sensors = np.array([[x, 1.5, 0.8] for x in (0.5, 1.5, 2.5)]), np.tile([0.0, 0.0, 1.0], (3, 1))
    found = []
    for samples, rays in ((128, CELL_LEAST), (32 * CELL_RAYS, CELL_RAYS)):
        cells = room_cells(inside, samples=samples)
        assert cells[1].rays == rays and cells[1].starts.size == rays * cells[1].cells.size
        share = shares_and_derivatives(cells, inside, sensors, samples=4096)[0]
        found.append(share @ cells[0].area)
    np.testing.assert_allclose(*found, rtol=0.005)


def test_batches_of_a_beam_in_one_launch_are_those_of_each_alone(monkeypatch):
    """Hours of several batches share launches; each batch keeps its points on the window."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun import sunlit_cells as module

    room = rooms.surfaces([(square(k, at), 0.6) for k in range(3) for at in (0.0, 3.0)])
    inside, outside = TracedScene(room, [hole()]), TracedScene(overhang(2.0), [hole()])
    cells = module.surface_cells(inside).cells
    suns = np.array([towards(40, 20), towards(30, 60), towards(50, 200), towards(20, -30)])
    way, seeds, points = BsdfOptics(clear_glass()).scattering, (0, 3, 4), 64

    def flux(*some: int):
        return module.Beam((inside, outside), 0, way, points, some).flux(cells, suns).toarray()

    each = np.concatenate([flux(seed) for seed in seeds], axis=1)
    assert each.any() and not np.array_equal(each[:, :4], each[:, 4:8])
    np.testing.assert_array_equal(flux(*seeds), each)
    monkeypatch.setattr(module, "RAYS", 5 * points // module.EDGE_SHARE)  # five columns at once
    np.testing.assert_array_equal(flux(*seeds), each)


def test_a_sensor_close_to_a_sunlit_wall_has_the_part_of_it_above_its_horizon():
    """One wall reflects: the flux of points of the hole over their distances, by quadrature.

    The horizon of a sensor that looks up cuts the spot 0.3 m away; cells of 0.12 m have 5 % too
    much of what is below it, cells twice as wide 17 %.
    """
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.sunlit_cells import Beam
    from mitsuba_cfs.trace.sun.sunlit_sensors import room_cells, room_light, shares_and_derivatives

    sides = [(k, at) for k in range(3) for at in (0.0, 3.0)]
    room = rooms.surfaces([(square(k, at), 0.5 if (k, at) == (0, 0.0) else 0.0) for k, at in sides])
    inside, outside = TracedScene(room, [hole()]), TracedScene(rooms.NOTHING, [hole()])
    sun, place = towards(20, 60), np.array([0.3, 1.4, 1.0])
    middle = (np.arange(400) + 0.5) / 400 + 1
    x, z = (v.ravel() for v in np.meshgrid(middle, middle))
    lit = np.stack([0 * x, -x / sun[0] * sun[1], z - x / sun[0] * sun[2]], axis=1)
    way = lit - place
    distance = np.linalg.norm(way, axis=1)
    cosines = np.maximum(way[:, 2], 0) * -way[:, 0] / distance**2
    expected = 0.8 * LUX * -sun[1] * 0.5 / np.pi * np.mean(cosines / distance**2)

    cells, beam = room_cells(inside), BsdfOptics(clear_glass()).scattering
    found = []
    for seed in range(3):
        sensor = place[None], np.array([[0.0, 0.0, 1.0]])
        share = shares_and_derivatives(cells, inside, sensor, samples=65_536, seed=seed)[0]
        flux = Beam((inside, outside), 0, beam, seeds=(seed,)).flux(cells[0], sun[None])
        found.append(room_light([share], flux, np.array([LUX]))[0][0, 0])
    assert np.mean(found) == pytest.approx(expected, rel=0.08)  # 0.05, and 0.02 of noise


def test_the_beam_that_the_room_reflects_is_that_of_paths():
    found, expected, error = both(rooms.NOTHING, sun_alone(towards(30, 50)))
    agrees(found, expected, error)


def reflected(exterior: Surfaces, sky: AnnualSky, **sampling):
    """Light of the test room behind clear glass by five phases, without the direct sun [S, L]."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.scene import Sampling

    few = {"sensor_samples": 4096, "patch_samples": 512, "subdivision": 1} | sampling
    traced = phase_matrices(scene(exterior), Sampling(**few))
    light = phase_light(traced, [[BsdfOptics(clear_glass())]], sky)
    return illuminance(light) - direct_sun(light), illuminance_with_error(light)[1]


def test_a_cut_window_lets_as_much_sun_into_the_room_as_a_whole_one():
    """The parts' scene had another origin than the room's: a fifth of the beam was lost."""
    black = rooms.surfaces([(overhang(2.0).triangles, 0.0)])
    sky = sun_alone(towards(30, 50))
    few = {"sensor_samples": 512, "patch_samples": 64}
    whole, parts = (reflected(black, sky, window_parts=n, **few)[0] for n in (1, 3))
    assert whole.min() > 5
    assert parts == pytest.approx(whole, rel=0.02)  # the same rays but for what parts hide


@pytest.mark.slow
def test_the_stated_error_is_the_spread_over_seeds_of_the_reflected_sun():
    sky = sun_alone(towards(30, 50))
    runs = [reflected(overhang(2.0), sky, seed=seed) for seed in range(8)]
    values, said = np.stack([r[0][:, 0] for r in runs]), np.stack([r[1] for r in runs])
    spread = (values.std(axis=0, ddof=1) / values.mean(axis=0)) ** 2
    quotient = np.sqrt((said**2).mean(axis=0).sum() / spread.sum())
    # of seven degrees of freedom and three sensors that share paths: a factor of two
    assert 0.5 < quotient < 2.0
    assert spread.max() > 0.003**2


@pytest.mark.slow
def test_a_sun_behind_the_facade_lights_what_stands_before_it():
    wall = rooms.quad((-30, -5, -4), (30, -5, -4), (30, -5, 9), (-30, -5, 9))
    found, expected, error = both(rooms.surfaces([(wall, 0.4)]), sun_alone(towards(40, 160)))
    assert expected.min() > 100
    agrees(found, expected, error)
