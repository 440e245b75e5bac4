"""The file of `cfs fit`: a study of `cfs thermal`, parameters with priors, and what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field, model_validator

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.sky.weather import Weather
from scenes.heat.measured_weather import interval_ends, no_column
from scenes.heat.study_file import StudyFile, study_of
from scenes.toml_file import Key, Positive, TomlTable, read_table, set_key, validated, with_absolute_files
from scenes.uncertain_inputs import INPUTS

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Quantity = Literal["air temperature", "operative temperature", "illuminance", "luminance"]
LIGHT = ("illuminance", "luminance")
UNITS = {"air temperature": "C", "operative temperature": "C", "illuminance": "lx", "luminance": "cd/m2"}
# keys whose usual deviation is that of an uncertain input, by their ends
USUAL = {
    "reflectance.floor": "reflectance_floor",
    "reflectance.wall": "reflectance_walls",
    "reflectance.ceiling": "reflectance_ceiling",
    "albedo": "reflectance_ground",
    "g_value": "g_value",
    "u_value": "u_value",
}
LEAST_READINGS = 3


class ParameterTable(TomlTable):
    """An input that is fitted: a number of the study, or a factor of several."""

    name: str = ""
    key: Key = ""
    keys: tuple[Key, ...] = ()
    factor: bool = False  # the numbers at the keys are multiplied by it
    mean: float | None = None  # of the prior; None: the study's own number, 1 of a factor
    deviation: Positive | None = None  # of the prior; None: the usual one of docs/sensitivities.md
    low: float | None = None  # bounds
    high: float | None = None

    @model_validator(mode="after")
    def _is_one(self) -> ParameterTable:
        if bool(self.key) == bool(self.keys):
            raise ValueError("give either `key` or `keys`")
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError("expected `low` below `high`")
        return self

    @property
    def all_keys(self) -> tuple[str, ...]:
        """The keys of the study that it sets."""
        return self.keys or (self.key,)

    @property
    def label(self) -> str:
        """Its name, else its key."""
        return self.name or ", ".join(self.all_keys)

    @property
    def usual(self) -> float | None:
        """The usual deviation of such an input, if there is one."""
        ends = [end for end in USUAL if self.key == end or self.key.endswith(f".{end}")]
        return INPUTS[USUAL[ends[0]]].deviation if ends and not self.factor else None


class MeasurementTable(TomlTable):
    """A column of the measurements, and where in the model it was measured."""

    column: str
    quantity: Quantity
    room: str = ""  # of several: its name or GUID
    point: Vector | None = None  # of a light meter, or on the surface whose luminance was read [m]
    direction: Vector = (0.0, 0.0, 1.0)  # that a light meter faces; of the surface's normal

    @model_validator(mode="after")
    def _has_point(self) -> MeasurementTable:
        if (self.quantity in LIGHT) != (self.point is not None):
            raise ValueError(
                "point: is missing" if self.point is None else "point: belongs to illuminance and luminance"
            )
        if not np.any(self.direction):
            raise ValueError("direction: expected a direction, got zeros")
        return self


class FitFile(TomlTable):
    """A whole fit; paths are relative to the file."""

    study: Path  # of `cfs thermal`
    measured: Path  # CSV
    time: str = "time"  # column of the intervals' ends
    begin: datetime | None = None  # of the readings that are fitted; others are predicted
    end: datetime | None = None
    average_h: Annotated[Positive, Field(le=24)] | None = None  # means of so many hours are fitted; None: time steps
    parameter: Annotated[tuple[ParameterTable, ...], Field(min_length=1)]
    measurement: Annotated[tuple[MeasurementTable, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _no_twins(self) -> FitFile:
        for name, values in (
            ("parameter", [one.label for one in self.parameter]),
            ("measurement", [one.column for one in self.measurement]),
        ):
            twice = [value for value in values if values.count(value) > 1]
            if twice:
                raise ValueError(f"{name}: {twice[0]!r} is there twice")
        if self.begin is not None and self.end is not None and not self.begin < self.end:
            raise ValueError("begin: expected a time before `end`")
        return self


@dataclass(frozen=True, slots=True)
class Fit:
    """A fit as it was read: the study's table, priors, and the readings."""

    tables: FitFile
    study: dict[str, Any]  # table of the study, with absolute paths
    study_file: Path
    file: Path
    readings: pd.DataFrame  # of each column, by the ends of its intervals
    mean: Array  # [p] of the priors
    deviation: Array  # [p]
    low: Array  # [p]
    high: Array  # [p]

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it names."""
        return (self.study_file, self.file.parent / self.tables.measured)

    def study_at(self, theta: Sequence[float] | Array) -> StudyFile:
        """The study with the parameters' values.

        Raises: `DataError` that names the parameter's key.
        """
        return study_of(self.table_at(theta), self.study_file)

    def table_at(self, theta: Sequence[float] | Array) -> dict[str, Any]:
        """The study's table with the parameters' values."""
        table = with_absolute_files(self.study, self.study_file.parent)
        for parameter, value in zip(self.tables.parameter, theta, strict=True):
            for key in parameter.all_keys:
                for path in _paths(table, key.split(".")):
                    number = float(value)
                    if parameter.factor:
                        number *= _number_at(self.study, path, parameter.label, self.file)
                    try:
                        set_key(table, path, round(number, 9), made=True)
                    except DataError as error:
                        raise DataError(error.message, file=self.file, field=f"parameter {parameter.label}") from None
        return table


def read_fit(path: str | PathLike[str]) -> Fit:
    """The fit of a TOML file with its measurements.

    Raises: `DataError` that names the file and the key, or the line of the measurements.
    """
    path = Path(path)
    tables = validated(FitFile, read_table(path), path)
    for key in ("study", "measured"):
        if not (path.parent / getattr(tables, key)).is_file():
            raise DataError(f"no such file: {getattr(tables, key)}", file=path, field=key)
    study_file = (path.parent / tables.study).absolute()
    study = read_table(study_file)
    parsed = study_of(study, study_file)
    priors = [_prior(one, number, study, parsed, path) for number, one in enumerate(tables.parameter)]
    mean, deviation, low, high = (np.array(column) for column in zip(*priors, strict=True))
    readings = _readings(path.parent / tables.measured, tables)
    fit = Fit(tables, study, study_file, path, readings, mean, deviation, low, high)
    fit.study_at(mean)
    return fit


def _prior(
    one: ParameterTable, number: int, study: dict[str, Any], parsed: StudyFile, path: Path
) -> tuple[float, float, float, float]:
    """Mean, deviation and bounds of a parameter."""
    field = f"parameter.{number}"
    mean = one.mean
    dumped = parsed.model_dump(mode="json")
    for key in one.all_keys:
        paths = _paths(study, key.split("."))
        found = [_value_at(study, p) for p in paths]
        if found == [None]:
            found = [_value_at(dumped, p) for p in paths]
        if mean is None or one.factor:
            wrong = [value for value in found if isinstance(value, bool) or not isinstance(value, int | float)]
            if wrong:
                told = "nothing" if wrong[0] is None else repr(wrong[0])
                raise DataError(f"expected a number of the study at {key!r}, got {told}", file=path, field=field)
    if mean is None:
        mean = 1.0 if one.factor else float(found[0])
    deviation = one.deviation if one.deviation is not None else one.usual
    if deviation is None:
        raise DataError("is missing: how far the value may be from `mean`", file=path, field=f"{field}.deviation")
    low = -np.inf if one.low is None else one.low
    high = np.inf if one.high is None else one.high
    if one.key.rpartition(".")[2] in ("albedo",) or "reflectance" in one.key.split("."):
        low, high = max(low, 0.0), min(high, 1.0)
    if not low <= mean <= high:
        raise DataError(f"expected a mean from {low:g} to {high:g}, got {mean:g}", file=path, field=f"{field}.mean")
    return float(mean), float(deviation), float(low), float(high)


def _paths(table: Any, parts: Sequence[str]) -> list[list[str]]:
    """The paths that a key stands for: a list without a number is all of its entries."""
    if not parts:
        return [[]]
    first, *rest = parts
    if isinstance(table, list | tuple):
        if first.isdecimal():
            inner = table[int(first)] if int(first) < len(table) else None
            return [[first, *path] for path in _paths(inner, rest)]
        return [[str(n), *path] for n, one in enumerate(table) for path in _paths(one, parts)]
    inner = table.get(first) if isinstance(table, dict) else None
    return [[first, *path] for path in _paths(inner, rest)]


def _value_at(table: Any, path: Sequence[str]) -> Any:
    for part in path:
        if isinstance(table, list | tuple):
            table = table[int(part)] if part.isdecimal() and int(part) < len(table) else None
        else:
            table = table.get(part) if isinstance(table, dict) else None
    return table


def _number_at(table: Any, path: Sequence[str], label: str, file: Path) -> float:
    value = _value_at(table, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        key = ".".join(path)
        raise DataError(f"expected a number at {key!r} for a factor", file=file, field=f"parameter {label}")
    return float(value)


def _readings(path: Path, tables: FitFile) -> pd.DataFrame:
    """The columns of the measurements by time; empty cells are missing readings."""
    try:
        data = pd.read_csv(path)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    times = interval_ends(data, tables.time, path)
    late = np.flatnonzero(np.diff(times.asi8) <= 0)
    if late.size:
        raise DataError("expected times in order, none twice", file=path, element=f"line {late[0] + 3}")
    columns = {}
    for number, one in enumerate(tables.measurement):
        if one.column not in data.columns:
            raise DataError(no_column(one.column, data), file=path, field=f"measurement.{number}.column")
        values = pd.to_numeric(data[one.column], errors="coerce")
        wrong = np.flatnonzero((values.isna() & data[one.column].notna()) | np.isinf(values))
        if wrong.size:
            element = f"line {wrong[0] + 2}"
            raise DataError("expected a number or nothing", file=path, element=element, field=one.column)
        if one.quantity in LIGHT and (values < 0).any():
            element = f"line {int(np.argmax(values < 0)) + 2}"
            raise DataError("expected light of at least 0", file=path, element=element, field=one.column)
        columns[one.column] = values.to_numpy(dtype=float)
    return pd.DataFrame(columns, index=times)


def by_step(readings: pd.DataFrame, weather: Weather) -> pd.DataFrame:
    """Means of the readings in the time steps of the weather [H], NaN where there is none."""
    step = pd.Timedelta(hours=weather.step_h)
    number = np.searchsorted(weather.times.to_numpy(), readings.index.to_numpy())
    inside = (number < len(weather.times)) & (readings.index > weather.times[0] - step)
    near = np.minimum(number, len(weather.times) - 1)
    inside &= readings.index > weather.times[near] - step
    means = readings[inside].groupby(number[inside]).mean()
    return means.reindex(range(len(weather.times))).set_axis(weather.times)
