"""Import report of a model: rooms and glass that were read, what is missing, and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mitsuba_cfs.notes import Note

USABLE, CARE, NOT_USABLE = Note("usable"), Note("usable with care"), Note("not usable")
# the rules of the verdict, stated in docs/bim.md: shares of the exterior glass
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
    glass_out: float  # exterior glass [m2]
    glass_used: float  # of it: before a room [m2]


@dataclass(frozen=True, slots=True)
class Account:
    """Rooms by storey, exterior glass and its used part, and spaces that fit badly."""

    storeys: tuple[StoreyAccount, ...]
    windows_out: int  # exterior windows, glazed doors and panels
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
    from_geometry: bool = False  # rooms found from geometry: the file has none
    cut_off: bool = False  # the file has lost its end
    raised: tuple[str, ...] = ()  # rooms that end at the roof in place of the top of their space
    shut_in: float = 0.0  # of the used glass: obstructions outdoors leave nothing open [m2]
    inner_only: tuple[str, ...] = ()  # rooms whose glass is all between them and other rooms

    @property
    def glass_out(self) -> float:
        """Area of the exterior glass [m2]."""
        return sum(storey.glass_out for storey in self.storeys)

    @property
    def glass_used(self) -> float:
        """Area of the glass that gives light to rooms [m2]."""
        return sum(storey.glass_used for storey in self.storeys)

    @property
    def share_used(self) -> float:
        """Share of the exterior glass that is used, 0 to 1; 1 without any."""
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
    def reasons(self) -> tuple[Note, ...]:
        """Why the verdict is not better, the gravest first."""
        return (*self._stops(), *self._cautions())

    @property
    def facts(self) -> tuple[tuple[str, str], ...]:
        """The account in a few words: title and text of verdict, rooms, glass, spaces."""
        lists = (
            (Note("Spaces overlapping"), self.overlapping),
            (Note("Rooms lower than their glass"), self.low),
            (Note("Rooms raised to what covers them"), self.raised),
            (Note("Spaces that are no rooms"), self.missing),
            (Note("Rooms with open edges"), self.leaking),
            (Note("Rooms with inner glass only"), self.inner_only),
        )
        model = Note(self.verdict)
        if self.reasons:
            model = Note("{verdict}: {reasons}", verdict=model, reasons=_joined(self.reasons))
        return (
            (Note("Model"), model),
            (Note("Rooms read"), self._rooms_line()),
            (Note("Glass"), self._glass_line()),
            *((title, _listed(names)) for title, names in lists if names),
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """`facts` as lines of text."""
        return tuple(Note("{title}: {text}", title=title, text=text) for title, text in self.facts)

    def _stops(self) -> list[Note]:
        notes = []
        if self.cut_off:
            notes.append(Note("THE FILE IS CUT OFF at its end: an unknown part of the building is lost"))
        if not self.rooms:
            notes.append(Note("no rooms"))
        elif self.share_used < HALF:
            notes.append(Note("only {percent:.0f} % of the exterior glass is used", percent=100 * self.share_used))
        return notes

    def _cautions(self) -> list[Note]:
        notes = []
        if self.rooms and HALF <= self.share_used < WHOLE:
            notes.append(Note("{percent:.0f} % of the exterior glass is used", percent=100 * self.share_used))
        if not self.glass_out:
            notes.append(Note("no exterior glass"))
        if self.glass_assumed > MUCH_ASSUMED * self.glass_used:
            notes.append(Note("{area:.1f} m2 of glass assumed", area=self.glass_assumed))
        losses = (
            Note("{area:.1f} m2 transparent but no glass", area=self.phantom),
            Note("{area:.1f} m2 of openings without a window closed", area=self.closed),
            Note("{area:.1f} m2 of glass without sky or ground in view", area=self.shut_in),
        )
        notes += [note for note in losses if note.values["area"] > NOTABLE * self.glass_out]
        if self.from_geometry:
            notes.append(Note("rooms found from geometry"))
        elif self.rooms < self.spaces:
            lost = self.spaces - self.rooms
            note = Note(
                "{count} of {all} spaces are no rooms",
                "{count} of {all} spaces is no room",
                count=lost,
                all=self.spaces,
            )
            notes.append(note)
        if self.overlapping:
            notes.append(Note("pairs of overlapping spaces: {count}", count=len(self.overlapping)))
        if self.inner_only:
            names = _listed(self.inner_only)
            notes.append(Note("only inner glass, to other rooms: {names}", names=names))
        if self.leaking:
            notes.append(Note("rooms with open edges: {count}", count=len(self.leaking)))
        return notes

    def _rooms_line(self) -> Note:
        if not self.rooms and not self.spaces:
            return Note("none: the file has no spaces, and no room was found between its walls")
        storeys = [
            Note("{storey} {count}", storey=_storey(s.name), count=s.rooms)
            if self.from_geometry
            else Note("{storey} {count} of {all}", storey=_storey(s.name), count=s.rooms, all=s.spaces)
            for s in self.storeys
        ]
        listed = _joined(storeys, ", ")
        if self.from_geometry:
            return Note("{count} found from geometry ({storeys})", count=self.rooms, storeys=listed)
        return Note(
            "{rooms} of {count} spaces ({storeys})",
            "{rooms} of {count} space ({storeys})",
            rooms=self.rooms,
            count=self.spaces,
            storeys=listed,
        )

    def _glass_line(self) -> Note:
        used = Note("no exterior glass in a room")
        if self.glass_out > 0:
            used = Note(
                "{used:.1f} of {all:.1f} m2 of exterior glass used ({percent:.0f} %, {windows} of {count} windows)",
                "{used:.1f} of {all:.1f} m2 of exterior glass used ({percent:.0f} %, {windows} of {count} window)",
                used=self.glass_used,
                all=self.glass_out,
                percent=100 * self.share_used,
                windows=self.windows_used,
                count=self.windows_out,
            )
        losses = [
            Note("{area:.1f} m2 assumed", area=self.glass_assumed),
            Note("{area:.1f} m2 without sky or ground in view", area=self.shut_in),
            Note("{area:.1f} m2 above rooms that are too low", area=self.glass_low),
            Note("{area:.1f} m2 without a room behind it", area=self.glass_missing),
            Note("{area:.1f} m2 transparent but no glass", area=self.phantom),
            Note("{area:.1f} m2 of openings without a window closed", area=self.closed),
        ]
        losses += [
            Note(
                "{area:.1f} m2 of the unused glass in storey {storey}, which has no rooms",
                storey=_storey(s.name),
                area=s.glass_out - s.glass_used,
            )
            for s in self.storeys
            if not s.rooms
        ]
        return _joined([used, *(note for note in losses if note.values["area"] >= 0.05)], ", ")


def _storey(name: str) -> str:
    return name or Note("(unnamed)")


def _joined(parts: Sequence[Note], separator: str = "; ") -> Note:
    """Notes in one line."""
    names = [f"part{number}" for number in range(len(parts))]
    template = separator.join(f"{{{name}}}" for name in names)
    return Note(template, **dict(zip(names, parts, strict=True)))


def _listed(names: tuple[str, ...]) -> str:
    text = ", ".join(names[:SHOWN])
    left = len(names) - SHOWN
    return Note("{names} and {count} more", names=text, count=left) if left > 0 else text
