"""The shading state of control groups by rules that read the room's light: of people, against glare, by daylight."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import SeasonalLight, direct_sun_by_group, eye_illuminance, illuminance, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.metrics.lm83 import blinds_operated
from mitsuba_cfs.progress import Progress, part
from scenes.fenestration.sight import sight_through
from scenes.results import day_numbers
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation import OperationHours
from scenes.room.shading_rules import JOINT_RULES, ShadingRule
from scenes.room.window_sensors import facade_illuminance
from thermal.control import by_glare
from thermal.occupants import haldi_robinson_2010, lightswitch_2002

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.int64]
MOST_COMBINATIONS = 1024  # of states of groups that avoid glare together
# An eye: position [m] and azimuth of the line of sight [deg] from north by east, None of the view
Seat = tuple[tuple[float, float, float] | None, float | None]


def states_by_people(
    room: RoomInputs, light: RoomLight, states: StateArray, manual: NDArray[np.int64]
) -> dict[int, StateArray]:
    """The states [H] of control groups that people move, by the number of the group.

    Groups with the same rule are moved by the same people.

    Args: states: [H, N] of the groups without such a rule; the others are open.
    """
    found: dict[int, StateArray] = {}
    rules: dict[tuple[object, ...], list[int]] = {}
    for c in manual.tolist():
        leaf = next(one for one in room.control.rules[c].leaves if one.rule == "manual")
        rules.setdefault((leaf.behaviour, leaf.seed, leaf.at), []).append(c)
    for members in rules.values():
        leaf = next(one for one in room.control.rules[members[0]].leaves if one.rule == "manual")
        if leaf.behaviour == "Haldi-Robinson":
            found |= _by_habit(room, light, states, members, leaf)
        else:
            found |= _by_direct_sun(room, light, members, leaf)
    return found


def _by_direct_sun(room: RoomInputs, light: RoomLight, members: list[int], rule: ShadingRule) -> dict[int, StateArray]:
    """States [H] of control groups by LM-83's rule, or of Lightswitch-2002's active user."""
    through = direct_sun_by_group(light.light)
    if through is None:
        message = f"{rule.behaviour} reads the direct sun, which the three-phase method lacks"
        raise DataError(message, element=room.space.label, field="control.behaviour")
    control, plane = room.windows.control, _plane_sensors(room, light)
    direct = np.stack(
        [np.sum([through[g][plane] for g in np.flatnonzero(control == c)], axis=0) for c in members]
    )  # [n, S, L]
    if rule.behaviour == "LM-83":
        lit = blinds_operated(list(direct.transpose(0, 2, 1))).astype(np.int64)
        closed = [room.skies.whole_year(one).astype(np.int64) for one in lit]
        return {c: one * _closed(room, c) for c, one in zip(members, closed, strict=True)}
    place = light.scene.eye.position if rule.at is None else rule.at
    nearest = int(np.argmin(np.linalg.norm(light.scene.points[plane] - np.array(place), axis=1)))
    sky, normal = room.skies, room.weather.direct_normal[room.skies.lit]
    watts = np.where(sky.illuminance > 0, normal / np.maximum(sky.illuminance, 1e-9), 0.0)
    present, day = _present(room), days(room)
    return {
        c: lightswitch_2002(sky.whole_year(of_group[nearest] * watts), present, day, closed=_closed(room, c))
        for c, of_group in zip(members, direct, strict=True)
    }


def _by_habit(
    room: RoomInputs, light: RoomLight, states: StateArray, members: list[int], rule: ShadingRule
) -> dict[int, StateArray]:
    """States [H] of control groups of which Haldi and Robinson's people lower a share.

    Light of the groups is added: that of each is known in each of its states.
    """
    counts = [room.windows.states_of(c) for c in members]

    def indoors(of_groups: StateArray) -> FloatArray:
        rows = light.states(of_groups[:, room.windows.control])
        return room.skies.whole_year(_plane_lx(room, light, rows, rule.at))

    base, more = indoors(states), []
    for c, count in zip(members, counts, strict=True):
        of_states = []
        for state in range(count):
            other = states.copy()
            other[:, c] = state
            of_states.append(indoors(other) - base)
        more.append(np.stack(of_states))  # [J, H]

    def lux(hour: int, shares: FloatArray) -> float:
        parts = (
            np.interp((1.0 - share) * (len(of) - 1), np.arange(len(of)), of[:, hour])
            for share, of in zip(shares, more, strict=True)
        )
        return float(base[hour] + sum(parts))

    level = facade_illuminance(room, "horizontal")[:, 0]
    shares = haldi_robinson_2010(
        lux,
        level,
        _present(room),
        blinds=len(members),
        seed=(rule.seed, zlib.crc32(room.space.guid.encode())),  # other people in each room
        substeps=max(round(12 * room.weather.step_h), 1),
    )
    return {c: np.rint((1.0 - shares[:, n]) * (counts[n] - 1)).astype(np.int64) for n, c in enumerate(members)}


def _closed(room: RoomInputs, c: int) -> int:
    """The last state of a control group, or that which its rule by people names."""
    leaf = next(one for one in room.control.rules[c].leaves if one.rule == "manual")
    return leaf.state or room.windows.states_of(c) - 1


def _present(room: RoomInputs) -> FloatArray:
    """Share of the people that is present [H]."""
    if room.operation is None:
        return room.occupied.astype(float)
    return OperationHours(room.operation, room.weather).present


def _plane_sensors(room: RoomInputs, light: RoomLight) -> slice:
    return slice(0, len(light.scene.points) - room.other_sensors)


def _plane_lx(
    room: RoomInputs, light: RoomLight, rows: StateArray, at: tuple[float, float, float] | None
) -> FloatArray:
    """Daylight of the work plane in the lit hours [L] [lx]: the mean, or at the nearest sensor.

    Args: rows: [G, L] states of the window groups.
    """
    plane = _plane_sensors(room, light)
    values: FloatArray = illuminance(light.light, rows)[plane].astype(float)
    if at is None:
        return values.mean(axis=0)
    return values[np.argmin(np.linalg.norm(light.scene.points[plane] - np.array(at), axis=1))]


def take_jointly(
    room: RoomInputs, light: RoomLight, states: StateArray, joint: NDArray[np.int64], progress: Progress
) -> None:
    """Set the states [H, N] of control groups to the best combination for all rules of light.

    The most open one whose glare at every seat, and whose daylight, are within their limits; for
    rules that leave a target of daylight the most closed one that does.  All other
    groups are in their states.
    """
    counts = [room.windows.states_of(c) for c in joint]
    combinations = np.array(list(product(*map(range, counts))), dtype=np.int64)
    if len(combinations) > MOST_COMBINATIONS:
        message = f"{len(joint)} groups have {len(combinations)} combinations of states, at most "
        message += f"{MOST_COMBINATIONS} are rated: let more windows move together"
        raise DataError(message, element=room.space.label, field="control.groups")
    lit = room.skies.lit
    leaves = [leaf for c in joint for leaf in room.control.rules[c].leaves]
    closure = _closure(room, joint, combinations, leaves)
    targets = [leaf for leaf in leaves if leaf.rule == "daylight"]
    limits = _limits(room, light, [leaf for leaf in leaves if leaf.rule in JOINT_RULES])
    if targets and len(targets) < len([leaf for leaf in leaves if leaf.rule in JOINT_RULES]):
        message = 'the rule "daylight" closes as far as it can, others open: not in one room'
        raise DataError(message, element=room.space.label, field="control.rule")
    if targets:  # the most closed first, the most open where none leaves the target
        combinations, closure = combinations[::-1], -closure[::-1]

    def excess(number: int, hours: NDArray[np.int64]) -> FloatArray:
        chosen = states.copy()
        chosen[:, joint] = combinations[number]
        rows = light.states(chosen[:, room.windows.control])
        steps = part(progress, number / len(combinations), (number + 1) / len(combinations), "glare control")
        return np.max([limit(rows, hours, steps) for limit in limits], axis=0)

    chosen = by_glare(closure, excess, len(lit))
    states[np.ix_(lit, joint)] = combinations[chosen]


def _closure(
    room: RoomInputs, joint: NDArray[np.int64], combinations: StateArray, leaves: Sequence[ShadingRule]
) -> FloatArray:
    """How closed each combination of states is [M], 0 to 1: the mean, weighted by glass area.

    Of each group its number among its states, or the view through that it takes away.
    """
    if any(leaf.prefer == "view" for leaf in leaves):
        return view_taken(room, joint, combinations) + 1e-3 * _mean_of_groups(room, joint, combinations)
    return _mean_of_groups(room, joint, combinations)


def view_taken(room: RoomInputs, groups: NDArray[np.int64], combinations: StateArray) -> FloatArray:
    """Share of the view out that each combination of states of control groups takes away [M].

    By the light of normal incidence that goes straight on, of that in the state with the most.
    """
    taken = []
    for c in groups.tolist():
        first = int(np.argmax(room.windows.control == c))
        seen = np.array([sight_through(one).straight for one in room.windows.systems[first]])
        taken.append(1.0 - seen / max(float(seen.max()), 1e-9))
    return _mean_of_groups(room, groups, combinations, taken)


def _mean_of_groups(
    room: RoomInputs, groups: NDArray[np.int64], combinations: StateArray, values: Sequence[FloatArray] = ()
) -> FloatArray:
    """Mean over control groups, weighted by glass area, in each combination of states [M].

    Args: values: [N][J] in each state; by default 0 for the first to 1 for the last.
    """
    windows, each, areas = room.windows, [], []
    for n, c in enumerate(groups.tolist()):
        count = room.windows.states_of(c)
        of_states = values[n] if len(values) else np.arange(count) / max(count - 1, 1)
        each.append(of_states[np.minimum(combinations[:, n], len(of_states) - 1)])
        areas.append(sum(windows.groups[g].area for g in np.flatnonzero(windows.control == c)))
    mean: FloatArray = np.stack(each, axis=1) @ (np.array(areas) / np.sum(areas))
    return mean


Excess = Callable[[StateArray, NDArray[np.int64], Progress], FloatArray]


def _limits(room: RoomInputs, light: RoomLight, rules: list[ShadingRule]) -> list[Excess]:
    """For each seat and limit of rules: glare beyond it, relative to it, in some lit hours [h]."""
    lights: dict[object, PhaseLight | SeasonalLight] = {}
    limits: dict[object, Excess] = {}
    for rule in rules:
        if rule.rule in ("work plane", "daylight"):
            level = rule.closes_above_lx if rule.rule == "work plane" else rule.target_lx
            limits[rule.rule, rule.at, level] = _excess_daylight(room, light, rule, level)
            continue
        seat = rule.seat, rule.looks_deg
        if seat not in lights:
            view = None if seat == (None, None) else seat_view(room, seat, light.scene.eye)
            lights[seat] = light.light if view is None else with_view(light.light, view)
        limit = rule.limit_dgp
        limits[seat, rule.limit_lx, limit] = (
            _excess_illuminance(lights[seat], rule.limit_lx)
            if limit is None
            else _excess_dgp(lights[seat], limit, rating_of(room.options.outputs))
        )
    return list(limits.values())


def _excess_daylight(room: RoomInputs, light: RoomLight, rule: ShadingRule, level: float) -> Excess:
    """Daylight of the work plane above a level, or below it where it is a target."""
    sign = 1.0 if rule.rule == "work plane" else -1.0

    def excess(rows: StateArray, hours: NDArray[np.int64], progress: Progress) -> FloatArray:
        values = _plane_lx(room, light, rows, rule.at)[hours].astype(np.float32)
        return sign * (values.astype(float) - level) / level

    return excess


def _excess_illuminance(light: PhaseLight | SeasonalLight, limit: float) -> Excess:
    def excess(rows: StateArray, hours: NDArray[np.int64], progress: Progress) -> FloatArray:
        values = eye_illuminance(light, rows).astype(np.float32)[hours]
        return (values.astype(float) - limit) / limit

    return excess


def _excess_dgp(light: PhaseLight | SeasonalLight, limit: float, rating: GlareOptions) -> Excess:
    def excess(rows: StateArray, hours: NDArray[np.int64], progress: Progress) -> FloatArray:
        rated = hourly_glare(light, "DGP", rows, hours=hours, options=rating, progress=progress)
        return (rated.dgp - limit) / max(limit, 1e-9)

    return excess


def seat_view(room: RoomInputs, seat: Seat, view: View) -> View:
    """The view of a seat; what it does not state is that of the room's view."""
    (position, looks_deg), direction = seat, np.asarray(view.direction)
    if looks_deg is not None:
        angle = np.radians(looks_deg)
        direction = np.array([np.sin(angle), np.cos(angle), 0.0])
    position = view.position if position is None else position
    return fisheye(position, direction, room.options.outputs.picture_size)


def days(room: RoomInputs) -> NDArray[np.int64]:
    """Number of the day of each hour [H], by the weather's local standard time."""
    return day_numbers(room.weather.midpoints)
