"""The explorer in headless Chromium, used with mouse and keys: slide, play, switch, compare."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenes.explore.folder import write_explorer
from tests.devtools import Page, chromium
from tests.explore.synthetic import explored_run

pytestmark = [pytest.mark.early, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]


@pytest.fixture(scope="module")
def run():
    return explored_run()


@pytest.fixture(scope="module")
def address(run, tmp_path_factory) -> str:
    folder = tmp_path_factory.mktemp("explorer")
    write_explorer(run, folder)
    lit = run.spaces[0].explored.lit
    hour = int(lit[len(lit) // 4])
    day = run.times[hour]
    return f"{(folder / 'index.html').as_uri()}#{day:%m-%d}T{day.hour:02d}"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Page(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def page(address, browser):
    browser.open("about:blank", ready="true")
    browser.open(address)
    yield browser
    assert browser.faults == []
    assert all(r.startswith(("file:", "data:", "about:")) for r in browser.requests)


def _hour(page: Page) -> int:
    return page.value("cfs.explorer.now")


def _picture(page: Page, panel: str = "one", canvas: str = ".eye") -> str:
    return page.value(f"document.querySelector('#{panel} {canvas}').toDataURL()")


def _text(page: Page, selector: str) -> str:
    return page.value(f"document.querySelector('{selector}').textContent")


def _go(page: Page, hour: int) -> None:
    """To an hour of the year, as the sliders' own events would."""
    page.value(
        f"(() => {{ date.value = {hour // 24}; window.hour.value = {hour % 24};"
        "date.dispatchEvent(new Event('input')); })()"
    )
    page.until(f"cfs.explorer.now === {hour}")


def _bright(page: Page, run) -> int:
    """To an hour with the sun before the windows, behind clear glass; the hour."""
    lit = run.spaces[0].explored.lit
    hour = int(next(h for h in lit if run.sun[h, 1] < -0.5 and run.sun[h, 2] > 0.3))
    _go(page, hour)
    page.value("document.querySelector('#one .variant').value = 1")
    page.value("document.querySelector('#one .variant').dispatchEvent(new Event('change'))")
    page.until("document.querySelector('#one .state').textContent === 'clear glass'")
    return hour


def test_the_glare_of_the_page_is_the_programs(page, run) -> None:
    """Every hour that the program rated, in both states: evalglare's rule here and there."""
    for state, year in enumerate(run.spaces[0].explored.pictures):
        found = page.value(
            "(async () => { const room = await cfs.explorer.variants[0].room(), out = [];"
            f"for (const l of {year.check.hours.tolist()}) {{"
            f"const r = await room.rated({state}, l); out.push(r.glare.dgp); }} return out; }})()"
        )
        # the pictures kept are rated alike to rounding; the program's own differ as promised
        assert found == pytest.approx(year.check.compressed_dgp, abs=1e-6)
        assert found == pytest.approx(year.check.dgp, abs=0.002)
    assert np.ptp(found) > 0.02, "all hours are alike: nothing was compared"


def test_luminance_and_illuminance_are_those_written(page, run) -> None:
    explored = run.spaces[0].explored
    for hour in (3, 60, 150):
        values = page.value(
            "(async () => { const room = await cfs.explorer.variants[0].room();"
            f"return [Array.from((await room.rated(0, {hour})).values),"
            f"Array.from(await room.illuminance(1, {hour}))]; }})()"
        )
        assert values[0] == pytest.approx(explored.pictures[0].values(hour), rel=1e-4, abs=1e-2)
        assert values[1] == pytest.approx(explored.illuminance[1][:, hour], rel=2e-3, abs=1e-2)


