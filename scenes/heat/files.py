"""The small files of a study of `cfs thermal`, read and checked before its building is."""

from __future__ import annotations

from dataclasses import dataclass

from mitsuba_cfs.sky.weather import Weather
from scenes.heat.study_file import StudyFile
from scenes.job.files import check_names
from scenes.job.inputs import Given, System, read_system, read_weather
from scenes.job.thermal_system import ThermalSystem, checked_system


@dataclass(frozen=True, slots=True)
class HeatFiles:
    """What the files of a study hold, all but a building's."""

    weather: Weather
    systems: tuple[System, ...]  # by shading state
    thermals: tuple[ThermalSystem, ...]
    given: Given  # the same as what the study file gives for all windows


def read_files(study: StudyFile) -> HeatFiles:
    """Weather and shading states of a study; its box is checked too.

    Raises: `DataError` for what cannot be used.
    """
    check_names(study.spaces, "spaces")
    if study.box is not None:
        from scenes.heat.box import box_building  # geometry: only where there is one

        box_building(study.box)
    weather = read_weather(study.weather)
    systems = tuple(
        read_system(s.bsdf, u_value=s.u_value, g_value=s.g_value, by="[[system]] of the study,")
        for s in study.system
    )
    thermals = tuple(
        checked_system(one, table.bsdf, table)
        for one, table in zip(systems, study.system, strict=True)
    )
    return HeatFiles(weather, systems, thermals, Given(systems, ask="a [[system]]"))
