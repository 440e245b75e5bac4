"""The explorer's folder: the page, its scripts and the data of one or several runs."""

from __future__ import annotations

import base64
import shutil
import zlib
from collections.abc import Sequence
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from bim.model import Building
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, write_text
from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.picture_year.year import PictureYear
from scenes.explore.case_files import AFTER, BEFORE, CASE, case_files, read_case
from scenes.figures.plan import PlanFrame, plan_frame
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import current_language, gettext, in_language, messages
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.report.model3d import largest_triangles
from scenes.report.page import environment, head_lines
from scenes.report.page_files import page_files
from scenes.result_folder import EXPLORER
from scenes.results import ExploredRoom, RoomYear, RunResult


def packed(array: ArrayLike, kind: str) -> dict[str, Any]:
    """An array as base64 of its bytes, deflated plane by plane, the lowest bytes first.

    Args: kind: of its numbers: u1, i2, u2, i4 or f4, little end first.
    """
    values = np.ascontiguousarray(array).astype(f"<{kind}").ravel()
    planes = values.view(np.uint8).reshape(-1, values.itemsize).T
    press = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = press.compress(np.ascontiguousarray(planes).tobytes()) + press.flush()
    return {"kind": kind, "length": len(values), "data": base64.b64encode(data).decode("ascii")}


def write_data(path: Path, data: object) -> None:
    """Write data as a script, which a page that was opened as a file may load."""
    write_text(path, BEFORE + json_text(data, separators=(",", ":")) + AFTER)


PAGE = "index.html"
SCRIPTS = "scenes/explore/templates/"  # where the messages of scripts are from
FILES = page_files("scenes.explore") | {"style.css": page_files("scenes.report")["style.css"]}
STEPS = 256  # of the palette


