"""The dissertation's Table 2 remade: phase methods against explicit slats, hour by hour.

    python -m scenes.validation.daylight_methods --weather CITY.epw [--every 10] [--json FILE]

Room of Table 1 (3.65 x 4.60 x 3.00 m, to the south-west), six sensors in its middle line; double
glazing by the Roos model, alone and behind an exterior blind of curved slats at 5, 40 and 70
degrees.  The reference is the same room path-traced with the slats as geometry; the methods know
only BSDFs made from it.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs import phases, variants
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems, generate_tensor_tree
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.sky.matrix import sky_matrix, sky_series
from mitsuba_cfs.sky.sun import is_up
from mitsuba_cfs.sky.weather import Weather, read_epw
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
from mitsuba_cfs.trace.direct_sun import (
    SUN_SOLID_ANGLE,
    KlemsScattering,
    PluginScattering,
    Scattering,
    direct_sun_matrix,
)
from mitsuba_cfs.trace.estimate import Stopping
from mitsuba_cfs.trace.lit_room import AngularBeam, PatchBeam, Room, Sky, System
from mitsuba_cfs.trace.point_in_time import point_in_time
from mitsuba_cfs.trace.view_matrix import view_matrix
from thermal.glazing import roos_angular_factor

GLASS_TRANSMITTANCE, GLASS_BACK, GLASS_FRONT = 0.55, 0.17, 0.19  # Table 1, at normal incidence
SLAT = {"depth": 0.080, "radius": 0.104, "spacing": 0.072}
SLAT_REFLECTANCE = 0.55
BLIND_OFFSET = 0.06  # [m] middle of the slats before the glass
MARGIN = 1.5  # [m] that the slats reach beyond the window: a BSDF knows no edges
TILTS = {"glass": None, "5 degrees": 5.0, "40 degrees": 40.0, "70 degrees": 70.0}
DIM = 50.0  # [lx] hours below this at the reference count no relative error
SUBDIVISION = 4
TREE_LEVELS = 5  # 1,024 cells a hemisphere


@dataclass(frozen=True)
class Scene:
    """The room and its sensors."""

    interior: Surfaces
    groups: list[WindowGroup]
    points: NDArray[np.float64]  # [S, 3]
    up: NDArray[np.float64]  # [S, 3]


@dataclass(frozen=True)
class Hours:
    """The skies of the chosen hours."""

    whole: NDArray[np.float64]  # [P, H] cd/m2, the sun spread over patches
    sky: NDArray[np.float64]  # [P, H] without the sun
    sun: NDArray[np.float64]  # [P, H] the sun alone
    direction: NDArray[np.float64]  # [H, 3]
    luminance: NDArray[np.float64]  # [H] of the disc [cd/m2]


def test_room() -> Scene:
    """The room of Table 1, its facade to the south-west."""
    building = shoebox(
        3.65, 4.60, 3.00,
        windows=(WindowRectangle(0.30, 0.90, 3.05, 1.70),),
        facing_deg=225.0,
        reflectance={"wall": 0.50, "ceiling": 0.80, "roof": 0.80, "floor": 0.34},
    )  # fmt: skip
    space = building.spaces[0]
    groups = window_groups(space)
    inward = -groups[0].frame[2]
    middle = groups[0].windows[0].triangles.reshape(-1, 3).mean(axis=0) * [1, 1, 0]
    points = middle + np.arange(0.6, 4.2, 0.6)[:, None] * inward + [0, 0, 0.85]
    return Scene(
        interior_surfaces(space), groups, points, np.tile([0.0, 0.0, 1.0], (len(points), 1))
    )


def glass_transmittance(cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transmittance [...] of the double glazing at the cosine of incidence."""
    return GLASS_TRANSMITTANCE * roos_angular_factor(np.arccos(np.clip(cosine, 0, 1)))


def glass_reflectance(cosine: NDArray[np.float64], normal: float) -> NDArray[np.float64]:
    """Reflectance [...], which rises from its `normal` value as the transmittance falls."""
    tau = glass_transmittance(cosine)
    return np.minimum(normal + (1 - normal) * (1 - tau / GLASS_TRANSMITTANCE), 1 - tau)


def glass_klems() -> KlemsBsdf:
    """Klems matrices of the double glazing; reflectance rises as the transmittance falls."""
    omega = KLEMS_FULL.projected_solid_angles()
    cosine = KLEMS_FULL.incident_directions()[:, 2]
    tau = glass_transmittance(cosine)
    front, back = (np.diag(glass_reflectance(cosine, r) / omega) for r in (GLASS_FRONT, GLASS_BACK))
    return KlemsBsdf(
        KLEMS_FULL, KLEMS_FULL, np.diag(tau / omega), np.diag(tau / omega), front, back
    )


