"""The report as a file: self-contained, escaped, complete, and robust where results are few."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from bim.account import Account, StoreyAccount
from bim.report.issue import Effect, Issue, issue_text
from scenes.report.glare_figures import gallery
from scenes.report.headline import cooled
from scenes.report.names import option_words
from scenes.report.page import environment, options_table, remaining, report_html, write_report
from scenes.report.tables import Column, Table
from scenes.report.typography import tied
from scenes.results import GlareResults
from scenes.run.options import JobOptions
from tests.report.synthetic import run_result

LARGEST = 12e6  # bytes, as asked of a run of two rooms with pictures of 600 pixels


@pytest.fixture(scope="module")
def result():
    return run_result(picture_size=96)


@pytest.fixture(scope="module")
def page(result) -> str:
    return report_html(result)


class Links(HTMLParser):
    """Everything that a page could fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attributes) -> None:
        for name, value in attributes:
            if name in ("src", "href", "srcset", "data", "poster") and value:
                self.found.append(value)


def test_nothing_is_fetched(page) -> None:
    links = Links()
    links.feed(page)
    assert links.found
    empty = "data:,"  # an icon that a browser need not ask for
    assert all(link == empty or link.startswith(("data:image/", "#")) for link in links.found)
    assert not re.search(r"url\((?!#)|@import|\bfetch\(|XMLHttpRequest|import\(", page)
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert policy in page  # the browser itself refuses the network


def test_every_anchor_of_the_contents_is_there(page) -> None:
    for anchor in re.findall(r'href="#([^"]+)"', page):
        assert f'id="{anchor}"' in page


def test_names_from_files_cannot_become_markup(page) -> None:
    assert "102 &lt;corner&gt; Meeting room west &amp; archive" in page
    assert "<corner>" not in page
    assert "Office <blank>" not in page


def test_key_numbers_are_those_of_the_result(result, page) -> None:
    for number, room in enumerate(result.spaces, start=1):
        section = page[page.index(f'id="room-{number}"') :]
        section = section[: section.index("</section>")]
        operative = room.heat.temperatures["operative_c"]
        occupied = room.heat.comfort["occupied"]
        worst = max(picture.glare["dgp"] for picture in room.glare.pictures)
        cards = dict(re.findall(r'">([^<>]+)</abbr></h3>\s*<p class="value"><b>([^<]+)</b>', section))
        assert cards["Spatial daylight autonomy"] == f"{room.daylight.room_metrics['sda300_50']:.0f}"
        assert cards["Highest glare"] == f"{worst:.2f}"
        assert cards["Peak temperature"] == f"{operative.max():.1f}"
        warm = int(((operative > 26) & occupied).sum())
        assert cards["Overheating hours"].replace("\u202f", "") == f"{warm}"
        comfort = None if cooled(room) else f"{room.heat.comfort_summary['within_80']:.0f}"
        assert cards.get("Adaptive comfort") == comfort  # it does not hold for a cooled room
    assert [cooled(room) for room in result.spaces] == [False, True]


def test_hashes_versions_seed_issues_and_notes_are_shown(result, page) -> None:
    for entry in result.manifest["inputs"].values():
        assert entry["sha256"] in page
    for text in (result.manifest["versions"]["mitsuba"], result.notes[0], "llvm_ad_mono"):
        assert text in page
    for issue in result.issues:
        assert issue_text(issue, "command").consequence in page


def test_each_option_of_a_run_is_named_and_explained() -> None:
    options = JobOptions(None, None).named()
    shown = options_table({"options": options}).rows
    files = ("building", "weather", "system")
    assert len(shown) == len(options) - len(files)
    unnamed = [key for key in options if option_words(key)[0] == key.replace("_", " ")]
    assert unnamed == [*files] and all(meaning for *_, meaning in shown)
    assert not {"True", "False", "None"} & {value for _, value, _ in shown}


def test_the_table_of_the_run_holds_no_data_of_other_tables(result) -> None:
    head = {"model": ["Model: usable"], "issues": [{"code": "no-name"}], "assumed": ["A note."]}
    manifest = {**result.manifest, "head": head, "weather_notes": []}
    assert "{&#39;code" not in report_html(replace(result, manifest=manifest))
    assert "head" not in remaining(manifest) and "weather_notes" not in remaining(manifest)


def test_account_stands_in_the_head_and_alike_issues_once(result) -> None:
    storey = StoreyAccount("E0", 3, 4, 20.0, 9.0)
    account = Account((storey,), 9, 4, 0.0, 11.0, 0.0, 0.0, 0.0, low=("A gym",))
    building = replace(result.building, account=account)
    dull = [Issue("body-not-closed", str(i), {"element": f"wall {i}"}) for i in range(19)]
    lost = Issue("window-without-room", "W1", {"element": "window W1"}, Effect("window", 11.0))
    page = report_html(replace(result, building=building, issues=(*dull, lost)))
    head, _, rest = page.replace("\u00a0", " ").partition("</header>")
    assert "9.0 of 20.0 m² of exterior glass used" in head
    assert "not usable: only 45 % of the exterior glass is used" in head
    assert "3 of 4 spaces" in head and "A gym" in head
    assert "19 times: wall 0: its body is not a closed solid" in rest and "wall 7: its" not in rest
    assert rest.index("no room behind it") < rest.index("19 times")


