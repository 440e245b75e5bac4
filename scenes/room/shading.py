"""The shading state of each window group in every hour, by the rules of a room's control groups."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
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
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.fenestration.sight import sight_through
from scenes.fenestration.systems import FenestrationSystem
from scenes.results import day_numbers
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation import OperationHours, SharedYear
from scenes.room.shading_rules import (
    JOINT_RULES,
    LOAD_RULES,
    MOST_CONDITIONS,
    ROOM_RULES,
    WAITS,
    WEATHER_RULES,
    ShadingRule,
)
from scenes.room.solar import SeasonalOutdoors, window_irradiance
from scenes.room.window_sensors import facade_illuminance, roof_irradiance, window_beam
from thermal.control import (
    Condition,
    RoomCondition,
    WaitingRule,
    always,
    by_cut_off,
    by_glare,
    by_threshold,
    combinations_of,
    delayed,
    held,
    latched,
    levels_of,
    sun_depth,
    with_few_moves,
)
from thermal.occupants import arrivals, haldi_robinson_2010, lightswitch_2002

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.int64]
MOST_COMBINATIONS = 1024  # of states of groups that avoid glare together
# An eye: position [m] and azimuth of the line of sight [deg] from north by east, None of the view
Seat = tuple[tuple[float, float, float] | None, float | None]


def control_signals(room: RoomInputs) -> frozenset[str]:
    """The computed quantities that the rules of a room's windows read.

    "irradiance" of the windows, "sun" on them, "eye": illuminance at an eye, "dgp" of every hour,
    "plane": daylight of the work plane, "direct": direct sun on it.
    """
    if room.operation is None or room.controller is not None:
        return frozenset()
    leaves = (leaf for rule in room.control.rules for leaf in rule.leaves)
    return frozenset(map(signal_of, leaves)) - {""}


def signal_of(rule: ShadingRule) -> str:
    """The computed quantity that a rule reads; "": none but the weather."""
    if rule.rule == "glare":
        return "eye" if rule.limit_dgp is None else "dgp"
    if rule.rule == "manual":
        return "plane" if rule.behaviour == "Haldi-Robinson" else "direct"
    if rule.rule in JOINT_RULES:
        return "plane"
    if rule.sensor != "window":
        return ""
    return {"irradiance": "irradiance", "cut-off": "sun", "sun depth": "sun"}.get(rule.rule, "")


def predicts(room: RoomInputs) -> bool:
    """Whether the shading of a room follows plans of the hours ahead."""
    if room.operation is None or room.controller is not None or not room.space.windows:
        return False
    return any(rule.rule == "predictive" for rule in room.control.rules)


Levels = Mapping[Condition, int]  # of conditions: 1 met, 0 not; of a rule that waits its own
NO_CONDITIONS: Levels = {}


def temperature_conditions(room: RoomInputs) -> tuple[RoomCondition, ...]:
    """The distinct conditions of a room's temperature that its rules read.

    Raises: `DataError` for more than `MOST_CONDITIONS`, or a rule by a load that the room has not.
    """
    if room.operation is None or room.controller is not None or not room.space.windows:
        return ()
    leaves = [leaf for rule in room.control.rules for leaf in rule.leaves]
    for kind in LOAD_RULES:
        needed = f"{kind}_c"
        if any(leaf.rule == kind for leaf in leaves) and (getattr(room.operation.loads, needed) is None):
            message = f'the rule "{kind}" needs a set point: the room has no ideal {kind}'
            raise DataError(message, element=room.space.label, field=f"loads.{needed}")
    step_h = room.weather.step_h
    by_room = (condition_of(leaf, step_h) for leaf in leaves if leaf.rule in ROOM_RULES)
    conditions = tuple(dict.fromkeys(by_room))
    if len(conditions) > MOST_CONDITIONS:
        message = f"{len(conditions)} limits of the room's temperature; at most {MOST_CONDITIONS}"
        raise DataError(message, element=room.space.label, field="control")
    return conditions


def room_conditions(
    room: RoomInputs, light: RoomLight | None, outdoors: SeasonalOutdoors | None
) -> tuple[tuple[Condition, ...], tuple[Condition, ...]]:
    """All conditions of a room's temperature, and those that the states of its windows follow from.

    A rule that combines conditions and waits is one of them: its levels are its states, and what it
    asks for is tabulated for those conditions that it reads itself.

    Raises: `DataError` where more than 2^`MOST_CONDITIONS` combinations would be computed.
    """
    conditions: list[Condition] = list(temperature_conditions(room))
    if not conditions:
        return (), ()
    rules, places = room.control.rules, room.control.places
    signals, waiting = _Signals(room, outdoors, NO_CONDITIONS), dict[str, WaitingRule]()
    step_h, read = room.weather.step_h, dict[Condition, None]()
    for c in range(len(rules)):
        for rule, place in _waiting_parts(rules[c], places[c], step_h):
            reads = dict.fromkeys(
                one
                for inner, at in list(_parts(rule, place)) or [(rule, place)]
                for one in _reads(inner, at, c, waiting, step_h)
            )
            one = _waiting_rule(room, c, (rule, place), tuple(reads), signals)
            waiting[one.name] = one
            conditions.append(one)
        read |= dict.fromkeys(_reads(rules[c], places[c], c, waiting, step_h))
    _bounded(room, read)
    return tuple(conditions), tuple(read)


def _bounded(room: RoomInputs, conditions: Iterable[Condition]) -> None:
    count, most = combinations_of(tuple(conditions)), 2**MOST_CONDITIONS
    if count > most:
        message = f"its rules by the room's temperature have {count} combinations of states, at "
        message += f"most {most} are computed: let fewer parts wait, or more windows move together"
        raise DataError(message, element=room.space.label, field="control")


def _waiting_rule(
    room: RoomInputs, c: int, at: tuple[ShadingRule, str], read: tuple[Condition, ...], signals: _Signals
) -> WaitingRule:
    """A rule of control group c, at a place of its file, as a condition that waits."""
    (rule, place), asked, reasons = at, [], tuple(dict.fromkeys(_reasons(at[0])))
    _bounded(room, read)
    for number in range(combinations_of(read)):
        signals.met = dict(zip(read, levels_of(number, read), strict=True))
        asked.append(_by_rule(room, c, signals, {}, reasons, at=at, at_once=place)[0])
    states, levels = np.unique(np.stack(asked), return_inverse=True)
    return WaitingRule(
        _waiting_name(c, place),
        read,
        tuple(states.tolist()),
        levels.reshape(len(asked), -1),
        *_waits(rule, room.weather.step_h),
    )


def _waiting_name(c: int, place: str) -> str:
    return f"group {c}, {place}"


def _parts(rule: ShadingRule, place: str) -> Iterator[tuple[ShadingRule, str]]:
    """The parts of a rule with their places in the file."""
    for n, inner in enumerate(rule.parts):
        yield inner, f"{place}.parts.{n}"


def _waiting_parts(rule: ShadingRule, place: str, step_h: float) -> Iterator[tuple[ShadingRule, str]]:
    """The rules that combine or turn conditions of the room, and wait; inner ones first."""
    if rule.rule not in ("any", "all") and not rule.inverse:
        return
    for inner, at in _parts(rule, place):
        yield from _waiting_parts(inner, at, step_h)
    if any(_waits(rule, step_h)) and any(leaf.rule in ROOM_RULES for leaf in rule.leaves):
        yield rule, place


def _reads(
    rule: ShadingRule, place: str, c: int, waiting: Mapping[str, WaitingRule], step_h: float
) -> Iterator[Condition]:
    """The conditions that a rule's states follow from, without those within rules that wait."""
    name = _waiting_name(c, place)
    if name in waiting:
        yield waiting[name]
    elif rule.rule in ROOM_RULES:
        yield condition_of(rule, step_h)
    elif rule.rule in ("any", "all"):
        for inner, at in _parts(rule, place):
            yield from _reads(inner, at, c, waiting, step_h)


