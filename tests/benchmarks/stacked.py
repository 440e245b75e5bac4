"""A big IFC file of real storeys, and what `cfs check` needs for it.

    python -m tests.benchmarks stacked BUILDING.ifc [--megabytes 100] [--write FILE.ifc]
        [--options "--space 'A101 7'"]

The storeys of the building are repeated above it, as they are in the file: elements, openings,
types, property sets, space boundaries and zones with GlobalIds of their own, placed higher by the
building's height.  Project, site, building, materials and surface styles are shared.  The copy's
number is appended to the names of its storeys and spaces.

Prints rooms, seconds (elapsed and of all processors), peak memory of the largest process, and the
stages that the command reported with the time of each.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Annotated

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.unit
import numpy as np

from bim.ifc.shapes import read_shapes

STATEMENT = re.compile(rb"#(\d+)\s*=\s*(\w+)\s*\(((?:'(?:[^']|'')*'|[^';])*)\)\s*;")
REFERENCE = re.compile(rb"'(?:[^']|'')*'|#(\d+)")
TEXT = re.compile(rb"'(?:[^']|'')*'")
SHARED = (
    "IfcProject",
    "IfcSite",
    "IfcBuilding",
    "IfcMaterial",
    "IfcMaterialLayerSet",
    "IfcMaterialDefinitionRepresentation",
    "IfcPresentationStyle",
)
NUMBERED = (b"IFCBUILDINGSTOREY", b"IFCSPACE")
MEGABYTE = 1_000_000


def stacked(path: Path, megabytes: float) -> Iterator[bytes]:
    """The statements of a file of that size: the building's, then those of its copies."""
    model, text = ifcopenshell.open(path), path.read_bytes()
    head, _, tail = text.rpartition(b"ENDSEC;")
    yield head
    shared = {one.id() for kind in SHARED for root in _instances(model, kind) for one in model.traverse(root)}
    shared |= _relations_of(model, shared)
    statements = [
        (int(number), kind.upper(), content)
        for number, kind, content in STATEMENT.findall(head.partition(b"DATA;")[2])
        if int(number) not in shared
    ]
    rooted = {one.id() for one in model.by_type("IfcRoot")}
    raised = _raised(model, shared)
    height = _height(model)
    pitch = model.get_max_id() + 1 + 2 * len(raised)
    size, copy = len(text), 0
    while size < MEGABYTE * megabytes:
        copy += 1
        lines = [
            _copied(statement, copy, pitch, shared, rooted, copy * height)
            for statement in statements
            if statement[0] not in raised
        ]
        for index, (number, (beneath, (x, y, z), axes)) in enumerate(raised.items()):
            first = copy * pitch + pitch - 2 * (index + 1)
            turned = ",".join(f"#{axis if axis in shared else copy * pitch + axis}" if axis else "$" for axis in axes)
            lines += [
                f"#{first}=IFCCARTESIANPOINT(({x!r},{y!r},{z + copy * height!r}));\n".encode(),
                f"#{first + 1}=IFCAXIS2PLACEMENT3D(#{first},{turned});\n".encode(),
                f"#{copy * pitch + number}=IFCLOCALPLACEMENT({beneath},#{first + 1});\n".encode(),
            ]
        block = b"".join(lines)
        size += len(block)
        yield block
    yield b"ENDSEC;" + tail


def _instances(model: ifcopenshell.file, kind: str) -> list[ifcopenshell.entity_instance]:
    try:
        return list(model.by_type(kind))
    except RuntimeError:  # a class that the schema has not
        return []


def _relations_of(model: ifcopenshell.file, shared: Collection[int]) -> set[int]:
    """Relations between shared objects alone."""
    return {
        relation.id()
        for relation in model.by_type("IfcRelationship")
        if all(
            one.id() in shared
            for one in model.traverse(relation, max_levels=1)
            if one.is_a("IfcObject") and one != relation
        )
    }


