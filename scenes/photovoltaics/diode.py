"""The voltage of a two-diode cell at a current, compiled; `scenes.photovoltaics.two_diode`'s I(V).

Apart from it, so that a datasheet is checked before a compiler is loaded.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.compiled import compiled
from scenes.photovoltaics.two_diode import Cell, cell_currents

NEWTON_STEPS = 60
CONVERGED = 1e-10  # [V]


def cell_voltage(
    cell: Cell, current: ArrayLike, irradiance: ArrayLike, temperature: ArrayLike
) -> NDArray[np.float64]:
    """Voltage of one cell that carries a current [A]; negative where it is shaded and driven."""
    photo, first, second, thermal = cell_currents(cell, irradiance, temperature)
    inner = diode_voltage(photo, first, second, thermal, cell.shunt, current)
    return inner - np.asarray(current, dtype=float) * cell.series


@compiled(numba.vectorize, ["f8(f8,f8,f8,f8,f8,f8)"], nopython=True)
def diode_voltage(photo, first, second, thermal, shunt, current):
    """V_d [V] at a current [A], from I_ph, I_01, I_02 [A], V_t [V] and R_p [Ohm].

    The current falls with V_d and is concave in it, so that Newton's method from above the root
    comes down to it without overshooting.
    """
    spare = max(photo - current, 0.0)
    inner = thermal * np.log1p(spare / first)
    if second > 0:
        inner = min(inner, 2 * thermal * np.log1p(spare / second))
    for _ in range(NEWTON_STEPS):
        root = np.exp(inner / (2 * thermal))
        one, two = first * root * root, second * root
        value = photo - (one - first) - (two - second) - inner / shunt - current
        step = value / (one / thermal + two / (2 * thermal) + 1 / shunt)
        inner += step
        if abs(step) < CONVERGED:
            break
    return inner
