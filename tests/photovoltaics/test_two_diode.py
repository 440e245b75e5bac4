"""The two-diode cell and shaded strings, against closed forms and pvlib's single diode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pvlib
import pytest

from scenes.photovoltaics.energy import diode_voltage, string_power, string_voltage
from scenes.photovoltaics.two_diode import BOLTZMANN, ICE, Datasheet, cell_currents, fitted_cell

SHEET = Datasheet(9.2, 39.5, 8.7, 32.0, 60, 0.0005)


def cell_voltage(cell, current, irradiance, temperature):
    """Voltage of one cell that carries a current [A]; negative where it is shaded and driven."""
    photo, first, second, thermal = cell_currents(cell, irradiance, temperature)
    inner = diode_voltage(photo, first, second, thermal, cell.shunt, current)
    return inner - np.asarray(current, dtype=float) * cell.series


def test_fitted_cell_meets_every_point_of_the_datasheet():
    cell = fitted_cell(SHEET)
    for current, voltage in ((9.2, 0.0), (0.0, 39.5), (8.7, 32.0)):
        found = 60 * cell_voltage(cell, current, 1000.0, 25.0)
        # 1e-6 V: near the short circuit the voltage falls by R_p = 50 Ohm a cell
        assert found == pytest.approx(voltage, abs=1e-6)
    power = string_power(cell, [[1000.0]], [[25.0]], [60], [0])
    assert power[0] == pytest.approx(SHEET.power, rel=1e-6)
    around = 60 * 8.7 * np.array([0.999, 1.001])
    assert np.all(around / 60 * 60 * cell_voltage(cell, around / 60, 1000, 25) < SHEET.power)


def test_without_second_diode_it_is_pvlibs_single_diode():
    cell = replace(fitted_cell(SHEET), saturation_2=0.0)
    current = np.linspace(0, 9, 19)
    irradiance, temperature = 800.0, 47.0
    photo, first, _, thermal = cell_currents(cell, irradiance, temperature)
    current = current[current < photo]
    peer = pvlib.pvsystem.v_from_i(current, photo, first, cell.series, cell.shunt, thermal)
    found = cell_voltage(cell, current, irradiance, temperature)
    np.testing.assert_allclose(found, peer, atol=1e-8)


def test_saturation_follows_the_gap_and_voltage_falls_with_temperature():
    cell = fitted_cell(SHEET)
    voltage = 60 * cell_voltage(cell, 0.0, 1000.0, np.array([25.0, 75.0]))
    coefficient = (voltage[1] / voltage[0] - 1) / 50
    # silicon: -0.27 to -0.36 %/K over the datasheets of crystalline modules
    assert -0.0036 < coefficient < -0.0027
    _, first, _, thermal = cell_currents(cell, 0.0, 75.0)
    assert thermal == pytest.approx(BOLTZMANN * (75 + ICE))
    assert 500 < first / cell.saturation_1 < 1500  # doubles about every 5 K


def test_string_current_is_that_of_the_weakest_without_bypass():
    cell = fitted_cell(SHEET)
    lit = np.array([[1000.0, 300.0]])
    blocked = string_power(cell, lit, 25.0, [59, 1], [0, 0], bypass=1e9)
    even = string_power(cell, [[300.0]], 25.0, [60], [0])
    # The dark cell's shunt lets some more current through, never less
    assert even[0] * 0.999 < blocked[0] < 0.45 * SHEET.power


def test_bypassed_third_leaves_two_thirds_less_the_diode():
    cell = fitted_cell(SHEET)
    lit = np.array([[1000.0, 1000.0, 0.0]])
    power = string_power(cell, lit, 25.0, [20, 20, 20], [0, 1, 2])
    # 40 cells at their own best point, minus half a volt; the best point shifts by second order
    assert power[0] == pytest.approx(SHEET.power * 2 / 3 - 0.5 * 8.7, rel=1e-3)


def test_substrings_in_any_order_and_number_give_the_same_power():
    cell = fitted_cell(SHEET)
    rng = np.random.default_rng(1)
    lit, warm = rng.uniform(0, 1000, (50, 6)), rng.uniform(0, 60, (50, 6))
    order = rng.permutation(6)
    substring = np.array([0, 0, 1, 1, 2, 2])
    one = string_power(cell, lit, warm, np.full(6, 10), substring)
    two = string_power(cell, lit[:, order], warm[:, order], np.full(6, 10), substring[order])
    np.testing.assert_allclose(one, two, rtol=1e-12)
    dense = np.linspace(0, 1, 20001)[1:] * lit.max(axis=1, keepdims=True) * 0.0095
    swept = dense * string_voltage(cell, dense, lit, warm, np.full(6, 10.0), substring)
    # a sweep of 20,000 currents misses the top by less than (1/20000)^2 of a flat maximum
    np.testing.assert_allclose(one, swept.max(axis=1), rtol=1e-4)


def test_table_of_diode_voltages_is_the_model():
    cell = fitted_cell(SHEET)
    rng = np.random.default_rng(2)
    lit, warm = rng.uniform(0, 1200, (400, 1)), rng.uniform(-30, 90, (400, 1))
    current = rng.uniform(0, 12, (400, 1))
    found = string_voltage(cell, current, lit, warm, np.ones(1), np.zeros(1, int), bypass=1e9)
    exact = cell_voltage(cell, current, lit, warm)
    # a volt of reverse voltage for each 20 mA through the shunt: relative to that
    np.testing.assert_allclose(found, exact, rtol=2e-5, atol=5e-6)


def test_dark_string_gives_nothing_and_faults_are_named():
    cell = fitted_cell(SHEET)
    assert string_power(cell, [[0.0]], 5.0, [60], [0]) == 0.0
    with pytest.raises(ValueError, match="negative"):
        string_power(cell, [[-1.0]], 5.0, [60], [0])
    with pytest.raises(ValueError, match="no two-diode cell"):
        fitted_cell(replace(SHEET, cells=10))
    with pytest.raises(ValueError, match="short-circuit current"):
        Datasheet(9.2, 39.5, 9.7, 32.0, 60)
