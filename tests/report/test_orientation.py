"""The building within the paths of the sun: north is up, and the words say where it comes from."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from bim.report.issue import Issue
from scenes.report.page import INNER, OUTER, orientation, report_html
from tests.report.synthetic import run_result


@pytest.fixture(scope="module")
def result():
    return run_result(picture_size=48, pictures=1)


def _with_axis(result, degrees: float, *codes: str):
    """The run with a model whose +y axis points so many degrees from north to east."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(4)
    matrix[:2, :2] = [[c, s], [-s, c]]
    values = {"map": degrees, "true": 0.0, "difference": abs(degrees), "angle": degrees}
    issues = tuple(Issue(code, "project", values) for code in codes)
    return replace(result, building=replace(result.building, from_model=matrix, issues=issues))


def _points(body: str, style: str) -> list[np.ndarray]:
    paths = re.findall(rf'class="{style}" d="M([^"Z]*)', body)
    return [np.array([p.split() for p in path.split("L")], dtype=float) for path in paths]


def test_paths_rise_in_the_east_and_are_high_in_summer_at_noon_in_the_south(result):
    body = orientation(result).body
    june, march, december = _points(body, "sun")
    for path in (june, march, december):
        radius = np.hypot(*path.T)
        assert path[0, 0] > 0 > path[-1, 0]  # east is right
        assert radius[[0, -1]] == pytest.approx(OUTER, abs=25) and radius.min() > INNER
        assert path[radius.argmin(), 1] > 0  # south is down
    # azimuths of the rise: sin(declination) / cos(latitude), declinations +-23.44 and 0 degrees
    rises = [np.degrees(np.arctan2(p[0, 0], -p[0, 1])) for p in (june, march, december)]
    assert rises == pytest.approx([55.2, 90.0, 124.8], abs=4)
    noon = [OUTER - np.hypot(*p.T).min() for p in (june, march, december)]  # 90 degrees: the ring
    degrees = np.array(noon) * 90 / (OUTER - INNER)
    assert degrees == pytest.approx([67.7, 44.3, 20.8], abs=1.5)


def test_windows_are_on_the_side_that_they_face(result):
    ends = _points(orientation(result).body, "window")
    spaces = result.building.spaces
    normals = [window.normal for space in spaces for window in space.windows]
    assert len(ends) == len(normals)
    for (first, last), normal in zip(ends, normals, strict=True):
        along = (last - first) / np.linalg.norm(last - first)
        assert along @ [normal[0], -normal[1]] == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(
    ("degrees", "codes", "words"),
    [
        (30.0, (), "30.0° east of north (by TrueNorth)"),
        (-45.0, ("north-contradicts-map",), "45.0° west of north (by IfcMapConversion; TrueNorth"),
        (0.0, ("true-north-missing",), "0.0° east of north (assumed: the file states no north)"),
        (12.5, ("north-corrected",), "12.5° east of north (by the corrections file)"),
    ],
)
def test_the_axis_of_the_model_is_drawn_and_named_with_its_source(result, degrees, codes, words):
    shown = orientation(_with_axis(result, degrees, *codes))
    assert words in shown.words
    ((tail, tip),) = _points(shown.body, "axis")
    angle = np.degrees(np.arctan2(tip[0] - tail[0], tail[1] - tip[1]))
    assert angle == pytest.approx(degrees, abs=0.1)


def test_the_page_has_the_picture_and_a_model_without_axes_of_its_own_has_no_axis(result):
    page = report_html(result)
    assert 'id="orientation"' in page and "North is up in all plans." in page
    assert 'class="axis"' not in page
