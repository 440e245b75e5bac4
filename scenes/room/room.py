"""The year of one room: stages from its inputs to daylight, glare and heat, in order.

    inputs     RoomInputs        building, windows with their systems, weather, skies, operation
    light      RoomLight         matrices and the light of every lit hour in every shading state
    states     [H, G]            the shading state of each window group in every hour
    daylight   DaylightResult    illuminance of the sensors, metrics
    glare      GlareResults      every hour, pictures, colour
    zone       RoomZone          surfaces, solar gains, operation
    heat       ThermalResult     temperatures, comfort, loads

No file is read or written:

    weather = read_weather(Path("city.epw"))
    system = read_system(Path("blind.xml"))
    building = read_ifc("house.ifc")                        # or bim.shoebox.shoebox(...)
    space = building.spaces[0]
    result = compute_room(building, space, in_all_windows(space, system), weather, RoomOptions())
"""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.light import eye_illuminance, illuminance, with_pictures, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.picture_year.year import picture_year
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.trace.kernels.scattering import through_beams
from scenes.fenestration.systems import States
from scenes.results import ExploredRoom, GlareResults, RoomYear, ShadingYear
from scenes.room.control_hour import controlled_states
from scenes.room.daylight import room_daylight
from scenes.room.glare import annual_glare, coloured, glare_map, rated_hours, rated_hours_error, rating_of, room_glare
from scenes.room.heat import DaylitRoom, heat_alone
from scenes.room.inner_glass import borrowed_share
from scenes.room.inputs import FileSensors, RoomInputs, room_inputs
from scenes.room.leaks import leak_issues
from scenes.room.light import RoomLight, room_light
from scenes.room.lobes import lobe_figures
from scenes.room.operation import Operation
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.room.picture_hours import wanted_hours
from scenes.room.sensitivities import heat_sensitivities, light_sensitivities, rooms_at_ends
from scenes.room.shading import (
    RuledYear,
    control_signals,
    predicts,
    room_conditions,
    ruled_year,
    temperature_conditions,
)
from scenes.room.slats import MovedSlats, moved_zones, room_slats
from scenes.room.solar import SeasonalOutdoors, seasonal_outdoors
from scenes.room.spectral import explored_colour, room_spectral
from scenes.room.zone import (
    RoomAlternatives,
    RoomZone,
    ZoneSurfaces,
    balances,
    reads_work_plane,
    room_zone,
    zone_surfaces,
)
from thermal.control import combinations_of, levels_of

LONG = 2.0  # stages after which memory is returned; a shorter one has used little [s]


class RoomChoices(TypedDict, total=False):
    """Options of `compute_room` and `lit_room`; see there."""

    operation: Operation | None
    skies: AnnualSky | None
    cache: MatrixCache | None
    pictures: bool
    colour: bool
    explore: bool
    rate: tuple[str, NDArray[np.int64]] | None
    inner: bool
    together: Collection[str]
    progress: Progress


