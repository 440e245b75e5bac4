"""Systems of a study with shading states of their own, and the demo's study of one."""

from __future__ import annotations

import re

import pytest

from mitsuba_cfs.errors import DataError
from scenes.demo import FOLDER, STUDY, VENETIAN_BLIND
from scenes.study.files import check_files
from scenes.study.plan import plan_of
from scenes.study.store import Store
from scenes.study.study import run_study
from scenes.study.study_file import read_study
from tests.scenes.study_files import SYSTEM, study_file

pytestmark = pytest.mark.early

STATES = f"""
[[system]]
bsdf = "{FOLDER / "glazing.xml"}"
[[system]]
bsdf = "{VENETIAN_BLIND}"
[control]
"""


@pytest.fixture(scope="module")
def years(tmp_path_factory):
    """Results of a blind and a glazing by themselves, and as the states of one system."""
    tmp_path = tmp_path_factory.mktemp("states")
    (tmp_path / "up.toml").write_text(STATES + "state = 0\n")
    (tmp_path / "down.toml").write_text(STATES + "state = 1\n")
    glazing = SYSTEM.replace(str(VENETIAN_BLIND), str(FOLDER / "glazing.xml"))
    systems = SYSTEM + glazing.replace('"blind"', '"glass"')
    systems += '[[system]]\noperation = "up.toml"\n[[system]]\noperation = "down.toml"\n'
    (tmp_path / "gains.toml").write_text("[gains]\n")  # the same defaults as without the table
    head = 'operation = "gains.toml"\nmethods = ["three-phase"]\nglare = "sDGP"\n'
    study = read_study(study_file(tmp_path, head, system=systems))
    check_files(study)
    found = run_study(study, Store(tmp_path / "out"))
    assert found.failed == 0, found.first_error
    return found.table.set_index("system"), plan_of(study)


def stays(table, column: str) -> None:
    blind, glass, up, down = table.loc[["blind", "glass", "up", "down"], column]
    assert up == pytest.approx(glass, rel=1e-6) and down == pytest.approx(blind, rel=1e-6)
    assert glass > 1.02 * blind, column


def test_a_system_that_stays_in_a_state_is_that_state(years):
    """Of two states the first and the second, by `always`: as the systems by themselves."""
    table, plan = years
    for column in ("da300", "dgp_mean"):
        stays(table, column)
    assert table.loc["up", "fenestration"].startswith("Window")
    assert plan.cases[2].key != plan.cases[3].key


def test_the_heat_of_a_system_that_stays_in_a_state_is_that_states(years):
    stays(years[0], "operative_mean_c")


@pytest.mark.parametrize(
    ("system", "operation", "words"),
    [('bsdf = "{blind}"\n', STATES, "leave [[system]] out"), ("", "[loads]\nheating_c = 20\n", "is missing")],
)
def test_states_are_where_the_system_has_none(tmp_path, system, operation, words):
    (tmp_path / "own.toml").write_text(operation)
    text = "[[system]]\n" + system.format(blind=VENETIAN_BLIND) + 'operation = "own.toml"\n'
    with pytest.raises(DataError, match=re.escape(words)) as caught:
        read_study(study_file(tmp_path, system=text))
    assert "own.toml" in str(caught.value)


def test_the_demo_compares_one_room_in_three_ways():
    study = read_study(STUDY)
    check_files(study)
    cases = plan_of(study).cases
    assert [case.system for case in cases] == ["Blind up", "Blind down", "Blind controlled"]
    assert len({case.scene for case in cases}) == 1 and len({case.key for case in cases}) == 3
