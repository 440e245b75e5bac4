"""Rooms of a building by their names, and why a room or its windows are missing."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from bim.model import Building, Space
from bim.names import AmbiguousName, UnknownName, listed
from bim.report.issue import Issue, issue_text
from mitsuba_cfs.errors import DataError

QUOTED = 3  # problems of the model that one message quotes


def chosen_spaces(
    building: Building,
    names: Sequence[str],
    path: Path,
    lit: Callable[[Space], bool] = lambda space: bool(space.windows),
) -> list[Space]:
    """The spaces of those names or GUIDs, or every space with a window.

    Args: lit: whether a space has one, or what counts as one.

    Raises: `DataError` that quotes what the model's problems say about a room that is not there.
    """
    chosen = named_spaces(building, names, path)
    if names:
        zoned = {space.guid for name in names for space in building.zone(name)}
        chosen = [space for space in chosen if lit(space) or space.guid not in zoned]
        for space in chosen:
            if not lit(space):
                about = [p for p in _lost(building, "window") if _names(p, space.name)]
                why = f": {_quoted(about)}" if about else ""
                raise DataError(f"has no window{why}", file=path, element=f"space {space.label}")
        return chosen
    chosen = [space for space in chosen if lit(space)]
    if not chosen:
        raise no_window(building, path)
    return chosen


def no_window(building: Building, path: Path) -> DataError:
    """That no space has a window, with what the model's problems say of it."""
    why = _because(building, "window") or _because(building, "room")
    what = f"no space has a window to the outside{why}"
    return DataError(what, file=path, element="IfcWindow")


def named_spaces(building: Building, names: Sequence[str], path: Path) -> list[Space]:
    """The spaces of those names or GUIDs, or of zones, each once, or all; with windows or not."""
    if not building.spaces:
        raise DataError(f"has no rooms (IfcSpace){_because(building, 'room')}", file=path)
    if not names:
        return list(building.spaces)
    chosen = (space for name in names for space in _spaces(building, name, path))
    return list({space.guid: space for space in chosen}.values())


def _spaces(building: Building, name: str, path: Path) -> Sequence[Space]:
    """The space of a name, else those of the zone of that name."""
    try:
        return (building.space(name),)
    except (UnknownName, AmbiguousName) as error:
        zone = building.zone(name)
        if zone and isinstance(error, UnknownName):
            return zone
        lost = [p for p in _lost(building, "room") if p.where == name or _names(p, name)]
        if isinstance(error, UnknownName) and lost:
            message = f"space {name!r} was left out: {_quoted(lost)}"
        else:
            message = str(error.args[0])
            if building.zones:
                message += f"; zones: {listed(name, (zone.name for zone in building.zones))}"
        raise DataError(message, file=path, field="space") from error


def _lost(building: Building, kind: str) -> list[Issue]:
    """The problems for which a "room" or "window" is not there."""
    return [issue for issue in building.issues if issue.effect.lost == kind]


def _names(issue: Issue, name: str) -> bool:
    """Whether an issue concerns rooms of that name, or with that name as whole words in theirs."""
    rooms = issue.values.get("rooms", issue.values.get("room", ""))
    text = " + ".join(map(str, rooms)) if isinstance(rooms, tuple) else str(rooms)
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text, re.IGNORECASE) is not None


def _because(building: Building, kind: str) -> str:
    cut_off = [issue for issue in building.issues if issue.code == "file-cut-off"]
    lost = [*cut_off, *_lost(building, kind)]
    return f": {_quoted(lost)}" if lost else ""


def _quoted(issues: Sequence[Issue]) -> str:
    """The first problems in one line, and how many more there are."""
    texts = [issue_text(issue, "command") for issue in issues[:QUOTED]]
    shown = "; ".join(f"{text.what} ({text.effect})" for text in texts)
    more = len(issues) - QUOTED
    return f"{shown}; and {more} more, see cfs check" if more > 0 else shown
