"""A design with one answer for each orientation, room or climate, in place of one for all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import pandas as pd

from mitsuba_cfs.errors import DataError
from scenes.design.design import COMMAND, FRONT_TABLE, DesignResult, design_manifest, run_design
from scenes.design.design_file import Design
from scenes.study.store import Store

Report = Callable[[Path], object]  # writes a page


def designs_of(design: Design) -> dict[str, Design]:
    """The design of each orientation, room entry or climate, by its name."""
    each = design.search.each
    parts: dict[str, dict[str, Any]]
    if each == "orientation":
        parts = {f"{angle:g}°": {"orientations_deg": (angle,)} for angle in design.orientations_deg}
    elif each == "room":
        parts = {one.name or "": {"room": (one,)} for one in design.room}
    elif each == "climate":
        parts = {one.name or "": {"climate": (one,)} for one in design.climate}
    else:
        raise ValueError("search.each: expected orientation, room or climate")
    whole = {"search": design.search.model_copy(update={"each": None})}
    titles = {name: ", ".join(filter(None, (design.title, name))) for name in parts}
    return {name: design.model_copy(update=whole | part | {"title": titles[name]}) for name, part in parts.items()}


def run_each(
    design: Design,
    store: Store | str | PathLike[str],
    *,
    on_part: Callable[[str], object] | None = None,
    **options: Any,
) -> dict[str, DesignResult]:
    """The result of each part of a design, by its name; `write_each` writes what comes of it.

    Args: on_part: called with the name before each; others: as of `run_design`.

    Raises: `DataError` that names the part for which no candidate can be computed.
    """
    if not isinstance(store, Store):
        store = Store(Path(store), inputs=design.files, command=COMMAND)
    results = {}
    for name, one in designs_of(design).items():
        if on_part is not None:
            on_part(name)
        try:
            results[name] = run_design(one, store, **options)
        except DataError as error:
            raise DataError(f"{name}: {error.message}", file=error.file, field=error.field) from error
    return results


def folder_of(design: Design, number: int) -> str:
    """The folder of a part's pages in that of the results; number: from 1."""
    return f"{design.search.each}_{number}"


def write_each(
    design: Design,
    results: Mapping[str, DesignResult],
    store: Store,
    report: Report | None = None,
    pages: Callable[[DesignResult], Mapping[str, Report]] | None = None,
) -> None:
    """Write one table of all candidates, the cases of all fronts, the manifest, and the pages.

    Args:
        report: writes the page of all parts.
        pages: the pages of a part by their file names, which are written into a folder of its own.
    """
    each = design.search.each or ""
    rows = [{each: name} | row for name, result in results.items() for row in result.rows()]
    cases = pd.DataFrame([row for result in results.values() for row in result.study.rows()])
    more: dict[str, Report] = {FRONT_TABLE: lambda path: cases.to_csv(path, index=False, float_format="%.6g")}
    for number, result in enumerate(results.values(), 1):
        for name, write in ({} if pages is None else pages(result)).items():
            more[f"{folder_of(design, number)}/{name}"] = write
    table = {
        "study": design.model_dump(mode="json"),
        "answers": {name: design_manifest(result) for name, result in results.items()},
    }
    store.write(rows, table, report, more={name: _in_its_folder(write) for name, write in more.items()})


def _in_its_folder(write: Report) -> Report:
    def written(path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path)

    return written
