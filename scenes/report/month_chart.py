"""The frame of a chart of energy by month, and what it tells under the pointer."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from scenes.figures.chart import Chart, ChartMark, Readout
from scenes.figures.scale import Tick, axis_ticks
from scenes.language.catalogue import gettext
from scenes.language.numbers import month_name, rounded, short_month
from scenes.report.names import quantity


def month_chart(
    monthly: pd.DataFrame,
    names: Sequence[str],
    marks: Sequence[ChartMark],
    top: float,
    *,
    title: str,
    explanation: str,
) -> Chart:
    """Marks over months, from 0 to a top [kWh].

    Args: names: columns of `monthly` [kWh] that are told under the pointer.
    """
    ticks = tuple(
        Tick(100 * (i + 0.5) / len(monthly), name[0], name[1:], False)
        for i, name in enumerate(short_month(m.month) for m in monthly.index)
    )
    rows = tuple(
        (quantity(n).label, tuple(f"{rounded(v, 0)} kWh" for v in monthly[n])) for n in names
    )
    return Chart(
        title,
        explanation,
        gettext("Month"),
        gettext("Energy [kWh]"),
        ticks,
        axis_ticks(0.0, top),
        tuple(marks),
        readout=Readout(tuple(month_name(m.month) for m in monthly.index), rows),
    )
