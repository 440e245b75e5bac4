"""Yield of photovoltaic subsystems: temperature, mismatch, inverter.

`diode_voltage` inverts I(V) of `two_diode`; it is compiled, and is here so that a datasheet is
checked before a compiler is loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
import pvlib
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RegularGridInterpolator

from mitsuba_cfs.compiled import compiled
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from scenes.photovoltaics.irradiance import CellIrradiance
from scenes.photovoltaics.modules import PvModule
from scenes.photovoltaics.two_diode import Cell, Datasheet, cell_currents

NEWTON_STEPS = 60
CONVERGED = 1e-10  # [V]


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
        power[hours] = _maximum(cell, irradiance[hours], temperature[hours], cells, substring, bypass)
    return power


def _maximum(cell, irradiance, temperature, cells, substring, bypass) -> NDArray[np.float64]:
    """Power at the best of many currents, refined between its neighbours [h]."""
    current = _candidates(cell_currents(cell, irradiance, temperature)[0], substring)
    rows = np.arange(len(current))
    for _ in range(REFINEMENTS + 1):
        power = current * string_voltage(cell, current, irradiance, temperature, cells, substring, bypass=bypass)
        best = power.argmax(axis=1)
        low = np.where(best > 0, current[rows, np.maximum(best - 1, 0)], 0.0)
        high = current[rows, np.minimum(best + 1, current.shape[1] - 1)]
        current = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, POINTS)
    return np.maximum(power[rows, best], 0.0)


def _candidates(photo: NDArray[np.float64], substring: NDArray[np.int64]) -> NDArray[np.float64]:
    """Currents [h, I] in order: even steps, and near the weakest cell of every substring.

    Each maximum of the power lies just below the photocurrent that limits some substring.
    """
    limits = np.stack([photo[:, substring == number].min(axis=1) for number in np.unique(substring)], axis=1)
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
        current,
        photo[:, order],
        temperature[:, order].astype(float),
        cells[order],
        substring[order],
        table.voltage,
        table.reach,
        cell.series,
        bypass,
    )


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
def _string_voltage(current, photo, temperature, cells, substring, table, reach, series, bypass):
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


CALM = 1.0  # wind speed where the weather states none [m/s]


@dataclass(frozen=True, slots=True)
class Subsystem:
    """Modules on one inverter input: in series, or each at its own best point."""

    name: str
    modules: tuple[int, ...]  # their numbers
    in_series: bool = True


@dataclass(frozen=True, slots=True)
class SubsystemYield:
    """Power of one subsystem."""

    name: str
    modules: int
    peak: float  # at standard test conditions [W]
    direct_current: NDArray[np.float64]  # [h] [W] in the steps of the irradiance
    alternating_current: NDArray[np.float64]  # [h] [W]
    unmatched: float  # annual DC energy if every group of cells had its own best point [Wh]


def cell_temperatures(
    irradiance: NDArray[np.floating], weather: Weather, steps: NDArray[np.int64], *, mounting: str, efficiency: float
) -> NDArray[np.float64]:
    """Cell temperature [S, h] [C] by Faiman's heat balance with PVsyst's coefficients.

    T = T_air + G alpha (1 - eta) / (u_c + u_v wind), alpha = 0.9; u_c = 29 (freestanding),
    20 (semi_integrated), 15 W/m2K (insulated back).  Source: pvlib `temperature.pvsyst_cell`.
    """
    if weather.dry_bulb_c is None:
        raise ValueError("weather: has no air temperature")
    wind = np.full(len(steps), CALM) if weather.wind_speed is None else weather.wind_speed[steps]
    coefficients = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["pvsyst"][mounting]
    return pvlib.temperature.pvsyst_cell(
        irradiance, weather.dry_bulb_c[steps], wind, module_efficiency=efficiency, **coefficients
    )


def _cell_power(cell: Cell, irradiance: NDArray[np.float64], temperature: NDArray[np.float64]) -> NDArray[np.float64]:
    """Maximum power of one cell by itself, of the shape of its conditions [W]; from a table."""
    light = np.linspace(0.0, max(1.0, irradiance.max()), 101)
    warm = np.linspace(temperature.min() - 1, temperature.max() + 1, 41)
    grid = np.stack(np.meshgrid(light, warm, indexing="ij")).reshape(2, -1, 1)
    power = string_power(cell, grid[0], grid[1], [1.0], [0], bypass=np.inf)
    table = RegularGridInterpolator((light, warm), power.reshape(len(light), len(warm)))
    return table(np.stack([irradiance, temperature], axis=-1))


def subsystem_yields(
    modules: Sequence[PvModule],
    subsystems: Sequence[Subsystem],
    irradiance: CellIrradiance,
    weather: Weather,
    sheet: Datasheet,
    cell: Cell,
    *,
    mounting: str = "semi_integrated",
    other_losses: float = 0.03,
    inverter_efficiency: float = 0.96,
    progress: Progress = silent,
) -> list[SubsystemYield]:
    """Hourly power of every subsystem, shading mismatch among its cells included.

    Args:
        mounting: see `cell_temperatures`.
        other_losses: soiling, cables, ageing: share of the DC power.
        inverter_efficiency: nominal; its part-load curve is pvlib's `inverter.pvwatts`.
    """
    result = []
    for k, subsystem in enumerate(subsystems):
        rows = np.flatnonzero(np.isin(irradiance.module, subsystem.modules))
        light = irradiance.effective[rows].T.astype(float)
        area = np.mean([modules[m].area for m in subsystem.modules])
        warm = cell_temperatures(
            irradiance.plain[rows],
            weather,
            irradiance.steps,
            mounting=mounting,
            efficiency=min(0.9, sheet.power / 1000.0 / area),
        ).T
        members = irradiance.module[rows]
        groups = np.bincount(members)[members]
        cells = sheet.cells / groups
        strip = np.concatenate([modules[m].substring for m in sorted(set(members.tolist()))])
        # every module has its own substrings
        substring = members * (strip.max() + 1) + strip
        if subsystem.in_series:
            power = string_power(cell, light, warm, cells, substring)
        else:
            power = np.zeros(len(light))
            for m in subsystem.modules:
                own = members == m
                power += string_power(cell, light[:, own], warm[:, own], cells[own], substring[own])
        ideal = (cells * _cell_power(cell, light, warm)).sum()
        direct = power * (1 - other_losses)
        peak = sheet.power * len(subsystem.modules)
        alternating = pvlib.inverter.pvwatts(direct, peak, eta_inv_nom=inverter_efficiency)
        unmatched = float(ideal) * weather.step_h * (1 - other_losses)
        result.append(SubsystemYield(subsystem.name, len(subsystem.modules), peak, direct, alternating, unmatched))
        progress("yield", (k + 1) / len(subsystems))
    return result
