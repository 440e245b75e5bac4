"""Window groups cut where what stands outdoors is not the same before all of a group."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.methods.light import illuminance, illuminance_with_error
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.window_parts import Region, cut_group, window_cells

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
OMEGA = KLEMS_FULL.projected_solid_angles()
POINTS = np.array([[1.8, y, 0.8] for y in (0.5, 1.0, 2.0, 4.0)])
UP = np.tile([0.0, 0.0, 1.0], (4, 1))
FEW = {"sensor_samples": 16384, "patch_samples": 4096, "subdivision": 1}


def facade() -> list:
    """The wall that the test room's window stands in, seen from outside."""
    x0, x1, z0, z1 = rooms.X0, rooms.X1, rooms.Z0, rooms.Z1
    strips = ((-9, 12, -3, z0), (-9, 12, z1, 6), (-9, x0, z0, z1), (x1, 12, z0, z1))
    return [(rooms.quad((a, 0, c), (b, 0, c), (b, 0, d), (a, 0, d)), 0.4) for a, b, c, d in strips]


def overhang(depth: float) -> Surfaces:
    """A slab above the window of the test room, and its facade."""
    slab = rooms.quad((-1, -depth, 2.7), (-1, 0, 2.7), (5, 0, 2.7), (5, -depth, 2.7))
    return rooms.surfaces([(slab, 0.5), *facade()])


def fins(depth: float) -> Surfaces:
    """Four fins across the window of the test room, two of them at its jambs."""
    places = (0.25, 1.3, 2.35, 3.4)
    quads = [rooms.quad((x, 0, 0), (x, -depth, 0), (x, -depth, 3), (x, 0, 3)) for x in places]
    return rooms.surfaces([(q, 0.5) for q in quads] + facade())


def overcast() -> AnnualSky:
    """One hour without sun, 10,000 lx."""
    sky = cie_patches("overcast", ReinhartSky(1), 1e4)[:, None]
    sun, none = np.array([[0, -0.8, 0.6]]), np.zeros(1)
    return AnnualSky(sky, sun, none, np.arange(1), 1, np.zeros_like(sky))


def clear_glass() -> KlemsBsdf:
    """Glass of 0.8 that reflects nothing."""
    block, nothing = np.diag(0.8 / OMEGA), np.zeros((K, K))
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block, nothing, nothing)


def scene(exterior: Surfaces):
    from mitsuba_cfs.methods.scene import DaylightScene

    interior, groups = rooms.test_room()
    return DaylightScene(interior, exterior, groups, POINTS, UP)


def by_phases(exterior: Surfaces, five_phase: bool = False, **sampling):
    """Light of the test room by phases in one hour, and its stated error."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.scene import Sampling

    traced = phase_matrices(scene(exterior), Sampling(**FEW | sampling), five_phase=five_phase)
    light = phase_light(traced, [[BsdfOptics(clear_glass())]], overcast())
    return illuminance(light)[:, 0], illuminance_with_error(light)[1], traced


def by_paths(exterior: Surfaces):
    """The same by paths, and its relative error."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.scene import Sampling

    light = PathLight(scene(exterior), [[BsdfOptics(clear_glass())]], overcast(), Sampling(hour_samples=131_072))
    values, error = illuminance_with_error(light)
    return values[:, 0], error


@pytest.mark.parametrize("outdoors", [overhang(1.0), fins(0.8)], ids=["overhang", "fins"])
def test_parts_agree_with_paths_and_one_part_does_not(outdoors):
    expected, error = by_paths(outdoors)
    found, said, traced = by_phases(outdoors)
    whole, doubt, _ = by_phases(outdoors, window_parts=1)
    off, off_whole = found / expected - 1, whole / expected - 1
    parts = len(traced.parts.groups)
    print(parts, np.round(off, 3), np.round(said, 3), np.round(off_whole, 3), np.round(doubt, 3))
    assert parts > 2
    noise = np.hypot(said, error)
    assert np.all(np.abs(off) < 0.02 + 3 * noise) and np.abs(off).max() < 0.04
    # what is wrong with one mean over the window is said
    assert np.abs(off_whole).max() > 0.04
    assert np.all(np.abs(off_whole) < 3 * np.hypot(doubt, error) + 0.02)


def test_five_phases_take_the_parts_too():
    three, _, _ = by_phases(overhang(1.0))
    five, _, traced = by_phases(overhang(1.0), five_phase=True)
    assert traced.daylight.values.shape[0] == traced.direct_daylight.shape[0] > 2
    np.testing.assert_allclose(five, three, rtol=1e-6)  # no sun: nothing to take apart


