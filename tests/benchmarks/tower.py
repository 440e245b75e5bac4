"""Processor seconds and peak memory of `cfs run --quick` for towers of more and more rooms.

    python -m tests.benchmarks tower [ROOMS ...] [--houses 10] [--of run|check|thermal] [--options "..."]
    python -m tests.benchmarks tower ROOMS --write FILE.ifc

Each storey has nine offices with a window, five to the south and four to the north, and between
them a corridor with a window at each end and a door to each office: ten rooms.  With `--houses` the
rooms are those of so many equal houses on both sides of a street.  The building is
written in IFC4 with the demo's constructions and glazing; the command gets the demo's weather and
blind and a folder and a cache of its own.  `--of check`: `cfs check`, which reads the building
alone; `--of thermal`: `cfs thermal --quick` with all rooms coupled; OPTIONS go to the command.

By room: processor seconds of the command and all that it started, and what each ten rooms more
cost above the tower before.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.geometry
import ifcopenshell.api.project
import ifcopenshell.api.root
import numpy as np

from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.demo.make_office import HEIGHT, Office, project, thickness

SOUTH, NORTH = 5, 4  # offices of a storey
ROOMS = SOUTH + NORTH + 1
OFFICE, DEPTH, CORRIDOR = 3.5, 5.0, 2.0  # width and depth of a south office, of the corridor [m]
OUTER, INNER = thickness("Outer wall"), thickness("Partition")
WIDTH = SOUTH * OFFICE + (SOUTH - 1) * INNER
HALL = DEPTH + INNER  # where the corridor begins, from the south [m]
BACK = HALL + CORRIDOR + INNER  # and the north offices
LENGTH = BACK + DEPTH
STUDY = """weather = "{weather}"
building = "tower.ifc"
couple = true
[[system]]
bsdf = "{blind}"
[trace]
view_factors = false
"""
STREET, GAP = 15.0, 4.0  # between houses across the street, and side by side [m]
SILL, DOOR = 0.9, (0.9, 2.1)  # of windows; width and height of a door [m]


@dataclass(frozen=True, slots=True)
class Used:
    """What a command took."""

    rooms: int
    seconds: float  # of the processor, of all its processes
    elapsed: float  # [s]
    memory: float  # at the peak of its biggest process [GB]


def tower(rooms: int, houses: int = 1) -> ifcopenshell.file:
    """A tower of that many rooms, or houses on a street that have as many together: ten to a storey."""
    storeys, rest = divmod(rooms, ROOMS * houses)
    if rooms <= 0 or rest:
        raise ValueError(f"{houses} houses have a multiple of {ROOMS * houses} rooms, not {rooms}")
    model = ifcopenshell.api.project.create_file(version="IFC4")
    first, body, axis = project(model)
    (building,) = model.by_type("IfcBuilding")
    palette = None
    for house in range(houses):
        origin = ((house // 2) * (WIDTH + 2 * OUTER + GAP), (house % 2) * (LENGTH + 2 * OUTER + STREET))
        for number in range(storeys):
            storey = first
            if house or number:
                name = f"Storey {number}" if houses == 1 else f"House {house + 1}, storey {number}"
                storey = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingStorey", name=name)
                ifcopenshell.api.aggregate.assign_object(model, products=[storey], relating_object=building)
            storey.Elevation = number * (HEIGHT + thickness("Ground floor"))
            place = np.eye(4)
            place[2, 3] = storey.Elevation
            ifcopenshell.api.geometry.edit_object_placement(model, product=storey, matrix=place)
            parts = Office(model, storey, body, axis, palette=palette, origin=origin)
            palette = parts.palette
            _storey(parts, 100 * (house * storeys + number), top=number == storeys - 1)
    return model


def _storey(parts: Office, before: int, *, top: bool) -> None:
    """A storey's slabs, walls, windows, doors and rooms, heights from its floor; names of rooms after a number."""
    outline = ((-OUTER, -OUTER), (WIDTH + OUTER, -OUTER), (WIDTH + OUTER, LENGTH + OUTER), (-OUTER, LENGTH + OUTER))
    parts.slab("Floor", "Ground floor", outline, -thickness("Ground floor"), "Grey floor")
    if top:
        parts.slab("Roof", "Roof", outline, HEIGHT, "White ceiling")
    corners = {
        "South wall": ((WIDTH + OUTER, 0.0), (-OUTER, 0.0)),
        "West wall": ((0.0, 0.0), (0.0, LENGTH)),
        "North wall": ((-OUTER, LENGTH), (WIDTH + OUTER, LENGTH)),
        "East wall": ((WIDTH, LENGTH), (WIDTH, 0.0)),
    }
    for name, (start, end) in corners.items():
        parts.wall(name, "Outer wall", start, end, HEIGHT, "White wall")
    for name, y in (("South corridor", DEPTH), ("North corridor", BACK - INNER)):
        parts.wall(name, "Partition", (0.0, y), (WIDTH, y), HEIGHT, "Light partition")
    _offices(parts, before, "South", SOUTH, (0.0, DEPTH))
    _offices(parts, before + SOUTH, "North", NORTH, (BACK, LENGTH))
    parts.space(f"{before + ROOMS}", "Corridor", (0.0, HALL), (WIDTH, BACK - INNER), HEIGHT)
    low = HALL + 0.5
    parts.window("Window west", "West wall", low, SILL, 1.0, 1.5)
    parts.window("Window east", "East wall", LENGTH - low - 1.0, SILL, 1.0, 1.5)


