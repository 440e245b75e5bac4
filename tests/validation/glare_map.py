r"""Glare maps against the DGP of pictures: the same views, hour by hour and by the hours above limits.

    python -m tests.validation glare_map [--system venetian_blind.xml] [--views 4] [--size 200] [--every 7]
    python -m tests.validation glare_map --by command --out FOLDER [--system venetian_blind.xml]

The demo's south office with one state all year.  Views are spread over the order of the map, from the
worst on.  By function: every seventh hour of use, DGP of each.  By command: `cfs run --annual-glare`,
whose glare_map.csv has the map, and `cfs dgp` of the same views.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from bim.ifc.building import read_ifc
from mitsuba_cfs import variants
from mitsuba_cfs.glare.classes import LIMITS, hour_not_exceeded
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import with_view
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.fenestration.systems import read_system
from scenes.room.glare import glare_map
from scenes.room.light import room_light
from scenes.room.options import RoomOptions
from scenes.room.room import inputs_of_room

DEMO = Path(WEATHER).parent
ROOM = "South office"


def by_function(system: str, views: int, size: int, every: int) -> list[str]:
    """Rows of the table: views of the map, some hours of use by the map and by pictures."""
    variants.activate()
    building = read_ifc(DEMO / "office.ifc")
    space = next(one for one in building.spaces if ROOM in one.label)
    systems = {window.guid: (read_system(DEMO / system),) for window in space.windows}
    room = inputs_of_room(building, space, systems, read_epw(WEATHER), RoomOptions.of(picture_size=size))
    light = room_light(room)
    state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    plan, of_map = glare_map(room, light, state)
    used = np.flatnonzero(room.occupied)
    lit = np.flatnonzero(np.isin(used, room.skies.lit))[::every]
    rows = []
    for e, n in spread(plan.worst(plan.not_exceeded.size), views):
        view = fisheye(plan.eyes[e], plan.directions[n], size)
        hours = np.searchsorted(room.skies.lit, used[lit])
        pictures, by_map = hourly_glare(with_view(light.light, view), "DGP", hours=hours).dgp, of_map[e, n, lit]
        off = by_map - pictures
        reached = [f"{hour_not_exceeded(one):.3f}" for one in (pictures, by_map)]
        above = [f"{np.sum(pictures > limit)}, {np.sum(by_map > limit)}" for limit in LIMITS]
        words = f"{plan.eyes[e, 0]:.1f}, {plan.eyes[e, 1]:.1f}, {direction_deg(plan.directions[n]):.0f}"
        errors = f"{np.sqrt(np.mean(off**2)):.4f} | {off.mean():+.4f} | {off.min():+.3f} to {off.max():+.3f}"
        rows.append(f"| {words} | {', '.join(reached)} | {' | '.join(above)} | {errors} |")
        print(rows[-1], flush=True)
    return rows


def spread(order: list, count: int) -> list:
    """Items evenly spread over an order, the first included and the last fifth left out."""
    return [order[i] for i in np.linspace(0, 0.8 * len(order), count).astype(int)]


def direction_deg(direction: np.ndarray) -> float:
    """Angle from north by east."""
    return float(np.degrees(np.arctan2(direction[0], direction[1])) % 360)


def by_command(system: str, views: int, size: int, out: Path) -> list[str]:
    """Rows of the table: hours of use above each limit by `glare_map.csv` and by `cfs dgp`."""
    common = [str(DEMO / "office.ifc"), "--weather", str(WEATHER), "--cfs", str(DEMO / system), "--space", ROOM]
    _cfs("run", *common, "--annual-glare", "--size", "32", "--no-colour", "--out", str(out / "run"))
    table = pd.read_csv(out / "run" / "glare_map.csv")
    columns = [f"hours_above_{limit:.2f}" for limit in LIMITS]
    order = table.sort_values(["dgp_exceeded_in_5_percent", columns[-1]], ascending=False)
    chosen = order.iloc[spread(list(range(len(order))), views)]
    given = []
    for row in chosen.itertuples():
        angle = np.radians(row.direction_deg)
        eye = f"{row.x} {row.y} {row.z}"
        given += ["--view", f"-vta -vp {eye} -vd {np.sin(angle):.6f} {np.cos(angle):.6f} 0 -vh 180 -vv 180"]
    _cfs("dgp", *common, *given, "--size", str(size), "--worst", "0", "--out", str(out / "dgp"))
    pictures = pd.read_csv(out / "dgp" / "views.csv")
    rows = []
    for (_, one), (_, other) in zip(chosen.iterrows(), pictures.iterrows(), strict=True):
        hours = other["hours_of_use"] * np.array([other[f"share_above_{limit:.2f}"] for limit in LIMITS])
        above = [f"{a:.0f}, {one[name]:.0f}" for a, name in zip(hours, columns, strict=True)]
        reached = f"{other['dgp_exceeded_in_5_percent']:.3f}, {one['dgp_exceeded_in_5_percent']:.3f}"
        rows.append(f"| {one.x:.1f}, {one.y:.1f}, {one.direction_deg:.0f} | {reached} | {' | '.join(above)} |")
    return rows


def _cfs(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "scenes.cli", *arguments], check=True)


def main(
    *,
    system: Annotated[str, "of scenes/demo"] = "glazing.xml",
    views: int = 4,
    size: Annotated[int, "[px]"] = 200,
    every: Annotated[int, "hour of use, by function"] = 7,
    by: Annotated[str, ("function", "command")] = "function",
    out: Annotated[Path | None, "new folder, by command"] = None,
) -> str:
    """Print the rows of the table."""
    if by == "command":
        if out is None:
            raise SystemExit("--by command: expected --out FOLDER")
        return "\n".join(by_command(system, views, size, out))
    by_function(system, views, size, every)
    return ""
