"""Transmission of window systems in kernels: scattered light and the straight beam, separately."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import ring_falls, specular_exponent, specular_fall, through_peak
from mitsuba_cfs.bsdf.klems import KlemsBasis
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.traced_klems import cell
from mitsuba_cfs.directions import normalize
from mitsuba_cfs.surfaces import WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import vectors

BEAM_PLACES = 16  # polar angles in a patch, for the mean of a beam; a quarter as many azimuths
FALL_STEPS = 4096  # of the table of a specular system's fall, in cosine
WINDOW_UP = (0, 1, 0)  # of a plugin that is asked in the window's own frame


class Scattering(Protocol):
    """Transmission of a window group in its local frame (z outdoors), in a kernel.

    `key` identifies its values, for `mitsuba_cfs.matrices.cache.digest`.
    """

    key: object

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """BSDF [1/sr] without its through peak, for light from `sun` that leaves to -`outward`."""

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """Transmittance of light that goes straight on."""


def sun_scattering(bsdf: Bsdf, angular: AngularTable | None = None) -> Scattering:
    """Transmission of a system for the sun, scattered light and straight beam separately.

    Args: angular: transmittance of a specular system's beam, in place of the data's patches.
    """
    if isinstance(bsdf, TensorTreeBsdf):
        scattering: Scattering = TreeScattering(bsdf)
    else:
        share = bsdf.see_through if angular is None else 1.0
        peak = through_peak(bsdf.filled().transmission_front, bsdf.basis_in, share)
        exponent = None if angular is not None else specular_exponent(peak, bsdf.basis_in)
        beams = bsdf.basis_in, peak.scattered, peak.transmittance, exponent
        scattering = KlemsScattering(*beams)
    return scattering if angular is None else SpecularScattering(scattering, angular)


class AngularBeam:
    """Transmittance of the straight beam by the angle of incidence alone (clear glass)."""

    def __init__(self, values: ArrayLike) -> None:
        """From the shares [n] at n angles of incidence evenly spaced in cosine, 0 to 1."""
        variants.activate()
        self._values = mi.Float(np.asarray(values, dtype=np.float32))
        self._last = len(np.asarray(values)) - 1

    def at(self, local: mi.Vector3f) -> mi.Float:
        """Share at local directions, linear between the angles."""
        place = dr.clip(dr.abs(local.z), 0, 1) * self._last
        low = cell(place, self._last - 1)
        a, b = (dr.gather(mi.Float, self._values, low + k) for k in (0, 1))
        return dr.lerp(a, b, place - mi.Float(low))


class PatchBeam:
    """Transmittance of the straight beam, interpolated between Klems patches."""

    def __init__(self, basis: KlemsBasis, values: ArrayLike, exponent: float | None = None) -> None:
        """From the shares [K].

        Args: exponent: of a specular system's fall (`specular_exponent`): the shares are means
            over its rings, and between their middles only what they differ from it by is linear.
        """
        self._bins, self._fall = DirectionBins(basis), None
        values = np.asarray(values, dtype=float)
        if exponent is not None:
            cosine = np.linspace(0.0, 1.0, FALL_STEPS)
            self._fall = AngularBeam(specular_fall(np.arccos(cosine), exponent))
            values = values / ring_falls(basis, exponent)[basis.rings]
        self._values = mi.Float(values.astype(np.float32))

    def at(self, local: mi.Vector3f) -> mi.Float:
        """Share at the local directions of light that passes along the line of `local`."""
        outward = dr.mulsign(local, local.z)
        if self._fall is None:
            return self._bins.between(self._values, outward)
        return self._fall.at(outward) * self._bins.between(self._values, outward, ends=False)


class KlemsScattering:
    """A Klems transmission block without its through peak, and the peak as a straight beam.

    Scattered light is constant in a patch.  The straight beam is interpolated between the patch
    centres, as clear glass transmits less and less across a ring.
    """

    def __init__(
        self,
        basis: KlemsBasis,
        scattered: NDArray[np.float64],
        through: NDArray[np.float64],
        exponent: float | None = None,
    ) -> None:
        """From BSDF values [K out, K in] [1/sr] without the peak, and the peak's share [K in].

        Args: exponent: of the fall of a specular system, see `PatchBeam`.
        """
        self.bins = DirectionBins(basis)
        self.table = np.ascontiguousarray(scattered, dtype=np.float32)  # [K out, K in]
        self._values = mi.Float(self.table.ravel())
        self._through = PatchBeam(basis, through, exponent)
        self.basis, self.beams = basis, np.asarray(through, dtype=float)  # [K] as the data have it
        self.key: object = ("klems", basis, np.asarray(scattered), np.asarray(through), exponent or -1.0)

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        row, column = self.bins.index(outward), self.bins.index(sun)
        return dr.gather(mi.Float, self._values, row * self.bins.size + column)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._through.at(sun)


class PluginScattering:
    """A Mitsuba BSDF plugin of this package (Klems matrices or tensor trees) in window axes."""

    def __init__(self, bsdf: mi.BSDF, key: object = None) -> None:
        """From the plugin, loaded with `up` [0, 1, 0]; its through beam stays part of it.

        Args: key: the BSDF file's bytes or the tree, needed only to keep matrices in a cache.
        """
        self._bsdf, self.key = bsdf, key

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(outward))
        si.n = mi.Normal3f(0, 0, 1)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.wi = -outward
        return self._bsdf.eval(mi.BSDFContext(), si, sun)[0] / dr.maximum(sun.z, 1e-6)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return mi.Float(0)


class SpecularScattering:
    """A specular system with an exact angular function; scattered light from the data."""

    def __init__(self, rest: Scattering, angular: AngularTable) -> None:
        """From the data's transmission and the exact angular function."""
        shares = angular.by_cosine()
        self.rest, self._beam = rest, AngularBeam(shares)
        self.key: object = ("specular", rest.key, shares)

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self.rest.scattered(sun, outward)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._beam.at(sun)


