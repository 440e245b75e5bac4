"""The explorer's DGP and its time for an hour, in headless Chromium, and the size of its folder.

    python -m tests.validation explorer RESULTS [--load 2] [--screenshot FILE.png]

RESULTS is a folder of `cfs run --explore`.  Judge: this program's rating of its own uncompressed
pictures in the hours that it drew at random when it wrote the folder, against what the page
computes and rates; of the times, the browser's clock.  Shared: the view's matrices, their pixels
and noise, the rule.  Cannot show: whether the pictures are right, which docs/validation.md shows
elsewhere; the time on a screen: the page is drawn without a GPU.  An hour's time is from the
slider's event to all that the page draws of it: its codes read from disk where they are not there
yet, unpacked, made a picture, rated, painted, the plan with its patches of sun.  Frames: the times
between requestAnimationFrame calls while the mouse drags the slider of the date for six seconds,
with `--load` other processes that never rest.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.explore.case_files import CASE, read_data
from scenes.explore.folder import explorer_of
from tests.devtools import Page

WALK = """(async () => {
  const choice = document.querySelector("#one .variant");
  const byId = (id) => document.getElementById(id);
  const told = (e, kind) => e.dispatchEvent(new Event(kind));
  const turn = () => new Promise((on) => setTimeout(on));
  const out = [];
  for (let v = 0; v < choice.options.length; v++) {
    choice.value = v;
    const variant = cfs.explorer.variants[v], room = await variant.room();
    if (variant.state < 0) continue;
    const check = room.facts.checks[variant.state];
    if (!check) continue;
    const times = [], pictures = [], glare = [], dgp = [];
    for (const l of check.hours) {
      const hour = room.arrays.lit[l], start = performance.now();
      byId("date").value = Math.floor(hour / 24);
      byId("hour").value = hour % 24;
      cfs.explorer.now = -1;
      told(byId("date"), "input");
      while (cfs.explorer.now !== hour) await turn();
      times.push(performance.now() - start);
      const found = cfs.explorer.found[0];
      pictures.push(found.milliseconds);
      glare.push(found.glareMilliseconds);
      dgp.push(found.glare.dgp);
    }
    const name = `${variant.entry.name}, ${room.facts.states[variant.state]}`;
    out.push([name, times, pictures, glare, dgp, check.dgp]);
  }
  return out;
})()"""


@dataclass(frozen=True, slots=True)
class WalkedState:
    """The hours of a room in one shading state, as the page shows them."""

    name: str
    milliseconds: NDArray[np.float64]  # [h] from the slider to all that is drawn
    picture: NDArray[np.float64]  # [h] of these for the luminances
    glare: NDArray[np.float64]  # [h] of these for the rating
    dgp: NDArray[np.float64]  # [h] shown
    own: NDArray[np.float64]  # [h] of the program's own pictures

    def __str__(self) -> str:
        off = np.abs(self.dgp - self.own)
        lines = [
            f"  {self.name}: {len(self.dgp)} hours, DGP {self.own.min():.3f} to "
            f"{self.own.max():.3f}; differs by {off.max():.5f} at most, {off.mean():.6f} in the "
            "mean"
        ]
        times = {"a full hour": self.milliseconds, "picture": self.picture, "glare": self.glare}
        for name, found in times.items():
            low, high = np.percentile(found, (50, 95))
            lines.append(f"    {name}: median {low:.0f} ms, 95 % below {high:.0f} ms, most {found.max():.0f} ms")
        return "\n".join(lines)


def walked(page: Page, results: Path) -> tuple[WalkedState, ...]:
    """Every room and state of an explorer, in the hours that the program rated itself.

    Raises: `RuntimeError` where the page has faults.
    """
    page.open((explorer_of(results) / "index.html").resolve().as_uri())
    found = page.value(WALK)
    if page.faults:
        raise RuntimeError(f"the page has faults: {page.faults}")
    return tuple(WalkedState(name, *(np.array(v) for v in values)) for name, *values in found)


FRAMES = """(() => {
  const times = [], shown = new Set();
  const frame = () => {
    times.push(performance.now());
    shown.add(cfs.explorer.now);
    window.asked = requestAnimationFrame(frame);
  };
  frame();
  window.taken = () => { cancelAnimationFrame(window.asked); return [times, shown.size]; };
})()"""
DRAG_S = 6.0


@contextmanager
def loaded(processes: int) -> Iterator[None]:
    """So many other processes that never rest."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def dragged(page: Page) -> str:
    """Frames and hours a second while the mouse drags the date of an open explorer."""
    page.drag("#date", 0.3, 0.7)  # the files of the year's middle are read
    page.until("cfs.explorer.now === 24 * date.value + Number(window.hour.value)")
    (start, height), (end, _) = page.place("#date", 0.25), page.place("#date", 0.75)
    page.mouse("mouseMoved", start, height)
    page.mouse("mousePressed", start, height)
    page.value(FRAMES)
    begun = time.monotonic()
    while (share := (time.monotonic() - begun) / DRAG_S) < 1:
        page.mouse("mouseMoved", start + share * (end - start), height, held=True)
        time.sleep(0.012)
    times, hours = page.value("window.taken()")
    page.mouse("mouseReleased", end, height)
    between = np.diff(times)
    low, high = np.percentile(between, (50, 95))
    return (
        f"dragged: {1000 / between.mean():.0f} frames/s, median {low:.0f} ms, 95 % below {high:.0f} ms, most "
        f"{between.max():.0f} ms; {1000 * hours / between.sum():.0f} hours/s"
    )


def sizes(results: Path) -> list[str]:
    """A line for each room's view: pixels, hours and bytes on disk."""
    folder = explorer_of(results)
    lines = []
    for entry in read_data(folder / CASE)["rooms"]:
        view = read_data(folder / f"{entry['file']}.js")["facts"]["view"]
        stem = Path(entry["file"]).name
        files = [f for f in (folder / "data").glob(f"{stem}[_.]*")]
        total = sum(f.stat().st_size for f in files) / 1e6
        lines.append(
            f"{entry['name']}: {view['width']} x {view['height']} pixels, {len(entry['states'])} "
            f"states, {total:.1f} MB on disk"
        )
    return lines


def main(results: Path, *, load: int = 0, screenshot: Path | None = None) -> None:
    """Print the sizes, the hours of each room and state, and the frames of a drag."""
    print("\n".join(sizes(results)))
    with tempfile.TemporaryDirectory() as place, Page(Path(place)) as page:
        for state in walked(page, results):
            print(state)
        with loaded(load):
            print(dragged(page))
        if screenshot:
            page.screenshot(screenshot)
