"""The rooms of a building against rules: light, view and sun of each, then every criterion.

The grids of several rules share one V and one D.  Glare of the seats and temperatures are computed
where a rule limits them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.building_file import no_window
from bim.model import Building, Space, in_month
from bim.report.issue import Effect, Issue
from bim.sensors import plane_sides
from bim.templates import template_rooms
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.light import direct_sun_by_group, illuminance
from mitsuba_cfs.metrics.autonomy import daylight_autonomy
from mitsuba_cfs.metrics.en17037 import HALF_TIME, exceeded, greatest_cell
from mitsuba_cfs.metrics.lm83 import blinds_operated, sunlit_hours
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.spectra.detectors import DETECTORS, detected, equivalent_daylight
from scenes.comply.assess import applies, asked_of, assess_room, values_of
from scenes.comply.blinds import DEFAULT_NAME, open_and_closed
from scenes.comply.dwellings import dwelling_words, judged, uses_of_rooms
from scenes.comply.files import ComplyFiles, read_files
from scenes.comply.findings import EyeLight, Findings, GridLight, RoomHeat, SeatGlare, calendar_of
from scenes.comply.glare import PICTURED, seat_glare, worst_seat_glare
from scenes.comply.needs import DgpExceeded
from scenes.comply.options import ComplyOptions
from scenes.comply.outdoors import OutdoorMesh, outdoors_of
from scenes.comply.results import ONE_STATE, CheckedRoom, Compliance, GridSummary, RoomLights
from scenes.comply.rules import GridTable
from scenes.comply.sunlight import SunExposure, sun_day, sun_exposure
from scenes.comply.tables import USE_WORDS
from scenes.comply.uses import RoomUse
from scenes.comply.view_out import ViewOut, view_out, windows_without_view
from scenes.fenestration.ratings import system_ratings
from scenes.fenestration.sight import sight_through
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_system import thermal_system
from scenes.head import Head, unused_notes
from scenes.input_files import building_of
from scenes.inputs import first_states, inputs_of
from scenes.language.catalogue import N_
from scenes.report.method import METHODS
from scenes.results import MAP_ERROR
from scenes.room.control_groups import same_control
from scenes.room.daylight import overcast_factor
from scenes.room.glare import MAP_DIRECTIONS, MAP_EYES, MAP_SPACING
from scenes.room.ground import assumed_ground_note
from scenes.room.heat import heat_alone
from scenes.room.inputs import RoomInputs, room_inputs, skies_for
from scenes.room.light import RoomLight, grid_points, room_light
from scenes.room.luminaires import lamp_spectra
from scenes.room.operation import Operation, check_states, used_operation, weekday_note
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions, SensorGrid
from scenes.room.room import StageTimes, asked_year, inputs_of_room
from scenes.room.series import RoomSeries, corner
from scenes.room.shared_states import with_shared_states
from scenes.room.solar import seasonal_outdoors
from scenes.room.spectral import eye_illuminances
from scenes.room.zone import room_zone, zone_surfaces
from scenes.run.first_plan import FROM, OnPlan, first_plan
from scenes.run.options import JobOptions
from scenes.surroundings import NO_SURROUNDINGS, has_surroundings
from thermal.errors import ThermalInputError
from thermal.ratings import CLASSES, ThermalRating

STANDARD = "ISO 52022-3, reference"  # the method that is named where a system's layers are known


def solar_sentences(systems: Mapping[str, States]) -> tuple[list[str], list[str]]:
    """Of each state of the windows' systems g_tot and EN 14501's class; what is assumed of their heat.

    LM-83's default shade is a figure for light alone: it has no heat to be rated.
    """
    distinct = {id(state): state for states in systems.values() for state in states}
    ratings: list[str] = []
    assumed: list[str] = []
    for system in distinct.values():
        if DEFAULT_NAME in system.name:
            continue
        try:
            ratings.append(solar_sentence(system))
            assumed += thermal_system(system).notes
        except ThermalInputError as error:
            ratings.append(Note("{system}: g_tot is unknown: {reason}.", system=system.name, reason=error.message))
    return ratings, assumed


def solar_sentence(system: FenestrationSystem) -> str:
    """A system's g_tot, the method that gives it, and EN 14501's class of it.

    Raises: `ThermalInputError` where U, g and the BSDF do not go together.
    """
    heat = thermal_system(system)
    found = {rating.method: rating for rating in system_ratings(system, heat)}
    rating: ThermalRating = found.get(STANDARD) or found["heat balance"]
    values = {f"limit_{number}": limit for number, limit in enumerate(CLASSES["g"])}
    limits = Note(", ".join(f"{{{key}:.2f}}" for key in values), **values)
    source = Note("as in the heat balance") if rating.method == "heat balance" else rating.method
    return Note(
        "{system}: g_tot {g:.2f} at normal incidence ({source}), class {solar_class} for the "
        "limits {limits} of EN 14501 (not verified).",
        system=system.name,
        g=rating.g_value,
        source=source,
        solar_class=rating.solar_class("g"),
        limits=limits,
    )


def sensor_grid_of(space: Space, table: GridTable) -> SensorGrid:
    """The grid of a rule in a room; where it has no spacing, whole cells no wider than p."""
    spacing = table.spacing
    if spacing is None:
        sides = plane_sides(space, table.height, table.margin)
        longer = max(sides)
        spacing = longer / np.ceil(longer / greatest_cell(*sides) - 1e-9)
    return SensorGrid(spacing=float(spacing), height=table.height, margin=table.margin)


def lights_of(room: RoomInputs, traced: RoomLight, operated: Iterable[int]) -> list[GridLight]:
    """The light on each grid of a room.

    The windows' first state is open, their last closed; LM-83's rule moves them by group.

    Args: operated: numbers of the grids whose light with operated blinds is wanted.
    """
    light, sky = traced.light, room.skies

    def year(values: NDArray[np.float64]) -> NDArray[np.float32]:
        return sky.whole_year(values.astype(np.float32)).T

    opened, factor = illuminance(light), overcast_factor(light)
    through = direct_sun_by_group(light) or []
    points = traced.scene.points
    last = [len(of) - 1 for of in light.systems]
    ends = room.windows.in_state(0), [of[-1] for of in room.windows.systems]
    seen = [[sight_through(one).is_view for one in of] for of in ends]
    found, first = [], 0
    for number, grid in enumerate(room.grids):
        count = len(grid_points(room.space, grid))
        own = slice(first, first + count)
        first += count
        direct = [part[own] for part in through]
        blinds = closed = free = None
        if number in operated:
            state = blinds_operated([part.T for part in direct]).astype(np.int64)  # [G, L]
            lit = illuminance(light, state * np.array(last, dtype=np.int64)[:, None])
            blinds, closed = year(lit[own]), sky.whole_year(state).T > 0
            free = np.where(closed, seen[1], seen[0])
        sun = np.sum(direct, axis=0) if direct else np.zeros_like(opened[own])
        found.append(GridLight(points[own], year(opened[own]), year(sun), factor[own], blinds, closed, free))
    return found


def seat_eye(
    room: RoomInputs, light: RoomLight, state: NDArray[np.int64], tables: OperationTables | None
) -> tuple[EyeLight, list[str]]:
    """Light at the eye of a room, and notes.

    Args: state: [H, G] of the window groups; tables: the luminaires and colours of the room.
    """
    room = replace(room, operation=tables)
    daylight, notes = eye_illuminances(room, light, state)
    lamps = None
    if tables is not None:
        position, direction = (
            np.asarray(a, dtype=float)[None] for a in (light.scene.eye.position, light.scene.eye.direction)
        )
        spectra = lamp_spectra(tables, room.space, position, direction, seed=room.options.sampling.seed)
        if spectra is not None:
            received = detected(spectra[0][0])
            lamps = np.array([received[0], equivalent_daylight(received[DETECTORS.index("melanopic")])])
    used = working_hours(room.weather, *room.options.occupancy.hours)
    return EyeLight(daylight, lamps, used), notes


def room_heat(room: RoomInputs, light: RoomLight, state: NDArray[np.int64], *, progress: Progress = silent) -> RoomHeat:
    """Operative temperatures of a room that neither heats nor cools; state: [H, G] of the window groups."""
    outdoors = seasonal_outdoors(room, light, progress=progress)
    zone = room_zone(room, zone_surfaces(room), outdoors, state, progress=progress)
    thermal, _ = heat_alone(zone, room.weather, room.options.heat_step_s, progress)
    return RoomHeat(thermal.temperatures["operative_c"].to_numpy(), np.asarray(room.weather.dry_bulb_c), room.occupied)


# the parts of a room's light, as the dossier's last line names their seconds
PARTS = TRACING, SUMS, GLARE, HEAT, EYES = (
    "V and D",
    "light and blinds of every hour",
    "glare",
    "temperatures",
    "light at the eye",
)
OnHead = Callable[[Head], None]
LIGHT, RAYS = frozenset({"open", "operated", "glare", "heat", "eye"}), frozenset({"view", "sun"})


def check_building(
    options: ComplyOptions,
    progress: Progress = silent,
    files: ComplyFiles | None = None,
    on_head: OnHead = lambda head: None,
    on_plan: OnPlan | None = None,
) -> Compliance:
    """The rooms of a building file against the rules of the options.

    Args:
        files: of `read_files`; read now by default.
        on_head: called with what was left out and assumed, before anything is traced.
        on_plan: called with first figures of all rooms where these are many, before the rest.

    Raises: `DataError` for a file that cannot be used, before anything is traced.
    """
    files = files or read_files(options)
    if options.building is None:
        raise ValueError("a check of a file needs its building")
    start, steps = time.monotonic(), part(progress, 0.1, 1.0)
    building = building_of(options, steps)
    reading = round(time.monotonic() - start, 1)
    result = check_rooms(building, options, files, progress, on_head, on_plan=on_plan)
    return replace(result, seconds={"reading": reading, **result.seconds})


def check_rooms(
    building: Building,
    options: ComplyOptions,
    files: ComplyFiles,
    progress: Progress = silent,
    on_head: OnHead = lambda head: None,
    *,
    on_plan: OnPlan | None = None,
) -> Compliance:
    """The rooms of a building against the rules of the options; on_head, on_plan: as `check_building`."""
    check = Check(building, options, files, progress)
    on_head(check.head)
    spaces = list(check.inputs.spaces)
    uses = check.uses_of(spaces)
    glazed = [space for space in spaces if space.windows]
    dark = [s for s in spaces if not s.windows and uses[s.guid].occupied]
    if not glazed:
        raise no_window(building, check.file)
    if on_plan is not None and check.lit and len(glazed) >= FROM:
        job = JobOptions(options.building, options.weather, room=options.room)
        on_plan(first_plan(check.inputs, glazed, job, progress))
    views, view_issues = check.views(glazed)
    check.asked_uses = uses
    check.asked = {s.guid: asked_of(files.rules, s, uses[s.guid]) for s in glazed}
    lights, issues, notes = check.lights(glazed)
    rooms = []
    for space in spaces:
        if space.guid in lights and space.guid in views:
            rooms.append(check.room(space, uses[space.guid], lights[space.guid], *views[space.guid]))
        elif space in dark:
            rooms.append(check.dark_room(space, uses[space.guid]))
    if not rooms:
        raise DataError("none of its rooms could be computed", file=options.building)
    rooms, verdicts = judged(rooms)
    return Compliance(
        check.building,
        files.rules,
        tuple(rooms),
        tuple(verdicts),
        check.calendar,
        files.weather,
        check.day,
        tuple(check.assumptions(rooms, left_out(spaces, glazed, dark))),
        check.head,
        tuple(dict.fromkeys(notes)),
        (*check.head.issues, *view_issues, *issues),
        check.seconds,
        blinds=check.blinds,
        settings=(*([light_words(options.room)] if check.lit else []), *dict.fromkeys(check.ratings)),
    )


class Check:
    """A building on its way through the rules: what its rooms share."""

    def __init__(self, building: Building, options: ComplyOptions, files: ComplyFiles, progress: Progress) -> None:
        """From what was read."""
        self.options, self.files, self.progress = options, files, progress
        self.file = options.building or Path(building.name)
        self.parts = frozenset(p for rule in files.rules.values() for p in rule.parts)
        self.operation = files.inputs.operation  # moves the blinds; gains and set points are those of the rules
        plain = replace(files.inputs, operation=None)
        self.inputs = inputs_of(
            building, options, plain, rooms="all", states=self._states, fill=self.lit, tables=self.tables
        )
        self.operation = self.operation and used_operation(self.operation, self.inputs.building)
        if self.operation is not None and self.lit:
            check_states(self.operation, max(map(len, self.inputs.filled.values()), default=1))
        self.systems, self.building = self.inputs.systems, self.inputs.building
        self.shaded = self._shaded(self.inputs.filled)
        self.ratings, extra = solar_sentences(self.systems)
        self.head = self.inputs.head.with_assumptions([*unused_notes(building), *extra])
        windows = [window for space in self.inputs.spaces for window in space.windows]
        self.hidden, self.glass = windows_without_view(windows, self.systems)
        self.calendar = calendar_of(files.weather)
        self.day = sun_day(files.weather, *options.day, files.least_altitude_deg)
        self.outdoors: OutdoorMesh = outdoors_of(in_month(self.building, options.day[0]))
        self.seconds: dict[str, float] = {}
        self.eye_notes: list[str] = []
        self.asked: Mapping[str, frozenset[str]] = {}  # parts that a room's own criteria need
        self.asked_uses: Mapping[str, RoomUse] = {}

    def _shaded(self, systems: Mapping[str, States]) -> bool:
        """Whether there are real blinds: LM-83's default shade rates no glare."""
        return self.files.closed is not None or min(map(len, systems.values()), default=0) > 1

    def _states(self, systems: Mapping[str, States]) -> Mapping[str, States]:
        """Each window open, and closed too where blinds move; in all states where an operation moves them."""
        if self.operation is not None and self._shaded(systems):
            return systems
        if "operated" in self.parts or (self._shaded(systems) and self.moving):
            return open_and_closed(systems, self.files.closed)
        return first_states(systems)

    @property
    def tables(self) -> OperationTables | None:
        """The tables of the operation; None without one."""
        return None if self.operation is None else self.operation.tables

    @property
    def lit(self) -> bool:
        """Whether the rules look at light at all."""
        return bool(self.parts & {"open", "operated", "heat", "eye"}) or self.glaring

    @property
    def moving(self) -> bool:
        """Whether something that real blinds change is looked at, LM-83's own sum apart."""
        return self.glaring or bool(self.parts & {"heat", "eye"})

    @property
    def glaring(self) -> bool:
        """Whether glare is rated."""
        return "glare" in self.parts and self.options.room.outputs.annual_glare

    def uses_of(self, spaces: list[Space]) -> dict[str, RoomUse]:
        """The use of each room by GUID."""
        return uses_of_rooms(self.building, spaces, self.files.uses, self.options.linked)

    def views(self, spaces: list[Space]) -> tuple[dict[str, tuple[ViewOut, SunExposure]], list[Issue]]:
        """View and sunlight of each room by GUID, by rays against the whole building."""
        start, found, issues = time.monotonic(), {}, []
        for number, space in enumerate(spaces):
            self.progress("view and sunlight", number / len(spaces))
            try:
                view = view_out(space, self.outdoors, eye_height=self.options.eye_height, hidden=self.hidden)
            except RoomError as error:
                values = {"room": space.label, "reason": str(error)}
                issues.append(Issue("room-not-simulated", space.guid, values, Effect("room")))
                continue
            found[space.guid] = view, sun_exposure(space, self.outdoors, self.day)
        self.progress("view and sunlight", 1.0)
        self._took({"view and sunlight": time.monotonic() - start})
        return found, issues

    def lights(self, spaces: list[Space]) -> tuple[dict[str, RoomLights], list[Issue], list[str]]:
        """The light of each room by GUID, equal rooms computed once."""
        if not self.lit:
            rules = self.files.rules.items()
            none = {name: values_of(rule, Findings(self.calendar), LIGHT) for name, rule in rules}
            return {s.guid: RoomLights(s, {}, none) for s in spaces}, [], []
        start, options = time.monotonic(), self.options
        self.progress("sky", 0.0)
        room = options.room
        skies = skies_for(self.files.weather, room.sampling, **room.sky)
        self.progress("sky", 1.0)
        cache = MatrixCache.of_user() if options.cache else None
        if self.moving and self.shaded:
            chosen = self.building, spaces, self.systems, self.files.weather, room
            self.operation = with_shared_states(
                self.operation, *chosen, skies=skies, cache=cache, progress=self.progress
            )

        def compute(space: Space, steps: Progress) -> RoomLights:
            return self._light(space, skies, cache, steps)

        results, issues, notes = RoomSeries(
            self.building,
            spaces,
            template_rooms(spaces),
            self.systems,
            options.room.sampling,
            cache,
            compute,
            moved_lights,
            options.building,
            alike=lambda one, other: (
                self._costly(one) == self._costly(other)
                and self._setups(one) == self._setups(other)
                and self._glare_limits(one) == self._glare_limits(other)
                and same_control(self.tables, self.building, one, other)
            ),
        ).results(self.progress)
        left = time.monotonic() - start - sum(self.seconds.get(name, 0.0) for name in PARTS)
        self._took({"what else light takes": max(left, 0.0)})
        return {result.space.guid: result for result in results}, issues, notes

    def _costly(self, space: Space) -> frozenset[str]:
        """What of glare, heat and the eye's light a rule looks at in a room."""
        return self.asked[space.guid] & {"glare", "heat", "eye"}

    def _glare(
        self, room: RoomInputs, light: RoomLight, state: NDArray[np.int64] | None, progress: Progress
    ) -> SeatGlare:
        """Glare at the stated seats of a room, else at the worst views of its glare map; state: [H, G]."""
        options = self.options
        if options.glare_by_map:
            limits = self._glare_limits(room.space)
            return worst_seat_glare(room, light, state, limits=limits, eye_height=options.eye_height, progress=progress)
        return seat_glare(
            room,
            light,
            None if state is None else light.states(state),
            grid=options.grid,
            directions=options.directions,
            eye_height=options.eye_height,
            progress=progress,
        )

    def _glare_limits(self, space: Space) -> frozenset[tuple[float, float]]:
        """Limits of DGP that the criteria of a room have, each with the share of the hours that may exceed it."""
        use = self.asked_uses[space.guid]
        return frozenset(
            (need.limit, need.share)
            for rule in self.files.rules.values()
            for criterion in rule.criterion
            if applies(criterion, space, use)
            for need in criterion.needs
            if isinstance(need, DgpExceeded)
        )

    def _setups(self, space: Space) -> dict[str, OperationTables | None]:
        """The operation of a room by rule, of the rules that look at its heat.

        A rule whose weather is not this one has none: its heat is not computed.
        """
        if "heat" not in self._costly(space):
            return {}
        use = self.asked_uses[space.guid].key
        return {
            name: rule.operation_of(use)
            for name, rule in self.files.rules.items()
            if "heat" in rule.parts and rule.fits(self.files.weather)
        }

    def _light(self, space: Space, skies: AnnualSky, cache: MatrixCache | None, progress: Progress) -> RoomLights:
        """One room's light on all grids, and its glare where that is wanted."""
        rules = self.files.rules
        grids = {name: sensor_grid_of(space, rule.grid) for name, rule in rules.items()}
        distinct = list(dict.fromkeys(grids.values()))
        eyes = "eye" in self._costly(space)
        room = room_inputs(
            self.building,
            space,
            self.systems,
            self.files.weather,
            self.options.room,
            operation=self.tables,
            skies=skies,
            cache=cache,
            grids=distinct,
        )
        room = replace(room, operation=None)
        operated = {distinct.index(grids[name]) for name, rule in rules.items() if "operated" in rule.parts}
        if self.moving and self.shaded:
            operated = operated or {0}
        times = StageTimes()
        with times.stage(TRACING):
            light = room_light(room, progress=progress)
        with times.stage(SUMS):
            found = lights_of(room, light, operated)
        state = self._state(room, found, skies, cache)
        glare = None
        if self.glaring and "glare" in self._costly(space):
            with times.stage(GLARE):
                glare = self._glare(room, light, state, progress)
        open_all = np.zeros((skies.hours, len(room.windows.groups)), dtype=np.int64)
        state = open_all if state is None else state
        heats: dict[str, RoomHeat] = {}
        with times.stage(HEAT):
            distinct_setups: list[tuple[OperationTables | None, RoomHeat]] = []
            for name, setup in self._setups(space).items():
                heat = next((heat for one, heat in distinct_setups if one == setup), None)
                if heat is None:
                    operated_room = replace(room, operation=setup)
                    heat = room_heat(operated_room, light, state, progress=progress)
                    distinct_setups.append((setup, heat))
                heats[name] = heat
        eye = None
        if eyes:
            tables = None if self.files.lamps is None else self.files.lamps.tables.of_room(self.building, space)
            with times.stage(EYES):
                eye, notes = seat_eye(room, light, state, tables)
            self.eye_notes += notes
        self._took(times.seconds)
        of_room = Findings(self.calendar, glare=glare, eye=eye)
        lights = {name: found[distinct.index(grid)] for name, grid in grids.items()}
        values = {
            name: values_of(rules[name], replace(of_room, light=grid, heat=heats.get(name)), LIGHT)
            for name, grid in lights.items()
        }
        summaries = {id(grid): self._summary(grid) for grid in found}
        by_rule = {name: summaries[id(grid)] for name, grid in lights.items()}
        groups = tuple(g.name for g in room.windows.groups)
        return RoomLights(space, by_rule, values, groups, glare)

    def _state(
        self, room: RoomInputs, lights: Sequence[GridLight], skies: AnnualSky, cache: MatrixCache | None
    ) -> NDArray[np.int64] | None:
        """The states [H, G] of a room's window groups by the operation, else by LM-83's rule; None: open all year."""
        if not (self.shaded and self.moving):
            return None
        if self.operation is None:
            closed = next((one.closed for one in lights if one.closed is not None), None)
            if closed is None:
                return None
            last = np.array([len(of) - 1 for of in room.windows.systems], dtype=np.int64)
            return closed[:, : len(last)] * last
        chosen = self.building, room.space, self.systems, self.files.weather, self.options.room
        asked = asked_year(inputs_of_room(*chosen, operation=self.operation, skies=skies, cache=cache))
        return asked.states[:, room.windows.control]

    def _weather_words(self) -> Iterator[str]:
        """Rules that ask for other weather."""
        weather = self.files.weather
        for rule in self.files.rules.values():
            if not rule.fits(weather):
                yield Note(
                    "{rule}: no verdict. It asks for the weather of {sites}; {file} is not that.",
                    rule=Note(rule.title),
                    sites=rule.weather_asked,
                    file=weather.site if weather.file is None else weather.file.name,
                )
            elif not rule.judges(weather):
                yield Note(
                    "{rule}: no verdict, figures only. It asks for weather whose header states {words}; that of "
                    "{file} does not.",
                    rule=Note(rule.title),
                    words=rule.header[0],
                    file=weather.site if weather.file is None else weather.file.name,
                )
        fitting = [rule for rule in self.files.rules.values() if rule.fits(weather)]
        yield from weekday_note([one.operation for rule in fitting for one in rule.setup], weather)

    def _took(self, seconds: Mapping[str, float]) -> None:
        """Add what parts of the check took."""
        for name, value in seconds.items():
            self.seconds[name] = round(self.seconds.get(name, 0.0) + value, 1)

    def _summary(self, light: GridLight) -> GridSummary:
        ten = self.calendar.ten
        light_of_use = light.open if light.operated is None else light.operated
        return GridSummary(
            light.points,
            light.factor,
            daylight_autonomy(light_of_use, ten),
            sunlit_hours(light.direct, ten, step_h=self.calendar.step_h),
            exceeded(light.open[self.calendar.daylight], HALF_TIME),
            None if light.closed is None else light.closed[ten].mean(axis=0),
            None if light.free is None else free_shares(light.free[ten]),
        )

    def room(self, space: Space, use: RoomUse, light: RoomLights, view: ViewOut, sun: SunExposure) -> CheckedRoom:
        """A room with windows against all rules."""
        rules, findings = self.files.rules, Findings(self.calendar, view=view, sun=sun)
        values = {name: {**light.values[name], **values_of(rule, findings, RAYS)} for name, rule in rules.items()}
        verdicts = tuple(assess_room(rules, values, space, use, self.files.weather))
        return CheckedRoom(space, use, verdicts, view, sun, light if light.grids else None)

    def dark_room(self, space: Space, use: RoomUse) -> CheckedRoom:
        """An occupied room without any window: it has no daylight, no view and no sun."""
        none = np.zeros((len(self.calendar.times), 1), dtype=np.float32)
        light = GridLight(np.zeros((1, 3)), none, none, np.zeros(1), none) if self.lit else None
        view = ViewOut(np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros((1, 3), dtype=bool))
        used = working_hours(self.files.weather, *self.options.room.occupancy.hours)
        eye = EyeLight(np.zeros((2, len(used))), None, used) if self.lit else None
        findings = Findings(self.calendar, light, view, SunExposure((), ()), eye=eye)
        rules = self.files.rules
        values = {name: values_of(rule, findings, LIGHT | RAYS) for name, rule in rules.items()}
        verdicts = tuple(assess_room(rules, values, space, use, self.files.weather))
        return CheckedRoom(space, use, verdicts, None, None, None)

    def assumptions(self, rooms: list[CheckedRoom], left: list[Space]) -> list[str]:
        """What was assumed, in sentences; `left` are rooms without a rule."""
        found = [*self._weather_words(), *self._ray_words(), *self._light_words()]
        found += dwelling_words(rooms)
        if left:
            names = ", ".join(space.label for space in left)
            found.append(Note("Not assessed (no window, not regularly occupied): {rooms}.", rooms=names))
        found += [
            Note(
                "{room}: {use}; {source}.",
                room=room.space.label,
                use=Note(USE_WORDS.get(room.use.key, room.use.key)),
                source=room.use.source,
            )
            for room in rooms
            if room.use.assumed
        ]
        rules = self.files.rules.values()
        found += [
            Note("{rule}. Left out: {what}", rule=Note(rule.title), what=Note(sentence))
            for rule in rules
            for sentence in rule.left_out
        ]
        return found

    def _ray_words(self) -> Iterator[str]:
        """What was assumed for sun and view."""
        files, options = self.files, self.options
        if not options.surroundings and not has_surroundings(self.building):
            yield NO_SURROUNDINGS
        if "sun" in self.parts:
            month, day = options.day
            yield Note(
                "Sunlight is assessed on {day} {month} for solar altitudes from {altitude:g}° ({source}).",
                day=day,
                month=Note("February") if month == 2 else Note("March"),
                altitude=files.least_altitude_deg,
                source=files.altitude_source,
            )
        if "view" in self.parts:
            yield Note(
                "View out is assessed at eyes {height:g} m above the floor, spaced 0.5 m and 0.5 m "
                "from the walls (utilised area), without furniture.",
                height=options.eye_height,
            )
            yield from self.glass

    @property
    def blinds(self) -> str:
        """How the blinds move, in words."""
        movable = max(map(len, self.inputs.filled.values()), default=1) > 1 or self.files.closed is not None
        return blinds_words(movable, self.shaded, self.operation)

    def _light_words(self) -> Iterator[str]:
        """What was assumed for light, glare and heat."""
        room = self.options.room
        if "glare" in self.parts and not self.glaring:
            yield Note("Glare was not computed; --annual-glare rates every hour with daylight.")
        elif self.glaring:
            yield glare_words(self.options, self.blinds)
        if "eye" in self.parts:
            yield eye_words(self.options, self.blinds)
            yield from dict.fromkeys(self.eye_notes)
        if "heat" in self.parts:
            template = N_(
                "Temperatures for rules without a set-up are without heating and cooling, with {blinds}, "
                "{air_changes:g} air changes per hour and gains in the hours of use."
            )
            yield from assumed_ground_note(self.building)
            if any("heat" in r.parts and not r.setup for r in self.files.rules.values()):
                yield Note(template, blinds=self.blinds, air_changes=room.infiltration_ach)
        if "open" in self.parts and self.calendar.median_diffuse is None:
            yield Note("The daylight factor method is not available: there is no diffuse daylight in the weather file.")
        elif "open" in self.parts and not self.calendar.stated_illuminance:
            yield Note(
                "The weather file has no diffuse illuminance: its median for the daylight factor method is "
                "computed from the diffuse irradiance with Perez's luminous efficacy."
            )


