"""Angular functions of specular systems: a table, a formula, or a stack of panes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.glazing import Glazing, Pane, PaneOptics, glazing_values, pane_optics, polarised_values, stack
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, spectral_glazing
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import polarised_shares

SCATTERED_LIMIT = 0.05  # share of what a specular system passes that may be scattered
DIFFUSE_TOLERANCE = 0.05  # that function and BSDF may pass more or less of diffuse light

FloatArray = NDArray[np.float64]
ANGLES = np.radians(np.arange(0.0, 90.25, 0.5))  # that formulas are tabulated at
STEPS = 1024  # of a table by the cosine, as kernels take it
PLACES = 32  # angles of incidence in each patch, for its mean
OVER = 1e-3  # by which transmittance and reflectance may be more than 1, for rounding


@dataclass(frozen=True, slots=True)
class AngularTable:
    """Transmittance and reflectance of a specular system by angle of incidence, one band.

    Between its angles the values are monotone cubics.  At 90 degrees all light is
    reflected, whether the table has that line or not.
    """

    theta: FloatArray  # [N] rising from 0 [rad]
    transmittance: FloatArray  # [N]
    reflectance_front: FloatArray | None = None  # [N] None: the BSDF's
    reflectance_back: FloatArray | None = None  # [N]

    def __post_init__(self) -> None:
        theta = self.theta
        if theta.ndim != 1 or len(theta) < 2 or theta[0] != 0 or np.any(np.diff(theta) <= 0):
            raise ValueError("angles: expected at least two, from 0 and rising")
        if theta[-1] > np.pi / 2 + 1e-9:
            raise ValueError(f"angles: expected at most 90 degrees, got {np.degrees(theta[-1]):g}")
        for name in ("transmittance", "reflectance_front", "reflectance_back"):
            values = getattr(self, name)
            if values is None:
                continue
            if values.shape != theta.shape or np.any(values < 0) or np.any(values > 1):
                raise ValueError(f"{name}: expected a share of 1 for each of {len(theta)} angles")
            if name != "transmittance" and np.any(values + self.transmittance > 1 + OVER):
                worst = float(np.degrees(theta[np.argmax(values + self.transmittance)]))
                raise ValueError(f"{name}: more than all is left with what passes, at {worst:g}")

    def transmitted(self, theta: ArrayLike) -> FloatArray:
        """Transmittance [..] at angles of incidence [rad]."""
        return self._at(self.transmittance, 0.0, theta)

    def reflected(self, side: str, theta: ArrayLike) -> FloatArray | None:
        """Reflectance [..] of "front" or "back" at angles of incidence; None where not known."""
        values = self.reflectance_front if side == "front" else self.reflectance_back
        return None if values is None else self._at(values, 1.0, theta)

    def by_cosine(self, values: FloatArray | None = None, end: float = 0.0) -> FloatArray:
        """Shares [STEPS] at uniform steps of the cosine, 0 to 1; the transmittance by default."""
        values = self.transmittance if values is None else values
        return self._at(values, end, np.arccos(np.linspace(0.0, 1.0, STEPS)))

    def patch_means(self, basis: KlemsBasis, values: FloatArray | None = None, end: float = 0.0) -> FloatArray:
        """Means [K] over the patches in cos(theta) d_omega; the transmittance by default."""
        places = (np.arange(PLACES) + 0.5) / PLACES
        theta, _ = basis.angles_within(np.arange(basis.size)[:, None], places, 0.5)
        return self._at(self.transmittance if values is None else values, end, theta).mean(axis=1)

    def mixed(self, other: AngularTable, share: FloatArray) -> AngularTable:
        """With a share [N] of light at each angle that meets another system at the same angles.

        The reflectance of the back stays.
        """
        front = None
        if self.reflectance_front is not None and other.reflectance_front is not None:
            front = (1 - share) * self.reflectance_front + share * other.reflectance_front
        passed = (1 - share) * self.transmittance + share * other.transmittance
        return AngularTable(self.theta, passed, front, self.reflectance_back)

    def _at(self, values: FloatArray, end: float, theta: ArrayLike) -> FloatArray:
        angles = self.theta
        if angles[-1] < np.pi / 2 - 1e-9:
            angles, values = np.append(angles, np.pi / 2), np.append(values, end)
        from scipy.interpolate import PchipInterpolator  # a second, for tables only

        return np.clip(PchipInterpolator(angles, values)(np.minimum(theta, angles[-1])), 0, 1)


def specular_matrices(table: AngularTable, basis: KlemsBasis = KLEMS_FULL) -> KlemsBsdf:
    """The Klems matrices of a table with reflectances on either side: means over its patches."""
    known = (table.transmittance, table.reflectance_front, table.reflectance_back)
    tau, front, back = (
        np.diag(table.patch_means(basis, values, end) / basis.projected_solid_angles())
        for values, end in zip(known, (0.0, 1.0, 1.0), strict=True)
    )
    return KlemsBsdf(basis, basis, tau, tau, front, back)


def roos_table(glazing: Glazing) -> AngularTable:
    """A glazing unit after Roos et al. 2001, see `glazing_values`."""
    tau, front, back = (np.clip(v, 0, 1) for v in glazing_values(glazing, ANGLES))
    return AngularTable(ANGLES, tau, front, back)


def glass_table(panes: Sequence[tuple[float, float]]) -> AngularTable:
    """Panes of uncoated glass behind each other, absorbing or not, the outer one first.

    Args: panes: transmissivity of each, of one way through the glass at normal incidence without
        reflections, and its index of refraction.

    Source: Fresnel's equations with all reflections between the faces, each polarisation by
    itself; a single pane is Radiance's material `glass` ("The RADIANCE 5.1 Synthetic Imaging
    System", 3.2).
    """
    cosine = np.cos(ANGLES)
    shares = [polarised_shares(cosine, index, passed) for passed, index in panes]
    return _table_of([PaneOptics(tau, rho, rho) for tau, rho in shares])


def stack_table(panes: Sequence[Pane]) -> AngularTable:
    """Angular function of a stack of panes, the outer one first.

    All interreflections are added by intensity, for each polarisation separately.  Uncoated
    panes follow Fresnel's equations, coated ones LBNL's shape, equal for both polarisations.
    """
    return _table_of([_by_polarisation(pane) for pane in panes])


def _table_of(panes: Sequence[PaneOptics]) -> AngularTable:
    """The mean of both polarisations of panes [2, N] behind each other."""
    whole = stack(panes)
    values = (whole.tau, whole.rho_front, whole.rho_back)
    tau, front, back = (np.clip(value.mean(axis=0), 0, 1) for value in values)
    return AngularTable(ANGLES, tau, front, back)


def _by_polarisation(pane: Pane) -> PaneOptics:
    """A pane at `ANGLES` for either polarisation [2, N]."""
    if pane.coated:
        optics = pane_optics(pane, ANGLES)
        both = (np.tile(v, (2, 1)) for v in (optics.tau, optics.rho_front, optics.rho_back))
        return PaneOptics(*both)
    tau, rho = polarised_values(pane.transmittance, pane.reflectance_front, ANGLES)
    return PaneOptics(tau, rho, rho)


def check_specular(klems: KlemsBsdf, angular: AngularTable | None, path: Path) -> None:
    """`DataError` where the BSDF is not that of a specular system with this function."""
    if angular is None:
        return
    omega = klems.basis_in.projected_solid_angles()
    peak = through_peak(klems.transmission_matrix() / omega, klems.basis_in, 1.0)
    beam, rest = omega @ peak.transmittance / np.pi, omega @ peak.scattered @ omega / np.pi
    if rest > SCATTERED_LIMIT * (beam + rest):
        share = 100 * rest / (beam + rest)
        message = f"the BSDF scatters {share:.0f} % of what it passes: no function of an angle"
        raise DataError(message, file=path, field="angular")
    means = float(omega @ angular.patch_means(klems.basis_in) / np.pi)
    if abs(means - beam) > DIFFUSE_TOLERANCE:
        message = f"passes {means:.2f} of diffuse light, the BSDF {beam:.2f}: not the same system"
        raise DataError(message, file=path, field="angular")


def spectral_tables(panes: Sequence[SpectralPane]) -> dict[str, AngularTable]:
    """The table of each band of panes from outside to inside, wavelength by wavelength."""
    return {
        band: AngularTable(
            ANGLES,
            np.clip(one.transmittance, 0.0, 1.0),
            np.clip(one.reflectance_front, 0.0, 1.0),
            np.clip(one.reflectance_back, 0.0, 1.0),
        )
        for band, one in spectral_glazing(panes, ANGLES).items()
    }
