"""Pictures whose luminance goes into the view's paths, against matrices of all patches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.phase_matrices import few_pictures, view_of_light, with_view_matrices
from mitsuba_cfs.methods.subdivision import Parts
from tests.glare.test_outdoor_pictures import sky
from tests.trace import rooms
from tests.trace.gloss_scenes import black_room

pytestmark = pytest.mark.usefixtures("variant")

VIEW = fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), 64)
HOURS = np.array([3, 0, 4])
STATES = np.array([[1, 0, 0, 1, 0]])  # of the one window in each of five hours: both at HOURS


def light_of(*needs: str, **kept: Any) -> Any:
    """A room with a wall and an overhang before it, its window with two states of glass."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    scene = cfs.DaylightScene(room, rooms.obstruction(), groups, view=VIEW)
    sampling = cfs.Sampling(view_samples=2, patch_samples=256, window_parts=2)
    states = [cfs.AngularOptics([0.0, tau, tau, tau, tau]) for tau in (0.7, 0.2)]
    return cfs.daylight(scene, [states], sky(5), sampling=sampling, needs=needs, **kept)


@cache
def by_patches() -> list:
    """The rated pictures by V of all patches."""
    from mitsuba_cfs.methods.glare import rated_pictures

    light = light_of("DGP")
    assert light.matrices.view.lit.rows.shape[1] == 145 * len(light.matrices.parts.groups)
    return rated_pictures(light, HOURS, STATES)


def test_paths_that_carry_luminance_sum_to_the_matrix_times_it() -> None:
    """Each part of V with the luminance that is its own, in the mean and in the halves."""
    from mitsuba_cfs.trace.kernels.patch_light import PatchLight
    from mitsuba_cfs.trace.pictures.annual import view_matrices

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

    light = light_of()
    assert few_pictures(light.matrices, len(HOURS))
    found = rated_pictures(light, HOURS, STATES)
    shown = pictures(light, HOURS, STATES)
    for (picture, rated), (expected, other), again in zip(found, by_patches(), shown, strict=True):
        np.testing.assert_allclose(picture, expected, rtol=1e-4, atol=1e-5 * expected.mean())
        np.testing.assert_array_equal(again, picture)
        assert rated.dgp == pytest.approx(other.dgp, abs=1e-6)
        # the difference of two halves: float32 of DGP itself
        assert rated.dgp_standard_error == pytest.approx(other.dgp_standard_error, abs=1e-6)
    means = [picture.mean() for picture, _ in found]
    assert len(set(np.round(means, 3))) == len(HOURS)  # the hours differ


def test_glare_of_few_hours_needs_no_matrix_of_all_patches(monkeypatch) -> None:
    """A single hour's glare traced a column for each patch of the windows."""
    from mitsuba_cfs.methods.glare import hourly_glare

    monkeypatch.setattr("mitsuba_cfs.methods.glare.with_phase_pictures", None)
    rated = hourly_glare(light_of(), "DGP", STATES, hours=HOURS)
    expected = [other.dgp for _, other in by_patches()]
    assert rated.dgp == pytest.approx(expected, abs=1e-6)


def test_matrices_at_hand_are_taken_and_many_pictures_get_them() -> None:
    matrices = light_of().matrices
    patches = 145 * len(matrices.parts.groups)
    assert few_pictures(matrices, 10)
    assert not few_pictures(matrices, patches)
    assert not few_pictures(with_view_matrices(matrices), 1)


def test_the_cache_gives_few_pictures_again_and_matrices_first(tmp_path, monkeypatch) -> None:
    """The same pictures are not traced twice, and kept matrices serve other systems."""
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.methods import phase_matrices
    from mitsuba_cfs.methods.glare import rated_pictures

    kept, calls = MatrixCache(tmp_path), []
    trace = phase_matrices.view_matrices

    def counted(*args, **options):
        calls.append(options["light"])
        return trace(*args, **options)

    monkeypatch.setattr(phase_matrices, "view_matrices", counted)
    first, second = (rated_pictures(light_of(cache=kept), HOURS, STATES) for _ in range(2))
    assert len(calls) == 1 and calls[0] is not None
    for (picture, _), (again, _) in zip(first, second, strict=True):
        np.testing.assert_array_equal(picture, again)
    assert len(light_of("DGP", cache=kept).matrices.view.pixels) and calls[1] is None
    assert not few_pictures(light_of(cache=kept).matrices, 1)
    rated_pictures(light_of(cache=kept), HOURS, 1 - STATES)
    assert len(calls) == 2


def matrices_of(*needs: str, **kept: Any) -> Any:
    """The bare room, nothing outdoors: few paths, and sunlit near and far."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=VIEW)
    return cfs.phase_matrices(scene, cfs.Sampling(view_samples=2), needs=needs, **kept)


def luminance(number: int) -> Any:
    """Of the one window's patches in two hours."""
    from mitsuba_cfs.trace.kernels.patch_light import PatchLight

    lit, later = np.random.default_rng(number).random((2, 145, 2)).astype(np.float32)
    return PatchLight(lit, later)


def arrays(value: Any) -> list[np.ndarray]:
    """All arrays of matrices, in their order."""
    if isinstance(value, np.ndarray):
        return [value]
    if sparse.issparse(value):
        return [value.data, value.indices, value.indptr]
    parts = vars(value) if hasattr(value, "__dict__") else getattr(value, "__slots__", ())
    return [a for name in parts for a in arrays(getattr(value, name))]