def condition_of(rule: ShadingRule, step_h: float) -> RoomCondition:
    """The condition of a rule by the room's temperature, for weather in steps of so many hours."""
    rows, quantity = _waits(rule, step_h), ROOM_RULES[rule.rule]
    if rule.inverse:
        rows = 0, 0  # windows open where it is met: the rule waits, see `_waiting_parts`
    if rule.rule in LOAD_RULES:
        return RoomCondition(rule.close_above_w, rule.close_above_w, quantity, *rows)
    return RoomCondition(rule.closes_above_c, rule.opens_below_c, quantity, *rows)


def _waits(rule: ShadingRule, step_h: float) -> tuple[int, int]:
    """Steps of the weather that a rule waits before it opens, and between two moves."""
    return round(rule.open_delay_h / step_h), round(rule.hold_h / step_h)


@dataclass(frozen=True, slots=True)
class RuledYear:
    """The states of the control groups in every hour by their rules, and what moved them."""

    states: StateArray  # [H, N]
    moved_by: StateArray  # [H, N] number of the reason of each move; -1: none
    reasons: tuple[str, ...]


def shading_states(
    room: RoomInputs,
    light: RoomLight | None = None,
    outdoors: SeasonalOutdoors | None = None,
    *,
    met: Levels = NO_CONDITIONS,
    progress: Progress = silent,
) -> StateArray:
    """The shading state of each window group in every hour [H, G]; see `ruled_year`."""
    ruled = ruled_year(room, light, outdoors, met=met, progress=progress)
    return ruled.states[:, room.windows.control]


