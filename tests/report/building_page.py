"""Size of the report of many made-up rooms, and how long it takes to be seen in Chromium.

python -m tests.report.building_page 1 6 20 82
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.report.page import report_html
from scenes.results import RunResult
from tests.devtools import Page
from tests.report.synthetic import moved, run_result

ON_A_STOREY = 10


def building(rooms: int, *, picture_size: int = 320, pictures: int = 4) -> RunResult:
    """The two made-up rooms again and again, ten a storey."""
    run = run_result(picture_size=picture_size, pictures=pictures)
    found = []
    for i in range(rooms):
        room, storey = run.spaces[i % 2], i // ON_A_STOREY
        offset = np.array([20.0 * (i % ON_A_STOREY // 2), 0.0, 3.2 * storey])
        space = replace(
            moved(room.space, list(offset)), guid=f"guid-{i}", name=f"{i + 1:03d}", storey=f"Storey {storey}"
        )
        daylight = replace(room.daylight, points=room.daylight.points + offset)
        found.append(replace(room, space=space, daylight=daylight))
    spaces = tuple(room.space for room in found)
    return replace(run, building=replace(run.building, spaces=spaces), spaces=tuple(found))


SEEN = """(() => {
  const [page] = performance.getEntriesByType("navigation");
  const [paint] = performance.getEntriesByName("first-contentful-paint");
  return [paint.startTime, page.domComplete];
})()"""


READY = "performance.getEntriesByName('first-contentful-paint').length && document.readyState === 'complete'"


def seen(file: Path, folder: Path) -> tuple[float, float, float]:
    """First view and all loaded [ms], work of the page's thread [s]: least of three."""
    found = []
    with Page(folder) as page:
        page.send("Performance.enable")
        for _ in range(3):
            page.open("about:blank", ready="true")
            page.open(file.as_uri(), ready=READY)
            metrics = {m["name"]: m["value"] for m in page.send("Performance.getMetrics")["metrics"]}
            found.append((*page.value(SEEN), metrics["TaskDuration"]))
    return tuple(np.min(found, axis=0))


def main(counts: list[int]) -> None:
    """One row of docs/benchmarks.md for each number of rooms."""
    for rooms in counts:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "report.html"
            file.write_text(report_html(building(rooms)), encoding="utf-8")
            first, done, work = seen(file, Path(folder))
            size = file.stat().st_size / 1e6
        print(f"| {rooms} | {size:.1f} MB | {first:.0f} ms | {done:.0f} ms | {work:.1f} s |")


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]])
