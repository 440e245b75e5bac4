"""`make audit`: licences and the list of packages are written whatever the service answers."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

CLEAN = {"name": "b", "version": "1", "vulns": []}
UNKNOWN = {"name": "c", "skip_reason": "Dependency not found"}
FAULT = {"name": "a", "version": "1", "vulns": [{"id": "PYSEC-1", "fix_versions": ["2"]}]}


def audited(folder: Path, answer: object) -> subprocess.CompletedProcess:
    """The audit with an answer of `pip-audit` made here; None: it ends without one."""
    program = folder / ".venv-audit" / "bin" / "pip-audit"
    program.parent.mkdir(parents=True)
    (folder / "answer").write_text(json.dumps({"dependencies": answer}))
    copy = 'while [ "$1" != --output ]; do shift; done; cp answer "$2"; exit 1'
    no_answer = "echo could not connect >&2; exit 1"
    program.write_text(f"#!/bin/sh\n{no_answer if answer is None else copy}\n")
    program.chmod(0o755)
    words = ["bash", str(REPOSITORY / ".ci" / "audit"), sys.executable]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    ("answer", "code", "line"),
    [
        ([CLEAN], 0, "audit: 1 packages checked, 0 vulnerable"),
        ([CLEAN, {"name": "mitsuba-cfs", "skip_reason": "not found"}], 0, "1 packages checked"),
        ([CLEAN, FAULT], 1, "audit: 2 packages checked, 1 vulnerable"),
        ([CLEAN, UNKNOWN], 1, "audit: not checked, unknown to the service: c"),
        ([UNKNOWN, UNKNOWN], 1, "not checked: the service did not answer for any of 2 packages"),
        (None, 1, "audit: known vulnerabilities were not checked: could not connect"),
    ],
)
def test_what_was_not_checked_is_no_clean_bill(tmp_path, answer, code, line) -> None:
    result = audited(tmp_path, answer)
    assert result.returncode == code and line in result.stderr
    assert "Traceback" not in result.stderr
    assert ("a 1: PYSEC-1, corrected in 2" in result.stdout) == (answer == [CLEAN, FAULT])
    numpy = metadata.version("numpy")
    assert f"numpy {numpy}: BSD-3-Clause" in result.stdout
    parts = json.loads((tmp_path / "sbom.json").read_text())["components"]
    assert f"pkg:pypi/numpy@{numpy}" in {one["purl"] for one in parts}
