"""The files of a check against rules: the dossier, its values and the problems of the model."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pandas as pd

from bim.report.issue import COLUMNS, Issue, issue_rows
from mitsuba_cfs.files import write_table, write_text
from scenes.comply.bcf import write_bcf
from scenes.comply.page import dossier_html
from scenes.comply.results import Compliance
from scenes.comply.tables import values_frame
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.result_folder import ResultFolder

SET_NAME = "CFS compliance"
MODEL_CHECK = Path(str(files(__package__) / "model.ids"))  # what a check needs of a model


def write_compliance(
    result: Compliance,
    folder: ResultFolder,
    *,
    quick: bool = False,
    page: PageOptions = OWN_PAGE,
) -> None:
    """Write all files; earlier results are replaced at the end."""
    with folder.replaced() as place:
        write_table(values_frame(result), place / "values.csv", index=False, float_format="%.6g")
        rows = issue_rows(result.issues, "command")
        issues = pd.DataFrame(rows, columns=list(COLUMNS))
        write_table(issues, place / "problems.csv", index=False)
        write_text(place / MODEL_CHECK.name, MODEL_CHECK.read_text("utf-8"))
        write_bcf(result, place / "issues.bcf")
        write_text(place / "dossier.html", dossier_html(result, quick=quick, page=page))


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
