"""The year of one room from Python objects; no file is read or written.

weather = read_weather(Path("city.epw"))
system = read_system(Path("blind.xml"))                 # scenes.run.inputs
building = read_ifc("house.ifc")                        # or bim.shoebox.shoebox(...)
space = building.spaces[0]
result = compute_room(building, space, in_all_windows(space, system), weather, RoomOptions())
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import States
from scenes.results import GlareResults, RoomYear
from scenes.room.daylight import HeldSensors
from scenes.room.glare import rating_of
from scenes.room.heat import DaylitRoom, heat_alone
from scenes.room.inner_glass import borrowed_share
from scenes.room.operation import Operation
from scenes.room.options import RoomOptions
from scenes.room.picture_hours import wanted_hours
from scenes.room.room import RoomSimulation


class RoomChoices(TypedDict, total=False):
    """What `compute_room` and `lit_room` may be told besides; see there."""

    operation: Operation | None
    skies: AnnualSky | None
    cache: MatrixCache | None
    pictures: bool
    colour: bool
    explore: bool
    rate: tuple[str, NDArray[np.int64]] | None
    inner: bool
    progress: Progress


def compute_room(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    **chosen: Unpack[RoomChoices],
) -> RoomYear:
    """Daylight, glare, temperatures and comfort of one room alone, with one method.

    Args: as of `lit_room`.

    Raises: `RoomError` for a room that cannot be computed (no work plane, no closed zone),
        `ValueError` for a window without a system.
    """
    lit = lit_room(building, space, systems, weather, options, **chosen)
    progress, start = chosen.get("progress", silent), time.monotonic()
    heat = heat_alone(lit.inputs, weather, options.heat_step_s, progress)
    seconds = lit.seconds["thermal"] + round(time.monotonic() - start, 2)
    return replace(lit, seconds={**lit.seconds, "thermal": round(seconds, 2)}).with_heat(heat)


def lit_room(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    *,
    operation: Operation | None = None,
    skies: AnnualSky | None = None,
    cache: MatrixCache | None = None,
    pictures: bool = True,
    colour: bool = False,
    explore: bool = False,
    rate: tuple[str, NDArray[np.int64]] | None = None,
    inner: bool = False,
    progress: Progress = silent,
) -> DaylitRoom:
    """Daylight and glare of one room, and what its heat comes from.

    Args:
        building: what stands around the room is its `elements`.
        systems: by window GUID the `FenestrationSystem` in each shading state, from open to
            closed; one tuple of one system is the usual case, see `in_all_windows`.
        options: method, sampling, sensors, occupancy, outputs; `RoomOptions()` is a full run.
        operation: shading control, gains, set points; without it the first state holds all year
            and the room floats freely.
        skies: of `skies_for`, where several rooms share them.
        cache: where traced matrices are kept and found again, `MatrixCache.of_user()`.  Systems
            and weather do not enter V and D: variants of them cost only algebra.
        pictures: False leaves the luminance pictures and their glare out.
        colour: True gives the picture with most light at the eye in colour too.
        explore: True gives every hour's picture in every state, for the explorer.
        rate: a glare metric (DGP, eDGP, sDGP) and hours of the year with the sun up to rate by it.
        inner: True lets light of rooms with windows in through glass; phase methods only.

    Raises: `RoomError` for a room that cannot be computed (no work plane, no closed zone),
        `ValueError` for a window without a system, `DataError` for an explorer where what stands
        outdoors changes over the year.
    """
    if operation is None:
        systems = {guid: states[:1] for guid, states in systems.items()}
    room = RoomSimulation(
        building, space, systems, weather, options,
        operation=None if operation is None else operation.tables,
        skies=skies, cache=cache, inner=inner, held=HeldSensors.of(building, space),
        progress=progress,
    )  # fmt: skip
    if explore and len(room.seasons) > 1:
        message = "the explorer knows one state of the trees: give them one transmittance"
        raise DataError(message, file=building.file, field="--explore")
    outputs, skies = options.outputs, room.skies
    hours = wanted_hours(outputs.picture_hours, weather.midpoints, skies.lit)
    daylight = room.timed("daylight", lambda: room.daylight)
    holes = room.timed("holes", room.holes)
    year, rated = None, GlareResults(room.scene.view, (), rating_of(outputs).rule)
    if outputs.annual_glare:
        year = room.timed("annual glare", room.annual_glare)
    if pictures:
        rated = room.timed("glare", lambda: room.glare(hours, year))
    if colour:
        rated = room.timed("colour", partial(room.coloured, rated))
    dgp = None if rate is None else room.timed("glare", lambda: room.rated(*rate))
    explored = room.timed("explorer", room.explored) if explore else None
    heat = room.timed("thermal", room.heat_inputs)
    return DaylitRoom(
        space, daylight, rated, heat, room.seconds, year, dgp=dgp, problems=holes,
        explored=explored, borrowed=borrowed_share(space, room.light, room.inner),
    )  # fmt: skip
