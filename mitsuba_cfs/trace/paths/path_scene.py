"""A room ready to be traced under one sky: both sides of its windows, their systems, the sky."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.directions import normalize
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import SkyBins
from mitsuba_cfs.trace.kernels.scattering import AngularBeam, PatchBeam
from mitsuba_cfs.trace.kernels.scene import TracedScene


class PathOptics:
    """How a window group passes light: a straight beam, mirrors, and a BSDF for the rest."""

    def __init__(
        self,
        bsdf: mi.BSDF | None = None,
        beam: AngularBeam | PatchBeam | None = None,
        mirrors: tuple[AngularBeam | None, AngularBeam | None] = (None, None),
    ) -> None:
        """From a plugin that scatters, without the peak that `beam` stands for.

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
    """A sky without its sun on Reinhart patches, and the sun as a disc: one value for each row."""

    columns = 1

    def __init__(self, patches: ArrayLike, sun: ArrayLike, sun_radiance: float) -> None:
        """From patch radiances [P] (the ground first), sun direction [3] and disc radiance."""
        patches = np.asarray(patches, dtype=np.float32)
        reinhart, towards = ReinhartSky.of_size(len(patches)), normalize(sun)
        self.bins = SkyBins(reinhart)
        self.radiance = mi.Float(patches)
        self.sun = mi.Vector3f(*(dr.opaque(mi.Float, float(v)) for v in towards))
        self.sun_radiance = dr.opaque(mi.Float, float(sun_radiance) if towards[2] > 0 else 0.0)

    def add(
        self, result: mi.Float64, row: mi.UInt32, direction: mi.Vector3f, beta: mi.Float,
        active: mi.Bool,
    ) -> None:  # fmt: skip
        """Add what paths that leave to the sky bring to their rows of `result`."""
        light = dr.gather(mi.Float, self.radiance, self.bins.index(direction), active)
        dr.scatter_add(result, mi.Float64(beta * light), row, active)


class PatchSky:
    """A sky of unit radiance without a sun, told apart by its patches: P values for each row."""

    def __init__(self, subdivision: int) -> None:
        """From Reinhart's MF."""
        self.bins = SkyBins(ReinhartSky(subdivision))
        self.columns = self.bins.size
        self.sun, self.sun_radiance = mi.Vector3f(0, 0, 1), mi.Float(0)

    def add(
        self, result: mi.Float64, row: mi.UInt32, direction: mi.Vector3f, beta: mi.Float,
        active: mi.Bool,
    ) -> None:  # fmt: skip
        """Add what paths bring to the patch of their row that they leave to."""
        slot = row * self.columns + self.bins.index(direction)
        dr.scatter_add(result, mi.Float64(beta), slot, active)


class LitRoom:
    """The scenes on both sides of the windows, and the systems in them."""

    def __init__(
        self,
        interior: Surfaces,
        exterior: Surfaces,
        groups: Sequence[WindowGroup],
        systems: Sequence[PathOptics],
    ) -> None:
        """Build both scenes; they share the origin of their coordinates."""
        if len(systems) != len(groups):
            raise ValueError(f"{len(systems)} systems for {len(groups)} window groups")
        self.inside = TracedScene(interior, groups)
        self.outside = TracedScene(exterior, groups)
        self.systems = tuple(systems)
        self.glossy = self.inside.gloss is not None or self.outside.gloss is not None
