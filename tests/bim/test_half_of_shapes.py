"""Half of a model's products is meshed in another process: the same shapes, whatever happens to it."""

from __future__ import annotations

import os
from concurrent.futures import Future

import numpy as np
import pytest

from bim.ifc import shapes as module
from bim.ifc.project import open_ifc
from bim.ifc.shapes import half_of_shapes, read_shapes
from mitsuba_cfs.processes import ProcessEnded
from scenes.demo import OFFICE


@pytest.fixture
def two_cores(monkeypatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(module, "SMALL", 0)


def same(one: dict, other: dict) -> bool:
    return list(one) == list(other) and all(
        np.array_equal(one[key].triangles, other[key].triangles)
        and np.array_equal(one[key].style_index, other[key].style_index)
        and one[key].styles == other[key].styles
        for key in one
    )


def meshed_here(monkeypatch) -> list[int]:
    """Numbers of the products that are meshed in this process, as they come."""
    counts: list[int] = []
    whole = module._meshed

    def counted(model, products, *rest):
        counts.append(len(products))
        return whole(model, products, *rest)

    monkeypatch.setattr(module, "_meshed", counted)
    return counts


@pytest.mark.usefixtures("two_cores")
def test_both_processes_give_the_shapes_of_one(monkeypatch) -> None:
    model = open_ifc(OFFICE)
    whole, _ = read_shapes(model)
    here = meshed_here(monkeypatch)
    half = half_of_shapes(OFFICE)
    assert half is not None
    both, issues = read_shapes(model, half=half)
    assert same(both, whole)
    assert not issues
    assert 0 < here[0] < len(whole)
    assert here[1:] == [0]  # nothing is meshed twice


@pytest.mark.usefixtures("two_cores")
def test_products_that_are_left_out_are_left_out_of_both(monkeypatch) -> None:
    model = open_ifc(OFFICE)
    walls = {wall.id() for wall in model.by_type("IfcWall")}
    alone, _ = read_shapes(model, without=walls)
    both, _ = read_shapes(model, without=walls, half=half_of_shapes(OFFICE))
    assert same(both, alone)
    assert not walls & set(both)


def test_a_process_that_ended_leaves_its_half_to_this_one() -> None:
    """The geometry engine may crash."""
    model = open_ifc(OFFICE)
    ended: Future = Future()
    ended.set_exception(ProcessEnded("a library ended its process by signal 11", ""))
    assert same(read_shapes(model, half=ended)[0], read_shapes(model)[0])


@pytest.mark.parametrize("cores", [1, 4])
def test_other_numbers_of_cores_have_the_threads_of_the_engine(cores, monkeypatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    monkeypatch.setattr(module, "SMALL", 0)
    assert half_of_shapes(OFFICE) is None
