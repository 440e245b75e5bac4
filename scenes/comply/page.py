"""The dossier as one self-contained page that prints: verdicts, rooms, clauses, sources."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import metadata

import numpy as np
from markupsafe import Markup

from scenes.comply import tables
from scenes.comply.drawings import plans, sun_bars
from scenes.comply.findings import SeatGlare
from scenes.comply.results import CheckedRoom, Compliance
from scenes.comply.rules import RuleTable
from scenes.figures.chart import Chart
from scenes.language.catalogue import decimal, gettext, in_language, ngettext, translated
from scenes.language.numbers import colon, rounded, semicolons
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report.names import stage_words
from scenes.report.page import FILES as SHARED
from scenes.report.page import environment, head_lines
from scenes.report.page_files import page_files
from scenes.report.room import RoomSection, facts
from scenes.report.tables import Table, issues_table

FILES = page_files("scenes.comply")
# what does not come apart at the end of a line: a sign and its number, a number and what it counts
TOGETHER = re.compile(
    r"(?<=[≥≤]) (?=\d)|(?<=\d) (?=%|°|lx|h\b|m\b|s\b|K h\b|kWh|points?\b|credits?\b)"
    r"|(?<=\bK) (?=h\b)"
)


@dataclass(frozen=True, slots=True)
class DossierRule:
    """The section of one rule."""

    rule: RuleTable
    building: Table
    rooms: Table
    without: tuple[str, ...]  # titles of criteria that no room is for


@dataclass(frozen=True, slots=True)
class DossierRoom(RoomSection):
    """The section of one room in a dossier."""

    missed: tuple[str, ...]  # a sentence for each criterion that it misses
    tables: tuple[Table, ...]
    sun: Chart | None
    openings: Table | None


def dossier_html(result: Compliance, *, quick: bool = False, page: PageOptions = OWN_PAGE) -> str:
    """The dossier as text: no script, font or picture is fetched from anywhere."""
    with in_language(page.language):
        return _filled(result, quick=quick, page=page)


def _filled(result: Compliance, *, quick: bool, page: PageOptions) -> str:
    rooms = [dossier_room(result, room, i) for i, room in enumerate(result.rooms, 1)]
    style = (SHARED["style.css"], FILES["dossier.css"])
    return environment(FILES).get_template("dossier.html.j2").render(
        page=page,
        title=page.title or result.building.name or gettext("Building"),
        facts=summary(result) + page.facts,
        notes=head_lines(result.head, (*([NOTE] if quick else []), *result.notes)),
        assumptions=[translated(text) for text in result.assumptions],
        rules=[dossier_rule(result, name) for name in result.rules],
        rooms=rooms,
        problems=issues_table(result.issues),
        version=metadata.version("mitsuba-cfs"),
        seconds=tied(_seconds(result.seconds)),
        style=Markup("\n".join(style)),
    )  # fmt: skip


def _seconds(stages: Mapping[str, float]) -> str:
    """The computing time of each stage."""
    return ", ".join(
        f"{stage_words(stage)} {decimal(f'{value:g}')} s" for stage, value in stages.items()
    )


def dossier_rule(result: Compliance, name: str) -> DossierRule:
    """Tables of a rule."""
    return DossierRule(
        result.rules[name],
        tied_table(tables.building_table(result, name)),
        tied_table(tables.rooms_table(result, name)),
        tables.without_rooms(result, name),
    )


def dossier_room(result: Compliance, room: CheckedRoom, number: int) -> DossierRoom:
    """Tables and drawings of a room."""
    found = [tied_table(tables.room_table(result, room, name)) for name in result.rules]
    return DossierRoom(
        f"room-{number}",
        gettext("Room {room}", room=room.space.label),
        room_facts(room),
        plans(result, room),
        tuple(map(tied, tables.missed(room))),
        tuple(table for table in found if table.rows),
        sun_bars(result, room),
        tables.openings_table(room),
    )


def room_facts(room: CheckedRoom) -> tuple[tuple[str, str], ...]:
    """Size, use and blinds of a room in words."""
    template = "" if room.light is None else room.light.template
    use = f"{tables.use_words(room.use)}, {translated(room.use.source)}"
    rows = [*facts(room.space, template), (gettext("Use"), use)]
    if room.use.dwelling:
        rows.append((gettext("Dwelling"), room.use.dwelling))
    if not room.use.occupied:
        words = gettext("not regularly; criteria for occupied rooms do not apply")
        rows.append((gettext("Occupied"), words))
    if room.light is not None:
        grids = list(room.light.grids.values())
        shares = {
            colon(name, f"{rounded(100 * share, 0)} %"): None
            for grid in grids
            if grid.closed is not None
            for name, share in zip(room.light.groups, grid.closed.tolist(), strict=True)
        }
        if shares:
            rows.append((gettext("Blinds closed (8 to 18 o'clock)"), ", ".join(shares)))
        for some, every in {grid.view_free: None for grid in grids if grid.view_free}:
            words = gettext(
                "{some} %, through all windows {every} %",
                some=rounded(100 * some, 0),
                every=rounded(100 * every, 0),
            )
            title = gettext("Unobstructed view through at least one window (8 to 18 o'clock)")
            rows.append((title, words))
        if room.light.glare is not None:
            rows.append((gettext("Glare"), glare_words(room.light.glare)))
    return tuple(rows)


def glare_words(glare: SeatGlare) -> str:
    """The number of seats whose glare is rated, and the worst of them."""
    seats = len(np.unique(glare.eyes, axis=0))
    directions = len(glare.eyes) // seats
    dgp = rounded(float(glare.not_exceeded().max()), 2)
    if directions > 1:
        return ngettext(
            "{count} seat, {directions} directions; DGP exceeded in 5 % of the hours: {dgp} at the "
            "worst",
            "{count} seats, {directions} directions each; DGP exceeded in 5 % of the hours: {dgp} "
            "at the worst",
            seats,
            directions=directions,
            dgp=dgp,
        )
    return ngettext(
        "{count} seat; DGP exceeded in 5 % of the hours: {dgp}",
        "{count} seats; DGP exceeded in 5 % of the hours: {dgp} at the worst",
        seats,
        dgp=dgp,
    )


def tied(text: str) -> str:
    """A text whose numbers stay with their signs and units at the end of a line."""
    return TOGETHER.sub("\N{NO-BREAK SPACE}", text)


def tied_table(table: Table) -> Table:
    """A table with all its cells `tied`."""
    rows = tuple(tuple(tied(cell) for cell in row) for row in table.rows)
    return replace(table, rows=rows)


def summary(result: Compliance) -> tuple[tuple[str, str], ...]:
    """What was checked, in a few facts."""
    building, weather = result.building, result.weather
    file = "" if building.file is None else building.file.name
    median = result.calendar.median_diffuse
    rows = [
        (gettext("Model"), file or building.name),
        (gettext("Weather"), weather.site + (f" ({weather.file.name})" if weather.file else "")),
        (
            gettext("Rooms"),
            gettext("{count} of {all}", count=len(result.rooms), all=len(building.spaces)),
        ),
        (gettext("Rules"), semicolons([rule.edition for rule in result.rules.values()])),
    ]
    if median is not None:
        rows.append((gettext("Median diffuse illuminance"), f"{rounded(median, 0)} lx"))
    return tuple(rows)
