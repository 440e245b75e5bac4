"""NaN and infinity leave no writer of results."""

from __future__ import annotations

import json
import re

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.files import json_text, write_table
from scenes.run.outputs import csv_text
from tests.modules import MODULES, file_name

PLAIN = {  # json.dumps that write no results
    "mitsuba_cfs/files.py",  # `json_text` itself
    "scenes/study/store.py",  # a case's own file, which it reads again
    "bim/building_file.py",  # an entry of the cache, which may hold NaN
    "bim/ifc/corrections_draft.py",
    "bim/ifc/correct.py",  # values of TOML
    "scenes/commands/self_test.py",
    "scenes/cost/reference.py",
    "scenes/calibration/shipped.py",
}


def test_json_has_null_for_nan_and_no_infinity():
    value = {"a": float("nan"), "b": [1.5, np.float64("nan")], "c": (1, "x")}
    assert json.loads(json_text(value)) == {"a": None, "b": [1.5, None], "c": [1, "x"]}
    for infinite in (float("inf"), -np.inf):
        with pytest.raises(ValueError, match="not JSON compliant"):
            json_text({"a": [infinite, float("nan")]})


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_has_empty_cells_for_nan_and_no_infinity(tmp_path, suffix):
    table = pd.DataFrame({"name": ["x", "y"], "lux": [1.0, np.nan], "flux": [1.0, 2.0]})
    path = tmp_path / f"table.{suffix}"
    write_table(table, path, index=False)
    assert csv_text(table, index=False) == "name,lux,flux\nx,1,1\ny,,2\n"
    table.loc[1, "flux"] = -np.inf
    with pytest.raises(ValueError, match="infinite results: flux"):
        write_table(table, path, index=False)
    with pytest.raises(ValueError, match="infinite results: flux"):
        csv_text(table)
    if suffix == "csv":
        assert path.read_text().splitlines()[2] == "y,,2.0"


def test_every_writer_of_json_is_this_one():
    users = {file_name(path) for path in MODULES if re.search(r"\bjson\.dumps?\(", path.read_text(encoding="utf-8"))}
    assert users == PLAIN
