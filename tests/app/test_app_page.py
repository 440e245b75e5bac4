"""The page of `cfs app` in headless Chromium: from files to results by mouse and by keyboard."""

from __future__ import annotations

import json
import re
import shutil
import time
from pathlib import Path

import pytest

from scenes.app import actions
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.library import write_library_system
from tests.app.served import serving
from tests.devtools import Page, chromium
from tests.report.test_accessibility import AXE, FAULTS, GRAVE

pytestmark = [pytest.mark.early, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]
GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
STEPS = ("files", "building", "systems", "compute", "results")
DONE_S = 900.0  # for the slow test's commands


def choose(page: Page, selector: str, *files: Path) -> None:
    """Choose files as a file dialog does."""
    root = page.send("DOM.getDocument")["root"]["nodeId"]
    node = page.send("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
    page.send("DOM.setFileInputFiles", nodeId=node, files=[str(file) for file in files])


def go(page: Page, step: str) -> None:
    page.click(f'nav [href="#{step}"]')
    page.until(f"!document.getElementById('{step}').hidden")


def select(page: Page, name: str, value: str) -> None:
    page.value(
        f"(() => {{ const e = document.getElementById({json.dumps(name)});"
        f"e.value = {json.dumps(value)}; e.dispatchEvent(new Event('change')); }})()"
    )


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("app") / "My project") as one:
        yield one


@pytest.fixture(scope="module")
def browser(served, tmp_path_factory):
    with Page(tmp_path_factory.mktemp("browser")) as page:
        page.open(served.address)
        yield page
        assert page.faults == []
        hosts = {address.split("/")[2] for address in page.requests if "//" in address}
        assert hosts <= {f"127.0.0.1:{served.port}"}


def test_dropped_files_are_a_project(browser, served) -> None:
    browser.send("DOM.enable")
    choose(browser, "#drop", OFFICE, WEATHER)
    browser.until("document.querySelectorAll('#file-rows tr').length === 2")
    served.idle()
    browser.until("document.querySelector('nav [href=\"#building\"] .mark.done') !== null")
    study = served.project.study()
    assert study["room"][0]["building"] == "inputs/office.ifc"
    assert study["climate"][0]["weather"].endswith(".epw")
    assert "token" not in browser.value("location.href")


def test_the_building_is_seen_and_a_room_is_chosen_in_the_view(browser, served) -> None:
    go(browser, "building")
    browser.until("document.getElementById('viewer')?.dataset.painted === 'yes'")
    picture = "document.getElementById('viewer').toDataURL()"
    before = browser.value(picture)
    browser.click("#viewer", 0.45, 0.6)
    browser.until("document.querySelector('#room h3') !== null")
    name = browser.value("document.querySelector('#room h3').textContent")
    assert name in ("A South office", "B East office")
    browser.until(f"{picture} !== {json.dumps(before)}")
    assert browser.value("document.querySelector('#room-rows tr.selected').innerText").find(name) > 0
    told = browser.value("document.getElementById('building').innerText")
    assert "m²" in told and re.search(r"\d m[23]\b", told) is None, "the check's lines are for a terminal"


def test_a_fix_by_a_flag_is_told_as_one_of_the_command_line(browser) -> None:
    """The page has no button for it; rooms keep their words whole where the table scrolls."""
    go(browser, "building")
    browser.until("document.querySelector('#room-rows td') !== null")
    told = browser.value(
        "import('/app/building.js').then((module) => ['--join makes one', 'draw it', ''].map(module.remedy))"
    )
    assert told == ["; on the command line: --join makes one", "; draw it", ""]
    assert browser.value("getComputedStyle(document.querySelector('#room-rows td')).overflowWrap") == "break-word"


def test_a_room_is_left_out_and_its_use_stated_by_click(browser, served) -> None:
    go(browser, "building")
    browser.click("#room-rows tr:nth-child(2) input")
    browser.until("document.getElementById('room-count').textContent.startsWith('1 room')")
    guid = browser.value("document.querySelector('#room-rows input').dataset.key").split()[1]
    assert served.project.study()["room"][0]["spaces"] == [guid]
    browser.click("#room-rows tr:nth-child(1) button")
    browser.until("document.querySelector('#room select') !== null")
    browser.value(
        "(() => { const e = document.querySelector('#room select'); e.value = 'meeting';"
        "e.dispatchEvent(new Event('change')); })()"
    )
    browser.until("document.querySelector('#room-rows tr').innerText.includes('meeting')")
    assert served.project.uses() == {guid: "meeting"}