def glare_words(options: ComplyOptions, blinds: str) -> str:
    """How glare is rated; blinds: `blinds_words`."""
    start, end = options.room.occupancy.hours
    if options.glare_by_map:
        return Note(
            "Glare is rated with {blinds}, daily from {start} to {end} o'clock, at the {views} worst views of a map of "
            "each room: eyes {spacing:g} m apart (more in rooms above {area:g} m²), {directions} directions each. "
            "Hours in which the map's error of {error:g} may decide a limit are rated by pictures of {pixels} pixels.",
            views=PICTURED,
            blinds=blinds,
            spacing=MAP_SPACING,
            area=MAP_EYES * MAP_SPACING**2,
            directions=MAP_DIRECTIONS,
            error=MAP_ERROR,
            pixels=options.room.outputs.picture_size,
            start=start,
            end=end,
        )
    seats = Note("one seat in the middle of each room")
    if options.grid is not None:
        seats = Note("seats spaced {distance:g} m", distance=options.grid)
    return Note(
        "Glare is rated with {blinds}, {seats}, daily from {start} to {end} o'clock, with pictures of {pixels} pixels.",
        blinds=blinds,
        seats=seats,
        pixels=options.room.outputs.picture_size,
        start=start,
        end=end,
    )


def eye_words(options: ComplyOptions, blinds: str) -> str:
    """Whose light at the eye is judged; blinds: `blinds_words`."""
    start, end = options.room.occupancy.hours
    return Note(
        "Light at the eye is that of one view in each room, with {blinds}, daily from {start} to {end} o'clock.",
        blinds=blinds,
        start=start,
        end=end,
    )


