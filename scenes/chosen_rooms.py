"""Rooms of a building by their names, and why a room or its windows are missing."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from bim.model import CUT_OFF, Building, Problem, Space
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
        for space in chosen:
            if not lit(space):
                about = [p for p in _lost(building, "window") if _says(p.what, space.name)]
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
    """The spaces of those names or GUIDs, each once, or all spaces; with windows or without."""
    if not building.spaces:
        raise DataError(f"has no rooms (IfcSpace){_because(building, 'room')}", file=path)
    if not names:
        return list(building.spaces)
    return list(
        {space.guid: space for space in (_space(building, n, path) for n in names)}.values()
    )


def _space(building: Building, name: str, path: Path) -> Space:
    try:
        return building.space(name)
    except (KeyError, ValueError) as error:
        lost = [p for p in _lost(building, "room") if p.where == name or _says(p.what, name)]
        if isinstance(error, KeyError) and lost:
            message = f"space {name!r} was left out: {_quoted(lost)}"
        else:
            message = str(error.args[0])
        raise DataError(message, file=path, field="space") from error


def _lost(building: Building, kind: str) -> list[Problem]:
    """The problems for which a "room" or "window" is not there."""
    return [problem for problem in building.problems if problem.lost == kind]


def _says(text: str, name: str) -> bool:
    """Whether a text holds a name as whole words."""
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text, re.IGNORECASE) is not None


def _because(building: Building, kind: str) -> str:
    cut_off = [problem for problem in building.problems if problem.kind == CUT_OFF]
    lost = [*cut_off, *_lost(building, kind)]
    return f": {_quoted(lost)}" if lost else ""


def _quoted(problems: Sequence[Problem]) -> str:
    """The first problems in one line, and how many more there are."""
    shown = "; ".join(f"{p.what} ({p.consequence})" for p in problems[:QUOTED])
    more = len(problems) - QUOTED
    return f"{shown}; and {more} more, see cfs check" if more > 0 else shown
