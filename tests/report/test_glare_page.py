"""The page of a year of glare: roses on the plan, the worst view, seats and views."""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.view import fisheye
from scenes.figures.plan import plan_frame
from scenes.figures.rose import RoseWedge, roses
from scenes.head import NO_HEAD
from scenes.language.catalogue import in_language
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.pictures import write_check_picture
from scenes.report.glare_figures import glare_plan
from scenes.report.headline import GLARE_OF_YEAR, POOR, cards
from scenes.results import GlareMap
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.outputs import write_heat_map
from scenes.year_of_glare.page import write_page
from tests.devtools import Page, chromium
from tests.report.synthetic import run_result, two_rooms

DIRECTIONS = 4
SIDES = [((1, 0), 0, 1), ((0, 1), 1, -1), ((0, -1), 1, 1)]


def table() -> pd.DataFrame:
    """Views of a grid of 2 x 2 eyes in four directions; the south is worst, nearest the window."""
    rows = []
    for e, (x, y) in enumerate([(1.5, 1.5), (3.5, 1.5), (1.5, 4.0), (3.5, 4.0)]):
        for d in range(DIRECTIONS):
            way = np.array([np.sin(np.pi * d / 2), -np.cos(np.pi * d / 2)])
            much = 0.5 * max(-way[1], 0) * (1.0 if y < 2 else 0.3) + 0.01 * e
            protection = "none" if much > 0.2 else "minimum" if much > 0.1 else "high"
            rows.append(
                {
                    "view": f"eye{e + 1:03d}_{d + 1}",
                    "x": x,
                    "y": y,
                    "z": 1.2,
                    "direction_x": way[0],
                    "direction_y": way[1],
                    "direction_z": 0.0,
                    "hours_of_use": 3650,
                    "share_above_0.35": much,
                    "share_above_0.40": 0.6 * much,
                    "share_above_0.45": 0.3 * much,
                    "dgp_exceeded_in_5_percent": 0.3 + much / 2,
                    "protection_en17037": protection,
                    "highest_dgp": 0.3 + much,
                    "worst_hour": "2017-12-21 12:30:00",
                    "dgp_sunny_hour_error": 0.0,
                }
            )
    return pd.DataFrame(rows)


def write_glare_page(path: Path, page: PageOptions = OWN_PAGE) -> None:
    """The page of these views."""
    options = YearOptions("office.ifc", "city.epw", grid=2.0, directions=DIRECTIONS)
    year = SimpleNamespace(
        options=options,
        room="101 <Open> office",
        space=two_rooms().spaces[0],
        weather=SimpleNamespace(site="Lyon"),
        notes=("A note & more.",),
        head=NO_HEAD,
        fenestration=({"system": "Blind at 45", "source": "blind.xml", "windows": ["W"]},),
    )
    write_page(year, table(), path, page)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("glare") / "report.html"
    write_glare_page(path)
    return path


def test_every_view_is_a_wedge_with_its_figures(page) -> None:
    text = page.read_text()
    assert text.count('class="wedge"') == 4 * DIRECTIONS
    assert "eye002_1: 51 % above 0.35, 31 % above 0.40, 15 % above 0.45; maximum 0.81" in text
    assert "101 &lt;Open&gt; office" in text and "A note &amp; more." in text
    assert "eye002_1: DGP 0.81, 21 December" in text
    assert 'src="eye002_1_12-21_12h.png"' in text


def test_seats_have_their_worst_and_best_direction(page) -> None:
    text = page.read_text()
    section = text[text.index('id="seats"') : text.index('id="views"')]
    rows = re.findall(r"<tr>(.*?)</tr>", section, re.DOTALL)[1:]
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in rows]
    assert [c[3:5] for c in cells] == [["none", "high"]] * 2 + [["minimum", "high"]] * 2


@pytest.mark.parametrize(("way", "axis", "sign"), SIDES)
def test_wedges_point_where_the_eye_looks(way, axis, sign) -> None:
    """In SVG y goes down: a view to the north has its wedge above the eye."""
    space = two_rooms().spaces[0]
    wedge = RoseWedge(np.array([2.0, 3.0]), np.array(way, float), (0.25, 0.04), "words")
    _, body = roses(plan_frame(space, np.array([[2.0, 3.0, 1.2]])), [wedge], 1.0, 4)
    eye = np.array([200.0, -300.0])
    lengths = {}
    for name, path in re.findall(r'class="(reach|above\d)" d="(.*?)"', body):
        numbers = np.array(re.findall(r"-?\d+\.\d", path), float)
        first, last = numbers[2:4] - eye, numbers[-2:] - eye
        lengths[name] = np.linalg.norm(first)
        assert sign * (first + last)[axis] > 0
        assert abs((first + last)[1 - axis]) < 1
    # areas are shares: radii their roots
    assert lengths["above0"] / lengths["reach"] == pytest.approx(0.5, abs=0.01)
    assert lengths["above1"] / lengths["reach"] == pytest.approx(0.2, abs=0.01)


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_the_page_opens_without_a_fault(page, tmp_path) -> None:
    with Page(tmp_path) as browser:
        browser.open(page.as_uri(), ready="document.readyState === 'complete'")
        boxes = browser.value(
            "[...document.querySelectorAll('.rose .reach')].map((e) => e.getBoundingClientRect().width)"
        )
        assert len(boxes) == 4 * DIRECTIONS and min(boxes) > 10
        assert browser.value("document.documentElement.scrollWidth") <= 1400
        missing = [f for f in browser.faults if "ERR_FILE_NOT_FOUND" not in f]  # its two pictures
        assert missing == []


