"""The inputs of one room's simulation: the data that every stage reads."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bim.held_sensors import ModelGrid
from bim.model import Building, Season, Space, season_of, seasons
from bim.sensors import model_grids, model_views
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import MatrixCache, cached_or_computed
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.sight import sight_through
from scenes.fenestration.systems import States
from scenes.results import ShadingYear
from scenes.room.control_groups import ControlGroups, control_groups
from scenes.room.luminaires import with_luminaires
from scenes.room.operation import FUNCTION, Controller, OperationHours, SharedYear
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions, SensorGrid
from scenes.room.windows import RoomWindows, room_windows


@dataclass(frozen=True, slots=True)
class FileSensors:
    """Sensor grids and the glare view of a room that the building's file contains."""

    grids: tuple[ModelGrid, ...] = ()
    view: View | None = None  # the first fisheye of the whole hemisphere

    @classmethod
    def of(cls, building: Building, space: Space) -> FileSensors:
        """The sensors of a room."""
        fisheyes = [model_view.view for model_view in model_views(building, space) if model_view.view.covers_hemisphere]
        return cls(tuple(model_grids(building, space)), fisheyes[0] if fisheyes else None)


NO_SENSORS = FileSensors()
EYE_TURNS = (90, 180, 270)  # [degrees] anticlockwise, of the eye's other directions


@dataclass(frozen=True, slots=True)
class RoomInputs:
    """One room and the data from which its year is computed."""

    building: Building
    space: Space
    systems: Mapping[str, States]  # by window GUID; also of rooms that lend light
    windows: RoomWindows
    control: ControlGroups  # of the windows
    weather: Weather
    skies: AnnualSky
    options: RoomOptions
    seasons: tuple[Season, ...]  # the building by months, the most leaves first
    operation: OperationTables | None  # of this room; None: first shading state, floating freely
    grids: tuple[SensorGrid, ...]  # of the work plane, one after the other
    file_sensors: FileSensors
    inner_glass: bool  # whether light passes through glass between rooms
    cache: MatrixCache | None
    together: frozenset[str] = frozenset()  # GUIDs of the rooms that are balanced with this one
    controller: Controller | None = None  # in place of the operation's rules of shading
    shared: Mapping[str, SharedYear] = field(default_factory=dict)  # known states, by the name of their group

    @property
    def followed(self) -> dict[int, SharedYear]:
        """The known years of control groups that other rooms share, by the number of the group."""
        names = enumerate(self.control.shared)
        return {c: self.shared[name].up_to(self.windows.states_of(c)) for c, name in names if name in self.shared}

    @property
    def other_sensors(self) -> int:
        """Sensors of the scene that are not of the work plane: the last ones."""
        return sum(len(grid.points) for grid in self.file_sensors.grids)

    @property
    def season(self) -> NDArray[np.int64]:
        """The season of every lit hour [L], as an index into `seasons`."""
        return self.season_of_year[self.skies.lit]

    @property
    def season_of_year(self) -> NDArray[np.int64]:
        """The season of every hour [H], as an index into `seasons`."""
        return season_of(self.seasons, self.weather.midpoints.month.to_numpy())

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """The hours with people [H]."""
        if self.operation is not None:
            return OperationHours(self.operation, self.weather).present > 0
        return self.skies.once(working_hours, self.weather, *self.options.occupancy.hours)

    def shading(
        self, state: NDArray[np.int64], moved_by: NDArray[np.int64] | None = None, reasons: tuple[str, ...] = ()
    ) -> ShadingYear:
        """The year of the control groups, from the states of the window groups [H, G].

        Args: moved_by, reasons: as of `ShadingYear`.
        """
        firsts = [int(np.argmax(self.windows.control == c)) for c in range(len(self.control.names))]
        rules = self.control.kinds
        if self.controller is not None:
            rules = (FUNCTION,) * len(rules)
        seen = [[sight_through(one).is_view for one in self.windows.systems[g]] for g in firsts]
        return ShadingYear(
            self.control.names,
            rules,
            state[:, firsts],
            self.control.number,
            moved_by,
            reasons,
            tuple(map(np.array, seen)),
        )


def room_inputs(
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
    file_sensors: FileSensors = NO_SENSORS,
    inner_glass: bool = False,
    together: Collection[str] = (),
    controller: Controller | None = None,
    shared: Mapping[str, SharedYear] | None = None,
) -> RoomInputs:
    """The inputs of one room.

    Args:
        systems: by window GUID the `FenestrationSystem` of each shading state, from open to closed.
        operation: tables of all rooms; those of this room are chosen here.
        skies: of `skies_for`, shared by the rooms of a building; computed here without.
        grids: sensor grids in place of the grid of the options.
        together: GUIDs of the rooms whose heat is balanced with this one's: sun passes the glass
            and open doorways between them.
        controller: of the shading states, in place of the rules of the tables.
        shared: known states of the groups that several rooms share, see `shared_states`; a group of
            which none are known follows its rule in this room.

    Raises: `ValueError` for a window without a system, `DataError` for a room that the tables name
        and the building does not contain.
    """
    if skies is None:
        skies = skies_for(weather, options.sampling, cache, **options.sky)
    tables = None if operation is None else operation.of_room(building, space)
    if tables is not None:
        grid = (tuple(grids) or (options.grid,))[0]
        tables = with_luminaires(tables, building, space, grid, seed=options.sampling.seed)
    control = control_groups(space, None if tables is None else tables.control, building)
    shared = dict(shared or {})
    control = control.following(shared)
    return RoomInputs(
        building,
        space,
        systems,
        room_windows(space, systems, control),
        control,
        weather,
        skies,
        options,
        seasons(building),
        tables,
        tuple(grids) or (options.grid,),
        file_sensors,
        inner_glass,
        cache,
        frozenset(together),
        controller,
        shared,
    )


def skies_for(weather: Weather, sampling: Sampling, cache: MatrixCache | None = None, /, **choices: str) -> AnnualSky:
    """Sky patches and sun of the year; the same for every room and method.

    Args: cache: of the sun's directions; choices: `RoomOptions.sky`.
    """
    towards = cached_sun_directions(weather, choices.get("sun_model", "spa"), cache)
    return annual_sky(weather, sampling.subdivision, solar=True, towards=towards, **choices)


def cached_sun_directions(weather: Weather, model: str, cache: MatrixCache | None) -> NDArray[np.float64]:
    """Directions to the sun [H, 3] of a weather: `sun_directions`, cached on disk.

    The Solar Position Algorithm and its library take half a second, about as long as all else of a
    study's case whose matrices are cached.
    """
    place = (weather.latitude_deg, weather.longitude_deg, weather.timezone_h, weather.elevation_m)
    air = (weather.pressure_pa, weather.dry_bulb_c)
    times = np.asarray(weather.midpoints.asi8)
    entry = (
        None
        if cache is None
        else cache.entry("sun directions", *place, weather.turned_deg, model, times, *air, by=sun_directions.__module__)
    )
    return cached_or_computed(entry, lambda: sun_directions(weather, model=model))
