"""Clear panes: transmittance and reflectance by angle of incidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.gloss import polarised_shares

# coefficients in cos(theta) of the transmittance of clear and bronze glass relative to normal
# incidence, and of transmittance + reflectance: the shape that coated panes are given
# (Finlayson, Arasteh, Huizenga, Rubin, Reilly 1993, "WINDOW 4.0: documentation of calculation
# procedures", LBL-33943; EnergyPlus Engineering Reference, "Angular Properties for Coated Glass")
CLEAR_SHAPE = ((-0.0015, 3.355, -3.840, 1.460, 0.0288), (0.999, -0.563, 2.043, -2.532, 1.054))
BRONZE_SHAPE = ((-0.002, 2.813, -2.341, -0.05725, 0.599), (0.997, -1.868, 6.513, -7.862, 3.225))
CLEAR_ABOVE = 0.645  # normal transmittance above which a coated pane has the clear shape


@dataclass(frozen=True)
class Pane:
    """One pane in one band: its values at normal incidence; front is outdoors."""

    name: str
    transmittance: float
    reflectance_front: float
    reflectance_back: float
    coated: bool = False

    def __post_init__(self) -> None:
        values = (self.transmittance, self.reflectance_front, self.reflectance_back)
        worst = self.transmittance + max(self.reflectance_front, self.reflectance_back)
        if min(values) < 0 or worst > 1 + 1e-9:
            raise ValueError(f"pane {self.name}: expected shares of 1, got {values}")
        if not self.coated and self.reflectance_front != self.reflectance_back:
            raise ValueError(f"pane {self.name}: uncoated glass is alike on both sides")


def pane_values(pane: Pane, theta: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] at angles of incidence `theta` [rad]."""
    if not pane.coated:
        tau, rho = uncoated_values(pane.transmittance, pane.reflectance_front, theta)
        return tau, rho, rho
    return coated_values(pane.transmittance, pane.reflectance_front, pane.reflectance_back, theta)


