"""One case of a study, from its files to its figures."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Unpack

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Window
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import sha256
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.glare.classes import CLASSES, class_hours, hour_not_exceeded, mean_error, protection_level
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.resolver import source_notes
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_system import thermal_system
from scenes.head import Head, joined, model_lines, tree_notes
from scenes.heat.box import building_or_box
from scenes.input_files import building_of, read_files, read_weather
from scenes.input_options import InputOptions
from scenes.inputs import Inputs, inputs_of
from scenes.results import RoomYear, method_figures
from scenes.room.inputs import skies_for
from scenes.room.options import RoomOptions
from scenes.room.room import RoomChoices, compute_room
from scenes.room.shared_states import with_shared_states
from scenes.study.plan import OF_BUILDING, OF_ROOM, Case, InputFile, StudyPlan, program_version
from scenes.study.store import CaseResult
from scenes.study.study_file import SYSTEM_TABLE

WARM_C = 26.0  # operative temperature above which hours are counted
KEPT_TEMPERATURES = ("outdoor_c", "air_c", "operative_c")
OF_READING = ("building", "surroundings", "cache", *OF_ROOM[1:])  # that a building is read with
ALONE = threading.Lock()  # Dr.Jit has all cores already, and a worker may have several threads


def case_inputs(case: Case, building: Building | None = None, spaces: tuple[str, ...] = ()) -> Inputs:
    """The inputs of a case, from its files.

    Args: building: of the case, where it is read already; spaces: other rooms than its own.

    Raises: `DataError` for a file that has changed or cannot be used.
    """
    if case.program != program_version():
        raise DataError("this process runs another version of the program than the study's")
    for source in case.files:
        if sha256(source.path) != source.sha256:
            raise DataError("is not the file that it was when the study began", file=source.path)
    files = read_files(case.inputs, weather=case_weather(case), table=SYSTEM_TABLE)
    if case.control is not None and files.operation is not None:
        files = replace(files, operation=files.operation.controlled_by(case.control.function))
    options = replace(case.inputs, spaces=spaces) if spaces else case.inputs
    building = _building(case) if building is None else building
    return inputs_of(building, options, files, heat_of=case.options)


def plan_head(plan: StudyPlan) -> Head:
    """What was left out of the buildings of a study, and what is assumed in its cases."""
    rooms: dict[tuple[Any, ...], tuple[Case, Building, list[str]]] = {}
    for case in plan.cases:
        building, space = plan.rooms[case.scene]
        key = (id(building), replace(case.inputs, spaces=()))
        rooms.setdefault(key, (case, building, []))[2].append(space.guid)
    heads = []
    for case, building, guids in rooms.values():
        spaces = tuple(dict.fromkeys(guids))
        try:
            heads.append(case_inputs(case, building, spaces).head)
        except DataError as error:  # of these cases alone, which then fail
            heads.append(Head(model_lines(building), building.issues, (str(error),)))
    return joined(heads)


def case_year(inputs: Inputs, case: Case, **chosen: Unpack[RoomChoices]) -> RoomYear:
    """The room's year by the case's options; chosen: as of `lit_room`."""
    options, (space,) = case.options, inputs.spaces
    weather = _file(case, "weather"), case.orientation_deg
    skies = _skies(*weather, options.sampling, *options.sky.items())
    room, cache = (inputs.building, [space], inputs.systems, inputs.weather, options), MatrixCache.of_user()
    operation = with_shared_states(
        inputs.operation, *room, skies=skies, cache=cache, progress=chosen.get("progress", silent)
    )
    return compute_room(
        inputs.building,
        space,
        inputs.systems,
        inputs.weather,
        options,
        operation=operation,
        skies=skies,
        cache=cache,
        pictures=False,
        **chosen,
    )


def compute_case(case: Case, progress: Progress = silent) -> CaseResult:
    """Figures and arrays of a case.

    Raises: `DataError` for a file that has changed or cannot be used, `RoomError` for a room that
    cannot be computed.
    """
    with ALONE:
        return _computed(case, progress)


def _computed(case: Case, progress: Progress) -> CaseResult:
    start = time.monotonic()
    variants.activate()
    inputs = case_inputs(case)
    systems, weather = inputs.systems, inputs.weather
    hours = _rated_hours(weather, case.options)
    rate = None if case.glare == "none" else (case.glare, hours)
    room = case_year(inputs, case, rate=rate, progress=progress)
    figures, arrays = room_figures(room)
    figures |= {f"da300 {grid.name}": grid.metrics["da300"] for grid in room.daylight.grids}
    figures["straight_view_percent"] = _straight_view(room, systems, hours)
    if room.dgp is not None:
        figures |= glare_figures(room.dgp.dgp, weather, case.options.occupancy.hours)
        figures |= rating_figures(room.dgp)
        arrays["dgp"] = np.full(len(weather.times), np.nan, dtype=np.float32)
        arrays["dgp"][hours] = room.dgp.dgp
    if case.inputs.system is None:  # else the table says it: names are no part of a case's key
        figures["fenestration"] = " ".join(source_notes(inputs.sources))
    models = (thermal_system(system).named_model for system in inputs.used_systems)
    figures["window_model"] = " ".join(dict.fromkeys(models))
    of_file = case_weather(case).notes
    if street := [note for note in weather.notes if note not in of_file]:
        figures["heat_island"] = " ".join(street)
    if trees := tree_notes(inputs.building):
        figures["trees"] = " ".join(trees)
    figures["seconds"] = round(time.monotonic() - start, 3)
    return CaseResult(case.key, figures, arrays)


def _straight_view(room: RoomYear, systems: dict[str, States], hours: NDArray[np.int64]) -> float:
    """The view through the windows, in the shading state of each of the hours [h]."""
    state = np.zeros((len(hours), len(room.space.windows)), dtype=np.int64)
    if room.operation is not None:
        state = room.operation.shading.of_windows[hours]
    return straight_view(room.space.windows, systems, state)


def _building(case: Case) -> Building:
    """The building of a case: files are read once for neighbours in the grid."""
    if case.box is not None:
        return building_or_box(case.box, case.inputs)
    files = tuple(file for file in case.files if file.name.startswith(OF_BUILDING))
    named = {name: value for name, value in case.inputs.named().items() if name in OF_READING}
    return _read_building(files, InputOptions(weather=None, **named))


def _file(case: Case, name: str) -> InputFile:
    return next(file for file in case.files if file.name == name)


@lru_cache(maxsize=4)
def _read_building(files: tuple[InputFile, ...], options: InputOptions) -> Building:
    """The building of files that have not changed since: `files` tells them apart."""
    return building_of(options)


@lru_cache(maxsize=4)
def _read_weather(source: InputFile) -> Weather:
    return read_weather(source.path)


def case_weather(case: Case) -> Weather:
    """The weather of a case, turned against its model."""
    return _turned(_file(case, "weather"), case.orientation_deg)


def _turned(source: InputFile, angle: float) -> Weather:
    return _read_weather(source).turned(angle)


@lru_cache(maxsize=1)  # some 100 MB each; neighbours in the grid share it
def _skies(source: InputFile, angle: float, sampling: Sampling, *sky: tuple[str, str]) -> AnnualSky:
    return skies_for(_turned(source, angle), sampling, **dict(sky))


def _rated_hours(weather: Weather, options: RoomOptions) -> NDArray[np.int64]:
    """Hours of the year whose glare counts: occupied, and the sun up."""
    used = working_hours(weather, *options.occupancy.hours)
    return np.flatnonzero(used & is_up(sun_directions(weather, model=options.sun_model)))


def glare_figures(dgp: NDArray[np.float64], weather: Weather, occupied: tuple[int, int]) -> dict[str, float | str]:
    """Hours by class, the worst, what 5 % of the hours exceed.

    Occupied hours in the dark count as imperceptible.

    Args: dgp: [h] of the occupied hours with the sun up.
    """
    used = int(np.count_nonzero(working_hours(weather, *occupied)))
    every = np.concatenate([dgp, np.zeros(used - len(dgp))])
    hours = class_hours(every) * weather.step_h
    result: dict[str, float | str] = {
        f"glare_{name}_h": float(count) for name, count in zip(CLASSES, hours, strict=True)
    }
    result["dgp_max"] = float(np.max(dgp, initial=0.0))
    result["dgp_mean"] = float(np.mean(dgp)) if len(dgp) else 0.0
    result["dgp_5_percent"] = hour_not_exceeded(every)
    result["glare_protection"] = protection_level(every)
    return result


def rating_figures(rated: AnnualGlare) -> dict[str, float | str]:
    """What a glare source is, and the standard error of DGP: root mean square, and of the worst."""
    dgp, error = rated.dgp, rated.dgp_standard_error
    result: dict[str, float | str] = {"glare_rule": rated.rule}
    mean = mean_error(error)
    if mean is not None and not np.isnan(error).any():
        result["dgp_standard_error"] = mean
        result["dgp_max_standard_error"] = float(error[np.argmax(dgp)])
    return result


def room_figures(room: RoomYear) -> tuple[dict[str, float | str], dict[str, NDArray[Any]]]:
    """Daylight, temperatures and comfort as figures of the table and arrays of the report."""
    daylight, heat = room.daylight, room.heat
    figures: dict[str, float | str] = {k: float(v) for k, v in daylight.room_metrics.items()}
    figures["illuminance_error_mean"] = 100.0 * float(daylight.relative_error.mean())
    figures["illuminance_error_max"] = 100.0 * float(daylight.relative_error.max())
    figures |= heat_figures(heat.temperatures, heat.comfort)
    figures |= {k: float(v) for k, v in heat.comfort_summary.items()}
    figures |= method_figures(room)
    window = heat.fenestration[0]
    figures |= {k: float(v) for k, v in window.items() if not isinstance(v, str)}
    if room.operation is not None:
        figures |= {k: float(v) for k, v in room.operation.summary.items()}
    if room.spectral is not None:
        figures |= room.spectral.summary
    if room.bands is not None:
        for _, row in room.bands.figures.iterrows():
            figures |= {f"{row['figure']}_{name}": float(row[name]) for name in ("p5", "median", "p95")}
        for _, row in room.bands.verdicts.iterrows():
            figures[f"{row['rule']}_met_percent"] = float(row["met_percent"])
    figures |= {f"{stage}_s": seconds for stage, seconds in room.seconds.items()}
    times = heat.temperatures.index.to_numpy().astype("datetime64[s]")
    arrays: dict[str, NDArray[Any]] = {
        "times": times.astype(np.int64),
        "points": daylight.points,
        "relative_error": daylight.relative_error,
        "mean_illuminance": daylight.illuminance.mean(axis=0),
        "median_illuminance": np.median(daylight.illuminance, axis=1).astype(np.float32),
    }
    arrays |= {f"sensor/{k}": v.to_numpy() for k, v in daylight.sensor_metrics.items()}
    arrays |= {f"temperature/{k}": heat.temperatures[k].to_numpy(np.float32) for k in KEPT_TEMPERATURES}
    for name, column in heat.comfort.items():
        flag = column.dtype == bool
        arrays[f"comfort/{name}"] = column.to_numpy(bool if flag else np.float32)
    return figures, arrays


def heat_figures(temperatures: pd.DataFrame, comfort: pd.DataFrame) -> dict[str, float]:
    """Operative temperatures of the occupied hours, and how many are warm or comfortable [h]."""
    used = comfort["occupied"].to_numpy(bool)
    operative = temperatures["operative_c"].to_numpy()[used]
    result = {
        "operative_min_c": float(operative.min()),
        "operative_mean_c": float(operative.mean()),
        "operative_max_c": float(operative.max()),
        "warm_h": float(np.count_nonzero(operative > WARM_C)),
    }
    for band in ("within_90", "within_80"):
        result[f"comfortable_{band[-2:]}_h"] = float(comfort.loc[used, band].sum())
    return result


def straight_view(windows: Sequence[Window], systems: Mapping[str, States], state: NDArray[np.int64]) -> float:
    """Visible transmittance straight on at normal incidence [%], mean of windows and hours.

    The normal-normal transmittance by which EN 14501 classes the view out; what a system scatters,
    or sends on in another direction, shows nothing of the outdoors.

    Args:
        systems: by state of each window, by its GUID; the last state stands for those beyond.
        state: [h, W] of each window in the hours that count.
    """
    beams: dict[int, float] = {}
    seen = area = 0.0
    for window, of_window in zip(windows, state.T, strict=True):
        states = systems[window.guid]
        for number, count in enumerate(np.bincount(of_window)):
            system = states[min(number, len(states) - 1)]
            if id(system) not in beams:
                beams[id(system)] = _normal_beam(system)
            seen += window.area * count * beams[id(system)]
        area += window.area
    return 100.0 * seen / (area * len(state)) if len(state) else 0.0


def _normal_beam(system: FenestrationSystem) -> float:
    """The beam through the patch at normal incidence."""
    bsdf = system.visible
    if bsdf.transmission_front is None:
        raise ValueError(f"{system.name} has no transmission")
    peak = through_peak(bsdf.transmission_front, KLEMS_FULL, bsdf.see_through)
    return float(peak.transmittance[0])
