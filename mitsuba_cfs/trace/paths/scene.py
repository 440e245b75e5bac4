"""Scenes, window systems and skies for path tracing under one sky."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import specular_exponent, through_peak, without_beam
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.directions import normalize
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import SkyBins
from mitsuba_cfs.trace.kernels.scattering import WINDOW_UP, AngularBeam, PatchBeam, TreeBeam, loaded
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.specular_paths import SpecularPath, mirror_sequences


class PathOptics:
    """Optics of a window group: a straight beam, specular reflectances, and a BSDF for the rest."""

    def __init__(
        self,
        bsdf: mi.BSDF | None = None,
        beam: AngularBeam | PatchBeam | None = None,
        mirrors: tuple[AngularBeam | None, AngularBeam | None] = (None, None),
    ) -> None:
        """From the plugin of the scattered light in window axes, without the straight `beam`.

        Args: mirrors: specular reflectance of the front (outdoors) and of the back.
        """
        self.bsdf, self.beam, self.mirrors = bsdf, beam, mirrors

    def straight(self, local: mi.Vector3f) -> mi.Float:
        """Transmittance of the straight beam."""
        return mi.Float(0) if self.beam is None else self.beam.at(local)

    def mirrored(self, local: mi.Vector3f) -> mi.Float:
        """Specular reflectance for a ray along `local`: outwards (z > 0) it meets the back."""
        front, back = (mi.Float(0) if m is None else m.at(local) for m in self.mirrors)
        return dr.select(local.z > 0, back, front)


class Sky:
    """A sky on Reinhart patches without its sun, and the sun as a disc: one value for each row."""

    columns = 1

    def __init__(self, patches: ArrayLike, sun: ArrayLike, sun_radiance: float) -> None:
        """From patch radiances [P] (the ground first), sun direction [3] and disc radiance."""
        patches = np.asarray(patches, dtype=np.float32)
        reinhart, towards = ReinhartSky.of_size(len(patches)), normalize(sun)
        self.bins = SkyBins(reinhart)
        self.radiance = mi.Float(patches)
        self.sun = mi.Vector3f(*(dr.opaque(mi.Float, float(v)) for v in towards))
        self.sun_radiance = dr.opaque(mi.Float, float(sun_radiance) if towards[2] > 0 else 0.0)

    def add(self, result: mi.Float64, row: mi.UInt32, direction: mi.Vector3f, beta: mi.Float, active: mi.Bool) -> None:
        """Add the light of paths that leave to the sky to their rows of `result`."""
        light = dr.gather(mi.Float, self.radiance, self.bins.index(direction), active)
        dr.scatter_add(result, mi.Float64(beta * light), row, active)


class PatchSky:
    """A sky of unit radiance without a sun, by patches: P values for each row."""

    def __init__(self, subdivision: int) -> None:
        """From Reinhart's MF."""
        self.bins = SkyBins(ReinhartSky(subdivision))
        self.columns = self.bins.size
        self.sun, self.sun_radiance = mi.Vector3f(0, 0, 1), mi.Float(0)

    def add(self, result: mi.Float64, row: mi.UInt32, direction: mi.Vector3f, beta: mi.Float, active: mi.Bool) -> None:
        """Add the weight of paths to the sky patch of their row that they leave to."""
        slot = row * self.columns + self.bins.index(direction)
        dr.scatter_add(result, mi.Float64(beta), slot, active)


class PathTracingScene:
    """The scenes on both sides of the windows, and the systems in the windows."""

    def __init__(
        self, interior: Surfaces, exterior: Surfaces, groups: Sequence[WindowGroup], systems: Sequence[PathOptics]
    ) -> None:
        """Build both scenes; they share the origin of their coordinates."""
        if len(systems) != len(groups):
            raise ValueError(f"{len(systems)} systems for {len(groups)} window groups")
        self.inside = TracedScene(interior, groups)
        self.outside = TracedScene(exterior, groups)
        self.systems = tuple(systems)
        self.glossy = self.inside.gloss is not None or self.outside.gloss is not None
        sequences = mirror_sequences(self.outside)
        self.mirror_paths = [SpecularPath(self.outside, planes) for planes in sequences]


def path_optics(bsdf: Bsdf, angular: AngularTable | None = None) -> PathOptics:
    """Optics of a system for paths in both directions, its straight beam separate.

    The transmittance of the beam is that of light towards the room in both directions.

    Args: angular: as for `sun_scattering`; its reflectances are specular.
    """
    if angular is not None:
        return _specular_system(replace(bsdf, see_through=1.0), angular)
    if isinstance(bsdf, TensorTreeBsdf):
        return PathOptics(loaded(tensor_tree_plugin(without_beam(bsdf), up=WINDOW_UP)), TreeBeam(bsdf))
    front = through_peak(bsdf.filled().transmission_front, bsdf.basis_in, bsdf.see_through)
    beam = PatchBeam(bsdf.basis_in, front.transmittance, specular_exponent(front, bsdf.basis_in))
    return PathOptics(loaded(klems_plugin(without_peaks(bsdf, "transmission"), up=WINDOW_UP)), beam)


def without_peaks(bsdf: KlemsBsdf, *kinds: str) -> KlemsBsdf:
    """Klems matrices without the peak in "transmission", "reflection" or both."""
    full = bsdf.filled()
    blocks = {f"{kind}_{side}": None for kind in kinds for side in ("front", "back")}
    for name in blocks:
        block = getattr(full, name)
        share = bsdf.see_through if name.startswith("transmission") else None
        if block is not None:
            blocks[name] = through_peak(block, full.basis_in, share).scattered
    return replace(full, **blocks)


def _specular_system(bsdf: Bsdf, angular: AngularTable) -> PathOptics:
    """A specular system by its exact angular function; scattered light from the data."""
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
                transmission_front=trees.transmission_front, transmission_back=trees.transmission_back
            )
        return PathOptics(loaded(tensor_tree_plugin(trees, up=WINDOW_UP)), beam, tuple(mirrors))
    rest = without_peaks(bsdf, *kinds)
    if not any(block is not None and block.any() for block in rest.blocks().values()):
        return PathOptics(None, beam, tuple(mirrors))
    return PathOptics(loaded(klems_plugin(rest, up=WINDOW_UP)), beam, tuple(mirrors))
