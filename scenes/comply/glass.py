"""Windows that one does not see through, and a sentence on each state of a window."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from bim.model import Window
from mitsuba_cfs.notes import Note
from scenes.fenestration.sight import SightThrough, sight_through
from scenes.fenestration.systems import States


def windows_without_view(
    windows: Iterable[Window], systems: Mapping[str, States]
) -> tuple[frozenset[str], tuple[str, ...]]:
    """GUIDs of the windows that one does not see through when open, and a sentence on each state.

    Windows whose system is not known are seen through.
    """
    known: dict[int, SightThrough] = {}
    hidden, notes = set(), {}
    for window in windows:
        if window.guid not in systems:
            continue
        for number, system in enumerate(systems[window.guid]):
            if id(system) not in known:
                known[id(system)] = sight_through(system)
            sight = known[id(system)]
            notes[system.name] = Note(
                "{system}: direct visible transmittance {direct:.0f} % at normal incidence, haze "
                "{haze:.0f} %; {verdict}.",
                system=system.name,
                direct=100 * sight.straight,
                haze=100 * sight.haze,
                verdict=_view_words(sight, closed=number > 0),
            )
            if number == 0 and not sight.is_view:
                hidden.add(window.guid)
    return frozenset(hidden), tuple(notes.values())


def _view_words(sight: SightThrough, *, closed: bool) -> Note:
    """What a state, open or closed, means for the view."""
    if closed and sight.is_view:
        return Note("the view remains when closed")
    if closed:
        return Note("blocks the view")
    return Note("counts as a view") if sight.is_view else Note("does not count as a view")
