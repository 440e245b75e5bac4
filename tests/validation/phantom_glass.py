"""Glass of IFC files counted by ifcopenshell alone, against the glass that the rooms here have.

    python -m tests.validation phantom_glass FILES... [--misses]

The count knows nothing of `bim` but the areas of the windows that it judges.  Real glass of an
element is the outline of its own transparent triangles across their main direction; of a window
without any, all of it less the lining that it states, or 0.7 of it ("assumed").  Doors, plates and
members without transparent triangles have none, nor have members narrower than 0.2 m, the bars of
a frame; walls, slabs, roofs, coverings and proxies have some only where a material or a style
names glass or a clear plastic; virtual elements have none.

Phantom glass: what rooms here have beyond that, all that faces down, and what lies twice in one
place.  Glass before a space: real glass of windows, doors and plates, drawn twice or once, with an
IfcSpace of the file on one side and none on the other by 100 points of each, whatever became of
that space here.  Left: real glass of such elements that no room here has, between rooms or before
none; of it told: what a problem of the building is about, by the GUID of the element or of what it
is part of.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import ifcopenshell
import ifcopenshell.util.element as element_of
import numpy as np
import shapely

from bim.ifc.building import read_ifc
from bim.ifc.project import open_ifc
from bim.model import Window
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.processes import process_pool
from tests.validation.real_glass import Pane, real_glass

EXACT = 0.01  # areas that agree so are the same
DOWN = -0.5  # z of the outward normal of glass that faces down
NEAR = 0.3  # two panes nearer than this, one over the other, are one window [m]
ROUGH = 0.03  # error of a share by so many points


@dataclass(frozen=True, slots=True)
class Counted:
    """Areas [m2] of one file."""

    file: str
    used: float = 0.0  # in rooms here
    drawn: float = 0.0  # of it: real, and drawn
    assumed: float = 0.0  # of it: of windows whose glass is not drawn
    empty: float = 0.0  # of it: in openings that the file leaves empty
    beyond: float = 0.0  # of it: more than the element has, or of an element without glass
    down: float = 0.0  # of it: facing down
    twice: float = 0.0  # of it: over other glass
    before: float = 0.0  # real glass before an IfcSpace
    before_used: float = 0.0  # of it: in rooms here
    left: float = 0.0  # real glass that no room here has
    told: float = 0.0  # of it: with a problem of its own
    misses: tuple[str, ...] = ()
    refused: str = ""

    @property
    def phantom(self) -> float:
        """All that is none [m2]."""
        return self.beyond + self.down + self.twice


def counted(path: Path) -> Counted:
    """The glass of the rooms of a file, judged."""
    try:
        building = read_ifc(path)
        model = open_ifc(path)
    except CfsError as error:
        return Counted(path.name, refused=str(error).split(": ", 1)[-1])
    windows = [w for space in building.spaces for w in space.windows]
    ours: dict[str, float] = defaultdict(float)
    down, misses = 0.0, []
    for window in windows:
        if window.normal[2] < DOWN:
            down += window.area
            misses.append(f"{_said(model, window.guid)}: {window.area:.2f} face down")
        else:
            ours[window.guid] += window.area
    real = real_glass(model, set(ours))
    parts: dict[str, float] = defaultdict(float)
    for guid, area in ours.items():
        pane = real.get(guid, Pane(0.0, "none"))
        parts[pane.kind] += min(area, pane.area)
        more = area - pane.area if area > (1 + EXACT) * pane.area else 0.0
        parts["beyond"] += more
        misses += [f"{_said(model, guid)}: {area:.2f}, real {pane.area:.2f}"] if more > 0 else []
    lost = {g: p.area * p.inside - ours.get(g, 0.0) for g, p in real.items()}
    lost = {g: a for g, a in lost.items() if a > ROUGH * real[g].area}
    misses += [f"{_said(model, guid)}: {area:.2f} not used" for guid, area in lost.items()]
    before = sum(pane.area * pane.inside for pane in real.values())
    left = {guid: pane.area - ours.get(guid, 0.0) for guid, pane in real.items()}
    left = {guid: area for guid, area in left.items() if area > ROUGH * real[guid].area}
    named = {issue.where for issue in building.issues}
    silent = {g: a for g, a in left.items() if named.isdisjoint(_with_wholes(model, g))}
    misses += [f"{_said(model, g)}: {area:.2f} left in silence" for g, area in silent.items()]
    left_area = sum(left.values())
    return Counted(
        path.name,
        sum(ours.values()) + down,
        parts["drawn"],
        parts["assumed"],
        parts["empty"],
        parts["beyond"],
        down,
        twice(windows),
        before,
        before - sum(lost.values()),
        left_area,
        left_area - sum(silent.values()),
        tuple(misses),
    )


def _with_wholes(model: ifcopenshell.file, guid: str) -> set[str]:
    """GUIDs of an element and of all that it is a part of."""
    found, element = {guid}, model.by_guid(guid)
    while (whole := element_of.get_aggregate(element)) is not None:
        found.add(whole.GlobalId)
        element = whole
    return found


def twice(windows: Sequence[Window]) -> float:
    """Glass [m2] that lies over other glass that is as good as parallel to it."""
    area = 0.0
    for i, one in enumerate(windows):
        reach = np.ptp(one.triangles.reshape(-1, 3), axis=0).max()
        for other in windows[i + 1 :]:
            if abs(one.normal @ other.normal) < 0.99:
                continue
            apart = other.centre - one.centre
            if abs(apart @ one.normal) > NEAR or np.linalg.norm(apart) > 10 * reach:
                continue
            area += _overlap(one, other)
    return area


def _overlap(one: Window, other: Window) -> float:
    aside = np.eye(3)[np.argmin(np.abs(one.normal))]
    u = np.cross(aside, one.normal) / np.linalg.norm(np.cross(aside, one.normal))
    axes = np.stack([u, np.cross(one.normal, u)])
    flat = [shapely.union_all(shapely.polygons(w.triangles @ axes.T)) for w in (one, other)]
    shared = flat[0].intersection(flat[1]).area
    return float(shared) if shared > EXACT * min(one.area, other.area) else 0.0


def _said(model, guid: str) -> str:
    try:
        element = model.by_guid(guid)
    except RuntimeError:
        return guid
    return f"{element.is_a()} {element.Name or ''} {guid}"


def table(rows: Sequence[Counted]) -> str:
    """Markdown table of the files and their sum."""
    head = (
        "| file | glass m2 | drawn | assumed | in empty openings | phantom "
        "| before a space | of it used | left | of it told |"
    )
    lines = [head, "|---" * 10 + "|"]
    for r in rows:
        if r.refused:
            lines.append(f"| {r.file} | refused: {r.refused} | | | | | | | | |")
            continue
        share, told = _share(r.before_used, r.before), _share(r.told, r.left)
        lines.append(
            f"| {r.file} | {r.used:.1f} | {r.drawn:.1f} | {r.assumed:.1f} | {r.empty:.1f} "
            f"| {r.phantom:.2f} | {r.before:.1f} | {share} | {r.left:.1f} | {told} |"
        )
    sums = [
        sum(getattr(r, name) for r in rows)
        for name in ("used", "drawn", "assumed", "empty", "phantom", "before", "before_used", "left", "told")
    ]
    lines.append(
        f"| all | {sums[0]:.1f} | {sums[1]:.1f} | {sums[2]:.1f} | {sums[3]:.1f} | {sums[4]:.2f} "
        f"| {sums[5]:.1f} | {_share(sums[6], sums[5])} "
        f"| {sums[7]:.1f} | {_share(sums[8], sums[7])} |"
    )
    return "\n".join(lines)


def _share(part: float, whole: float) -> str:
    return f"{100 * part / whole:.1f} %" if whole > EXACT else "-"


def main(files: Sequence[Path], *, misses: Annotated[bool, "name the elements that differ"] = False) -> None:
    """Print the table, and with `--misses` the elements that miss."""
    rows = []
    for path in files:
        with process_pool(1) as pool:
            try:
                rows.append(pool.submit(counted, path).result())
            except BrokenProcessPool:
                rows.append(Counted(path.name, refused="its process was ended"))
        if misses:
            print(
                rows[-1].file,
                f"phantom {rows[-1].phantom:.2f} (down {rows[-1].down:.2f}, twice {rows[-1].twice:.2f})",
                *rows[-1].misses,
                sep="\n  ",
                flush=True,
            )
    print(table(rows))
