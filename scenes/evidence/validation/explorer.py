"""The explorer's DGP and its time for an hour, in headless Chromium, and the size of its folder.

    python -m scenes.evidence.validation.explorer RESULTS [--screenshot FILE.png]

RESULTS is a folder of `cfs run --explore`.  Judge: this program's rating of its own uncompressed
pictures in the hours that it drew at random when it wrote the folder, against what the page
computes and rates.  Shared: the view's matrices, their pixels and noise, the rule.  Cannot show:
whether the pictures are right, which docs/validation.md shows elsewhere.  Times are of one browser
tab: the hour's codes are on disk, unpacked, made a picture, and rated.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from scenes.evidence.devtools import Page
from scenes.explore.folder import CASE, explorer_of
from scenes.explore.packing import read_data

RATE = """(async () => {{
  const found = cfs.explorer.variants.find((v) => v.entry.file === {file!r});
  const room = await found.room(), out = [];
  await room.rated({state}, 0);
  for (const hour of {hours}) {{
    const r = await room.rated({state}, hour);
    out.push([r.glare.dgp, r.milliseconds, r.glareMilliseconds, r.wholeMilliseconds]);
  }}
  return out;
}})()"""


def main() -> None:
    """Print a line for each room and state."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("--screenshot", type=Path)
    given = parser.parse_args()
    folder = explorer_of(given.results)
    with tempfile.TemporaryDirectory() as place, Page(Path(place)) as page:
        page.open((folder / "index.html").resolve().as_uri())
        for entry in read_data(folder / CASE)["rooms"]:
            facts = read_data(folder / f"{entry['file']}.js")["facts"]
            view = facts["view"]
            print(f"{entry['name']}: {view['width']} x {view['height']} pixels", end=", ")
            print(f"{_megabytes(folder, entry):.1f} MB on disk")
            for state, check in enumerate(facts["checks"]):
                hours = check["hours"]
                found = page.value(RATE.format(file=entry["file"], state=state, hours=hours))
                _line(entry["states"][state], np.array(found), np.array(check["dgp"]))
        if given.screenshot:
            page.screenshot(given.screenshot)
        for fault in page.faults:
            print("fault:", fault)


def _megabytes(folder: Path, entry: dict) -> float:
    """Of all files of a room."""
    stem = Path(entry["file"]).name
    return sum(f.stat().st_size for f in (folder / "data").glob(f"{stem}[_.]*")) / 1e6


def _line(state: str, found: np.ndarray, dgp: np.ndarray) -> None:
    difference = np.abs(found[:, 0] - dgp)
    print(
        f"  {state}: {len(dgp)} hours, DGP {dgp.min():.3f} to {dgp.max():.3f}; differs by "
        f"{difference.max():.5f} at most, {difference.mean():.6f} in the mean"
    )
    for name, column in (("picture", 1), ("glare", 2), ("hour from disk", 3)):
        low, most = np.percentile(found[:, column], (50, 95))
        print(f"    {name}: median {low:.1f} ms, 95 % below {most:.1f} ms")


if __name__ == "__main__":
    main()
