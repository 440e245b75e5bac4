"""The shading state of each window group in every hour, by the rules of a room's control groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bim.to_tracer import exterior_surfaces
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import SeasonalLight, eye_illuminance, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.surfaces import Surfaces, even_numbers, points_on_triangles
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from mitsuba_cfs.trace.sun.shade import sunlit_shares
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation import OperationHours
from scenes.room.operation_tables import MOST_CONDITIONS, ROOM_RULES, WEATHER_RULES, ShadingRule
from scenes.room.solar import SeasonalOutdoors, window_irradiance
from thermal.control import (
    Condition,
    TemperatureCondition,
    WaitingRule,
    always,
    by_cut_off,
    by_glare,
    by_threshold,
    combinations_of,
    delayed,
    held,
    levels_of,
)

FloatArray = NDArray[np.float64]
StateArray = NDArray[np.int64]
SUN_POINTS = 64  # on each window group, for its sunlit share
DISC_RAYS = 4  # from each of them
MOST_COMBINATIONS = 1024  # of states of groups that avoid glare together
# An eye: position [m] and azimuth of the line of sight [deg] from north by east, None of the view
Seat = tuple[tuple[float, float, float] | None, float | None]


def control_signals(room: RoomInputs) -> frozenset[str]:
    """The computed quantities that the rules of a room's windows read.

    "irradiance" of the windows, "sun" on them, "eye": illuminance at an eye, "dgp" of every hour.
    """
    if room.operation is None or room.controller is not None:
        return frozenset()
    leaves = (leaf for rule in room.control.rules for leaf in rule.leaves)
    return frozenset(map(signal_of, leaves)) - {""}


def signal_of(rule: ShadingRule) -> str:
    """The computed quantity that a rule reads; "": none but the weather."""
    if rule.rule == "glare":
        return "eye" if rule.limit_dgp is None else "dgp"
    if rule.sensor == "roof":
        return ""
    return {"irradiance": "irradiance", "cut-off": "sun"}.get(rule.rule, "")


def predicts(room: RoomInputs) -> bool:
    """Whether the shading of a room follows plans of the hours ahead."""
    if room.operation is None or room.controller is not None or not room.space.windows:
        return False
    return room.control.rules[0].rule == "predictive"


Levels = Mapping[Condition, int]  # of conditions: 1 met, 0 not; of a rule that waits its own
NO_CONDITIONS: Levels = {}


def temperature_conditions(room: RoomInputs) -> tuple[TemperatureCondition, ...]:
    """The distinct conditions of a room's temperature that its rules read.

    Raises: `DataError` for more than `MOST_CONDITIONS`.
    """
    if room.operation is None or room.controller is not None or not room.space.windows:
        return ()
    leaves = (leaf for rule in room.control.rules for leaf in rule.leaves)
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
    by_glare, read = set(_against_glare(room)), dict[Condition, None]()
    for c in sorted(range(len(rules)), key=by_glare.__contains__):
        for rule, place in _waiting_parts(rules[c], places[c], room.weather.step_h):
            reads = [
                one
                for inner, at in _parts(rule, place)
                for one in _reads(inner, at, c, waiting, room.weather.step_h)
            ]
            if any(leaf.rule == "glare" for leaf in rule.leaves):
                reads = [*read, *reads]  # it avoids glare beside the groups without this rule
            one = _waiting_rule(room, light, c, (rule, place), dict.fromkeys(reads), signals)
            waiting[one.name] = one
            conditions.append(one)
        read |= dict.fromkeys(_reads(rules[c], places[c], c, waiting, room.weather.step_h))
    _bounded(room, read)
    return tuple(conditions), tuple(read)


def _bounded(room: RoomInputs, conditions: Iterable[Condition]) -> None:
    count, most = combinations_of(tuple(conditions)), 2**MOST_CONDITIONS
    if count > most:
        message = f"its rules by the room's temperature have {count} combinations of states, at "
        message += f"most {most} are computed: let fewer parts wait, or more windows move together"
        raise DataError(message, element=room.space.label, field="control")


def _waiting_rule(
    room: RoomInputs,
    light: RoomLight | None,
    c: int,
    at: tuple[ShadingRule, str],
    reads: Iterable[Condition],
    signals: _Signals,
) -> WaitingRule:
    """A rule of control group c, at a place of its file, as a condition that waits."""
    (rule, place), read, asked = at, tuple(reads), []
    _bounded(room, read)
    for number in range(combinations_of(read)):
        signals.met = dict(zip(read, levels_of(number, read), strict=True))
        without_glare = None
        if any(leaf.rule == "glare" for leaf in rule.leaves):
            without_glare = _plain_states(room, light, signals, silent)[:, c]
        asked.append(_rule_states(room, c, at, signals, without_glare, at_once=place))
    states, levels = np.unique(np.stack(asked), return_inverse=True)
    return WaitingRule(
        _waiting_name(c, place), read, tuple(states.tolist()), levels.reshape(len(asked), -1),
        *_waits(rule, room.weather.step_h),
    )  # fmt: skip


def _waiting_name(c: int, place: str) -> str:
    return f"group {c}, {place}"


def _parts(rule: ShadingRule, place: str) -> Iterator[tuple[ShadingRule, str]]:
    """The parts of a rule with their places in the file."""
    for n, inner in enumerate(rule.parts):
        yield inner, f"{place}.parts.{n}"


def _waiting_parts(
    rule: ShadingRule, place: str, step_h: float
) -> Iterator[tuple[ShadingRule, str]]:
    """The combining rules in a rule that read the room's temperature and wait; inner ones first."""
    if rule.rule not in ("any", "all"):
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


