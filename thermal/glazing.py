"""U-value and g-value of glazing from its panes and gaps: EN 673 and EN 410."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range

SIGMA = 5.67e-8  # [W/(m2 K4)]
MEAN_TEMPERATURE = 283.0  # [K] of the glazing, EN 673
TOTAL_DIFFERENCE = 15.0  # [K] across the glazing, EN 673
OUTER_FILM = 25.0  # [W/(m2 K)] EN 673
GLASS_CONDUCTIVITY = 1.0  # [W/(m K)] EN 673

# density [kg/m3], viscosity [Pa s], conductivity [W/(m K)], heat capacity [J/(kg K)] at 10 degC
GASES = {
    "air": (1.232, 1.761e-5, 0.02496, 1008.0),
    "argon": (1.699, 2.164e-5, 0.01684, 519.0),
    "krypton": (3.560, 2.400e-5, 0.00900, 245.0),
}
# A and n of Nu = A (Gr Pr)^n: EN 673:2011, heat flow up for tilted glazing
_NUSSELT = {"vertical": (0.035, 0.38), "tilted": (0.10, 0.31), "horizontal": (0.16, 0.28)}


@dataclass(frozen=True, slots=True)
class Gap:
    """A gas space between two panes."""

    width: float  # [m]
    gas: tuple[tuple[str, float], ...]  # (name, volume fraction), fractions sum to 1
    emissivity: tuple[float, float]  # of the two surfaces that bound it

    def __post_init__(self) -> None:
        require_range(self.width, 1e-3, 0.2, "gap width", "m")
        for name, _ in self.gas:
            require(name in GASES, "gap gas", f"{name!r} is not of {', '.join(GASES)}")
        total = sum(fraction for _, fraction in self.gas)
        require(abs(total - 1.0) < 1e-6, "gap gas", f"fractions sum to {total:g}")
        for emissivity in self.emissivity:
            require_range(emissivity, 1e-3, 1.0, "gap emissivity")

    def conductance(
        self, difference: float, position: str = "vertical", *, mean_temperature: float = MEAN_TEMPERATURE
    ) -> float:
        """h_s = h_r + h_g [W/(m2 K)] with a temperature difference [K] across it.

        Away from EN 673's mean temperature [K] the gas is scaled: density as 1/T, conductivity and
        viscosity as T^0.85 and T^0.76, the slopes of their tables from 250 to 330 K.
        """
        density, viscosity, conductivity, capacity = (
            sum(fraction * GASES[name][i] for name, fraction in self.gas) for i in range(4)
        )
        warm = mean_temperature / MEAN_TEMPERATURE
        density, viscosity = density / warm, viscosity * warm**0.76
        conductivity *= warm**0.85
        a, n = _NUSSELT[position]
        grashof = 9.81 * self.width**3 * difference * density**2
        grashof /= mean_temperature * viscosity**2
        prandtl = viscosity * capacity / conductivity
        nusselt = max(1.0, a * (grashof * prandtl) ** n)
        e1, e2 = self.emissivity
        radiative = 4 * SIGMA * mean_temperature**3 / (1 / e1 + 1 / e2 - 1)
        return radiative + nusselt * conductivity / self.width


def inner_film(emissivity: float = 0.837) -> float:
    """Inside film h_i [W/(m2 K)] of EN 673 for the emissivity of the room-side face."""
    return 3.6 + 4.1 * emissivity / 0.837


def gap_conductances(gaps: Sequence[Gap], position: str = "vertical") -> NDArray[np.float64]:
    """Conductances [G] [W/(m2 K)] of the gaps, the 15 K shared in proportion to 1/h (EN 673)."""
    require(position in _NUSSELT, "glazing position", f"{position!r} is not of {list(_NUSSELT)}")
    share = np.full(len(gaps), 1.0 / max(len(gaps), 1))
    conductance = np.zeros(len(gaps))
    for _ in range(50):
        differences = TOTAL_DIFFERENCE * share
        pairs = zip(gaps, differences, strict=True)
        fresh = np.array([gap.conductance(d, position) for gap, d in pairs])
        if np.max(np.abs(fresh - conductance), initial=0.0) < 1e-9:
            break
        conductance = fresh
        share = (1.0 / conductance) / np.sum(1.0 / conductance)
    return conductance


def en673_u_value(
    panes: Sequence[float],
    gaps: Sequence[Gap],
    *,
    position: str = "vertical",
    emissivity_in: float = 0.837,
    conductivity: float = GLASS_CONDUCTIVITY,
) -> float:
    """U-value [W/(m2 K)] of the centre of a glazing; panes: thicknesses [m], outside to inside.

    Source: EN 673:2011.
    """
    require(len(panes) == len(gaps) + 1, "glazing", f"{len(panes)} panes, {len(gaps)} gaps")
    resistance = 1.0 / OUTER_FILM + 1.0 / inner_film(emissivity_in)
    resistance += sum(panes) / conductivity
    resistance += float(np.sum(1.0 / gap_conductances(gaps, position)))
    return 1.0 / resistance


def en410_g_value(
    transmittance: ArrayLike,
    absorptances: ArrayLike,
    resistances: ArrayLike,
    *,
    outer_film: float = 23.0,
    inner_film: float = 8.0,
) -> NDArray[np.float64]:
    """Total solar energy transmittance g = tau + q_i of a glazing of n panes.

    Args:
        transmittance: [...] solar; absorptances: [..., n] of each pane, outside to inside.
        resistances: [n - 1] between neighbouring panes' middles [m2 K/W].
        outer_film, inner_film: h_e and h_i [W/(m2 K)] of EN 410.

    Source: EN 410:2011, clause 5.4: each pane's heat is divided by the resistances on its sides.
    """
    alpha = np.asarray(absorptances, dtype=float)
    between = np.asarray(resistances, dtype=float)
    require(alpha.shape[-1] == len(between) + 1, "glazing", "one resistance between two panes")
    outside = 1.0 / outer_film + np.concatenate([[0.0], np.cumsum(between)])
    inward = outside / (outside[-1] + 1.0 / inner_film)
    return np.asarray(transmittance, dtype=float) + alpha @ inward
