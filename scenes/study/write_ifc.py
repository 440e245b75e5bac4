"""A study's results written back into its building model, case by case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bim.ifc.results_write import SET_NAME, write_results
from bim.model import Space
from bim.report.issue import Issue
from mitsuba_cfs.files import replacing
from scenes.study.files import one_building
from scenes.study.plan import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult

OF_WINDOWS = ("fenestration", "u_value", "g_value", "visible_transmittance", "solar_transmittance")


def write_study_ifc(study: StudyResult, out: Path) -> tuple[Issue, ...]:
    """Write `out`: the building with a property set for each case on its space and windows.

    A set is named after its case, "CFS results: system, climate, angle, method".
    """
    source = one_building(case.inputs.building for case in study.plan.cases)
    done = [(case, result) for case, result in zip(study.plan.cases, study.results, strict=True) if not result.error]
    issues: dict[Issue, None] = {}
    with replacing(out, field="--write-ifc") as part:
        for name, cases in _by_variant(done).items():
            values = {}
            for case, result in cases:
                _, space = study.plan.rooms[case.scene]
                values |= _values(space, case, result)
            written = write_results(source, values, part, set_name=f"{SET_NAME}: {name}")
            issues |= dict.fromkeys(written)
            source = part
    return tuple(issues)


def _by_variant(done: Sequence[tuple[Case, CaseResult]]) -> dict[str, list[tuple[Case, CaseResult]]]:
    """The cases of all rooms by what they are besides the room."""
    variants: dict[str, list[tuple[Case, CaseResult]]] = {}
    for case, result in done:
        angle = f"{case.orientation_deg:g} deg"
        name = ", ".join((case.system, case.climate, angle, case.options.method))
        variants.setdefault(name, []).append((case, result))
    return variants


def _values(space: Space, case: Case, result: CaseResult) -> dict[str, dict[str, Any]]:
    """Every figure on the space, the fenestration's on the windows."""
    figures = {k: v for k, v in result.figures.items() if v is not None}
    about = {"system": case.system, "method": case.options.method, "glare_metric": case.glare}
    window = about | {k: figures[k] for k in OF_WINDOWS if k in figures}
    return {space.guid: about | figures} | {w.guid: window for w in space.windows}