def condition_of(rule: ShadingRule, step_h: float) -> TemperatureCondition:
    """The condition of a rule by the room's temperature, for weather in steps of so many hours."""
    operative, rows = rule.rule == "operative temperature", _waits(rule, step_h)
    return TemperatureCondition(rule.closes_above_c, rule.opens_below_c, operative, *rows)


def _waits(rule: ShadingRule, step_h: float) -> tuple[int, int]:
    """Steps of the weather that a rule waits before it opens, and between two moves."""
    return round(rule.open_delay_h / step_h), round(rule.hold_h / step_h)


def shading_states(
    room: RoomInputs,
    light: RoomLight | None = None,
    outdoors: SeasonalOutdoors | None = None,
    *,
    met: Levels = NO_CONDITIONS,
    progress: Progress = silent,
) -> StateArray:
    """The shading state of each window group in every hour [H, G].

    Args:
        light: for the signals "eye" and "dgp"; outdoors: for the signal "irradiance".
        met: the levels of the second part of `room_conditions`.
    """
    numbers, operation = room.windows.control, room.operation
    if operation is None or not room.space.windows:
        return np.zeros((room.skies.hours, len(room.control.names)), dtype=np.int64)[:, numbers]
    signals = _Signals(room, outdoors, met)
    states = _plain_states(room, light, signals, progress)
    for c in _against_glare(room):
        states[:, c] = _rule_states(room, c, _rule_of(room, c), signals, states[:, c])
    return states[:, numbers]


def _against_glare(room: RoomInputs) -> NDArray[np.int64]:
    """The control groups with a rule against glare."""
    rules = enumerate(room.control.rules)
    groups = [c for c, rule in rules if any(leaf.rule == "glare" for leaf in rule.leaves)]
    return np.array(groups, dtype=np.int64)


def _rule_of(room: RoomInputs, c: int) -> tuple[ShadingRule, str]:
    """The rule of a control group, and its place in the file."""
    return room.control.rules[c], room.control.places[c]


