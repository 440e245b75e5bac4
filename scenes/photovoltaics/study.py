"""From the inputs of a command to the yield of a building's photovoltaic modules."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from bim.model import Building
from bim.report.issue import Issue
from bim.to_tracer import COMPASS
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from scenes.head import NO_HEAD, Head
from scenes.input_files import InputFiles
from scenes.input_options import InputOptions
from scenes.inputs import outdoor_inputs
from scenes.photovoltaics.energy import Subsystem, SubsystemYield, subsystem_yields
from scenes.photovoltaics.irradiance import CellIrradiance, cell_irradiance
from scenes.photovoltaics.modules import PvModule, pv_modules
from scenes.photovoltaics.study_file import PvStudy
from scenes.photovoltaics.two_diode import fitted_cell

FLAT = 30.0  # a face tilted less looks up [degrees]


@dataclass(frozen=True, slots=True)
class PvResult:
    """Result of a photovoltaic study."""

    building: Building  # with every element, without rooms
    modules: tuple[PvModule, ...]
    subsystems: tuple[Subsystem, ...]
    irradiance: CellIrradiance
    yields: tuple[SubsystemYield, ...]
    weather: Weather
    issues: tuple[Issue, ...]
    head: Head = NO_HEAD  # what was left out, what was assumed

    def module_table(self) -> pd.DataFrame:
        """Annual irradiation of each module, in the plane and below its glass [kWh/m2]."""
        step = self.weather.step_h / 1000
        owner = {m: subsystem.name for subsystem in self.subsystems for m in subsystem.modules}
        rows = []
        for number, module in enumerate(self.modules):
            own = self.irradiance.module == number
            plain = self.irradiance.plain[own].sum(axis=1, dtype=float) * step
            effective = self.irradiance.effective[own].sum(axis=1, dtype=float) * step
            rows.append(
                {
                    "guid": module.guid,
                    "name": module.name,
                    "subsystem": owner.get(number, ""),
                    "azimuth_deg": module.azimuth_deg,
                    "tilt_deg": module.tilt_deg,
                    "area_m2": module.area,
                    "irradiation_kwh_m2": plain.mean(),
                    "least_lit_cells_kwh_m2": plain.min(),
                    "effective_kwh_m2": effective.mean(),
                }
            )
        return pd.DataFrame(rows)

    def yield_table(self) -> pd.DataFrame:
        """Annual energy of each subsystem [kWh], and what it is per kW of peak power."""
        rows = []
        for one in self.yields:
            direct, alternating = (
                float(power.sum()) * self.weather.step_h / 1000
                for power in (one.direct_current, one.alternating_current)
            )
            ideal = one.unmatched / 1000
            rows.append(
                {
                    "subsystem": one.name,
                    "modules": one.modules,
                    "peak_kw": one.peak / 1000,
                    "yield_kwh": alternating,
                    "direct_current_kwh": direct,
                    "mismatch_loss": 1 - direct / ideal if ideal > 0 else 0.0,
                    "kwh_per_kw": alternating / (one.peak / 1000),
                }
            )
        return pd.DataFrame(rows)


def run_pv(
    options: InputOptions,
    files: InputFiles,
    study: PvStudy,
    *,
    file: Path | None = None,
    samples: int = 8192,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    on_head: Callable[[Head], None] = lambda head: None,
) -> PvResult:
    """Find the modules, trace their irradiance and model their yield.

    Args:
        options: the building of any format, how it is read, and the weather.
        files: of `read_files`; the weather's steps may have any length.
        file: of the study, for messages.
        on_head: called with what was left out and assumed, before anything is traced.
    """
    queries = [study.module.select, *(table.select for table in study.subsystem)]
    inputs, (selected, *of_subsystems) = outdoor_inputs(
        options, files, queries, leave_out=study.leave_out, reflectance=study.surroundings, file=file, progress=progress
    )
    building, weather = inputs.building, inputs.weather
    along, substrings = study.module.groups, study.module.substrings
    modules = pv_modules(building.elements, selected, substrings=substrings, along=along)
    if not modules:
        message = f"chooses no element with a shape in {options.building}"
        raise DataError(message, file=file, field=f"module.select = {study.module.select!r}")
    cell = fitted_cell(study.module.datasheet())
    subsystems, issues = _subsystems(study, of_subsystems, modules, file)
    head = inputs.head
    model = (*head.model, Note("Modules: {count}", count=len(modules)))
    head = replace(head, model=model, issues=(*building.issues, *issues))
    on_head(head)
    irradiance = cell_irradiance(
        building.elements, modules, weather, samples=samples, seed=seed, progress=progress, cache=cache
    )
    yields = subsystem_yields(
        modules,
        subsystems,
        irradiance,
        weather,
        study.module.datasheet(),
        cell,
        mounting=study.module.mounting,
        other_losses=study.other_losses,
        inverter_efficiency=study.inverter_efficiency,
        progress=progress,
    )
    return PvResult(building, tuple(modules), subsystems, irradiance, tuple(yields), weather, head.issues, head)


def _subsystems(
    study: PvStudy, selected: Sequence[frozenset[str]], modules: Sequence[PvModule], file: Path | None
) -> tuple[tuple[Subsystem, ...], list[Issue]]:
    """Modules of each stated subsystem; without any, those of each orientation.

    Args: selected: GUIDs that the selector of each subsystem chooses.
    """
    issues = _unalike(modules)
    if not study.subsystem:
        names = [orientation(module) for module in modules]
        return tuple(
            Subsystem(name, tuple(np.flatnonzero(np.array(names) == name).tolist()), False)
            for name in dict.fromkeys(names)
        ), issues
    taken: dict[str, str] = {}
    result = []
    for table, guids in zip(study.subsystem, selected, strict=True):
        own = tuple(number for number, module in enumerate(modules) if module.guid in guids)
        if not own:
            field = f"subsystem {table.name}: select"
            raise DataError("chooses none of the modules", file=file, field=field)
        for number in own:
            guid = modules[number].guid
            if guid in taken:
                what = f"module {modules[number].name} is also in {taken[guid]}"
                raise DataError(what, file=file, field=f"subsystem {table.name}: select")
            taken[guid] = table.name
        result.append(Subsystem(table.name, own, table.in_series))
    for module in modules:
        if module.guid not in taken:
            values = {"module": module.name}
            issues.append(Issue("module-in-no-subsystem", module.guid, values))
    return tuple(result), issues


def orientation(module: PvModule) -> str:
    """Compass point of a module's face, or "roof"."""
    if module.tilt_deg < FLAT:
        return "roof"
    return COMPASS[round(module.azimuth_deg / 45) % 8]


def _unalike(modules: Sequence[PvModule]) -> list[Issue]:
    """Modules of another size than most: one datasheet cannot be theirs."""
    sizes = [round(module.area, 2) for module in modules]
    usual = Counter(sizes).most_common(1)[0][0]
    return [
        Issue("module-of-other-size", module.guid, {"module": module.name, "area": module.area, "usual": usual})
        for module in modules
        if abs(module.area - usual) > 0.05 * usual
    ]
