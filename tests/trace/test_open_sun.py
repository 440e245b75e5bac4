"""The direct sun of sensors is traced once for all systems: these add their beam and their BSDF."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.gloss import mirror
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces

from . import rooms
from .test_reflected_sun import towards

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
POINTS = np.array([[x, y, 0.8] for x in (0.5, 1.5, 2.5) for y in (0.4, 1.2, 3.0)])
SUNS = np.array([towards(a, z) for a in (12, 30, 50) for z in (-80, -60, -30, 0, 20, 45, 165, 180)])


def outdoors(shade: Surfaces) -> Surfaces:
    """A wall in front of the western window, an overhang above the southern one, and a mirror to the south."""
    slab = rooms.quad((0, -1, 2.5), (0, 0, 2.5), (3.5, 0, 2.5), (3.5, -1, 2.5))
    pane = rooms.quad((-1, -10, 0), (3, -11, 0), (3, -11, 5), (-1, -10, 5))
    return Surfaces(
        np.concatenate([shade.triangles, slab, pane]),
        np.append(shade.reflectance, [0.4, 0.4, 0.0, 0.0]),
        np.append(shade.surface, [1, 1, 2, 2]),
        (),
        (None, None, mirror(0.8)),
    )


def systems() -> list:
    """For each of two groups: a blind without a beam, one with, a diffuser; the last with clear glass beside it."""
    from mitsuba_cfs.trace.kernels.scattering import AngularScattering, KlemsScattering

    rng = np.random.default_rng(4)
    none, steep = np.zeros(K), 0.7 * KLEMS_FULL.incident_directions()[:, 2]
    blind = KlemsScattering(KLEMS_FULL, rng.random((K, K)), none)
    with_beam = KlemsScattering(KLEMS_FULL, 0.3 * rng.random((K, K)), steep)
    clear = KlemsScattering(KLEMS_FULL, np.zeros((K, K)), np.full(K, 0.8))
    diffuser = AngularScattering(np.linspace(0.0, 0.3, 8), np.linspace(0.0, 0.5, 8))
    return [[blind, blind], [with_beam, blind], [diffuser, clear], [None, with_beam]]


def matrix(of_groups, cache: MatrixCache | None, **options):
    """C_ds of both groups [G, S, Q]."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups, shade = rooms.l_shaped_room()
    up = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
    options = {"suns": SUNS, "window_points": 32, "stopping": Stopping(batches=4), "by_group": True} | options
    return direct_sun_matrix(room, outdoors(shade), groups, of_groups, POINTS, up, cache=cache, **options)


def without_rays(monkeypatch) -> None:
    from mitsuba_cfs.trace.sun import direct
    from mitsuba_cfs.trace.sun.window_points import WindowPoints

    for owner, names in ((direct, ("sun_discs", "crossed_discs")), (WindowPoints, ("visible", "sunlit"))):
        for name in names:
            monkeypatch.setattr(owner, name, None)


def same(found, expected) -> None:
    np.testing.assert_array_equal(found.values, expected.values)
    np.testing.assert_allclose(found.standard_error, expected.standard_error, rtol=1e-6)  # stored with seven digits


def files(folder, name: str) -> int:
    return sum(file.name.startswith(name) for file in folder.iterdir())


def test_other_systems_in_the_windows_trace_nothing_and_have_the_light_traced_afresh(tmp_path, monkeypatch):
    first, *others = systems()
    cache = MatrixCache(tmp_path)
    fresh = [matrix(of_groups, None) for of_groups in others]
    assert all(np.mean(one.values > 0) > 0.2 for one in fresh[:2])
    by_discs = matrix([None, others[1][1]], None).values[1]
    assert 0.02 < np.mean(by_discs > 0) < 0.5  # clear glass: only sensors in the sun have any
    matrix(first, cache)
    without_rays(monkeypatch)
    for of_groups, expected in zip(others, fresh, strict=True):
        same(matrix(of_groups, cache), expected)
    assert files(tmp_path, "sun-discs") == files(tmp_path, "sun-on-windows") == 1


def test_a_cache_that_stores_nothing_of_the_sun_costs_the_rays_and_nothing_else(tmp_path, monkeypatch):
    from mitsuba_cfs.matrices import stored_parts

    _, system, other, _ = systems()
    fresh = matrix(system, None)
    (tmp_path / "read").mkdir()
    same(matrix(system, MatrixCache(tmp_path / "read", stores=False)), fresh)
    assert not list((tmp_path / "read").iterdir())
    file = tmp_path / "file"
    file.touch()
    same(matrix(system, MatrixCache(file / "below")), fresh)
    monkeypatch.setattr(stored_parts, "MOST_STORED", 64)
    same(matrix(system, MatrixCache(tmp_path / "small")), fresh)
    assert files(tmp_path / "small", "direct-sun") == 1
    assert files(tmp_path / "small", "sun-") == 0
    same(matrix(other, MatrixCache(tmp_path / "small")), matrix(other, None))


def test_a_damaged_file_of_the_sun_is_traced_again(tmp_path):
    first, system, _, _ = systems()
    cache, fresh = MatrixCache(tmp_path), matrix(system, None)
    matrix(first, cache)
    for name in ("sun-discs", "sun-on-windows"):
        (file,) = tmp_path.glob(f"{name}*")
        file.write_bytes(file.read_bytes()[:400])
    same(matrix(system, cache), fresh)