def test_a_system_of_the_library_is_a_variant_with_its_sheet(browser, served) -> None:
    go(browser, "systems")
    select(browser, "glazing", "double low-e")
    select(browser, "shade", "screen 5 %, grey")
    assert "0.12" in browser.value("document.getElementById('library-sheet').innerText")
    browser.click("#moving")
    browser.click("#add-system")
    browser.until("document.querySelectorAll('#chosen .card').length === 1")
    served.idle()
    (system,) = served.project.study()["system"]
    states = served.project.states(system["operation"])
    assert [Path(one).name for one in states] == ["double-low-e.xml", "double-low-e-screen-5-grey.xml"]
    assert browser.value("document.querySelector('#chosen .sheet') !== null")
    told = browser.value("document.querySelector('#chosen .card p').textContent")
    assert told.startswith("Fabric by the model of") and ". Moves between the states of controlled " in told


def test_a_fixed_shade_does_not_move(browser, served) -> None:
    go(browser, "systems")
    moving = "document.getElementById('moving').disabled"
    for shade, fixed in (
        ("perforated sheet, 30 %", True),
        ("fixed louvre 150 mm, 30 deg", True),
        ("screen 5 %, grey", False),
    ):
        select(browser, "shade", shade)
        assert browser.value(moving) is fixed
    wanted = {"glazing": "double low-e", "shade": "perforated sheet, 30 %", "moving": True}
    status, answer = served.page("POST", "/api/library", wanted)
    assert status == 422 and "fixed" in answer["error"]


def test_the_elapsed_time_goes_on_between_news(browser) -> None:
    browser.value(
        "document.body.insertAdjacentHTML('beforeend', `<i id=clock data-since=${Date.now() / 1000 - 57}></i>`); 0"
    )
    browser.until("document.getElementById('clock').textContent === '59 s'")
    browser.until("document.getElementById('clock').textContent === '1 min 1 s'")
    browser.value("document.getElementById('clock').remove()")


def test_the_commands_are_shown_before_they_run(browser, served) -> None:
    go(browser, "compute")
    browser.click("#compute input[data-key='rule en17037']")
    browser.until("document.querySelectorAll('#plan code').length === 2")
    run, comply = browser.value("[...document.querySelectorAll('#plan code')].map((e) => e.textContent)")
    assert run.startswith("cfs run inputs/office.ifc --weather ") and "--operation" in run
    assert "--quick" in run and "--out results/report-" in run
    assert comply.startswith("cfs comply ") and "--standard en17037" in comply
    asked = "document.getElementById('conditioned').value"
    assert browser.value(asked) == "heated" and browser.value("document.getElementById('heating_c').value") == "20"
    select(browser, "conditioned", "free")
    browser.until("document.getElementById('set-points').hidden")
    assert served.project.operation() == {}
    select(browser, "conditioned", "heated")
    browser.until("document.getElementById('heating_c').value === '20'")
    assert served.project.operation()["loads"] == {"heating_c": 20.0, "cooling_c": 26.0}


def test_a_fault_is_said_and_the_page_goes_on(browser, served) -> None:
    go(browser, "files")
    bad = served.project.folder.parent / "house.ifc"
    bad.write_text("no IFC")
    choose(browser, "#drop", bad)
    browser.until("document.querySelector('#notices .notice') !== null")
    assert "house.ifc" in browser.value("document.getElementById('notices').innerText")
    browser.click("#notices button")
    browser.until("document.querySelector('#notices .notice') === null")
    browser.faults[:] = [one for one in browser.faults if "422" not in one]


