"""g per direction where it was not measured: from one g, from rules, or for a shade on a glazing.

A BSDF file contains the solar transmittance and reflectance by direction; the Blackbox model
also needs U and g by direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range
from thermal.notes import ThermalNote

GAIN = 0.02  # of light, that measured data may have
# EN 13363-1:2003 as in Kuhn 2006 and the dissertation [W/(m2 K)]: external, internal, integrated
EXTERNAL_CONDUCTANCES = (6.0, 18.0)
INTERNAL_CONDUCTANCE = 18.0
INTEGRATED_CONDUCTANCE = 3.0
KAPPA = 0.4  # Kuhn et al. 2011: venetian blinds, where it cannot be measured

# What is assumed of a system when nothing but its BSDF is known: U [W/(m2 K)] and the share of the
# absorbed sun that goes inwards.  Computed with ISO 15099 (WINDOW's engine) for a low-e argon
# double glazing 6/16/6 alone and with a grey shade outside, inside; between the panes: EN 13363-1.
TYPICAL_SYSTEMS = {
    "none": (1.23, 0.40),
    "external": (1.01, 0.072),
    "internal": (1.10, 0.595),
    "integrated": (1.15, 0.30),
}


_SHADES = {
    "none": ThermalNote("without a shade"),
    "external": ThermalNote("with an external shade"),
    "internal": ThermalNote("with an internal shade"),
    "integrated": ThermalNote("with a shade between the panes"),
}


@dataclass(frozen=True, slots=True)
class ThermalData:
    """U and g by direction of a system, and the assumptions made."""

    u_value: float  # [W/(m2 K)]
    g_value: NDArray[np.float64]  # [...] as the transmittance
    assumptions: tuple[ThermalNote, ...]  # one for every value that was not given


def thermal_data(
    transmittance: ArrayLike,
    reflectance: ArrayLike,
    *,
    u_value: float | None = None,
    g_normal: float | None = None,
    normal: int = 0,
    shading_position: str = "none",
    item: str = "fenestration",
) -> ThermalData:
    """U and g by direction from a BSDF and further thermal data.

    g follows from g at one direction with a constant inward share N of the absorption, g = tau + N
    alpha, N = (g_n - tau_n)/alpha_n; by direction N differs, see `window_model`
    with `typical_unit.typical_unit`.  Without g, N and U are those of a typical system with its
    shade "none", "external", "internal" or "integrated"; the assumptions say so.

    Args:
        transmittance, reflectance: [K] solar, direction to hemisphere.
        g_normal: g at the direction with index `normal` (Klems: 0).
        item: what errors name.
    """
    known = ", ".join(TYPICAL_SYSTEMS)
    fits = shading_position in TYPICAL_SYSTEMS
    require(fits, "shading position", f"{shading_position!r} is not of {known}")
    tau, rho = np.asarray(transmittance, dtype=float), np.asarray(reflectance, dtype=float)
    for values, what in ((tau, "transmittance"), (rho, "reflectance")):
        within = bool(np.all((values >= 0) & (values <= 1)))  # NaN fails
        require(within, f"{item}: {what}", f"expected numbers from 0 to 1, got {values}")
    fits = bool(np.all(tau + rho <= 1 + GAIN))
    require(fits, item, "transmits and reflects more than it receives")
    typical_u, share = TYPICAL_SYSTEMS[shading_position]
    notes = []
    if u_value is None:
        u_value = typical_u
        notes.append(
            ThermalNote(
                "{system}: no U-value given; {u_value:g} W/(m2 K) is assumed, as for low-e double glazing {shade}.",
                {"system": item, "u_value": u_value, "shade": _SHADES[shading_position]},
            )
        )
    require_range(u_value, 0.1, 7.0, f"{item}: U", "W/(m2 K)")
    if g_normal is None:
        notes.append(
            ThermalNote(
                "{system}: no g-value given; {percent:g} % of the absorbed solar radiation is "
                "assumed to be released inwards, as for low-e double glazing {shade}.",
                {"system": item, "percent": 100 * share, "shade": _SHADES[shading_position]},
            )
        )
    else:
        share = inward_share(float(tau.flat[normal]), float(rho.flat[normal]), g_normal, item=item)
    return ThermalData(u_value, g_from_inward_share(tau, rho, share), tuple(notes))


def inward_share(transmittance: float, reflectance: float, g_value: float, *, item: str = "fenestration") -> float:
    """Share N of the absorbed sun that reaches the room: (g - tau)/(1 - tau - rho)."""
    require_range(g_value, 0.0, 1.0, f"{item}: g")
    message = (
        f"{g_value:g} is below the solar transmittance {transmittance:.3f}, the least that g can "
        "be: g = tau + secondary heat gain"
    )
    require(g_value >= transmittance - 0.01, f"{item}: g", message)
    absorptance = 1.0 - transmittance - reflectance
    if absorptance < 1e-3:
        return 0.0
    share = max(g_value - transmittance, 0.0) / absorptance
    message = f"{g_value:g} needs {share:.2f} times the absorbed sun (tau {transmittance:.3f})"
    require(share <= 1.0, f"{item}: g", message)
    return share


def g_from_inward_share(transmittance: ArrayLike, reflectance: ArrayLike, share: float) -> NDArray[np.float64]:
    """g = tau + N (1 - tau - rho) [...] for an inward share N."""
    tau, rho = np.asarray(transmittance, dtype=float), np.asarray(reflectance, dtype=float)
    return tau + share * np.maximum(1.0 - tau - rho, 0.0)


def position_of_share(share: float) -> str:
    """Likely position of a shade from the inward share of the absorbed radiation.

    0.05 to 0.15 outside, 0.3 between the panes and 0.5 to 0.7 inside (`TYPICAL_SYSTEMS`).
    """
    if share < 0.2:
        return "external"
    return "internal" if share > 0.45 else "integrated"


def external_shade_g(
    tau_shade: ArrayLike,
    rho_shade: ArrayLike,
    g_glazing: ArrayLike,
    u_glazing: float,
    *,
    conductances: tuple[float, float] = EXTERNAL_CONDUCTANCES,
) -> NDArray[np.float64]:
    """g of a glazing with a shade outside.

    g = tau_B g + alpha_B L/L2 + tau_B (1 - g) L/L1,  1/L = 1/U + 1/L1 + 1/L2.

    Source: EN 13363-1; newer editions and ISO 52022-1 use conductances (5, 10).
    """
    tau, rho, g = _arrays(tau_shade, rho_shade, g_glazing)
    first, second = conductances
    total = 1.0 / (1.0 / u_glazing + 1.0 / first + 1.0 / second)
    alpha = 1.0 - tau - rho
    return tau * g + alpha * total / second + tau * (1.0 - g) * total / first


def internal_shade_g(
    tau_shade: ArrayLike,
    rho_shade: ArrayLike,
    g_glazing: ArrayLike,
    u_glazing: float,
    *,
    conductance: float = INTERNAL_CONDUCTANCE,
) -> NDArray[np.float64]:
    """g of a glazing with a shade inside: g (1 - g rho_B - alpha_B L/L2), 1/L = 1/U + 1/L2.

    Source: EN 13363-1; newer editions and ISO 52022-1 use 30.
    """
    tau, rho, g = _arrays(tau_shade, rho_shade, g_glazing)
    total = 1.0 / (1.0 / u_glazing + 1.0 / conductance)
    return g * (1.0 - g * rho - (1.0 - tau - rho) * total / conductance)


def integrated_shade_g(
    tau_shade: ArrayLike,
    rho_shade: ArrayLike,
    g_glazing: ArrayLike,
    u_glazing: float,
    *,
    conductance: float = INTEGRATED_CONDUCTANCE,
) -> NDArray[np.float64]:
    """g of a shade between panes: g tau_B + g (alpha_B + (1 - g) rho_B) L/L3, 1/L = 1/U + 1/L3.

    Source: EN 13363-1.
    """
    tau, rho, g = _arrays(tau_shade, rho_shade, g_glazing)
    total = 1.0 / (1.0 / u_glazing + 1.0 / conductance)
    return g * tau + g * (1.0 - tau - rho + (1.0 - g) * rho) * total / conductance


@dataclass(frozen=True, slots=True)
class InternalShade:
    """Solar properties of a glazing with an interior shade; arrays by direction."""

    tau_glazing: NDArray[np.float64] | float  # [...]
    rho_glazing: NDArray[np.float64] | float  # [...] outside
    g_glazing: NDArray[np.float64] | float  # [...]
    tau_glazing_diffuse: float
    rho_glazing_diffuse_back: float  # room side
    u_glazing: float  # [W/(m2 K)]
    tau_shade: NDArray[np.float64] | float  # [...]
    rho_shade: NDArray[np.float64] | float  # [...] towards the glazing
    tau_shade_diffuse: float
    rho_shade_diffuse: float

    def kuhn(
        self, *, kappa: float = KAPPA, conductance: float = INTERNAL_CONDUCTANCE
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """tau, rho and g [...] of the system.

        D = 1 - rho_sd,dif rho_gu,dif
        g = tau + g_gu - tau_gu + (1 - kappa) tau_gu alpha_gu,dif rho_sd/D
            + tau_gu alpha_sd (1 - L/L2)/D,    1/L = 1/U + 1/L2

        kappa is the share that goes outwards of the light which the shade throws back and the
        glazing absorbs.

        Source: Kuhn 2006, Energy and Buildings 38:648-660; the factor that the dissertation's
        print lost is (1 - L/L2)/D.
        """
        require_range(kappa, 0.0, 1.0, "kappa")
        tau_gu, rho_gu, g_gu = _arrays(self.tau_glazing, self.rho_glazing, self.g_glazing)
        tau_sd, rho_sd = (np.asarray(v, dtype=float) for v in (self.tau_shade, self.rho_shade))
        rho_back = self.rho_glazing_diffuse_back
        d = 1.0 - self.rho_shade_diffuse * rho_back
        tau = tau_gu * tau_sd + tau_gu * rho_sd * rho_back * self.tau_shade_diffuse / d
        rho = rho_gu + tau_gu * self.tau_glazing_diffuse * rho_sd / d
        alpha_gu = 1.0 - self.tau_glazing_diffuse - rho_back
        loss = 1.0 / (1.0 + conductance / self.u_glazing)
        returned = (1.0 - kappa) * tau_gu * alpha_gu * rho_sd / d
        shade_heat = tau_gu * (1.0 - tau_sd - rho_sd) * (1.0 - loss) / d
        return tau, rho, tau + g_gu - tau_gu + returned + shade_heat


def _arrays(*values: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    arrays = tuple(np.asarray(v, dtype=float) for v in values)
    inside = all(bool(np.all((a >= 0) & (a <= 1))) for a in arrays)
    require(inside, "solar property", "a transmittance, reflectance or g lies outside 0 to 1")
    return arrays