def _plain_states(
    room: RoomInputs, light: RoomLight | None, signals: _Signals, progress: Progress
) -> StateArray:
    """The states of all control groups [H, N]; of those against glare by these rules alone."""
    states = np.zeros((room.skies.hours, len(room.control.names)), dtype=np.int64)
    glare = _against_glare(room)
    for c in range(len(room.control.rules)):
        if c not in glare:
            states[:, c] = _rule_states(room, c, _rule_of(room, c), signals, None)
    if len(glare):
        if light is None:
            raise ValueError("the rule against glare needs the room's light")
        _avoid_glare(room, light, states, glare, progress)
    return states


def _rule_states(
    room: RoomInputs,
    c: int,
    rule_at: tuple[ShadingRule, str],
    signals: _Signals,
    without_glare: StateArray | None,
    *,
    at_once: str = "",
) -> StateArray:
    """The states of a control group by a rule of it [H].

    Args: rule_at: with its place in the file; without_glare: its states by its rules against glare
        [H]; at_once: the place of a rule that does not wait.
    """
    groups, operation = np.flatnonzero(room.windows.control == c), room.operation
    by_name = {one.name: one for one in signals.met if isinstance(one, WaitingRule)}

    def plain(rule: ShadingRule, place: str) -> StateArray:
        if rule.rule == "glare" and without_glare is not None:
            return without_glare
        closed = rule.state or group_states(room, c) - 1
        if rule.rule in ("schedule", *WEATHER_RULES) and operation is not None:
            hours = OperationHours(operation, room.weather)
            return hours.states(rule, place, room.windows.states, closed)
        if rule.rule in ROOM_RULES:
            met = signals.met[condition_of(rule, room.weather.step_h)]
            return always(closed if met else 0, room.skies.hours)
        if rule.rule == "irradiance":
            brightest = signals.irradiance(rule.sensor)[:, groups].max(axis=1)
            return by_threshold(brightest, rule.close_above, rule.open_below, closed=closed)
        if rule.rule == "predictive":
            raise ValueError("plans are made of the room's light: predictive_states")
        if rule.rule == "cut-off":
            return _by_cut_off(room, rule, groups, signals.beam(rule.sensor))
        return always(rule.state, room.skies.hours)

    def of(rule: ShadingRule, place: str) -> StateArray:
        waiting = by_name.get(_waiting_name(c, place))
        if waiting is not None:
            return always(waiting.states[signals.met[waiting]], room.skies.hours)
        if rule.rule in ("any", "all"):
            parts = [of(*one) for one in _parts(rule, place)]
            states = np.max(parts, axis=0) if rule.rule == "any" else np.min(parts, axis=0)
        else:
            states = plain(rule, place)
        if place == at_once:
            return states
        wait, hold = _waits(rule, room.weather.step_h)
        return held(delayed(states, wait), hold)

    return of(*rule_at)


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
        return self._once(
            ("beam", sensor), lambda at: window_beam(self._room, shaded=at == "window")
        )

    def _once(self, key: tuple[str, str], compute: Callable[[str], FloatArray]) -> FloatArray:
        if key not in self._values:
            self._values[key] = compute(key[1])
        return self._values[key]

    def _irradiance(self, sensor: str) -> FloatArray:
        if sensor == "roof":
            return roof_irradiance(self._room)
        if self._outdoors is None:
            raise ValueError("the rule by irradiance needs the room's outdoors")
        return window_irradiance(self._outdoors, self._room.skies)


def _by_cut_off(
    room: RoomInputs, rule: ShadingRule, groups: NDArray[np.int64], beam: FloatArray
) -> StateArray:
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


def group_states(room: RoomInputs, c: int) -> int:
    """Number of states of a control group: of its window group with the most."""
    windows = room.windows
    return max(len(windows.systems[g]) for g in np.flatnonzero(windows.control == c))


