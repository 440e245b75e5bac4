"""The page: templates filled with the figures and tables of a run."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import shapely
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from bim.model import Building
from mitsuba_cfs.files import json_text, write_text
from mitsuba_cfs.notes import Note
from scenes.figures.plan import plan_frame, window_from_above
from scenes.head import FAR_SITE, Head
from scenes.language.catalogue import N_, gettext, in_language, ngettext, translated
from scenes.language.numbers import cell, colon, day_and_month, rounded, semicolons
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report import tables
from scenes.report.method import method_words
from scenes.report.model3d import checked_model, model3d
from scenes.report.names import glossary, option_words, stage_words
from scenes.report.page_files import page_files
from scenes.report.room import room_page
from scenes.report.storeys import RoomMetric, room_metrics, storey_plans
from scenes.report.typography import prose, tied
from scenes.report.verdict import verdict
from scenes.results import RunResult
from scenes.surroundings import NO_SURROUNDINGS, has_surroundings

INNER, OUTER, EDGE = 620.0, 1000.0, 1130.0  # radii of the ring and the picture [SVG units]
DAYS = ((6, 21), (3, 21), (12, 21))  # month and day of the paths
STEPS = 6  # of a path between two hours
COMPASS = (N_("N"), N_("E"), N_("S"), N_("W"))
SOURCES = {  # code of an issue: where north comes from
    "north-corrected": N_("by the corrections file"),
    "north-contradicts-map": N_("by IfcMapConversion; TrueNorth differs"),
    "true-north-from-map": N_("by IfcMapConversion"),
    "true-north-missing": N_("assumed: the file states no north"),
    "true-north-invalid": N_("assumed: TrueNorth is not a direction in the plane"),
}


@dataclass(frozen=True, slots=True)
class Orientation:
    """The picture, and in words where north is."""

    words: str
    view_box: str
    body: str  # SVG inside


def orientation(result: RunResult) -> Orientation:
    """Outlines and windows of all rooms in the ring of the sun's paths."""
    spaces = result.building.spaces
    outlines = [plan_frame(space, np.empty((0, 3))).outline for space in spaces]
    west, south, east, north = shapely.union_all(outlines).bounds
    middle = np.array([(west + east) / 2, (south + north) / 2])
    scale = 0.93 * INNER / max(float(np.hypot(east - west, north - south)) / 2, 0.1)

    def placed(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return (points[..., :2] - middle) * [scale, -scale]

    parts = [
        _circle("ring", OUTER),
        _circle("ground", INNER),
        *(_circle("altitude", _radius(altitude)) for altitude in (30.0, 60.0)),
    ]
    for k, name in enumerate(COMPASS):
        x, y = np.sin(np.pi / 2 * k), -np.cos(np.pi / 2 * k)
        parts.append(_drawn("altitude", [(INNER * x, INNER * y), (OUTER * x, OUTER * y)]))
        at = (OUTER + EDGE) / 2
        parts.append(_text("compass", at * x, at * y, gettext(name)))
    for month, day in DAYS:
        parts += _path(result, month, day)
    for space, outline in zip(spaces, outlines, strict=True):
        for part in shapely.get_parts(outline):
            ring = placed(shapely.get_coordinates(part.exterior))
            parts.append(_drawn("floor", ring, closed=True))
        for window in space.windows:
            ends = placed(window_from_above(window))
            parts.append(_drawn("window", ends, closed=len(ends) > 2))
    angle = model_axis_deg(result.building)
    if angle is not None:
        x, y = np.sin(np.radians(angle)), -np.cos(np.radians(angle))
        tip = np.array([x, y]) * INNER
        parts.append(_drawn("axis", [0.8 * tip, tip]))
        parts.append(_text("axis-name", 0.72 * tip[0], 0.72 * tip[1], "+y"))
    box = " ".join(f"{v:.0f}" for v in (-EDGE, -EDGE, 2 * EDGE, 2 * EDGE))
    return Orientation(_words(result.building, angle), box, "".join(parts))


def model_axis_deg(building: Building) -> float | None:
    """Direction of the +y axis of the building's file, from north to east [deg]."""
    if building.from_model is None:
        return None
    east, north = building.from_model[:2, 1]
    return float(np.degrees(np.arctan2(east, north)))


def _words(building: Building, angle: float | None) -> str:
    north = gettext("North is up in all plans.")
    if angle is None:
        return north
    codes = {issue.code for issue in building.issues}
    source = next((text for code, text in SOURCES.items() if code in codes), N_("by TrueNorth"))
    side = gettext("{angle}° east of north") if angle > -0.05 else gettext("{angle}° west of north")
    axis = gettext(
        "The model's +y axis points {direction} ({source}). If the building does not lie so, set "
        "north in the corrections file.",
        direction=side.format(angle=rounded(abs(angle), 1)),
        source=gettext(source),
    )
    return f"{north} {axis}"


def _path(result: RunResult, month: int, day: int) -> list[str]:
    """The path of the sun on a day that the run has, from rise to set."""
    on = np.flatnonzero((result.times.month == month) & (result.times.day == day))
    if len(on) < 2:
        return []
    steps = np.arange(0, len(on) - 1, 1 / STEPS)
    sun = np.stack([np.interp(steps, np.arange(len(on)), axis) for axis in result.sun[on].T], axis=1)
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    points = [_on_ring(one) for one in sun[sun[:, 2] > 0]]
    if not points:
        return []
    name = day_and_month(result.times[on[0]], short=True)
    x, y = points[len(points) // 2]
    return [_drawn("sun", points), _text("day", x, y - 38, name)]


def _on_ring(sun: NDArray[np.float64]) -> tuple[float, float]:
    east, north = sun[:2] / np.hypot(sun[0], sun[1])
    radius = _radius(float(np.degrees(np.arcsin(sun[2]))))
    return radius * float(east), -radius * float(north)


def _radius(altitude: float) -> float:
    return OUTER - (OUTER - INNER) * altitude / 90.0


def _drawn(style: str, points: Iterable[ArrayLike], *, closed: bool = False) -> str:
    path = "L".join(f"{x:.1f} {y:.1f}" for x, y in map(np.asarray, points))
    return f'<path class="{style}" d="M{path}{"Z" if closed else ""}"/>'


def _circle(style: str, radius: float) -> str:
    return f'<circle class="{style}" r="{radius:.0f}"/>'


def _text(style: str, x: float, y: float, text: str) -> str:
    return f'<text class="{style}" x="{x:.0f}" y="{y:.0f}">{text}</text>'


FILES = page_files("scenes.report")  # that other pages share
SCRIPTS = ("tables.js", "pointer.js", "viewer.js", "storeys.js")
SAVING = "figures.js"  # of pages with figures to save


def write_report(result: RunResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the report of a run as one self-contained HTML file."""
    write_text(path, report_html(result, page))


def report_html(result: RunResult, page: PageOptions = OWN_PAGE) -> str:
    """The report as text: no script, font or picture is fetched from anywhere."""
    if not result.spaces:
        raise ValueError("a report needs at least one room")
    with in_language(page.language):
        return _filled(result, page)


def write_check(building: Building, head: Sequence[str], path: Path, before: Building | None = None) -> None:
    """Write the check of a model as one HTML file: head, 3D model, problems.

    Args: head: its first lines; before: the same file without its corrections.
    """
    text = (
        environment()
        .get_template("check.html.j2")
        .render(
            page=OWN_PAGE,
            title=building.name or gettext("Building"),
            head=head,
            model=checked_model(building, before),
            problems=tables.problems_table(building.issues),
            style=Markup(FILES["style.css"]),
            scripts=Markup("\n".join(FILES[name] for name in SCRIPTS[:-1])),
        )
    )
    write_text(path, text)


def _filled(result: RunResult, page: PageOptions) -> str:
    rooms = tuple(room_page(result, room, i) for i, room in enumerate(result.spaces, start=1))
    manifest = result.manifest
    model = model3d(result)
    several = len(rooms) > 1
    alone = () if has_surroundings(result.building) else (NO_SURROUNDINGS,)
    metrics = room_metrics(result) if several else ()
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            page=page,
            title=page.title or result.building.name or gettext("Building"),
            result=result,
            head=head_lines(result.head, (*result.notes, *alone)),
            rooms=rooms,
            verdict=verdict(result, [room.cards for room in rooms]),
            model=model,
            orientation=orientation(result),
            comparison=comparison(result, rooms),
            metrics=metrics,
            storeys=storey_plans(result) if several else (),
            storey_data=storey_data(metrics, len(rooms)),
            summary=summary(result) + page.facts,
            problems=tables.problems_table(result.issues),
            version=manifest.get("versions", {}).get("mitsuba-cfs", ""),
            inputs=inputs_table(manifest.get("inputs", {})),
            options=options_table(manifest),
            versions=tables.nested_table(gettext("Versions"), manifest.get("versions", {})),
            rest=tables.nested_table(gettext("Run"), remaining(manifest)),
            timings=timings_table(result),
            method=method_words(result),
            glossary=glossary(),
            style=Markup(FILES["style.css"]),
            scripts=Markup("\n".join(FILES[name] for name in (*SCRIPTS, SAVING))),
        )
    )


def storey_data(metrics: Sequence[RoomMetric], rooms: int) -> list[dict[str, Any]]:
    """Words and colours of every room, for the plans of the storeys."""
    return [
        {
            "unit": metric.scale.unit,
            "rooms": [
                [metric.words(i), metric.scale.hex(metric.values[i]), metric.scale.ink(metric.values[i])]
                for i in range(rooms)
            ],
        }
        for metric in metrics
    ]


def environment(own: Mapping[str, str] | None = None) -> jinja2.Environment:
    """Templates; everything inserted is escaped unless marked as markup.

    Args: own: files of a page of another package, beside those that all share.
    """
    environment = jinja2.Environment(
        loader=jinja2.DictLoader({**FILES, **(own or {})}),
        autoescape=True,
        extensions=["jinja2.ext.i18n"],
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["script_json"] = script_json
    environment.filters["packed_json"] = packed_json
    environment.filters["tied"] = tied
    environment.filters["headed"] = headed
    environment.install_gettext_callables(gettext, ngettext)
    return environment


def headed(text: object) -> str:
    """A heading with the page's colon after it."""
    return colon(str(text), "").rstrip(" ")


def script_json(value: object) -> Markup:
    """JSON that is safe inside a script element: no `<` can end it."""
    return Markup(json_text(value, separators=(",", ":")).replace("<", "\\u003c"))


def packed_json(value: object) -> str:
    """JSON for a script to unpack when it is asked for: deflated without a header, base64."""
    text = json_text(value, separators=(",", ":")).encode()
    packer = zlib.compressobj(9, wbits=-15)
    return base64.b64encode(packer.compress(text) + packer.flush()).decode("ascii")


def summary(result: RunResult) -> tuple[tuple[str, str], ...]:
    """The run in a few facts."""
    building = result.building
    rows = [(gettext("Run"), gettext(NOTE))] if result.manifest.get("quick") else []
    rows.append((gettext("Building"), building.name or gettext("unnamed")))
    if building.latitude_deg is not None and building.longitude_deg is not None:
        north, east = building.latitude_deg, building.longitude_deg
        latitude, longitude = rounded(abs(north), 2), rounded(abs(east), 2)
        place = (
            gettext("{degrees}° N", degrees=latitude) if north >= 0 else gettext("{degrees}° S", degrees=latitude),
            gettext("{degrees}° E", degrees=longitude) if east >= 0 else gettext("{degrees}° W", degrees=longitude),
        )
        far = any(isinstance(note, Note) and note.template == FAR_SITE for note in result.head.assumed)
        parts = (*place, *([gettext("far from the weather station, whose sun is used")] if far else []))
        rows.append((gettext("Site of the building"), semicolons(parts)))
    manifest = result.manifest
    inputs = manifest.get("inputs", {})
    main = ("building", "weather", "system")
    titles = {"weather": gettext("Weather and sun")}
    rows += [(titles.get(name) or _title(name), _named(manifest, name)) for name in main if name in inputs]
    if "system" not in inputs and manifest.get("system"):
        rows.append((gettext("Fenestration"), str(manifest["system"])))
    first, last = result.times[0], result.times[-1]
    period = ngettext(
        "{first} to {last}, {count} hour",
        "{first} to {last}, {count} hours",
        len(result.times),
        first=day_and_month(first, short=True),
        last=day_and_month(last, short=True),
    )
    rows.append((gettext("Period"), period))
    others = len(building.spaces) - len(result.spaces)
    computed = len(result.spaces)
    rooms = (
        gettext("{count} computed, {others} more in the file", count=computed, others=others)
        if others > 0
        else gettext("{count} computed", count=computed)
    )
    rows.append((gettext("Rooms"), rooms))
    account = building.account
    read = () if account is None else account.facts
    return (*rows, *((translated(title), prose(translated(text))) for title, text in read))


def head_lines(head: Head, notes: Iterable[str] = ()) -> tuple[str, ...]:
    """What was left out and assumed, and notes that the head does not have, in the page's language.

    That the run was quick comes first.
    """
    notes = head.further(notes)
    quick = [gettext(NOTE)] if NOTE in notes else []
    return (*quick, *(translated(line) for line in (*head.lines, *notes) if line != NOTE))


def comparison(result: RunResult, rooms) -> tables.Table | None:
    """The headline figures of all rooms side by side; None for a single room."""
    if len(rooms) < 2:
        return None
    labels = list(dict.fromkeys(card.label for room in rooms for card in room.cards))
    meaning = {card.label: card for room in rooms for card in room.cards}
    columns = (
        tables.Column(gettext("Room"), numeric=False),
        *(tables.Column(text, meaning[text].unit, meaning[text].meaning) for text in labels),
    )
    rows = []
    for room in rooms:
        values = {card.label: card.value for card in room.cards}
        rows.append((room.name, *(values.get(label, "–") for label in labels)))
    return tables.Table(gettext("All rooms"), columns, tuple(rows))


def options_table(manifest: Mapping) -> tables.Table:
    """What was chosen for the run; the input files have a table of their own."""
    titles = (gettext("Option"), gettext("Value"), gettext("Meaning"))
    columns = tuple(tables.Column(title, numeric=False) for title in titles)
    files = {"building", "weather", "system", *manifest.get("inputs", {})}
    rows = []
    for key, value in manifest.get("options", {}).items():
        if key in files:
            continue
        label, meaning = option_words(key)
        rows.append((label, tables.plain_value(value), meaning))
    return tables.Table(gettext("Options"), columns, tuple(rows))


def inputs_table(inputs: Mapping) -> tables.Table:
    """Input files with their hashes."""
    digests = (e.get("sha256") if isinstance(e, Mapping) else None for e in inputs.values())
    names = map(file_name, inputs.values())
    return files_table(zip(inputs, names, (str(d or "–") for d in digests), strict=True))


def files_table(files: Iterable[tuple[str, str, str]]) -> tables.Table:
    """Input files: what each is (a name of `named_files`), its name and hash."""
    titles = (gettext("Input"), gettext("File"), "SHA-256")
    columns = tuple(tables.Column(title, numeric=False) for title in titles)
    rows = tuple((_title(kind), name, digest) for kind, name, digest in files)
    return tables.Table(gettext("Input files"), columns, rows)


def file_name(entry: object) -> str:
    """The file's own name from a manifest's entry (a mapping, a path or a text)."""
    if isinstance(entry, Mapping):
        named = next((entry[k] for k in ("name", "file", "path") if entry.get(k)), None)
        if named is None:
            return "–"
        entry = named
    return Path(str(entry)).name


def timings_table(result: RunResult) -> tables.Table:
    """Seconds by stage: of each room, then of the run."""
    columns = (
        tables.Column(gettext("Room"), numeric=False),
        tables.Column(gettext("Stage"), numeric=False),
        tables.Column(gettext("Time"), "s"),
    )
    rows = [
        (room.space.label, stage_words(stage), cell(seconds, 1))
        for room in result.spaces
        for stage, seconds in room.seconds.items()
    ]
    total = result.manifest.get("seconds")
    if isinstance(total, int | float):
        rows.append((gettext("entire run"), gettext("all"), cell(total, 1)))
    return tables.Table(gettext("Computing time"), columns, tuple(rows))


def remaining(manifest: Mapping) -> dict[str, Any]:
    """What the manifest holds besides the parts shown in tables of their own."""
    tables_of_their_own = ("inputs", "options", "seed", "versions", "seconds", "rooms", "folders")
    at_the_head = ("quick", "head", "fenestration", "building", "site", "system")
    shown = (*tables_of_their_own, *at_the_head)
    names = {"variant": gettext("Mitsuba variant"), "weather_notes": gettext("Notes on the weather")}
    rest = {key: value for key, value in manifest.items() if key not in shown and value not in ([], None)}
    return {names.get(key, key): value for key, value in rest.items()}


def _named(manifest: Mapping, name: str) -> str:
    """The file of an input, after the name that the file gives itself."""
    own = manifest.get({"weather": "site", "system": "system"}.get(name, ""))
    file = file_name(manifest["inputs"][name])
    return f"{own} ({file})" if own else file


def _title(name: str) -> str:
    known = {
        "system": gettext("Fenestration system"),
        "operation": gettext("Operation"),
        "system_thermal": gettext("Thermal data of the system"),
        "building": gettext("Model file"),
        "weather": gettext("Weather"),
        "surroundings": gettext("Surroundings"),
        "corrections": gettext("Corrections"),
        "system_angular": gettext("Angular data of the system"),
        "state": gettext("Fenestration system of a state"),
        "held": gettext("Fenestration system that the model names"),
    }
    return known.get(name.rstrip("_0123456789"), name)
