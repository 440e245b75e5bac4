"""`cfs design --scheduler`: candidates on the workers of a Dask cluster."""

from __future__ import annotations

import os

import pytest

from scenes.design.design import run_design
from scenes.design.design_file import read_design
from tests.design.designs import COOLING, ENERGY, PLAIN, SEARCH, WIDTH, by_formula, design_file

pytest.importorskip("distributed")

from tests.scenes.test_study_cluster import Cluster

pytestmark = pytest.mark.early

WARM = '[[constraint]]\nname = "warm hours"\nat_most = 60\n'


def where_computed(case, *, progress=None):
    """The figures of the formula, and the process that computed them."""
    result = by_formula(case)
    result.figures["process"] = float(os.getpid())
    return result


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A scheduler and two workers."""
    found = Cluster(tmp_path_factory.mktemp("dask"), 2)
    yield found
    found.stop()


def test_workers_give_the_same_grid(cluster, tmp_path):
    few = WIDTH.replace("0.4", "1.0").replace("2.4", "1.5")
    search = SEARCH + 'method = "all"\n'
    design = read_design(design_file(tmp_path, PLAIN, few, COOLING, ENERGY, WARM, search))
    alone = run_design(design, tmp_path / "alone", compute=by_formula)
    shared = run_design(design, tmp_path / "shared", compute=where_computed, scheduler=cluster.address)
    assert shared.table.equals(alone.table)
    assert shared.errors == alone.errors
    assert {one.figures["process"] for one in shared.study.results} <= {one.pid for one in cluster.workers}


def test_a_search_on_workers_finds_the_best_of_the_grid(cluster, tmp_path):
    design = read_design(design_file(tmp_path, PLAIN, WIDTH, COOLING, ENERGY, WARM, SEARCH))
    result = run_design(design, tmp_path / "out", compute=by_formula, scheduler=cluster.address)
    assert result.best.candidate.label == "width 1.2 m, set point 25"
    again = run_design(design, tmp_path / "again", compute=by_formula, scheduler=cluster.address)
    assert [one.candidate.point for one in again.searched] == [one.candidate.point for one in result.searched]
