"""The page of `cfs check`: leaks in the 3D model, rooms without and with the corrections."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from bim.ifc.building import read_ifc
from scenes.commands.ifc import command
from scenes.report.model3d import checked_model
from tests.bim.small_ifc import DEPTH, HEIGHT, WIDTH, box_model, box_room
from tests.devtools import Page, chromium
from tests.issues import of_code


def page_data(path, out) -> dict:
    result = CliRunner().invoke(command, ["check", str(path), "--html", str(out)])
    assert result.exit_code == 0 and f"page: {out}" in result.output
    found = re.search(r'id="viewer-data">(.*?)</script>', out.read_text("utf-8"), re.DOTALL)
    return json.loads(found[1])


def corners(data: dict, kind: str) -> np.ndarray:
    """Corners [N, 3] of all triangles of a kind, from the model's centre [m]."""
    texts = [batch["t"] for batch in data["batches"] if batch["kind"] == kind]
    packed = [np.frombuffer(base64.b64decode(text), "<i2") for text in texts]
    return np.concatenate([*packed, np.empty(0, "<i2")]).reshape(-1, 3) * data["unit"]


def test_a_leak_is_marked_where_it_is(tmp_path) -> None:
    path = tmp_path / "m.ifc"
    box_room(space=False, window=False, gap=0.3).write(str(path))
    data = page_data(path, tmp_path / "m.html")
    building = read_ifc(path)
    (leak,) = of_code(building, "room-leaks")
    centre = np.array(checked_model(building).centre)
    mark = corners(data, "mark") + centre
    place = [leak.values[axis] for axis in "xyz"]
    assert (mark.min(axis=0) + mark.max(axis=0)) / 2 == pytest.approx(place, abs=0.01)
    assert np.ptp(np.array(data["whole"]), axis=0)[0] > WIDTH  # the house is in view, not the mark
    assert not len(corners(data, "before"))


def test_rooms_without_the_corrections_are_beside_those_with_them(tmp_path, monkeypatch) -> None:
    path, read = tmp_path / "m.ifc", []
    monkeypatch.setattr(
        "bim.ifc.building.read_ifc", lambda *a, **options: read.append(options) or read_ifc(*a, **options)
    )
    box_model(space_height=HEIGHT + 1.0)[0].model.write(str(path))
    assert not len(corners(page_data(path, tmp_path / "plain.html"), "before"))
    path.with_name("m.corrections.toml").write_text("as_drawn = ['IfcSpace']", "utf-8")
    data = page_data(path, tmp_path / "m.html")
    assert len(read) == 2, "without and with the corrections, each once"
    before, after = corners(data, "before"), corners(data, "wall")
    assert np.ptp(before[:, 2]) == pytest.approx(HEIGHT, abs=0.01)  # cut at the roof
    assert np.ptp(after[:, 2]) == pytest.approx(HEIGHT + 1.0, abs=0.01)
    assert np.ptp(before[:, 0]) == pytest.approx(WIDTH, abs=0.01)
    assert np.ptp(before[:, 1]) >= DEPTH - 0.01


@pytest.mark.parametrize("north_deg", [0.0, 40.0])
def test_the_arrow_points_north_whatever_the_axes_of_the_model(tmp_path, north_deg) -> None:
    path = tmp_path / "m.ifc"
    box_model()[0].model.write(str(path))
    path.with_name("m.corrections.toml").write_text(f"north = {north_deg}", "utf-8")
    data = page_data(path, tmp_path / "m.html")
    arrow, walls = corners(data, "north"), corners(data, "wall")
    tip = arrow[arrow[:, 1].argmax()]
    tail = arrow[arrow[:, 1] < arrow[:, 1].max() - 0.1].mean(axis=0)
    assert (tip - tail)[0] == pytest.approx(0.0, abs=0.01) and (tip - tail)[1] > 0.5
    assert arrow[:, 1].max() < walls[:, 1].min()  # outside the house, on the ground
    assert np.ptp(arrow[:, 2]) < 0.01


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_the_page_runs_without_a_fault_and_draws_the_model(tmp_path) -> None:
    box_room().write(str(tmp_path / "m.ifc"))
    page_data(tmp_path / "m.ifc", tmp_path / "m.html")
    with Page(tmp_path) as page:
        page.open((tmp_path / "m.html").as_uri(), ready="document.readyState === 'complete'")
        page.until("document.getElementById('viewer').width > 300")  # a canvas has 300 before it is drawn on
        assert page.faults == []