def test_the_steps_are_walked_by_keyboard(browser) -> None:
    go(browser, "files")
    browser.value("document.querySelector('nav a').focus()")
    for step in STEPS[1:]:
        browser.press("Tab")
        browser.press("Enter")
        browser.until(f"!document.getElementById('{step}').hidden")
        assert browser.value("document.activeElement.closest('section')?.id") == step
        browser.value(f"document.querySelector('nav [href=\"#{step}\"]').focus()")


@pytest.mark.parametrize("width", [1440, 390])
def test_nothing_is_wider_than_the_window(browser, width) -> None:
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.send("Emulation.setDeviceMetricsOverride", **size)
    for step in STEPS:
        browser.value(f"location.hash = '#{step}'")
        browser.until(f"!document.getElementById('{step}').hidden")
        assert browser.value("document.documentElement.scrollWidth") <= width, step
        link = f"document.querySelector('nav [href=\"#{step}\"]').getBoundingClientRect()"
        assert browser.value(f"{link}.right") < width + 1, "the step that is shown is not in view"
    browser.value("location.hash = '#building'")
    browser.until("!document.getElementById('building').hidden")
    rows = "[...document.querySelectorAll('#room-rows tr')].map((row) => row.getBoundingClientRect().height)"
    assert max(browser.value(rows)) < (70 if width > 620 else 150), "a row of rooms is as tall as a column of words"
    cells = "[...document.querySelectorAll('#{} td, #{} button')].map((e) => e.getBoundingClientRect().right)"
    for step, table in (("building", "room-rows"), ("files", "file-rows")):
        browser.value(f"location.hash = '#{step}'")
        browser.until(f"!document.getElementById('{step}').hidden")
        assert 0 < max(browser.value(cells.format(table, table))) <= width, table


@pytest.mark.skipif(not AXE.is_file(), reason="no axe-core")
@pytest.mark.parametrize("flags", [(), ("--force-dark-mode",)], ids=["light", "dark"])
def test_no_step_has_a_serious_fault(served, tmp_path, flags) -> None:
    with Page(tmp_path, *flags) as page:
        page.open(served.address)
        page.send("Page.setBypassCSP", enabled=True)
        found = {}
        page.value(AXE.read_text(encoding="utf-8") + "; 0")
        for step in STEPS:
            page.value(f"location.hash = '#{step}'")
            page.until(f"!document.getElementById('{step}').hidden")
            found[step] = [fault for fault in page.value(FAULTS) if fault[0] in GRAVE]
    assert not {step: some for step, some in found.items() if some}


def test_the_page_is_german_where_it_is_asked_to_be(tmp_path) -> None:
    with serving(tmp_path / "projekt", language="de") as served, Page(tmp_path) as page:
        page.open(served.address)
        assert page.value("document.documentElement.lang") == "de"
        text = page.value("document.body.innerText")
        assert "Dateien" in text and "Choose" not in text and "Next" not in text


def test_doubts_have_reasons_and_rooms_are_joined_by_click(tmp_path) -> None:
    """A far weather station and an unknown north are said where they are chosen; open rooms become one, then two."""
    with serving(tmp_path / "project") as served, Page(tmp_path) as page:
        for file in (OFFICE, WEATHER):
            served.upload(Path(file))
        served.idle()
        path = served.project.folder / "results" / "check.json"
        record = json.loads(path.read_text("utf-8"))
        rooms = record["rooms"]
        names, guids = [room["label"] for room in rooms[:2]], [room["guid"] for room in rooms[:2]]
        record["site"] = {"latitude_deg": 51.5, "longitude_deg": 0.0}
        record["issues"] = [
            {
                "code": "true-north-missing",
                "severity": "assumption",
                "what": "No north",
                "effect": "",
                "fix": "",
                "count": 1,
                "glass_m2": 0,
                "where": "",
            }
        ]
        record["open_rooms"] = [{"rooms": names, "guids": guids, "area_m2": 14.9, "join": " + ".join(guids)}]
        trifle = {
            "level": "minor",
            "code": "glass-lost",
            "severity": "loss",
            "glass_m2": 0.01,
            "what": "A pane",
            "effect": "is lost",
        }
        rooms[0] |= {"doubt": "minor", "doubts": [trifle], "volume_m3": 47.4, "drawn_volume_m3": 76.5}
        path.write_text(json.dumps(record), "utf-8")
        page.open(served.address)
        assert "km from the building's site" in page.value("document.getElementById('needed').innerText")
        go(page, "building")
        place = page.value("document.getElementById('place').innerText")
        assert "the arrow is an assumption" in place and "km from the building's site" in place
        assert "left out" not in page.value("document.querySelector('#room-rows tr').innerText")
        page.click("#room-rows tr:nth-child(1) button")
        page.until("document.querySelector('#room h3') !== null")
        panel = page.value("document.getElementById('room').innerText")
        assert (
            "47.4 m³ (as drawn: 76.5 m³)" in panel
            and "A pane: is lost (0.01 m² of glass)" in panel
            and "14.9 m²" in panel
        )
        page.click("#room [data-key^='join ']")
        page.until("!document.getElementById('joined-box').hidden")
        assert served.project.study()["room"][0]["join"] == [" + ".join(guids)]
        served.idle()
        last = served.project.journal()[-1]
        assert last["kind"] == "check" and " + ".join(guids) in last["command"]
        page.until("!document.querySelector('#joined button').disabled")
        page.click("#joined button")
        page.until("document.getElementById('joined-box').hidden")
        assert "join" not in served.project.study()["room"][0]


