"""The explorer of one case of a study: computed after its figures, kept in the study's folder."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import scratch_folder, write_bytes
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.source_code import code_version
from scenes.explore.case_files import CASE, read_case
from scenes.explore.folder import write_rooms
from scenes.results import RunResult
from scenes.study.one_case import ALONE, case_inputs, case_year
from scenes.study.plan import Case, requirements
from scenes.study.store import failure_line
from scenes.workers import Tasks

PHASED = ("three-phase", "five-phase")  # a path tracer has no matrices to compute an hour from


@dataclass(frozen=True, slots=True)
class ExploredCase:
    """What the explorer shows of a case."""

    key: str  # of `explorer_key`
    files: dict[str, bytes] = field(default_factory=dict)  # by name; none once they are written
    shown: dict[str, Any] = field(default_factory=dict)  # as `case.js` holds it
    error: str = ""  # one line; then there is nothing else


def explorer_key(case: Case) -> str:
    """A hash of what the explorer of a case depends on."""
    return digest(case.key, code_version(__name__))[:32]


def compute_explorer(case: Case, progress: Progress = silent) -> ExploredCase:
    """Every hour's pictures, plan and temperatures of a case, as files of the explorer.

    Raises: as `scenes.study.one_case.compute_case`.
    """
    with ALONE, scratch_folder() as folder:
        variants.activate()
        inputs = case_inputs(case)
        room, weather = case_year(inputs, case, explore=True, progress=progress), inputs.weather
        sun = sun_directions(weather)
        run = RunResult(inputs.building, weather.midpoints, sun, (room,), (), {}, head=inputs.head)
        write_rooms(run, folder)
        result = (one for one in folder.rglob("*") if one.is_file())
        files = {one.relative_to(folder).as_posix(): one.read_bytes() for one in result}
        return ExploredCase(explorer_key(case), files, read_case(folder))


def explorers(
    cases: Sequence[Case],
    folder: Path,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Generator[tuple[Case, ExploredCase]]:
    """The explorer of each case, once for each key: kept in the folder, or computed and kept.

    Args: processes, scheduler, progress: as of `scenes.study.store.computed`.
    """
    once = {explorer_key(case): case for case in cases}
    left = []
    for key, case in once.items():
        kept = _kept(key, folder)
        if kept is None:
            left.append(case)
        else:
            yield case, kept
    here = processes == 1 and scheduler is None
    compute = partial(compute_explorer, progress=progress) if here else compute_explorer
    tasks = Tasks(left, compute, _failed, key=explorer_key, scene=attrgetter("scene"), needs=requirements(left))
    with closing(tasks.results(processes=processes, scheduler=scheduler)) as results:
        for result in results:
            if not result.error:
                _keep(result, folder)
            yield once[result.key], ExploredCase(result.key, {}, result.shown, result.error)


def _kept(key: str, folder: Path) -> ExploredCase | None:
    """An explorer that an earlier run finished."""
    try:
        return ExploredCase(key, {}, read_case(folder / key))
    except DataError:
        return None


def _keep(explored: ExploredCase, folder: Path) -> None:
    """Write the files of a case; the last says that all are there."""
    for name in sorted(explored.files, key=lambda name: name == CASE):
        place = folder / explored.key / name
        place.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(place, explored.files[name])


def _failed(case: Case, error: BaseException) -> ExploredCase:
    return ExploredCase(explorer_key(case), error=failure_line(error))