def _offices(parts: Office, before: int, side: str, count: int, between: tuple[float, float]) -> None:
    """A row of offices, each with a window and a door to the corridor."""
    width = (WIDTH - (count - 1) * INNER) / count
    for k in range(count):
        low, name = k * (width + INNER), f"{before + k + 1}"
        if k:
            run = [(low, y) for y in between]
            parts.wall(f"Partition {name}", "Partition", *run, HEIGHT, "Light partition")
        parts.space(name, "Office", (low, between[0]), (low + width, between[1]), HEIGHT)
        middle, glazed = low + width / 2, width - 1.0
        along = WIDTH + OUTER - middle if side == "South" else middle + OUTER
        parts.window(f"Window {name}", f"{side} wall", along - glazed / 2, SILL, glazed, 1.5)
        parts.door(f"Door {name}", f"{side} corridor", middle - DOOR[0] / 2, *DOOR)


def measured(rooms: int, options: list[str], *, houses: int = 1, of: str = "run") -> Used:
    """What a tower, or a street, costs a command of `cfs`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = folder / "tower.ifc"
        tower(rooms, houses).write(str(path))
        study = folder / "study.toml"
        study.write_text(STUDY.format(weather=WEATHER, blind=VENETIAN_BLIND))
        results = ["--quick", "--out", str(folder / "results")]
        given = {
            "check": ["check", str(path)],
            "thermal": ["thermal", str(study), *results],
            "run": ["run", str(path), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND), *results],
        }
        return _used(rooms, [sys.executable, "-m", "scenes.cli", *given[of], *options], folder)


def _used(rooms: int, command: list[str], folder: Path) -> Used:
    before = os.times()
    with (folder / "said.txt").open("w") as said:
        process = subprocess.Popen(
            command, stdout=said, stderr=said, env={**os.environ, "CFS_CACHE": str(folder / "kept")}
        )
        _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit((folder / "said.txt").read_text()[-2000:])
    seconds = usage.ru_utime + usage.ru_stime
    return Used(rooms, seconds, os.times().elapsed - before.elapsed, usage.ru_maxrss / 2**20)


def main(
    rooms: Sequence[int] = (10, 30, 100, 300),
    *,
    houses: int = 1,
    of: Annotated[str, ("run", "check", "thermal")] = "run",
    write: Annotated[Path | None, "write the first building here, and no more"] = None,
    options: Annotated[str, "of the command, as one text"] = "",
) -> None:
    """Print a line for each building."""
    if write is not None:
        tower(rooms[0], houses).write(str(write))
        return
    print("| rooms | processor s | elapsed s | by room | of each room more | GB |")
    print("|---" * 6 + "|")
    last = None
    for count in rooms:
        used = measured(count, options.split(), houses=houses, of=of)
        more = ""
        if last is not None and count > last.rooms:
            more = f"{(used.seconds - last.seconds) / (count - last.rooms):.2f}"
        print(
            f"| {count} | {used.seconds:.1f} | {used.elapsed:.0f} | {used.seconds / count:.2f} "
            f"| {more} | {used.memory:.2f} |",
            flush=True,
        )
        last = used