def _raised(
    model: ifcopenshell.file, shared: Collection[int]
) -> dict[int, tuple[str, tuple[float, ...], tuple[int, int]]]:
    """Placements on which all others rest: what each is relative to, its origin, axes."""
    found = {}
    for one in model.by_type("IfcLocalPlacement"):
        beneath, axes = one.PlacementRelTo, one.RelativePlacement
        if one.id() in shared or not (beneath is None or beneath.id() in shared):
            continue
        turned = tuple(axis.id() if axis else 0 for axis in (axes.Axis, axes.RefDirection))
        place = f"#{beneath.id()}" if beneath else "$"
        found[one.id()] = (place, axes.Location.Coordinates, turned)
    return found


def _height(model: ifcopenshell.file) -> float:
    """Height of the building, in the file's unit."""
    shapes, _ = read_shapes(model, without={site.id() for site in model.by_type("IfcSite")})
    heights = np.concatenate([shape.triangles[..., 2].ravel() for shape in shapes.values()])
    return float(np.ptp(heights)) / float(ifcopenshell.util.unit.calculate_unit_scale(model))


def _copied(
    statement: tuple[int, bytes, bytes],
    copy: int,
    pitch: int,
    shared: Collection[int],
    rooted: Collection[int],
    rise: float,
) -> bytes:
    """A statement of a copy: references, GlobalId, name and elevation are its own."""
    number, kind, content = statement

    def moved(match: re.Match[bytes]) -> bytes:
        if match[1] is None or int(match[1]) in shared:
            return match[0]
        return b"#%d" % (int(match[1]) + copy * pitch)

    content = REFERENCE.sub(moved, content)
    if number in rooted:
        guid, _, rest = content.partition(b",")
        digest = hashlib.md5(guid + b"%d" % copy, usedforsecurity=False).hexdigest()
        owner, _, rest = rest.partition(b",")
        if kind in NUMBERED:
            rest = TEXT.sub(lambda match: match[0][:-1] + b" %d'" % copy, rest, count=1)
        content = b",".join((f"'{ifcopenshell.guid.compress(digest)}'".encode(), owner, rest))
    if kind == b"IFCBUILDINGSTOREY":
        rest, _, elevation = content.rpartition(b",")
        content = rest + (b",$" if elevation.strip() == b"$" else f",{float(elevation) + rise!r}".encode())
    return b"#%d=%s(%s);\n" % (number + copy * pitch, kind, content)


def main(
    building: Path,
    *,
    megabytes: float = 100.0,
    write: Annotated[Path | None, "write the big file here, and no more"] = None,
    options: Annotated[str, "of cfs check, as one text"] = "",
) -> None:
    """Write the file and print what `cfs check` needs for it."""
    if write is not None:
        with write.open("wb") as stream:
            stream.writelines(stacked(building, megabytes))
        return
    with tempfile.TemporaryDirectory() as name:
        big = Path(name) / f"{building.stem}_{megabytes:.0f}MB.ifc"
        with big.open("wb") as stream:
            stream.writelines(stacked(building, megabytes))
        check(big, shlex.split(options))


def check(path: Path, options: list[str]) -> None:
    """Print what `cfs check` needs for a file, and the stages that it reports."""
    started = time.perf_counter()
    command = [sys.executable, "-m", "scenes.cli", "check", str(path), "--no-cache", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    assert process.stdout is not None
    head: list[str] = []
    for line in process.stdout:
        if len(head) < 40:
            head.append(f"{time.perf_counter() - started:7.1f} s  {line.rstrip()}")
    _, status, usage = os.wait4(process.pid, 0)
    print("\n".join(head))
    print(
        f"{path.stat().st_size / MEGABYTE:.0f} MB: {time.perf_counter() - started:.0f} s, "
        f"{usage.ru_utime + usage.ru_stime:.0f} s of processors, {usage.ru_maxrss / 2**20:.2f} GB, "
        f"exit code {os.waitstatus_to_exitcode(status)}"
    )
