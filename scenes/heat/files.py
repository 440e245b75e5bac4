"""The small files of a study of `cfs thermal`, read and checked before its building is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import FenestrationSystem, States, WindowOverrides
from scenes.fenestration.thermal_system import checked_system
from scenes.heat.measured_weather import read_measured
from scenes.heat.study_file import StudyFile
from scenes.input_files import InputFiles, check_names, read_weather
from scenes.room.ground import YEAR_DAYS
from scenes.room.operation import check_schedules, read_state


@dataclass(frozen=True, slots=True)
class HeatFiles:
    """What the files of a study hold, all but a building's."""

    inputs: InputFiles
    systems: tuple[FenestrationSystem, ...]  # of the study's tables

    @property
    def weather(self) -> Weather:
        """The weather of the year."""
        return self.inputs.weather


def read_files(study: StudyFile, file: Path | None = None, *, weather: Weather | None = None) -> HeatFiles:
    """Weather and shading states of a study; its box is checked too.

    Args: file: the study's own, for messages; weather: of the study, where it is read already.

    Raises: `DataError` for what cannot be used.
    """
    check_names(study.spaces, "spaces")
    if study.box is not None:
        from scenes.heat.box import box_building  # geometry: only where there is one

        box_building(study.box)
    if weather is not None:
        pass
    elif study.measured is None:
        weather = read_weather(study.weather)
        if study.heat_island is not None:
            weather = study.heat_island.warmed(weather, file)
    else:
        weather = read_measured(study.weather, study.measured)
        _fits_measured(study, weather, file)
    check_schedules(study, weather, file)
    for key in ("tilt_step_deg", "control_of"):
        if getattr(study, key) is not None:
            message = "belongs to an operation file of `cfs run` and `cfs study`"
            raise DataError(message, file=file, field=key)
    by = "[[system]] of the study,"
    systems = tuple(replace(read_state(table, table.bsdf, by=by), tilt_deg=table.tilt_deg) for table in study.system)
    for one, table in zip(systems, study.system, strict=True):
        checked_system(one, table.bsdf or file)
    return HeatFiles(InputFiles(weather, _overrides(study, systems)), systems)


def _overrides(study: StudyFile, systems: tuple[FenestrationSystem, ...]) -> WindowOverrides:
    """The systems as the states of the windows that their tables name."""
    states: dict[tuple[str, ...], States] = {}
    for table, system in zip(study.system, systems, strict=True):
        states[table.windows] = (*states.get(table.windows, ()), system)
    return WindowOverrides(states.pop((), ()), named=tuple(states.items()), ask="a [[system]]")


def _fits_measured(study: StudyFile, weather: Weather, file: Path | None) -> None:
    """Raise `DataError` where a study asks of weather that is no year what only a year says."""
    step = 60.0 * weather.step_h
    if study.step_minutes < step and step % study.step_minutes:
        message = f"expected a part of the weather's {step:g} minutes, got {study.step_minutes}"
        raise DataError(message, file=file, field="step_minutes")
    days = len(weather.times) * weather.step_h / 24.0
    if days < YEAR_DAYS and any(one.envelope.ground is not None for one in study.variants):
        raise DataError(
            f"the ground follows a year of weather, got {days:.0f} days; state a temperature by [[envelope.neighbour]]",
            file=file,
            field="envelope.ground",
        )
