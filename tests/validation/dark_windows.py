"""Windows of IFC files that see hardly anything: by the sum of D, as a share of a free one's.

    python -m tests.validation dark_windows FILES...

D of a window counts the sky and ground that it sees, and what surfaces outdoors reflect of them; of
glass that looks into a wall or a closed void it is about zero, whatever put it there.  Named are
those below a tenth.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bim.ifc.building import read_ifc
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.surfaces import Surfaces, WindowGroup

DIM = 0.1  # share below which a window is named
SAMPLING = Sampling(patch_samples=1024, sensor_samples=16, subdivision=1)


def seen(path: Path) -> Iterator[tuple[str, str, float, float]]:
    """Room, window, its area [m2] and the share that it sees, of every window."""
    building = read_ifc(path)
    weight = KLEMS_FULL.projected_solid_angles() / np.pi
    for space in (space for space in building.spaces if space.windows):
        alone = [WindowGroup(w.name, (w,)) for g in window_groups(space) for w in g.windows]
        scene = DaylightScene(Surfaces.none(), exterior_surfaces(building, space), alone)
        traced = phase_matrices(scene, SAMPLING, five_phase=False, needs=())
        daylight = traced.parts.of_groups(traced.daylight.values)
        for group, one in zip(alone, daylight, strict=True):
            yield space.label, group.name, group.area, float(one.sum(axis=1) @ weight)


def main(files: Sequence[Path]) -> None:
    """Print the dim windows of each file and how many there are of all."""
    variants.activate()
    for path in files:
        try:
            found = list(seen(path))
        except CfsError as error:
            print(f"refused: {error}")
            continue
        dim = [one for one in found if one[-1] < DIM]
        print(f"{path.name}: {len(dim)} of {len(found)} windows see less than {100 * DIM:.0f} %")
        for room, window, area, share in dim:
            print(f"    {share:.3f}  {area:.2f} m2  {window} of room {room}", flush=True)