def test_an_open_site_is_not_cut_and_keeps_its_digits():
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    ground = rooms.quad((-60, -60, -0.3), (60, -60, -0.3), (60, 0, -0.3), (-60, 0, -0.3))
    for exterior in (rooms.NOTHING, rooms.surfaces([(ground, 0.2)])):
        _, said, traced = by_phases(exterior)
        assert traced.parts.groups == tuple(traced.scene.groups)
        assert said.max() < 0.02
        plain = daylight_matrix(exterior, traced.scene.groups, subdivision=1, samples=512, stopping=Stopping(batches=8))
        np.testing.assert_array_equal(traced.daylight.values, plain.values)


def test_no_light_comes_through_the_room_from_behind():
    """A box round the window's outside, closed: not a ray of it may leave through the window."""
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    x0, x1, z0, z1, d = rooms.X0, rooms.X1, rooms.Z0, rooms.Z1, -1.0
    box = rooms.surfaces(
        [
            (rooms.quad((x0, d, z0), (x1, d, z0), (x1, d, z1), (x0, d, z1)), 0.9),
            (rooms.quad((x0, d, z0), (x0, 0, z0), (x1, 0, z0), (x1, d, z0)), 0.9),
            (rooms.quad((x0, d, z1), (x1, d, z1), (x1, 0, z1), (x0, 0, z1)), 0.9),
            (rooms.quad((x0, d, z0), (x0, d, z1), (x0, 0, z1), (x0, 0, z0)), 0.9),
            (rooms.quad((x1, d, z0), (x1, 0, z0), (x1, 0, z1), (x1, d, z1)), 0.9),
        ]
    )
    _, groups = rooms.test_room()
    found = daylight_matrix(box, groups, subdivision=1, samples=512)
    assert found.values.sum(axis=2).max() < 1e-3  # seams of float32 let a ray in a thousand out


def test_forced_parts_and_their_mean():
    _, _, traced = by_phases(overhang(1.0), window_parts=3)
    parts = traced.parts
    assert len(parts.groups) == 3 and list(parts.group) == [0, 0, 0]
    area = np.array([part.area for part in parts.groups])
    assert area.sum() == pytest.approx(traced.scene.groups[0].area)
    mean = parts.of_groups(traced.daylight.values)
    expected = np.tensordot(area / area.sum(), traced.daylight.values, 1)
    np.testing.assert_allclose(mean[0], expected)


def test_the_cut_follows_what_varies():
    """Below a wide slab in height, beside fins in width."""
    for outdoors, axis in ((overhang(1.0), 1), (fins(0.8), 0)):
        _, _, traced = by_phases(outdoors, window_parts=2)
        low, high = (part.windows[0].triangles.reshape(-1, 3) @ part.frame.T for part in traced.parts.groups)
        across = [np.ptp(p, axis=0)[:2] for p in (low, high)]
        whole = np.ptp(traced.scene.groups[0].windows[0].triangles.reshape(-1, 3) @ low_frame(traced), axis=0)
        assert all(side[1 - axis] == pytest.approx(whole[1 - axis]) for side in across)
        assert all(side[axis] < 0.9 * whole[axis] for side in across)


def low_frame(traced):
    return traced.scene.groups[0].frame.T


def l_shape() -> WindowGroup:
    """A window that is no convex polygon, and a triangle beside it."""
    glass = np.concatenate(
        [rooms.quad((0, 0, 0), (2, 0, 0), (2, 0, 1), (0, 0, 1)), rooms.quad((0, 0, 1), (1, 0, 1), (1, 0, 2), (0, 0, 2))]
    )
    gable = np.array([[(3, -0.5, 0), (5, -0.5, 0), (4, -0.5, 2)]], dtype=float)
    return WindowGroup("south", (WindowSurface("L", glass), WindowSurface("gable", gable)))


def test_cells_and_parts_keep_the_area():
    group = l_shape()
    cells = window_cells(group)
    assert cells.area.sum() == pytest.approx(group.area)
    assert np.all(cells.area <= cells.sides.prod(axis=1) * (1 + 1e-9))
    below, above = Region.everything().halves(1, 0.7)
    parts = cut_group(group, [below, *above.halves(0, 1.5)])
    assert sum(part.area for part in parts) == pytest.approx(group.area)
    assert all(np.allclose(part.frame, group.frame) for part in parts)
    assert parts[0].area == pytest.approx(2 * 0.7 + 2 * 0.7 - 0.5 * 0.7**2)


def test_windows_at_other_depths_are_told_apart():
    group = l_shape()
    front, back = cut_group(group, Region.everything().halves(2, 0.25))
    assert {w.name for w in front.windows} == {"L"} and {w.name for w in back.windows} == {"gable"}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("parts", [None, 2])