def blinds_words(movable: bool, shaded: bool, operation: Operation | None) -> str:
    """How blinds move where glare, temperatures and light at the eye are judged.

    Args: movable: some window has more than one state; shaded: each has.
    """
    if not movable:
        return ONE_STATE
    if shaded and operation is not None:
        return Note("blinds moved as in {file}", file=operation.file.name)
    return Note("blinds closed by the rule of LM-83") if shaded else Note("all blinds open")


def light_words(room: RoomOptions) -> str:
    """How light is computed."""
    sampling = room.sampling
    return Note(
        "Light is computed with the {method} method: {sensor} paths per sensor, {patch} per window "
        "direction, {sun} sun sampling points per window.",
        method=Note(METHODS[room.method]),
        sensor=sampling.sensor_samples,
        patch=sampling.patch_samples,
        sun=sampling.sun_points,
    )


def left_out(spaces: list[Space], glazed: list[Space], dark: list[Space]) -> list[Space]:
    """The spaces that have no window and are not regularly occupied."""
    held = {space.guid for space in (*glazed, *dark)}
    return [space for space in spaces if space.guid not in held]


def free_shares(free: NDArray[np.bool_]) -> tuple[float, float]:
    """Shares of the hours in which some and in which all window groups [H, G] are seen through."""
    return float(np.mean(free.any(axis=1))), float(np.mean(free.all(axis=1)))


def moved_lights(lights: RoomLights, space: Space) -> RoomLights:
    """The light of a template room for one equal to it, moved to where that stands."""
    shift = corner(space) - corner(lights.space)
    grids = {name: replace(grid, points=grid.points + shift) for name, grid in lights.grids.items()}
    glare = lights.glare
    if glare is not None:
        glare = replace(glare, eyes=glare.eyes + shift, plan=glare.plan and glare.plan.moved(shift))
    template = lights.space.label
    return replace(lights, space=space, grids=grids, glare=glare, template=template)
