"""Fabrics of roller blinds: BSDF from a data sheet's values at normal incidence.

A share of the beam is transmitted directly through the holes, the rest of the transmission is
scattered. Both decrease with the angle as Kotey, Wright and Collins 2009 measured ("Determining
off-normal solar optical properties of roller blinds", ASHRAE Transactions 115(1)); that model is
also ASHRAE 1311-RP's and EnergyPlus' (WindowMaterial:Shade:EquivalentLayer).  The
scattered part leaves with the same angular decrease, so that the BSDF is reciprocal; in the model
itself it is diffuse.  Reflection is diffuse and does not depend on the angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.angular import ANGLES, AngularTable
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FabricBand:
    """A fabric at normal incidence in one spectral band; front is outdoors."""

    transmittance: float  # normal-hemispherical
    direct: float  # of it normal-normal
    reflectance_front: float  # normal-hemispherical
    reflectance_back: float

    def __post_init__(self) -> None:
        if not 0 <= self.direct <= self.transmittance:
            raise ValueError("expected a direct share between 0 and the transmittance")
        most = max(self.reflectance_front, self.reflectance_back)
        if min(self.reflectance_front, self.reflectance_back) < 0 or (
            self.transmittance + most > 1 + 1e-9
        ):
            raise ValueError("expected transmittance and reflectance of 1 at most, together")


def fabric_transmittances(band: FabricBand, theta: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Transmittance [..] and its direct part [..] at angles of incidence [rad]."""
    theta = np.asarray(theta, dtype=float)
    if band.direct >= 1:
        return np.ones_like(theta), np.ones_like(theta)
    thread = (band.transmittance - band.direct) / (1 - band.direct)
    power = 0.133 * (thread + 0.003) ** -0.467 if thread <= 0.33 else 0.33 * (1 - thread)
    whole = band.transmittance * np.clip(np.cos(theta), 0, 1) ** power
    closed = np.cos(band.direct * np.pi / 2)
    cut_off = np.radians(90 - 25 * closed)
    course = np.cos(np.pi / 2 * np.minimum(theta / cut_off, 1)).clip(0, 1)
    straight = np.where(theta < cut_off, band.direct * course ** (0.6 * closed**0.3), 0.0)
    return whole, np.minimum(straight, whole)


def fabric_klems(band: FabricBand, basis: KlemsBasis = KLEMS_FULL) -> KlemsBsdf:
    """The Klems matrices of a fabric: means over the patches."""
    whole, straight = fabric_transmittances(band, ANGLES)
    table, omega = AngularTable(ANGLES, whole), basis.projected_solid_angles()
    beam, scattered = (table.patch_means(basis, v) for v in (straight, whole - straight))
    tau = np.diag(beam / omega)
    if scattered.any():
        tau += np.outer(scattered, scattered) / (omega @ scattered)
    rho = np.full_like(tau, 1 / np.pi)
    front, back = band.reflectance_front * rho, band.reflectance_back * rho
    return KlemsBsdf(basis, basis, tau, tau, front, back)
