"""The study file of `cfs pv`: which elements are modules, their datasheet, their subsystems."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from mitsuba_cfs.errors import DataError
from scenes.photovoltaics.two_diode import Datasheet, fitted_cell
from scenes.toml_file import read_table, validated

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, lt=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ModuleTable(_Table):
    """A module at standard test conditions, and how its cells lie."""

    select: str  # ifcopenshell selector: by material, type, name, GUID
    short_circuit_current: Positive  # [A]
    open_circuit_voltage: Positive  # [V]
    current: Positive  # at maximum power [A]
    voltage: Positive  # at maximum power [V]
    cells: Annotated[int, Field(gt=0)]  # in series
    current_coefficient: float = 0.0005  # of the short-circuit current [1/K]
    shunt: Positive = 50.0  # of one cell [Ohm]
    substrings: Annotated[int, Field(gt=0)] = 3  # with a bypass diode each
    groups: Annotated[int, Field(gt=0)] = 4  # of cells along each substring
    mounting: Literal["freestanding", "semi_integrated", "insulated"] = "semi_integrated"

    def datasheet(self) -> Datasheet:
        """The electrical part."""
        return Datasheet(
            self.short_circuit_current, self.open_circuit_voltage, self.current, self.voltage,
            self.cells, self.current_coefficient, self.shunt,
        )  # fmt: skip


class SubsystemTable(_Table):
    """Modules on one input of an inverter."""

    name: str
    select: str
    in_series: bool = True  # else each module at its own best point


class PvStudy(_Table):
    """The whole file."""

    module: ModuleTable
    subsystem: tuple[SubsystemTable, ...] = ()  # by orientation if there is none
    leave_out: tuple[str, ...] = ()  # selectors: trees that do not exist
    surroundings: Annotated[float, Field(ge=0, le=1)] | None = None  # reflectance of all opaque
    other_losses: Share = 0.03  # soiling, cables, ageing
    inverter_efficiency: Annotated[float, Field(gt=0.5, le=1)] = 0.96


def read_pv_study(path: str | Path) -> PvStudy:
    """The study of a TOML file; `DataError` names the entry that is wrong."""
    path = Path(path)
    study = validated(PvStudy, read_table(path), path)
    try:
        fitted_cell(study.module.datasheet())
    except DataError as error:
        raise DataError(error.message, file=path, field="module") from None
    return study
