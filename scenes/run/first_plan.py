"""The first plan of a run: daylight and glare of every room from few rays, before the full passes.

The same functions as of the rooms' stages, by the three-phase method, with uncut windows and a
coarse sky: what a room costs are a few products of matrices.  Its rays are traced for all rooms at
once.  Windows reflect nothing onto the outdoors, and nothing outdoors mirrors: X and the straight
view would be traced room by room, in a third of the time.  The daylight factors of a building with
73 rooms are 2.7 % less for it, of each room by less than its standard error.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import without_formulas
from mitsuba_cfs.glare.classes import LIMITS
from mitsuba_cfs.glare.indices import simplified_dgp
from mitsuba_cfs.methods.light import eye_illuminance
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.phase_light import PhaseLight, illuminance_of_all, phase_light
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices
from mitsuba_cfs.methods.standard_error import noise_of_sums
from mitsuba_cfs.progress import Progress, silent
from scenes.inputs import Inputs
from scenes.language.catalogue import gettext
from scenes.report.names import quantity
from scenes.report.under_way import page_under_way
from scenes.results import DaylightResult
from scenes.room.daylight import room_daylight
from scenes.room.inputs import RoomInputs, skies_for
from scenes.room.light import RoomLight
from scenes.room.options import RoomOptions
from scenes.room.shading import control_signals, predicts, shading_states, temperature_conditions
from scenes.run.options import JobOptions
from scenes.run.together import traced_together

# a hundredth of a full run's paths; fewer where the run has fewer
PATHS = {"sensor_samples": 256, "patch_samples": 128}
SPACING = 1.0  # of the sensors, at least [m]
READ = {"eye", "plane"}  # what a rule of shading may read; others leave the first state
GLARE = LIMITS[1]  # above it glare disturbs, EN 17037's medium level
SET = 24  # rooms that are traced together: each has its surroundings in memory
FROM = 6  # rooms; fewer are computed nearly as soon
COLUMNS = ("daylight_factor", "da300", "sda300_50", "glare_h")
DIGITS = (2, 1, 0, 0)  # after the point


@dataclass(frozen=True, slots=True)
class PlannedRoom:
    """First figures of a room, with their standard errors by the rays."""

    space: Space
    figures: dict[str, float]  # by `COLUMNS`: three in per cent, hours of the year
    errors: dict[str, float]
    mean_error: float  # relative, of the yearly mean illuminance: the mean of the sensors
    unshaded: bool = False  # in the first shading state: its rules need more than a first plan has
    complete: bool = False  # of the run itself, but for the hours with glare

    def completed(self, daylight: DaylightResult) -> PlannedRoom:
        """The room with the light of the run in place of the first; hours with glare stay as planned."""
        figures, errors = _light_figures(daylight)
        return replace(
            self,
            figures=self.figures | figures,
            errors=self.errors | errors,
            mean_error=float(daylight.relative_error.mean()),
            unshaded=False,
            complete=True,
        )


OnPlan = Callable[[Sequence[PlannedRoom]], None]  # called with the first plan of many rooms


def plan_options(options: RoomOptions) -> RoomOptions:
    """The options of a first plan."""
    fewer = {name: min(paths, getattr(options.sampling, name)) for name, paths in PATHS.items()}
    return options.changed(
        method="three-phase",
        sky_subdivision=1,
        annual_glare=False,
        spectral=False,
        sensitivities=False,
        bands=False,
        sensor_spacing=max(options.grid.spacing, SPACING),
        **fewer,
    )


def first_plan(
    inputs: Inputs, spaces: Sequence[Space], options: JobOptions, progress: Progress = silent
) -> list[PlannedRoom]:
    """The first plan of the rooms of a run; those that cannot be computed are left out."""
    progress("first plan", 0.0)
    room = plan_options(options.room)
    skies = skies_for(inputs.weather, room.sampling, **room.sky)
    chosen = replace(options, room=room, inner_glass=False, cache=False)
    elements = tuple(replace(element, gloss=None) for element in inputs.building.elements)
    inputs = replace(inputs, building=replace(inputs.building, elements=elements))
    planned = []
    for start in range(0, len(spaces), SET):
        some = spaces[start : start + SET]
        for one, scene, matrices in traced_together(inputs, some, skies, chosen, cut=False):
            if matrices is None:
                matrices = phase_matrices(scene, room.sampling, five_phase=False)
            try:
                planned.append(_planned(one, matrices))
            except RoomError:
                continue
        progress("first plan", min(start + SET, len(spaces)) / max(len(spaces), 1))
    return planned


def _planned(room: RoomInputs, matrices: PhaseMatrices) -> PlannedRoom:
    optics: list[list[Any]] = [  # that reflect nothing outdoors
        [MatrixOptics(one.transmission, one.scattering, reflection=one.reflection) for one in states]
        for states in room.windows.optics()
    ]
    light = phase_light(matrices, optics, room.skies)
    of_room = RoomLight(matrices.scene, matrices, light, None)
    by_light = bool(control_signals(room) - READ) or room.controller is not None
    unshaded = by_light or predicts(room) or bool(temperature_conditions(room)) or any(room.control.shared)
    state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    if not unshaded:
        state = shading_states(room, of_room, None)
    daylight = room_daylight(room, of_room, state, sunny_hours=False)
    figures, errors = _light_figures(daylight)
    figures["glare_h"], errors["glare_h"] = _glare_hours(room, of_room, state)
    return PlannedRoom(room.space, figures, errors, float(daylight.relative_error.mean()), unshaded)


def _light_figures(daylight: DaylightResult) -> tuple[dict[str, float], dict[str, float]]:
    """Figures of a room's light by the first three `COLUMNS`, and their standard errors."""
    metrics, sensors = daylight.room_metrics, daylight.sensor_metrics
    return {name: float(metrics[name]) for name in COLUMNS[:3]}, {
        # the sensors' noise goes together
        "daylight_factor": float(sensors["daylight_factor_standard_error"].mean()),
        "da300": float(sensors["da300_standard_error"].mean()),
        "sda300_50": float(metrics["sda300_50_standard_error"]),
    }


