"""Shading control: which state of a window holds in every hour, and the sun of that state.

State 0 is the open one; higher numbers are more closed.  The optical and the thermal state switch
together: `switched` picks the sun, and hands the state to the heat balance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.climate import Solar
from thermal.errors import require
from thermal.zone import Gains

StateArray = NDArray[np.int64]


def always(state: int, hours: int) -> StateArray:
    """The same state in every hour [H]."""
    require(state >= 0, "shading state", f"is negative: {state}")
    return np.full(hours, state, dtype=np.int64)


def by_schedule(day: ArrayLike, hours: int) -> StateArray:
    """The states of a day's 24 hours, repeated [H]."""
    profile = np.asarray(day, dtype=np.int64)
    require(profile.shape == (24,), "shading schedule", f"expected 24 states, got {profile.shape}")
    return np.resize(profile, hours)


def by_threshold(
    values: ArrayLike, close_above: float, open_below: float | None = None, *, closed: int = 1
) -> StateArray:
    """Closed [H] when a value, such as the facade's irradiance, is above a threshold.

    Once closed it opens below `open_below` (default: the same threshold).
    """
    e = np.asarray(values, dtype=float)
    lower = close_above if open_below is None else open_below
    require(lower <= close_above, "shading control", "opens at a greater value than it closes at")
    state = np.zeros(len(e), dtype=np.int64)
    shut = False
    for hour, value in enumerate(e):
        shut = value > close_above or (shut and lower <= value and lower < close_above)
        state[hour] = closed if shut else 0
    return state


def by_glare(closure: ArrayLike, excess: Callable[[int, StateArray], NDArray[np.float64]], hours: int) -> StateArray:
    """The most open combination of states [H] without glare; the last one where none has none.

    Of equally open ones the one with the least glare. Combinations are rated only in the hours in
    which each more open one has glare.

    Args:
        closure: [M] of each combination; the last is the most closed.
        excess: of a combination and some hours [h]: glare beyond its limit [h], negative below it.
    """
    steps = np.round(np.asarray(closure, dtype=float), 9)
    chosen = np.full(hours, len(steps) - 1, dtype=np.int64)
    left = np.arange(hours)
    for step in np.unique(steps):
        equal = np.flatnonzero(steps == step)
        values = np.stack([excess(int(one), left) for one in equal])
        best, fine = values.argmin(axis=0), values.min(axis=0) < 0
        chosen[left[fine]] = equal[best[fine]]
        left = left[~fine]
        if not len(left):
            break
    return chosen


# what a room's condition reads: temperatures [degC], power that cools or heats it [W]
ROOM_QUANTITIES = ("air", "operative", "cooling", "heating")


@dataclass(frozen=True, slots=True)
class RoomCondition:
    """Met once a room's temperature or load at the end of the step before is above a limit.

    Until it is below the other.
    """

    above: float  # [degC] or [W]
    below: float
    quantity: str = "air"  # of ROOM_QUANTITIES
    open_delay_rows: int = 0  # hours that it stays met after the quantity has left it: `delayed`
    hold_rows: int = 0  # least number of hours between two changes: `held`

    def __post_init__(self) -> None:
        require(self.quantity in ROOM_QUANTITIES, "shading control", f"no {self.quantity!r}")
        fits = self.below <= self.above
        require(fits, "shading control", "opens at a greater value than it closes at")

    @property
    def levels(self) -> int:
        """Number of its levels: not met, met."""
        return 2


@dataclass(frozen=True, slots=True, eq=False)
class WaitingRule:
    """A rule that combines conditions, and waits before its state changes.

    Its level is the number of its state among those that it has in the year, from the most open.
    """

    name: str
    reads: tuple[Condition, ...]
    states: tuple[int, ...]  # of the windows, by level
    asked: StateArray  # [A, H] level by `number_of` the levels of `reads`, as if it did not wait
    open_delay_rows: int = 0  # as of `RoomCondition`
    hold_rows: int = 0

    def __post_init__(self) -> None:
        fits = len(self.asked) == combinations_of(self.reads)
        require(fits, "shading control", "expected states for all levels of what a rule reads")

    @property
    def levels(self) -> int:
        """Number of its levels."""
        return len(self.states)


Condition = RoomCondition | WaitingRule


