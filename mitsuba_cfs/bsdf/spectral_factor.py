"""Transmittance of systems by wavelength and angle of incidence, relative to visible light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.colour import relative_rgb
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, diffuse_reflectance, spectral_transmittance
from mitsuba_cfs.spectra.channels import Channels
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities, visible_mean

Array = NDArray[np.float64]
ANGLES = np.radians(np.arange(0.0, 89.1, 1.0))  # up to grazing incidence, where nothing passes
PATCH_ANGLES = 32  # angles of incidence in each patch, for its mean


@dataclass(frozen=True, slots=True)
class SlatLight:
    """Colour of the light of coloured slats, by direction and number of reflections.

    Of the visible light from a patch of incidence to a patch of the room side a share was
    reflected n times: its spectrum is rho^n.  The rest passed between the slats.
    """

    reflectance: Array  # [N] of the slats at `NANOMETRES`
    shares: Array  # [n, K out, K in] of visible light, once reflected first; full Klems basis

    def __post_init__(self) -> None:
        if self.reflectance.shape != (len(NANOMETRES),) or self.shares.shape[1:] != (KLEMS_FULL.size,) * 2:
            raise ValueError(
                f"slats: expected {KLEMS_FULL.size} x {KLEMS_FULL.size} patches and {len(NANOMETRES)} wavelengths, "
                f"got {self.shares.shape[1:]} and {self.reflectance.shape}"
            )

    def relative(self, channels: Channels) -> Array:
        """r_c of light that is reflected 1, 2, .. times [n, C]."""
        powers = self.reflectance ** (1 + np.arange(len(self.shares)))[:, None]
        return _relative(channels.mean(powers), visible_mean(powers)[:, None])


class PatchFactors(NamedTuple):
    """r_c of patches of incidence."""

    straight: Array  # [C, K] of all light; with coloured slats of what they do not reflect
    reflected: Array  # [n, C, K] of what slats reflect 1, 2, .. times; empty without coloured ones


@dataclass(frozen=True)
class SpectralFactor:
    """Transmittance of a system by angle of incidence and wavelength, relative to visible light.

    `ANGLES` are the angles of incidence A.
    """

    transmittance: Array  # [A, N] at `ANGLES` and `NANOMETRES`, of any scale
    whole: bool = True  # of all its layers; otherwise the rest passes all wavelengths equally
    mirrored: Array | None = None  # [N] reflectance of its room side for diffuse light; None: neutral
    slats: SlatLight | None = None  # coloured ones besides

    @staticmethod
    def of_panes(panes: Sequence[SpectralPane], shade: ArrayLike = 1.0, reflectance: ArrayLike = 0.0) -> SpectralFactor:
        """That of panes in series.

        Args:
            shade: transmittance [N] of a shade besides, at all angles, of any scale.
            reflectance: of the side of a diffusing shade indoors that faces the panes [N]: light
                goes to and fro between it and the panes.
        """
        tau = spectral_transmittance(panes, NANOMETRES, ANGLES) if panes else np.ones((1, 1))
        back = diffuse_reflectance(panes, NANOMETRES) if panes else np.zeros(len(NANOMETRES))
        passed, sent = (np.asarray(values, dtype=float) for values in (shade, reflectance))
        to_and_fro = 1 / (1 - sent * back)
        mirrored = None
        if np.all(passed == 1.0) or np.any(sent > 0):  # else the shade's scale is not known
            mirrored = np.broadcast_to(sent + passed**2 * back * to_and_fro, (len(NANOMETRES),))
        whole = np.broadcast_to(tau * passed * to_and_fro, (len(ANGLES), len(NANOMETRES)))
        return SpectralFactor(whole, mirrored=mirrored if panes or np.any(sent > 0) else None)

    @staticmethod
    def neutral() -> SpectralFactor:
        """That of a system that transmits all wavelengths equally."""
        return SpectralFactor.of_panes(())

    @cached_property
    def visible(self) -> Array:
        """Transmittance [A] for D65 and V(lambda)."""
        visible: Array = visible_mean(self.transmittance)
        return visible

    @staticmethod
    def of_diffuse_light(factors: Sequence[SpectralFactor], amounts: Sequence[float]) -> SpectralFactor:
        """That of the mean diffuse light of several systems, at all angles.

        Args: amounts: of visible light that each passes.
        """
        weight = np.sin(2 * ANGLES)
        spectra = [weight @ one.transmittance for one in factors]
        parts = [amount * spectrum / visible_mean(spectrum) for amount, spectrum in zip(amounts, spectra, strict=True)]
        return SpectralFactor(np.tile(np.sum(parts, axis=0), (len(ANGLES), 1)))

    def of_angles(self, channels: Channels) -> Array:
        """r_c at `ANGLES` [1 + n, C, A]: of light that passes straight on, that slats reflect 1, 2, .. times."""
        ratio: Array = _relative(channels.mean(self.transmittance), self.visible[:, None]).T
        if self.slats is None:
            return ratio[None]
        return np.concatenate([ratio[None], ratio * self.slats.relative(channels)[..., None]])

    def rgb(self) -> Array:
        """Linear sRGB [A, 3] of D65 through it at `ANGLES`, over its luminance; none negative."""
        observer = illuminant("D65")[:, None] * sensitivities()[-3:].T  # [N, 3]
        x, y, z = (self.transmittance @ (observer / observer.sum(axis=0))).T
        return relative_rgb(x, y, z)

    def of_patches(self, channels: Channels) -> PatchFactors:
        """r_c of the patches of the full Klems basis, by their means of transmittance."""
        places = (np.arange(PATCH_ANGLES) + 0.5) / PATCH_ANGLES
        theta, _ = KLEMS_FULL.angles_within(np.arange(KLEMS_FULL.size)[:, None], places, 0.5)
        theta = np.minimum(theta, ANGLES[-1])
        visible = np.interp(theta, ANGLES, self.visible).mean(axis=1)
        means = [np.interp(theta, ANGLES, row).mean(axis=1) for row in channels.mean(self.transmittance).T]
        panes = _relative(np.array(means), visible)
        if self.slats is None:
            return PatchFactors(panes, np.empty((0, *panes.shape)))
        return PatchFactors(panes, panes * self.slats.relative(channels)[..., None])


def _relative(means: Array, visible: Array) -> Array:
    """Transmittances relative to the visible one; 1 where nothing visible passes."""
    visible = np.broadcast_to(visible, means.shape)
    relative: Array = np.divide(means, visible, out=np.ones_like(means), where=visible > 0)
    return relative
