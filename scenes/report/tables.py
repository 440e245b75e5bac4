"""Tables of the report: rows of cells ready for plain HTML, sortable and easy to copy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from bim.report.issue import Issue, IssueText
from bim.report.ranking import ranked
from scenes.language.catalogue import N_, decimal, gettext
from scenes.language.numbers import cell, semicolons
from scenes.report.names import Quantity, quantity
from scenes.results import LuminancePicture, RoomYear

DGP_LIMITS = ((0.35, "imperceptible"), (0.40, "perceptible"), (0.45, "disturbing"))
CLASS_WORDS = {  # of glare
    "imperceptible": N_("imperceptible"),
    "perceptible": N_("perceptible"),
    "disturbing": N_("disturbing"),
    "intolerable": N_("intolerable"),
}
GLARE_WORDS = {
    "imperceptible": N_("imperceptible glare"),
    "perceptible": N_("perceptible glare"),
    "disturbing": N_("disturbing glare"),
    "intolerable": N_("intolerable glare"),
}


@dataclass(frozen=True, slots=True)
class Column:
    """One column: heading, unit, what it means, and whether it holds numbers."""

    label: str
    unit: str = ""
    meaning: str = ""
    numeric: bool = True
    short: bool = False  # text that is not broken into lines


@dataclass(frozen=True, slots=True)
class Table:
    """Headed rows of text."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]


def glare_class(dgp: float) -> str:
    """The word for a daylight glare probability (Wienold 2009; EN 14501)."""
    return next((word for limit, word in DGP_LIMITS if dgp <= limit), "intolerable")


def glare_table(times: pd.DatetimeIndex, pictures: Iterable[LuminancePicture]) -> Table:
    """The glare of each picture's hour, in time's order."""
    pictures = sorted(pictures, key=lambda picture: picture.hour)
    others = dict.fromkeys(key for picture in pictures for key in picture.glare)
    keys = ["dgp", *(key for key in others if key != "dgp")]
    columns = [Column(gettext("Hour"), numeric=False, short=True)]
    columns += [_column(key) for key in keys]
    columns.insert(2, Column(gettext("Class"), "", gettext("Class of the DGP."), numeric=False, short=True))
    columns.append(Column(gettext("Brightest pixel"), "cd/m²", gettext("Highest luminance in the picture.")))
    rows = []
    for picture in pictures:
        row = [moment(times[picture.hour])]
        row += [cell(picture.glare.get(key), quantity(key).digits) for key in keys]
        row.insert(2, gettext(CLASS_WORDS[glare_class(picture.glare["dgp"])]))
        row.append(cell(float(picture.luminance.max()), 0))
        rows.append(tuple(row))
    return Table(gettext("Glare by hour"), tuple(columns), tuple(rows))


def moment(time: pd.Timestamp) -> str:
    """A time as a reader says it, sortable as text too."""
    return f"{time:%Y-%m-%d %H:%M}"


def monthly_gains(gains: pd.DataFrame) -> pd.DataFrame:
    """Energy by month [kWh] of the columns in watts, indexed by the month's first day."""
    watts = gains[[name for name in gains if name.endswith("_w")]]
    hours = step_hours(watts.index)
    return (watts * hours / 1000).groupby(watts.index.to_period("M")).sum()


def step_hours(times: pd.DatetimeIndex) -> float:
    """Length of an interval [h]: the shortest step."""
    if len(times) < 2:
        return 1.0
    return float(times.to_series().diff().min() / pd.Timedelta(hours=1))


def gains_table(monthly: pd.DataFrame) -> Table:
    """Monthly energies with their sum."""
    columns = [Column(gettext("Month"), numeric=False, short=True)]
    columns += [Column(quantity(n).label, "kWh", quantity(n).meaning) for n in monthly]
    rows = [
        (month.strftime("%Y-%m"), *(cell(v, 0) for v in row))
        for month, row in zip(monthly.index, monthly.to_numpy(), strict=True)
    ]
    rows.append((gettext("Sum"), *(cell(v, 0) for v in monthly.sum())))
    return Table(gettext("Solar energy by month"), tuple(columns), tuple(rows))


