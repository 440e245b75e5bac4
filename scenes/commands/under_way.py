"""Pages of a folder of results that show what is ready until the report takes their place."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from scenes.result_folder import ResultFolder
    from scenes.results import RoomYear
    from scenes.run.first_plan import PlannedRoom
    from scenes.study.plan import Case, StudyPlan
    from scenes.study.store import CaseResult


class RefreshedPage:
    """Files of a folder that are written anew every few seconds, in a language."""

    def __init__(self, folder: ResultFolder, language: str) -> None:
        self._folder, self._language = folder, language
        self._written = -float("inf")

    def write(self, files: Callable[[], dict[str, str]], *, now: bool = False) -> None:
        """Write texts by file name if the last ones are old enough, or `now`."""
        from scenes.language.catalogue import in_language
        from scenes.report.under_way import REFRESH_S

        if not now and time.monotonic() - self._written < REFRESH_S:
            return
        with in_language(self._language):
            self._folder.early(files())
        self._written = time.monotonic()


class FirstPlanPage:
    """Prints the first plan and writes it in the place of a report."""

    def __init__(self, folder: ResultFolder, report: str, language: str, *, refined: bool) -> None:
        """Of a run's folder.

        Args: report: name of the page's file; refined: `light` is called with rooms as they come.
        """
        self._page, self._report, self._refined = RefreshedPage(folder, language), report, refined
        self.table = ""
        self._rooms: dict[str, PlannedRoom] = {}  # by GUID

    def __call__(self, rooms: Sequence[PlannedRoom]) -> None:
        """Print the plan, and write it."""
        from scenes.run.first_plan import plan_lines, plan_table

        self.table = plan_table(rooms)
        self._rooms = {room.space.guid: room for room in rooms}
        self._page.write(self._files, now=True)
        click.echo("\n".join(plan_lines(rooms)))

    def light(self, room: RoomYear) -> None:
        """Put the light of a room in the place of the first."""
        planned = self._rooms.get(room.space.guid)
        if planned is None:
            return
        self._rooms[room.space.guid] = planned.completed(room.daylight)
        self._page.write(self._files)

    def _files(self) -> dict[str, str]:
        from scenes.result_folder import FIRST_PLAN
        from scenes.run.first_plan import plan_page

        return {FIRST_PLAN: self.table, self._report: plan_page(list(self._rooms.values()), refined=self._refined)}


class StudyPage:
    """Writes the cases of a study in the place of its report as they come."""

    def __init__(self, folder: ResultFolder, plan: StudyPlan, language: str) -> None:
        self._page, self._plan = RefreshedPage(folder, language), plan
        self._ready: dict[str, CaseResult] = {}

    def reused(self, results: Mapping[str, CaseResult]) -> None:
        """Add cases of an earlier run, by key; they are written with the next that is ready."""
        self._ready |= {key: replace(result, arrays={}) for key, result in results.items()}

    def __call__(self, case: Case, result: CaseResult) -> None:
        """Add a case that is ready."""
        self._ready[case.key] = replace(result, arrays={})
        self._page.write(self._files)

    def _files(self) -> dict[str, str]:
        from scenes.result_folder import REPORT
        from scenes.study_report.under_way import cases_page

        return {REPORT: cases_page(self._plan, self._ready)}
