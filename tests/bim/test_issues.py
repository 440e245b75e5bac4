"""Issues as data: the catalogue, texts for a layer and a language, and the page of codes."""

from __future__ import annotations

import ast
import pickle
import re

import pytest

from bim.report.__main__ import page
from bim.report.issue import COLUMNS, Effect, Issue, Phrase, catalogue, issue_rows, issue_text, phrases, templates
from bim.report.ranking import ranked
from tests.conftest import REPOSITORY
from tests.modules import MODULES

FLAG = re.compile(r"\bcfs [a-z]|(?<![\w-])--[a-z]")
WITHOUT_FLAGS = ("bim/bonsai/", "bim/report/__main__.py", "bim/to_radiance.py")
GLASS = Issue("glass-between-rooms", "W1", {"element": "IfcWindow W1", "rooms": ("A", "B")})
EFFECT = "daylight does not pass it; in the coupled heat balance of both rooms, sun does"


def test_the_fix_is_for_the_layer_that_shows_it():
    assert "inner_glass=True" in issue_text(GLASS).fix
    assert "--inner-glass" in issue_text(GLASS, "command").fix


def test_a_template_is_translated_before_it_is_filled():
    german = {
        "{element} is glass between the rooms {rooms}": "{element} ist Glas zwischen {rooms}",
        EFFECT: "gilt als undurchsichtig",
    }
    text = issue_text(GLASS, fill=lambda one, _="", **values: german.get(one, one).format(**values))
    assert text.what == "IfcWindow W1 ist Glas zwischen A, B"
    assert text.effect == "gilt als undurchsichtig"
    assert set(german) <= set(templates())


def test_phrases_within_values_are_translated():
    repaired = Issue("space-repaired", "S", {"room": "R1", "repair": Phrase("holes-capped")})
    text = issue_text(
        repaired, fill=lambda one, _="", **values: {"holes capped": "Löcher"}.get(one, one).format(**values)
    )
    assert text.effect == "it is repaired: Löcher"


def test_long_lists_are_counted():
    many = Issue("rooms-joined", "R", {"rooms": tuple("ABCDEFGHIJ")})
    assert issue_text(many).what == "The rooms A, B, C, D, E, F and 4 more were to be joined"


def test_unknown_codes_and_missing_values_are_refused():
    with pytest.raises(ValueError, match="no issue has the code 'nothing'"):
        Issue("nothing", "x")
    with pytest.raises(ValueError, match="issue window-without-room: lacks element"):
        Issue("window-without-room", "x")
    with pytest.raises(ValueError, match="phrase next-storey: lacks gap"):
        Phrase("next-storey")


def test_issues_are_values():
    again = pickle.loads(pickle.dumps(GLASS))
    assert again == GLASS and len({again, GLASS}) == 1
    assert GLASS != Issue(GLASS.code, GLASS.where, {**GLASS.values, "rooms": ("A", "C")})


def test_rows_have_code_and_severity():
    (row,) = issue_rows([GLASS], "command")
    assert dict(zip(COLUMNS, row, strict=True)) == {
        "where": "W1",
        "what": "IfcWindow W1 is glass between the rooms A, B",
        "consequence": f"{EFFECT}; --inner-glass lets daylight pass",
        "code": "glass-between-rooms",
        "severity": "loss",
    }


def test_issues_of_a_code_are_told_apart_by_the_values_of_its_group():
    low = [
        Issue("room-too-low", name, {"room": name, "top": 2.0, "area": 1.0, "reason": Phrase(why)}, Effect(glass=1.0))
        for name, why in (("A", "not-covered"), ("B", "not-covered"), ("C", "top-not-level"))
    ]
    assert [one.count for one in ranked(low)] == [2, 1]


def test_the_page_of_codes_is_that_of_the_catalogue():
    """Written anew by `python -m bim.report`."""
    text = (REPOSITORY / "docs" / "issues.md").read_text("utf-8")
    assert text == page()
    assert all(f"| `{code}` |" in text for code in catalogue())


def test_texts_are_parts_of_one_sentence():
    for code, template in catalogue().items():
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", code)
        assert template.what[0].isupper() or template.what[0] == "{", code
        assert not template.effect[0].isupper() and not template.what.endswith("."), code
        assert set(template.group) <= template.fields, code


def _strings(tree: ast.Module):
    """String constants that are no docstrings."""
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node


def test_no_module_of_bim_names_a_flag_of_the_command_line():
    """Python callers have arguments; `fix-command` of the catalogue is for the command line."""
    faults = []
    for path in MODULES:
        name = path.relative_to(REPOSITORY).as_posix()
        if not name.startswith("bim/") or name.startswith(WITHOUT_FLAGS):
            continue
        tree = ast.parse(path.read_text("utf-8"))
        faults += [f"{name}:{one.lineno}" for one in _strings(tree) if FLAG.search(one.value)]
    assert not faults


def test_every_code_and_phrase_is_used():
    text = "\n".join(path.read_text("utf-8") for path in MODULES)
    built = {f"{kind}-assumed" for kind in ("reflectance", "construction", "element", "adjacency")}
    built |= {"apertures-without-room", "doors-without-room"}
    assert not [code for code in catalogue() if f'"{code}"' not in text and code not in built]
    prefixes = ("month-", "side-", "data-")
    assert not [key for key in phrases() if f'"{key}"' not in text and not key.startswith(prefixes)]
