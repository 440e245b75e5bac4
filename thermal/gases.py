"""Properties of gases and their mixtures at low pressure, compiled.

Conductivity, viscosity and specific heat are straight lines in the absolute temperature; mixtures
follow kinetic theory.

Source: ISO 15099:2003, 5.3.3, formulas (56) to (68) and annex B.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.errors import require
from thermal.records import inlined

FloatArray = NDArray[np.float64]
GAS_NAMES = ("air", "argon", "krypton", "xenon")
UNIVERSAL_GAS = 8314.462175  # [J/(kmol K)]
PRESSURE = 101325.0  # [Pa]
# a + b T of conductivity [W/(m K)], viscosity [Pa s] and specific heat [J/(kg K)]; kg/kmol
_LINES = np.array(
    [
        [2.873e-3, 7.760e-5, 3.723e-6, 4.940e-8, 1002.737, 1.2324e-2, 28.97],
        [2.285e-3, 5.149e-5, 3.379e-6, 6.451e-8, 521.9285, 0.0, 39.948],
        [9.443e-4, 2.826e-5, 2.213e-6, 7.777e-8, 248.0907, 0.0, 83.80],
        [4.538e-4, 1.723e-5, 1.069e-6, 7.414e-8, 158.3397, 0.0, 131.30],
    ]
)


def gas_fractions(gas: tuple[tuple[str, float], ...]) -> NDArray[np.float64]:
    """Volume fractions in the order of `GAS_NAMES` [4]."""
    fractions = np.zeros(len(GAS_NAMES))
    for name, fraction in gas:
        require(name in GAS_NAMES, "gap gas", f"{name!r} is not of {', '.join(GAS_NAMES)}")
        require(fraction >= 0, "gap gas", f"{name} has the fraction {fraction:g}")
        fractions[GAS_NAMES.index(name)] += fraction
    require(abs(fractions.sum() - 1) < 1e-6, "gap gas", f"fractions sum to {fractions.sum():g}")
    return fractions


@inlined
def gas_density(fractions: FloatArray, gap: int, kelvin: float) -> float:
    """Density [kg/m3] of a gap's mixture at ambient pressure; fractions [G, 4]."""
    weight = 0.0
    for i in range(4):
        weight += fractions[gap, i] * _LINES[i, 6]
    return PRESSURE * weight / (UNIVERSAL_GAS * kelvin)


@inlined
def gas_heat(fractions: FloatArray, gap: int, kelvin: float) -> float:
    """Specific heat [J/(kg K)] of a gap's mixture."""
    weight, heat = 0.0, 0.0
    for i in range(4):
        share = fractions[gap, i] * _LINES[i, 6]
        weight += share
        heat += share * (_LINES[i, 4] + _LINES[i, 5] * kelvin)
    return heat / weight


@inlined
def gas_viscosity(fractions: FloatArray, gap: int, kelvin: float) -> float:
    """Dynamic viscosity [Pa s] of a gap's mixture."""
    total = 0.0
    for i in range(4):
        if fractions[gap, i] <= 0.0:
            continue
        own = _LINES[i, 2] + _LINES[i, 3] * kelvin
        spread = 1.0
        for j in range(4):
            if j == i or fractions[gap, j] <= 0.0:
                continue
            other = _LINES[j, 2] + _LINES[j, 3] * kelvin
            m = _LINES[i, 6] / _LINES[j, 6]
            phi = (1.0 + np.sqrt(own / other) * m**-0.25) ** 2 / (2.0 * np.sqrt(2.0 * (1.0 + m)))
            spread += phi * fractions[gap, j] / fractions[gap, i]
        total += own / spread
    return total


@inlined
def gas_conductivity(fractions: FloatArray, gap: int, kelvin: float) -> float:
    """Thermal conductivity [W/(m K)] of a gap's mixture: of translation and of inner energy."""
    total = 0.0
    for i in range(4):
        if fractions[gap, i] <= 0.0:
            continue
        whole = _LINES[i, 0] + _LINES[i, 1] * kelvin
        moving = _translation(i, kelvin)
        by_moving, by_inner = 1.0, 1.0
        for j in range(4):
            if j == i or fractions[gap, j] <= 0.0:
                continue
            mi, mj = _LINES[i, 6], _LINES[j, 6]
            root = np.sqrt(moving / _translation(j, kelvin)) * (mi / mj) ** 0.25
            phi = (1.0 + root) ** 2 / (2.0 * np.sqrt(2.0 * (1.0 + mi / mj)))
            psi = phi * (1.0 + 2.41 * (mi - mj) * (mi - 0.142 * mj) / (mi + mj) ** 2)
            ratio = fractions[gap, j] / fractions[gap, i]
            by_moving += psi * ratio
            by_inner += phi * ratio
        total += moving / by_moving + (whole - moving) / by_inner
    return total


@inlined
def _translation(i: int, kelvin: float) -> float:
    """The part of a gas' conductivity that its molecules' motion carries (formula 66)."""
    viscosity = _LINES[i, 2] + _LINES[i, 3] * kelvin
    return 15.0 / 4.0 * UNIVERSAL_GAS / _LINES[i, 6] * viscosity
