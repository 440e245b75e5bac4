"""The buttons that save a figure as SVG or PNG, clicked in headless Chromium, and the files that they give."""

from __future__ import annotations

import base64
import re
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenes.report.page import report_html
from scenes.study_report.page import study_report_html
from tests.devtools import WAIT, Page, chromium
from tests.report.synthetic import run_result
from tests.report.test_study_report import study

pytestmark = [pytest.mark.early, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]
SVG = "{http://www.w3.org/2000/svg}"
FIGURES = "[...document.querySelectorAll('figure:has(.save)')].filter((f) => f.getClientRects().length).slice(0, 20)"


# The browser saves few files that a script asks for: the page's own file is read in place of the saved one
READ = """(() => {
  const object = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
  URL.createObjectURL = (blob) => { window.made = blob; return object.call(URL, blob); };
  HTMLAnchorElement.prototype.click = function () { window.madeName = this.download; };
  window.stopReading = () => { URL.createObjectURL = object; HTMLAnchorElement.prototype.click = click; };
})()"""
BYTES = """new Promise((done) => {
  const reader = new FileReader();
  reader.onload = () => done([window.madeName, reader.result.split(",")[1]]);
  reader.readAsDataURL(window.made);
})"""


def saved(page: Page, folder: Path, figure: int, kind: str) -> Path:
    """The file that a button of the figure of that number gives."""
    page.value("window.made = undefined; window.madeName = undefined")
    page.value(f"{FIGURES}[{figure}].querySelector('.save [data-kind={kind}]').click()")
    page.until("window.made !== undefined && window.madeName !== undefined")
    name, data = page.value(BYTES)
    (folder / name).write_bytes(base64.b64decode(data))
    return folder / name


@pytest.fixture(scope="module", params=["report", "study"])
def opened(request, tmp_path_factory):
    """A page in dark colours with its folder of downloads."""
    folder = tmp_path_factory.mktemp(request.param)
    text = report_html(run_result(picture_size=64)) if request.param == "report" else study_report_html(study())
    (folder / "page.html").write_text(text, encoding="utf-8")
    downloads = folder / "downloads"
    downloads.mkdir()
    with Page(folder, "--force-dark-mode") as page:
        page.open((folder / "page.html").as_uri(), ready="document.readyState === 'complete'")
        assert page.value("getComputedStyle(document.querySelector('.save')).display") == "none"
        page.click("button.figures")
        page.value(READ)
        yield page, downloads
        assert page.faults == []


def test_every_figure_is_saved_as_svg_with_its_title_marks_and_words(opened) -> None:
    page, downloads = opened
    titles = page.value(f"{FIGURES}.map((f) => f.dataset.figure)")
    assert len(titles) > 5
    names = set()
    for number, title in enumerate(titles):
        text = saved(page, downloads, number, "svg").read_text(encoding="utf-8")
        root = ET.fromstring(text)
        assert root.find(f"{SVG}title").text == title
        assert "var(--" not in text and "foreignObject" not in text and "NaN" not in text
        assert not re.search(r'href="(?!data:)', text)
        shown = {element.tag.removeprefix(SVG) for element in root.iter()}
        assert shown & {"path", "image"}, title
        words = "".join(element.text or "" for element in root.iter(f"{SVG}text"))
        wanted = page.value(f"{FIGURES}[{number}].querySelector('figcaption').innerText")
        assert "".join(wanted.removeprefix("SVG").lstrip().removeprefix("PNG").split())[:30] in words.replace(" ", "")
        cells = page.value(f"{FIGURES}[{number}].querySelectorAll('.plot text, svg[role] text').length")
        assert sum(one.get("transform") is not None for one in root.iter(f"{SVG}text")) == cells, title
        # paper is white and words are dark, though the screen is dark
        assert root.find(f"{SVG}rect").get("fill") == "rgb(255, 255, 255)"
        width, height = float(root.get("width")), float(root.get("height"))
        for element in root.iter(f"{SVG}text"):
            if element.get("transform") is None:
                assert -1 < float(element.get("x")) < width + 1 and 0 < float(element.get("y")) < height, element.text
        names.add(title)
    assert page.value("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"


def test_a_png_has_what_the_svg_has(opened, tmp_path) -> None:
    page, downloads = opened
    titles = page.value(f"{FIGURES}.map((f) => f.dataset.figure)")
    for number in range(0, len(titles), 3):
        svg = ET.fromstring(saved(page, downloads, number, "svg").read_text(encoding="utf-8"))
        picture = np.array(Image.open(saved(page, downloads, number, "png")))
        size = [3 * float(svg.get(side)) for side in ("height", "width")]
        assert np.abs(np.array(picture.shape[:2]) - size).max() <= 1
        drawn = picture[::3, ::3, :3].astype(int)
        assert (drawn[0, 0] == 255).all() and len(np.unique(drawn @ [65536, 256, 1])) > 20, titles[number]
        assert 0.5 < (drawn > 200).all(axis=-1).mean() < 0.999 or "image" in ET.tostring(svg, "unicode")


def test_lines_are_where_the_page_has_them(opened) -> None:
    """The path of a chart, in the figure's pixels, spans what the page's own path spans."""
    page, downloads = opened
    number = page.value(f"{FIGURES}.findIndex((f) => f.querySelector('.plot path.mark, .plot path.seen'))")
    at = page.value(
        f"(() => {{ const f = {FIGURES}[{number}], box = f.getBoundingClientRect();"
        "return [...f.querySelectorAll('.plot path.mark, .plot path.seen')].map((path) => {"
        "const b = path.getBoundingClientRect();"
        "return [b.left - box.left + 10, b.right - box.left + 10, b.top - box.top + 10, b.bottom - box.top + 10];"
        "}); })()"
    )
    root = ET.fromstring(saved(page, downloads, number, "svg").read_text(encoding="utf-8"))
    paths = [element for element in root.iter(f"{SVG}path") if element.get("transform") is None]
    spans = []
    for path in paths:
        points = np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", path.get("d")), dtype=float)
        if len(points) > 1:
            spans.append([*np.ptp(points, axis=0), *points.mean(axis=0), points[:, 0].min(), points[:, 1].min()])
    assert at and spans
    for left, right, top, bottom in at:
        # a stroke is at most 3 pixels wide, and belongs to the page's box
        found = [s for s in spans if abs(s[4] - left) < 4 and abs(s[0] - (right - left)) < 7]
        assert any(abs(s[1] - (bottom - top)) < 7 and abs(s[5] - top) < 4 for s in found), (left, right, top, bottom)


def test_a_click_saves_a_file(opened, tmp_path) -> None:
    page, _ = opened
    page.value("window.stopReading()")
    page.send("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.value(f"{FIGURES}[0].id = 'first'")
    page.click("#first .save [data-kind=svg]")
    end = time.monotonic() + WAIT
    while not any(one.suffix == ".svg" and one.stat().st_size for one in tmp_path.iterdir()):
        assert time.monotonic() < end, "nothing was saved"
        page.value("0")
        time.sleep(0.02)
    page.click("button.figures")
    assert page.value("getComputedStyle(document.querySelector('.save')).display") == "none"
