"""The level of daylight provision of a run, by the rule file that `cfs comply` reads."""

from __future__ import annotations

import pytest

from mitsuba_cfs.metrics.en17037 import DaylightProvision
from scenes.comply.rules import read_rule
from scenes.provision_levels import level_number, provision_levels


@pytest.mark.parametrize(
    ("lower", "upper", "number"),
    [
        (99, 9000, 0),
        (100, 299, 0),
        (100, 300, 1),
        (299, 9000, 1),
        (300, 500, 2),
        (499, 9000, 2),
        (500, 749, 2),
        (500, 750, 3),
    ],
)
def test_levels_of_table_a1(lower, upper, number):
    assert level_number(DaylightProvision(upper, lower)) == number


def test_rules_of_a_run_and_of_a_dossier_are_one_file():
    """Read by pydantic there and plainly here; limits of both rooms' tables agree."""
    criterion = next(c for c in read_rule("en17037").criterion if c.key == "provision")
    wanted = [(level.name, *(need.at_least for need in level.needs)) for level in criterion.level]
    assert [(one.name, one.target, one.minimum) for one in provision_levels()] == wanted
    assert provision_levels()[2].words == "750 and 500 lx"
