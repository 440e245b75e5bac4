"""The states of groups of windows of several rooms, decided once for the building."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space, Window
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, item, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import States
from scenes.room.control_groups import ControlGroups, SharedGroup, check_seats, shared_groups
from scenes.room.inputs import RoomInputs
from scenes.room.operation import Operation, SharedYear
from scenes.room.options import RoomOptions
from scenes.room.room import asked_year, inputs_of_room
from scenes.room.shading import combined_states, waited_states
from scenes.room.shading_rules import ROOM_RULES, WAITS, ShadingRule


def with_shared_states(
    operation: Operation | None,
    building: Building,
    spaces: Sequence[Space],
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    *,
    skies: AnnualSky | None = None,
    cache: MatrixCache | None = None,
    inner: bool = False,
    progress: Progress = silent,
) -> Operation | None:
    """The operation with the states of the groups that several rooms share, among them some `spaces`.

    Each sensor room follows the rule of a group by itself; the group takes the most closed of these
    states, and then waits as its rule says. Rooms with windows of a single state do not count.

    Args: systems: also of the windows of sensor rooms; the others as of `lit_room`.

    Raises: `DataError` for groups that cannot move together.
    """
    groups = [] if operation is None else shared_groups(building, operation.tables, spaces)
    if operation is None or not groups:
        return operation
    counts = {group.name: _states(group, systems) for group in groups}
    sensors = {g.name: tuple(s for s in g.sensor_rooms if _most(g.windows[s.guid], systems) > 1) for g in groups}
    several = {group.name for group in groups if len(sensors[group.name]) > 1}
    for group in groups:
        _check_waits(group, group.name in several)
    rooms = sorted({s.guid: s for of in sensors.values() for s in of}.values(), key=lambda space: space.guid)
    asked: dict[str, dict[str, SharedYear]] = {group.name: {} for group in groups}
    asking: list[RoomInputs] = []
    for number, space in enumerate(rooms):
        steps = item(progress, "room", number + 1, len(rooms), space.label)
        room = inputs_of_room(
            building, space, systems, weather, options, operation=operation, skies=skies, cache=cache, inner=inner
        )
        asking.append(room)
        of = [c for c, name in enumerate(room.control.shared) if name and space in sensors.get(name, ())]
        check_seats(room.control, space, of)
        year = asked_year(replace(room, control=_at_once(room.control, several)), progress=steps)
        for c in of:
            own = SharedYear(year.states[:, c], year.moved_by[:, c], year.reasons)
            asked[room.control.shared[c]][space.guid] = own
    none = np.zeros(len(weather.times), dtype=np.int64)
    shared = {}
    for group in groups:
        years = list(asked[group.name].values()) or [SharedYear(none, none - 1, ())]
        one = _together(asking[0], group.rule, years) if len(years) > 1 else years[0]
        shared[group.name] = one.up_to(counts[group.name])
    return replace(operation, shared=shared)


def _most(windows: Sequence[Window], systems: Mapping[str, States]) -> int:
    """The number of states of some windows: of the one with the most."""
    return max(len(systems[window.guid]) for window in windows)


def _states(group: SharedGroup, systems: Mapping[str, States]) -> int:
    """The number of states of a group's windows.

    Raises: `DataError` for windows with different numbers of states, apart from those with one.
    """
    known = [windows for windows in group.windows.values() if all(w.guid in systems for w in windows)]
    counts = {_most(windows, systems): windows[0].name or windows[0].guid for windows in known}
    moving = sorted(set(counts) - {1})
    if len(moving) > 1:
        message = f"windows of the group have {moving[0]} states ({counts[moving[0]]}) and {moving[1]} "
        message += f"({counts[moving[1]]}): give them as many"
        raise DataError(message, element=f"group {group.name!r}", field=group.place)
    return moving[0] if moving else 1


def _check_waits(group: SharedGroup, several: bool) -> None:
    """Raise `DataError` for a rule by the temperatures or people of several rooms that waits."""
    waits = [key for key in WAITS if getattr(group.rule, key)]
    by_heat = waits and any(leaf.rule in ROOM_RULES for leaf in group.rule.leaves)
    if several and (by_heat or group.rule.until == "arrival"):
        message = "does not act on the temperatures or the people of several rooms: name one as `sensor_rooms`"
        key = waits[0] if by_heat else "until"
        raise DataError(message, element=f"group {group.name!r}", field=f"{group.place}.{key}")


def _at_once(control: ControlGroups, names: set[str]) -> ControlGroups:
    """The groups, those of these names with rules that do not wait."""
    none = {key: ShadingRule.model_fields[key].default for key in WAITS}
    rules = [
        rule.model_copy(update=none) if name in names else rule
        for rule, name in zip(control.rules, control.shared, strict=True)
    ]
    return replace(control, rules=tuple(rules))


def _together(room: RoomInputs, rule: ShadingRule, years: Sequence[SharedYear]) -> SharedYear:
    """The most closed states of the years that rooms ask for, as a rule waits.

    Args: room: with the weather and the use by which the rule waits.
    """
    reasons = tuple(dict.fromkeys((*(one for year in years for one in year.reasons), *WAITS)))

    def numbered(year: SharedYear) -> NDArray[np.int64]:
        numbers = np.array([*map(reasons.index, year.reasons), -1], dtype=np.int64)
        return numbers[year.moved_by]

    states, moved_by = combined_states(True, [(year.states, numbered(year)) for year in years])
    states, moved_by = waited_states(room, rule, states, moved_by, reasons)
    return SharedYear(states, moved_by, reasons)
