"""Every table of evidence says who judges, what both sides share, and what it cannot show."""

from __future__ import annotations

import re

import pytest

from tests.conftest import REPOSITORY
from tests.validation import mutants

DOCS = REPOSITORY / "docs"
SAID = ("- Judge:", "- Shared:", "- Cannot show:")
# Heads of tables that claim nothing: what there is, what is asked for, what is written
NO_EVIDENCE = {
    "architecture.md": "all",
    "bim.md": "all",
    "capabilities.md": "all",
    "formats.md": "all",
    "glossary.md": "all",
    "howto.md": "all",
    "issues.md": "all",
    "quickstart.md": "all",
    "validation.md": {"| subject | judged by | page |"},
    "bsdf.md": {"| stated | by | used as | DGP |"},
    "daylight.md": {"| function | gives |"},
    "design.md": {"| table | keys |", "| key | what varies |", "| in the folder | what |"},
    "fit.md": {"| table | keys |", "| quantity | unit | model |", "| in the folder | what |"},
    "glare.md": {"| index | of | source |", "| option | default | |", "| part of a five-phase picture | resolution |"},
    "radiance.md": {"| type | as | status | how |"},
    "thermal.md": {"| to | read |", "| closure | absorptances from | layer resistance | film resistances |"},
    "control.md": {
        "| of `ControlHour` | what |",
        "| rule or key | closed | test |",
        "| scenario | set points | source | not available, left out |",
    },
    "comply.md": {
        "| in the folder of results | what |",
        "| option | what |",
        "| rule | quantity | set-up | weather that it asks for |",
    },
    "sensitivities.md": {"| column | content |", "| file | content |", "| input | deviation | source |"},
    "spectral.md": {"| file | content |", "| part | spectrum |"},
    "app.md": {"| file | content | read by |"},
    "studies.md": {"| in the folder | what |", "| event | what is done |"},
    "pv.md": {"| key | meaning |"},
    "site.md": {"| in the folder of results | quantity | met if |"},
}
ONCE = {"benchmarks.md", "evidence_reliability.md", "reliability.md"}  # pages that say it once, for all of their tables


def tables(page: str) -> list[tuple[str, str]]:
    """Head of each table, and the text between it and the table or heading before it."""
    found, text, inside = [], [], False
    for line in page.splitlines():
        if line.startswith("#"):
            text = []
        if line.startswith("|"):
            if not inside:
                found.append((line, "\n".join(text)))
            text = []
        inside = line.startswith("|")
        if not inside:
            text.append(line)
    return found


def silent(name: str, page: str) -> list[str]:
    """Heads of tables that do not say what they are."""
    exempt = NO_EVIDENCE.get(name, set())
    above = page if name in ONCE else ""
    return [
        head
        for head, text in tables(page)
        if exempt != "all" and head not in exempt and not all(word in text or word in above for word in SAID)
    ]


@pytest.mark.parametrize("name", sorted(path.name for path in DOCS.glob("*.md")))
def test_each_table_says_what_it_is(name):
    assert not silent(name, (DOCS / name).read_text("utf-8"))


@pytest.mark.parametrize("said", SAID)
def test_a_silent_table_is_found(said):
    page = (DOCS / "evidence_glare.md").read_text("utf-8")
    assert len(silent("evidence_glare.md", page.replace(said, "- ", 1))) == 1


def test_what_is_exempt_is_there():
    for name, heads in NO_EVIDENCE.items():
        page = (DOCS / name).read_text("utf-8")
        assert heads == "all" or heads <= {head for head, _ in tables(page)}, name


def test_the_glossary_counts_klems_patches_as_the_code_does():
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER

    full, half, quarter = (basis.size for basis in (KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER))
    said = f"{full} x {full} (full), {half} (half) or {quarter} (quarter) patches"
    assert said in (DOCS / "glossary.md").read_text("utf-8")


def test_modules_in_which_faults_are_planted_are_there():
    for module, tests in mutants.MODULES.items():
        assert (REPOSITORY / f"{module}.py").is_file(), module
        assert all((REPOSITORY / "tests" / f"{one}.py").is_file() for one in tests), module


def unknown_tests(page: str) -> list[str]:
    """Rows of a page of faults whose last cell names no test, or one that is not there."""
    rows, file = [], ""
    for row in page.splitlines():
        if not row.startswith("| ") or row.startswith("| fault |"):
            continue
        cell = re.split(r"(?<!\\)\|", row)[-2].strip()
        names = re.findall(r"`([^`]+)`", cell)
        if not names and not (file and cell.startswith("the same")):
            rows.append(row)
        for name in names:
            file, function = name.partition("::")[0] or file, name.partition("::")[2]
            path = REPOSITORY / file
            pattern = re.escape(function).replace(re.escape("..."), r"\w*") if function else "test_"
            if not path.is_file() or not re.search(rf"^def {pattern}", path.read_text("utf-8"), re.MULTILINE):
                rows.append(row)
    return rows


def test_each_fault_has_its_test():
    page = (DOCS / "reliability.md").read_text("utf-8")
    assert not unknown_tests(page)
    assert len(unknown_tests(page.replace("::test_a_read_only_disk", "::test_a_written_disk"))) == 1
    assert len(unknown_tests(page.replace("`tests/test_processes.py`", "-"))) > 0
