"""The glossary names each public class of the four faces and of `bim.model`, and no other."""

from __future__ import annotations

import importlib
import inspect
import re

import pytest

from tests.conftest import REPOSITORY
from tests.test_faces import PACKAGES, face

PAGE = (REPOSITORY / "docs" / "glossary.md").read_text("utf-8")
HEADING = "## Classes of "


def classes(package: str) -> set[str]:
    """Names of a face's classes; of `bim` also the public ones of its data model."""
    module = importlib.import_module(package)
    found = {name for name in face(package) if inspect.isclass(getattr(module, name))}
    if package == "bim":
        model = importlib.import_module("bim.model")
        found |= {
            name
            for name, value in inspect.getmembers(model, inspect.isclass)
            if value.__module__ == model.__name__ and not name.startswith("_")
        }
    return found


def rows(page: str, package: str) -> list[list[str]]:
    """Cells of a package's table, without its head."""
    section = page.split(f"{HEADING}`{package}`\n", 1)[1].split("\n## ", 1)[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def faults(page: str, package: str) -> list[str]:
    """Classes without a line, lines without a class, lines that say nothing or come twice."""
    table = rows(page, package)
    names = [row[0].strip("`") for row in table]
    there = classes(package)
    return (
        [f"{name} is missing" for name in sorted(there - set(names))]
        + [f"{name} does not exist" for name in sorted(set(names) - there)]
        + [f"{name} comes twice" for name in sorted({n for n in names if names.count(n) > 1})]
        + [f"{row[0]} says nothing" for row in table if not row[-1]]
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_each_public_class_has_a_line(package):
    assert faults(PAGE, package) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_a_class_without_a_line_and_a_line_without_a_class_are_found(package):
    first = rows(PAGE, package)[0][0]
    name = first.strip("`")
    heading, renamed = f"{HEADING}`{package}`\n", f"| `{name}Formerly` |"
    before, after = PAGE.split(heading)
    planted = before + heading + after.replace(f"| {first} |", renamed, 1)
    assert faults(planted, package) == [f"{name} is missing", f"{name}Formerly does not exist"]


def test_each_face_has_a_section():
    sections = re.findall(rf"^{HEADING}`(\w+)`$", PAGE, re.MULTILINE)
    assert sorted(sections) == sorted(PACKAGES)
