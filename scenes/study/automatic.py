"""The methods of the cases that leave theirs open, by measured errors and this machine's costs.

- Specular surfaces in the room are outside of what eDGP and sDGP assume, and the phase methods'
  direct sun does not know their reflections: full DGP by point-in-time paths, whatever it takes.
  (The rule of the dissertation's 3.2.8.  The tracer has no mirrors in a room either, and the
  reason says so.)
- Otherwise a method within the limits of error and time; of these the most accurate, of equals the
  quickest, with full DGP where its time is about equal.  Errors are those measured for similar
  systems, see `scenes.calibration.errors`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bim.model import Building, Space
from bim.sensors import view_point
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.calibration.costs import Calibration, Workload
from scenes.calibration.durations import spoken_time
from scenes.calibration.errors import (
    MeasuredErrors,
    Pair,
    Traits,
    hidden_sky,
    measured_errors,
    sun_in_view,
    system_traits,
)
from scenes.calibration.shipped import this_machines_costs
from scenes.study.one_case import case_inputs, case_weather
from scenes.study.plan import AUTO, Case, StudyPlan, with_method
from scenes.study.study_file import Study

EQUAL = 0.011  # errors that differ by less are equal: they are known to a per cent at best
SLACK = 1.25  # times that differ by less are equal: then full DGP, which assumes least
SPECULAR = ("point-in-time", "DGP")


@dataclass(frozen=True, slots=True)
class Demand:
    """What is asked for."""

    work: Workload
    time_budget: float  # [s]
    dgp_error: float  # relative
    errors: Mapping[Pair, float]  # expected of each method and metric, relative
    specular: bool = False  # a surface of a room mirrors
    origin: str = ""  # of the errors, in words


@dataclass(frozen=True, slots=True)
class MethodChoice:
    """A method, a glare metric, and the reason in a sentence or two."""

    method: str
    metric: str
    seconds: float  # predicted
    error: float  # expected, relative
    why: str


def choose(demand: Demand, calibration: Calibration) -> MethodChoice:
    """The method and metric for a demand on the machine of a calibration.

    Where nothing meets both the error and the time, the nearest that the time allows is taken, or
    else the quickest; the reason says so.
    """
    seconds = {pair: calibration.seconds(*pair, demand.work) for pair in calibration.pairs()}
    if demand.specular:
        return _choice(
            SPECULAR,
            seconds,
            demand,
            "a surface of the room mirrors, which eDGP, sDGP "
            "and the phase methods do not cover: full pictures by paths (the mirror "
            "itself is not traced: every surface of a room is diffuse)",
        )
    known = {pair: s for pair, s in seconds.items() if pair in demand.errors}
    near = {pair for pair in known if demand.errors[pair] <= demand.dgp_error}
    quick = {pair for pair in known if known[pair] <= demand.time_budget}
    if near & quick:
        allowed, words = near & quick, f"{len(near & quick)} of {len(known)} meet error and time"
    elif quick:
        allowed, words = quick, "none within the time is near enough: the nearest that is"
    else:
        quickest = min(known, key=known.get)
        allowed, words = {quickest}, "none is quick enough: the quickest"
    best = min(demand.errors[pair] for pair in allowed)
    equals = [pair for pair in allowed if demand.errors[pair] < best + EQUAL]
    least = SLACK * min(known[pair] for pair in equals)
    equals = [pair for pair in equals if known[pair] <= least]
    taken = min(equals, key=lambda pair: (pair[1] != "DGP", known[pair]))
    return _choice(taken, seconds, demand, words)


def _choice(pair, seconds: dict[str, Any], demand: Demand, words: str) -> MethodChoice:
    method, metric = pair
    time, error = seconds[pair], demand.errors[pair]
    why = (
        f"{words}; expected error of DGP {100 * error:.2g} % (asked {100 * demand.dgp_error:.0f} %)"
        f", predicted {spoken_time(time)} (budget {spoken_time(demand.time_budget)}) for "
        f"{demand.work.scenes} room(s) x {demand.work.systems} system(s) x "
        f"{demand.work.steps} steps"
    )
    if time > demand.time_budget:
        why += "; OVER the time budget"
    if error > demand.dgp_error:
        why += "; NOT the error asked for"
    if demand.origin:
        why += f"; {demand.origin}"
    return MethodChoice(method, metric, time, error, why)


SHINING = 50.0  # [W/m2] normal to the sun, from which it counts as shining


def settled(
    study: Study, plan: StudyPlan, calibration: Calibration | None = None, measured: MeasuredErrors | None = None
) -> StudyPlan:
    """The plan with a method for every case; those of rooms with mirrors have their own.

    Args:
        calibration: this machine's by default, measured or scaled.
        measured: the errors that ship with the program by default.

    Raises: `DataError` for a calibration of this machine that cannot be read.
    """
    open_cases = [case for case in plan.cases if case.chosen == AUTO]
    if not open_cases:
        return plan
    calibration = calibration or this_machines_costs()
    calibration = calibration.scaled(study.options.picture_size)
    measured = measured or measured_errors()
    chosen: dict[bool, MethodChoice] = {}
    for specular in {case.specular for case in open_cases}:
        cases = [case for case in open_cases if case.specular == specular]
        budget = study.auto.time_budget * len(cases) / len(open_cases)
        traits = case_traits(cases, plan)
        demand = Demand(
            work_of(cases), budget, study.auto.dgp_error, measured.of_all(traits), specular, measured.origin(traits)
        )
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
        if case.inputs.weather not in hours:
            weather = case_weather(case)
            used = working_hours(weather, *case.options.occupancy.hours)
            up = is_up(sun_directions(weather))
            hours[case.inputs.weather] = np.array([np.count_nonzero(used & up), np.count_nonzero(up)])
    rated, lit = sum(hours[case.inputs.weather] for case in cases) / (scenes * systems)
    return Workload(scenes, systems, round(rated), round(lit))


def case_traits(cases: list[Case], plan: StudyPlan) -> list[Traits]:
    """What a method's error goes by, of each system in each room under each climate."""
    rooms: dict[tuple[Any, ...], tuple[float, float]] = {}
    systems: dict[tuple[Any, ...], list[tuple[float, float, float, float]]] = {}
    result: dict[Traits, None] = {}
    for case in cases:
        building, space = plan.rooms[case.scene]
        filled = (case.scene, case.inputs.system, case.inputs.operation)
        if filled not in systems:
            systems[filled] = filled_traits(case, building)
        seen = (case.scene, case.inputs.weather, case.orientation_deg)
        if seen not in rooms:
            rooms[seen] = room_traits(case, building, space)
        result |= {Traits(*system, *rooms[seen]): None for system in systems[filled]}
    return list(result)


def filled_traits(case: Case, building: Building) -> list[tuple[float, float, float, float]]:
    """The traits of what fills a case's windows, each in its first state."""
    filled = case_inputs(case, building).systems.values()
    first = {id(states[0]): states[0] for states in filled}
    return [system_traits(system.fine) for system in first.values()]


def room_traits(case: Case, building: Building, space: Space) -> tuple[float, float]:
    """Share of the occupied hours with the sun in view, and of the sky that is hidden."""
    if not space.windows:
        return 0.0, 0.0
    weather = case_weather(case)
    suns = sun_directions(weather)
    rated = working_hours(weather, *case.options.occupancy.hours) & is_up(suns)
    shining = (weather.direct_normal > SHINING)[rated]
    groups = window_groups(space)
    sun = sun_in_view(groups, *view_point(space), suns[rated], shining)
    return sun, hidden_sky(groups, exterior_surfaces(building, space))
