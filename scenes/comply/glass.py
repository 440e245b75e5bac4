"""What one sees through a window's system: how much goes straight on, and how much is haze."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bim.model import Window
from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, States

MOST_HAZE = 0.5  # share of the light passed that may be scattered in what counts as a view


@dataclass(frozen=True, slots=True)
class SightThrough:
    """Light of normal incidence through a system."""

    transmittance: float  # all that passes
    straight: float  # what goes straight on

    @property
    def haze(self) -> float:
        """Share of what passes that is scattered, 0 to 1; 1 where nothing passes."""
        if self.transmittance <= 0:
            return 1.0
        return max(1.0 - self.straight / self.transmittance, 0.0)

    @property
    def is_view(self) -> bool:
        """Whether one sees through: at least half of what passes goes straight on."""
        return self.haze <= MOST_HAZE


def sight_through(system: FenestrationSystem) -> SightThrough:
    """Visible transmittance at normal incidence: total, and specular alone."""
    klems = system.visible
    block = klems.transmission_matrix() / klems.basis_in.projected_solid_angles()
    straight = through_peak(block, klems.basis_in, klems.see_through).transmittance[0]
    return SightThrough(float(klems.direct_hemispherical(block)[0]), float(straight))


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
