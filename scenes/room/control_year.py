"""What the shading control of a room reads, in combinations of the states of its groups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import SeasonalLight, eye_illuminance, illuminance, with_pictures, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.sky.sun import sun_directions
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation import OperationHours
from scenes.room.shading import Levels, shading_states, slat_tilts_deg
from scenes.room.shading_by_light import MOST_COMBINATIONS, Seat, seat_view
from scenes.room.solar import SeasonalOutdoors, SunByStates, window_irradiance
from scenes.room.window_sensors import window_beam
from scenes.room.zone import (
    RoomZone,
    ZoneSurfaces,
    climate,
    lamp_daylight,
    operated,
    per_window,
    room_zone,
    zone_surfaces,
)
from thermal.climate import Solar
from thermal.control import profile_angle
from thermal.zone import Gains

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.int64]
States = int | Sequence[int] | Mapping[str, int]  # of all control groups, of each [N], or by name
AT_A_TIME = 24  # hours whose glare is rated together: with those of the same day


@dataclass(frozen=True, slots=True)
class ZoneHeat:
    """Sun and gains of a zone's year in a combination of shading states."""

    solar: Solar
    gains: Gains
    lamps: FloatArray  # [H] power of the lamps [W], part of the gains


class ControlYear:
    """What a room's control reads in the combinations of states of its N control groups.

    Quantities of a combination are computed for all hours when one of them is first asked for.
    """

    def __init__(self, room: RoomInputs, light: RoomLight, outdoors: SeasonalOutdoors) -> None:
        """From the stages of a room."""
        self.room, self.light, self.outdoors = room, light, outdoors
        self.groups = room.control.names
        self.counts = tuple(room.windows.states_of(c) for c in range(len(self.groups)))
        self._sensors: dict[tuple[int, ...], NDArray[np.float32]] = {}
        self._eyes: dict[tuple[Seat, tuple[int, ...]], FloatArray] = {}
        self._glare: dict[tuple[Seat, tuple[int, ...]], FloatArray] = {}
        self._errors: dict[tuple[Seat, tuple[int, ...]], FloatArray] = {}
        self._views: dict[Seat, PhaseLight | SeasonalLight] = {}
        self._pictures: dict[Seat, PhaseLight | SeasonalLight] = {}
        self._lit = np.full(room.skies.hours, -1, dtype=np.int64)
        self._lit[room.skies.lit] = np.arange(len(room.skies.lit))

    def combination(self, states: States, previous: Sequence[int]) -> tuple[int, ...]:
        """The states of the control groups [N] of what a control function returns.

        Args: previous: [N] states of groups that are not named.

        Raises: `ValueError` for what is no state of a group.
        """
        if isinstance(states, Mapping):
            unknown = [name for name in states if name not in self.groups]
            if unknown:
                there = ", ".join(self.groups)
                raise ValueError(f"no group {unknown[0]!r}; there are {there}")
            of_all = [states.get(g, p) for g, p in zip(self.groups, previous, strict=True)]
        elif isinstance(states, int | np.integer):  # a group with fewer is in its last
            of_all = [min(int(states), count - 1) for count in self.counts]
            if states >= max(self.counts):
                raise ValueError(f"state {states}: expected 0 to {max(self.counts) - 1}")
        else:
            if not isinstance(states, Sequence | np.ndarray) or np.ndim(states) != 1:
                raise ValueError(f"expected a state, one of each group, or names, got {states!r}")
            of_all = list(states)
            if len(of_all) != len(self.groups):
                raise ValueError(f"{len(of_all)} states for {len(self.groups)} groups")
        for name, state, count in zip(self.groups, of_all, self.counts, strict=True):
            if not isinstance(state, int | np.integer) or not 0 <= state < count:
                raise ValueError(f"state {state!r} of group {name}: expected 0 to {count - 1}")
        return tuple(map(int, of_all))

    @cached_property
    def combinations(self) -> StateArray:
        """All combinations of states [M, N], the last group's states changing first.

        Raises: `DataError` for more than `MOST_COMBINATIONS`.
        """
        count = int(np.prod(self.counts))
        if count > MOST_COMBINATIONS:
            message = f"the groups have {count} combinations of states, at most {MOST_COMBINATIONS}"
            label = self.room.space.label
            raise DataError(f"{message} are computed", element=label, field="control.groups")
        return np.array(list(product(*map(range, self.counts))), dtype=np.int64)

    def of_windows(self, states: Sequence[int]) -> StateArray:
        """States of the window groups [G] of those of the control groups [N]."""
        return np.asarray(states, dtype=np.int64)[self.room.windows.control]

    def of_panes(self, states: ArrayLike) -> StateArray:
        """States of the zone's windows [..., W] of those of the control groups [..., N].

        A window with fewer states is in its last.
        """
        most = np.array([len(w.states) - 1 for w in self.zone.zone.windows], dtype=np.int64)
        chosen = np.asarray(states, dtype=np.int64)[..., self.room.control.number]
        return np.minimum(chosen, most)

    def sensors_lx(self, states: tuple[int, ...]) -> NDArray[np.float32]:
        """Illuminance of the work plane's sensors in the lit hours [S, L] [lx]."""
        if states not in self._sensors:
            values = illuminance(self.light.light, self._rows(states))
            plane = values[: len(values) - self.room.other_sensors].astype(np.float32)
            self._sensors[states] = plane
        return self._sensors[states]

    def eye_lx(self, states: tuple[int, ...], seat: Seat = (None, None)) -> FloatArray:
        """Illuminance at the eye of a seat in the lit hours [L] [lx]."""
        if (seat, states) not in self._eyes:
            self._eyes[seat, states] = eye_illuminance(self._view(seat), self._rows(states))
        return self._eyes[seat, states]

    def dgp(self, states: tuple[int, ...], hour: int, seat: Seat = (None, None)) -> float:
        """DGP of a seat in an hour of the year; 0 in the dark."""
        if self._lit[hour] < 0:
            return 0.0
        key = seat, states
        if key in self._glare and not np.isnan(self._glare[key][self._lit[hour]]):
            return float(self._glare[key][self._lit[hour]])
        day = np.arange(hour, min(hour - hour % AT_A_TIME + AT_A_TIME, self.room.skies.hours))
        used = (self.room.occupied[day] | (day == hour)) & (self._lit[day] >= 0)
        return float(self.dgp_of(states, day[used], seat)[0])

    def dgp_of(
        self, states: tuple[int, ...], hours: NDArray[np.int64], seat: Seat = (None, None), *, sigmas: float = 0.0
    ) -> FloatArray:
        """DGP of a seat in some lit hours of the year [n].

        Args: sigmas: so many standard errors of the tracing are added.
        """
        key = seat, states
        if key not in self._glare:
            count = len(self.room.skies.lit)
            self._glare[key], self._errors[key] = np.full(count, np.nan), np.zeros(count)
        errors = self._errors[key]
        rated, columns = self._glare[key], self._lit[hours]
        left = columns[np.isnan(rated[columns])]
        if len(left):
            if seat not in self._pictures:  # V of all patches: combinations are products then
                self._pictures[seat] = with_pictures(self._view(seat), by_states=True)
            glare = hourly_glare(
                self._pictures[seat],
                "DGP",
                self._rows(states),
                hours=left,
                options=rating_of(self.room.options.outputs),
            )
            rated[left], errors[left] = glare.dgp, np.nan_to_num(glare.dgp_standard_error)
        return rated[columns] + sigmas * errors[columns]

    @property
    def lit_hours(self) -> NDArray[np.int64]:
        """The number of each hour of the year among the lit ones [H]; -1 in the dark."""
        return self._lit

    def lit_hour(self, hour: int) -> int:
        """The number of an hour of the year among the lit ones; -1 in the dark."""
        return int(self._lit[hour])

    @cached_property
    def sun(self) -> FloatArray:
        """Direction to the sun [H, 3]."""
        return sun_directions(self.room.weather)

    @cached_property
    def irradiance(self) -> FloatArray:
        """Irradiance of the brightest window group of each control group [H, N] [W/m2]."""
        return self._of_groups(window_irradiance(self.outdoors, self.room.skies))

    @cached_property
    def beam(self) -> FloatArray:
        """The sun's direct irradiance of each control group behind the surroundings [H, N]."""
        return self._of_groups(window_beam(self.room, shaded=True))

    @cached_property
    def profile_deg(self) -> FloatArray:
        """Least profile angle of the sun before each control group [H, N] [deg]; 90 behind it."""
        frames = [group.frame for group in self.room.windows.groups]
        angles = np.stack([profile_angle(self.sun @ frame.T) for frame in frames], axis=1)
        return -np.degrees(self._of_groups(-angles))

    @cached_property
    def tilts_deg(self) -> tuple[FloatArray, ...]:
        """Slat tilt of each state [J] of each control group [N] [deg]; NaN without."""
        control, systems = self.room.windows.control, self.room.windows.systems
        firsts = (int(np.argmax(control == c)) for c in range(len(self.groups)))
        return tuple(slat_tilts_deg(systems[g]) for g in firsts)

    @cached_property
    def outdoor_c(self) -> FloatArray:
        """Outdoor temperature [H] [degC]."""
        return climate(self.room.weather).outdoor_c

    @cached_property
    def wind_m_s(self) -> FloatArray:
        """Wind speed [H] [m/s]."""
        return climate(self.room.weather).wind_speed

    @cached_property
    def present(self) -> FloatArray:
        """Share of the people that is present [H]."""
        tables = self.room.operation
        if tables is None:
            return self.room.occupied.astype(float)
        return OperationHours(tables, self.room.weather).present

    @cached_property
    def zone(self) -> RoomZone:
        """The zone of the room with all groups in their first state."""
        states = np.zeros((self.room.skies.hours, len(self.room.windows.groups)), dtype=np.int64)
        return room_zone(self.room, self._surfaces, self.outdoors, states)

    @cached_property
    def sun_by_states(self) -> SunByStates:
        """The sun of the zone in combinations of states."""
        return SunByStates(
            self.room, self.outdoors, self._surfaces.room, self._surfaces.outer, thermals=self._surfaces.thermals
        )

    def work_plane_lx(self, states: tuple[int, ...]) -> FloatArray:
        """Mean illuminance of the work plane in all hours [H] [lx]."""
        return self.room.skies.whole_year(self.sensors_lx(states).mean(axis=0, dtype=float))

    def heat(self, states: tuple[int, ...]) -> ZoneHeat:
        """Sun and gains of the zone with its control groups in states [N]."""
        solar, *_ = self.sun_by_states.of(self.of_windows(states).tolist())
        windows = np.array(states, dtype=np.int64)[self.room.control.number]
        of_windows = np.tile(windows, (self.room.skies.hours, 1))
        zone, tables = self.zone.zone, self.room.operation
        solar = per_window(replace(solar, state=of_windows), zone)
        if tables is None:
            return ZoneHeat(solar, zone.gains, np.zeros(self.room.skies.hours))
        plane = None
        if tables.gains.dims:
            lit = self.room.skies.whole_year(self.sensors_lx(states)).T
            plane = lamp_daylight(tables, self.light.scene.points[: lit.shape[1]], lit)
        area = self.room.space.floor_area
        zone, lamps = operated(zone, tables, area, self.room.weather, plane)
        return ZoneHeat(solar, zone.gains, lamps)

    @cached_property
    def by_file(self) -> RoomInputs:
        """The room as its operation file controls it."""
        return replace(self.room, controller=None)

    def by_rules(self, met: Levels) -> StateArray:
        """States of the control groups by the rules of the operation file [H, N]."""
        states = shading_states(self.by_file, self.light, self.outdoors, met=met)
        return self.by_file.shading(states).states

    def number_of(self, states: Sequence[int]) -> int:
        """The number of a combination of states [N] among `combinations`."""
        return int(np.ravel_multi_index(tuple(states), self.counts))

    @cached_property
    def _surfaces(self) -> ZoneSurfaces:
        return zone_surfaces(self.room)

    def _of_groups(self, values: FloatArray) -> FloatArray:
        """The greatest value [H, N] of the window groups [H, G] of each control group."""
        numbers = self.room.windows.control
        return np.stack([values[:, numbers == c].max(axis=1) for c in range(len(self.groups))], 1)

    def _rows(self, states: tuple[int, ...]) -> StateArray:
        whole = np.tile(self.of_windows(states), (self.room.skies.hours, 1))
        return self.light.states(whole)

    def _view(self, seat: Seat) -> PhaseLight | SeasonalLight:
        if seat not in self._views:
            light = self.light.light
            if seat != (None, None):
                view = seat_view(self.room, seat, self.light.scene.eye)
                light = with_view(light, view)
            self._views[seat] = light
        return self._views[seat]
