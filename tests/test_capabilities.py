"""No command, option, key, rule, format or public name of an earlier state is missing."""

from __future__ import annotations

import pytest

from tests.capabilities import STORED, capabilities, mentioned, missing, read_renames, read_stored, renamed


@pytest.fixture(scope="module")
def now():
    return capabilities()


@pytest.mark.parametrize("stored", sorted(STORED.glob("*.tsv")), ids=lambda path: path.stem)
def test_nothing_that_was_there_is_missing(stored, now):
    assert not missing(read_stored(stored), now, read_renames())


def test_each_rename_is_needed_and_leads_somewhere(now):
    """A line of renames.json that no stored capability needs has become wrong or useless."""
    before = {one for path in STORED.glob("*.tsv") for one in read_stored(path)}
    for old, new in read_renames().items():
        affected = [one for one in before if renamed(one, {old: new}) != one]
        assert affected, old


def test_planted_loss_is_found(now):
    before = [("command", "run"), ("option", "run --quick"), ("option", "run --gone")]
    assert missing(before, now, {}) == [("option", "run --gone")]
    assert not missing(before, now, {"option: run --gone": "option: run --quick"})
    assert not missing(before, now, {"option: run --gone": ""})


def test_a_group_is_renamed_with_its_options():
    renames = {"option: ifc check *": "option: check *", "command: ifc check": "command: check"}
    assert renamed(("option", "ifc check --out"), renames) == ("option", "check --out")
    assert renamed(("command", "ifc check"), renames) == ("command", "check")
    assert renamed(("command", "ifc survey"), renames) == ("command", "ifc survey")


def test_a_test_is_named_for_what_has_one():
    assert mentioned("command", "bsdf check")
    assert mentioned("rule", "lm83")
    assert not mentioned("option", "run --no-such-option")