def ruled_year(
    room: RoomInputs,
    light: RoomLight | None = None,
    outdoors: SeasonalOutdoors | None = None,
    *,
    met: Levels = NO_CONDITIONS,
    progress: Progress = silent,
) -> RuledYear:
    """The states of a room's control groups by their rules.

    Args:
        light: for the signals "eye", "dgp", "plane" and "direct"; outdoors: for "irradiance".
        met: the levels of the second part of `room_conditions`.
    """
    operation, rules = room.operation, room.control.rules
    states = np.zeros((room.skies.hours, len(room.control.names)), dtype=np.int64)
    if operation is None or not room.space.windows:
        return RuledYear(states, np.full_like(states, -1), ())
    signals, moved_by = _Signals(room, outdoors, met), np.full_like(states, -1)
    followed = room.followed
    known_reasons = (one for year in followed.values() for one in year.reasons)
    reasons = tuple(dict.fromkeys((*(one for rule in rules for one in _reasons(rule)), *known_reasons)))

    def reading(kinds: Sequence[str]) -> NDArray[np.int64]:
        found = [c for c, r in enumerate(rules) if any(leaf.rule in kinds for leaf in r.leaves)]
        return np.array(found, dtype=np.int64)

    def rule_of(c: int, known: Mapping[str, StateArray]) -> None:
        states[:, c], moved_by[:, c] = _by_rule(room, c, signals, known, reasons)

    joint, manual = reading(JOINT_RULES), reading(("manual",))
    if light is None and len(joint) + len(manual):
        raise ValueError("rules against glare, by daylight or by people need the room's light")
    by_people: dict[int, StateArray] = {}
    for c in range(len(rules)):
        if c in followed:
            states[:, c], moved_by[:, c] = followed[c].states, _renumbered(followed[c], reasons)
        elif c not in joint and c not in manual:
            rule_of(c, {})
    if light is not None and len(manual):
        by_people = _by_people(room, light, states, manual)
        for c in set(manual.tolist()) - set(joint.tolist()):
            rule_of(c, {"manual": by_people[c]})
    if light is not None and len(joint):
        _take_jointly(room, light, states, joint, progress)
        for c in joint.tolist():
            known = {kind: states[:, c].copy() for kind in JOINT_RULES}
            rule_of(c, known | ({"manual": by_people[c]} if c in by_people else {}))
    return RuledYear(states, moved_by, reasons)


def _renumbered(year: SharedYear, reasons: Sequence[str]) -> StateArray:
    """The number of the reason of each move [H] of a year, among `reasons`; -1: none."""
    numbers = np.array([*map(reasons.index, year.reasons), -1], dtype=np.int64)
    moved: StateArray = np.where(_moves(year.states), numbers[year.moved_by], -1)
    return moved


def _reasons(rule: ShadingRule) -> Iterator[str]:
    """What may move windows by a rule: its conditions, and the keys that make them wait."""
    if rule.rule in ("any", "all"):
        for one in rule.parts:
            yield from _reasons(one)
    else:
        yield rule.rule
    yield from (key for key in WAITS if getattr(rule, key))


