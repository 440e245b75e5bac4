"""Pictures whose luminance goes into the view's paths, against matrices of all patches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from mitsuba_cfs.images.view import fisheye
from tests.glare.test_outdoor_pictures import sky
from tests.trace import rooms
from tests.trace.gloss_scenes import black_room

pytestmark = pytest.mark.usefixtures("variant")

VIEW = fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), 64)
HOURS = np.array([3, 0, 4])
STATES = np.array([[1, 0, 0, 1, 0]])  # of the one window in each of five hours: both at HOURS


def filled(**kept: Any) -> Any:
    """A room with a wall and an overhang before it, its window with two states of glass."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    scene = cfs.DaylightScene(room, rooms.obstruction(), groups, view=VIEW)
    sampling = cfs.Sampling(view_samples=2, patch_samples=256, window_parts=2)
    states = [cfs.AngularOptics([0.0, tau, tau, tau, tau]) for tau in (0.7, 0.2)]
    return cfs.PhaseSystems(cfs.PhaseScene(scene, sampling, **kept), [states])


@cache
def by_patches() -> list:
    """The rated pictures by V of all patches."""
    from mitsuba_cfs.methods.glare import rated_pictures

    systems = filled()
    assert systems.traced.view.lit.rows.shape[1] == 145 * len(systems.traced.parts.groups)
    return rated_pictures(systems.light(sky(5)), HOURS, STATES)


def test_paths_that_carry_luminance_sum_to_the_matrix_times_it() -> None:
    """Each part of V with the luminance that is its own, in the mean and in the halves."""
    from mitsuba_cfs.trace.annual_pictures import view_matrices
    from mitsuba_cfs.trace.patch_light import PatchLight

    room, groups = rooms.test_room()
    parts = [groups[0], replace(groups[0])]
    lit, later = np.random.default_rng(5).random((2, 2 * 145, 3)).astype(np.float32)
    options = {"samples": 2, "tile": 4}
    whole = view_matrices(room, parts, VIEW, **options)
    found = view_matrices(room, parts, VIEW, light=PatchLight(lit, later), **options)
    pairs = (
        (found.lit.rows, whole.lit.rows @ lit),
        (found.indirect.rows, whole.indirect.rows @ later),
        (found.noise.lit, whole.noise.lit @ lit),
        (found.noise.indirect, whole.noise.indirect @ later),
    )
    for values, expected in pairs:  # float32 of hundreds of terms
        scale = np.abs(expected).max()
        assert scale > 0
        np.testing.assert_allclose(values, expected, atol=3e-6 * scale)
    assert sparse.csr_array(found.seen - whole.seen).nnz == 0


def test_few_pictures_are_those_of_the_matrices() -> None:
    """Hours out of order in two states: pictures, glare, and its error."""
    from mitsuba_cfs.methods.glare import pictures, rated_pictures

    systems = filled()
    light = systems.light(sky(5))
    found = rated_pictures(light, HOURS, STATES)
    assert "view" not in vars(systems.traced)  # V of all patches was not traced
    shown = pictures(light, HOURS, STATES)
    for (picture, rated), (expected, other), again in zip(found, by_patches(), shown, strict=True):
        np.testing.assert_allclose(picture, expected, rtol=1e-4, atol=1e-5 * expected.mean())
        np.testing.assert_array_equal(again, picture)
        assert rated.dgp == pytest.approx(other.dgp, abs=1e-6)
        # the difference of two halves: float32 of DGP itself
        assert rated.dgp_standard_error == pytest.approx(other.dgp_standard_error, abs=1e-6)
    means = [picture.mean() for picture, _ in found]
    assert len(set(np.round(means, 3))) == len(HOURS)  # the hours differ


def test_matrices_at_hand_are_taken_and_many_pictures_get_them() -> None:
    systems = filled()
    traced = systems.traced
    patches = 145 * len(traced.parts.groups)
    assert traced.few(10)
    assert not traced.few(patches)
    assert traced.view is traced.view
    assert not traced.few(1)


def test_the_cache_gives_few_pictures_again_and_matrices_first(tmp_path, monkeypatch) -> None:
    """The same pictures are not traced twice, and kept matrices serve other systems."""
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.methods import phase_scene
    from mitsuba_cfs.methods.glare import rated_pictures

    kept, calls = MatrixCache(tmp_path), []
    trace = phase_scene.view_matrices

    def counted(*args, **options):
        calls.append(options["light"])
        return trace(*args, **options)

    monkeypatch.setattr(phase_scene, "view_matrices", counted)
    first, second = (
        rated_pictures(filled(cache=kept).light(sky(5)), HOURS, STATES) for _ in range(2)
    )
    assert len(calls) == 1 and calls[0] is not None
    for (picture, _), (again, _) in zip(first, second, strict=True):
        np.testing.assert_array_equal(picture, again)
    assert len(filled(cache=kept).traced.view.pixels) and calls[1] is None
    assert not filled(cache=kept).traced.few(1)
    rated_pictures(filled(cache=kept).light(sky(5)), HOURS, 1 - STATES)
    assert len(calls) == 2


def test_rooms_with_gloss_keep_the_patches() -> None:
    """What gloss shows of the windows is a matrix of patches for each pixel."""
    import mitsuba_cfs as cfs
    from mitsuba_cfs.trace.annual_pictures import view_matrices
    from mitsuba_cfs.trace.patch_light import PatchLight

    groups = rooms.test_room()[1]
    room = black_room(cfs.Gloss((0.04, 0.04)))[1]
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=VIEW)
    assert room.glossy and not cfs.PhaseScene(scene).few(1)
    light = np.ones((145, 1), dtype=np.float32)
    with pytest.raises(ValueError, match="gloss"):
        view_matrices(room, groups, VIEW, samples=1, light=PatchLight(light, light))
