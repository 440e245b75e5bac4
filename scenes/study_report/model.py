"""The rooms of a study as one model in 3D, its sensors coloured by case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bim.model import Building, Space
from scenes.figures.scale import ColourScale
from scenes.report.model3d import ColourLayer, Model3D, colour_bytes, model3d
from scenes.report.names import quantity
from scenes.results import RoomYear, RunResult
from scenes.study.case import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, room_of

SHOWN = ("da300", "udi_300_3000")
MOST_LAYERS = 60
APART = 3.0  # between buildings [m]


def study_model(study: StudyResult) -> Model3D:
    """All rooms that have a result, buildings side by side, before they are turned."""
    first: dict[str, tuple[Case, CaseResult]] = {}
    for case, result in zip(study.plan.cases, study.results, strict=True):
        if not result.error:
            first.setdefault(case.scene, (case, result))
    places = _places(study, list(first))
    rooms, elements = [], []
    seen: set[int] = set()
    for scene, (case, result) in first.items():
        building, _ = study.plan.rooms[scene]
        offset = places[scene]
        rooms.append(_moved_room(room_of(study, case, result), offset))
        if id(building) not in seen:
            seen.add(id(building))
            elements += [_moved(e, offset) for e in building.elements]
    name = next(iter(study.plan.rooms.values()))[0].name
    whole = Building(name, tuple(room.space for room in rooms), tuple(elements))
    times = rooms[0].heat.temperatures.index
    model = model3d(RunResult(whole, times, np.empty((0, 3)), tuple(rooms), (), {}))
    return replace(model, layers=_layers(study, list(first)))


def _places(study: StudyResult, scenes: list[str]) -> dict[str, np.ndarray]:
    """How far each room's building is moved along x so that none stands in another."""
    places, moved, edge = {}, {}, 0.0
    for scene in scenes:
        building, _ = study.plan.rooms[scene]
        if id(building) not in moved:
            points = np.concatenate([space.shell.reshape(-1, 3) for space in building.spaces])
            shift = edge - points[:, 0].min() if moved else 0.0
            edge = points[:, 0].max() + shift + APART
            moved[id(building)] = np.array([shift, 0.0, 0.0])
        places[scene] = moved[id(building)]
    return places


def _moved(part, offset: np.ndarray):
    """A face, window or element somewhere else."""
    return replace(part, triangles=part.triangles + offset)


def _moved_room(room: RoomYear, offset: np.ndarray) -> RoomYear:
    space: Space = room.space
    space = replace(
        space,
        faces=tuple(_moved(face, offset) for face in space.faces),
        windows=tuple(_moved(window, offset) for window in space.windows),
    )
    daylight = replace(room.daylight, points=room.daylight.points + offset)
    return replace(room, space=space, daylight=daylight)


def _layers(study: StudyResult, scenes: list[str]) -> tuple[ColourLayer, ...]:
    """A colouring for each case but its room, with the values of every room that has that case."""
    groups: dict[tuple, dict[str, tuple[Case, CaseResult]]] = {}
    for case, result in zip(study.plan.cases, study.results, strict=True):
        if not result.error:
            key = (case.system, case.climate, case.orientation_deg, case.options.method)
            groups.setdefault(key, {})[case.scene] = case, result
    found = []
    for members in groups.values():
        if set(members) != set(scenes):
            continue
        label = case_label(study, next(iter(members.values()))[0])
        for column in SHOWN:
            q = quantity(column)
            values = np.concatenate([members[s][1].arrays[f"sensor/{column}"] for s in scenes])
            scale = ColourScale(0.0, 100.0, f"{q.label}: {label}", "%")
            found.append(ColourLayer(column, scale, colour_bytes(scale, values), 0))
    return tuple(found[:MOST_LAYERS])
