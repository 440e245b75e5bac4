"""What becomes of IFC files: a line of figures for each, from a process of its own."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, fields
from pathlib import Path

from bim.ifc.building import read_ifc
from bim.ifc.project import open_ifc
from bim.model import Building, Space
from bim.shell import open_edges
from bim.soundness import AGREES, agree
from bim.to_energyplus import write_epjson
from bim.to_gltf import write_gltf
from bim.to_radiance import write_radiance
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.files import scratch_folder
from mitsuba_cfs.processes import process_pool


@dataclass(frozen=True, slots=True)
class Surveyed:
    """Figures of one file; quantities agree within 2 %."""

    file: str
    megabytes: float
    schema: str = ""
    rooms: int = 0
    rooms_with_windows: int = 0
    windows: int = 0
    glass: float = 0.0  # [m2]
    open_rooms: int = 0  # with an edge that has no neighbour
    areas: int = 0  # rooms that state a floor area
    areas_between_walls: int = 0  # of them: agree with the floor between the walls
    areas_to_middles: int = 0  # of them: agree with the floor to the middle of the walls
    volumes: int = 0  # rooms that state a volume
    volumes_agreeing: int = 0
    issues: int = 0
    check_s: float = 0.0  # reading and checking
    export_s: float = 0.0  # every room for Radiance, EnergyPlus and glTF
    cpu_s: float = 0.0  # of both, all threads: the same on a busy machine
    memory_mb: float = 0.0  # peak of the process
    spaces: int = 0  # IfcSpace in the file, each room once; 0 where rooms are found from geometry
    glass_used: float = 0.0  # of the glass to the outdoors: with a room [m2]
    glass_out: float = 0.0  # all glass to the outdoors, with or without a room [m2]
    verdict: str = ""  # of the account
    refused: str = ""  # why, where the file cannot be read


def survey(paths: Iterable[str | Path]) -> Iterator[Surveyed]:
    """Figures of each file in turn; every file has its own process, so that memory is its own."""
    for path in map(Path, paths):
        with process_pool(1) as pool:
            try:
                yield pool.submit(_surveyed, path).result()
            except BrokenProcessPool:  # ended by a signal: a native library, or too little memory
                why = "its process was ended: too little memory, or a fault of a library"
                yield Surveyed(path.name, path.stat().st_size / 1e6, refused=f"{path}: {why}")


def _surveyed(path: Path) -> Surveyed:
    megabytes = path.stat().st_size / 1e6
    start, cpu = time.perf_counter(), time.process_time()
    try:
        building = read_ifc(path)
    except CfsError as error:
        return Surveyed(path.name, megabytes, refused=str(error))
    check_s = time.perf_counter() - start
    start = time.perf_counter()
    with scratch_folder() as folder:
        _export(building, folder)
    export_s, cpu_s = time.perf_counter() - start, time.process_time() - cpu
    # ru_maxrss counts kilobytes, on macOS bytes
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak /= 1e6 if sys.platform == "darwin" else 1e3
    spaces = building.spaces
    areas = [s for s in spaces if s.stated_area is not None]
    volumes = [s for s in spaces if s.stated_volume is not None]
    return Surveyed(
        path.name,
        megabytes,
        open_ifc(path).schema,
        len(spaces),
        sum(bool(s.windows) for s in spaces),
        len(building.windows),
        sum(w.area for w in building.windows),
        sum(open_edges(s.shell) > 0 for s in spaces),
        len(areas),
        sum(agree(s.floor_area, s.stated_area) for s in areas),
        sum(s.area_to_middles is not None for s in areas),
        len(volumes),
        sum(agree(s.drawn_volume, s.stated_volume) for s in volumes),
        len(building.issues),
        check_s,
        export_s,
        cpu_s,
        peak,
        building.account.spaces if not building.account.from_geometry else 0,
        building.account.glass_used,
        building.account.glass_out,
        building.account.verdict,
    )


def _export(building: Building, folder: Path) -> None:
    """Write every room in every format."""
    for number, space in enumerate(building.spaces):
        if space.windows and _has_work_plane(space):
            write_radiance(space, building, folder / str(number))
    if building.spaces:
        write_epjson(building, folder / "building.epJSON")
        write_gltf(building, folder / "building.glb")


def _has_work_plane(space: Space) -> bool:
    return float(space.shell[..., 2].max()) > space.floor_level + 1.2


def markdown(rows: Sequence[Surveyed]) -> str:
    """The table of the files, and a line of sums below it."""
    head = (
        "| file | MB | schema | rooms | of spaces | with windows | windows | glass m2 | of all "
        "| verdict | open | area | volume | issues | check s | export s | CPU s | memory MB |"
    )
    lines = [head, "|---" * head.count(" | ") + "|---|"]
    for row in rows:
        name = f"{row.file} | {row.megabytes:.1f}"
        if row.refused:
            lines.append(f"| {name} | refused: {row.refused.split(': ', 1)[-1]} |" + " |" * 15)
            continue
        area = f"{row.areas_between_walls}" + (f" + {row.areas_to_middles} to middles" if row.areas_to_middles else "")
        lines.append(
            f"| {name} | {row.schema} | {row.rooms} | {row.spaces or 'found'} "
            f"| {row.rooms_with_windows} | {row.windows} | {row.glass:.1f} "
            f"| {_share(row.glass_used, row.glass_out)} | {row.verdict} | {row.open_rooms} "
            f"| {_of(area, row.areas)} | {_of(str(row.volumes_agreeing), row.volumes)} "
            f"| {row.issues} | {row.check_s:.1f} | {row.export_s:.1f} | {row.cpu_s:.1f} "
            f"| {row.memory_mb:.0f} |"
        )
    total = {f.name: sum(getattr(r, f.name) for r in rows) for f in fields(Surveyed) if f.type in ("int", "float")}
    lines.append(
        f"\n{len(rows)} files, {sum(bool(r.refused) for r in rows)} refused; {total['rooms']} rooms"
        f" ({total['open_rooms']} with an open edge), {total['windows']} windows with "
        f"{total['glass_used']:.1f} m2 of the {total['glass_out']:.1f} m2 of glass to the "
        f"outdoors. Within {100 * AGREES:.0f} % of the file's own: floor area "
        f"{total['areas_between_walls']} of "
        f"{total['areas']} rooms between the walls and {total['areas_to_middles']} to the middle of"
        f" the walls, volume {total['volumes_agreeing']} of {total['volumes']}."
    )
    return "\n".join(lines)


def _share(part: float, whole: float) -> str:
    return f"{100 * part / whole:.0f} %" if whole > 0 else "-"


def _of(agreeing: str, stating: int) -> str:
    return f"{agreeing} of {stating}" if stating else "-"
