"""The methods of the cases that leave theirs open, chosen by this machine's costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.calibration.choice import Demand, MethodChoice, choose
from scenes.calibration.costs import Calibration, Workload
from scenes.calibration.shipped import this_machines_costs
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.run.inputs import read_weather
from scenes.study.case import AUTO, Case, with_method
from scenes.study.one_case import case_systems
from scenes.study.plan import StudyPlan
from scenes.study.study_file import Study


def settled(study: Study, plan: StudyPlan, calibration: Calibration | None = None) -> StudyPlan:
    """The plan with a method for every case; those of rooms with mirrors have their own.

    Args: calibration: this machine's by default, measured or scaled.

    Raises: `DataError` for a calibration of this machine that cannot be read.
    """
    open_cases = [case for case in plan.cases if case.chosen == AUTO]
    if not open_cases:
        return plan
    calibration = calibration or this_machines_costs()
    calibration = calibration.scaled(study.options.picture_size)
    chosen: dict[bool, MethodChoice] = {}
    for specular in {case.specular for case in open_cases}:
        cases = [case for case in open_cases if case.specular == specular]
        budget = study.auto.time_budget * len(cases) / len(open_cases)
        demand = Demand(work_of(cases), budget, study.auto.dgp_error, _fine(cases, plan), specular)
        choice = choose(demand, calibration)
        chosen[specular] = replace(choice, why=f"{choice.why}; {calibration.origin}")
    cases = []
    for case in plan.cases:
        if case.chosen == AUTO:
            choice = chosen[case.specular]
            metric = "none" if case.glare == "none" else choice.metric
            case = with_method(case, choice.method, metric, choice.why)
        cases.append(case)
    predicted = sum(choice.seconds for choice in chosen.values())
    return replace(plan, cases=tuple(cases), predicted=predicted)


def work_of(cases: list[Case]) -> Workload:
    """Rooms, systems, and for each pair the rated hours of all orientations and climates."""
    scenes = len({case.scene for case in cases})
    systems = len({case.system for case in cases})
    hours = {}
    for case in cases:
        if case.weather not in hours:
            weather = read_weather(case.weather.path)
            used = working_hours(weather, *case.options.occupancy.hours)
            up = is_up(sun_directions(weather))
            hours[case.weather] = np.array([np.count_nonzero(used & up), np.count_nonzero(up)])
    rated, lit = sum(hours[case.weather] for case in cases) / (scenes * systems)
    return Workload(scenes, systems, round(rated), round(lit))


def _fine(cases: list[Case], plan: StudyPlan) -> bool:
    """Whether every system is known finely enough for the sun's disc."""
    files = {case.bsdf.path for case in cases if case.bsdf is not None}
    systems = [read_system(path) for path in files]
    for case in cases:
        if case.bsdf is None:
            _, space = plan.rooms[case.scene]
            systems += [one for states in case_systems(case, space).values() for one in states]
    return all(map(keeps_the_sun, {id(system): system for system in systems}.values()))


def keeps_the_sun(system: FenestrationSystem) -> bool:
    """A tensor tree, or a Klems matrix that has the straight beam on its diagonal."""
    if system.tree is not None:
        return True
    matrix = system.visible
    return bool(through_peak(matrix.transmission_front, matrix.basis_in).transmittance.max() > 0)
