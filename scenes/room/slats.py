"""A room with other slats in its windows: an input of the slats a step lower and higher.

Where a system's layers give its BSDF (`scenes.fenestration.slats`), tilt, width and reflectance of the
slats are moved in all windows together. The light follows from the traced matrices, the heat from the
matrices of the sun; the shading states of each hour stay those of the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.light import SeasonalLight, eye_illuminance, illuminance
from mitsuba_cfs.methods.optics import States as OpticsStates
from mitsuba_cfs.methods.phase_light import PhaseLight, phase_light
from scenes.fenestration.slats import (
    SLAT_INPUTS,
    greatest_step,
    has_recipe,
    moved_slats,
    recipes_of,
    slat_value,
    states_g,
)
from scenes.fenestration.systems import States
from scenes.results import DaylightResult
from scenes.room.glare import rated_hours
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.shading import RuledYear
from scenes.room.solar import SeasonalOutdoors
from scenes.room.spectral import eye_illuminances
from scenes.room.zone import MovedZone, RoomZone, reads_work_plane, room_zone, zone_surfaces
from scenes.uncertain_inputs import INPUTS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SlatEnd:
    """A room with other slats."""

    room: RoomInputs
    light: RoomLight

    def illuminance(self, state: NDArray[np.int64]) -> Array:
        """Of the sensors, the eye last, in the lit hours [S + 1, L] [lx]; state: [H, G]."""
        light, rows = self.light.light, self.light.states(state)
        return np.concatenate([illuminance(light, rows), eye_illuminance(light, rows)[None]])


@dataclass(frozen=True, slots=True)
class MovedSlats:
    """A room with an input of its slats a step lower and higher."""

    key: str  # of `SLAT_INPUTS`
    value: float  # of the input, mean of the states
    step: float
    low: SlatEnd
    high: SlatEnd

    def slope(self, state: NDArray[np.int64]) -> Array:
        """Derivative of the illuminance of the sensors, the eye last [S + 1, L]; state: [H, G]."""
        slope: Array = (self.high.illuminance(state) - self.low.illuminance(state)) / (2 * self.step)
        return slope

    def dgp(self, state: NDArray[np.int64]) -> tuple[Array, Array]:
        """DGP in the lit hours [L] with the input a step lower and higher; 0 where nobody is there or no slats are."""
        room = self.low.room
        rows = state[room.skies.lit]
        slats = np.zeros(len(rows), dtype=bool)
        for states, row in zip(room.windows.systems, rows.T, strict=True):
            with_slats = np.array([has_recipe(one) for one in states])
            slats |= with_slats[np.minimum(row, len(states) - 1)]
        columns = np.flatnonzero(slats & room.occupied[room.skies.lit])
        low, high = np.zeros(len(rows)), np.zeros(len(rows))
        for end, values in ((self.low, low), (self.high, high)):
            if len(columns):
                values[columns] = rated_hours(end.room, end.light, state, "DGP", room.skies.lit[columns]).dgp
        return low, high

    def melanopic_slope(self, state: NDArray[np.int64]) -> Array:
        """Derivative of melanopic EDI at the eye by daylight in the lit hours [L] [lx]; state: [H, G]."""
        high, low = (eye_illuminances(end.room, end.light, state)[0][1] for end in (self.high, self.low))
        slope: Array = ((high - low) / (2 * self.step))[self.low.room.skies.lit]
        return slope


def room_slats(room: RoomInputs, light: RoomLight) -> Iterator[MovedSlats]:
    """The room with each input of its slats moved; none where no system has a recipe.

    Tilts are moved where all states with a stated tilt have a recipe.
    """
    systems = room.windows.systems
    recipes = recipes_of(systems)
    tilted = [one for states in systems for one in states if one.tilt_deg is not None]
    for key in SLAT_INPUTS if recipes else ():
        if key == "tilt_deg" and not all(map(has_recipe, tilted)):
            continue
        step = min(INPUTS[key].deviation, *(greatest_step(recipe, key) for recipe in recipes))
        if step <= 0:  # at the end of its range
            continue
        value = float(np.mean([slat_value(recipe, key) for recipe in recipes]))
        low, high = (_end(room, light, moved) for moved in moved_slats(systems, key, step))
        yield MovedSlats(key, value, step, low, high)


def _end(room: RoomInputs, light: RoomLight, systems: tuple[States, ...]) -> SlatEnd:
    """The room with other systems of its window groups."""
    changed = replace(room, windows=replace(room.windows, systems=systems))
    optics = changed.windows.optics()

    def of_season(one: PhaseLight) -> PhaseLight:
        inner: Sequence[OpticsStates] = one.systems[len(optics) :]
        return phase_light(one.matrices, [*optics, *inner], one.sky, reflected=one.reflected)

    whole: PhaseLight | SeasonalLight
    if isinstance(light.light, SeasonalLight):
        phases = [one for one in light.light.lights if isinstance(one, PhaseLight)]
        whole = replace(light.light, lights=tuple(map(of_season, phases)))
    else:
        whole = of_season(light.light)
    return SlatEnd(changed, replace(light, light=whole))


def moved_zones(
    slats: Sequence[MovedSlats],
    zone: RoomZone,
    outdoors: SeasonalOutdoors,
    state: NDArray[np.int64],
    daylight: DaylightResult,
    ruled: RuledYear | None,
) -> tuple[MovedZone, ...]:
    """The zone with other slats; none where a system with a recipe states its g.

    Args: zone: of the result; state: [H, G] of the window groups; daylight, ruled: as of `room_zone`.
    """
    if not slats or states_g(slats[0].low.room.windows.systems):
        return ()

    def of_end(end: SlatEnd) -> RoomZone:
        room, surfaces = end.room, zone_surfaces(end.room)

        def in_states(some: NDArray[np.int64], by: RuledYear | None) -> RoomZone:
            lit = daylight
            if reads_work_plane(room):
                values = end.illuminance(some)[: len(daylight.points)]
                lit = replace(daylight, illuminance=room.skies.whole_year(values.astype(np.float32)).T)
            return room_zone(room, surfaces, outdoors, some, lit, ruled=by)

        moved = in_states(state, ruled)
        if zone.alternatives is None:
            return moved
        states = (one.shading.states[:, room.windows.control] for one in zone.alternatives.rooms)
        rooms = tuple(in_states(some, None) for some in states)
        return replace(moved, alternatives=replace(zone.alternatives, rooms=rooms))

    return tuple(MovedZone(one.key, one.value, one.step, of_end(one.low), of_end(one.high)) for one in slats)
