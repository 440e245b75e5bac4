"""Simplified glare: direct-only pictures, illuminance of its own, and the three methods at one."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.glare.annual import annual_glare, full_picture
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.indices import simplified_dgp
from mitsuba_cfs.methods import UnknownMethodError
from mitsuba_cfs.methods.glare import metric_values
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from tests.glare.test_annual import VIEW, made_up


def test_edgp_takes_the_sources_of_the_picture_and_the_illuminance_given():
    pictures = made_up(4)
    own = np.array([500.0, 1500.0, 3000.0, 6000.0])
    found = annual_glare(pictures, illuminance=own).dgp
    values = pictures.values(np.arange(4))
    for h in range(4):
        picture = full_picture(values[h], pictures.pixels, VIEW)
        alone = evaluate(picture, VIEW, illuminance=float(own[h]))
        assert found[h] == pytest.approx(alone.dgp, rel=1e-12)
    assert not np.allclose(found, annual_glare(pictures).dgp, rtol=0.01)
    with pytest.raises(ValueError, match="illuminance"):
        annual_glare(pictures, illuminance=own[:3])


def test_sdgp_is_wienolds_line_and_at_most_one():
    found = [simplified_dgp(E) for E in (0.0, 1000.0, 20_000.0)]
    assert found == pytest.approx([0.184, 0.2462, 1.0])


@pytest.mark.parametrize(("scale", "same"), [(0.0, True), (1.0, False)])
def test_a_direct_view_leaves_out_what_the_room_reflects_twice(variant, scale, same):
    """The pictures of eDGP: a part of the whole ones, pixel by pixel, as the seed is the same."""
    from mitsuba_cfs.methods.scene import DaylightScene, Sampling
    from tests.trace import rooms

    room, groups = rooms.test_room(scale)
    scene = DaylightScene(room, rooms.NOTHING, groups, view=VIEW)
    traced = phase_matrices(scene, Sampling(view_samples=4), needs=["DGP", "eDGP"])
    luminance = np.ones((1, 145, 1))
    whole, part = (m.three_phase(luminance).values(np.array([0])) for m in (traced.view, traced.direct_view))
    assert np.all(part <= whole * (1 + 1e-5))
    if same:
        assert part == pytest.approx(whole, abs=1e-6)
    else:
        assert traced.view.seen.sum() < part.sum() < 0.97 * whole.sum()


@pytest.fixture(scope="module")
def place(variant):
    """The benchmark's room in small, and its window."""
    from dataclasses import replace

    from mitsuba_cfs.methods.scene import Sampling
    from scenes.cost.reference import reference_scene, reference_sky, reference_system

    scene = reference_scene(96)
    scene = replace(scene, points=scene.points[::20], normals=scene.normals[::20])
    sampling = Sampling(view_samples=8, picture_samples=8, sensor_samples=4096, hour_samples=4096, patch_samples=1024)
    return scene, reference_system(), reference_sky(sampling, 2), sampling


@pytest.mark.parametrize(
    "metric", ["eDGP", "illuminance", *(pytest.param(m, marks=pytest.mark.slow) for m in ("DGP", "sDGP"))]
)
def test_the_methods_agree_on_every_metric_behind_a_blind(place, metric):
    from mitsuba_cfs.methods import METHODS

    scene, system, sky, sampling = place
    found = {}
    for method in METHODS:
        light = daylight(scene, [[system]], sky, method=method, sampling=sampling)
        found[method] = metric_values(light, metric)
    reference = found["point-in-time"]
    for method in METHODS[:2]:
        # windows are black to the room in the phase methods, which take 2 to 6 % of the light;
        # two hours of sun behind slats that let little of its beam through
        if metric == "illuminance":
            assert found[method].mean() / reference.mean() == pytest.approx(0.96, abs=0.08)
        else:
            assert found[method] == pytest.approx(reference, abs=0.03)


def test_a_method_that_there_is_not_is_refused(place):
    scene, system, sky, sampling = place
    with pytest.raises(UnknownMethodError, match="two-phase"):
        daylight(scene, [[system]], sky, method="two-phase")
    light = daylight(scene, [[system]], sky, sampling=sampling, needs=())
    with pytest.raises(UnknownMethodError, match="UGR"):
        metric_values(light, "UGR")
    with pytest.raises(UnknownMethodError, match="lux"):
        phase_matrices(scene, sampling, needs=["lux"])


def test_costs_predict_a_study(place):
    from scenes.cost.measure import Cost, measure

    scene, system, sky, sampling = place
    cost = Cost("five-phase", "DGP", 10.0, 2.0, 0.5)
    assert cost.seconds(100, systems=3, scenes=2) == 2 * (10 + 3 * (2 + 50))
    found = measure(scene, system, sky, sampling, methods=["three-phase"], metrics=["sDGP"])
    assert len(found) == 1 and found[0].per_scene > found[0].per_step > 0
    assert Cost(**found[0].record()) == found[0]
