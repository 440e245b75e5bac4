"""Yield of photovoltaic subsystems: temperature, mismatch, inverter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pvlib
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from scenes.photovoltaics.irradiance import CellIrradiance
from scenes.photovoltaics.modules import PvModule
from scenes.photovoltaics.strings import string_power
from scenes.photovoltaics.two_diode import Cell, Datasheet

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
    irradiance: NDArray[np.floating],
    weather: Weather,
    steps: NDArray[np.int64],
    *,
    mounting: str,
    efficiency: float,
) -> NDArray[np.float64]:
    """Cell temperature [S, h] [C] by Faiman's heat balance with PVsyst's coefficients.

    T = T_air + G alpha (1 - eta) / (u_c + u_v wind), alpha = 0.9; u_c = 29 (freestanding),
    20 (semi_integrated), 15 W/m2K (insulated back).  Source: pvlib `temperature.pvsyst_cell`.
    """  # fmt: skip
    if weather.dry_bulb_c is None:
        raise ValueError("weather: has no air temperature")
    wind = np.full(len(steps), CALM) if weather.wind_speed is None else weather.wind_speed[steps]
    coefficients = pvlib.temperature.TEMPERATURE_MODEL_PARAMETERS["pvsyst"][mounting]
    return pvlib.temperature.pvsyst_cell(
        irradiance, weather.dry_bulb_c[steps], wind, module_efficiency=efficiency, **coefficients
    )


def _cell_power(
    cell: Cell, irradiance: NDArray[np.float64], temperature: NDArray[np.float64]
) -> NDArray[np.float64]:
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
            irradiance.plain[rows], weather, irradiance.steps, mounting=mounting,
            efficiency=min(0.9, sheet.power / 1000.0 / area),
        ).T  # fmt: skip
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
        result.append(
            SubsystemYield(
                subsystem.name, len(subsystem.modules), peak, direct, alternating, unmatched
            )
        )
        progress("yield", (k + 1) / len(subsystems))
    return result