def test_sliders_move_by_mouse_and_keys(page) -> None:
    before, hour = _picture(page), _hour(page)
    page.drag("#date", 0.2, 0.75)
    page.until("cfs.explorer.now === 24 * date.value + Number(window.hour.value)")
    assert _hour(page) != hour
    moved = _hour(page)
    assert abs(moved // 24 - 0.75 * 364) < 12, "the slider is not where the mouse left it"
    page.press("ArrowRight", 3)
    page.until(f"cfs.explorer.now === {moved + 72}")
    page.value("document.getElementById('hour').focus()")
    page.press("ArrowLeft")
    page.until(f"cfs.explorer.now === {moved + 71}")
    assert _picture(page) != before
    assert "to" in _text(page, "#hour-now")


def test_choices_that_are_overtaken_are_not_computed(page) -> None:
    """A drag sends more events than hours can be computed: each would delay the next frame."""
    page.value(
        "(() => { const { panels } = cfs.explorer, one = panels[0], compute = one.compute; window.computed = [];"
        "one.compute = function (hour) { computed.push(hour); return compute.call(one, hour); };"
        "for (let day = 100; day < 150; day++) { date.value = day; date.dispatchEvent(new Event('input')); } })()"
    )
    page.until("cfs.explorer.now === 149 * 24 + Number(window.hour.value)")
    assert page.value("computed.length") <= 3
    assert page.value("document.getElementById('date-now').textContent") != ""


def test_a_click_on_the_carpet_chooses_its_hour(page) -> None:
    page.click("#carpet", (100 + 0.5) / 365, (24 - 13 - 0.5) / 24)
    page.until(f"cfs.explorer.now === {100 * 24 + 13}")


def test_play_goes_on_and_stops(page) -> None:
    hour = _hour(page)
    page.click("#play")
    page.until(f"cfs.explorer.now > {hour + 1}")
    page.click("#play")
    page.until("!cfs.explorer.playing")
    page.value("new Promise((done) => setTimeout(done, 400))")
    stopped = _hour(page)
    page.value("new Promise((done) => setTimeout(done, 500))")
    assert _hour(page) == stopped


def test_the_state_of_shading_switches(page, run) -> None:
    lit = run.spaces[0].explored.lit
    _go(page, int(lit[len(lit) // 4]))
    open_dgp, before = _text(page, "#one .dgp"), _picture(page)
    page.value("document.querySelector('#one .variant').focus()")
    page.press("ArrowDown", 2)  # as operated, clear glass, blind
    page.until("document.querySelector('#one .state').textContent === 'blind <down>'")
    assert _picture(page) != before
    assert _text(page, "#one .dgp") != open_dgp
    assert "No direct sun is transmitted" in _text(page, "#one .light")


def test_two_side_by_side_and_their_difference(page, run) -> None:
    lit = run.spaces[0].explored.lit
    _go(page, int(lit[len(lit) // 4]))
    page.click("#compare")
    page.until("cfs.explorer.found.length === 2")
    assert _picture(page, "one") != _picture(page, "two")
    dgp = page.value("cfs.explorer.found.map((f) => f.glare.dgp)")
    said = _text(page, "#changes")
    assert f"DGP {'−' if dgp[1] < dgp[0] else '+'}{abs(dgp[1] - dgp[0]):.3f}" in said
    page.press("ArrowRight")  # the box has the focus: nothing moves
    page.value("document.getElementById('date').focus()")
    hour = _hour(page)
    page.press("ArrowRight")
    page.until(f"cfs.explorer.now === {hour + 24}")  # one slider for both
    assert page.value("cfs.explorer.found.length") == 2


def test_looks_change_the_picture(page, run) -> None:
    _bright(page, run)
    seen = {_picture(page)}
    for _ in range(2):
        page.click("#outline")
        page.value("new Promise((done) => setTimeout(done, 200))")
        seen.add(_picture(page))
    assert len(seen) == 2, "outlines come and go"
    page.value("document.getElementById('colours').focus()")
    page.press("ArrowDown")
    page.until("document.getElementById('scale').hidden")
    assert _picture(page) not in seen


def test_true_colour_and_melanopic_map(page, run) -> None:
    hour = _bright(page, run)
    explored = run.spaces[0].explored
    number, window = int(np.flatnonzero(explored.lit == hour)[0]), explored.pictures[0].window
    surface = int(np.setdiff1d(np.arange(len(explored.pictures[0].pixels)), window)[200])
    grey = page.value("document.getElementById('colours').value = 'seen'") and _picture(page)
    for value in ("true", "melanopic"):
        page.value(f"(() => {{ colours.value = '{value}'; colours.dispatchEvent(new Event('change')); }})()")
        page.value("new Promise((done) => setTimeout(done, 300))")
        assert _picture(page) != grey
        if value == "true":
            place = int(explored.pictures[0].pixels[surface])
            y, x = divmod(place, explored.pictures[0].view.width)
            pen = "document.querySelector('#one .eye').getContext('2d')"
            red, green, blue, _ = page.value(f"Array.from({pen}.getImageData({x}, {y}, 1, 1).data)")
            assert red > green > blue
            assert page.value("document.getElementById('scale').offsetParent === null")  # of false colours
    # a surface without sun: 0.5 of its own times 0.8 of the light; a window: 1.2
    found = "cfs.explorer.found[0]"
    ratio = f"(i) => cfs.melanopic({found}, {found}.tints)[i] / {found}.values[i]"
    beam = page.value(f"{found}.ofBeam[{surface}]")
    assert beam == 0
    assert page.value(f"({ratio})({surface})") == pytest.approx(0.4, abs=1e-3)
    assert page.value(f"({ratio})({int(window[0])})") == pytest.approx(1.2, abs=1e-3)
    assert _text(page, "#one .quantity") == "Melanopic EDI of the work plane"
    plane = page.value(f"Array.from({found}.melanopic)")
    assert plane == pytest.approx((0.9 * explored.illuminance[0][:, number]).tolist(), rel=2e-3, abs=0.01)
    assert "lx melanopic EDI at the eye" in _text(page, "#one .figures")
    assert _text(page, "#high-end").endswith("cd/m², melanopic EDL")


def test_patches_of_sun_have_their_true_edges(page, run) -> None:
    """On the floor: what a ray to the sun that leaves by a window reaches, by the triangles."""
    room, hour = run.spaces[0], _bright(page, run)
    page.click("#on-floor")  # the work plane alone is left
    page.value("new Promise((done) => setTimeout(done, 300))")
    points = np.random.default_rng(0).uniform((0.1, 0.1), (4.9, 5.9), (200, 2))
    shown = page.value(
        "(() => { const d = cfs.explorer.panels[0].drawing, { width, height } = d.layer;"
        "const { data } = d.layer.getContext('2d').getImageData(0, 0, width, height);"
        f"return {points.tolist()}.map(([x, y]) => {{ const [u, v] = d.to(x, y).map(Math.floor);"
        "return data[4 * (v * width + u) + 3]; }); })()"
    )
    height = page.value("cfs.explorer.panels[0].drawing.plan.heights.desk")
    reached = np.array([_reached(run, room, (*p, height), run.sun[hour]) for p in points])
    assert 10 < reached.sum() < 190
    wrong = (np.array(shown) > 127) != reached
    assert wrong.sum() <= 4, "more than the pixels that an edge crosses"
    # a closed blind passes next to nothing of the beam: no patch, as the words say
    page.value("cfs.explorer.found[0].room.arrays.through.fill(1e-7) && hour.dispatchEvent(new Event('input'))")
    page.until("document.querySelector('#one .light').textContent.includes('No direct sun')")
    left = "d.layer.getContext('2d').getImageData(0, 0, d.layer.width, d.layer.height).data"
    assert page.value(f"(d => !{left}.some((one, i) => i % 4 === 3 && one > 0))(cfs.explorer.panels[0].drawing)")


def _reached(run, room, point, sun) -> bool:
    """Whether the sun reaches a point through a window, by rays and triangles."""
    windows = np.concatenate([w.triangles for w in room.space.windows])
    opaque = [part.triangles for part in (*room.space.faces, *run.building.elements)]
    return _hit(windows, point, sun) and not _hit(np.concatenate(opaque), point, sun)


def _hit(triangles, point, way) -> bool:
    """Whether a ray meets a triangle (Möller and Trumbore 1997)."""
    a, b, c = triangles.transpose(1, 0, 2)
    p = np.cross(way, c - a)
    det = np.einsum("ij,ij->i", b - a, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.asarray(point) - a
        u = np.einsum("ij,ij->i", t, p) / det
        q = np.cross(t, b - a)
        v, s = q @ way / det, np.einsum("ij,ij->i", c - a, q) / det
    return bool(np.any((np.abs(det) > 1e-12) & (u >= 0) & (v >= 0) & (u + v <= 1) & (s > 1e-6)))


def test_a_phone_scrolls_in_one_direction(address, tmp_path) -> None:
    with Page(tmp_path, width=390, height=800) as page:
        page.open(address)
        assert page.value("document.documentElement.scrollWidth") <= 390
        assert page.faults == []


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_hour_display_glare_and_picture_are_on_one_screen(address, tmp_path, width, height) -> None:
    """Nothing of them is below the first screen, and none covers another."""
    parts = "#date", "#hour", "#play", "#colours", "#one .dgp", "#one .eye"
    with Page(tmp_path, width=width, height=height) as page:
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        page.send("Emulation.setDeviceMetricsOverride", **size)
        page.open(address)
        boxes = [
            page.value(
                f"(({{left, top, right, bottom}}) => [left, top, right, bottom])"
                f"(document.querySelector('{part}').getBoundingClientRect())"
            )
            for part in parts
        ]
    assert all(bottom <= height for *_, bottom in boxes), dict(zip(parts, boxes, strict=True))
    for i, (left, top, right, bottom) in enumerate(boxes):
        for other in boxes[:i]:
            assert left >= other[2] - 1 or other[0] >= right - 1 or top >= other[3] - 1 or other[1] >= bottom - 1


def test_a_missing_file_is_said(address, tmp_path) -> None:
    folder = Path(address.removeprefix("file://").partition("#")[0]).parent
    (tmp_path / "copy").mkdir()
    for one in folder.iterdir():
        if one.is_file() and one.name != "case.js":
            (tmp_path / "copy" / one.name).write_bytes(one.read_bytes())
    with Page(tmp_path) as page:
        page.send("Page.navigate", url=(tmp_path / "copy" / "index.html").as_uri())
        page.until("document.getElementById('fault')?.hidden === false")
        assert "case.js cannot be loaded" in _text(page, "#fault")
