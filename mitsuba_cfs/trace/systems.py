"""A fenestration system's BSDF as the kernels take it: for the direct sun, and for paths."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import specular_exponent, through_peak
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_peak import without_beam
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.trace.direct_sun import KlemsScattering, PluginScattering
from mitsuba_cfs.trace.lit_room import AngularBeam, PatchBeam, PathOptics
from mitsuba_cfs.trace.sun_discs import Scattering

WINDOW_UP = (0, 1, 0)  # of a plugin that is asked in the window's own frame


def sun_scattering(bsdf: Bsdf, angular: AngularTable | None = None) -> Scattering:
    """How a system passes the sun, its through beam kept apart.

    Args: angular: what the beam of a specular system has, in place of the data's patches.
    """
    if isinstance(bsdf, TensorTreeBsdf):
        found: Scattering = TreeScattering(bsdf)
    else:
        peak = through_peak(bsdf.filled().transmission_front, bsdf.basis_in)
        exponent = None if angular is not None else specular_exponent(peak, bsdf.basis_in)
        beams = bsdf.basis_in, peak.scattered, peak.transmittance, exponent
        found = KlemsScattering(*beams)
    return found if angular is None else SpecularScattering(found, angular)


def lit_system(bsdf: Bsdf, angular: AngularTable | None = None) -> PathOptics:
    """A system for paths that cross it either way, its through beam kept apart.

    The beam towards the room stands for that of the other direction too.

    Args: angular: as for `sun_scattering`; reflectances that it has are those of mirrors.
    """
    if angular is not None:
        return _specular_system(bsdf, angular)
    if isinstance(bsdf, TensorTreeBsdf):
        return PathOptics(_loaded(tensor_tree_plugin(without_beam(bsdf))), TreeBeam(bsdf))
    front = through_peak(bsdf.filled().transmission_front, bsdf.basis_in)
    beam = PatchBeam(bsdf.basis_in, front.transmittance, specular_exponent(front, bsdf.basis_in))
    return PathOptics(_loaded(klems_plugin(without_peaks(bsdf, "transmission"))), beam)


def without_peaks(bsdf: KlemsBsdf, *kinds: str) -> KlemsBsdf:
    """Klems matrices without what goes straight on ("transmission") or is mirrored."""
    full = bsdf.filled()
    blocks = {f"{kind}_{side}": None for kind in kinds for side in ("front", "back")}
    for name in blocks:
        block = getattr(full, name)
        blocks[name] = None if block is None else through_peak(block, full.basis_in).scattered
    return replace(full, **blocks)


def _specular_system(bsdf: Bsdf, angular: AngularTable) -> PathOptics:
    """A specular system by its exact function; only what scatters is left to the data."""
    mirrors, kinds = [], ["transmission"]
    for values in (angular.reflectance_front, angular.reflectance_back):
        mirrors.append(None if values is None else AngularBeam(angular.by_cosine(values, 1.0)))
    if None not in mirrors:
        kinds.append("reflection")
    else:
        mirrors = [None, None]  # the data's, on both sides
    beam = AngularBeam(angular.by_cosine())
    if isinstance(bsdf, TensorTreeBsdf):
        trees = without_beam(bsdf)
        if "reflection" in kinds:
            trees = TensorTreeBsdf(
                transmission_front=trees.transmission_front,
                transmission_back=trees.transmission_back,
            )
        return PathOptics(_loaded(tensor_tree_plugin(trees)), beam, tuple(mirrors))
    rest = without_peaks(bsdf, *kinds)
    if not any(block is not None and block.any() for block in rest.blocks().values()):
        return PathOptics(None, beam, tuple(mirrors))
    return PathOptics(_loaded(klems_plugin(rest)), beam, tuple(mirrors))


class SpecularScattering:
    """A specular system by its exact function; what scatters is the data's."""

    def __init__(self, rest: Scattering, angular: AngularTable) -> None:
        """From the data's way and the system's function."""
        shares = angular.by_cosine()
        self._rest, self._beam = rest, AngularBeam(shares)
        self.key: object = ("specular", rest.key, shares)

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._rest.scattered(sun, outward)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._beam.at(sun)


class AngularScattering:
    """What passes by its angle of incidence alone: straight on, and scattered evenly."""

    def __init__(self, straight: ArrayLike, scattered: ArrayLike) -> None:
        """From shares [n], [m] at even steps of the cosine of incidence, 0 to 1."""
        self._straight, self._scattered = AngularBeam(straight), AngularBeam(scattered)
        self.key: object = ("angular", np.asarray(straight), np.asarray(scattered))

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._scattered.at(sun) * dr.inv_pi + dr.zeros(mi.Float, dr.width(outward))

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._straight.at(sun)


class TreeBeam:
    """The share of light that keeps its beam in a tensor tree."""

    def __init__(self, tree: TensorTreeBsdf) -> None:
        self.bsdf = _loaded(tensor_tree_plugin(tree, up=WINDOW_UP, peak=True))

    def at(self, local: mi.Vector3f) -> mi.Float:
        """Share at local directions of light that passes along the line of `local`."""
        into_room = -dr.mulsign(local, local.z)
        return self.bsdf.through(mi.BSDFContext(), into_room, mi.Bool(True))


class TreeScattering(PluginScattering):
    """A tensor tree in window axes, its through beam kept apart."""

    def __init__(self, tree: TensorTreeBsdf) -> None:
        self._beam = TreeBeam(tree)
        super().__init__(self._beam.bsdf, key=tree)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._beam.at(sun)


def _loaded(entry: dict) -> mi.BSDF:
    """The BSDF of a `load_dict` entry; making the entry has chosen the variant."""
    return mi.load_dict(entry)
