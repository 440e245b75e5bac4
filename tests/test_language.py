"""Plain English: phrases and names of a private dialect stay out of docs, docstrings and messages.

`PHRASES` and `NAMES` have the replacement for each. A part of the code that still has some is in
`NOT_CLEAN`; a part that has become clean leaves that list, and none enters it.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

PHRASES = {  # a regular expression, and what to write
    r"alike all over": "uniform",
    r"what stands": "surroundings, obstructions",
    r"stands? in for": "replaces",
    r"stands? in the (file|way)": "is in the file; obstructs",
    r"beside each other": "in parallel, side by side",
    r"comes? along": "is shipped with",
    r"(goes|go) back\b": "is returned",
    r"no more\b(?! than)": "no longer",
    r"(lies|lie) in (the|a|its) (file|folder|cache|model|IFC)": "is in",
    r"looks? (out|onto)\b": "faces",
    r"what of (a|the|it|its)\b": "the part of",
    r"(is|are|was|were|and) said\b": "is reported, is stated",
    r"(is|are) told\b(?! to)": "is stated",
    r"told apart": "distinguished",
    r"held (against|to the|to its)": "compared with",
    r"hangs? on\b": "depends on",
    r"at hand": "available",
    r"(found|made|traced|computed|run|tried) anew": "... again",
    r"kept (and|or) found|found (and|or) kept|or else it is found": "cached, computed and cached",
    r"the way (out|through) (of|to)\b": "the exit of, the path to",
    r"brought to light|comes? to light": "showed",
    r"worked out": "computed",
    r"by (two|three|five) phases": "with the five-phase method",
    r"(behind|before) (a|the|its|each) (pane|blind|window|glass|shade|screen)s?\b": "say which side: outside, on the room side of",
    r"(a|an|each|every|one) (row|ray|path|column|line|picture) an? "
    r"(hour|pixel|sensor|case|room|patch)": "... per ...",
    r"\bmend(s|ed|ing)?\b": "fix",
    r"does without|do without": "omits",
    r"(walks|walk) of light": "random walks",
    r"for itself\b": "separately",
    r"neither .{1,40} nor .{1,40} hold": "say it with a verb",
    r"each for itself|all by itself": "separately",
    r"so far apart": "spacing",
    r"asks? for nothing": "needs no, loads nothing",
    r"to be had\b": "available",
}
NAMES = {  # names of public functions, classes, parameters and fields
    "found": "result",
    "said": "message",
    "heard": "callbacks",
    "given": "overrides",
    "mine": "the thing itself",
    "theirs": "the thing itself",
    "ours": "the thing itself",
    "kept": "cached",
    "looks": "views",
    "ways": "paths",
    "standing": "outdoors",
}
PREFIXES = ("kept_", "found_", "said_", "heard_", "given_")
ALLOWED = {"given_sky"}  # public names that stay until the next breaking version

# Parts of the code that still have such phrases or names: the list shrinks, and none enters it
NOT_CLEAN: set[str] = set()

PHRASE = re.compile("|".join(f"(?:{pattern})" for pattern in PHRASES), re.IGNORECASE)
DOCS = [
    *(REPOSITORY / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((REPOSITORY / "docs").rglob("*.md")),
]
PACKAGES = ("mitsuba_cfs", "thermal", "bim", "scenes")


def part(path: Path) -> str:
    """The sub-package of a module, or its package."""
    folder = path.relative_to(REPOSITORY).parent.parts
    return "/".join(folder[:2])


def modules() -> dict[str, list[Path]]:
    """Modules by part of the code."""
    parts: dict[str, list[Path]] = {}
    for package in PACKAGES:
        for path in sorted((REPOSITORY / package).rglob("*.py")):
            parts.setdefault(part(path), []).append(path)
    return parts


def prose(source: str) -> Iterator[tuple[int, str]]:
    """Comments and texts of a module with the number of their first line; no code."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in (tokenize.COMMENT, tokenize.STRING):
            yield token.start[0], token.string


def phrases(text: str) -> list[str]:
    """The phrases to avoid in a text, however its lines are broken."""
    joined = re.sub(r"\s*\n\s*#?\s*", " ", text)
    return [match[0] for match in PHRASE.finditer(joined)]


def public_names(source: str) -> Iterator[tuple[int, str]]:
    """Names of public functions and classes, their parameters and fields, with their lines."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            if node.name.startswith("_"):
                continue
            yield node.lineno, node.name
            arguments = node.args
            for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
                yield node.lineno, a.arg
        elif isinstance(node, ast.ClassDef):
            yield node.lineno, node.name
            for field in node.body:
                if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                    yield field.lineno, field.target.id


def faults(path: Path) -> list[str]:
    """Phrases and names to avoid in a module."""
    source = path.read_text("utf-8")
    name = path.relative_to(REPOSITORY).as_posix()
    said = [f"{name}:{line}: {p}" for line, text in prose(source) for p in phrases(text)]
    named = [
        f"{name}:{line}: name {n}"
        for line, n in public_names(source)
        if (n in NAMES or n.startswith(PREFIXES)) and n not in ALLOWED
    ]
    return said + named


@pytest.mark.parametrize("page", DOCS, ids=lambda page: page.relative_to(REPOSITORY).as_posix())
def test_the_docs_are_in_plain_english(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert not phrases(text)


@pytest.mark.parametrize("name", sorted(set(modules()) - NOT_CLEAN))
def test_the_code_is_in_plain_english(name: str) -> None:
    assert not [fault for path in modules()[name] for fault in faults(path)]


def test_parts_that_are_clean_leave_the_list() -> None:
    there = modules()
    assert set(there) >= NOT_CLEAN
    assert not [n for n in sorted(NOT_CLEAN) if not any(faults(path) for path in there[n])]


def test_a_planted_phrase_and_name_are_found(tmp_path: Path) -> None:
    assert phrases("It is said in\n    one line, and comes\n# along.") == ["is said", "comes along"]
    names = [name for _, name in public_names("def read(kept_sun, *, found):\n    pass\n")]
    assert names == ["read", "kept_sun", "found"]