def _by_rule(
    room: RoomInputs,
    c: int,
    signals: _Signals,
    known: Mapping[str, StateArray],
    reasons: Sequence[str],
    *,
    at: tuple[ShadingRule, str] | None = None,
    at_once: str = "",
) -> tuple[StateArray, StateArray]:
    """The states of a control group by its rule [H], and the number of the reason of each move [H].

    Args: known: its states [H] by the kinds of rules of which several groups take theirs together;
        at: a rule in it with its place in the file; at_once: the place of a rule that does not
        wait.
    """
    by_name = {one.name: one for one in signals.met if isinstance(one, WaitingRule)}
    groups, operation = np.flatnonzero(room.windows.control == c), room.operation
    hours = room.skies.hours

    def plain(rule: ShadingRule, place: str) -> StateArray:
        if rule.rule in known:
            return known[rule.rule]
        closed = rule.state or room.windows.states_of(c) - 1
        if rule.rule in ("schedule", *WEATHER_RULES) and operation is not None:
            of_hours = OperationHours(operation, room.weather)
            return of_hours.states(rule, place, room.windows.states, closed)
        if rule.rule in ROOM_RULES:
            met = signals.met[condition_of(rule, room.weather.step_h)]
            return always(closed if met else 0, hours)
        if rule.rule == "irradiance":
            brightest = signals.irradiance(rule.sensor)[:, groups].max(axis=1)
            return by_threshold(brightest, rule.close_above, rule.open_below, closed=closed)
        if rule.rule == "illuminance":
            brightest = signals.illuminance(rule.sensor)[:, groups].max(axis=1)
            lower = rule.opens_below_lx
            return by_threshold(brightest, rule.closes_above_lx, lower, closed=closed)
        if rule.rule == "predictive":
            raise ValueError("plans are made of the room's light: predictive_states")
        if rule.rule == "cut-off":
            return _by_cut_off(room, rule, groups, signals.beam(rule.sensor))
        if rule.rule == "sun depth":
            return _by_sun_depth(room, rule, groups, signals.beam(rule.sensor)) * closed
        return always(rule.state, hours)

    def of(rule: ShadingRule, place: str) -> tuple[StateArray, StateArray]:
        waiting = by_name.get(_waiting_name(c, place))
        if waiting is not None:
            states = always(waiting.states[signals.met[waiting]], hours)
            return states, np.full(hours, -1)
        if rule.rule in ("any", "all"):
            parts = [of(*one) for one in _parts(rule, place)]
            states, by = combined_states(rule.rule == "any", parts)
        else:
            states = plain(rule, place)
            if rule.inverse:
                states = np.where(states > 0, 0, rule.state or room.windows.states_of(c) - 1)
            by = np.where(_moves(states), reasons.index(rule.rule), -1)
        return (states, by) if place == at_once else waited_states(room, rule, states, by, reasons)

    return of(*(at or (room.control.rules[c], room.control.places[c])))


def waited_states(
    room: RoomInputs, rule: ShadingRule, states: StateArray, by: StateArray, reasons: Sequence[str]
) -> tuple[StateArray, StateArray]:
    """States that a rule asks for [H] as it waits, and the number of the reason of each move [H].

    Args: by: the reasons of the moves that are asked for, as numbers of `reasons`.
    """
    wait, hold = _waits(rule, room.weather.step_h)
    few = rule.most_moves or 1
    changes: dict[str, Callable[[StateArray], StateArray]] = {
        "open_delay_h": lambda one: delayed(one, wait),
        "hold_h": lambda one: held(one, hold),
        "until": lambda one: latched(one, _ends(room, rule.until)),
        "most_moves": lambda one: with_few_moves(one, few, days(room)),
    }
    for key in WAITS:
        if getattr(rule, key):
            waited = changes[key](states)
            same = _moves(states) & (waited == states)
            by = np.where(_moves(waited), np.where(same, by, reasons.index(key)), -1)
            states = waited
    return states, by


def _moves(states: StateArray) -> NDArray[np.bool_]:
    """Hours [H] whose state is not that of the hour before."""
    return np.concatenate([[False], states[1:] != states[:-1]])


def combined_states(closed: bool, parts: Sequence[tuple[StateArray, StateArray]]) -> tuple[StateArray, StateArray]:
    """The most closed, or most open, states of parts [H], and the reason of each move [H].

    The part that has the extreme after a move towards it, or before one away from it, moves then.
    """
    states, by = np.stack([one for one, _ in parts]), np.stack([one for _, one in parts])
    extreme = states.max(axis=0) if closed else states.min(axis=0)
    number = states.argmax(axis=0) if closed else states.argmin(axis=0)
    change = np.concatenate([[0], np.diff(extreme)])
    before = np.concatenate([number[:1], number[:-1]])
    towards = change > 0 if closed else change < 0
    chosen = by[np.where(towards, number, before), np.arange(by.shape[1])]
    return extreme, np.where(change != 0, chosen, -1)


