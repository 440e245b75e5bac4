"""The glare experiment of the dissertation's 3.2.3 by computation: room, eye, sunny days, systems.

The room is that of its Table 1, to the south-west; the eye is on the middle line, 1.5 m before the
facade, and looks at it.  The "measurement" is the same room with the slats as geometry.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.generate import generate_klems, generate_tensor_tree
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics, SystemOptics
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.scattering import AngularBeam
from mitsuba_cfs.trace.paths.scene import PathOptics
from tests.validation import blind_room
from tests.validation.glare_systems import tree_optics

EYE_HEIGHT = 1.2  # [m]
DIFFUSE = 5_000.0  # [lx] horizontal: hours below it are left out
COSINE = np.linspace(0, 1, 64)


def glare_scene(size: int, distance: float = 1.5) -> DaylightScene:
    """The room, seen from `distance` [m] before the facade at 1.2 m above the floor."""
    scene = blind_room.test_room()
    inward = -scene.groups[0].frame[2]
    middle = scene.groups[0].windows[0].triangles.reshape(-1, 3).mean(axis=0) * [1, 1, 0]
    eye = middle + distance * inward + [0, 0, EYE_HEIGHT]
    view = fisheye(eye, -inward, size)
    return DaylightScene(
        scene.interior, blind_room.empty(), scene.groups, scene.points, scene.up, view
    )


def glazing() -> PathOptics:
    """The double glazing alone: a beam and two mirrors."""
    mirrors = tuple(
        AngularBeam(blind_room.glass_reflectance(COSINE, normal))
        for normal in (blind_room.GLASS_FRONT, blind_room.GLASS_BACK)
    )
    return PathOptics(None, AngularBeam(blind_room.glass_transmittance(COSINE)), mirrors)


def measurement(
    scene: DaylightScene, exterior: Surfaces, sky: AnnualSky, sampling: Sampling
) -> PathLight:
    """The room with everything as geometry, path-traced."""
    scene = replace(scene, exterior=exterior)
    return PathLight(scene, [[MatrixOptics(paths=glazing())]] * len(scene.groups), sky, sampling)


def known_system(
    layer: PeriodicLayer | None, *, levels: int = 5, samples: int = 4096
) -> SystemOptics:
    """What the methods know: Klems matrices, and the layer's tensor tree before the glazing.

    The light that layer and glazing throw at each other, which the matrices hold, is added to the
    tree on Klems patches.
    """
    glass = blind_room.glass_klems()
    if layer is None:
        return BsdfOptics(glass)
    klems = generate_klems(layer, samples=16 * samples, seed=1).bsdf[0]
    both = combine_layers([klems, glass]).bsdf
    tree, _ = generate_tensor_tree(layer, levels, samples=samples, seed=1)
    system = glazing()
    return tree_optics(both, tree[0], system.beam, _between(klems, both), (None, system.mirrors[1]))


def _between(layer: KlemsBsdf, both: KlemsBsdf) -> KlemsBsdf:
    """What layer and glazing transmit together beyond the layer's light through the glazing."""
    tau = blind_room.glass_transmittance(KLEMS_FULL.incident_directions()[:, 2])
    front = both.transmission_front - tau[:, None] * layer.transmission_front
    back = both.transmission_back - tau[None, :] * layer.transmission_back
    nothing = np.zeros_like(front)
    return KlemsBsdf(
        KLEMS_FULL, KLEMS_FULL, np.maximum(front, 0), np.maximum(back, 0), nothing, nothing
    )


def sunny_days(weather: Weather, month: int, day: int, count: int) -> NDArray[np.int64]:
    """Days of the year [count] with the most direct sun within a fortnight of a date."""
    series = sky_series(weather)
    of_day = series.direct_normal.reshape(-1, weather.per_day).sum(axis=1)
    dates = weather.midpoints[:: weather.per_day]
    target = int(np.flatnonzero((dates.month == month) & (dates.day == day))[0])
    near = np.arange(max(0, target - 14), min(len(of_day), target + 15))
    return np.sort(near[np.argsort(-of_day[near], kind="stable")[:count]])


def lit_hours(weather: Weather, days: NDArray[np.int64], every: int) -> NDArray[np.int64]:
    """Every `every`-th daylit hour of some days."""
    steps = weather.per_day
    bright = sky_series(weather).diffuse_horizontal > DIFFUSE
    hours = (days[:, None] * steps + np.arange(0, steps, every)).ravel()
    return hours[bright[hours]]
