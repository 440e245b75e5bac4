"""Two files of one house, by two exporters: the area of the rooms' faces and their U-value.

    python -m tests.validation same_house FILE OTHER

What two exporters wrote of one model is one house: faces of a kind that look to the same side have
the same area and the same layers.  Printed are areas and mean U-values (with 0.17 m2 K/W of films)
by kind of face and by what follows, reveals and frames apart.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from bim.building_file import read_building_file
from bim.model import Building
from tests.validation.wall_thickness import APART

FILMS = 0.17  # surface resistances of a wall: EN ISO 6946:2017, table 7 [m2 K/W]
LEAST = 1.0  # sums below this are not printed [m2]


def areas_and_losses(building: Building) -> dict[tuple[str, str], tuple[float, float]]:
    """Area [m2] and area times U-value [W/K] of the rooms' faces, by kind and by what follows."""
    sums: dict[tuple[str, str], tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
    for face in (face for space in building.spaces for face in space.faces):
        made = face.construction
        if face.kind in APART or made is None:
            continue
        resistance = FILMS + sum(layer.thickness / layer.conductivity for layer in made.layers)
        area, loss = sums[face.kind, face.adjacency]
        sums[face.kind, face.adjacency] = area + face.area, loss + face.area / resistance
    return dict(sums)


def main(files: Sequence[Path]) -> None:
    """Print a line for each kind of face."""
    one, other = (areas_and_losses(read_building_file(path)) for path in files)
    print("| face | towards | area [m2] | of the other | U [W/(m2 K)] | of the other |")
    print("|---|---|---|---|---|---|")
    for kind, towards in sorted({*one, *other}):
        pair = [sums.get((kind, towards), (0.0, 0.0)) for sums in (one, other)]
        if max(area for area, _ in pair) < LEAST:
            continue
        areas = " | ".join(f"{area:.1f}" for area, _ in pair)
        means = " | ".join(f"{loss / area:.3f}" if area else "none" for area, loss in pair)
        print(f"| {kind} | {towards} | {areas} | {means} |")
