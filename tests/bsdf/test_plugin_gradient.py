"""The tables of both plugins are differentiable parameters of a scene."""

from __future__ import annotations

import numpy as np
import pytest
from plugin_setup import UP, context, interaction, random_directions, to_mitsuba
from test_tensor_plugin import system

from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBsdf

STEP = 0.05
NAMES = {"klems": "matrices", "tree 3": "leaves", "tree 4": "leaves"}


def entry(kind: str) -> dict:
    """A plugin that scatters unevenly to all sides."""
    if kind == "klems":
        from mitsuba_cfs.bsdf.plugin import klems_plugin

        random, size = np.random.default_rng(7), KLEMS_QUARTER.size
        blocks = [random.uniform(0.02, 0.12, (size, size)) for _ in range(4)]
        return klems_plugin(KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, *blocks), up=UP)
    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    return tensor_tree_plugin(system(int(kind[-1])), up=UP)


@pytest.mark.parametrize("kind", NAMES)
def test_the_gradient_is_that_of_a_linear_function(variant, kind):
    import drjit as dr
    import mitsuba as mi

    bsdf = mi.load_dict(entry(kind))
    parameters = mi.traverse(bsdf)
    table = parameters[NAMES[kind]]
    si, _ = interaction(random_directions(2000, 1))
    wo = to_mitsuba(random_directions(2000, 2))
    before = np.array(bsdf.eval(context("Radiance"), si, wo)).ravel()
    dr.enable_grad(table)
    value = bsdf.eval(context("Radiance"), si, wo)
    np.testing.assert_allclose(np.array(value).ravel(), before, rtol=1e-6)  # its own numbers
    dr.backward(dr.sum(value, axis=None))
    slope, numbers = dr.grad(table).numpy(), table.numpy()
    assert np.isclose((slope * numbers).sum(), before.sum(), rtol=1e-4)
    assert 0 < np.count_nonzero(slope) < slope.size / 2 + 1  # light from the camera's side alone


@pytest.mark.parametrize("kind", NAMES)
def test_a_changed_table_changes_the_light_and_not_the_directions(variant, kind):
    import mitsuba as mi

    bsdf = mi.load_dict(entry(kind))
    si, _ = interaction(np.tile(random_directions(1, 3), (1000, 1)))
    u = np.random.default_rng(5).uniform(size=(3, 1000)).astype(np.float32)
    drawn = bsdf.sample(context("Radiance"), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    parameters = mi.traverse(bsdf)
    parameters[NAMES[kind]] = parameters[NAMES[kind]] * 2.0
    parameters.update()
    again = bsdf.sample(context("Radiance"), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    np.testing.assert_array_equal(np.array(again[0].wo), np.array(drawn[0].wo))
    np.testing.assert_allclose(np.array(again[1]), 2.0 * np.array(drawn[1]), rtol=1e-5)


def scene(kind: str):
    """A pane before a bright lamp, a floor that it lights, and a camera that looks at the floor."""
    import mitsuba as mi

    at = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "pane": {
                "type": "rectangle",
                "to_world": at().look_at(origin=[0, 0, 1], target=[0, -1, 1], up=[0, 0, 1]),
                "bsdf": entry(kind),
            },
            "floor": {
                "type": "rectangle",
                "to_world": at().translate([0, 2, 0]).scale(2.0),
                "bsdf": {"type": "diffuse", "reflectance": 0.5},
            },
            "lamp": {
                "type": "rectangle",
                "to_world": at().look_at(origin=[0.5, -2, 1.5], target=[0, 0, 1], up=[0, 0, 1]),
                "emitter": {"type": "area", "radiance": 10.0},
            },
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": at().look_at(origin=[0, 2.5, 3], target=[0, 1.5, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
            },
            "integrator": {"type": "prb", "max_depth": 4},
        }
    )


@pytest.mark.parametrize("kind", ["klems", "tree 4"])
def test_prb_against_differences(variant, kind):
    import drjit as dr
    import mitsuba as mi

    whole = scene(kind)
    parameters = mi.traverse(whole)
    key = next(name for name in dict(parameters) if name.endswith(NAMES[kind]))
    numbers = mi.TensorXf(parameters[key])

    def light(scale: float) -> float:
        parameters[key] = numbers * scale
        parameters.update()
        return float(mi.render(whole, spp=1024, seed=3).numpy().mean())

    difference = (light(1 + STEP) - light(1 - STEP)) / (2 * STEP)
    parameters[key] = mi.TensorXf(numbers)
    dr.enable_grad(parameters[key])
    parameters.update()
    dr.backward(dr.mean(mi.render(whole, parameters, spp=1024, seed=4), axis=None))
    slope = float((dr.grad(parameters[key]).numpy() * numbers.numpy()).sum())
    assert difference > 0
    assert np.isclose(slope, difference, rtol=0.03)  # noise of 256 pixels with 1,024 paths: 1 %
