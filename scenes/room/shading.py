"""The shading state of each window group in every hour, by the rules of a room's control groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation import OperationHours, SharedYear
from scenes.room.shading_by_light import days, states_by_people, take_jointly
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
    by_threshold,
    combinations_of,
    delayed,
    held,
    latched,
    levels_of,
    sun_depth,
    with_few_moves,
)
from thermal.occupants import arrivals

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.int64]


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
        by_people = states_by_people(room, light, states, manual)
        for c in set(manual.tolist()) - set(joint.tolist()):
            rule_of(c, {"manual": by_people[c]})
    if light is not None and len(joint):
        take_jointly(room, light, states, joint, progress)
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