def combinations_of(conditions: Sequence[Condition]) -> int:
    """Number of combinations of the levels of conditions."""
    return int(np.prod([one.levels for one in conditions], dtype=np.int64))


def number_of(levels: Sequence[int], conditions: Sequence[Condition]) -> int:
    """The number of a combination of levels; the first condition's level changes first."""
    return int(np.dot(levels, strides(conditions))) if conditions else 0


def strides(conditions: Sequence[Condition]) -> StateArray:
    """What a level of each condition [K] adds to the number of a combination."""
    counts = [1, *(one.levels for one in conditions)][: len(conditions)]
    return np.cumprod(counts, dtype=np.int64)


def levels_of(number: int, conditions: Sequence[Condition]) -> tuple[int, ...]:
    """The level of each condition in the combination of a number."""
    steps = strides(conditions)
    return tuple(number // int(step) % one.levels for one, step in zip(conditions, steps, strict=True))


@dataclass(frozen=True, slots=True)
class TemperatureControl:
    """Sun and gains of a zone by the levels of conditions of its temperature in each hour.

    The heat balance chooses, from an alternative for each combination of the levels of `read`.
    """

    conditions: tuple[Condition, ...]  # those that a rule reads before it
    suns: tuple[Solar, ...]
    gains: tuple[Gains, ...]
    read: tuple[Condition, ...] | None = None  # None: all conditions

    def __post_init__(self) -> None:
        count = combinations_of(self.chosen_by)
        fits = len(self.suns) == len(self.gains) == count > 1
        require(fits, "shading control", "expected an alternative for all conditions met or not")
        for k, one in enumerate(self.conditions):
            if isinstance(one, WaitingRule):
                fits = all(read in self.conditions[:k] for read in one.reads)
                require(fits, "shading control", "a rule reads a condition that comes after it")

    @property
    def chosen_by(self) -> tuple[Condition, ...]:
        """The conditions whose levels number the alternatives."""
        return self.conditions if self.read is None else self.read


def profile_angle(sun_local: ArrayLike) -> NDArray[np.float64]:
    """Angle [H] [rad] of the sun above the horizon in the plane across horizontal slats.

    sun_local: [H, 3] to the sun in the window frame (y up, z outward); pi/2 behind the facade.
    """
    s = np.asarray(sun_local, dtype=float)
    return np.where(s[:, 2] > 0, np.arctan2(s[:, 1], np.maximum(s[:, 2], 1e-12)), np.pi / 2)


def cut_off_angle(tilt: ArrayLike, width: float, spacing: float) -> NDArray[np.float64]:
    """Profile angle [...] [rad] from which on slats let no direct sun pass between them.

    tan(phi) = (spacing/width - sin(tilt))/cos(tilt), tilt [rad] positive when the slats close
    towards the sky: the shadow width (sin tilt + cos tilt tan phi) then covers the spacing.
    """
    require(width > 0 and spacing > 0, "slats", "width and spacing must be positive")
    beta = np.asarray(tilt, dtype=float)
    return np.arctan2(spacing / width - np.sin(beta), np.cos(beta))


def by_cut_off(sun_local: ArrayLike, beam: ArrayLike, tilts: ArrayLike, width: float, spacing: float) -> StateArray:
    """The most open slat tilt [H] that stops the beam; the last one where none does.

    Args: sun_local: [H, 3]; beam: [H] on the facade [W/m2] (0: slats stay open); tilts: [J] [rad]
        of the states, from open to closed; NaN: no slats, which stop nothing.
    """
    limits = cut_off_angle(tilts, width, spacing)
    limits = np.where(np.isnan(limits), np.inf, limits)
    stops = profile_angle(sun_local)[None, :] >= limits[:, None]
    state = np.where(stops.any(axis=0), stops.argmax(axis=0), len(limits) - 1)
    return np.where(np.asarray(beam, dtype=float) > 0, state, 0).astype(np.int64)


def delayed(states: StateArray, rows: int) -> StateArray:
    """States [H] that open only after a more open one has been asked for in `rows` rows before.

    The most closed state of these rows and the row itself; closing is not delayed.
    """
    result = states.copy()
    for row in range(1, rows + 1):
        result[row:] = np.maximum(result[row:], states[:-row])
    return result


def held(states: StateArray, rows: int) -> StateArray:
    """States [H] of which each holds for at least `rows` rows."""
    if rows <= 1 or not len(states):
        return states
    result, moved = states.copy(), -rows  # the first state may end at once
    for row in range(1, len(states)):
        result[row] = result[row - 1]
        if states[row] != result[row] and row - moved >= rows:
            result[row], moved = states[row], row
    return result


def latched(states: StateArray, ends: ArrayLike) -> StateArray:
    """States [H] that close at any time, but open in some hours only.

    Args: ends: [H] hours in which a more open state may be taken.
    """
    result, free = states.copy(), np.asarray(ends, dtype=bool)
    for row in range(1, len(states)):
        if not free[row]:
            result[row] = max(result[row], result[row - 1])
    return result


def with_few_moves(states: StateArray, most: int, day: NDArray[np.int64]) -> StateArray:
    """States [H] that change at most so often in each day; after that they stay until its end.

    Args: day: [H] number of the day of each row.
    """
    result, moves = states.copy(), 0
    for row in range(1, len(states)):
        if day[row] != day[row - 1]:
            moves = 0
        if moves >= most:
            result[row] = result[row - 1]
        elif states[row] != result[row - 1]:
            moves += 1
    return result


def sun_depth(sun: ArrayLike, outwards: ArrayLike, corners: ArrayLike, plane: float) -> NDArray[np.float64]:
    """Distance from a window's foot to which the sun reaches on a level plane [H] [m].

    Each corner c of the glass casts a spot at c - s (c_z - plane)/s_z; the depth is the distance of
    the farthest one from the foot of the window, along the level direction into the room.  Walls
    that stop it are not considered.  0 for a sun behind the facade or below the horizon; infinite
    for a window that looks straight up, which has no foot.

    Args:
        sun: [H, 3] directions to it; outwards: [3] the window's normal; corners: [N, 3] [m].
        plane: height of the plane [m].
    """
    s, normal = np.asarray(sun, dtype=float), np.asarray(outwards, dtype=float)
    points = np.asarray(corners, dtype=float)
    level = np.hypot(normal[0], normal[1])
    shines = (s @ normal > 0) & (s[:, 2] > 0)
    if level < 1e-6:
        return np.where(shines, np.inf, 0.0)
    inwards = -np.array([normal[0], normal[1], 0.0]) / level
    foot = (points @ inwards).min()
    above = np.maximum(points[:, 2] - plane, 0.0)
    slope = np.where(shines, -(s @ inwards) / np.where(shines, s[:, 2], 1.0), 0.0)
    reached = points @ inwards - foot + slope[:, None] * above
    return np.where(shines, np.maximum(reached.max(axis=1), 0.0), 0.0)


def switched(suns: Sequence[Solar], chosen: ArrayLike, states: ArrayLike | None = None) -> Solar:
    """The sun of the chosen combination of states in every hour.

    Args:
        suns: the sun in each combination, alike in shape.
        chosen: [H] index of the combination.
        states: [H, W] state of each window; by default the index, of all windows.
    """
    choice = np.asarray(chosen, dtype=np.int64)
    require(len(suns) > 0, "shading states", "there is none")
    rows, windows = suns[0].absorbed_outer.shape
    fits = len(choice) > 0 and rows % len(choice) == 0
    require(fits, "shading state", f"{len(choice)} hours do not fit {rows} rows of sun")
    inside = bool(np.all((choice >= 0) & (choice < len(suns))))
    require(inside, "shading state", f"expected 0 to {len(suns) - 1}")
    at = np.repeat(choice, rows // len(choice))

    def pick(name: str) -> NDArray[np.float64] | None:
        arrays = [getattr(s, name) for s in suns]
        if any(a is None for a in arrays):
            return None
        same = all(a.shape == arrays[0].shape for a in arrays)
        require(same, f"solar {name}", "the combinations differ in shape")
        return np.stack(arrays)[at, np.arange(rows)]

    names = ("absorbed_outer", "absorbed_inner", "absorbed_middle", "inside", "facade")
    parts: dict[str, Any] = {name: pick(name) for name in (*names, "window_inside", "window_facade")}
    of_windows = np.repeat(choice[:, None], windows, axis=1) if states is None else states
    return Solar(**parts, state=np.asarray(of_windows, dtype=np.int64))