def window_beam(room: RoomInputs, *, shaded: bool) -> FloatArray:
    """The sun's direct irradiance of each window group in every hour [H, G] [W/m2].

    Args: shaded: by the surroundings; else as if there were none.
    """
    sun, groups = sun_directions(room.weather), room.windows.groups
    normals = np.stack([group.frame[2] for group in groups])
    # an hour of sunset has a beam in the weather, although the sun has set in its middle
    direct = np.where(is_up(sun), room.weather.direct_normal, 0.0)
    beam: FloatArray = direct[:, None] * np.maximum(sun @ normals.T, 0.0)
    if not shaded:
        return beam
    points = np.concatenate(
        [
            points_on_triangles(
                np.concatenate([w.triangles for w in group.windows]), even_numbers(SUN_POINTS)
            )[0]
            for group in groups
        ]
    )
    facing = np.repeat(normals, SUN_POINTS, axis=0)
    for number, season in enumerate(room.seasons):
        exterior = exterior_surfaces(season.building, room.space, "solar")
        hours = np.flatnonzero((beam > 0).any(axis=1) & (room.season_of_year == number))
        if len(hours) and len(exterior.triangles):
            lit = sunlit_shares(
                exterior, points, facing, sun[hours], samples=DISC_RAYS,
                seed=room.options.sampling.seed,
            )  # fmt: skip
            beam[hours] *= lit.reshape(len(groups), SUN_POINTS, -1).mean(axis=1).T
    return beam


def roof_irradiance(room: RoomInputs) -> FloatArray:
    """Irradiance of the window groups without surroundings [H, G] [W/m2]."""
    sampling, groups = room.options.sampling, room.windows.groups
    centres = [np.mean([w.triangles.mean(axis=(0, 1)) for w in g.windows], axis=0) for g in groups]
    matrix = sky_irradiance_matrix(
        Surfaces.none(), np.stack(centres), np.stack([g.frame[2] for g in groups]),
        subdivision=sampling.subdivision, seed=sampling.seed, cache=room.cache,
    ).values  # fmt: skip
    lit: FloatArray = (matrix @ np.asarray(room.skies.solar)).astype(float)
    return room.skies.whole_year(lit).T


def _avoid_glare(
    room: RoomInputs,
    light: RoomLight,
    states: StateArray,
    glare: NDArray[np.int64],
    progress: Progress,
) -> None:
    """Set the states [H, N] of control groups to the most open combination without glare.

    At every seat that their rules name, with all other groups in their states.
    """
    counts = [group_states(room, c) for c in glare]
    combinations = np.array(list(product(*map(range, counts))), dtype=np.int64)
    if len(combinations) > MOST_COMBINATIONS:
        message = f"{len(glare)} groups have {len(combinations)} combinations of states, at most "
        message += f"{MOST_COMBINATIONS} are rated: let more windows move together"
        raise DataError(message, element=room.space.label, field="control.groups")
    windows, lit = room.windows, room.skies.lit
    areas = np.array(
        [sum(windows.groups[g].area for g in np.flatnonzero(windows.control == c)) for c in glare]
    )
    closure = combinations / np.maximum(np.array(counts) - 1, 1) @ (areas / areas.sum())
    leaves = [leaf for c in glare for leaf in room.control.rules[c].leaves if leaf.rule == "glare"]
    limits = _limits(room, light, leaves)

    def excess(number: int, hours: NDArray[np.int64]) -> FloatArray:
        chosen = states.copy()
        chosen[:, glare] = combinations[number]
        rows = light.states(chosen[:, windows.control])
        steps = part(
            progress, number / len(combinations), (number + 1) / len(combinations), "glare control"
        )
        return np.max([limit(rows, hours, steps) for limit in limits], axis=0)

    chosen = by_glare(closure, excess, len(lit))
    states[np.ix_(lit, glare)] = combinations[chosen]


Excess = Callable[[StateArray, NDArray[np.int64], Progress], FloatArray]


def _limits(room: RoomInputs, light: RoomLight, rules: list[ShadingRule]) -> list[Excess]:
    """For each seat and limit of rules: glare beyond it, relative to it, in some lit hours [h]."""
    lights: dict[object, PhaseLight | SeasonalLight] = {}
    limits: dict[object, Excess] = {}
    for rule in rules:
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