class OpenWindow:
    """A window with nothing in it: all of the beam passes, and nothing is scattered."""

    key = "open window"

    def scattered(self, sun: mi.Vector3f, outward: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return dr.zeros(mi.Float, dr.width(sun))

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return dr.full(mi.Float, 1.0, dr.width(sun))


class AngularScattering:
    """Transmission by the angle of incidence alone: a straight beam and diffuse light."""

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
    """Transmittance of the straight beam in a tensor tree."""

    def __init__(self, tree: TensorTreeBsdf) -> None:
        self.bsdf = loaded(tensor_tree_plugin(tree, up=WINDOW_UP, peak=True))

    def at(self, local: mi.Vector3f) -> mi.Float:
        """Share at local directions of light that passes along the line of `local`."""
        into_room = -dr.mulsign(local, local.z)
        return self.bsdf.through(mi.BSDFContext(), into_room, mi.Bool(True))


class TreeScattering(PluginScattering):
    """A tensor tree in window axes without its straight beam, and the beam."""

    def __init__(self, tree: TensorTreeBsdf) -> None:
        self._beam = TreeBeam(tree)
        super().__init__(self._beam.bsdf, key=tree)

    def through(self, sun: mi.Vector3f) -> mi.Float:
        """See `Scattering`."""
        return self._beam.at(sun)


def scattered_by_patches(scattering: Scattering) -> KlemsScattering | None:
    """The Klems data that a system's scattered light follows; None for systems of another kind."""
    if isinstance(scattering, SpecularScattering):
        return scattered_by_patches(scattering.rest)
    return scattering if isinstance(scattering, KlemsScattering) else None


def through_beams(
    groups: Sequence[WindowGroup], scattering: Sequence[Scattering | None], suns: ArrayLike
) -> NDArray[np.float64]:
    """Transmittance of each group's straight beam for each sun [G, Q], 0 behind the facade."""
    suns = normalize(np.atleast_2d(np.asarray(suns, dtype=float)))
    result = np.zeros((len(groups), len(suns)))
    for g, (group, way) in enumerate(zip(groups, scattering, strict=True)):
        local = suns @ group.frame.T
        if way is not None:
            tau = way.through(vectors(local))
            result[g] = np.where(local[:, 2] > 0, np.broadcast_to(tau.numpy(), len(suns)), 0.0)
    return result


def patch_beams(scattering: Sequence[Scattering | None], basis: KlemsBasis) -> NDArray[np.float64]:
    """Part of each group's straight beam in the diagonal of T [G, K].

    For Klems data their own values; for others the mean over each patch in cos(theta) d_omega: at
    the centre of the last ring clear glass transmits a fifth less than that.
    """
    return np.stack([_beam_of_patches(way, basis) for way in scattering])


def _beam_of_patches(way: Scattering | None, basis: KlemsBasis) -> NDArray[np.float64]:
    if way is None:
        return np.zeros(basis.size)
    if isinstance(way, KlemsScattering) and way.basis == basis:
        return way.beams
    places = (np.arange(BEAM_PLACES) + 0.5) / BEAM_PLACES
    u, v = (axis.ravel() for axis in np.meshgrid(places, places[:: BEAM_PLACES // 4]))
    theta, phi = basis.angles_within(np.arange(basis.size)[:, None], u, v)
    sine = np.sin(theta)
    towards = np.stack([sine * np.cos(phi), -sine * np.sin(phi), np.cos(theta)])
    beam = way.through(mi.Vector3f(towards.reshape(3, -1).astype(np.float32))).numpy()
    return np.broadcast_to(beam, theta.size).reshape(theta.shape).mean(axis=1).astype(float)


def loaded(entry: dict) -> mi.BSDF:
    """The BSDF of a `load_dict` entry; making the entry has activated the variant."""
    return mi.load_dict(entry)
