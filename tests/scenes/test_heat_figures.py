"""The figure of a year of heat: written for any length of step, its bars are the table's sums."""

from __future__ import annotations

from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from scenes.heat.plots import DEMANDS, ELECTRICITY, balance_panel, energy_panel, year_figure
from thermal.records import TERMS


def year_of(step_h: float):
    """A made-up year with constant flows, 100 W of sun in the glass that goes out by the window."""
    rows = round(8760 / step_h)
    start = pd.Timestamp("2017-01-01") + pd.Timedelta(hours=step_h / 2)
    times = pd.date_range(start, periods=rows, freq=pd.Timedelta(hours=step_h))
    swing = np.sin(np.arange(rows) * step_h / 8760 * 2 * np.pi)
    temperatures = ("air_c", "mrt_c", "operative_c", "outdoor_c")
    hours = {name: 20.0 + (i + 1) * swing for i, name in enumerate(temperatures)}
    hours |= {f"{name.replace(' ', '_')}_w": np.zeros(rows) for name in TERMS}
    hours |= {
        "glass_sun_w": np.full(rows, 100.0),
        "windows_w": np.full(rows, -140.0),
        "ideal_loads_w": np.full(rows, 40.0),
    }
    energy = {f"{name} [kWh/m2]": np.arange(12.0) for name in (*DEMANDS, *ELECTRICITY)}
    energy["electricity fans [kWh/m2]"] = np.zeros(12)
    return SimpleNamespace(name="A", hours=pd.DataFrame(hours, times), energy=pd.DataFrame(energy, range(1, 13)))


@pytest.mark.parametrize("step_h", [1.0, 0.5])
def test_balance_is_in_kwh_and_walls_come_with_their_sun(step_h) -> None:
    axes = Figure().subplots()
    balance_panel(year_of(step_h), axes)
    bars = {one.get_label(): [bar.get_height() for bar in one] for one in axes.containers}
    assert set(bars) == {"windows", "ideal loads"}
    january = 31 * 24 / 1e3
    assert bars["windows"][0] == pytest.approx(-40.0 * january)
    assert bars["ideal loads"][0] == pytest.approx(40.0 * january)


def test_what_is_not_there_has_no_entry() -> None:
    axes = Figure().subplots()
    energy_panel(year_of(1.0), axes)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["heat", "cold", "electricity lamps", "electricity equipment"]


def test_figure_is_whole(tmp_path) -> None:
    year_figure(year_of(1.0), tmp_path / "year.svg")
    root = ElementTree.parse(tmp_path / "year.svg").getroot()
    assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 50