def test_what_is_stored_of_the_sun_belongs_to_its_scene_sensors_hours_and_seed(tmp_path):
    cache, (system, *_) = MatrixCache(tmp_path), systems()
    matrix(system, cache)
    matrix(system, cache, suns=SUNS[:5])
    matrix(system, cache, seed=1)
    assert files(tmp_path, "sun-discs") == files(tmp_path, "sun-on-windows") == 3
    matrix(system, cache, window_points=16)
    assert (files(tmp_path, "sun-discs"), files(tmp_path, "sun-on-windows")) == (3, 4)


def test_batches_one_by_one_are_stored_one_by_one(tmp_path, monkeypatch):
    """As of a room whose sensors and hours are too many for one launch."""
    from mitsuba_cfs.trace.sun import direct

    first, system, _, _ = systems()
    together = matrix(system, None)
    monkeypatch.setattr(direct, "LANES", len(POINTS) * len(SUNS))
    cache = MatrixCache(tmp_path)
    matrix(first, cache)
    without_rays(monkeypatch)
    same(matrix(system, cache), together)
    assert files(tmp_path, "sun-on-windows") > 1


def test_packed_arrays_are_the_same_arrays():
    from mitsuba_cfs.matrices.packed import PackedArray

    rng = np.random.default_rng(1)
    mixed = (rng.random((7, 3, 11)) * (rng.random((7, 3, 11)) < 0.2)).astype(np.float32)
    for array in (mixed, mixed > 0, np.zeros((3, 5)), np.full((2, 9), 0.3, dtype=np.float32), np.zeros((0, 4))):
        packed = PackedArray.of(array)
        np.testing.assert_array_equal(packed.whole(), array.astype(np.float32))
        read = PackedArray.of_arrays(packed.arrays("a"), "a")
        np.testing.assert_array_equal(read.whole(), array.astype(np.float32))
        assert read.shape == array.shape and read.empty == (not array.any())
    assert PackedArray.of(mixed > 0).values.size == 1


def steep():
    """Glass whose transmittance changes by a twentieth across the disc of a sun to the side."""
    from mitsuba_cfs.trace.kernels.scattering import AngularScattering

    return AngularScattering(np.linspace(0, 1, 257) ** 8, np.zeros(2))


def disc_about(sun: np.ndarray, count: int = 200_000) -> np.ndarray:
    """Directions [n, 3] even over the disc of a sun."""
    from mitsuba_cfs.sky.sun import SUN_RADIUS

    number = np.arange(count) + 0.5
    radius, turn = SUN_RADIUS * np.sqrt(number / count), 2.399963 * number
    x = np.cross(sun, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(sun, x)
    ways = sun + (np.tan(radius) * np.cos(turn))[:, None] * x + (np.tan(radius) * np.sin(turn))[:, None] * y
    return ways / np.linalg.norm(ways, axis=1)[:, None]


def test_the_mean_of_a_beam_over_the_disc_is_that_of_many_directions():
    from mitsuba_cfs.trace.sun.specular_paths import beam_transmittance

    suns = np.array([towards(20, z) for z in (0, 40, 60, 75)])
    local = np.stack([-suns[:, 0], suns[:, 2], -suns[:, 1]], axis=1)
    expected = [
        np.mean(np.interp(disc_about(sun)[:, 2], np.linspace(0, 1, 257), np.linspace(0, 1, 257) ** 8)) for sun in local
    ]
    assert beam_transmittance(steep(), local) == pytest.approx(expected, rel=5e-4)


def test_half_a_disc_has_the_transmittance_of_its_visible_half():
    """Of the disc's mean it would have 3 % too much or too little."""
    from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = rooms.test_room()
    sun, far = towards(25, 60), 100.0
    point = np.array([1.8, 1e-3, 1.8])
    x = point[0] + far * sun[0] / -sun[1]  # where the line to the middle of the disc meets the cover's plane
    errors = []
    for low, high in ((-900, x), (x, 900)):
        cover = rooms.quad((low, -far, 0), (high, -far, 0), (high, -far, 300), (low, -far, 300))
        ways = disc_about(sun)
        met = point[0] + (far + point[1]) * ways[:, 0] / -ways[:, 1]
        visible = (met < low) | (met > high)
        light = np.interp(-ways[:, 1], np.linspace(0, 1, 257), np.linspace(0, 1, 257) ** 8) * ways[:, 2] * visible
        found = direct_sun_matrix(
            room,
            rooms.surfaces([(cover, 0.0)]),
            groups,
            [steep()],
            point[None],
            [[0, 0, 1]],
            suns=sun[None],
            stopping=Stopping(batches=64),
        )
        errors.append(found.values[0, 0] / SUN_SOLID_ANGLE / light.mean() - 1)
    assert np.abs(errors).max() < 0.005, errors


def test_a_product_for_each_patch_of_the_sun_is_the_sum_over_all_points(monkeypatch):
    from mitsuba_cfs.trace.sun import window_points

    of_groups = systems()[0]
    by_patches = matrix(of_groups, None).values
    monkeypatch.setattr(window_points, "scattered_by_patches", lambda scattering: None)
    by_points = matrix(of_groups, None).values
    assert by_points.any(axis=(1, 2)).all()
    np.testing.assert_allclose(by_patches, by_points, rtol=2e-5, atol=1e-7 * by_points.max())
