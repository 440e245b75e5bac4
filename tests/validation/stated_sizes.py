"""Windows and doors of IFC files: the area that each has here against width by height as stated.

    python -m tests.validation stated_sizes FILES...

IfcWindow and IfcDoor state OverallWidth and OverallHeight; the area here is that of the opening's
outline across the direction that the filling is found to look in, so that one that is taken to lie
flat, or to look along its wall, shows.  Named are those more than a quarter off.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bim.ifc.corrections import Corrections
from bim.ifc.glass_of_rooms import apertures_in
from bim.ifc.source import read_source
from mitsuba_cfs.errors import CfsError
from tests.validation.real_glass import stated_area

LEAST, MOST = 0.75, 1.33  # ratios of found to stated area that agree


def compared(path: Path) -> tuple[int, list[str]]:
    """How many windows and doors state their size, and lines of those that differ."""
    source = read_source(path, Corrections(), lambda stage, part: None)
    count, off = 0, []
    for aperture in apertures_in(source)[0]:
        filling = aperture.filling
        if not filling.ifc_class.startswith(("IfcWindow", "IfcDoor")):
            continue
        stated = stated_area(source.model.by_guid(filling.guid))
        if stated <= 0:
            continue
        count += 1
        if not LEAST < aperture.opening.area / stated < MOST:
            normal = " ".join(f"{part:.2f}" for part in aperture.plane.normal)
            off.append(
                f"{filling.ifc_class} {filling.guid}: {aperture.opening.area:.2f} m2 towards "
                f"({normal}) for {stated:.2f} m2"
            )
    return count, off


def main(files: Sequence[Path]) -> None:
    """Print a line for each file, and below it those that differ."""
    for path in files:
        try:
            count, off = compared(path)
        except CfsError as error:
            print(f"refused: {error}", flush=True)
            continue
        print(f"{path.name}: {count} state their size, {len(off)} differ", flush=True)
        for line in off:
            print(f"  {line}")