def test_file_is_small_with_full_pictures(tmp_path) -> None:
    path = tmp_path / "report.html"
    write_report(run_result(picture_size=600, pictures=10), path)
    assert path.stat().st_size < LARGEST
    assert path.read_text(encoding="utf-8").startswith("<!doctype html>")


def of_rooms(result, number: int):
    """The run with so many rooms, each one of its two."""
    rooms = []
    for i in range(number):
        room = result.spaces[i % 2]
        rooms.append(replace(room, space=replace(room.space, guid=f"room {i}")))
    building = replace(result.building, spaces=tuple(room.space for room in rooms))
    return replace(result, building=building, spaces=tuple(rooms))


def test_many_rooms_have_smaller_pictures_and_the_page_says_so() -> None:
    result = run_result(picture_size=400, pictures=1)
    sides = {}
    for number in (10, 11):
        run = of_rooms(result, number)
        found = gallery(run, run.spaces[0])
        seen = base64.b64decode(found.pictures[0].seen.partition(",")[2])
        sides[number] = (Image.open(io.BytesIO(seen)).width, found.reduced_to)
    assert sides == {10: (400, 0), 11: (200, 240)}  # means of 2 x 2 pixels: 240 at most
    small = of_rooms(run_result(picture_size=96, pictures=1), 11)
    assert gallery(small, small.spaces[0]).reduced_to == 0


@pytest.mark.slow
def test_twenty_rooms_are_one_file_of_less_than_8_mb() -> None:
    page = report_html(of_rooms(run_result(picture_size=600), 20))
    assert len(page.encode()) < 8e6
    assert page.count("Pictures are reduced to 240 pixels a side") == 20


def test_report_of_little(result) -> None:
    """One room without pictures, 20 days, few metrics, a bare manifest, dark all the time."""
    room, hours = result.spaces[0], slice(0, 480)
    thermal = replace(
        room.heat,
        temperatures=room.heat.temperatures.iloc[hours],
        gains=room.heat.gains.iloc[hours] * 0,
        comfort=room.heat.comfort.iloc[hours][["comfort_c", "within_80"]],
    )
    metrics = pd.DataFrame({"x": [1.0], "y": [-2.0], "z": [0.8], "daylight_factor": [np.nan]})
    daylight = replace(
        room.daylight,
        points=room.daylight.points[:1],
        sensor_metrics=metrics,
        room_metrics={},
        illuminance=np.zeros((480, 1), np.float32),
        relative_error=np.zeros(1),
    )
    few = replace(room, heat=thermal, daylight=daylight, glare=GlareResults(room.glare.view, ()))
    small = replace(
        result,
        times=result.times[hours],
        sun=result.sun[hours],
        spaces=(few,),
        issues=(),
        notes=(),
        manifest={"inputs": {"weather": "a.epw"}},
    )
    page = report_html(small)
    assert "No luminance picture was requested." in page
    assert not re.search(r"\bnan\b", page[: page.rindex("<script>")], re.IGNORECASE)
    assert "480 hours" in page


def test_no_room_is_a_wrong_call(result) -> None:
    with pytest.raises(ValueError, match="at least one room"):
        report_html(replace(result, spaces=()))


def test_a_room_shows_one_picture_in_colour_where_it_has_one() -> None:
    result = run_result(picture_size=64, pictures=2)
    first, second = result.spaces
    plain = replace(second, glare=replace(second.glare, colour=None))
    html = report_html(replace(result, spaces=(first, plain)))
    assert html.count("<b>In colour: ") == 1
    found = gallery(result, first).colour
    assert first.glare.colour is not None and gallery(result, plain).colour is None
    assert found.title in html and found.round
    shown = Image.open(io.BytesIO(base64.b64decode(found.seen.partition(",")[2])))
    assert shown.size == (64, 64)
    red, _, blue = np.asarray(shown, dtype=float).reshape(-1, 3).mean(axis=0)
    assert red > 1.2 * blue, "the made-up room is lit by a red light"


def test_options_of_a_command_are_not_broken_at_the_end_of_a_line() -> None:
    text = tied("run without --quick, for 5 m2 of <glass>")
    assert '<span class="option">--quick</span>, for 5\N{NO-BREAK SPACE}m²' in text
    assert "&lt;glass&gt;" in text
    assert '<span class="option">LM-83</span>, EN\N{NO-BREAK SPACE}17037' in tied("LM-83, EN 17037")
    table = Table("Of the code", (Column("Rule"),), (("EN 17037, 5 m2",),))
    html = environment().from_string('{% from "macros.html.j2" import table %}{{ table(t) }}').render(t=table)
    assert ">EN\N{NO-BREAK SPACE}17037, 5\N{NO-BREAK SPACE}m²</td>" in html, "in tables too"