@pytest.fixture
def elements_traced(monkeypatch) -> list[int]:
    """Grows by one each time that shares of the sunlit surfaces are traced."""
    from mitsuba_cfs.trace.pictures import annual

    calls, trace = [], annual.picture_sunlit_shares

    def counted(*args, **options):
        calls.append(len(calls))
        return trace(*args, **options)

    monkeypatch.setattr(annual, "picture_sunlit_shares", counted)
    return calls


def test_sunlit_elements_are_found_again_under_any_light(tmp_path, elements_traced) -> None:
    """By pictures and by the matrices of all patches, and all bit by bit as without a cache."""
    from mitsuba_cfs.matrices.cache import MatrixCache

    kept = MatrixCache(tmp_path)
    found = [view_of_light(matrices_of(cache=kept), luminance(number)) for number in (1, 2, 2)]
    found.append(matrices_of("DGP", cache=kept).view)
    assert len(elements_traced) == 1
    assert len(list(tmp_path.glob("view-sunlit-*"))) == 1
    alone = [view_of_light(matrices_of(), luminance(number)) for number in (1, 2, 2)] + [matrices_of("DGP").view]
    for one, other in zip(found, alone, strict=True):
        pairs = list(zip(arrays(one), arrays(other), strict=True))
        assert len(pairs) > 30 and one.sunlit.mean.near.nnz > 0 and one.sunlit.close.any()
        for a, b in pairs:
            assert a.dtype == b.dtype or a.dtype.kind == b.dtype.kind == "i"  # a file has columns' numbers in 32 bits
            np.testing.assert_array_equal(a, b)


def test_systems_share_the_elements_and_not_the_pictures(tmp_path, elements_traced) -> None:
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.methods.glare import rated_pictures

    kept = MatrixCache(tmp_path)
    rated_pictures(light_of(cache=kept), HOURS, STATES)
    found = rated_pictures(light_of(cache=kept), HOURS, 1 - STATES)
    assert len(elements_traced) == 1
    alone = rated_pictures(light_of(), HOURS, 1 - STATES)
    for (picture, rated), (expected, other) in zip(found, alone, strict=True):
        np.testing.assert_array_equal(picture, expected)
        assert rated.dgp == other.dgp
        assert rated.dgp_standard_error == other.dgp_standard_error


def _changed(name: str, scene: Any, sampling: Any) -> Any:
    """A scene and sampling that differ in one thing."""
    room, group = scene.interior, scene.groups[0]
    pane = replace(group.windows[0], triangles=group.windows[0].triangles[:1])  # half of it
    scenes = {
        "geometry": {"interior": replace(room, triangles=room.triangles * [1.0, 1.0, 1.01])},
        "reflectance": {"interior": replace(room, reflectance=room.reflectance * 0.9)},
        "window": {"groups": [replace(group, windows=(pane,))]},
        "size": {"view": fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), 60)},
        "eye": {"view": fisheye((1.8, 2.4, 1.2), (0.5, -1.0, 0.0), 64)},
    }
    samplings = {"seed": {"seed": sampling.seed + 1}, "paths": {"view_samples": 3}}
    return replace(scene, **scenes.get(name, {})), replace(sampling, **samplings.get(name, {}))


@pytest.mark.parametrize("name", ["geometry", "reflectance", "window", "size", "eye", "seed", "paths"])
def test_elements_of_another_view_are_not_taken(tmp_path, elements_traced, name) -> None:
    from mitsuba_cfs.matrices.cache import MatrixCache

    first = matrices_of(cache=MatrixCache(tmp_path))
    view_of_light(first, luminance(1))
    scene, sampling = _changed(name, first.scene, first.sampling)
    other = replace(first, scene=scene, sampling=sampling, parts=Parts.whole(scene.groups))
    view_of_light(other, luminance(2))
    assert len(elements_traced) == 2
    assert len(list(tmp_path.glob("view-sunlit-*"))) == 2


def test_what_is_lost_or_too_large_is_traced_anew(tmp_path, elements_traced, monkeypatch) -> None:
    """Pictures without their sunlit are none; what cannot be kept leaves no file behind."""
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.methods import phase_matrices

    kept = MatrixCache(tmp_path)
    view_of_light(matrices_of(cache=kept), luminance(1))
    (file,) = tmp_path.glob("view-sunlit-*")
    whole = file.read_bytes()
    for left in (None, whole[: len(whole) // 2]):
        file.unlink() if left is None else file.write_bytes(left)
        before = len(elements_traced)
        assert view_of_light(matrices_of(cache=kept), luminance(1)).sunlit is not None
        assert len(elements_traced) == before + 1
        assert file.stat().st_size == len(whole)
    for other in tmp_path.glob("view-*"):
        other.unlink()
    monkeypatch.setattr(phase_matrices, "LARGEST", len(whole) // 2)
    view_of_light(matrices_of(cache=kept), luminance(1))
    assert not list(tmp_path.glob("view-*"))


def test_rooms_with_gloss_keep_the_patches() -> None:
    """What gloss shows of the windows is a matrix of patches for each pixel."""
    import mitsuba_cfs as cfs
    from mitsuba_cfs.trace.kernels.patch_light import PatchLight
    from mitsuba_cfs.trace.pictures.annual import view_matrices

    groups = rooms.test_room()[1]
    room = black_room(cfs.Gloss((0.04, 0.04)))[1]
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=VIEW)
    assert room.glossy and not few_pictures(cfs.phase_matrices(scene, needs=()), 1)
    light = np.ones((145, 1), dtype=np.float32)
    with pytest.raises(ValueError, match="gloss"):
        view_matrices(room, groups, VIEW, samples=1, light=PatchLight(light, light))
