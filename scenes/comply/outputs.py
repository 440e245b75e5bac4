"""The files of a check against rules: the dossier, its values and the problems of the model."""

from __future__ import annotations

import pandas as pd

from mitsuba_cfs.files import write_table, write_text
from scenes.comply.page import dossier_html
from scenes.comply.results import Compliance
from scenes.comply.tables import values_frame
from scenes.result_folder import ResultFolder


def write_compliance(result: Compliance, folder: ResultFolder, *, quick: bool = False) -> None:
    """Write all files; earlier results are replaced at the end."""
    with folder.replaced() as place:
        write_table(values_frame(result), place / "values.csv", index=False, float_format="%.6g")
        rows = [(p.where, p.what, p.consequence) for p in result.problems]
        problems = pd.DataFrame(rows, columns=["where", "what", "consequence"])
        write_table(problems, place / "problems.csv", index=False)
        write_text(place / "dossier.html", dossier_html(result, quick=quick))