@dataclass(frozen=True, slots=True)
class StageTimes:
    """Durations of a room's stages."""

    seconds: dict[str, float] = field(default_factory=dict)  # by stage

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the duration of the block to a stage, and return what memory a long one has left."""
        start = time.monotonic()
        yield
        seconds = time.monotonic() - start
        self.add(name, seconds)
        if seconds > LONG:
            variants.return_memory()

    def add(self, name: str, seconds: float) -> None:
        """Add a duration to a stage."""
        self.seconds[name] = round(self.seconds.get(name, 0.0) + seconds, 2)


def compute_room(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    **choices: Unpack[RoomChoices],
) -> RoomYear:
    """Daylight, glare, temperatures and comfort of one room alone, with one method.

    Args: see `lit_room`.

    Raises: `RoomError` for a room that cannot be computed (no work plane, no closed zone),
        `ValueError` for a window without a system.
    """
    lit = lit_room(building, space, systems, weather, options, **choices)
    times = StageTimes(dict(lit.seconds))
    start, progress = time.monotonic(), choices.get("progress", silent)
    heat = heat_alone(lit.zone, weather, options.heat_step_s, progress)
    times.add("thermal", time.monotonic() - start)
    if lit.sensitivities is not None:
        with times.stage("sensitivities"):
            terrain = (lit.zone.operation or OperationTables()).terrain
            moved = list(rooms_at_ends([lit.zone]))
            (of_heat,) = heat_sensitivities([lit.zone], weather, options.heat_step_s, terrain=terrain, moved=moved)
            lit = lit.with_sensitivities(of_heat, options.sampling.seed)
    return replace(lit, seconds=times.seconds).with_heat(heat)


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
    together: Collection[str] = (),
    progress: Progress = silent,
) -> DaylitRoom:
    """Daylight and glare of one room, and the zone from which its heat is computed.

    Args:
        building: its `elements` are the surroundings of the room.
        systems: by window GUID the `FenestrationSystem` in each shading state, from open to
            closed; one tuple of one system is the usual case, see `in_all_windows`.
        options: method, sampling, sensors, occupancy, outputs; `RoomOptions()` is a full run.
        operation: shading control, gains, set points; without it the first shading state is used
            all year and the room floats freely.
        skies: of `skies_for`, shared by several rooms.
        cache: of traced matrices, `MatrixCache.of_user()`. V and D depend neither on systems nor
            on weather: variants of these cost only algebra.
        pictures: False omits the luminance pictures and their glare.
        colour: True adds the picture with the most light at the eye in colour.
        explore: True adds every hour's picture in every state, for the explorer.
        rate: a glare metric (DGP, eDGP, sDGP) and hours of the year with the sun up to rate.
        inner: True lets light of rooms with windows in through glass; phase methods only.
        together: GUIDs of the rooms that are balanced with this one, see `room_inputs`.

    Raises: `RoomError` for a room that cannot be computed (no work plane, no closed zone),
        `ValueError` for a window without a system, `DataError` for an explorer where the outdoors
        changes over the year.
    """
    room = inputs_of_room(
        building,
        space,
        systems,
        weather,
        options,
        operation=operation,
        skies=skies,
        cache=cache,
        inner=inner,
        together=together,
    )
    if explore and len(room.seasons) > 1:
        message = "the explorer knows one state of the trees: give them one transmittance"
        raise DataError(message, file=building.file, field="--explore")
    hours = wanted_hours(options.outputs.picture_hours, weather.midpoints, room.skies.lit)
    year = dgp = rated = explored = spectral = sensitivities = samples = plan = None
    dgp_error = 0.0
    slats: tuple[MovedSlats, ...] = ()
    times = StageTimes()

    with times.stage("daylight"):
        needs = light_needs(room, annual_glare=options.outputs.annual_glare)
        light = room_light(room, needs=needs, progress=progress)
        decided = decided_states(room, light, progress=progress)
        state, ruled, choice = decided.state, decided.ruled, decided.choice
        outdoors, surfaces = decided.outdoors, decided.surfaces
        daylight = room_daylight(room, light, state, progress=progress)
    with times.stage("leaks"):
        leaks = leak_issues(space, light.scene, seed=options.sampling.seed, cache=cache)
    if options.outputs.annual_glare:
        with times.stage("annual glare"):
            year = annual_glare(room, light, state, progress=progress)
        if space.windows and room.occupied.any():
            with times.stage("glare map"):
                plan, _ = glare_map(room, light, state, progress=progress)
    glare = GlareResults(light.scene.view, (), rating_of(options.outputs).rule)
    if pictures:
        with times.stage("glare"):
            glare = room_glare(room, light, state, hours, year, progress=progress)
    if colour:
        with times.stage("colour"):
            glare = coloured(room, light, state, glare, progress=progress)
    if rate is not None:
        with times.stage("glare"):
            dgp = rated_hours(room, light, state, *rate, progress=progress)
            dgp_error = rated_hours_error(room, light, state, *rate, dgp)
            rated = (*rate, dgp)
    with times.stage("glare"):
        as_lobe = lobe_figures(room, light, state, rated=rated, year=year, glare=glare)
    if explore:
        with times.stage("explorer"):
            explored = explored_room(room, light, state, sensors=len(daylight.points), progress=progress)
    if options.outputs.spectral:
        with times.stage("spectral"):
            spectral = room_spectral(room, light, state, daylight, progress=progress)
    if options.outputs.derives:
        with times.stage("sensitivities"):
            slats = tuple(room_slats(room, light))
            sensitivities, samples = light_sensitivities(room, light, state, daylight, year, spectral, slats=slats)
    with times.stage("thermal"):
        surfaces = surfaces or zone_surfaces(room)
        if outdoors is None:
            outdoors = seasonal_outdoors(room, light, progress=progress)
        zone = room_zone(room, surfaces, outdoors, state, daylight, ruled=ruled, progress=progress)
        if choice is not None:
            zone = replace(zone, alternatives=choice.alternatives)
    if slats:
        with times.stage("sensitivities"):
            zone = replace(zone, moved=moved_zones(slats, zone, outdoors, state, daylight, ruled))
    return DaylitRoom(
        space,
        daylight,
        glare,
        zone,
        times.seconds,
        year,
        spectral=spectral,
        sensitivities=sensitivities,
        samples=samples,
        dgp=dgp,
        dgp_sunny_hour_error=dgp_error,
        as_lobe=as_lobe,
        issues=leaks,
        explored=explored,
        glare_map=plan,
        borrowed=borrowed_share(space, light.light, light.inner),
    )


def inputs_of_room(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    *,
    operation: Operation | None = None,
    skies: AnnualSky | None = None,
    cache: MatrixCache | None = None,
    inner: bool = False,
    together: Collection[str] = (),
) -> RoomInputs:
    """The inputs of `lit_room`, from its arguments."""
    if operation is None:
        systems = {guid: states[:1] for guid, states in systems.items()}
    return room_inputs(
        building,
        space,
        systems,
        weather,
        options,
        operation=None if operation is None else operation.tables,
        skies=skies,
        cache=cache,
        file_sensors=FileSensors.of(building, space),
        inner_glass=inner,
        together=together,
        controller=None if operation is None else operation.controller,
        shared=None if operation is None else operation.shared,
    )


def light_needs(room: RoomInputs, *, annual_glare: bool = False) -> tuple[str, ...]:
    """The metrics that a room's stages ask its light for, in every hour."""
    if annual_glare or "dgp" in control_signals(room):
        return ("illuminance", "DGP")
    return ("illuminance",)


