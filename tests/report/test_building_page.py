"""The report of many rooms: drawn where it is looked at, printed whole, walked by few tab stops."""

from __future__ import annotations

import base64
import json
import re
import zlib

import pytest

from scenes.report.page import report_html
from tests.devtools import Page, chromium
from tests.report.building_page import building

pytestmark = [pytest.mark.early, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]
ROOMS = 12
DRAWN = """[...document.querySelectorAll("section.room")]
  .filter((s) => s.checkVisibility() && s.querySelector(".cards")
    .checkVisibility({contentVisibilityAuto: true})).map((s) => s.id)"""


@pytest.fixture(scope="module")
def text() -> str:
    return report_html(building(ROOMS, picture_size=48, pictures=1))


@pytest.fixture(scope="module")
def browser(text, tmp_path_factory):
    folder = tmp_path_factory.mktemp("building")
    (folder / "report.html").write_text(text, encoding="utf-8")
    with Page(folder) as page:
        page.open((folder / "report.html").as_uri(), ready="document.readyState === 'complete'")
        page.value("document.documentElement.style.scrollBehavior = 'auto'")
        yield page
        assert page.faults == []


def test_numbers_under_the_pointer_are_packed(text) -> None:
    found = re.search(r'class="carpet-data">([^<]+)</script>', text)
    carpet = json.loads(zlib.decompress(base64.b64decode(found[1]), wbits=-15))
    assert len(carpet["values"]) == carpet["rows"] * carpet["days"] == 8760


def test_rooms_are_drawn_where_they_are_looked_at(browser) -> None:
    browser.value("scrollTo(0, 0)")
    browser.until(f"({DRAWN}).length < {ROOMS}")
    assert f"room-{ROOMS}" not in browser.value(DRAWN)
    browser.value(f"document.querySelector('a[href=\"#room-{ROOMS}\"]').click()")
    browser.until(f"({DRAWN}).includes('room-{ROOMS}')")
    assert "room-3" not in browser.value(DRAWN)


def test_a_storey_is_chosen_and_what_is_above_lifted(browser) -> None:
    choose = (
        "(() => {{ const e = document.getElementById('viewer-{0}'); {1};e.dispatchEvent(new Event('change')); }})()"
    )
    picture = (
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() =>"
        "done(document.getElementById('viewer').toDataURL()))))"
    )
    browser.place("#viewer")
    pictures = [browser.value(picture)]
    assert browser.value("document.getElementById('viewer-lift').disabled")
    browser.value(choose.format("storey", "e.value = '0'"))
    pictures.append(browser.value(picture))
    browser.click("#viewer-lift")
    pictures.append(browser.value(picture))
    browser.value(choose.format("storey", "e.value = '-1'"))
    pictures.append(browser.value(picture))
    assert len(set(pictures[:3])) == 3 and pictures[3] == pictures[0]


def test_few_tab_stops(browser) -> None:
    """Before rooms had one stop for the headings of a table these twelve had 805."""
    stops = browser.value(
        "[...document.querySelectorAll('a[href], button, select, input, summary, [tabindex]')]"
        ".filter((e) => e.tabIndex >= 0 && !e.disabled && !e.closest('[hidden]')).length"
    )
    assert stops < 320


def test_a_heading_is_reached_by_arrow_keys_and_sorts(browser) -> None:
    browser.value("document.querySelector('[data-table=\"All rooms\"] th').focus()")
    browser.press("ArrowRight", 2)
    browser.press("Enter")
    sorted_by = "document.querySelector('[data-table=\"All rooms\"] th[aria-sort]').cellIndex"
    assert browser.value(sorted_by) == 2


def test_a_print_has_every_room(browser) -> None:
    """Every room begins a page of the PDF, and its pictures are in it."""
    browser.value("scrollTo(0, 0)")
    pdf = base64.b64decode(browser.send("Page.printToPDF")["data"])
    pages = len(re.findall(rb"/Type\s*/Page\b", pdf))
    images = len(re.findall(rb"/Subtype\s*/Image", pdf))
    assert pages > 2 * ROOMS
    assert images >= browser.value("document.images.length")


def test_the_verdict_of_many_rooms_is_one_printed_page(browser) -> None:
    """Head and verdict end above the foot of an A4 page with margins of 13 mm."""
    width, height = 184 / 25.4 * 96, 271 / 25.4 * 96
    size = {"width": round(width), "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    browser.send("Emulation.setEmulatedMedia", media="print")
    browser.send("Emulation.setDeviceMetricsOverride", **size)
    browser.value("scrollTo(0, 0)")
    shown, folded = browser.value(
        "[...document.querySelectorAll('#verdict .table-box')].map((e) => e.checkVisibility())"
    )
    below = browser.value("document.querySelector('#verdict').getBoundingClientRect().bottom")
    assert shown and not folded
    assert 300 < below < height
