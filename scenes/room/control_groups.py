"""The windows of a room that move together, and the rule of each such group."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.model import Space, Window
from bim.names import numbered
from bim.sensors import in_room
from bim.to_tracer import orientation_groups, orientation_name
from mitsuba_cfs.errors import DataError
from scenes.room.shading_rules import ControlTable, GroupTable, ShadingRule


@dataclass(frozen=True, slots=True)
class ControlGroups:
    """The groups of windows of a room that move together (axis N)."""

    names: tuple[str, ...]  # [N]
    rules: tuple[ShadingRule, ...]  # [N]
    places: tuple[str, ...]  # [N] paths of the tables of the rules
    number: NDArray[np.int64]  # [W] group of each window of the space


def control_groups(space: Space, control: ControlTable | None = None) -> ControlGroups:
    """The groups of a room; by default one for each orientation of its windows.

    Entries of `group` come first, in their order, then the other windows: facades by their area,
    single windows by their position. The order of the windows in the file does not matter.

    Raises: `DataError` for a seat or sensor outside the room, or groups that plans cannot follow
        together.
    """
    control = control or ControlTable()
    facades = _facades(space)
    keys: list[tuple[Any, ...]] = []
    for window, facade in zip(space.windows, facades, strict=True):
        entry = next((n for n, one in enumerate(control.group) if _names(one, window)), None)
        if entry is not None:
            keys.append((0, entry))
        elif control.groups == "window":
            keys.append((1, facade, *np.round(window.centre, 3).tolist(), window.guid))
        else:
            keys.append((1, facade if control.groups == "facade" else 0))
    distinct = sorted(set(keys))
    number = np.array([distinct.index(key) for key in keys], dtype=np.int64)
    names, rules, places = [], [], []
    for c, key in enumerate(distinct):
        windows = [w for w, n in zip(space.windows, number, strict=True) if n == c]
        table = control.group[key[1]] if key[0] == 0 else None
        names.append(_name(windows, table, control.groups))
        rules.append(control.rule_of(table))
        places.append("control" if table is None else f"control.group.{key[1]}")
    for rule, place in zip(rules, places, strict=True):
        for name in ("limit_dgp", "seat", "looks_deg") if rule.rule == "predictive" else ():
            if getattr(rule, name) != getattr(rules[0], name):
                message = '"predictive" has one for all groups of a room'
                raise DataError(message, element=space.label, field=f"{place}.{name}")
    leaves = [(leaf, p) for rule, p in zip(rules, places, strict=True) for leaf in rule.leaves]
    for leaf, place in leaves:
        for field, point in (("seat", leaf.seat), ("at", leaf.at)):
            if point is not None and not in_room(space, np.array([point]))[0]:
                where = f"{place}.{field}"
                raise DataError("is outside the room", element=space.label, field=where)
    return ControlGroups(tuple(numbered(names)), tuple(rules), tuple(places), number)


def _facades(space: Space) -> list[int]:
    """The number of the orientation of each window [W], that of the largest area first."""
    number = {w: f for f, group in enumerate(orientation_groups(space)) for w in group}
    return [number[w] for w in range(len(space.windows))]


def _names(table: GroupTable, window: Window) -> bool:
    """Whether an entry names a window."""
    named = window.guid in table.windows or window.name in table.windows
    return named or orientation_name(window) in table.facades


def _name(windows: list[Window], table: GroupTable | None, groups: str) -> str:
    """The name of a group in results."""
    if table is not None and (table.name or table.facades):
        return table.name or " ".join(table.facades)
    if table is None and groups == "facade":
        return orientation_name(windows[0])
    if table is None and groups == "room":
        return "all"
    return windows[0].name or windows[0].guid
