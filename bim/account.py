"""What of a model came through to rooms and glass, how much did not, and whether that will do."""

from __future__ import annotations

from dataclasses import dataclass

USABLE, CARE, NOT_USABLE = "usable", "usable with care", "not usable"
# the rules of the verdict, stated in docs/bim.md: shares of the glass that looks out
WHOLE = 0.98  # used from this on: nothing to say
HALF = 0.5  # used below this: not usable
MUCH_ASSUMED = 0.1  # of the used glass
NOTABLE = 0.01  # every loss above this is named
SHOWN = 6  # names in a line


@dataclass(frozen=True, slots=True)
class StoreyAccount:
    """Rooms and glass of one storey."""

    name: str
    rooms: int  # spaces that became rooms or parts of one
    spaces: int  # IfcSpace in the file, whatever became of them
    glass_out: float  # that looks out [m2]
    glass_used: float  # of it: before a room [m2]


@dataclass(frozen=True, slots=True)
class Account:
    """Rooms by storey, glass that looks out and what became of it, and spaces that fit badly."""

    storeys: tuple[StoreyAccount, ...]
    windows_out: int  # windows, glazed doors and panels that look out
    windows_used: int
    glass_assumed: float  # of the used glass: its outline is not drawn in the file [m2]
    glass_low: float  # above rooms that are lower than their windows [m2]
    glass_missing: float  # with no room behind at all [m2]
    phantom: float  # transparent surfaces that are no glass [m2]
    closed: float  # openings to the outdoors without a window that were closed [m2]
    overlapping: tuple[str, ...] = ()  # pairs of spaces
    low: tuple[str, ...] = ()  # rooms that end below the glass before them
    missing: tuple[str, ...] = ()  # spaces that are no rooms
    leaking: tuple[str, ...] = ()  # rooms with an open edge
    found: bool = False  # rooms found from geometry: the file has none
    cut_off: bool = False  # the file has lost its end
    raised: tuple[str, ...] = ()  # rooms that end at the roof in place of the top of their space
    shut_in: float = 0.0  # of the used glass: what stands before it leaves nothing open [m2]

    @property
    def glass_out(self) -> float:
        """Area of all glass that looks out [m2]."""
        return sum(storey.glass_out for storey in self.storeys)

    @property
    def glass_used(self) -> float:
        """Area of the glass that gives light to rooms [m2]."""
        return sum(storey.glass_used for storey in self.storeys)

    @property
    def share_used(self) -> float:
        """Glass used of all that looks out, 0 to 1; 1 without any."""
        return self.glass_used / self.glass_out if self.glass_out > 0 else 1.0

    @property
    def rooms(self) -> int:
        """Spaces that became rooms."""
        return sum(storey.rooms for storey in self.storeys)

    @property
    def spaces(self) -> int:
        """Spaces in the file."""
        return sum(storey.spaces for storey in self.storeys)

    @property
    def verdict(self) -> str:
        """One of USABLE, CARE, NOT_USABLE."""
        if self._stops():
            return NOT_USABLE
        return CARE if self._cautions() else USABLE

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the verdict is not better, the gravest first."""
        return (*self._stops(), *self._cautions())

    @property
    def facts(self) -> tuple[tuple[str, str], ...]:
        """The account in a few words: title and text of verdict, rooms, glass, spaces."""
        lists = (
            ("Spaces overlapping", self.overlapping),
            ("Rooms lower than their glass", self.low),
            ("Rooms raised to what covers them", self.raised),
            ("Spaces that are no rooms", self.missing),
            ("Rooms with open edges", self.leaking),
        )
        why = "; ".join(self.reasons)
        return (
            ("Model", self.verdict + (f": {why}" if why else "")),
            ("Rooms read", self._rooms_line()),
            ("Glass", self._glass_line()),
            *((title, _listed(names)) for title, names in lists if names),
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """`facts` as lines of text."""
        return tuple(f"{title}: {text}" for title, text in self.facts)

    def _stops(self) -> list[str]:
        found = []
        if self.cut_off:
            found.append("THE FILE IS CUT OFF at its end: an unknown part of the building is lost")
        if not self.rooms:
            found.append("no rooms")
        elif self.share_used < HALF:
            found.append(f"only {_percent(self.share_used)} of the glass that looks out is used")
        return found

    def _cautions(self) -> list[str]:
        found = []
        if self.rooms and HALF <= self.share_used < WHOLE:
            found.append(f"{_percent(self.share_used)} of the glass that looks out is used")
        if not self.glass_out:
            found.append("no glass looks out")
        if self.glass_assumed > MUCH_ASSUMED * self.glass_used:
            found.append(f"{self.glass_assumed:.1f} m2 of glass assumed")
        for area, what in (
            (self.phantom, "transparent but no glass"),
            (self.closed, "openings without a window closed"),
            (self.shut_in, "of glass with no sky or ground in sight"),
        ):
            if area > NOTABLE * self.glass_out:
                found.append(f"{area:.1f} m2 {what}")
        if self.found:
            found.append("rooms found from geometry")
        elif self.rooms < self.spaces:
            found.append(f"{self.spaces - self.rooms} of {self.spaces} spaces are no rooms")
        for names, what in (
            (self.overlapping, "pairs of spaces overlap"),
            (self.leaking, "rooms with open edges"),
        ):
            if names:
                found.append(f"{len(names)} {what}")
        return found

    def _rooms_line(self) -> str:
        if not self.rooms and not self.spaces:
            return "none: the file has no spaces, and no room was found between its walls"
        if self.found:
            by_storey = (f"{s.name or 'no storey'} {s.rooms}" for s in self.storeys)
            return f"{self.rooms} found from geometry ({', '.join(by_storey)})"
        by_storey = (f"{s.name or 'no storey'} {s.rooms} of {s.spaces}" for s in self.storeys)
        return f"{self.rooms} of {self.spaces} spaces ({', '.join(by_storey)})"

    def _glass_line(self) -> str:
        parts = [
            f"{self.glass_used:.1f} of {self.glass_out:.1f} m2 that looks out used "
            f"({_percent(self.share_used)}; {self.windows_used} of {self.windows_out} windows)"
            if self.glass_out > 0
            else "none looks out of a room"
        ]
        for area, what in (
            (self.glass_assumed, "assumed"),
            (self.shut_in, "with no sky or ground in sight"),
            (self.glass_low, "above rooms that are too low"),
            (self.glass_missing, "with no room behind"),
            (self.phantom, "transparent but no glass"),
            (self.closed, "openings without a window closed"),
        ):
            if area >= 0.05:
                parts.append(f"{area:.1f} m2 {what}")
        parts += [
            f"storey {s.name or 'without a name'} has no rooms and {lost:.1f} m2 of glass unused"
            for s in self.storeys
            if not s.rooms and (lost := s.glass_out - s.glass_used) > 0.05
        ]
        return ", ".join(parts)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _listed(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more