def captions(monkeypatch, draw) -> str:
    """Every text of the figures that a call saves."""
    texts = []

    def save(figure: Figure, *_: object, **__: object) -> None:
        figure.draw_without_rendering()
        texts.extend(text.get_text() for text in figure.findobj(Text))

    monkeypatch.setattr(Figure, "savefig", save)
    draw()
    return "\n".join(texts)


@pytest.mark.parametrize(
    ("language", "words"),
    [
        ("en", ("Mar", "0.45", "o'clock", "glare source", "protection: high")),
        ("de", ("Mär", "0,45", "Uhr", "Blendquelle", "Schutz: hoch", "Nutzungsstunden")),
        ("fr", ("mars", "0,45", "heures", "éblouissement", "protection")),
    ],
)
def test_captions_in_pictures_are_in_the_language_of_the_page(tmp_path, monkeypatch, language, words) -> None:
    times = pd.date_range("2017-01-01 00:30", periods=8760, freq="h")
    dgp = pd.Series(0.2, index=times)
    year = SimpleNamespace(
        options=YearOptions("office.ifc", "city.epw"),
        room="office",
        weather=SimpleNamespace(midpoints=times),
        sky=SimpleNamespace(lit=np.arange(8760)),
    )
    rated = SimpleNamespace(ratings=SimpleNamespace(dgp=dgp), view=SimpleNamespace(name="seat"))
    luminance = np.full((40, 40), 100.0)
    luminance[18:22, 18:22] = 1e5
    bright = evaluate(luminance, fisheye((0.0, 0.0, 1.2), (0.0, 1.0, 0.0), 40))
    monkeypatch.setattr("scenes.year_of_glare.outputs.used_dgp", lambda _, values: values)

    def draw() -> None:
        write_heat_map(tmp_path / "map.png", year, rated)
        write_check_picture(tmp_path / "sources.png", bright)

    monkeypatch.setattr("scenes.pictures.replacing", nullcontext)
    monkeypatch.setattr("scenes.year_of_glare.outputs.replacing", nullcontext)
    with in_language(language):
        text = captions(monkeypatch, draw)
    for word in words:
        assert word in text, text
    assert language == "en" or not re.search(r"protection: high|o'clock|\d\.\d", text)


def glare_year() -> GlareMap:
    """Two eyes in two directions, 20 hours of use: the second eye has glare to the south in 2 of them."""
    dgp = np.full((2, 2, 20), 0.3, dtype=np.float32)
    dgp[1, 0, :2] = 0.5, 0.42
    dgp[0, 1, :1] = 0.36
    eyes = np.array([[1.5, 1.5, 1.2], [3.5, 1.5, 1.2]])
    ways = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    return GlareMap.of(eyes, ways, dgp, spacing=2.0, step_h=0.5)


def test_a_glare_map_counts_hours_and_finds_the_worst_view() -> None:
    year = glare_year()
    assert year.worst() == [(1, 0)] and year.worst(2)[1] == (0, 0)  # equal ones in their order
    table = year.table()
    columns = ["eye", "direction_deg", "hours_above_0.35", "hours_above_0.40", "hours_above_0.45", "hours_of_use"]
    assert table.loc[2, columns].tolist() == [2, 180, 1.0, 1.0, 0.5, 10.0]
    assert table.loc[1, columns].tolist() == [1, 90, 0.5, 0.0, 0.0, 10.0]
    assert table["dgp_exceeded_in_5_percent"].round(2).tolist() == [0.3, 0.3, 0.42, 0.3]


@pytest.mark.parametrize(
    ("seats", "value", "words"),
    [
        (0.30, "High", "0.31 at the view point, 0.30 ± 0.03 at the worst seat"),
        (0.37, "High", "0.31 at the view point, 0.37 ± 0.03 at the worst seat"),  # within the map's error of 0.35
        (0.44, "Minimum", "0.31 at the view point, 0.44 ± 0.03 at the worst seat"),
        (0.60, "None", "0.31 at the view point, 0.60 ± 0.03 at the worst seat"),
    ],
)
def test_the_protection_from_glare_is_that_of_the_worst_seat_where_the_map_tells(seats, value, words) -> None:
    result = run_result(picture_size=32, pictures=1)
    room = result.spaces[1]
    year = room.annual_glare.assign(dgp=0.31)
    eyes, ways = np.array([[1.5, 1.5, 1.2]]), np.array([[0.0, -1.0, 0.0]])
    plan = GlareMap.of(eyes, ways, np.full((1, 1, 20), seats, dtype=np.float32), spacing=2.0, step_h=1.0)
    (card,) = (c for c in cards(result, replace(room, annual_glare=year, glare_map=plan)) if c.code == GLARE_OF_YEAR)
    assert card.value == value and words in card.words
    assert (card.grade == POOR) == (value == "None")


def test_the_plan_of_a_glare_map_names_the_worst_view() -> None:
    found = glare_plan(two_rooms().spaces[0], glare_year())
    assert found.limits == ("0.35", "0.40", "0.45") and found.body.count('class="wedge"') == 4
    assert "x 3.5 m, y 1.5 m, looking south, DGP above 0.45 in 5.0 % of the hours" in found.explanation
    assert "x 3.5 m; y 1.5 m; south: 1 h above 0.35, 1 h above 0.40" in found.body
    with in_language("de"):
        german = glare_plan(two_rooms().spaces[0], glare_year())
    assert "x 3,5 m; y 1,5 m; Süden: 1 h über 0,35" in german.body and "Blick nach Süden" in german.explanation