def slats(group: WindowGroup, tilt_deg: float) -> Surfaces:
    """The blind as geometry before the window, larger than it, and the wall round the window.

    The wall reflects as much as the glass, for a BSDF knows neither edges nor a wall.
    """
    local = group.windows[0].triangles.reshape(-1, 3) @ group.frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    width = high[0] - low[0] + 2 * MARGIN
    layer = venetian_blind(
        plastic("slat", SLAT_REFLECTANCE), tilt=np.radians(tilt_deg), width=width, **SLAT
    )
    count = int(np.ceil((high[1] - low[1] + 2 * MARGIN) / SLAT["spacing"]))
    corner = np.array([low[0] - MARGIN, low[1] - MARGIN, high[2] + BLIND_OFFSET])
    steps = corner + np.arange(count)[:, None] * [0, SLAT["spacing"], 0]
    triangles = (layer.triangles[None] + steps[:, None, None]).reshape(-1, 3, 3)
    wall = _wall(low, high)
    reflectance = np.repeat([SLAT_REFLECTANCE, GLASS_FRONT], [len(triangles), len(wall)])
    return Surfaces(
        np.concatenate([triangles, wall]) @ group.frame,
        reflectance,
        np.zeros(len(reflectance), dtype=np.int64),
    )


def _wall(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [8, 3, 3] of the plane round the rectangle from `low` to `high`, 3 m wide."""
    (x0, y0, z), (x1, y1, _) = low, high
    far = 3.0
    strips = [
        (x0 - far, y0 - far, x1 + far, y0),
        (x0 - far, y1, x1 + far, y1 + far),
        (x0 - far, y0, x0, y1),
        (x1, y0, x1 + far, y1),
    ]
    corners = [[(a, b, z), (c, b, z), (c, d, z), (a, d, z)] for a, b, c, d in strips]
    return np.array([[q[i] for i in order] for q in corners for order in ((0, 1, 2), (0, 2, 3))])


def chosen_hours(weather: Weather, every: int) -> Hours:
    """All sunlit hours of every `every`-th day."""
    series = sky_series(weather)
    day = np.arange(len(weather.times)) // round(24 / weather.step_h)
    lit = (series.diffuse_horizontal > 100) & is_up(series.sun) & (day % every == every // 2)
    hours = np.flatnonzero(lit)

    parts = {
        name: sky_matrix(weather, SUBDIVISION, parts=name)[:, hours] for name in ("sky", "sun")
    }
    luminance = series.direct_normal[hours] / SUN_SOLID_ANGLE

    return Hours(
        parts["sky"] + parts["sun"], parts["sky"], parts["sun"], series.sun[hours], luminance
    )


def empty() -> Surfaces:
    """Nothing outdoors."""
    return Surfaces(np.empty((0, 3, 3)), np.empty(0), np.empty(0, dtype=np.int64))


class BehindBlind:
    """A blind's tensor tree before the glazing: what comes through both without reflections."""

    def __init__(self, layer: PeriodicLayer) -> None:
        tree, _ = generate_tensor_tree(layer, TREE_LEVELS, samples=4096, seed=1)
        self._blind = PluginScattering(mi.load_dict(tensor_tree_plugin(tree[0], up=(0, 1, 0))))
        self._glass = AngularBeam(glass_transmittance(np.linspace(0, 1, 64)))

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.direct_sun.Scattering`."""
        return self._blind.scattered(sun, outward) * self._glass.at(outward)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.direct_sun.Scattering`."""
        return self._blind.through(sun)


def by_phases(
    scene: Scene, system: KlemsBsdf, tree: Scattering | None, hours: Hours
) -> dict[str, NDArray[np.float64]]:
    """Illuminance [S, H] by the three-phase and the five-phase method.

    Args: tree: what passes the sun in the five-phase method; the Klems matrix and its peak if None.
    """
    matrices = {}
    for depth in (32, 1):
        view = view_matrix(
            scene.interior, scene.groups, scene.points, scene.up, samples=16384, max_depth=depth
        )
        daylight = daylight_matrix(
            empty(), scene.groups, subdivision=SUBDIVISION, samples=2048, max_depth=depth
        )
        matrices[depth] = view.values, daylight.values
    transmission = [system.transmission_matrix()]
    whole = phases.three_phase(matrices[32][0], transmission, matrices[32][1], hours.whole)
    direct = phases.three_phase(matrices[1][0], transmission, matrices[1][1], hours.sun)
    peak = through_peak(system.filled().transmission_front, KLEMS_FULL)
    ways = {"five-phase, Klems": KlemsScattering(KLEMS_FULL, peak.scattered, peak.transmittance)}
    if tree is not None:
        ways["five-phase, tensor tree"] = tree
    found = {"three-phase": whole}
    for name, way in ways.items():
        exact = direct_sun_matrix(
            scene.interior, empty(), scene.groups, [way], scene.points, scene.up, hours.direction
        )
        found[name] = phases.five_phase(whole, direct, exact.values, hours.luminance)
    return found


def by_paths(
    scene: Scene, exterior: Surfaces, system: System, hours: Hours, samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance [S, H] by point-in-time paths, and its standard error."""
    room = Room(scene.interior, exterior, scene.groups, [system])
    runs = []
    for h in range(len(hours.luminance)):
        sky = Sky(hours.sky[:, h], hours.direction[h], hours.luminance[h])
        runs.append(
            point_in_time(
                room, sky, scene.points, scene.up, samples=samples, stopping=Stopping(batches=4)
            )
        )
    return tuple(np.stack([getattr(r, name) for r in runs], axis=1) for name in
                 ("values", "standard_error"))  # fmt: skip


def errors(found: NDArray, reference: NDArray) -> dict[str, float]:
    """Relative mean bias and root mean square error [%] of each sensor's hours, and of their mean.

    The mean of the six sensors is what the dissertation's figures 27 to 30 show.
    """
    bright = reference > DIM
    relative = found[bright] / reference[bright] - 1
    lit = reference.mean(axis=0) > DIM
    mean = found.mean(axis=0)[lit] / reference.mean(axis=0)[lit] - 1
    return {
        "rMBE": 100 * float(relative.mean()),
        "rRMSE": 100 * float(np.sqrt(np.mean(relative**2))),
        "rMBE of the sensors' mean": 100 * float(mean.mean()),
        "rRMSE of the sensors' mean": 100 * float(np.sqrt(np.mean(mean**2))),
        "rMBE of sums": 100 * float(found.sum() / reference.sum() - 1),
        "lowest [lx]": float(found.min()),
    }


def one_case(scene: Scene, hours: Hours, tilt_deg: float | None, samples: int) -> dict:
    """All methods against the explicit geometry for one system."""
    cosine = np.linspace(0, 1, 64)
    mirrors = [AngularBeam(glass_reflectance(cosine, r)) for r in (GLASS_FRONT, GLASS_BACK)]
    straight = System(None, AngularBeam(glass_transmittance(cosine)), tuple(mirrors))
    glass = glass_klems()
    exterior, system, tree = empty(), glass, None
    if tilt_deg is not None:
        exterior = slats(scene.groups[0], tilt_deg)
        layer = venetian_blind(plastic("slat", SLAT_REFLECTANCE), tilt=np.radians(tilt_deg), **SLAT)
        blind = generate_klems(layer, samples=65536, seed=1).bsdf[0]
        system = combine_layers([blind, glass]).bsdf
        tree = BehindBlind(layer)
    start = time.monotonic()
    reference, noise = by_paths(scene, exterior, straight, hours, samples)
    seconds = time.monotonic() - start
    found = by_phases(scene, system, tree, hours)
    peak = through_peak(system.filled().transmission_front, KLEMS_FULL)
    # the peak of the block towards the room stands for that of the other direction too
    full = system.filled()
    back = through_peak(full.transmission_back, KLEMS_FULL)
    scattering = KlemsBsdf(
        KLEMS_FULL, KLEMS_FULL, peak.scattered, back.scattered,
        full.reflection_front, full.reflection_back,
    )  # fmt: skip
    beam = PatchBeam(KLEMS_FULL, peak.transmittance)
    klems_system = System(mi.load_dict(klems_plugin(scattering)), beam)
    found["point in time, Klems"] = by_paths(scene, empty(), klems_system, hours, samples)[0]
    return {
        "noise of the reference [%]": 100 * float(np.mean(noise / np.maximum(reference, DIM))),
        "seconds of the reference": round(seconds, 1),
        "hours": reference.shape[1],
        **{name: errors(values, reference) for name, values in found.items()},
    }


def main() -> None:
    """Run all systems and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--weather", type=Path, required=True)
    parser.add_argument("--every", type=int, default=10, help="days from one to the next")
    parser.add_argument("--samples", type=int, default=8192, help="paths of a sensor in a batch")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    variants.activate()
    hours = chosen_hours(read_epw(options.weather), options.every)
    scene, results = test_room(), {}
    for name, tilt in TILTS.items():
        results[name] = one_case(scene, hours, tilt, options.samples)
        print(name, json.dumps(results[name], indent=1))
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