def test_a_command_that_was_resumed_is_not_resumed_again(tmp_path) -> None:
    with serving(tmp_path / "project") as served, Page(tmp_path) as page:
        served.jobs.add([actions.Action("export", "bad", ("export", "none.ifc", "--gltf", "none.glb"), "results/none")])
        served.idle()
        page.open(served.address)
        go(page, "compute")
        page.until("document.querySelectorAll('#jobs [data-key^=\"again \"]').length === 1")
        page.click("#jobs [data-key^='again ']")
        page.until("document.querySelectorAll('#jobs > li').length === 2")
        served.idle()
        page.until("document.querySelector('#jobs [data-key=\"again 2\"]') !== null")
        assert page.value("document.querySelector('#jobs [data-key=\"again 1\"]')") is None


def test_windows_without_glazing_data_are_named_before_a_command_refuses_them(tmp_path) -> None:
    """A building whose file has no glazing data needs a system: the page says so, with one it computes."""
    bare = tmp_path / "bare.ifc"
    bare.write_text(OFFICE.read_text("utf-8").replace("VisibleLightTransmittance", "Reference"), "utf-8")
    ready = "document.querySelectorAll('#plan code').length === 1"
    with serving(tmp_path / "project") as served, Page(tmp_path) as page:
        write_library_system("double clear", "", served.project.folder / "inputs" / "double-clear.xml")
        page.send("DOM.enable")
        page.open(served.address)
        choose(page, "#drop", bare, WEATHER)
        go(page, "compute")
        page.until(
            f"{ready} && document.getElementById('plan-fault').textContent.startsWith('2 windows of the chosen')"
        )
        assert page.value("document.getElementById('start').disabled")
        assert page.value("document.querySelector('nav [href=\"#systems\"] .mark').className") == "mark doubt"
        go(page, "systems")
        assert page.value("document.getElementById('no-systems').textContent").startswith("2 windows of the chosen")
        add_system(page, "double clear")
        go(page, "compute")
        page.until(f"{ready} && document.getElementById('plan-fault').textContent === ''")
        assert not page.value("document.getElementById('start').disabled")


def add_system(page: Page, glazing: str) -> None:
    """Choose a glazing of the library as a variant."""
    select(page, "glazing", glazing)
    page.click("#add-system")
    page.until("document.querySelectorAll('#chosen .card').length === 1")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", "SampleHouse4_Revit_IFC4.ifc"], ids=["office", "house"])