def values_table(caption: str, values: Mapping[str, float]) -> Table:
    """Named numbers, one a row."""
    rows = []
    for key, value in values.items():
        q = quantity(key)
        rows.append((q.label, named(q, value), q.unit, q.meaning))
    columns = (
        Column(gettext("Quantity"), numeric=False),
        Column(gettext("Value")),
        Column(gettext("Unit"), numeric=False, short=True),
        Column(gettext("Meaning"), numeric=False),
    )
    return Table(caption, columns, tuple(rows))


def named(q: Quantity, value: float | str | None) -> str:
    """The value as text; by its name where the quantity has names for its values."""
    if isinstance(value, str):
        return value
    if value is not None and q.values and 0 <= int(value) < len(q.values):
        return q.values[int(value)]
    return cell(value, q.digits)


def sensors_table(room: RoomYear) -> Table:
    """Every sensor with its metrics and its standard error."""
    daylight = room.daylight
    frame = daylight.sensor_metrics
    columns = [Column(gettext("Sensor"))] + [_column(key) for key in frame]
    columns += [Column(gettext("Annual mean"), "lx"), Column(gettext("Standard error"), "%")]
    digits = [2 if key in ("x", "y", "z") else max(quantity(key).digits, 1) for key in frame]
    mean = daylight.illuminance.mean(axis=0)
    rows = [
        (
            str(i),
            *(cell(float(v), d) for v, d in zip(row, digits, strict=True)),
            cell(float(mean[i]), 0),
            cell(100 * float(daylight.relative_error[i]), 2),
        )
        for i, row in enumerate(frame.to_numpy())
    ]
    return Table(gettext("Sensors of {room}", room=room.space.label), tuple(columns), tuple(rows))


def problems_table(issues: Iterable[Issue]) -> Table:
    """What is wrong with the building's file and what was done about it."""
    kinds = ranked(tuple(issues))
    glazed = any(one.glass for one in kinds)  # a column of dashes says nothing
    glass = (Column(gettext("Glass"), "m²"),) if glazed else ()
    columns = (
        *glass,
        Column(gettext("Problem"), numeric=False),
        Column(gettext("Treatment in the model"), numeric=False),
        Column(gettext("Element"), numeric=False),
    )
    rows = tuple(
        (
            *((cell(one.glass, 2) if one.glass else "–",) if glazed else ()),
            *issue_cells(one.text("command", gettext)),
            one.first.where,
        )
        for one in kinds
    )
    return Table(gettext("Problems by element"), columns, rows)


def issue_cells(text: IssueText) -> tuple[str, str]:
    """An issue, and its effect with the fix."""
    return text.what, semicolons([part for part in (text.effect, text.fix) if part])


def nested_table(caption: str, content: Mapping) -> Table:
    """Any nested mapping of the manifest, one value a row."""
    columns = (Column(gettext("Name"), numeric=False), Column(gettext("Value"), numeric=False))
    return Table(caption, columns, tuple(_flat(content)))


def _flat(content: Mapping, prefix: str = "") -> Iterable[tuple[str, str]]:
    for key, value in content.items():
        name = f"{prefix}{key}".replace("_", " ")
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name} › ")
        else:
            yield name, plain_value(value)


def plain_value(value: object) -> str:
    """A value of the manifest as text."""
    if isinstance(value, bool):
        return gettext("yes") if value else gettext("no")
    if isinstance(value, float):
        return decimal(f"{value:.6g}")
    if isinstance(value, list | tuple):
        return ", ".join(map(plain_value, value)) or "–"
    return "–" if value is None else str(value)


def _column(key: str) -> Column:
    q = quantity(key)
    if key in ("x", "y", "z"):
        return Column(key, "m")
    return Column(q.label, q.unit, q.meaning)
