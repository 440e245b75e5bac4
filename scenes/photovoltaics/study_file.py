"""The study file of `cfs pv`: which elements are modules, their datasheet, their subsystems."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from mitsuba_cfs.errors import DataError
from scenes.photovoltaics.two_diode import Datasheet, fitted_cell
from scenes.toml_file import Positive, Share, TomlTable, read_table, validated


class ModuleTable(TomlTable):
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
            self.short_circuit_current,
            self.open_circuit_voltage,
            self.current,
            self.voltage,
            self.cells,
            self.current_coefficient,
            self.shunt,
        )


class SubsystemTable(TomlTable):
    """Modules on one input of an inverter."""

    name: str
    select: str
    in_series: bool = True  # else each module at its own best point


class PvStudy(TomlTable):
    """The whole file."""

    module: ModuleTable
    subsystem: tuple[SubsystemTable, ...] = ()  # by orientation if there is none
    leave_out: tuple[str, ...] = ()  # selectors: trees that do not exist
    surroundings: Share | None = None  # reflectance of all opaque
    other_losses: Annotated[float, Field(ge=0, lt=1)] = 0.03  # soiling, cables, ageing
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