def _glare_hours(room: RoomInputs, of_room: RoomLight, state: NDArray[np.int64]) -> tuple[float, float]:
    """Occupied hours with the simplified DGP of the eye above `GLARE`, and their standard error."""
    rows = of_room.states(state)
    eye = eye_illuminance(of_room.light, rows)
    if not isinstance(of_room.light, PhaseLight):
        raise TypeError("a first plan has one season")
    whole = illuminance_of_all(of_room.light, rows)
    total = float(eye.sum())
    error = float(noise_of_sums(of_room.light, rows, whole)(None).standard_error()[-1])
    used = room.occupied[room.skies.lit]

    def hours(factor: float) -> float:
        bright = np.sort(factor * eye[used])
        first = bisect_right(bright.tolist(), GLARE, key=simplified_dgp)  # it rises with the light
        return float(len(bright) - first)

    relative = error / total if total > 0 else 0.0
    return hours(1.0), 0.5 * (hours(1 + relative) - hours(1 - relative))


def plan_lines(rooms: Sequence[PlannedRoom]) -> list[str]:
    """The first plan as a table of text."""
    heads = ("DF %", "mean DA %", "sDA %", "glare h")
    width = max(len(room.space.label) for room in rooms)
    lines = ["first plan".ljust(width) + "".join(f"{head:>16}" for head in heads)]
    for room in rooms:
        cells = (f"{figure} ±{error}" for figure, error in _cells(room))
        row = room.space.label.ljust(width) + "".join(f"{cell:>16}" for cell in cells)
        lines.append(row + (" (unshaded)" if room.unshaded else ""))
    return lines


def plan_table(rooms: Sequence[PlannedRoom]) -> str:
    """The first plan as a CSV file."""
    rows = []
    for room in rooms:
        row: dict[str, object] = {"guid": room.space.guid, "room": room.space.label}
        for name in COLUMNS:
            row |= {name: room.figures[name], f"{name}_standard_error": room.errors[name]}
        rows.append(row | {"mean_relative_error": room.mean_error, "unshaded": room.unshaded})
    return str(without_formulas(pd.DataFrame(rows)).to_csv(index=False, float_format="%.4g"))


def plan_page(rooms: Sequence[PlannedRoom], *, refined: bool = True) -> str:
    """The first plan as a page that loads itself again until the report takes its place.

    Args: refined: rooms get the light of the run as it comes.
    """
    glare = gettext("Occupied hours with glare, by the light at the eye")
    heads = [gettext("Room"), *(quantity(name).with_unit for name in COLUMNS[:3]), glare]
    rows = [[room.space.label, *(f"{figure} ± {error}" for figure, error in _cells(room))] for room in rooms]
    paragraphs = [
        gettext(
            "From few rays, with the standard error of each figure. This page loads itself again every "
            "few seconds and shows the report as soon as the run is complete; if the run is stopped, "
            "the page stays as it is."
        )
    ]
    if refined:
        heads.append(gettext("All rays"))
        for row, room in zip(rows, rooms, strict=True):
            row.append("✓" if room.complete else "")
        count = sum(room.complete for room in rooms)
        paragraphs.append(gettext("Light computed with all rays: {count} of {all} rooms.", count=count, all=len(rooms)))
    return page_under_way(gettext("First plan"), paragraphs, heads, rows)


def _cells(room: PlannedRoom) -> Iterator[tuple[str, str]]:
    """The figures of a room and their errors, by `COLUMNS`, as text."""
    for name, digits in zip(COLUMNS, DIGITS, strict=True):
        yield f"{room.figures[name]:.{digits}f}", f"{room.errors[name]:.{digits}f}"


def options_for_error(options: RoomOptions, rooms: Sequence[PlannedRoom], error: float) -> RoomOptions:
    """The options of a run with as many paths as a stated error of the yearly means needs.

    The error of the first plan falls with the root of the paths; the room with the largest decides.
    Half of the variance is left to what a first plan does not trace, the sun.  At most the paths of
    `options`.

    Source: Stein 1945, "A two-sample test for a linear hypothesis whose power is independent of the
    variance", Annals of Mathematical Statistics 16:243-258.
    """
    worst = max((room.mean_error for room in rooms), default=0.0)
    if not worst > 0:  # a plan without light says nothing
        return options
    share, first = 2 * (worst / error) ** 2, plan_options(options).sampling
    return options.changed(
        **{
            name: min(max(math.ceil(share * getattr(first, name)), 1), getattr(options.sampling, name))
            for name in PATHS
        }
    )
