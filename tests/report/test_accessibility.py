"""axe-core on every page: no serious fault, light and dark; the explorer with two side by side.

axe.min.js is that of axe-playwright-python (.ci/set-up installs it), or AXE_CORE names it.
"""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

from bim.shoebox import shoebox
from scenes.comply.comply import check_rooms
from scenes.comply.options import ComplyOptions
from scenes.comply.outputs import dossier_html
from scenes.demo import WEATHER
from scenes.explore.folder import write_explorer
from scenes.page_options import PageOptions
from scenes.report.page import report_html
from scenes.study_report.page import study_report_html
from tests.comply.test_outputs import RULE, files_of
from tests.devtools import Page, chromium
from tests.explore.synthetic import explored_run
from tests.report.building_page import building
from tests.report.other_pages import write_check_page, write_design_page, write_each_page, write_fit_page
from tests.report.synthetic import run_result
from tests.report.test_glare_page import write_glare_page
from tests.report.test_study_explorer import with_explored
from tests.report.test_study_report import study

PACKAGE = find_spec("axe_playwright_python")
BUNDLED = Path(PACKAGE.origin).with_name("axe.min.js") if PACKAGE and PACKAGE.origin else "none"
AXE = Path(os.environ.get("AXE_CORE", BUNDLED))
pytestmark = [
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
    pytest.mark.skipif(not AXE.is_file(), reason="no axe-core"),
]
GRAVE = {"serious", "critical"}
# What is not drawn yet has no colours to be judged
DRAWN = """(() => { const style = document.createElement("style");
  style.textContent = "section { content-visibility: visible !important; }";
  document.head.append(style); })()"""
FAULTS = """axe.run().then((found) => found.violations.map((fault) =>
  [fault.impact, fault.id, fault.nodes.map((node) => node.html.slice(0, 200))]))"""


def dossier(folder: Path) -> str:
    """The dossier of a room, by the view and the sun alone."""
    rule = folder / "rays.toml"
    rule.write_text(RULE, encoding="utf-8")
    options = ComplyOptions(None, WEATHER, standards=(str(rule),))
    return dossier_html(check_rooms(shoebox(name="Office"), options, files_of(options)))


@pytest.fixture(scope="module")
def pages(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    texts = {
        "report": report_html(run_result(picture_size=96)),
        "german": report_html(run_result(picture_size=96), PageOptions(language="de")),
        "building": report_html(building(12, picture_size=48, pictures=1)),
        "study": study_report_html(study()),
        "explored": study_report_html(with_explored(2, 3)),
        "dossier": dossier(folder),
    }
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    write_explorer(explored_run(), folder / "explorer")
    write_glare_page(folder / "glare.html")
    files = {name: folder / f"{name}.html" for name in (*texts, "glare")}
    files |= {"check": write_check_page(folder), "fit": write_fit_page(folder), "design": write_design_page(folder)}
    files["each"] = write_each_page(folder)
    return files | {"explorer": folder / "explorer" / "index.html"}


def faults(page: Page, file: Path) -> list:
    """What axe-core finds on a page."""
    page.open(file.as_uri(), ready="document.readyState === 'complete'")
    if file.parent.name == "explorer":
        page.until("document.body.dataset.ready === 'yes'")
        page.click("#compare")
        page.until("cfs.explorer.found.length === 2")
    page.value(DRAWN)
    page.value(AXE.read_text(encoding="utf-8") + "; 0")
    return page.value(FAULTS)


@pytest.mark.parametrize(
    "flags", [(), ("--force-dark-mode",), ("--window-size=390,844",)], ids=["light", "dark", "phone"]
)
def test_no_page_has_a_serious_fault(pages, tmp_path, flags) -> None:
    width = 390 if "390" in "".join(flags) else 1400
    with Page(tmp_path, *flags, width=width) as page:
        found = {name: faults(page, file) for name, file in pages.items() if width > 390 or name != "building"}
    grave = {name: [f for f in some if f[0] in GRAVE] for name, some in found.items()}
    assert not {name: some for name, some in grave.items() if some}


@pytest.mark.parametrize("width", [1440, 390])
def test_no_script_has_a_fault_and_nothing_is_wider_than_the_window(pages, tmp_path, width) -> None:
    with Page(tmp_path, width=width) as page:
        for name, file in pages.items():
            page.open(file.as_uri(), ready="document.readyState === 'complete'")
            page.until("new Promise((on) => setTimeout(() => on(true), 300))")  # scripts that begin late
            missing = [fault for fault in page.faults if "ERR_FILE_NOT_FOUND" in fault]  # pictures of the glare page
            assert page.faults == (missing if name == "glare" else []), name
            page.faults.clear()
            assert page.value("document.documentElement.scrollWidth") <= width, name
            offered = page.value("document.querySelector('button.figures')?.hidden === false")
            assert not offered or page.value("document.querySelector('.save') !== null"), name


def test_pages_without_rays_have_no_fault_at_all(pages, tmp_path) -> None:
    """Not even a moderate one: a skip link without its target, two landmarks of one name."""
    with Page(tmp_path) as page:
        found = {name: faults(page, pages[name]) for name in ("check", "fit", "design", "each", "glare", "explorer")}
    assert not {name: some for name, some in found.items() if some}


def test_a_planted_fault_is_seen(pages, tmp_path) -> None:
    text = pages["report"].read_text(encoding="utf-8")
    file = tmp_path / "planted.html"
    file.write_text(text.replace("<main", '<button></button><p style="color:#ccc">faint words</p><main', 1))
    with Page(tmp_path) as page:
        found = {fault[1] for fault in faults(page, file) if fault[0] in GRAVE}
    assert {"button-name", "color-contrast"} <= found
