"""The explorer's patches of sun, drawn in headless Chromium from triangles of our own."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.devtools import Page, chromium

pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium")

SCRIPT = Path(__file__).parents[2] / "scenes" / "explore" / "templates" / "sunpatch.js"
DRAWN = """(() => {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 200;
  const to = (x, y) => [x * 50, 200 - y * 50], outline = new Path2D();
  outline.rect(0, 0, 200, 200);
  const [blockers, through] = INPUTS, calls = { closed: 0, lines: 0 };
  const close = Path2D.prototype.closePath;
  Path2D.prototype.closePath = function () { calls.closed++; return close.call(this); };
  const line = Path2D.prototype.lineTo;
  Path2D.prototype.lineTo = function (...point) { calls.lines++; return line.call(this, ...point); };
  // a window 1 m wide and high above the floor of a room of 4 m, the sun straight above it
  const triangles = [1, 1, 1, 2, 1, 1, 2, 2, 1, 1, 1, 1, 2, 2, 1, 1, 2, 1];
  const room = { blockers, groups: [{ triangles, through }], outlinePath: () => outline };
  const pen = canvas.getContext("2d");
  pen.fillRect(0, 0, 200, 200); // what an earlier hour left
  cfs.sunPatch(canvas, room, [0, 0, 1], 0, to, "#f00");
  const at = (x, y) => pen.getImageData(...to(x, y), 1, 1).data[3];
  return { lit: at(1.25, 1.75), shaded: at(1.75, 1.25), beside: at(3, 3), closed: calls.closed, lines: calls.lines };
})()"""


def _drawn(tmp_path: Path, blockers: list[float], through: float) -> dict[str, int]:
    page_file = tmp_path / "page.html"
    page_file.write_text(
        f"<!doctype html><body data-ready=yes><script>const cfs = {{}};</script><script>{SCRIPT.read_text()}</script>"
    )
    with Page(tmp_path) as page:
        page.open(page_file.as_uri())
        return page.value(DRAWN.replace("INPUTS", json.dumps([blockers, through])))


def test_sun_reaches_the_floor_but_for_the_shadows_above_it(tmp_path: Path) -> None:
    shelf = [1.5, 1, 0.5, 2, 1, 0.5, 2, 1.5, 0.5, 1.5, 1, 0.5, 2, 1.5, 0.5, 1.5, 1.5, 0.5]
    far = [x + 500.0 for x in shelf]
    drawn = _drawn(tmp_path, shelf + far, 1.0)
    assert drawn == {"lit": 255, "shaded": 0, "beside": 0, "closed": 0, "lines": 6}


def test_the_lines_of_a_path_do_not_grow_with_the_house(tmp_path: Path) -> None:
    """20,000 triangles in one path took a tenth of a second to fill, in which no frame was drawn."""
    shelf = [1.5, 1, 0.5, 2, 1, 0.5, 2, 1.5, 0.5, 1.5, 1, 0.5, 2, 1.5, 0.5, 1.5, 1.5, 0.5]
    assert _drawn(tmp_path, shelf * 1000, 1.0)["lines"] == 6


def test_without_sun_through_the_window_nothing_is_drawn(tmp_path: Path) -> None:
    assert _drawn(tmp_path, [], 0.0) == {"lit": 0, "shaded": 0, "beside": 0, "closed": 0, "lines": 0}
