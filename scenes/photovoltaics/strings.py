"""Maximum power of cells in series of which some are shaded: substrings with bypass diodes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.compiled import compiled
from scenes.photovoltaics.diode import diode_voltage
from scenes.photovoltaics.two_diode import Cell, cell_currents

BYPASS_VOLTAGE = 0.5  # across a bypass diode that carries the current (Schottky) [V]
EVEN = 12  # currents, evenly spread, at which a string's power is looked at first
KNEES = 12  # substrings' photocurrents, at most, near which a best point is looked for
NEAR_KNEE = (0.75, 0.86, 0.92, 0.95, 0.97, 0.985, 1.0, 1.05)  # shares of those photocurrents
REFINEMENTS = 3
POINTS = 9  # of each refinement
CHUNK = 4_000_000  # voltages at once
# The table of diode voltages: relative error of the power below 1e-5 (tested against the model)
FIRST_TEMPERATURE, TEMPERATURE_STEP = -60.0, 1.0  # [C], [K]
TABLE_TEMPERATURES = FIRST_TEMPERATURE + TEMPERATURE_STEP * np.arange(181)
TABLE_CURRENTS = 4096
SMALL_CURRENT = 1e-4  # where the table's axis turns from linear to logarithmic [A]


def string_power(
    cell: Cell,
    irradiance: ArrayLike,
    temperature: ArrayLike,
    cells: ArrayLike,
    substring: ArrayLike,
    *,
    bypass: float = BYPASS_VOLTAGE,
) -> NDArray[np.float64]:
    """Maximum power of one string [H] [W]: one current through all its cells.

    The voltage of a substring is the sum of its cells', but no less than minus the bypass diode's:

        P = max over I of I sum over substrings of max(sum over cells of V(I, G, T), -V_bypass)

    Args:
        irradiance: [H, N] of each group of equally lit cells [W/m2].
        temperature: [H, N] of the cells [C].
        cells: [N] cells in series in each group.
        substring: [N] number of the substring each group belongs to, from 0.
    """
    irradiance = np.atleast_2d(np.asarray(irradiance, dtype=float))
    temperature = np.broadcast_to(np.asarray(temperature, dtype=float), irradiance.shape)
    cells, substring = np.asarray(cells, dtype=float), np.asarray(substring, dtype=np.int64)
    if irradiance.min(initial=0.0) < 0:
        raise ValueError("irradiance: expected no negative value")
    power = np.zeros(len(irradiance))
    lit = np.flatnonzero(irradiance.max(axis=1) > 0)
    size = max(1, CHUNK // ((EVEN + KNEES * len(NEAR_KNEE)) * irradiance.shape[1]))
    for start in range(0, len(lit), size):
        hours = lit[start : start + size]
        power[hours] = _maximum(
            cell, irradiance[hours], temperature[hours], cells, substring, bypass
        )
    return power


def _maximum(cell, irradiance, temperature, cells, substring, bypass) -> NDArray[np.float64]:
    """Power at the best of many currents, refined between its neighbours [h]."""
    current = _candidates(cell_currents(cell, irradiance, temperature)[0], substring)
    rows = np.arange(len(current))
    for _ in range(REFINEMENTS + 1):
        power = current * string_voltage(
            cell, current, irradiance, temperature, cells, substring, bypass=bypass
        )
        best = power.argmax(axis=1)
        low = np.where(best > 0, current[rows, np.maximum(best - 1, 0)], 0.0)
        high = current[rows, np.minimum(best + 1, current.shape[1] - 1)]
        current = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, POINTS)
    return np.maximum(power[rows, best], 0.0)


def _candidates(photo: NDArray[np.float64], substring: NDArray[np.int64]) -> NDArray[np.float64]:
    """Currents [h, I] in order: even steps, and near the weakest cell of every substring.

    Each maximum of the power lies just below the photocurrent that limits some substring.
    """
    limits = np.stack(
        [photo[:, substring == number].min(axis=1) for number in np.unique(substring)], axis=1
    )
    if limits.shape[1] > KNEES:
        limits = np.quantile(limits, np.linspace(0, 1, KNEES), axis=1).T
    near = (limits[:, :, None] * np.array(NEAR_KNEE)).reshape(len(photo), -1)
    even = photo.max(axis=1)[:, None] * np.arange(1, EVEN + 1) / EVEN
    return np.sort(np.concatenate([near, even], axis=1), axis=1)


def string_voltage(
    cell: Cell,
    current: NDArray[np.float64],
    irradiance: NDArray[np.float64],
    temperature: NDArray[np.float64],
    cells: NDArray[np.float64],
    substring: NDArray[np.int64],
    *,
    bypass: float = BYPASS_VOLTAGE,
) -> NDArray[np.float64]:
    """Voltage [H, I] of the string at currents [H, I] [A]; other arguments as `string_power`."""
    photo = cell_currents(cell, irradiance, temperature)[0]
    table = _diode_table(cell, float(max(photo.max(), current.max())))
    order = np.argsort(substring, kind="stable")
    return _string_voltage(
        current, photo[:, order], temperature[:, order].astype(float), cells[order],
        substring[order], table.voltage, table.reach, cell.series, bypass,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _DiodeTable:
    """V_d over I_ph - I and the temperature, the only two things that it depends on."""

    voltage: NDArray[np.float64]  # [T, N] [V]
    reach: float  # the axis is even in asinh(current / SMALL_CURRENT) from -reach to reach


def _diode_table(cell: Cell, largest: float) -> _DiodeTable:
    """A table that reaches the largest current [A], made once for its power of two."""
    return _made_table(cell, 2.0 ** np.ceil(np.log2(max(largest, SMALL_CURRENT))))


@lru_cache(maxsize=8)
def _made_table(cell: Cell, largest: float) -> _DiodeTable:
    reach = float(np.arcsinh(largest / SMALL_CURRENT))
    spare = SMALL_CURRENT * np.sinh(np.linspace(-reach, reach, TABLE_CURRENTS))
    _, first, second, thermal = cell_currents(cell, 0.0, TABLE_TEMPERATURES[:, None])
    return _DiodeTable(diode_voltage(spare, first, second, thermal, cell.shunt, 0.0), reach)


@compiled(parallel=True)
def _string_voltage(
    current, photo, temperature, cells, substring, table, reach, series, bypass
):  # fmt: skip
    total = np.zeros(current.shape)
    rows, columns = table.shape
    per_step = (columns - 1) / (2 * reach)
    for h in numba.prange(current.shape[0]):
        for i in range(current.shape[1]):
            sum_of_substring = 0.0
            for n in range(photo.shape[1]):
                x = (np.arcsinh((photo[h, n] - current[h, i]) / SMALL_CURRENT) + reach) * per_step
                column = min(max(int(x), 0), columns - 2)
                x -= column
                y = (temperature[h, n] - FIRST_TEMPERATURE) / TEMPERATURE_STEP
                row = min(max(int(y), 0), rows - 2)
                y -= row
                cold = table[row, column] * (1 - x) + table[row, column + 1] * x
                warm = table[row + 1, column] * (1 - x) + table[row + 1, column + 1] * x
                inner = cold * (1 - y) + warm * y
                sum_of_substring += cells[n] * (inner - current[h, i] * series)
                if n + 1 == photo.shape[1] or substring[n + 1] != substring[n]:
                    total[h, i] += max(sum_of_substring, -bypass)
                    sum_of_substring = 0.0
    return total
