"""The report opened and used in headless Chromium."""

from __future__ import annotations

import pytest

from scenes.report.page import report_html
from tests.report.browser import chromium, inspect
from tests.report.synthetic import run_result

pytestmark = [pytest.mark.early, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]
WITHOUT_WEBGL = ("--disable-3d-apis",)


@pytest.fixture(scope="module")
def page() -> str:
    return report_html(run_result(picture_size=96))


@pytest.mark.parametrize(
    ("width", "flags"),
    [(1400, ()), (375, ()), (1400, WITHOUT_WEBGL), (1000, ("--force-dark-mode",))],
    ids=["wide", "phone", "without WebGL", "dark"],
)
def test_page_works_in_a_browser(page, tmp_path, width, flags) -> None:
    found = inspect(page, tmp_path, *flags, width=width)
    assert found["faults"] == []
    assert found["scroll"] <= found["width"], "the page scrolls sideways"
    # orientation, two rooms, 3D view; the second room's year of glare, shading state and loads; it is cooled, so
    # that it has no adaptive comfort
    assert len(found["figures"]) == 1 + 2 * (5 + 1 + 5 + 6) + 1 + 3 - 1
    assert [name for name, *_ in found["figures"]].count("Adaptive comfort") == 1
    for name, *sizes in found["figures"]:
        assert sizes, f"{name} shows nothing"
        assert all(w >= 100 and h >= 90 for w, h in sizes), f"{name}: {sizes}"
    assert found["overlaps"] == []
    assert found["clipped"] == []
    assert found["scenes"] == 6, "a control of the 3D view changed nothing"
    assert found["scalesShown"] == [False, True, False, False]
    assert found["ascending"] == sorted(found["ascending"])
    assert found["descending"] == sorted(found["ascending"], reverse=True)
    # day 171 of 2023 counted from 0 is 21 June; half a row below the 13th from above is 12 to 13 h
    assert found["tip"].startswith("21 Jun, 12:00 – 13:00\n")
    assert found["tip"].endswith(" lx")


@pytest.mark.parametrize(
    ("planted", "instead", "key"),
    [
        ('cfsViewer(JSON.parse(document.getElementById("viewer-data")', "x.y(", "faults"),
        (".x-ticks i {", ".x-ticks span { left: 0 !important; } .x-ticks i {", "overlaps"),
        ("max-width: 1180px; margin: 0 auto;", "min-width: 1500px;", "scroll"),
    ],
)
def test_planted_fault_is_seen(page, tmp_path, planted, instead, key) -> None:
    assert planted in page
    found = inspect_or_fault(page.replace(planted, instead), tmp_path)
    assert {
        "faults": lambda: found["faults"],
        "overlaps": lambda: found["overlaps"],
        "scroll": lambda: found["scroll"] > found["width"],
    }[key]()


def inspect_or_fault(page: str, folder) -> dict:
    """The page's report; a page too broken to report counts as a fault."""
    try:
        return inspect(page, folder)
    except AssertionError as error:
        return {"faults": [str(error)]}
