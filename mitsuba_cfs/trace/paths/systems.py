"""A fenestration system's BSDF as path tracing takes it."""

from __future__ import annotations

from dataclasses import replace

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import specular_exponent, through_peak
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_peak import without_beam
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.trace.kernels.scattering import AngularBeam, PatchBeam, TreeBeam, loaded
from mitsuba_cfs.trace.paths.path_scene import PathOptics


def lit_system(bsdf: Bsdf, angular: AngularTable | None = None) -> PathOptics:
    """A system for paths that cross it either way, its through beam kept apart.

    The beam towards the room stands for that of the other direction too.

    Args: angular: as for `sun_scattering`; reflectances that it has are those of mirrors.
    """
    if angular is not None:
        return _specular_system(bsdf, angular)
    if isinstance(bsdf, TensorTreeBsdf):
        return PathOptics(loaded(tensor_tree_plugin(without_beam(bsdf))), TreeBeam(bsdf))
    front = through_peak(bsdf.filled().transmission_front, bsdf.basis_in)
    beam = PatchBeam(bsdf.basis_in, front.transmittance, specular_exponent(front, bsdf.basis_in))
    return PathOptics(loaded(klems_plugin(without_peaks(bsdf, "transmission"))), beam)


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
        return PathOptics(loaded(tensor_tree_plugin(trees)), beam, tuple(mirrors))
    rest = without_peaks(bsdf, *kinds)
    if not any(block is not None and block.any() for block in rest.blocks().values()):
        return PathOptics(None, beam, tuple(mirrors))
    return PathOptics(loaded(klems_plugin(rest)), beam, tuple(mirrors))
