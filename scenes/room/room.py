"""One room on its way from Python objects to its results; no file is read or written."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Problem, Space
from bim.outer_faces import OuterFaces, outer_faces
from bim.seasons import in_month, season_of, seasons
from bim.to_thermal import ThermalRoom
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs import variants
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import (
    SeasonalLight,
    eye_illuminance,
    path_light_of,
    seasonal_light,
    with_pictures,
)
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_light import PhaseLight, phase_light
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices, with_outdoors
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.progress import Progress, in_shares, part, silent
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from scenes.fenestration.systems import States
from scenes.fenestration.thermal_system import ThermalSystem, thermal_system
from scenes.results import (
    DaylightResult,
    ExploredRoom,
    GlareResults,
    ThermalResult,
)
from scenes.room.control import shading_states
from scenes.room.daylight import NO_SENSORS, HeldSensors, room_daylight, room_scene
from scenes.room.envelope import enveloped
from scenes.room.explorer import explored_room
from scenes.room.glare import (
    band_scenes,
    brightest_picture,
    default_hours,
    glare_by_state,
    glare_of_year,
    kept_glare,
    rating_of,
    room_glare,
    with_colour,
    worst_hours,
)
from scenes.room.heat import HeatInputs, fenestration_table, heat_alone
from scenes.room.inner_glass import InnerGlass, inner_glass
from scenes.room.leaks import hole_problems
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions, SensorGrid
from scenes.room.skies import skies_for
from scenes.room.solar import RoomSun, SeasonalOutdoors
from scenes.room.windows import room_windows
from scenes.room.zone import (
    RoomZone,
    internal_gains,
    operated,
    plain_services,
    services_of,
    under_the_sky,
    zone_surfaces,
)

FloatArray = NDArray[np.float64]
T = TypeVar("T")
# of the daylight's stage, the sensors' matrices; those of the view are a stage of their own
TRACED = {"daylight": 0.6}
WORST = 4  # pictures of an annual glare without hours asked for


class RoomSimulation:
    """A room on its way: each step is computed when it is first asked for, and serves all others.

    `cfs run` and `cfs study` ask for all of them (`lit_room`), `cfs thermal` for `zone`.
    """

    def __init__(
        self,
        building: Building,
        space: Space,
        systems: Mapping[str, States],
        weather: Weather,
        options: RoomOptions,
        *,
        operation: OperationTables | None = None,
        skies: AnnualSky | None = None,
        cache: MatrixCache | None = None,
        grids: Sequence[SensorGrid] = (),
        inner: bool = False,
        held: HeldSensors = NO_SENSORS,
        progress: Progress = silent,
    ) -> None:
        """See `lit_room`; grids: of the sensors in place of the options' one; held: beside them."""
        if operation is not None:
            operation = operation.of_room(building, space)
        self.building, self.space, self.weather, self.options = building, space, weather, options
        self.sampling, self.outputs = options.sampling, options.outputs
        self.operation, self.cache, self.progress = operation, cache, progress
        self.grids, self.held = tuple(grids) or (options.grid,), held
        self.skies = (
            skies_for(weather, options.method, options.sampling, cache, **options.sky)
            if skies is None
            else skies
        )
        self.windows = room_windows(space, systems)
        self.systems = systems
        self.seasons = seasons(building)
        first = self.seasons[0].building
        self.inner = inner_glass(first, space, systems) if inner else None
        self.seconds: dict[str, float] = {}

    def timed(self, stage: str, work: Callable[[], T]) -> T:
        """What the work gives; its time is noted, and memory that it needs no more goes back."""
        start = time.monotonic()
        result = work()
        variants.return_memory()
        self.seconds[stage] = round(time.monotonic() - start, 2)
        return result

    @cached_property
    def scene(self) -> DaylightScene:
        """Triangles, window groups, sensors and view in the visible band."""
        return self._scene(self.seasons[0].building, self.inner)

    def _scene(self, building: Building, inner: InnerGlass | None) -> DaylightScene:
        return room_scene(
            building,
            self.space,
            self.windows,
            self.grids,
            self.outputs.picture_size,
            inner=inner,
            held=self.held,
        )

    @cached_property
    def season(self) -> NDArray[np.int64]:
        """The season of every lit hour [L], its number among `seasons`."""
        months = self.weather.midpoints[self.skies.lit].month.to_numpy()
        return season_of(self.seasons, months)

    @cached_property
    def traced(self) -> PhaseMatrices:
        """V and D."""
        return phase_matrices(
            self.scene,
            self.sampling,
            five_phase=self.options.method != "three-phase",
            cache=self.cache,
            progress=in_shares(self.progress, TRACED),
        )

    @cached_property
    def light(self) -> PhaseLight | SeasonalLight:
        """The light of the lit hours in every state."""
        steps = part(self.progress, 0.6, 0.9, "daylight")
        matrices, optics = [self.traced], [self._optics(self.inner)]
        for season in self.seasons[1:]:
            inner = self.inner
            if inner is not None:
                inner = inner_glass(season.building, self.space, self.systems)
            matrices.append(with_outdoors(self.traced, self._scene(season.building, inner)))
            optics.append(self._optics(inner))
        if len(matrices) == 1:
            return phase_light(*matrices, *optics, self.skies, progress=steps)
        return seasonal_light(matrices, optics, self.skies, self.season, progress=steps)

    def _optics(self, inner: InnerGlass | None) -> list[Sequence[SystemOptics]]:
        """The optics of the window groups in their states [G][J]."""
        return [*self.windows.optics(), *(() if inner is None else inner.optics)]

    @cached_property
    def viewed(self) -> PhaseLight | SeasonalLight:
        """The light with the matrices of the view, which the glare of many hours takes."""
        return with_pictures(self.light, progress=in_shares(self.progress, TRACED))

    def eye(self) -> NDArray[np.float32]:
        """Illuminance at the eye in every state [J, L] [lx]."""
        hours = np.ones(len(self.skies.lit), dtype=np.int64)
        states = range(self.light.states)
        return np.stack([eye_illuminance(self.light, j * hours) for j in states]).astype(np.float32)

    @cached_property
    def state(self) -> NDArray[np.int64]:
        """The shading state of every hour [H]."""
        if self.operation is None or not self.space.windows:
            return np.zeros(self.skies.hours, dtype=np.int64)
        return shading_states(
            self.operation,
            self.space,
            self.weather,
            self.windows.states,
            irradiance=lambda: self.sun.irradiance,
            eye=lambda: self.skies.whole_year(self.eye()),
            dgp=lambda: glare_by_state(self.viewed, rating_of(self.outputs), self.progress),
        )

    @property
    def lit_state(self) -> NDArray[np.int64]:
        """The shading state of every lit hour [L]."""
        return self.state[self.skies.lit]

    @cached_property
    def daylight(self) -> DaylightResult:
        """Illuminance of the work plane and its metrics."""
        self.progress("daylight", 0.0)
        steps = part(self.progress, 0.9, 1.0, "daylight")
        found = room_daylight(
            self.light, self.lit_state, self.weather, self.options.method, steps, held=self.held
        )
        self.progress("daylight", 1.0)
        return found

    @property
    def pictured(self) -> PhaseLight | PathLight | SeasonalLight:
        """The light that pictures are made of."""
        if self.options.method == "point-in-time":
            return path_light_of(self.light)
        return self.viewed if "viewed" in self.__dict__ else self.light

    def holes(self) -> tuple[Problem, ...]:
        """What of the light leaves through no window."""
        return hole_problems(self.space, self.scene, seed=self.sampling.seed, cache=self.cache)

    def annual_glare(self) -> pd.DataFrame:
        """Glare of every hour."""
        return glare_of_year(
            self.viewed, self.lit_state, self.weather,
            rating=rating_of(self.outputs), progress=self.progress,
        )  # fmt: skip

    def rated(self, metric: str, hours: NDArray[np.int64]) -> AnnualGlare:
        """A glare metric in some hours of the year with the sun up [n]."""
        columns = np.searchsorted(self.skies.lit, hours)
        steps = part(self.progress, 0.0, 1.0, "annual glare")
        light, rating, kept = self.pictured, rating_of(self.outputs), None
        if isinstance(light, PhaseLight) and self.inner is None:
            kept = kept_glare(light, self.windows, metric, columns, rating)
        return hourly_glare(
            light,
            metric,
            self.lit_state,
            hours=columns,
            options=rating,
            cached=kept,
            progress=steps,
        )

    def explored(self) -> ExploredRoom:
        """Every hour in every state, of outdoors that do not change over the year."""
        names = [state.name for state in max(self.windows.systems, key=len)]
        steps = part(self.progress, 0.0, 1.0, "explorer")
        sensors = len(self.daylight.points)
        return explored_room(self.pictured, self.state, names, steps, sensors=sensors)

    def glare(self, hours: list[int], year: pd.DataFrame | None) -> GlareResults:
        """Pictures of the hours asked for, of the year's worst, or of the usual ones."""
        if not hours and year is not None:
            hours = worst_hours(year, min(WORST, self.outputs.picture_count))
        if not hours:
            eye = self.eye()[self.lit_state, np.arange(len(self.skies.lit))]
            count = self.outputs.picture_count
            hours = default_hours(self.weather.midpoints, self.skies.lit, eye, count)
        return room_glare(
            self.pictured, self.scene.view, self.lit_state, hours,
            rating=rating_of(self.outputs), progress=self.progress,
        )  # fmt: skip

    def coloured(self, glare: GlareResults) -> GlareResults:
        """The pictures with the brightest of them in colour."""
        if not glare.pictures:
            return glare
        self.progress("colour", 0.0)
        hour, groups = brightest_picture(glare).hour, self.windows.groups
        building = in_month(self.building, int(self.weather.midpoints[hour].month))
        sky = annual_sky(self.weather, self.sampling.subdivision, hours=[hour], **self.options.sky)
        found = with_colour(
            glare, band_scenes(building, self.space, groups, glare.view),
            self.light.systems[: len(groups)], sky, state=int(self.state[hour]),
            sampling=self.sampling, progress=part(self.progress, 0.0, 1.0, "colour"),
        )  # fmt: skip
        self.progress("colour", 1.0)
        return found

    @cached_property
    def outdoors(self) -> list[PhaseMatrices]:
        """D of the solar band in each season: the visible one's where both bands reflect alike."""
        first, *rest = (
            exterior_surfaces(season.building, self.space, "solar") for season in self.seasons
        )
        matrices = self._solar(first)
        of_d = replace(matrices, five_phase=False)
        scenes = [replace(matrices.scene, exterior=one) for one in rest]
        return [matrices, *(with_outdoors(of_d, scene) for scene in scenes)]

    def _solar(self, exterior: Surfaces) -> PhaseMatrices:
        if (
            self.inner is None
            and "scene" in self.__dict__
            and np.array_equal(exterior.reflectance, self.scene.exterior.reflectance)
        ):
            return self.traced
        scene = DaylightScene(Surfaces.none(), exterior, self.windows.groups)
        steps = part(self.progress, 0.0, 1.0, "sun")
        matrices = phase_matrices(
            scene, self.sampling, five_phase=False, needs=(), cache=self.cache, progress=steps
        )
        steps("sun", 1.0)
        return matrices

    @cached_property
    def outer(self) -> OuterFaces:
        """Places before the outer faces of the room's walls and windows."""
        return outer_faces(self.building, self.space, self.surfaces)

    @cached_property
    def sun(self) -> RoomSun:
        """The sun outside and what the room does with it."""
        steps = part(self.progress, 0.0, 0.8, "heat")
        interior = interior_surfaces(self.space, "solar")
        seen = SeasonalOutdoors(self.outdoors, self.season)
        return RoomSun(seen, interior, self.surfaces, self.outer, self.skies, steps)

    @cached_property
    def thermals(self) -> list[list[ThermalSystem]]:
        """Thermal data of the windows' systems by group and state [G][J]."""
        return [[thermal_system(system) for system in states] for states in self.windows.systems]

    @cached_property
    def occupied(self) -> NDArray[np.bool_]:
        """The hours with people [H]."""
        if self.operation is not None:
            return OperationHours(self.operation, self.weather).present > 0
        return working_hours(self.weather, *self.options.occupancy.hours)

    @cached_property
    def surfaces(self) -> ThermalRoom:
        """The room's surfaces and windows as a zone, with the gains and the air of the options."""
        gains = internal_gains(self.space, self.occupied, self.options.occupancy)
        systems = [self.thermals[g] for g in self.windows.group]
        return zone_surfaces(self.space, systems, gains, self.options.infiltration_ach)

    @cached_property
    def plane(self) -> FloatArray | None:
        """Mean illuminance of the work plane [H] [lx]; None where neither lamps nor control ask."""
        tables = self.operation
        if tables is None or not self.space.windows:
            return None
        dimmed = tables.gains.lighting_w_m2 and tables.gains.lighting_dimmed
        if tables.control.rule != "glare" and not dimmed:
            return None
        return self.daylight.illuminance.mean(axis=1, dtype=float)

    @cached_property
    def zone(self) -> RoomZone:
        """The room as the heat balance takes it."""
        room, lamps = self.surfaces, np.zeros(self.skies.hours)
        sun, state, plane = self.sun, self.state, self.plane  # stages of their own before this one
        self.progress("heat", 0.0)
        if self.operation is not None:
            area = self.space.floor_area
            zone, lamps = operated(room.zone, self.operation, area, self.weather, plane)
            room = enveloped(
                replace(room, zone=zone), self.building, self.space, self.operation, self.weather
            )
            services = services_of(self.operation, area, self.weather)
        else:
            services = plain_services(self.space, self.occupied, self.options.occupancy)
        share = [len(season.months) / 12 for season in self.seasons]
        exteriors = [outdoors.scene.exterior for outdoors in self.outdoors]
        room = under_the_sky(
            room, self.outer, list(zip(exteriors, share, strict=True)),
            seed=self.sampling.seed, cache=self.cache,
        )  # fmt: skip
        solar, gains = sun.switched(self.windows, self.thermals, state)
        return RoomZone(
            self.space, room, solar, gains, state, lamps, self.occupied, plane, services
        )

    def heat_inputs(self) -> HeatInputs:
        """What the heat balance takes, and what its tables name."""
        table = tuple(fenestration_table(self.windows, self.thermals))
        names = tuple(system.name for system in max(self.windows.systems, key=len, default=()))
        return HeatInputs(self.zone, table, names, self.operation)

    def thermal(self) -> ThermalResult:
        """Temperatures and comfort of the room alone."""
        step_s, progress = self.options.heat_step_s, self.progress
        return heat_alone(self.heat_inputs(), self.weather, step_s, progress)[0]