def operated_zone(room: RoomInputs, *, progress: Progress = silent) -> RoomZone:
    """The zone of a room whose light is computed only as far as its operation reads it.

    Raises: `RoomError` for a room without a closed zone.
    """
    surfaces, light = zone_surfaces(room), None
    if reads_work_plane(room):
        light = room_light(room, needs=light_needs(room), progress=progress)
    outdoors = seasonal_outdoors(room, light, progress=progress)
    return controlled_zone(room, surfaces, outdoors, light, progress=progress)


def controlled_zone(
    room: RoomInputs,
    surfaces: ZoneSurfaces,
    outdoors: SeasonalOutdoors,
    light: RoomLight | None,
    *,
    progress: Progress = silent,
) -> RoomZone:
    """The zone of a room by its rules of shading.

    Where these read the room's temperature: with an alternative for each combination of its
    conditions' levels, from which the heat balance chooses in every hour.
    """
    (conditions, read), rooms = room_conditions(room, light, outdoors), []
    for number in range(combinations_of(read)):
        met = dict(zip(read, levels_of(number, read), strict=True))
        ruled, daylight = ruled_year(room, light, outdoors, met=met, progress=progress), None
        state = ruled.states[:, room.windows.control]
        if light is not None and reads_work_plane(room):
            daylight = room_daylight(room, light, state, progress=progress)
        rooms.append(room_zone(room, surfaces, outdoors, state, daylight, ruled=ruled, progress=progress))
    if len(rooms) == 1:
        return rooms[0]
    return replace(rooms[0], alternatives=RoomAlternatives(conditions, read, tuple(rooms)))


@dataclass(frozen=True, slots=True)
class DecidedStates:
    """The shading states of a room, and what was computed to decide on them."""

    state: NDArray[np.int64]  # [H, G] of the window groups
    ruled: RuledYear | None  # by rules that read nothing of the room's heat
    outdoors: SeasonalOutdoors | None
    surfaces: ZoneSurfaces | None
    choice: RoomZone | None  # with the alternatives of rules by the room's temperature


def decided_states(room: RoomInputs, light: RoomLight | None, *, progress: Progress = silent) -> DecidedStates:
    """The states of a room's window groups by its function, plans or rules; light: None where these read none."""
    conditions, outdoors = temperature_conditions(room), None
    has_function = room.controller is not None and bool(room.space.windows)
    controlled = has_function or predicts(room)
    if conditions or controlled or "irradiance" in control_signals(room):
        outdoors = seasonal_outdoors(room, light, progress=progress)
    if conditions and outdoors is not None:
        surfaces = zone_surfaces(room)
        choice = controlled_zone(room, surfaces, outdoors, light, progress=progress)
        chosen = _chosen_by_balance(room, choice).states[:, room.windows.control]
        return DecidedStates(chosen, None, outdoors, surfaces, choice)
    if controlled and outdoors is not None and light is not None:
        state = controlled_states(room, light, outdoors, progress=progress)
        return DecidedStates(state, None, outdoors, None, None)
    ruled = ruled_year(room, light, outdoors, progress=progress)
    return DecidedStates(ruled.states[:, room.windows.control], ruled, outdoors, None, None)


def asked_year(room: RoomInputs, *, progress: Progress = silent) -> RuledYear:
    """The states of its control groups that a room asks for by itself, and what moves them.

    Its light is computed only as far as its rules read it.
    """
    signals, light = control_signals(room), None
    planned = room.controller is not None or predicts(room)
    if planned or signals - {"irradiance", "sun"} or (temperature_conditions(room) and reads_work_plane(room)):
        light = room_light(room, needs=light_needs(room), progress=progress)
    decided = decided_states(room, light, progress=progress)
    if decided.ruled is not None:
        return decided.ruled
    if decided.choice is not None:
        year = _chosen_by_balance(room, decided.choice)
        moved = np.full_like(year.states, -1) if year.moved_by is None else year.moved_by
        return RuledYear(year.states, moved, year.reasons)
    year = room.shading(decided.state)
    kinds = tuple(dict.fromkeys(year.rules))
    numbers = np.array([kinds.index(kind) for kind in year.rules])
    moves = np.concatenate([np.zeros_like(year.states[:1]), np.diff(year.states, axis=0)]) != 0
    return RuledYear(year.states, np.where(moves, numbers, -1), kinds)


