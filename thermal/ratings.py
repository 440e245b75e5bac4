"""U, g and secondary heat of a system by the standards, and EN 14501's classes of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.glazing import GASES, Gap, en410_g_value, en673_u_value, gap_conductances
from thermal.glazing_unit import GlazingUnit
from thermal.gvalue import KAPPA, InternalShade, external_shade_g, integrated_shade_g, internal_shade_g
from thermal.iso15099 import ISO_52022_3, NFRC, Conditions, iso15099_g_values, iso15099_u_value

FloatArray = NDArray[np.float64]
# EN 14501:2021: class 0 from the first limit on, class 4 below the last
CLASSES = {
    "g": (0.50, 0.35, 0.15, 0.10),  # total solar energy transmittance
    "secondary": (0.30, 0.20, 0.10, 0.03),  # secondary internal heat transfer factor
    "tau": (0.20, 0.15, 0.10, 0.05),  # direct solar transmittance
}

EUROPEAN = "EN 673, EN 410"  # the method of panes without a shade


@dataclass(frozen=True, slots=True)
class ReferenceGlazing:
    """A glazing of EN 14501, annex A, that shades are rated before or behind."""

    u_value: float  # [W/(m2 K)]
    g_value: float
    transmittance: float  # solar
    reflectance_outside: float
    reflectance_inside: float


REFERENCE_GLAZINGS = {
    "A": ReferenceGlazing(5.8, 0.85, 0.83, 0.08, 0.08),  # single, clear
    "B": ReferenceGlazing(2.9, 0.76, 0.69, 0.14, 0.14),  # double, clear
    "C": ReferenceGlazing(1.2, 0.59, 0.49, 0.29, 0.27),  # double, low-e
    "D": ReferenceGlazing(1.1, 0.32, 0.27, 0.29, 0.38),  # double, low-e, solar control
}


@dataclass(frozen=True, slots=True)
class ThermalRating:
    """One system at normal incidence by one method."""

    method: str
    u_value: float | None  # [W/(m2 K)]; None: the method gives none
    transmittance: float  # tau_e
    g_value: float  # g_tot

    @property
    def secondary(self) -> float:
        """Secondary heat q_i = g - tau_e."""
        return self.g_value - self.transmittance

    def solar_class(self, of: str) -> int:
        """EN 14501's class 0 (least effect) to 4 of "g", "secondary" or "tau"."""
        value = {"g": self.g_value, "secondary": self.secondary, "tau": self.transmittance}[of]
        return sum(value < limit for limit in CLASSES[of])


def layered_ratings(unit: GlazingUnit, transmittance: float, absorptance: ArrayLike) -> list[ThermalRating]:
    """NFRC 100/200, ISO 52022-3 at both conditions, and EN 673 with EN 410 where there is no shade.

    Args: absorptance: of each layer at normal incidence [N].
    """
    tau, alpha = np.array([transmittance]), np.asarray(absorptance, dtype=float)[None, :]

    def g(conditions: Conditions) -> float:
        return float(iso15099_g_values(unit, conditions, tau, alpha)[0])

    reference, summer = ISO_52022_3
    found = [
        ThermalRating("NFRC", iso15099_u_value(unit, NFRC[0]), transmittance, g(NFRC[1])),
        ThermalRating("ISO 52022-3, reference", iso15099_u_value(unit, reference), transmittance, g(reference)),
        ThermalRating("ISO 52022-3, summer", None, transmittance, g(summer)),
    ]
    if unit.shade_place == "none" and _known_to_en673(unit):
        found.append(_european(unit, transmittance, alpha[0]))
    return found


def _known_to_en673(unit: GlazingUnit) -> bool:
    return all(name in GASES for gap in unit.gaps for name, share in gap.gas if share > 0)


def _european(unit: GlazingUnit, tau: float, alpha: FloatArray) -> ThermalRating:
    """EN 673's U and EN 410's g of panes."""
    gaps = [
        Gap(gap.width, gap.gas, (a.emissivity[1], b.emissivity[0]))
        for gap, a, b in zip(unit.gaps, unit.layers, unit.layers[1:], strict=False)
    ]
    position = "vertical" if unit.tilt_deg > 60 else "tilted" if unit.tilt_deg > 15 else "horizontal"
    solid = [layer.thickness / layer.conductivity for layer in unit.layers]
    u_value = en673_u_value(
        solid, gaps, position=position, emissivity_in=unit.layers[-1].emissivity[1], conductivity=1.0
    )
    halves = 0.5 * (np.array(solid[:-1]) + np.array(solid[1:]))
    between = 1.0 / gap_conductances(gaps, position) + halves
    g_value = float(en410_g_value(tau, alpha, between))
    return ThermalRating(EUROPEAN, u_value, tau, g_value)


def shade_ratings(
    transmittance: float, reflectance: float, place: str, glazing: ReferenceGlazing, *, kappa: float = KAPPA
) -> list[ThermalRating]:
    """A shade before, behind or in a glazing: EN 13363-1, and Kuhn's formula for an interior one.

    Args: transmittance, reflectance: solar, of the shade; the reflectance of the side that the sun
        meets; place: "external", "internal" or "integrated".

    The light that reaches the room is tau_B tau/(1 - rho_B rho) (EN 13363-1, 5.2).
    """
    tau, rho = transmittance, reflectance
    formulas: dict[str, Callable[..., FloatArray]] = {
        "external": external_shade_g,
        "internal": internal_shade_g,
        "integrated": integrated_shade_g,
    }
    back = glazing.reflectance_outside if place == "external" else glazing.reflectance_inside
    passed = tau * glazing.transmittance / (1.0 - rho * back)
    g_value = float(formulas[place](tau, rho, glazing.g_value, glazing.u_value))
    found = [ThermalRating(f"EN 13363-1, {place}", None, passed, g_value)]
    if place == "internal":
        both = InternalShade(
            glazing.transmittance,
            glazing.reflectance_outside,
            glazing.g_value,
            glazing.transmittance,
            glazing.reflectance_inside,
            glazing.u_value,
            tau,
            rho,
            tau,
            rho,
        )
        passed_kuhn, _, g_kuhn = both.kuhn(kappa=kappa)
        method = f"Kuhn 2006, kappa {kappa:g}"
        found.append(ThermalRating(method, None, float(passed_kuhn), float(g_kuhn)))
    return found