def test_a_window_that_sees_nothing_is_cut_without_a_warning(parts):
    """One behind a wall: no part sees more than another, and none more than nothing."""
    from mitsuba_cfs.methods.subdivision import CellLight, subdivided

    group = l_shape()
    cells = window_cells(group)
    dark = CellLight(group, cells, np.zeros((len(cells.area), K, ReinhartSky(1).size)))
    assert len(subdivided(dark, parts).regions) == (parts or 1)


def test_the_best_cut_removes_the_most_variance():
    from mitsuba_cfs.methods.subdivision import _best_cut

    cells = window_cells(l_shape())
    seen = np.random.default_rng(2).uniform(size=(len(cells.area), 5)) + np.sin(cells.centre[:, [1]])
    region = Region.everything().halves(0, 0.8)[0]
    inside = region.holds(cells.centre)

    def variance(some):
        mean = np.average(seen[some], axis=0, weights=cells.area[some])
        return float((cells.area[some, None] * (seen[some] - mean) ** 2).sum())

    gains = {}
    for axis in range(3):
        for place in np.unique(np.round(cells.centre[inside, axis], 6))[1:] - 1e-3:
            halves = [inside & half.holds(cells.centre) for half in region.halves(axis, place)]
            gains[axis, float(place)] = variance(inside) - sum(map(variance, halves))
    found, (axis, place) = _best_cut(cells, region, seen), max(gains, key=lambda key: gains[key])
    assert found.gain == pytest.approx(gains[axis, place], rel=1e-5) and found.axis == axis
    cut = [half.holds(cells.centre).tolist() for half in region.halves(axis, found.place)]
    assert cut == [half.holds(cells.centre).tolist() for half in region.halves(axis, place)]
    assert _best_cut(cells, Region(np.full(3, 9.0), np.full(3, 10.0)), seen).gain < 0


def test_each_cut_is_the_best_of_all_regions():
    """By the means on both sides of every place, one after the other."""
    from mitsuba_cfs.methods.subdivision import DARK, CellLight, level, reference_skies, subdivided

    group, random = l_shape(), np.random.default_rng(5)
    cells = window_cells(group)
    light = CellLight(group, cells, random.random((len(cells.area), K, ReinhartSky(1).size)))
    outside = light.daylight @ reference_skies()
    weight = np.sqrt(OMEGA / np.pi)[:, None]
    seen = (outside * weight / np.maximum(level(outside), DARK)).reshape(len(cells.area), -1)
    regions = [Region.everything()]
    while len(regions) < 4:
        found = []
        for number, region in enumerate(regions):
            inside = np.flatnonzero(region.holds(cells.centre))
            for axis in range(3):
                at = np.unique(np.round(cells.centre[inside, axis], 6))
                for place in 0.5 * (at[1:] + at[:-1]):
                    below = cells.centre[inside, axis] < place
                    a, b = inside[below], inside[~below]
                    step = np.average(seen[a], 0, cells.area[a]) - np.average(seen[b], 0, cells.area[b])
                    areas = [cells.area[one].sum() for one in (a, b, inside)]
                    found.append((areas[0] * areas[1] / areas[2] * (step @ step), number, axis, float(place)))
        _, number, axis, place = max(found)
        regions += regions.pop(number).halves(axis, place)
    for one, other in zip(subdivided(light, 4).regions, regions, strict=True):
        np.testing.assert_array_equal([one.low, one.high], [other.low, other.high])


def test_states_of_a_cut_group_go_together():
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.scene import Sampling

    glass = clear_glass()
    half = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, *(0.5 * b for b in glass.blocks().values()))
    traced = phase_matrices(scene(overhang(1.0)), Sampling(**FEW))
    sky = overcast()
    twice = AnnualSky(
        np.tile(sky.whole, 2),
        np.tile(sky.direction, (2, 1)),
        np.zeros(2),
        np.arange(2),
        2,
        np.zeros((sky.whole.shape[0], 2)),
    )
    light = phase_light(traced, [[BsdfOptics(glass), BsdfOptics(half)]], twice)
    lit = illuminance(light, np.array([[0, 1]]))
    np.testing.assert_allclose(lit[:, 1], 0.5 * lit[:, 0], rtol=1e-6)


def test_few_paths_leave_few_parts():
    """What parts put right is not to be less than the noise of D."""
    from mitsuba_cfs.methods.subdivision import LIMIT, allowed

    assert allowed(65_536) == allowed(16_384) == LIMIT and allowed(1_024) == pytest.approx(4 * LIMIT)
    count = [
        len(by_phases(overhang(1.0), patch_samples=n, sensor_samples=256)[2].parts.groups) for n in (1_024, 16_384)
    ]
    assert 1 < count[0] < count[1]
