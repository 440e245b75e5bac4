"""How long an hour of an explorer takes in Chromium, and how far its DGP is from the program's.

    python -m scenes.evidence.explored_hours RESULTS

The hours are those drawn at random in which the program rated its own pictures: 100 of a year.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.evidence.devtools import Page
from scenes.explore.folder import explorer_of

WALK = """(async () => {
  const choice = document.querySelector("#one .variant");
  const byId = (id) => document.getElementById(id);
  const told = (e, kind) => e.dispatchEvent(new Event(kind));
  const turn = () => new Promise((on) => setTimeout(on));
  const out = [];
  for (let v = 0; v < choice.options.length; v++) {
    choice.value = v;
    told(choice, "change");
    const variant = cfs.explorer.variants[v], room = await variant.room();
    if (typeof variant.state !== "number") continue;
    const check = room.facts.checks[variant.state];
    if (!check) continue;
    const times = [], dgp = [];
    for (const l of check.hours) {
      const hour = room.arrays.lit[l], start = performance.now();
      byId("date").value = Math.floor(hour / 24);
      byId("hour").value = hour % 24;
      cfs.explorer.now = -1;
      told(byId("date"), "input");
      while (cfs.explorer.now !== hour) await turn();
      times.push(performance.now() - start);
      dgp.push(cfs.explorer.found[0].glare.dgp);
    }
    out.push([choice.options[v].textContent, times, dgp, check.dgp]);
  }
  return out;
})()"""


@dataclass(frozen=True, slots=True)
class WalkedState:
    """The hours of a room in one shading state, as the page shows them."""

    name: str
    milliseconds: NDArray[np.float64]  # [h] from the slider to the picture
    dgp: NDArray[np.float64]  # [h] shown
    own: NDArray[np.float64]  # [h] of the program's own pictures

    def __str__(self) -> str:
        off = np.abs(self.dgp - self.own)
        return (
            f"{self.name}: {len(self.dgp)} hours, an hour {np.median(self.milliseconds):.0f} ms in "
            f"the median, {np.max(self.milliseconds):.0f} ms at most; DGP off by {off.mean():.5f} "
            f"in the mean, {off.max():.5f} at most"
        )


def walked(results: Path) -> tuple[WalkedState, ...]:
    """Every room and state of an explorer, in the hours that the program rated itself."""
    with tempfile.TemporaryDirectory() as folder, Page(Path(folder)) as page:
        page.open((explorer_of(results) / "index.html").resolve().as_uri())
        found = page.value(WALK)
        if page.faults:
            raise RuntimeError(f"the page has faults: {page.faults}")
    return tuple(WalkedState(name, *(np.array(v) for v in values)) for name, *values in found)


if __name__ == "__main__":
    for state in walked(Path(sys.argv[1])):
        print(state)
