"""A blind's tensor tree before clear glazing, as the methods take it; and the glazing alone."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.trace.bins import DirectionBins
from mitsuba_cfs.trace.lit_room import AngularBeam, System
from scenes.methods.place import Fenestration


class Glass:
    """Clear glazing on the room side of a layer: its transmittance, and what comes back from it."""

    def __init__(self, beam: AngularBeam, gain: NDArray[np.float64], basis: KlemsBasis) -> None:
        """From the glazing's transmittance and a factor [K] for each patch of outdoor directions.

        The factor makes up for the light that layer and glazing throw at each other.
        """
        self.beam, self._bins, self.key = beam, DirectionBins(basis), np.asarray(gain)
        self._gain = mi.Float(np.asarray(gain, dtype=np.float32))

    def factor(self, outdoors: mi.Vector3f, indoors: mi.Vector3f) -> mi.Float:
        """By what the layer's BSDF is multiplied, for local directions on both sides (z > 0)."""
        gain = dr.gather(mi.Float, self._gain, self._bins.index(outdoors))
        return gain * self.beam.at(indoors)


class TreeBehind:
    """A tensor tree's layer before clear glazing, with the methods of `Scattering`.

    As `bsdf` of a `System` it is asked for the light that paths from both sides meet, and as its
    `beam` for what goes straight on.
    """

    def __init__(self, tree: TensorTreeBsdf, glass: Glass) -> None:
        """From the layer's tree of rank 4; its through peak is a beam."""
        self._local = mi.load_dict(tensor_tree_plugin(tree, up=(0, 1, 0), peak=True))
        self._tree = mi.load_dict(tensor_tree_plugin(tree, peak=True))  # in world axes
        self._glass = glass
        self.key = tree, glass.key
        self._scatter = mi.BSDFContext()
        self._scatter.type_mask = int(mi.BSDFFlags.GlossyReflection) | int(
            mi.BSDFFlags.GlossyTransmission
        )
        self._from_sun = mi.BSDFContext(mi.TransportMode.Importance)

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.direct_sun.Scattering`."""
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(outward))
        si.n = mi.Normal3f(0, 0, 1)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.wi = -outward
        value = self._local.eval(self._scatter, si, sun)[0] / dr.maximum(sun.z, 1e-6)
        return value * self._glass.factor(sun, outward)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `mitsuba_cfs.trace.direct_sun.Scattering`."""
        known = mi.Vector3f(sun)
        straight = self._local.through(self._from_sun, known, known.z > 0)
        return straight * self._glass.beam.at(known)

    def at(self, local: mi.Vector3f) -> mi.Float:
        """The straight beam's share, as of `AngularBeam`."""
        return self.through(dr.mulsign(local, local.z))

    def eval(self, _context, si, wo, active=True):
        """As a BSDF's: value times cosine, in the interaction's frame."""
        return self._tree.eval(self._scatter, si, wo, active) * self._passed(si, wo)

    def sample(self, _context, si, choice, u, active=True):
        """As a BSDF's."""
        drawn, weight = self._tree.sample(self._scatter, si, choice, u, active)
        return drawn, weight * self._passed(si, drawn.wo)

    def _passed(self, si, wo: mi.Vector3f) -> mi.Float:
        """What the glazing lets through of light from `wo` to `si.wi`, or the other way."""
        factor = mi.Float(1)
        for way, other in ((si.wi, wo), (wo, si.wi)):
            outdoors = other.z > 0
            turn = self._tree.turn(si)
            outside = self._tree.to_window(mi.Vector3f(other), turn)
            through = self._glass.factor(outside, way)
            within = self._glass.beam.at(way)
            factor *= dr.select(way.z < 0, dr.select(outdoors, through, within), 1.0)
        return factor


def tree_fenestration(
    klems: KlemsBsdf,
    tree: TensorTreeBsdf,
    glass: AngularBeam,
    gain: NDArray[np.float64],
    mirrors: tuple[AngularBeam | None, AngularBeam | None] = (None, None),
) -> Fenestration:
    """A layer known by a tensor tree before clear glazing known by its transmittance.

    Args:
        klems: matrices of layer and glazing together, for the phase methods.
        gain: [K] see `Glass`; mirrors: see `System`.
    """
    way = TreeBehind(tree, Glass(glass, gain, KLEMS_FULL))
    return Fenestration(klems.transmission_matrix(), way, System(way, way, mirrors))