def test_from_drop_to_dossier_without_a_shell(tmp_path, request, name) -> None:
    """Files, a variant, a report and a dossier, and both pages opened by their links.

    The house has doubtful rooms, and no glazing data: it needs a system.
    """
    file = request.getfixturevalue("real_data") / "ifc" / "buildings" / name if name else OFFICE
    with serving(tmp_path / "project") as served, Page(tmp_path) as page:
        page.send("DOM.enable")
        page.open(served.address)
        choose(page, "#drop", file, WEATHER)
        page.until("document.querySelectorAll('#file-rows tr').length === 2")
        served.idle()
        page.until("document.querySelector('nav [href=\"#building\"] .mark:not(.todo)') !== null")
        if name:
            go(page, "systems")
            page.until("document.getElementById('no-systems').className === 'fault'")
            add_system(page, "double clear")
        go(page, "compute")
        page.click("#compute input[data-key='rule en17037']")
        page.until("document.querySelectorAll('#plan code').length === 2")
        page.click("#start")
        end, first = time.monotonic() + DONE_S * (3 if name else 1), len(served.jobs.facts())
        page.until("!document.getElementById('jobs-box').hidden")
        while (jobs := served.jobs.facts())[-1]["kind"] != "comply" or served.jobs.busy:
            assert time.monotonic() < end, jobs
            time.sleep(0.5)
        assert {job["state"] for job in jobs} == {"done"} and len(jobs) >= first, jobs
        go(page, "results")
        page.until("document.querySelectorAll('#folders a').length >= 2")
        links = page.value("[...document.querySelectorAll('#folders a')].map((e) => e.href)")
        for page_name in ("report.html", "dossier.html"):
            (link,) = [one for one in links if one.endswith(page_name)]
            page.open(link, ready="document.readyState === 'complete'")
            assert page.value("document.querySelector('#verdict, h1') !== null")
        page.faults[:] = [one for one in page.faults if "sandboxed" not in one]
        assert page.faults == []


def test_a_variant_is_made_once(tmp_path) -> None:
    """A system of the library that is there already is taken as it is."""
    with serving(tmp_path / "project") as served:
        write_library_system("double clear", "", served.project.folder / "inputs" / "double-clear.xml")
        assert served.page("POST", "/api/library", {"glazing": "double clear"})[0] == 200
        assert not served.jobs.facts()
        assert served.project.study()["system"][0]["bsdf"] == "inputs/double-clear.xml"
        assert served.page("POST", "/api/library", {"glazing": "none"})[0] == 422


def test_results_of_older_inputs_and_a_damaged_file_are_told(tmp_path) -> None:
    """A damaged file of results is named; the rest of the page works, and says what is out of date."""
    results = tmp_path / "project" / "results"
    for name, file in (("report-glazing", "report.html"), ("comparison", "report.html")):
        (results / name).mkdir(parents=True)
        (results / name / file).write_text("<p class='answer'>Meets it.</p>", encoding="utf-8")
    (results / "check.json").write_text("{", encoding="utf-8")
    (results / "comparison" / "study.json").write_text('{"quick": true}', encoding="utf-8")
    rows = "space,system,sda300_50,glare_intolerable_h,error\nA,glazing,81.5,212,\nA,blind,63.0,12,\n"
    (results / "comparison" / "results.csv").write_text(rows, encoding="utf-8")
    with serving(tmp_path / "project") as served:
        for file in (OFFICE, WEATHER, GLAZING):
            shutil.copyfile(file, served.project.folder / "inputs" / ".upload")
            served.project.take(served.project.folder / "inputs" / ".upload", Path(file).name)
        for one in actions.computations(served.project, {"report": True}):
            line = {"command": ["cfs", *one.command], "kind": one.kind, "started": 1e9, "state": "done"}
            served.project.record(line)
        with Page(tmp_path) as page:
            page.open(served.address)
            assert "check.json" in page.value("document.getElementById('notices').innerText")
            go(page, "results")
            cards = page.value("[...document.querySelectorAll('#folders .card')].map((e) => e.innerText)")
            (report,) = [text for text in cards if "report-glazing" in text]
            assert "preview" in report  # its command had --quick
            (comparison,) = [text for text in cards if "results/comparison" in text]
            assert "preview" in comparison  # its study file has it
            assert "out of date" in report and "office.ifc" in report and "Meets it." in report
            best = page.value("[...document.querySelectorAll('#variants .best')].map((e) => e.innerText)")
            assert best == ["82", "12"]
            page.screenshot(tmp_path / "results.png")