def uncoated_values(
    transmittance: ArrayLike, reflectance: ArrayLike, theta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance [..] of a plain pane of glass at `theta` [rad].

    The means of `polarised_values`.
    """
    tau, rho = polarised_values(transmittance, reflectance, theta)
    return tau.mean(axis=0), rho.mean(axis=0)


def polarised_values(
    transmittance: ArrayLike, reflectance: ArrayLike, theta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance [2, ..] of a plain pane of glass for either polarisation.

    Refractive index and absorption are those that give the two values at normal incidence; then
    `mitsuba_cfs.gloss.polarised_shares`.

    Source: EnergyPlus Engineering Reference, "Angular properties for uncoated glass"; Furler 1991.
    """
    tau, rho = np.asarray(transmittance, dtype=float), np.asarray(reflectance, dtype=float)
    beta = tau**2 - rho**2 + 2 * rho + 1
    surface = (beta - np.sqrt(beta**2 - 4 * (2 - rho) * rho)) / (2 * (2 - rho))  # of one face
    root = np.sqrt(np.clip(surface, 1e-9, 0.9))
    index = (1 + root) / (1 - root)
    inner = np.where(rho > 1e-6, (rho - surface) / np.maximum(surface * tau, 1e-12), tau)
    cosine = np.cos(np.asarray(theta, dtype=float))
    return polarised_shares(cosine, index, np.clip(inner, 1e-9, 1.0))


def coated_values(
    transmittance: ArrayLike,
    reflectance_front: ArrayLike,
    reflectance_back: ArrayLike,
    theta: ArrayLike,
    *,
    clear: bool | None = None,
) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] of a coated pane at `theta` [rad].

    tau = tau_n t(theta), rho = rho_n (1 - r(theta)) + r(theta), with the shape of clear or bronze
    glass for t and r; the measured values are kept at normal incidence.

    Args: clear: whether the shape is that of clear glass; by default where tau_n is above
        `CLEAR_ABOVE`.
    """
    clear = bool(np.all(np.greater(transmittance, CLEAR_ABOVE))) if clear is None else clear
    shape = CLEAR_SHAPE if clear else BRONZE_SHAPE
    angles = np.asarray(theta, dtype=float)
    cosine = np.cos(angles)
    t = np.clip(np.polynomial.polynomial.polyval(cosine, shape[0]), 0, 1)
    r = np.clip(np.polynomial.polynomial.polyval(cosine, shape[1]) - t, 0, 1)
    t, r = np.where(angles == 0.0, 1.0, t), np.where(angles == 0.0, 0.0, r)
    tau = np.asarray(transmittance) * t
    rho = [np.asarray(n) * (1 - r) + r for n in (reflectance_front, reflectance_back)]
    return tau, *(np.minimum(value, 1 - tau) for value in rho)


def roos_factor(theta: ArrayLike, *, panes: int, category: float) -> NDArray[np.float64]:
    """Factor [..] by which a glazing's transmittance (or g) falls from normal incidence to `theta`.

    f = 1 - a z^alpha - b z^beta - c z^gamma, z = theta / 90 degrees.

    Args:
        panes: 1 to 3.
        category: how strongly coated the glazing is, from 1 to 10; 4 is uncoated.

    Source: Roos, Polato, van Nijnatten, Hutchins, Olive, Anderson 2001, "Angular-dependent optical
    properties of low-e and solar control windows", Solar Energy 69 (Suppl.).
    """
    if not (1 <= panes <= 3 and 1 <= category <= 10):
        raise ValueError(f"expected 1 to 3 panes, category 1 to 10, got {panes} and {category}")
    z = np.asarray(theta, dtype=float) / (np.pi / 2)
    a, b = 8.0, 0.25 / category
    c = 1 - a - b
    alpha = 5.2 + 0.7 * category
    gamma = (5.26 + 0.06 * panes) + (0.73 + 0.04 * panes) * category
    return np.clip(1 - a * z**alpha - b * z**2 - c * z**gamma, 0, 1)


@dataclass(frozen=True)
class Glazing:
    """A whole glazing unit in one band, by its manufacturer's values at normal incidence."""

    name: str
    transmittance: float
    reflectance_front: float
    reflectance_back: float
    panes: int = 2
    category: float = 4.0  # Roos' q

    def __post_init__(self) -> None:
        values = (self.transmittance, self.reflectance_front, self.reflectance_back)
        worst = self.transmittance + max(self.reflectance_front, self.reflectance_back)
        if min(values) < 0 or worst > 1:
            raise ValueError(f"glazing {self.name}: expected shares of 1, got {values}")


def glazing_values(glazing: Glazing, theta: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] of a glazing unit at `theta` [rad].

    Transmittance after Roos; the absorptance stays as at normal incidence up to 75 degrees and
    decreases to zero at 90 (Kuhn 2006, "Solar control: a general evaluation method for facades with
    venetian blinds or other solar control systems", Energy and Buildings 38).
    """
    theta = np.asarray(theta, dtype=float)
    factor = roos_factor(theta, panes=glazing.panes, category=glazing.category)
    tau = glazing.transmittance * factor
    kept = np.clip((np.pi / 2 - theta) / np.radians(15), 0, 1)
    reflectances = []
    for rho in (glazing.reflectance_front, glazing.reflectance_back):
        absorbed = (1 - glazing.transmittance - rho) * kept
        reflectances.append(1 - tau - absorbed)
    return tau, *reflectances


def specular_klems(pane: Pane | Glazing, basis: KlemsBasis, *, subdivision: int = 64) -> KlemsBsdf:
    """The Klems matrices of a pane or glazing that neither scatters nor bends: diagonal.

    Values are means over each ring, in cos(theta) d_omega.
    """
    sine2 = np.sin(basis.theta_bounds) ** 2
    step = (np.arange(subdivision) + 0.5) / subdivision
    theta = np.arcsin(np.sqrt(sine2[:-1, None] + np.diff(sine2)[:, None] * step))
    if isinstance(pane, Pane):
        values = pane_values(pane, theta)
    else:
        values = glazing_values(pane, theta)
    tau, rho_front, rho_back = (
        np.diag(value.mean(axis=1)[basis.rings] / basis.projected_solid_angles())
        for value in values
    )
    return KlemsBsdf(basis, basis, tau, tau, rho_front, rho_back)
