"""The explorer's folder: the page, its scripts and the data of one or several runs."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import write_text
from scenes.explore.case_files import CASE, case_files, read_case
from scenes.explore.packing import write_data
from scenes.explore.room_files import write_room
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import current_language, gettext, in_language, messages
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.report.page import environment
from scenes.report.page_files import page_files
from scenes.result_folder import EXPLORER
from scenes.results import RunResult

PAGE = "index.html"
SCRIPTS = "scenes/explore/templates/"  # where the messages of scripts are from
FILES = page_files("scenes.explore") | {"style.css": page_files("scenes.report")["style.css"]}
STEPS = 256  # of the palette


def write_explorer(result: RunResult, folder: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the explorer of a run's rooms that were computed for it.

    A room that is equal to another has that one's light, and is named with it.
    """
    with in_language(page.language):
        write_rooms(result, folder)
        write_page(folder)


def write_rooms(result: RunResult, folder: Path) -> None:
    """Write what the explorer of a run shows, without the page."""
    (folder / "data").mkdir(parents=True, exist_ok=True)
    entries = []
    for number, room in enumerate(one for one in result.spaces if one.explored is not None):
        entry = write_room(folder, f"room{number}", result, room)
        equal = [o.space.label for o in result.spaces if o.template == room.space.label]
        entry["name"] += "".join(f", {label}" for label in equal)
        entries.append(entry)
    first = result.times[0]
    colours = ColourScale(0, 1, "", "").rgba((np.arange(STEPS) + 0.5) / STEPS)[:, :3]
    write_data(
        folder / CASE,
        {
            "title": result.building.name or gettext("Building"),
            "site": str(result.manifest.get("site", "")),
            "first_day": f"{first:%Y-%m-%d}",
            "hours": len(result.times),
            "palette": base64.b64encode(colours.tobytes()).decode("ascii"),
            "rooms": entries,
        },
    )


def write_page(folder: Path) -> None:
    """Write the page with its style and scripts, in the language of the context."""
    for name, text in FILES.items():
        if name == PAGE:
            template = environment(FILES).get_template(PAGE)
            text = template.render(language=current_language(), words=script_words())
        write_text(folder / name, text)


def script_words() -> dict[str, str | tuple[str, str]]:
    """Translations of the scripts' messages, by their English text; of plurals both forms."""
    if current_language() == "en":
        return {}
    words = {}
    for message in messages(current_language()):
        if any(path.startswith(SCRIPTS) for path, _ in message.locations):
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
    joined: dict[str, Any] = cases[0] | {"rooms": []}
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
    files = {key: [f"{place}/{one}" for one in entry[key]] for key in ("models", "lux")}
    return entry | files | {"name": name, "file": f"{place}/{entry['file']}"}


def write_joined(case: dict[str, Any], target: Path) -> None:
    """Write the page of rooms whose files are there."""
    write_data(target / CASE, case)
    write_page(target)
