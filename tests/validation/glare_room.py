"""The glare experiment of the dissertation's 3.2.3 by computation: room, eye, sunny days, systems.

The room is that of its Table 1, to the south-west; the eye is on the middle line, 1.5 m before the
facade, and looks at it.  The "measurement" is the same room with the slats as geometry.
"""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.generate import generate_klems, generate_tensor_tree
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics, SystemOptics
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.scattering import AngularBeam, KlemsScattering
from mitsuba_cfs.trace.paths.scene import PathOptics
from tests.validation import blind_room


class TreeBehind:
    """A tensor tree's layer before clear glazing, with the methods of `Scattering`.

        f = f_tree tau(indoors) + f_between

    where f_between is the light that layer and glazing throw at each other, on Klems patches.  As
    `bsdf` of a `PathOptics` it is asked for the light that paths from both sides meet, and as its
    `beam` for what goes straight on.
    """

    def __init__(self, tree: TensorTreeBsdf, glass: AngularBeam, between: KlemsBsdf) -> None:
        """From the layer's tree of rank 4, whose through peak is a beam."""
        self._local = mi.load_dict(tensor_tree_plugin(tree, up=(0, 1, 0), peak=True))
        self._between = mi.load_dict(klems_plugin(between))
        nothing = between.transmission_front.sum(axis=0) * 0
        self._sun_between = KlemsScattering(KLEMS_FULL, between.transmission_front, nothing)
        self._glass = glass
        self.key = tree, between
        self._scatter = mi.BSDFContext()
        self._scatter.type_mask = int(mi.BSDFFlags.GlossyReflection) | int(mi.BSDFFlags.GlossyTransmission)
        self._from_sun = mi.BSDFContext(mi.TransportMode.Importance)

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.sun.direct.Scattering`."""
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(outward))
        si.n = mi.Normal3f(0, 0, 1)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.wi = -outward
        value = self._local.eval(self._scatter, si, sun)[0] / dr.maximum(sun.z, 1e-6)
        return value * self._glass.at(outward) + self._sun_between.scattered(sun, outward)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.sun.direct.Scattering`."""
        known = mi.Vector3f(sun)
        straight = self._local.through(self._from_sun, known, known.z > 0)
        return straight * self._glass.at(known)

    def at(self, local: mi.Vector3f) -> mi.Float:
        """The straight beam's share, as of `AngularBeam`."""
        return self.through(dr.mulsign(local, local.z))

    def eval(self, context, si, wo, active=True):
        """As a BSDF's: value times cosine, in the interaction's frame."""
        layer = self._local.eval(self._scatter, si, wo, active) * self._passed(si.wi, wo)
        return layer + self._between.eval(context, si, wo, active)

    def sample(self, context, si, choice, u, active=True):
        """As a BSDF's: one of the two parts, each half the time."""
        first = choice < 0.5
        choice = 2 * choice - dr.select(first, 0.0, 1.0)
        drawn, weight = self._local.sample(self._scatter, si, choice, u, active)
        other, other_weight = self._between.sample(context, si, choice, u, active)
        weight = 2 * dr.select(first, weight * self._passed(si.wi, drawn.wo), other_weight)
        drawn.wo = dr.select(first, drawn.wo, other.wo)
        return drawn, weight

    def _passed(self, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Float:
        """What the glazing lets through on its way to or from the room, on either."""
        factor = mi.Float(1)
        for way in (wi, wo):
            factor *= dr.select(way.z < 0, self._glass.at(way), 1.0)
        return factor


def tree_optics(
    klems: KlemsBsdf,
    tree: TensorTreeBsdf,
    glass: AngularBeam,
    between: KlemsBsdf,
    mirrors: tuple[AngularBeam | None, AngularBeam | None] = (None, None),
) -> MatrixOptics:
    """A layer known by a tensor tree before clear glazing known by its transmittance.

    Args:
        klems: matrices of layer and glazing together, for the phase methods.
        between: see `TreeBehind`; mirrors: see `PathOptics`.
    """
    way = TreeBehind(tree, glass, between)
    known = BsdfOptics(klems)
    paths = PathOptics(way, way, mirrors)
    return MatrixOptics(known.transmission, way, paths, known.reflection)


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
    return DaylightScene(scene.interior, blind_room.empty(), scene.groups, scene.points, scene.up, view)


def glazing() -> PathOptics:
    """The double glazing alone: a beam and two mirrors."""
    mirrors = tuple(
        AngularBeam(blind_room.glass_reflectance(COSINE, normal))
        for normal in (blind_room.GLASS_FRONT, blind_room.GLASS_BACK)
    )
    return PathOptics(None, AngularBeam(blind_room.glass_transmittance(COSINE)), mirrors)


def measurement(scene: DaylightScene, exterior: Surfaces, sky: AnnualSky, sampling: Sampling) -> PathLight:
    """The room with everything as geometry, path-traced."""
    scene = replace(scene, exterior=exterior)
    return PathLight(scene, [[MatrixOptics(paths=glazing())]] * len(scene.groups), sky, sampling)


def known_system(layer: PeriodicLayer | None, *, levels: int = 5, samples: int = 4096) -> SystemOptics:
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
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, np.maximum(front, 0), np.maximum(back, 0), nothing, nothing)


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