def _chosen_by_balance(room: RoomInputs, zone: RoomZone) -> ShadingYear:
    """The year of shading that the heat balance of the room alone chooses."""
    terrain = "suburbs" if room.operation is None else room.operation.terrain
    (result,) = balances([zone], room.weather, room.options.heat_step_s, terrain=terrain)
    return zone.in_alternatives(result.alternative).shading


LARGEST = 400  # pixels of a side of its pictures


def explored_room(
    room: RoomInputs, room_light: RoomLight, state: NDArray[np.int64], *, sensors: int, progress: Progress = silent
) -> ExploredRoom:
    """Pictures, illuminances and the sun's beam of all lit hours in combinations of states.

    The outdoors must be the same all year.

    Args:
        state: [H, G] of the window groups in each hour.
        sensors: number of sensors of the work plane, the first of the scene's.
    """
    light, scene, sky = room_light.light, room_light.scene, room.skies
    progress = part(progress, 0.0, 1.0, "explorer")
    combinations, operated = explored_combinations(room, light.states, state)
    L, J = len(sky.lit), len(combinations)
    small, pictures, through, lit, eyes = _small(light, progress), [], [], [], []
    hours = np.arange(L)
    for j, combination in enumerate(combinations):
        rows = room_light.states(np.tile(combination, (room.skies.hours, 1)))
        of_groups = [min(k, len(of) - 1) for of, k in zip(light.systems, rows[:, 0].tolist(), strict=True)]
        steps = part(progress, j / J, (j + 1) / J)
        made = pictures_in_state(small, hours, of_groups)
        pictures.append(picture_year(made, seed=light.sampling.seed, progress=steps))
        optics = [of[k] for of, k in zip(light.systems, of_groups, strict=True)]
        scattering = [optic.scattering for optic in optics]
        through.append(through_beams(scene.groups, scattering, sky.direction))
        lit.append(illuminance(light, rows)[:sensors].astype(np.float32))
        eyes.append(eye_illuminance(light, rows))
    triangles = [np.concatenate([w.triangles for w in g.windows]) for g in scene.groups]
    colour = None
    if room.options.outputs.spectral:
        colour = explored_colour(room, room_light, combinations, pictures, sensors)
    return ExploredRoom(
        tuple(_state_names(room, light.states, combinations)),
        operated,
        sky.lit,
        tuple(pictures),
        tuple(lit),
        np.stack(eyes).astype(np.float32),
        np.stack(through).astype(np.float32),
        np.maximum(sky.illuminance, 0).astype(np.float32),
        tuple(triangles),
        colour,
    )


def explored_combinations(
    room: RoomInputs, states: int, state: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The combinations of states [J, G] that the explorer shows, and that of each hour [H].

    All windows in each of the `states`, then those of the lit hours with different states.

    Args: state: [H, G] of the window groups in each hour.
    """
    most = np.array([len(of) - 1 for of in room.windows.systems], dtype=np.int64)
    state = np.minimum(state, most)
    equal = np.minimum(np.arange(states)[:, None], most)
    kinds = np.unique(state[room.skies.lit], axis=0)
    mixed = kinds[~(kinds[:, None] == equal).all(axis=2).any(axis=1)]
    combinations = np.concatenate([equal, mixed])
    operated = np.zeros(len(state), dtype=np.int64)  # in the dark nothing is shown
    for j, combination in enumerate(combinations):
        operated[(state == combination).all(axis=1)] = j
    return combinations, operated


def _state_names(room: RoomInputs, states: int, combinations: NDArray[np.int64]) -> Iterator[str]:
    """Names of combinations: of the state, then of the state of each control group."""
    names = [system.name for system in max(room.windows.systems, key=len)]
    yield from names[:states]
    for of_groups in room.shading(combinations[states:]).states:
        pairs = zip(room.control.names, of_groups, strict=True)
        yield ", ".join(f"{group}: {names[j]}" for group, j in pairs)


def _small(light: PhaseLight, progress: Progress) -> PhaseLight:
    """The light of the same hours for pictures of at most `LARGEST` pixels a side."""
    view = light.scene.eye
    if max(view.width, view.height) <= LARGEST:
        return with_pictures(light, progress=progress)
    share = LARGEST / max(view.width, view.height)
    size = {"width": round(view.width * share), "height": round(view.height * share)}
    return with_pictures(with_view(light, replace(view, **size)), progress=progress)
