"""The windows that move together, in a room or in several, and the rule of each such group."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space, Window
from bim.names import numbered
from bim.sensors import in_room
from bim.to_tracer import orientation_groups, orientation_name
from mitsuba_cfs.errors import DataError
from scenes.room.operation_tables import OperationTables, rooms_of
from scenes.room.shading_rules import ControlTable, GroupTable, ShadingRule

FOLLOWS = ShadingRule()  # of windows whose states are those of a group of several rooms: nothing is computed


@dataclass(frozen=True, slots=True)
class ControlGroups:
    """The groups of windows of a room that move together (axis N)."""

    names: tuple[str, ...]  # [N]
    rules: tuple[ShadingRule, ...]  # [N]
    places: tuple[str, ...]  # [N] paths of the tables of the rules
    number: NDArray[np.int64]  # [W] group of each window of the space
    kinds: tuple[str, ...]  # [N] names of the rules, in results
    shared: tuple[str, ...]  # [N] name of the group in the building; "": of this room alone
    sensor_rooms: tuple[tuple[str, ...], ...]  # [N] rooms that the rule of a shared group reads; none: all

    def following(self, names: Collection[str]) -> ControlGroups:
        """The groups of which the states of those shared by these names are known."""
        followed = [bool(name) and name in names for name in self.shared]
        rules = tuple(FOLLOWS if known else rule for rule, known in zip(self.rules, followed, strict=True))
        return replace(self, rules=rules)


def control_groups(
    space: Space, control: ControlTable | None = None, building: Building | None = None
) -> ControlGroups:
    """The groups of a room; by default one for each orientation of its windows.

    Entries of `group` come first, in their order, then the other windows: facades by their area,
    single windows by their position. The order of the windows in the file does not matter.

    Args: building: with the zones of the room.

    Raises: `DataError` for a seat or sensor outside the room, groups that plans cannot follow
        together, or a room of several zones.
    """
    control = control or ControlTable()
    entries = [control.group[n] for n in range(len(control.group))]
    named = [
        None if building is None else rooms_of(building, one, f"control.group.{n}") for n, one in enumerate(entries)
    ]
    facades = _facades(space, by_name=control.across != "room")
    keys: list[tuple[Any, ...]] = []
    for window, facade in zip(space.windows, facades, strict=True):
        entry = next((n for n, one in enumerate(entries) if _names(one, window, space, named[n])), None)
        if entry is not None:
            keys.append((0, entry))
        elif control.groups == "window":
            keys.append((1, facade, *np.round(window.centre, 3).tolist(), window.guid))
        else:
            keys.append((1, facade if control.groups == "facade" else 0))
    distinct = sorted(set(keys))
    number = np.array([distinct.index(key) for key in keys], dtype=np.int64)
    names, rules, places, shared, sensors = [], [], [], [], []
    for c, key in enumerate(distinct):
        windows = [w for w, n in zip(space.windows, number, strict=True) if n == c]
        table = control.group[key[1]] if key[0] == 0 else None
        place = _place(space, building, control, table)
        name = _name(windows, table, control.groups)
        names.append(f"{name} {place}" if place else name)
        shared.append("" if place is None else names[-1])
        sensors.append(control.sensor_rooms_of(table))
        rules.append(control.rule_of(table))
        places.append("control" if table is None else f"control.group.{key[1]}")
    for rule, where in zip(rules, places, strict=True):
        for field in ("limit_dgp", "seat", "looks_deg") if rule.rule == "predictive" else ():
            if getattr(rule, field) != getattr(rules[0], field):
                message = '"predictive" has one for all groups of a room'
                raise DataError(message, element=space.label, field=f"{where}.{field}")
    spanning = [name for name in shared if name]
    if len(set(spanning)) < len(spanning):
        message = f"two groups of several rooms are named {max(spanning, key=spanning.count)!r}: give them a `name`"
        raise DataError(message, element=space.label, field="control.group")
    groups = ControlGroups(
        tuple(numbered(names)),
        tuple(rules),
        tuple(places),
        number,
        tuple(rule.rule for rule in rules),
        tuple(shared),
        tuple(sensors),
    )
    check_seats(groups, space, [c for c, name in enumerate(shared) if not name])
    return groups


def check_seats(groups: ControlGroups, space: Space, of: Sequence[int]) -> None:
    """Raise `DataError` for a seat or sensor of some groups that is outside a room."""
    for c in of:
        for leaf in groups.rules[c].leaves:
            for field, point in (("seat", leaf.seat), ("at", leaf.at)):
                if point is not None and not in_room(space, np.array([point]))[0]:
                    where = f"{groups.places[c]}.{field}"
                    raise DataError("is outside the room", element=space.label, field=where)


def _facades(space: Space, *, by_name: bool) -> list[int]:
    """The number of the orientation of each window [W], that of the largest area first.

    Args: by_name: windows to one compass point have one number, as in other rooms.
    """
    number = {w: f for f, group in enumerate(orientation_groups(space)) for w in group}
    if not by_name:
        return [number[w] for w in range(len(space.windows))]
    points = [orientation_name(window) for window in space.windows]
    return [min(number[v] for v, other in enumerate(points) if other == point) for point in points]


def _names(table: GroupTable, window: Window, space: Space, rooms: Collection[str] | None) -> bool:
    """Whether an entry names a window.

    Args: rooms: GUIDs of the rooms that it names.
    """
    if window.guid in table.windows or window.name in table.windows:
        return True
    by_room = bool(table.storeys or table.zones or table.spaces)
    if not (table.facades or by_room) or (by_room and space.guid not in (rooms or ())):
        return False
    return not table.facades or orientation_name(window) in table.facades


def _name(windows: list[Window], table: GroupTable | None, groups: str) -> str:
    """The name of a group in results."""
    if table is not None and (table.name or table.facades):
        return table.name or " ".join(table.facades)
    if table is not None and not table.windows:
        return "all"
    if table is None and groups == "facade":
        return orientation_name(windows[0])
    if table is None and groups == "room":
        return "all"
    return windows[0].name or windows[0].guid


def _place(space: Space, building: Building | None, control: ControlTable, table: GroupTable | None) -> str | None:
    """The storey or zone whose rooms share a group, "" for the building; None: the room alone.

    A room without a storey, or without a zone, is alone; of zones within zones the innermost counts.
    """
    across = control.across_of(table)
    if across == "storey":
        return space.storey or None
    if across == "building":
        return ""
    if across == "room":
        return None
    zones = [zone for zone in (() if building is None else building.zones) if space.guid in zone.rooms]
    if not zones:
        return None
    inner = min(zones, key=lambda zone: len(zone.rooms))
    if not all(set(inner.rooms) <= set(zone.rooms) for zone in zones):
        there = ", ".join(zone.name for zone in zones)
        message = f"the room is in several zones ({there}): name one as `zones` of [[control.group]]"
        raise DataError(message, element=space.label, field="control.across")
    return inner.name


@dataclass(frozen=True, slots=True)
class SharedGroup:
    """Windows of several rooms that move together."""

    name: str
    rule: ShadingRule
    place: str  # path of the rule's table
    windows: Mapping[str, tuple[Window, ...]]  # by the room's GUID
    sensor_rooms: tuple[Space, ...]  # that the rule reads


def shared_groups(building: Building, tables: OperationTables, spaces: Sequence[Space] = ()) -> list[SharedGroup]:
    """The groups of windows of several rooms, by name.

    Args: spaces: only groups with windows of these rooms; none: of all.

    Raises: `DataError` for different rules in the rooms of a group, or a room without its windows.
    """
    if not any(one.control.shares for one in tables.variants):
        return []
    members: dict[str, list[tuple[Space, ControlGroups, int]]] = {}
    for space in building.spaces:
        if space.windows:
            groups = control_groups(space, tables.of_room(building, space).control, building)
            for c, name in enumerate(groups.shared):
                if name:
                    members.setdefault(name, []).append((space, groups, c))
    wanted = {space.guid for space in spaces}
    return [
        _shared_group(building, name, of)
        for name, of in sorted(members.items())
        if not wanted or any(space.guid in wanted for space, _, _ in of)
    ]


def _shared_group(building: Building, name: str, members: Sequence[tuple[Space, ControlGroups, int]]) -> SharedGroup:
    first, groups, c = members[0]
    rule, named, place = groups.rules[c], groups.sensor_rooms[c], groups.places[c]
    for space, other, n in members:
        if other.rules[n] != rule or other.sensor_rooms[n] != named:
            message = f"windows that move together have other rules here than in {first.label}"
            raise DataError(message, element=f"{space.label}, group {name!r}", field=place)
    windows = {
        space.guid: tuple(w for w, c in zip(space.windows, other.number, strict=True) if c == n)
        for space, other, n in members
    }
    seats = [point for leaf in rule.leaves for point in (leaf.seat, leaf.at) if point is not None]
    guids = {building.room(one).space.guid for one in named}
    others = guids - windows.keys()
    if others and place != "control":  # what [control] names counts for the groups that have windows there
        message = f"has no windows of the group {name!r}"
        raise DataError(message, element=building.space(min(others)).label, field=f"{place}.sensor_rooms")
    if guids & windows.keys():
        chosen = tuple(space for space, _, _ in members if space.guid in guids)
    elif seats:
        chosen = tuple(s for s, _, _ in members if all(in_room(s, np.array([seat]))[0] for seat in seats))
        if not chosen:
            message = "no room with windows of the group contains all seats and sensors of its rule"
            raise DataError(message, element=f"group {name!r}", field=place)
    else:
        chosen = tuple(space for space, _, _ in members)
    ordered = sorted(chosen, key=lambda space: space.guid)  # the same in any order of the file
    return SharedGroup(name, rule, place, windows, tuple(ordered))


def same_control(tables: OperationTables | None, building: Building, one: Space, other: Space) -> bool:
    """Whether windows of two rooms of equal shape and light move alike, and their tables are the same."""
    if tables is None:
        return True
    of_rooms = [tables.of_room(building, room) for room in (one, other)]
    if of_rooms[0] != of_rooms[1] or any(group.windows for group in of_rooms[0].control.group):
        return False  # other values, or a rule for windows of one of them
    if of_rooms[0].control.is_random:
        return False  # other people
    a, b = (control_groups(room, of_rooms[0].control, building) for room in (one, other))
    return (a.names, a.rules, a.shared) == (b.names, b.rules, b.shared)