def write_explorer(result: RunResult, folder: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the explorer of a run's rooms that were computed for it.

    A room that is equal to another shares the files of its pictures and its daylight.
    """
    with in_language(page.language):
        write_rooms(result, folder)
        write_page(folder, head_lines(result.head, result.notes))


def write_rooms(result: RunResult, folder: Path) -> None:
    """Write what the explorer of a run shows, without the page."""
    (folder / "data").mkdir(parents=True, exist_ok=True)
    entries: list[dict[str, Any]] = []
    by_label: dict[str, dict[str, Any]] = {}
    for number, room in enumerate(one for one in result.spaces if one.explored is not None):
        shared = by_label.get(room.template or "")
        entries.append(write_room(folder, f"room{number}", result, room, shared=shared))
        by_label.setdefault(room.space.label, entries[-1])
    first = result.times[0]
    colours = ColourScale(0, 1, "", "").rgba((np.arange(STEPS) + 0.5) / STEPS)[:, :3]
    write_data(
        folder / CASE,
        {
            "title": result.building.name or gettext("Building"),
            "site": str(result.manifest.get("site", "")),
            "first_day": f"{first:%Y-%m-%d}",
            "hours": len(result.times),
            "head": head_lines(result.head, result.notes),
            "palette": base64.b64encode(colours.tobytes()).decode("ascii"),
            "rooms": entries,
        },
    )


def write_page(folder: Path, head: Sequence[str]) -> None:
    """Write the page with its style and scripts, in the language of the context.

    Args: head: what was left out and assumed, in that language.
    """
    for name, text in FILES.items():
        if name == PAGE:
            template = environment(FILES).get_template(PAGE)
            text = template.render(language=current_language(), words=script_words(), head=head)
        write_text(folder / name, text)


def script_words(scripts: str = SCRIPTS) -> dict[str, str | tuple[str, str]]:
    """Translations of the scripts' messages, by their English text; of plurals both forms.

    Args: scripts: the folder of the page's scripts.
    """
    if current_language() == "en":
        return {}
    words = {}
    for message in messages(current_language()):
        if any(path.startswith(scripts) for path, _ in message.locations):
            words[message.id[0] if message.pluralizable else message.id] = message.string
    return words


def explorer_of(results: Path) -> Path:
    """The explorer's folder of a folder of results.

    Raises: `DataError` where there is none.
    """
    for folder in (results / EXPLORER, results):
        if (folder / CASE).is_file():
            return folder
    raise DataError("holds no explorer: compute it again with --explore", file=results)


def copy_explorer(folder: Path, target: Path) -> None:
    """Write the explorer of a folder elsewhere: its data, checked, and the page of this program.

    Raises: `DataError` for data that are missing or not of an explorer (`case_files`).
    """
    case = read_case(folder)
    _copy_files(folder, case, target)
    write_joined(case, target)


def join_explorers(folders: Sequence[Path], target: Path) -> None:
    """Write one explorer of several, with the data of each in its own folder.

    Raises: `DataError` where their years are not of one length, and as `copy_explorer`.
    """
    cases = [read_case(explorer_of(folder)) for folder in folders]
    lines = dict.fromkeys(line for case in cases for line in case.get("head", ()))
    joined: dict[str, Any] = cases[0] | {"rooms": [], "head": list(lines)}
    for number, (folder, case) in enumerate(zip(folders, cases, strict=True)):
        if case["hours"] != joined["hours"]:
            message = f"has {case['hours']} hours, {folders[0]} has {joined['hours']}"
            raise DataError(message, file=folder)
        _copy_files(explorer_of(folder), case, target / str(number))
        for entry in case["rooms"]:
            moved = moved_entry(entry, str(number), f"{folder.name}: {entry['name']}")
            joined["rooms"].append({key: v for key, v in moved.items() if key != "id"})
    write_joined(joined, target)


def _copy_files(folder: Path, case: dict[str, Any], target: Path) -> None:
    for name in dict.fromkeys(case_files(folder, case)):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / name, target / name)


def moved_entry(entry: dict[str, Any], place: str, name: str) -> dict[str, Any]:
    """The entry of a room whose files went into a folder, under another name."""
    files = {key: [f"{place}/{one}" for one in entry[key]] for key in ("models", "lux", "melanopic")}
    return entry | files | {"name": name, "file": f"{place}/{entry['file']}"}


def write_joined(case: dict[str, Any], target: Path) -> None:
    """Write the page of rooms whose files are there."""
    write_data(target / CASE, case)
    write_page(target, case.get("head", ()))


HOURS_A_FILE = 400  # whose codes are loaded together: about a month of daylight


def view_facts(view: View) -> dict[str, Any]:
    """The projection as the page takes it."""
    return {
        "kind": view.kind,
        "direction": view.direction,
        "up": view.up,
        "horizontal": view.horizontal_deg,
        "vertical": view.vertical_deg,
        "width": view.width,
        "height": view.height,
    }


def view_arrays(year: PictureYear) -> dict[str, Any]:
    """What the pictures of all states share."""
    return {
        "pixels": packed(year.pixels, "i4"),
        "row": packed(year.row, "i4"),
        "share": packed(year.share, "f4"),
        "blind": packed(np.packbits(_blind(year), bitorder="little"), "u1"),
    }


def write_pictures(folder: Path, name: str, year: PictureYear) -> None:
    """Write a state's model and the files of its hours' codes, `name`_0, `name`_1 and so on."""
    codes = []
    for number, first in enumerate(range(0, len(year.codes), HOURS_A_FILE)):
        some = year.codes[first : first + HOURS_A_FILE]
        codes.append({"first": first, "sizes": [len(code) for code in some]})
        text = base64.b64encode(b"".join(some)).decode("ascii")
        write_data(folder / f"{name}_{number}.js", text)
    facts = {"codes": codes, "rows_step": year.rows.step, "windows_step": year.windows.step}
    write_data(folder / f"{name}.js", {"facts": facts, "arrays": _model_arrays(year)})


def _model_arrays(year: PictureYear) -> dict[str, Any]:
    lit = [hour for hour, discs in enumerate(year.discs) for _ in discs]
    rows = [[*d.direction, d.luminance, d.solid_angle] for discs in year.discs for d in discs]
    arrays = {
        "window": packed(year.window, "i4"),
        "floor": packed(year.floor, "f4"),
        "disc_hour": packed(lit, "i4"),
        "disc": packed(np.array(rows, dtype=float), "f4"),
    }
    for i, (name, patterns) in enumerate((("rows", year.rows), ("windows", year.windows))):
        arrays |= {
            f"{name}_typical": packed(patterns.typical, "f4"),
            f"{name}_pattern": packed(patterns.pattern, "i2"),
            f"{name}_scale": packed(year.scale[i], "f4"),
            f"{name}_amounts": packed(year.amounts[i], "i2"),
            f"{name}_amount_step": packed(year.amount_step[i], "f4"),
        }
    return arrays


def _blind(year: PictureYear) -> NDArray[np.bool_]:
    """Pixels [n] that are not near themselves by rounding, as evalglare has it; see `glare.scan`.

    A browser's cosines may differ in the last digit, which would change how pixels are grouped.
    """
    x, y, z = pixel_directions(year.view)[0].reshape(-1, 3)[year.pixels].T
    return x * x + y * y + z * z > 1.0


LUX_STEP = 0.002  # of the logarithm of 1 + lux: an illuminance is kept to 0.1 %
TINT_STEP = 1e-3  # of tints under white light
TEMPERATURES = {"outdoor": "outdoor_c", "air": "air_c", "operative": "operative_c"}
LOADS = {"heating": "heating_w", "cooling": "cooling_w", "lighting": "lighting_w"}


def write_room(
    folder: Path, name: str, result: RunResult, room: RoomYear, *, shared: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Write a room's files, their names beginning with `name`; its entry of the case.

    Args:
        folder: of the page; the files go into `data` there.
        shared: entry of a room with the same pictures and daylight, whose files it takes.
    """
    explored = room.explored
    if explored is None:
        raise ValueError(f"{room.space.label} was not computed for the explorer")
    states = range(len(explored.states))
    for j in states if shared is None else ():
        write_pictures(folder / "data", f"{name}_state{j}", explored.pictures[j])
        codes = np.round(np.log1p(np.maximum(explored.illuminance[j], 0)) / LUX_STEP)
        write_data(folder / "data" / f"{name}_lux{j}.js", packed(codes, "u2"))
        if explored.colour is not None:
            codes = np.round(np.log1p(np.maximum(explored.colour.melanopic[j], 0)) / LUX_STEP)
            write_data(folder / "data" / f"{name}_mel{j}.js", packed(codes, "u2"))
    facts = {
        "states": explored.states,
        "groups": len(explored.windows),
        "view": view_facts(explored.pictures[0].view),
        "plan": _plan(room),
        "checks": [_check(year) for year in explored.pictures],
    }
    arrays = _arrays(result, room, explored)
    write_data(folder / "data" / f"{name}.js", {"facts": facts, "arrays": arrays})
    files = {
        "models": [f"data/{name}_state{j}" for j in states],
        "lux": [f"data/{name}_lux{j}" for j in states],
        "melanopic": [f"data/{name}_mel{j}" for j in states] if explored.colour is not None else [],
    }
    if shared is not None:
        files = {key: shared[key] for key in files}
    return {"name": room.space.label, "states": list(explored.states), "file": f"data/{name}", **files}


def _arrays(result: RunResult, room: RoomYear, explored: ExploredRoom) -> dict[str, Any]:
    arrays = view_arrays(explored.pictures[0]) | {
        "lit": packed(explored.lit, "i4"),
        "sun": packed(result.sun, "f4"),
        "sun_lux": packed(explored.sun_illuminance, "f4"),
        "eye": packed(explored.eye, "f4"),
        "through": packed(explored.through, "f4"),
        "operated": packed(explored.operated, "u1"),
        "blockers": packed(_blockers(result.building, room), "f4"),
    }
    if explored.colour is not None:
        colour = explored.colour
        arrays |= {
            "tint": packed(np.round(np.stack(colour.pixels) / TINT_STEP), "u2"),
            "tint_indoors": packed(colour.indoors, "f4"),
            "tint_sky": packed(colour.sky, "f4"),
            "tint_sun": packed(colour.sun, "f4"),
            "melanopic_eye": packed(colour.eye, "f4"),
        }
    for g, triangles in enumerate(explored.windows):
        arrays[f"group{g}"] = packed(triangles, "f4")
    for name, column in TEMPERATURES.items():
        if column in room.heat.temperatures:
            arrays[name] = packed(room.heat.temperatures[column], "f4")
    if room.operation is not None:
        for name, column in LOADS.items():
            arrays[name] = packed(room.operation.hours[column], "f4")
    return arrays


def _blockers(building: Building, room: RoomYear) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of what is opaque: what light meets in the room and outdoors."""
    outdoors, _ = largest_triangles(exterior_surfaces(building, room.space).triangles)
    return np.concatenate([furnished_surfaces(room.space).triangles, outdoors])


def _plan(room: RoomYear) -> dict[str, Any]:
    """Outline, windows and sensor cells from above [m], the eye, and the levels for the sun."""
    view, points = room.glare.view, room.daylight.points
    frame: PlanFrame = plan_frame(room.space, points)
    cells = np.round(frame.cells, 3)
    spacing = float(np.linalg.norm(cells[0, 1] - cells[0, 0])) if len(cells) else 0.5
    desk = float(np.median(points[:, 2])) if len(points) else room.space.floor_level + 0.8
    return {
        "outline": _rings(frame.outline),
        "windows": [np.round(ends, 3).tolist() for ends in frame.windows],
        "cells": cells.tolist(),
        "spacing": spacing,
        "bounds": [round(v, 3) for v in frame.outline.bounds],
        "eye": view.position[:2],
        "sight": view.direction[:2],
        "heights": {"floor": float(room.space.floor_level), "desk": desk},
    }


def _rings(outline: shapely.Geometry) -> list[list[list[float]]]:
    polygons = [part for part in shapely.get_parts(outline) if part.geom_type == "Polygon"]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return [np.round(shapely.get_coordinates(ring)[:-1], 3).tolist() for ring in rings]


def _check(year: PictureYear) -> dict[str, Any] | None:
    """DGP of the program's own pictures in some hours, and how far that of the kept ones is."""
    check = year.check
    if check is None or not len(check.hours):
        return None
    difference = np.abs(check.compressed_dgp - check.dgp)
    return {
        "hours": check.hours.tolist(),
        "dgp": np.round(check.dgp, 6).tolist(),
        "largest": float(difference.max()),
        "mean": float(difference.mean()),
    }


LOOPBACK = "127.0.0.1"


class _Handler(SimpleHTTPRequestHandler):
    """Files for who asks for them by the loopback address: a foreign name could be anybody's."""

    def send_head(self) -> Any:
        name = self.headers.get("Host", "").partition(":")[0]
        if name not in (LOOPBACK, "localhost"):
            self.send_error(403)
            return None
        return super().send_head()

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


def server(folder: Path, port: int = 0) -> ThreadingHTTPServer:
    """A server of a folder, not running yet; port 0: a free one.

    Raises: `OSError` where the port is taken.
    """
    return ThreadingHTTPServer((LOOPBACK, port), partial(_Handler, directory=str(folder)))
