"""The head of every result: what was left out, what was assumed, and how much it matters.

The terminal, the JSON record and the pages of every command show the same lines.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from bim.account import NOT_USABLE
from bim.model import Building, Space
from bim.report.issue import Audience, Issue, issue_note
from bim.report.ranking import Ranked, ranked
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.peaks import peak_note
from scenes.fenestration.resolver import source_notes, window_sources
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_system import thermal_system
from scenes.language.catalogue import N_
from scenes.toml_file import validated

# Labels of the issues in a head, by severity, the gravest first; "info" changes nothing
LABELS = {
    "loss": Note("left out"),
    "warning": Note("warning"),
    "unused": Note("not used"),
    "assumption": Note("assumed"),
}
TREES = "trees-by-month"
NOTED = ("rooms-joined-by-size", TREES)  # codes of issues that are notes of a result's pages
SHOWN = 8  # kinds of issues of a severity that a head lists; of what is left out it lists all
FAR_SITE_DEG = 2.0  # a weather station further than this from the building's site is reported
FAR_SITE = N_(  # template of that note
    "The site of the building ({building}) is far from the weather station {station} ({position}); "
    "the solar positions are those of the weather station."
)


@dataclass(frozen=True, slots=True)
class Head:
    """What was left out of the inputs of a result, and what was assumed."""

    model: tuple[str, ...]  # rooms and glass that were read, and a verdict
    issues: tuple[Issue, ...] = ()  # of the building model
    assumed: tuple[str, ...] = ()  # sentences: of use, systems, weather and site
    noted: tuple[str, ...] = ()  # sentences of the model for pages that list its issues apart

    @property
    def lines(self) -> tuple[str, ...]:
        """The head as the terminal and the pages show it."""
        return self.text("command")

    @property
    def notes(self) -> tuple[str, ...]:
        """The assumptions as sentences, for a page that has account and issues elsewhere."""
        return (*self.noted, *self.assumed)

    def further(self, notes: Iterable[str]) -> tuple[str, ...]:
        """Those of the notes that the head does not have, each once."""
        known = {*self.lines, *self.notes}
        return tuple(note for note in _once(notes) if note not in known)

    def text(self, audience: Audience) -> tuple[str, ...]:
        """The lines of the head; audience: whom the fixes are for."""
        of_model = (
            Note("{label}: {text}", label=label, text=text)
            for severity, label in LABELS.items()
            for text in _issue_lines(self.issues, severity, audience)
        )
        assumed = (Note("assumed: {text}", text=text) for text in self.assumed)
        return (*self.model, *of_model, *assumed)

    def with_assumptions(self, sentences: Iterable[str]) -> Head:
        """The head with further assumptions."""
        return replace(self, assumed=tuple(dict.fromkeys([*self.assumed, *sentences])))

    @property
    def record(self) -> dict[str, list[Any]]:
        """The head as data for a JSON file: issues by kind, the largest glass area first."""
        return {
            "model": list(self.model),
            "issues": [
                {
                    "code": one.first.code,
                    "severity": one.first.severity,
                    "count": one.count,
                    "glass_m2": round(one.glass, 3),
                    "where": one.first.where,
                    "text": one.text("command").line,
                }
                for one in ranked(self.issues)
            ],
            "assumed": list(self.assumed),
        }


NO_HEAD = Head(())


class IssueRecord(BaseModel):
    """An issue as `Head.record` holds it, of which the lines need this."""

    severity: str
    text: str


class HeadRecord(BaseModel):
    """A head as `Head.record` holds it."""

    model: tuple[str, ...]
    issues: tuple[IssueRecord, ...]
    assumed: tuple[str, ...]


def record_lines(record: Any, file: Path) -> tuple[str, ...]:
    """The lines of a head from its record in a JSON file; `DataError` where it is none."""
    head = validated(HeadRecord, record, file)
    issues = (
        f"{label}: {one.text}" for severity, label in LABELS.items() for one in head.issues if one.severity == severity
    )
    return (*head.model, *issues, *(f"assumed: {text}" for text in head.assumed))


def joined(heads: Iterable[Head]) -> Head:
    """One head of several results, each line once."""
    heads = list(heads)
    issues = {(issue.code, issue.where, str(issue.values)): issue for head in heads for issue in head.issues}
    return Head(
        _once(line for head in heads for line in head.model),
        tuple(issues.values()),
        _once(line for head in heads for line in head.assumed),
        _once(line for head in heads for line in head.noted),
    )


def head_of(
    building: Building,
    spaces: Sequence[Space] = (),
    systems: Mapping[str, States] | None = None,
    weather: Weather | None = None,
    *,
    notes: Iterable[str] = (),
    light_only: bool = False,
) -> Head:
    """The head of what is computed of a building.

    Args:
        spaces: the rooms that are computed; systems: of their windows, by GUID.
        notes: further assumptions; light_only: neither U nor g of the systems is used.
    """
    systems = systems or {}
    windows = [w for space in spaces for w in space.windows if w.guid in systems]
    used = {id(state): state for states in systems.values() for state in states}.values()
    assumed = [
        *notes,
        *source_notes(window_sources(windows, systems)),
        *system_notes(used, light_only=light_only),
        *([] if weather is None else [*weather.notes, *site_notes(building, weather)]),
    ]
    issues = issues_of(building, spaces)
    elsewhere = len(building.issues) - len(issues)
    others = [
        Note(
            "{count} problems of rooms that are not computed are not listed: cfs check lists them",
            "{count} problem of rooms that are not computed is not listed: cfs check lists it",
            count=elsewhere,
        )
    ]
    model = (*model_lines(building), *(others if elsewhere else ()))
    return Head(model, issues, _once(assumed), model_notes(building, issues))


def issues_of(building: Building, spaces: Sequence[Space] = ()) -> tuple[Issue, ...]:
    """The issues that concern these rooms or the whole model: not those of the other rooms alone.

    Args: spaces: all where empty.
    """
    chosen = {space.guid for space in spaces or building.spaces}
    used = {guid for space in building.spaces if space.guid in chosen for guid in _guids(space)}
    others = {guid for space in building.spaces if space.guid not in chosen for guid in _guids(space)} - used
    labels = {space.label: space.guid in chosen for space in building.spaces}
    return tuple(
        issue
        for issue in building.issues
        if issue.where not in others and _names_one(issue.values.get("rooms"), labels)
    )


def _names_one(rooms: object, chosen: Mapping[str, bool]) -> bool:
    """Whether rooms that an issue names by their labels are chosen ones in part; True where it names none."""
    if not isinstance(rooms, tuple) or not rooms or not all(room in chosen for room in rooms):
        return True
    return any(chosen[room] for room in rooms)


def _guids(space: Space) -> Iterable[str]:
    """A room, its windows and the building elements that bound it."""
    yield space.guid
    for window in space.windows:
        yield window.guid
    for face in space.faces:
        if face.element is not None:
            yield face.element


def model_lines(building: Building) -> tuple[str, ...]:
    """Rooms and glass that were read; with the verdict where the reader gives an account."""
    if building.account is not None:
        return building.account.lines
    if not building.spaces:
        return (Note("Elements read: {count}", count=len(building.elements)),)
    glass = sum(window.area for window in building.windows)
    return (
        Note("Rooms read: {count}", count=len(building.spaces)),
        Note(
            "Glass: {area:.1f} m2 in {count} windows",
            "Glass: {area:.1f} m2 in {count} window",
            area=glass,
            count=len(building.windows),
        ),
    )


def _issue_lines(issues: Iterable[Issue], severity: str, audience: Audience) -> list[str]:
    """The issues of a severity by kind, the largest glass area first."""
    kinds = ranked([issue for issue in issues if issue.severity == severity])
    shown = len(kinds) if severity == "loss" else SHOWN
    lines = [_issue_line(kind, audience) for kind in kinds[:shown]]
    rest = kinds[shown:]
    if rest:
        more = Note(
            "{count} more problems: cfs check lists all",
            "{count} more problem: cfs check lists all",
            count=sum(one.count for one in rest),
        )
        lines.append(_with_glass(more, sum(one.glass for one in rest)))
    return lines


def _issue_line(one: Ranked, audience: Audience) -> str:
    text = one.text(audience, Note)
    parts = {"what": text.what, "effect": text.effect}
    if text.fix:
        line = Note("{what}: {effect}; {fix}", fix=text.fix, **parts)
    else:
        line = Note("{what}: {effect}", **parts)
    return _with_glass(line, one.glass)


def _with_glass(line: Note, area: float) -> Note:
    """A line with the area of the glass that it concerns [m2], where there is one."""
    return Note("{line} ({area:.2f} m2 of glass)", line=line, area=area) if area else line


def model_notes(building: Building, issues: Iterable[Issue]) -> tuple[str, ...]:
    """Why the model cannot be used, what was joined, and what no result depends on."""
    account = building.account
    verdict = account.lines[:1] if account is not None and account.verdict == NOT_USABLE else ()
    issues = (issue for issue in issues if issue.severity == "unused" or issue.code in NOTED)
    return (*verdict, *map(issue_note, issues))


def unused_notes(building: Building) -> tuple[str, ...]:
    """Uses, sensors and views of a building's file that a command does not use."""
    parts = (building.uses, building.grids, building.views)
    if not any(map(len, parts)) or building.file is None:
        return ()
    note = Note(
        "{file} contains uses of rooms ({uses}), sensor grids ({grids}) and views ({views}); they are not used here.",
        file=building.file.name,
        uses=len(building.uses),
        grids=len(building.grids),
        views=len(building.views),
    )
    return (note,)


