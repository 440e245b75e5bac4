"""The two-diode model of a solar cell, fitted to a datasheet.

    I = I_ph - I_01 (exp(V_d / V_t) - 1) - I_02 (exp(V_d / (2 V_t)) - 1) - V_d / R_p
    V = V_d - I R_s,   V_t = k T / q

The first diode stands for recombination in the bulk (ideality 1), the second for recombination in
the space-charge region (ideality 2).  With irradiance G and cell temperature T:

    I_ph = I_ph,ref (G / 1000) (1 + alpha (T - T_ref))
    I_01 ~ T^3 exp(-E_g / (k T)),   I_02 ~ T^(5/2) exp(-E_g / (2 k T))

Reverse breakdown is left out: bypass diodes keep a shaded cell far from it.

Source: Sah, Noyce and Shockley 1957, doi:10.1109/JRPROC.1957.278528; Wolf, Noel and Stirn 1977,
doi:10.1109/T-ED.1977.18750; band gap of silicon: Varshni 1967, doi:10.1016/0031-8914(67)90062-6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import DataError

BOLTZMANN = 8.617333262e-5  # k / q [V/K]
STANDARD_TEMPERATURE = 298.15  # of the datasheet's standard test conditions [K]
STANDARD_IRRADIANCE = 1000.0  # [W/m2]
ICE = 273.15  # 0 degrees Celsius [K]


@dataclass(frozen=True, slots=True)
class Datasheet:
    """What a module's datasheet states at 1000 W/m2 and 25 C."""

    short_circuit_current: float  # [A]
    open_circuit_voltage: float  # [V]
    current: float  # at maximum power [A]
    voltage: float  # at maximum power [V]
    cells: int  # in series
    current_coefficient: float = 0.0005  # alpha of the short-circuit current [1/K]
    shunt: float = 50.0  # R_p of one cell [Ohm]; datasheets do not state it

    def __post_init__(self) -> None:
        if not 0 < self.current < self.short_circuit_current:
            raise DataError("current: expected less than the short-circuit current, above 0")
        if not 0 < self.voltage < self.open_circuit_voltage:
            raise DataError("voltage: expected less than the open-circuit voltage, above 0")
        if self.cells < 1 or not self.shunt > 0:
            raise DataError("cells and shunt: expected positive numbers")

    @property
    def power(self) -> float:
        """Maximum power [W]."""
        return self.current * self.voltage


@dataclass(frozen=True, slots=True)
class Cell:
    """Parameters of one cell at standard test conditions."""

    photocurrent: float  # I_ph [A]
    saturation_1: float  # I_01 [A]
    saturation_2: float  # I_02 [A]
    series: float  # R_s [Ohm]
    shunt: float  # R_p [Ohm]
    current_coefficient: float  # alpha [1/K]


def fitted_cell(sheet: Datasheet) -> Cell:
    """The cell that meets all four of the datasheet's points exactly, for its R_p.

    For a given R_s the short circuit, the open circuit and the point of maximum power are linear in
    I_ph, I_01 and I_02; R_s follows from dP/dV = 0 at maximum power.

    Raises: `DataError` where no cell with positive parameters has these points.
    """
    from scipy.optimize import brentq

    thermal = BOLTZMANN * STANDARD_TEMPERATURE
    open_circuit, voltage = sheet.open_circuit_voltage / sheet.cells, sheet.voltage / sheet.cells

    def currents(series: float) -> NDArray[np.float64]:
        points = [(0.0, sheet.short_circuit_current), (open_circuit, 0.0), (voltage, sheet.current)]
        inner = np.array([v + i * series for v, i in points])
        rows = [np.ones(3), -np.expm1(inner / thermal), -np.expm1(inner / (2 * thermal))]
        return np.linalg.solve(np.array(rows).T, [i for _, i in points] + inner / sheet.shunt)

    def slope(series: float) -> float:
        """I + V dI/dV at maximum power [A]."""
        _, first, second = currents(series)
        inner = voltage + sheet.current * series
        conductance = (
            first / thermal * np.exp(inner / thermal)
            + second / (2 * thermal) * np.exp(inner / (2 * thermal))
            + 1 / sheet.shunt
        )
        return sheet.current - voltage * conductance / (1 + series * conductance)

    tried = np.linspace(0.0, 0.999 * (open_circuit - voltage) / sheet.current, 400)
    try:
        with np.errstate(over="raise", invalid="raise"):
            values = np.array([slope(series) for series in tried])
    except (FloatingPointError, np.linalg.LinAlgError):  # currents of a pA or of a GA
        values = np.empty(0)
    for k in np.flatnonzero(np.diff(np.sign(values))):
        series = brentq(slope, tried[k], tried[k + 1], xtol=1e-14)
        photo, first, second = currents(series)
        if photo > 0 and first > 0 and second >= 0:
            return Cell(
                float(photo), float(first), float(second), float(series), sheet.shunt, sheet.current_coefficient
            )
    raise DataError("no two-diode cell has these currents and voltages: check them and the number of cells")


def cell_currents(cell: Cell, irradiance: ArrayLike, temperature: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """I_ph, I_01, I_02 [A] and V_t [V] at irradiance [W/m2] and cell temperature [C]."""
    kelvin = np.asarray(temperature, dtype=float) + ICE
    thermal, reference = BOLTZMANN * kelvin, BOLTZMANN * STANDARD_TEMPERATURE
    ratio = kelvin / STANDARD_TEMPERATURE
    gap = silicon_gap(STANDARD_TEMPERATURE) / reference - silicon_gap(kelvin) / thermal
    photo = cell.photocurrent * np.asarray(irradiance, dtype=float) / STANDARD_IRRADIANCE
    photo = photo * (1 + cell.current_coefficient * (kelvin - STANDARD_TEMPERATURE))
    first = cell.saturation_1 * ratio**3 * np.exp(gap)
    second = cell.saturation_2 * ratio**2.5 * np.exp(gap / 2)
    return photo, first, second, thermal


def silicon_gap(kelvin: ArrayLike) -> NDArray[np.float64]:
    """Band gap of silicon [eV]: 1.17 - 4.73e-4 T^2 / (T + 636)."""
    kelvin = np.asarray(kelvin, dtype=float)
    return 1.17 - 4.73e-4 * kelvin**2 / (kelvin + 636.0)
