"""Rooms, volume, glass, outdoors, outer walls and north of every IFC file in folders.

    python -m tests.validation buildings [FOLDERS or FILES...]

Without folders: ../shared/data/ifc and ../shared/cases/ifc.  U of the outer walls is weighted by
area, with the surface resistances of EN ISO 6946 (0.13 and 0.04 m2 K/W); north is the direction of
the model's +y axis, in degrees from north to east.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np

from bim.ifc.building import read_ifc
from bim.model import Building
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.processes import process_pool

FOLDERS = ("../shared/data/ifc", "../shared/cases/ifc")
OUTDOORS = ("space-outdoors", "space-external")  # codes of issues
SURFACES = 0.17  # resistances of both surfaces of an outer wall, EN ISO 6946:2017 [m2 K/W]
HEAD = "| file | rooms of spaces | volume m3 | glass m2 of all | outdoors | wall U | north | s | verdict |"


def main(arguments: Sequence[str]) -> int:
    """Print the table of all files, a line as soon as it is known."""
    print(HEAD)
    print("|---" * (HEAD.count("|") - 1) + "|")
    for path in ifc_files(arguments or FOLDERS):
        with process_pool(1) as pool:
            try:
                row = pool.submit(figures, path).result()
            except BrokenProcessPool:
                row = "its process was ended"
        print(f"| {path.stem[:36]} | {row} |", flush=True)
    return 0


def ifc_files(folders: Iterable[str | Path]) -> list[Path]:
    """The IFC files of folders, in order; a file is itself."""
    names = (".ifc", ".ifczip", ".ifcxml")
    paths = [p for f in map(Path, folders) for p in ([f] if f.is_file() else sorted(f.rglob("*")))]
    return [path for path in paths if path.suffix.lower() in names]


def figures(path: Path) -> str:
    """The cells of one file."""
    start = time.perf_counter()
    try:
        building = read_ifc(path)
    except CfsError as error:
        return f"refused: {str(error).split(': ', 1)[-1]}"
    account = building.account
    return " | ".join(
        (
            f"{len(building.spaces)} of {account.spaces}",
            f"{sum(s.volume for s in building.spaces):.1f}",
            f"{account.glass_used:.1f} of {account.glass_out:.1f}",
            f"{sum(issue.code in OUTDOORS for issue in building.issues)}",
            outer_wall(building),
            f"{north(building):.1f}",
            f"{time.perf_counter() - start:.1f}",
            str(account.verdict),
        )
    )


def outer_wall(building: Building) -> str:
    """Thermal transmittance of the outer walls, weighted by area [W/m2 K]."""
    walls = [
        (face.area, 1 / (face.construction.resistance + SURFACES))
        for space in building.spaces
        for face in space.faces
        if face.kind == "wall" and face.adjacency == "outside"
    ]
    return f"{np.average([u for _, u in walls], weights=[a for a, _ in walls]):.2f}" if walls else "-"


def north(building: Building) -> float:
    """Direction of the model's +y axis, from north to east [deg]."""
    if building.from_model is None:
        return 0.0
    east, north = building.from_model[:2, 1]
    return float(np.round(np.degrees(np.arctan2(east, north)), 6)) + 0.0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
