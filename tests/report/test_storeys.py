"""Rooms on the plans of their storeys: coloured, ranked, chosen; the page's outline of headings."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from scenes.report.page import report_html
from scenes.report.storeys import room_metrics, storey_plans
from tests.report.browser import chromium, inspect
from tests.report.synthetic import moved, run_result

USE = """
    const fills = () => [...document.querySelectorAll(".storey a path")]
      .map((p) => p.getAttribute("fill"));
    const shown = () => [...document.querySelectorAll("figure.storey")].map((f) => !f.hidden);
    const ranking = () => document.querySelector(".ranking:not([hidden]) ol").textContent;
    report.fills = [fills()];
    report.ranking = [ranking()];
    choose("storey-metric", "3");
    report.fills.push(fills());
    report.ranking.push(ranking());
    report.words = [...document.querySelectorAll(".storey a text")].map((t) => t.textContent);
    report.titles = [...document.querySelectorAll(".storey a title")].map((t) => t.textContent);
    report.shown = [shown()];
    choose("storey-choice", "1");
    report.shown.push(shown());
"""


@pytest.fixture(scope="module")
def result():
    """Two rooms one above the other, and one more that was not computed."""
    run = run_result(picture_size=48, pictures=1)
    first, second = run.spaces
    high = replace(moved(second.space, [0.0, 0.0, 3.2]), storey="First floor")
    low = replace(first.space, storey="Ground floor")
    left_out = replace(moved(low, [9.0, 0.0, 0.0]), guid="other", name="Store")
    building = replace(run.building, spaces=(high, low, left_out))
    rooms = (replace(second, space=high), replace(first, space=low))
    return replace(run, building=building, spaces=rooms)


def test_storeys_rise_and_show_what_was_not_computed(result) -> None:
    ground, first = storey_plans(result)
    assert (ground.name, first.name) == ("Ground floor", "First floor")
    assert [room.number for room in ground.rooms] == [1, None]
    assert [room.number for room in first.rooms] == [0]
    west, _, width, _ = map(float, ground.view_box.split())
    assert all(west < room.x < west + width for room in ground.rooms)


def test_rooms_are_ranked_by_what_is_better(result) -> None:
    found = {one.scale.label: one for one in room_metrics(result)}
    light, warm = found["Daylight autonomy"], found["Highest operative temperature"]
    means = [float(r.daylight.sensor_metrics["da300"].mean()) for r in result.spaces]
    assert light.ranked == tuple(np.argsort(means)[::-1])
    peaks = [float(r.heat.operative_c.max()) for r in result.spaces]
    assert warm.ranked == tuple(np.argsort(peaks))
    assert warm.words(0) == f"{peaks[0]:.1f}"
    assert replace(light, values=(float("nan"), 5.0)).ranked == (1,)
    assert replace(light, values=(float("nan"), 5.0)).words(0) == "–"


def test_headings_descend_one_by_one_and_the_page_can_be_skipped_into(result) -> None:
    page = report_html(result)
    levels = [int(level) for level in re.findall(r"<h([1-6])", page)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert page.index('class="skip" href="#verdict"') < page.index("<header>")


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("width", [1400, 375], ids=["wide", "phone"])
def test_another_figure_is_chosen_in_a_browser(result, tmp_path, width) -> None:
    found = inspect(report_html(result), tmp_path, width=width, use=USE)
    assert found["faults"] == [] and found["scroll"] <= found["width"]
    metrics = room_metrics(result)
    for metric, fills in zip((metrics[0], metrics[3]), found["fills"], strict=True):
        assert fills == [metric.scale.hex(metric.values[i]) for i in (1, 0)]
    assert found["words"] == [metrics[3].words(1), metrics[3].words(0)]
    assert found["titles"][0].endswith(": " + metrics[3].words(1) + " ")
    best = result.spaces[metrics[3].ranked[0]].space.label
    assert found["ranking"][1].startswith(best) and found["ranking"][0] != found["ranking"][1]
    assert found["shown"] == [[True, True], [False, True]]