def tree_notes(building: Building) -> tuple[str, ...]:
    """How much light the trees outdoors let pass."""
    return tuple(issue_note(issue) for issue in building.issues if issue.code == TREES)


def _once(lines: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(lines))


def system_notes(systems: Iterable[FenestrationSystem], *, light_only: bool = False) -> tuple[str, ...]:
    """What was assumed of fenestration systems: bands, see-through peaks, U, g and window model."""
    systems = list(systems)
    stated = [system for system in systems if system.between is None]  # tilts between have the data of these
    notes = [note for system in systems for note in system.notes]
    notes += [note for system in stated for note in peak_note(system)]
    for heat in [] if light_only else map(thermal_system, stated):
        notes += [*heat.notes, heat.named_model]
    return tuple(dict.fromkeys(notes))


def site_notes(building: Building, weather: Weather) -> tuple[str, ...]:
    """A sentence where building and weather lie far apart."""
    if building.latitude_deg is None or building.longitude_deg is None:
        return ()
    north = building.latitude_deg - weather.latitude_deg
    east = (building.longitude_deg - weather.longitude_deg + 180) % 360 - 180
    if max(abs(north), abs(east)) <= FAR_SITE_DEG:
        return ()
    note = Note(
        FAR_SITE,
        building=position_words(building.latitude_deg, building.longitude_deg),
        station=weather.site,
        position=position_words(weather.latitude_deg, weather.longitude_deg),
    )
    return (note,)


def position_words(latitude_deg: float, longitude_deg: float) -> Note:
    """Latitude and longitude in words."""
    north, east = abs(float(latitude_deg)), abs(float(longitude_deg))
    if latitude_deg >= 0 and longitude_deg >= 0:
        return Note("{north:.1f}° N, {east:.1f}° E", north=north, east=east)
    if latitude_deg >= 0:
        return Note("{north:.1f}° N, {east:.1f}° W", north=north, east=east)
    if longitude_deg >= 0:
        return Note("{north:.1f}° S, {east:.1f}° E", north=north, east=east)
    return Note("{north:.1f}° S, {east:.1f}° W", north=north, east=east)