def days(room: RoomInputs) -> NDArray[np.int64]:
    """Number of the day of each hour [H], by the weather's local standard time."""
    return day_numbers(room.weather.midpoints)


def _ends(room: RoomInputs, until: str) -> NDArray[np.bool_]:
    """Hours [H] in which windows may open that a rule has closed until some event."""
    if until == "sunset":
        return ~is_up(sun_directions(room.weather))
    if until == "midnight":
        return np.concatenate([[True], np.diff(days(room)) != 0])
    if until == "sunrise":
        up = is_up(sun_directions(room.weather))
        return np.concatenate([up[:1], up[1:] & ~up[:-1]])
    return arrivals(room.occupied, days(room))


class _Signals:
    """What rules read of the window groups, computed once."""

    def __init__(self, room: RoomInputs, outdoors: SeasonalOutdoors | None, met: Levels) -> None:
        self._room, self._outdoors, self.met = room, outdoors, met
        self._values: dict[tuple[str, str], FloatArray] = {}

    def irradiance(self, sensor: str) -> FloatArray:
        """Irradiance [H, G] [W/m2]."""
        return self._once(("irradiance", sensor), self._irradiance)

    def beam(self, sensor: str) -> FloatArray:
        """The sun's direct irradiance [H, G] [W/m2]."""
        return self._once(("beam", sensor), lambda at: window_beam(self._room, shaded=at == "window"))

    def _once(self, key: tuple[str, str], compute: Callable[[str], FloatArray]) -> FloatArray:
        if key not in self._values:
            self._values[key] = compute(key[1])
        return self._values[key]

    def illuminance(self, sensor: str) -> FloatArray:
        """Illuminance of a sensor in the middle of the glass [H, G] [lx]."""
        return self._once(("illuminance", sensor), lambda at: facade_illuminance(self._room, at))

    def _irradiance(self, sensor: str) -> FloatArray:
        if sensor != "window":
            return roof_irradiance(self._room, horizontal=sensor == "horizontal")
        if self._outdoors is None:
            raise ValueError("the rule by irradiance needs the room's outdoors")
        return window_irradiance(self._outdoors, self._room.skies)


def _by_cut_off(room: RoomInputs, rule: ShadingRule, groups: NDArray[np.int64], beam: FloatArray) -> StateArray:
    """The state that stops the sun on all of some window groups [H], each by its profile angle."""
    sun = sun_directions(room.weather)
    each = [
        by_cut_off(
            sun @ room.windows.groups[g].frame.T,
            beam[:, g],
            _tilts(rule, room.windows.systems[g]),
            rule.slat_width,
            rule.slat_spacing,
        )
        for g in groups
    ]
    states: StateArray = np.max(each, axis=0)
    return states


def _tilts(rule: ShadingRule, states: Sequence[FenestrationSystem]) -> FloatArray:
    """The slat tilt [J] [rad] by a rule, else by the systems."""
    stated = rule.slat_tilts_deg
    return np.radians(np.array(stated) if stated else slat_tilts_deg(states))


def slat_tilts_deg(states: Sequence[FenestrationSystem]) -> FloatArray:
    """The slat tilt of each state [J] [deg]; NaN without slats, or raised."""
    return np.array([np.nan if s.tilt_deg is None else s.tilt_deg for s in states], dtype=float)


def _by_sun_depth(room: RoomInputs, rule: ShadingRule, groups: NDArray[np.int64], beam: FloatArray) -> StateArray:
    """1 where the sun reaches deeper into the room than a rule allows [H], else 0."""
    sun = sun_directions(room.weather)
    floor = min(face.triangles[..., 2].min() for face in room.space.faces)
    result = np.zeros(len(sun), dtype=np.int64)
    for g in groups:
        group = room.windows.groups[g]
        corners = np.concatenate([w.triangles.reshape(-1, 3) for w in group.windows])
        depth = sun_depth(sun, group.frame[2], corners, floor + rule.plane_height_m)
        result |= (depth > rule.deepest_m) & (beam[:, g] > rule.beam_above)
    return result


def _by_people(
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


def _take_jointly(
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
