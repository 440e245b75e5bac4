"""Trace a few rays with the chosen variant and compare with a closed form.

`cfs doctor` runs this as a process of its own (`python -m scenes.commands.self_test`), so that an
LLVM library that aborts costs a line, not the program. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import time

from mitsuba_cfs import variants

SIDE, DISTANCE = 1.0, 0.5  # a square of 2 * SIDE above a point, parallel to its plane [m]
RAYS = 1_000_000
RAYS_SCALAR = 5_000


def view_factor(side: float = SIDE, distance: float = DISTANCE) -> float:
    """The view factor of a parallel square centred above a point: four times that of a quarter.

    F = 2/pi * 2 * a / sqrt(1 + a^2) * atan(a / sqrt(1 + a^2)) with a = side / distance.

    Source: Siegel and Howell, Thermal Radiation Heat Transfer, configuration factor of a
    differential element to a parallel rectangle with one corner on its normal.
    """
    a = side / distance
    root = math.sqrt(1.0 + a * a)
    return 4.0 / math.pi * a / root * math.atan(a / root)


def traced_view_factor(variant: str, *, seed: int = 1) -> tuple[float, int]:
    """The same, as the share of cosine-distributed rays that hit; and the number of rays."""
    import drjit as dr
    import mitsuba as mi

    to_world = mi.ScalarTransform4f().translate([0, 0, DISTANCE]).scale([SIDE, SIDE, 1])
    scene = mi.load_dict({"type": "scene", "square": {"type": "rectangle", "to_world": to_world}}, parallel=False)
    sampler = mi.load_dict({"type": "independent"})
    if variant.startswith("scalar"):
        sampler.seed(seed)
        hits = sum(_hits(mi, scene, sampler.next_2d()) for _ in range(RAYS_SCALAR))
        return hits / RAYS_SCALAR, RAYS_SCALAR
    sampler.seed(seed, RAYS)
    hit = _hits(mi, scene, sampler.next_2d())
    # dr.minimum is one of the operations at which LLVM 15 and 16 abort on x86 processors
    return float(dr.mean(dr.minimum(mi.Float(dr.select(hit, 1.0, 0.0)), 1.0))[0]), RAYS


def _hits(mi, scene, sample):
    direction = mi.warp.square_to_cosine_hemisphere(sample)
    ray = mi.Ray3f(mi.Point3f(0.0, 0.0, 0.0), direction)
    return scene.ray_intersect_preliminary(ray).is_valid()


def result() -> dict[str, object]:
    """What was chosen, what was traced, what was expected, and whether they agree."""
    choice = variants.choose(vectorised=False)
    variants.activate(choice.variant, vectorised=False)
    start = time.perf_counter()
    traced, rays = traced_view_factor(choice.variant)
    expected = view_factor()
    deviation = math.sqrt(expected * (1.0 - expected) / rays)
    return {
        "variant": choice.variant,
        "reason": choice.reason,
        "rays": rays,
        "traced": traced,
        "expected": expected,
        "agrees": abs(traced - expected) <= 4.0 * deviation,  # one seed in 16 000 fails by chance
        "seconds": time.perf_counter() - start,
    }


if __name__ == "__main__":
    print(json.dumps(result()))
