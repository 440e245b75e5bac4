"""The files of a check against rules: dossier, values, BCF topics, the model's problems."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
from markupsafe import Markup

from bim.bcf import Topic, in_model, write_topics
from bim.building_file import is_ifc
from bim.names import natural_key
from bim.report.issue import COLUMNS, Issue, issue_rows
from bim.sensors import view_point
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import write_table, write_text
from scenes.comply import tables
from scenes.comply.assess import NO_VERDICT, NOT_COMPUTED, BuildingVerdict, RoomVerdict, assess_building
from scenes.comply.dwellings import OF_DWELLING
from scenes.comply.findings import SeatGlare
from scenes.comply.results import ONE_STATE, CheckedRoom, Compliance, GridSummary
from scenes.comply.rules import NOT_MET, RuleTable
from scenes.comply.tables import limit_of, missed, shown, values_frame
from scenes.figures.chart import Chart, ChartMark, box
from scenes.figures.plan import FloorPlan, plan, plan_frame
from scenes.figures.rose import RosePlan
from scenes.figures.scale import ColourScale, Tick
from scenes.language.catalogue import decimal, gettext, in_language, ngettext, translated
from scenes.language.numbers import colon, day_and_month, listed, rounded, semicolons
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report.glare_figures import compass, glare_plan
from scenes.report.names import stage_words
from scenes.report.page import FILES as SHARED
from scenes.report.page import environment, head_lines
from scenes.report.page_files import page_files
from scenes.report.room import RoomSection, facts
from scenes.report.tables import Table, problems_table
from scenes.result_folder import DOSSIER, ResultFolder

NAMED = 4  # rooms that a sentence names; of more the rest is counted


def answers(result: Compliance) -> tuple[tuple[str, str], ...]:
    """Title and sentence of each criterion that is for a room: level, rooms below the least one.

    Levels and titles are in the page's language.
    """
    sentences = [
        (verdict, _sentence(result, verdict))
        for verdict in result.verdicts
        if verdict.rooms and verdict.criterion.over != "no building"
    ]
    return tuple((f"{result.rules[one.rule].edition}, {gettext(one.criterion.title)}", text) for one, text in sentences)


def _sentence(result: Compliance, verdict: BuildingVerdict) -> str:
    """Such as "medium. 9 of 12 rooms reach at least minimum; below: A, B and C."."""
    asked = [
        (room, one)
        for room in result.rooms
        for one in room.verdicts
        if one.rule == verdict.rule and one.criterion.key == verdict.criterion.key and one.asked and one.applies
    ]
    unknown = [room.space.label for room, one in asked if one.reached in (NOT_COMPUTED, NO_VERDICT)]
    missed = [_short_of(room.space.label, one) for room, one in asked if one.reached == NOT_MET]
    met = len(asked) - len(unknown) - len(missed)
    criterion = verdict.criterion
    parts = [f"{_capital(gettext(criterion.words_of(verdict.reached)))}."]
    parts += _as_one_dwelling(result, verdict)
    if missed and criterion.missed != NOT_MET:
        parts = [f"{colon(_capital(gettext(criterion.missed)), _names(missed))}."]
    elif missed and not met and not unknown:
        parts.append(gettext("No room meets it: {rooms}.", rooms=_names(missed)))
    elif missed:
        parts.append(
            ngettext(
                "{count} of {all} rooms meets it; not: {rooms}.",
                "{count} of {all} rooms meet it; not: {rooms}.",
                met,
                all=len(asked),
                rooms=_names(missed),
            )
        )
    elif asked and not unknown:
        both = len(asked) == 2
        all_of_them = ngettext("The one room meets it.", "All {count} rooms meet it.", len(asked))
        parts.append(gettext("Both rooms meet it.") if both else all_of_them)
        parts += _least_favourable(asked)
    if unknown and len(unknown) < len(asked):  # else the level says so
        parts.append(gettext("Not computed: {rooms}.", rooms=_names(unknown)))
    rule = result.rules[verdict.rule]
    of_glare = any("glare" in need.parts for level in verdict.criterion.level for need in level.needs)
    if unknown and not rule.fits(result.weather):
        parts.append(gettext("It asks for the weather of {sites}.", sites=rule.weather_asked))
    elif unknown and not rule.judges(result.weather):
        parts.append(gettext("It asks for weather whose header states {words}.", words=rule.header[0]))
        parts += _least_favourable([(room, one) for room, one in asked if one.values[0][0] is not None])
    elif unknown and of_glare and all(room.light is None or room.light.glare is None for room, _ in asked):
        parts.append(gettext("Annual glare was not asked for."))
    rated = [room.light.glare for room, _ in asked if room.light is not None and room.light.glare is not None]
    if rated and of_glare:
        moved = result.blinds == ONE_STATE or any(glare.operated for glare in rated)
        blinds = translated(result.blinds) if moved else gettext("all blinds open")
        parts.append(gettext("Rated with {blinds}.", blinds=blinds))
    return " ".join(parts)


def _as_one_dwelling(result: Compliance, verdict: BuildingVerdict) -> Iterator[str]:
    """The level of the building if all its rooms are one dwelling, where none is named and it is another."""
    criterion = verdict.criterion
    if criterion.over != OF_DWELLING or any(room.use.dwelling for room in result.rooms):
        return
    own = [
        (room, one)
        for room in result.rooms
        for one in room.verdicts
        if one.rule == verdict.rule and one.criterion.key == criterion.key and one.applies
    ]
    areas = [room.space.floor_area for room, _ in own]
    homes = [criterion.key for _ in own]
    (whole,) = assess_building([(one,) for _, one in own], areas, homes) if own else (verdict,)
    if whole.reached == verdict.reached:
        return
    best = [room.space.label for room, one in own if one.reached == whole.reached]
    yield gettext(
        "No dwelling is named, and each room is taken as one; if all rooms are one dwelling: {level} ({rooms}). A "
        "mapping file (--uses) names dwellings.",
        level=gettext(criterion.words_of(whole.reached)),
        rooms=_names(best),
    )


def _least_favourable(asked: Sequence[tuple[CheckedRoom, RoomVerdict]]) -> Iterator[str]:
    """The room nearest to the limit, where the criterion is one value against one limit."""
    if not asked:
        return
    (_, first), *_ = asked
    if len(first.criterion.level) > 1 or len(first.criterion.level[0].needs) > 1:
        return
    (need,) = first.criterion.level[0].needs
    sign = 1.0 if need.at_least is not None else -1.0
    room, worst = min(asked, key=lambda one: sign * (one[1].values[0][0] or 0.0))
    value = shown(need, worst.values[0][0])
    yield gettext(
        "Least favourable: {room} ({value}, limit {limit}).", room=room.space.label, value=value, limit=limit_of(need)
    )


def _short_of(room: str, verdict: RoomVerdict) -> str:
    """A room with the first value of the lowest level that misses its limit, and this limit."""
    for need, value in zip(verdict.criterion.level[0].needs, verdict.values[0], strict=True):
        if need.met(value) is False:
            return gettext("{room} ({value}, limit {limit})", room=room, value=shown(need, value), limit=limit_of(need))
    return room


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _names(rooms: list[str]) -> str:
    """The first rooms by name, the rest counted."""
    if len(rooms) <= NAMED:
        return listed(rooms)
    rest = len(rooms) - NAMED
    return gettext("{names} and {count} more", names=", ".join(rooms[:NAMED]), count=rest)


FIRST_HOUR, LAST_HOUR = 4, 21  # of the sun's bars
# plans of the light, and the needs of rules that look at what they show, the nearest first
LIGHT_PLANS = {
    "half time": ("reached_lux",),
    "daylight factor": ("reached_factor",),
    "daylight autonomy": ("sda", "view_free", "leni", "mean_hours", "worst_hours", "equinox"),
    "sunlit hours": ("ase",),
}
MOST_BARS = 12  # openings with a bar of their own
MOST_LETTERS = 28  # of the name beside a bar


def plans(result: Compliance, room: CheckedRoom) -> tuple[FloorPlan, ...]:
    """Plans of what the rules look at in a room."""
    return (*_view_plans(result, room), *_light_plans(result, room), *_glare_plans(room))


def _view_plans(result: Compliance, room: CheckedRoom) -> Iterator[FloorPlan]:
    wanted = any("view" in rule.parts for rule in result.rules.values())
    if room.view is None or not wanted:
        return
    frame = plan_frame(room.space, room.view.points)
    angle = room.view.sight_angle_deg
    title = gettext("Horizontal sight angle")
    scale = ColourScale(0, 90, title, "°")
    text = gettext("{least} to {most}°.", least=rounded(float(np.min(angle)), 0), most=rounded(float(np.max(angle)), 0))
    yield plan(frame, angle, scale, title=title, explanation=text)
    layers = room.view.layer_count
    scale = ColourScale(0, 3, gettext("Layers"), "")
    text = gettext("Layers (landscape, sky, ground) visible through one opening; 0 where the landscape is not visible.")
    yield plan(frame, layers, scale, title=gettext("Layers of the view"), explanation=text)


def _light_plans(result: Compliance, room: CheckedRoom) -> Iterator[FloorPlan]:
    """One plan of each quantity, on the grid of the first rule that asks for it."""
    for kind, needs in LIGHT_PLANS.items():
        asking = _asking(result, room, needs)
        if asking is None:
            continue
        name, grid = asking
        frame = plan_frame(room.space, grid.points)
        height = decimal(f"{grid.points[0, 2] - room.space.floor_level:.2f}")
        of_grid = gettext("Grid of {rule}, {height} m above the floor.", rule=result.rules[name].edition, height=height)
        if kind == "daylight factor":
            title, factor = gettext("Daylight factor"), 100 * grid.factor
            scale = ColourScale(0, max(float(np.ceil(factor.max())), 1.0), title, "%")
            text = gettext("Overcast sky.") + " " + of_grid
            yield plan(frame, factor, scale, title=title, explanation=text, digits=1)
        elif kind == "half time":
            title = gettext("Illuminance in half of the daylight hours")
            top = float(max(np.ceil(grid.half_time.max() / 250) * 250, 750))
            scale = ColourScale(0, top, gettext("Illuminance"), "lx")
            text = gettext("Reached in half of the daylight hours, blinds open.") + " " + of_grid
            yield plan(frame, grid.half_time, scale, title=title, explanation=text)
        elif kind == "daylight autonomy":
            title = gettext("Daylight autonomy")
            scale = ColourScale(0, 100, title, "%")
            text = (
                gettext("300 lx, 8 to 18 o'clock, blinds open.")
                if grid.closed is None
                else gettext("300 lx, 8 to 18 o'clock, blinds operated.")
            )
            text += " " + of_grid
            yield plan(frame, 100 * grid.autonomy, scale, title=title, explanation=text)
        elif grid.sunlit_hours.any():
            title = gettext("Sunlit hours")
            top = float(np.ceil(grid.sunlit_hours.max() / 50) * 50)
            scale = ColourScale(0, top, gettext("Direct sun"), "h")
            text = gettext("1000 lx of direct sun, 8 to 18 o'clock, blinds open.") + " " + of_grid
            yield plan(frame, grid.sunlit_hours, scale, title=title, explanation=text)


def _asking(result: Compliance, room: CheckedRoom, needs: Sequence[str]) -> tuple[str, GridSummary] | None:
    """Name and grid of the first rule with the first of some needs; None where no rule has any."""
    grids = {} if room.light is None else room.light.grids
    for wanted in needs:
        for name, grid in grids.items():
            criteria = result.rules[name].criterion
            if any(need.what == wanted for one in criteria for need in one.needs):
                return name, grid
    return None


def _glare_plans(room: CheckedRoom) -> Iterator[FloorPlan]:
    glare = None if room.light is None else room.light.glare
    if glare is None or glare.plan is not None or len(glare.eyes) == 1:
        return
    eyes, seat = np.unique(glare.eyes, axis=0, return_inverse=True)
    worst = np.zeros(len(eyes))  # of the directions of each eye
    np.maximum.at(worst, seat.ravel(), glare.not_exceeded())
    frame = plan_frame(room.space, eyes)
    scale = ColourScale(0.2, 0.6, gettext("Daylight glare probability"), "")
    text = (
        gettext("DGP exceeded in 5 % of the hours of use, worst direction of each seat, blinds operated.")
        if glare.operated
        else gettext("DGP exceeded in 5 % of the hours of use, worst direction of each seat, blinds open.")
    )
    yield plan(frame, worst, scale, title=gettext("Glare"), explanation=text, digits=2)


def shortened(name: str) -> str:
    """A name without its middle where it would take the room of the bars beside it."""
    half = MOST_LETTERS // 2
    return name if len(name) <= MOST_LETTERS else f"{name[:half]}…{name[-half:]}"


def sun_bars(result: Compliance, room: CheckedRoom) -> Chart | None:
    """When the sun may shine on each opening, and on any."""
    wanted = any("sun" in rule.parts for rule in result.rules.values())
    if room.sun is None or not wanted or not room.sun.openings:
        return None
    openings = room.sun.openings[:MOST_BARS]
    rows = [(gettext("any opening"), room.sun.times)]
    rows += [(shortened(one.name), one.times) for one in openings]
    count = len(rows)
    x_range, y_range = (60.0 * FIRST_HOUR, 60.0 * LAST_HOUR), (0.0, float(count))
    marks = []
    for style, some in (("part1", rows[:1]), ("part0", rows[1:])):
        start = 0 if style == "part1" else 1
        path = "".join(
            box(a, b, count - 1 - i + 0.2, count - i - 0.2, x_range, y_range)
            for i, (_, times) in enumerate(some, start)
            for a, b in times
        )
        marks.append(ChartMark(path, style, filled=True))
    hours = range(FIRST_HOUR, LAST_HOUR + 1, 2)
    span = LAST_HOUR - FIRST_HOUR
    more = len(room.sun.openings) - len(openings)
    text = gettext(
        "{date}, local standard time, cloudless: {hours} h at any opening.",
        date=day_and_month(result.day.day),
        hours=rounded(room.sun.hours, 2),
    )
    if more:
        text += " " + ngettext("{count} more opening in the table.", "{count} more openings in the table.", more)
    return Chart(
        gettext("Possible sunlight at the openings"),
        text,
        gettext("Hour"),
        "",
        tuple(Tick(100 * (h - FIRST_HOUR) / span, str(h), "") for h in hours),
        tuple(Tick(100 * (count - i - 0.5) / count, name, "", False) for i, (name, _) in enumerate(rows)),
        tuple(marks),
        height=30 + 18 * count,
    )


FILES = page_files("scenes.comply")


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
    glare: RosePlan | None


def dossier_html(result: Compliance, *, quick: bool = False, page: PageOptions = OWN_PAGE) -> str:
    """The dossier as text: no script, font or picture is fetched from anywhere."""
    with in_language(page.language):
        return _filled(result, quick=quick, page=page)


def _filled(result: Compliance, *, quick: bool, page: PageOptions) -> str:
    by_name = sorted(result.rooms, key=lambda room: natural_key(room.space.label))
    rooms = [dossier_room(result, room, i) for i, room in enumerate(by_name, 1)]
    style = (SHARED["style.css"], FILES["dossier.css"])
    return (
        environment(FILES)
        .get_template("dossier.html.j2")
        .render(
            page=page,
            title=page.title or result.building.name or gettext("Building"),
            facts=summary(result) + page.facts,
            answers=answers(result),
            quick=gettext(NOTE) if quick else "",
            notes=head_lines(result.head, result.notes),
            assumptions=[translated(text) for text in result.assumptions],
            settings=[translated(text) for text in result.settings],
            rules=[dossier_rule(result, name) for name in result.rules],
            rooms=rooms,
            problems=problems_table(result.issues),
            version=metadata.version("mitsuba-cfs"),
            seconds=_seconds(result.seconds),
            style=Markup("\n".join(style)),
        )
    )


def _seconds(stages: Mapping[str, float]) -> str:
    """The computing time of each stage."""
    return ", ".join(f"{stage_words(stage)} {decimal(f'{value:g}')} s" for stage, value in stages.items())


def dossier_rule(result: Compliance, name: str) -> DossierRule:
    """Tables of a rule."""
    return DossierRule(
        result.rules[name],
        tables.building_table(result, name),
        tables.rooms_table(result, name),
        tables.without_rooms(result, name),
    )


def dossier_room(result: Compliance, room: CheckedRoom, number: int) -> DossierRoom:
    """Tables and drawings of a room."""
    room_tables = [tables.room_table(result, room, name) for name in result.rules]
    return DossierRoom(
        f"room-{number}",
        gettext("Room {room}", room=room.space.label),
        room_facts(room),
        plans(result, room),
        tuple(tables.missed(result.rules, room)),
        tuple(table for table in room_tables if table.rows),
        sun_bars(result, room),
        tables.openings_table(room, result.building),
        _glare_rose(room),
    )


def _glare_rose(room: CheckedRoom) -> RosePlan | None:
    """The glare map of a room; None where its seats were stated, or glare is not asked for."""
    glare = None if room.light is None else room.light.glare
    return None if glare is None or glare.plan is None else glare_plan(room.space, glare.plan)


def _glare_maps(result: Compliance) -> pd.DataFrame | None:
    """The glare maps of all rooms, with the room of each row; None without any."""
    found = []
    for room in result.rooms:
        glare = None if room.light is None else room.light.glare
        if glare is not None and glare.plan is not None:
            table = glare.plan.table()
            table.insert(0, "room", room.space.label)
            table.insert(1, "guid", room.space.guid)
            found.append(table)
    return pd.concat(found, ignore_index=True) if found else None


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
                "{some} %, through all windows {every} %", some=rounded(100 * some, 0), every=rounded(100 * every, 0)
            )
            title = gettext("Unobstructed view through at least one window (8 to 18 o'clock)")
            rows.append((title, words))
        if room.light.glare is not None:
            rows.append((gettext("Glare"), glare_words(room.light.glare)))
    return tuple(rows)


def glare_words(glare: SeatGlare) -> str:
    """The number of seats whose glare is rated, and the worst of them."""
    if glare.plan is not None:
        return _map_words(glare)
    seats = len(np.unique(glare.eyes, axis=0))
    directions = len(glare.eyes) // seats
    dgp = rounded(float(glare.not_exceeded().max()), 2)
    if directions > 1:
        return ngettext(
            "{count} seat, {directions} directions; DGP exceeded in 5 % of the hours: {dgp} at the worst",
            "{count} seats, {directions} directions each; DGP exceeded in 5 % of the hours: {dgp} at the worst",
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


def _map_words(glare: SeatGlare) -> str:
    """The worst seat of a glare map, and how its hours are rated."""
    seat = int(np.argmax(glare.not_exceeded()))
    x, y, _ = glare.eyes[seat]
    where = gettext(
        "worst view of the map: x {x} m, y {y} m, looking {compass}; DGP exceeded in 5 % of the hours: {dgp}",
        x=rounded(float(x), 1),
        y=rounded(float(y), 1),
        compass=gettext(compass(glare.directions[seat])),
        dgp=rounded(float(glare.not_exceeded()[seat]), 2),
    )
    hours = 0 if glare.pictured is None else int(glare.pictured.sum())
    if not hours:
        return semicolons([where, gettext("decided by the map")])
    rated = ngettext("{count} hour rated by pictures", "{count} hours rated by pictures", hours)
    return semicolons([where, rated])


def summary(result: Compliance) -> tuple[tuple[str, str], ...]:
    """What was checked, in a few facts."""
    building, weather = result.building, result.weather
    file = "" if building.file is None else building.file.name
    median = result.calendar.median_diffuse
    rows = [
        (gettext("Model"), file or building.name),
        (gettext("Weather"), weather.site + (f" ({weather.file.name})" if weather.file else "")),
        (gettext("Rooms"), gettext("{count} of {all}", count=len(result.rooms), all=len(building.spaces))),
        (gettext("Rules"), semicolons([rule.edition for rule in result.rules.values()])),
    ]
    if median is not None and any("open" in rule.parts for rule in result.rules.values()):
        rows.append((gettext("Median diffuse illuminance"), f"{rounded(median, 0)} lx"))
    return tuple(rows)


def write_room_topics(result: Compliance, path: Path) -> None:
    """Write a BCF topic for each room that misses a criterion.

    A topic selects the room by its GUID; its camera stands in the room and looks to the biggest
    window, in the axes of the building's file.
    """
    file = result.building.file
    has_guids = file is None or is_ifc(file)  # the rooms of other formats have no IFC GUID
    rooms = [room for room in result.rooms if any(missed(result.rules, room))]
    topics = [_topic(result, room, has_guids=has_guids) for room in rooms]
    write_topics(topics, path, "" if file is None else file.name)


def _topic(result: Compliance, room: CheckedRoom, *, has_guids: bool) -> Topic:
    sentences = list(missed(result.rules, room))
    what = "criterion" if len(sentences) == 1 else "criteria"
    try:
        camera = in_model(result.building, *view_point(room.space))
    except RoomError:  # a room that is lower than the eye
        camera = None
    return Topic(
        f"comply/{room.space.guid}",
        f"{room.space.label}: {len(sentences)} {what} not met",
        "\n".join(sentences),
        (room.space.guid,) if has_guids else (),
        camera=camera,
    )


SET_NAME = "CFS compliance"
MODEL_CHECK = Path(str(files(__package__) / "model.ids"))  # what a check needs of a model


def write_compliance(
    result: Compliance, folder: ResultFolder, *, quick: bool = False, page: PageOptions = OWN_PAGE
) -> None:
    """Write all files; earlier results are replaced at the end."""
    with folder.replaced() as place:
        write_table(values_frame(result), place / "values.csv", index=False, float_format="%.6g")
        maps = _glare_maps(result)
        if maps is not None:
            write_table(maps, place / "glare_map.csv", index=False, float_format="%.6g")
        rows = issue_rows(result.issues, "command")
        issues = pd.DataFrame(rows, columns=list(COLUMNS))
        write_table(issues, place / "problems.csv", index=False)
        write_text(place / MODEL_CHECK.name, MODEL_CHECK.read_text("utf-8"))
        if any(any(missed(result.rules, room)) for room in result.rooms):
            write_room_topics(result, place / "issues.bcf")
        write_text(place / DOSSIER, dossier_html(result, quick=quick, page=page))


def write_into_ifc(result: Compliance, out: Path) -> tuple[Issue, ...]:
    """Write the building's file with a property set of its levels on each room; what had no place.

    The properties are "RULE CRITERION" with the level that is reached, and "use".
    """
    from bim.ifc.results_write import write_results  # reads IFC

    values = {
        room.space.guid: {"use": room.use.key}
        | {f"{v.rule} {v.criterion.key}": v.reached for v in room.verdicts if v.applies}
        for room in result.rooms
    }
    if result.building.file is None:
        raise ValueError("a building that is not from a file has none to write into")
    return write_results(result.building.file, values, out, set_name=SET_NAME)
