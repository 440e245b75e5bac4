"""Scenes that share the acceleration structure of what stands outdoors."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.trace.kernels.estimate import Stopping

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")


def town(side: int = 40, spread: float = 12.0):
    """2 side^2 triangles: a grid of slanted tiles before the test room's window."""
    x, y = np.meshgrid(np.linspace(-spread, spread, side), np.linspace(-2 * spread, -1, side))
    z = 3.0 + 3.0 * np.sin(3.0 * x) * np.cos(2.0 * y)
    at = np.stack([x, y, z], axis=-1).reshape(-1, 1, 3)
    tile = [[[0, 0, 0], [0.3, 0, 0.1], [0, 0.1, 0.4]], [[0, 0, 0], [0, 0.3, 0], [0.2, 0, 1]]]
    triangles = (at[:, None] + np.array(tile)).reshape(-1, 3, 3)
    return rooms.surfaces([(triangles[: side**2], 0.4), (triangles[side**2 :], 0.1)])


def apart(monkeypatch, *given, **chosen):
    """The scene in a structure of its own, all in one mesh."""
    from mitsuba_cfs.trace.kernels import scene

    with monkeypatch.context() as patch:
        patch.setattr(scene, "FROM", 10**9)
        return scene.TracedScene(*given, **chosen)


def met(scene, rays: int = 50_000, *, half: bool = False):
    """Distance, triangle (-1: none) and shade of rays about the window, from both sides of it."""
    import drjit as dr
    import mitsuba as mi

    random = np.random.default_rng(3)
    at = np.array([1.8, 0.0, 1.7]) + random.uniform(-1, 1, (rays, 3)) * [1.4, 4.0, 0.7]
    way = random.normal(size=(rays, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    axes = ((at - scene.centre).T, way.T)
    start, towards = (kind(*map(mi.Float, a)) for kind, a in zip((mi.Point3f, mi.Vector3f), axes, strict=True))
    ray = mi.Ray3f(start, towards)
    ray.maxt = mi.Float(random.uniform(0.1, 40, rays))
    active = mi.Float(way.T[0]) > 0 if half else mi.Bool(True)
    hit = scene.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
    blocked = scene.scene.ray_test(ray, coherent=False, active=active)
    valid = hit.is_valid()
    triangle = dr.select(valid, mi.Int32(hit.prim_index), -1)
    return dr.select(valid, hit.t, -1.0).numpy(), triangle.numpy(), blocked.numpy()


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("blocks", [False, True])
def test_rays_meet_what_they_meet_in_one_mesh(monkeypatch, blocks, half):
    from mitsuba_cfs.trace.kernels.scene import SharedScene, TracedScene

    given = town(), rooms.test_room()[1]
    shared = TracedScene(*given, windows_block=blocks)
    alone = apart(monkeypatch, *given, windows_block=blocks)
    assert isinstance(shared.scene, SharedScene) and not isinstance(alone.scene, SharedScene)
    (t, triangle, blocked), (t1, triangle1, blocked1) = (met(s, half=half) for s in (shared, alone))
    same = triangle == triangle1
    # rays through an edge of two tiles may take either for float32's rounding of their origin
    assert same.mean() > 0.9995 and (blocked == blocked1).mean() > 0.9995
    np.testing.assert_allclose(t[same], t1[same], atol=2e-5)  # ten steps of float32 at 12 m
    panes = triangle >= len(given[0].triangles)
    assert panes.any() == blocks and (triangle == -1).any()
    np.testing.assert_array_equal(shared.epsilon.numpy(), alone.epsilon.numpy())


def test_scenes_of_equal_triangles_share_one_structure():
    from mitsuba_cfs.trace.kernels.scene import SceneCache

    first, again, groups, scenes = town(), town(), rooms.test_room()[1], SceneCache()
    traced = [
        scenes.scene(first, groups),
        scenes.scene(again, groups, windows_block=False),
        scenes.scene(again, centre=[3.0, 4.0, 5.0]),
    ]
    assert len({id(scene.scene._solid) for scene in traced}) == 1
    other = scenes.scene(town(side=41), groups), SceneCache().scene(first, groups)
    assert not {id(scene.scene._solid) for scene in other} & {id(traced[0].scene._solid)}


def test_scenes_that_are_not_kept_share_the_structure_of_those_that_are(monkeypatch):
    """The facades' and the sky's view take the structure that the windows' light is traced in."""
    from mitsuba_cfs.trace.kernels import scene
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
    from mitsuba_cfs.trace.matrices.view_factors import sky_shares

    scenes, built = scene.SceneCache(scenes=1), []
    kept = scenes.scene(town(), rooms.test_room()[1])
    alone = scenes.of_surfaces(town(), np.array([0.0, -5.0, 2.0]))
    assert alone.scene._solid is kept.scene._solid
    assert scenes.scene(kept.surfaces, kept.groups) is kept  # it took no place among the kept
    places, normals = np.array([[[0.0, -0.5, 2.0]]]), np.array([[0.0, -1.0, 0.0]])
    expected = sky_shares(town(), places, normals)
    monkeypatch.setattr(scene, "scene_of", lambda triangles: built.append(len(triangles)))
    assert scenes.of_surfaces(town(), np.zeros(3)).scene._solid is kept.scene._solid and not built
    monkeypatch.undo()
    np.testing.assert_array_equal(sky_shares(town(), places, normals, scenes=scenes), expected)
    rows = [
        sky_irradiance_matrix(town(), places[0], normals, subdivision=1, samples=512, scenes=one).values
        for one in (scenes, None)
    ]
    np.testing.assert_array_equal(*rows)


def test_what_reaches_far_or_is_small_is_built_about_each_scenes_own_middle():
    from mitsuba_cfs.trace.kernels.scene import SolidMesh

    assert SolidMesh(town().triangles).is_shared
    assert not SolidMesh(town(spread=300.0).triangles).is_shared
    assert not SolidMesh(rooms.obstruction().triangles).is_shared


def test_matrix_does_not_know_whether_the_structure_is_shared(monkeypatch):
    from mitsuba_cfs.trace.kernels import scene
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    def traced():
        few = {"samples": 64, "subdivision": 1, "stopping": Stopping(batches=2)}
        return daylight_matrix(town(), rooms.test_room()[1], **few).values

    shared = traced()
    monkeypatch.setattr(scene, "FROM", 10**9)
    alone = traced()
    # of 9,280 paths some ten meet another tile at an edge, and each carries 1/64 of its row at most
    assert np.abs(shared - alone).sum() < 2e-3 * alone.sum()
