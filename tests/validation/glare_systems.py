"""A blind's tensor tree before clear glazing, as the methods take it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics
from mitsuba_cfs.trace.kernels.scattering import AngularBeam, KlemsScattering
from mitsuba_cfs.trace.paths.scene import PathOptics


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
        self._tree = mi.load_dict(tensor_tree_plugin(tree, peak=True))  # in world axes
        self._between = mi.load_dict(klems_plugin(between))
        nothing = between.transmission_front.sum(axis=0) * 0
        self._sun_between = KlemsScattering(KLEMS_FULL, between.transmission_front, nothing)
        self._glass = glass
        self.key = tree, between
        self._scatter = mi.BSDFContext()
        self._scatter.type_mask = int(mi.BSDFFlags.GlossyReflection) | int(
            mi.BSDFFlags.GlossyTransmission
        )
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
        layer = self._tree.eval(self._scatter, si, wo, active) * self._passed(si.wi, wo)
        return layer + self._between.eval(context, si, wo, active)

    def sample(self, context, si, choice, u, active=True):
        """As a BSDF's: one of the two parts, each half the time."""
        first = choice < 0.5
        choice = 2 * choice - dr.select(first, 0.0, 1.0)
        drawn, weight = self._tree.sample(self._scatter, si, choice, u, active)
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
