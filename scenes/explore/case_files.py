"""The checked case of an explorer's folder and the files that it names: results may be foreign.

A case names its data files. Only plain names under a folder `data` are followed, and only to data:
the page loads each of them as a script.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

CASE = "case.js"
BEFORE, AFTER = "cfs.give(", ");\n"  # of the JSON in a data file, a script
NAME = re.compile(r"(?:[\w-]+/)*data/[\w-]+", re.ASCII)
TEXTS, LISTS = ("name", "file"), ("states", "models", "lux", "melanopic")  # of the entry of a room
PACKED = {"kind", "length", "data"}


def read_data(path: Path) -> Any:
    """The data of a script that calls `cfs.give` (`scenes.explore.folder.write_data`).

    Raises: `DataError` for a file that is none.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if not (text.startswith(BEFORE) and text.endswith(AFTER)):
            raise ValueError("is empty" if not text else "another text than one call of cfs.give")
        return json.loads(text.removeprefix(BEFORE).removesuffix(AFTER))
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise DataError(f"is no data of an explorer: {reason(error)}", file=path) from None


def read_case(folder: Path) -> dict[str, Any]:
    """The case of an explorer's folder.

    Raises: `DataError` for a case without rooms or hours, and for names of files that are not plain
        names under `data`.
    """
    file = folder / CASE
    case = read_data(file)
    if not isinstance(case, dict) or not isinstance(case.get("rooms"), list):
        raise DataError("is no case of an explorer: no list of rooms", file=file)
    if not isinstance(case.get("hours"), int):
        raise DataError("is no case of an explorer: no number of hours", file=file)
    lines = case.get("head", [])
    if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
        raise DataError("is no case of an explorer: no list of texts", file=file, field="head")
    for number, entry in enumerate(case["rooms"]):
        _check_entry(entry, file, f"room {number}")
    return case


def case_files(folder: Path, case: dict[str, Any]) -> Iterator[str]:
    """Names of the data files of a case, relative to its folder, each read and checked.

    Raises: `DataError` for a file that is missing, empty, outside the folder or no data.
    """
    for entry in case["rooms"]:
        _check_arrays(folder, entry["file"])
        yield f"{entry['file']}.js"
        for name in entry["models"]:
            yield f"{name}.js"
            for number in range(_number_of_codes(folder, name)):
                if not isinstance(_data(folder, f"{name}_{number}"), str):
                    raise DataError("is no text of codes", file=folder / f"{name}_{number}.js")
                yield f"{name}_{number}.js"
        for name in (*entry["lux"], *entry["melanopic"]):
            if not _is_packed(_data(folder, name)):
                raise DataError("is no array of illuminances", file=folder / f"{name}.js")
            yield f"{name}.js"


def _check_entry(entry: Any, file: Path, room: str) -> None:
    if not isinstance(entry, dict):
        raise DataError("is no table", file=file, element=room)
    entry.setdefault("melanopic", [])  # which runs without light by wavelength have not
    for key in (*TEXTS, *LISTS):
        value = entry.get(key)
        texts = value if key in LISTS else [value]
        if not isinstance(texts, list) or not all(isinstance(one, str) for one in texts):
            raise DataError("is missing or no text", file=file, element=room, field=key)
        if key not in ("name", "states"):
            for name in texts:
                if not NAME.fullmatch(name):
                    message = f"{name[:80]!r} is no plain name of a file under data/"
                    raise DataError(message, file=file, element=room, field=key)


def _data(folder: Path, name: str) -> Any:
    """The data of a file of the case, which may not be a link that leads elsewhere."""
    path = folder / f"{name}.js"
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise DataError("is a link that leads out of the explorer's folder", file=path)
    return read_data(path)


def _check_arrays(folder: Path, name: str) -> dict[str, Any]:
    """The facts of a file of facts and arrays."""
    data = _data(folder, name)
    facts, arrays = (data.get("facts"), data.get("arrays")) if isinstance(data, dict) else (0, 0)
    if not isinstance(facts, dict) or not isinstance(arrays, dict):
        raise DataError("holds no facts and arrays", file=folder / f"{name}.js")
    for key, array in arrays.items():
        if not _is_packed(array):
            raise DataError("is no packed array", file=folder / f"{name}.js", field=key)
    return facts


def _number_of_codes(folder: Path, name: str) -> int:
    codes = _check_arrays(folder, name).get("codes")
    if not isinstance(codes, list):
        raise DataError("names no files of codes", file=folder / f"{name}.js")
    return len(codes)


def _is_packed(data: Any) -> bool:
    return isinstance(data, dict) and data.keys() >= PACKED and isinstance(data["data"], str)
