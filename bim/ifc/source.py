"""An IFC file opened, meshed, corrected and placed in the world: what every later step reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

import ifcopenshell
import numpy as np

from bim.colours import GREY
from bim.ifc.corrections import Corrections, Paint, corrections_file
from bim.ifc.damage import Damage
from bim.ifc.linked import one_model
from bim.ifc.north import north_rotation
from bim.ifc.placing import Placed, ground_level, in_world
from bim.ifc.project import (
    area_scale,
    ending_issues,
    guid_issues,
    length_issues,
    length_scale,
    open_all,
    site_location,
)
from bim.ifc.quantities import QuantityScales
from bim.ifc.shapes import NO_ELEMENTS, Shape, read_shapes
from bim.ifc.spaces import check_rooms
from bim.ifc.storeys import check_storeys, keep_storeys
from bim.ifc.surface_styles import SurfaceStyle
from bim.ifc.transparent import judged_transparent
from bim.names import listed
from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Source:
    """A model with its shapes in world axes."""

    path: Path
    model: ifcopenshell.file
    placed: Placed
    corrections: Corrections
    latitude_deg: float | None
    longitude_deg: float | None
    elevation: float
    issues: tuple[Issue, ...]
    damage: Damage = field(
        default_factory=Damage
    )  # gathers what cannot be read, as it is asked for

    @property
    def shapes(self) -> dict[int, Shape]:
        """Shapes by STEP id, in world axes [m]."""
        return self.placed.shapes

    @property
    def elements(self) -> list[Shape]:
        """Building elements and terrain."""
        return [s for s in self.shapes.values() if s.ifc_class not in NO_ELEMENTS]

    @property
    def walls(self) -> list[Shape]:
        """Building elements without terrain and railings: what rooms border on."""
        return [s for s in self.elements if not s.ifc_class.startswith(("IfcSite", "IfcRailing"))]

    @property
    def ground(self) -> float:
        """Height of the ground in the world [m]."""
        return ground_level(self.model, self.placed, self.damage)

    @property
    def name(self) -> str:
        """Name of the project, else of the file."""
        project = self.model.by_type("IfcProject")
        name = (project[0].LongName or project[0].Name or "") if project else ""
        return name or self.path.stem

    def quantity_scales(self) -> QuantityScales:
        """Factors from the file's units of length, area and volume to m, m2 and m3."""
        return QuantityScales(
            length_scale(self.model),
            area_scale(self.model, "AREAUNIT"),
            area_scale(self.model, "VOLUMEUNIT"),
        )


def read_source(
    path: str | PathLike[str],
    corrections: Corrections,
    tell: Progress,
    linked: Sequence[str | PathLike[str]] = (),
    *,
    rooms: Sequence[str] = (),
    storeys: Sequence[str] = (),
) -> Source:
    """The opened model, its shapes meshed, corrected and placed.

    Args:
        linked: files of the same building, whose elements are added.
        rooms, storeys: as of `bim.ifc.building.read_ifc`.
    """
    tell("opening", 0.0)
    files = [path, *linked]
    models, damage = open_all(files), Damage()
    check_rooms([*models.values()], rooms, path, corrections.room_names)
    check_storeys([*models.values()], storeys, path)
    lengths = [issue for one in models.values() for issue in length_issues(one)]
    model, issues = one_model(models)
    issues += keep_storeys(model, storeys, path, damage)
    endings = [issue for file in files for issue in ending_issues(file)]
    names = {"first": Path(path).name}
    endings += [
        Issue("file-corrections-unused", Path(one).name, {"file": Path(one).name, **names})
        for one in linked
        if corrections_file(one).is_file()
    ]
    issues = endings + lengths + guid_issues(model) + issues
    rotation, more = north_rotation(model, corrections.north_deg)
    latitude, longitude, elevation, site = site_location(model)
    check_materials(model, corrections)
    removed = corrections.removed(model)
    shapes, faults = read_shapes(
        model, lambda fraction: tell("geometry", fraction), without=removed
    )
    unglazed = corrections.unglazed(model)
    shapes |= {key: opaque(shapes[key]) for key in unglazed if key in shapes}
    shapes, phantoms = judged_transparent(model, shapes, damage)
    issues += more + site + faults + phantoms
    for step_id, paint in corrections.painted(model).items():
        if step_id in shapes:
            shapes[step_id] = painted(shapes[step_id], paint)
    if corrections.file:
        values = {
            "removed": len(removed),
            "repainted": len(corrections.painted(model)),
            "unglazed": len(unglazed),
        }
        issues.append(Issue("corrections-used", corrections.file, values))
    placed = in_world(shapes, rotation)
    return Source(
        Path(path), model, placed, corrections, latitude, longitude, elevation,
        tuple([*issues, *placed.issues]), damage,
    )  # fmt: skip


def check_materials(model: ifcopenshell.file, corrections: Corrections) -> None:
    """Raise `DataError` where corrections name a material that the file has not."""
    names = [material.Name or "" for material in model.by_type("IfcMaterial")]
    for one in corrections.materials:
        if not any(map(one.matches, names)):
            message = f"no material is named {one.name!r}; there are: {listed(one.name, names)}"
            raise DataError(message, file=corrections.file or None, field="material.name")


def opaque(shape: Shape) -> Shape:
    """The shape without glass."""
    styles = tuple(replace(style, transparency=0.0) for style in shape.styles)
    return replace(shape, styles=styles, is_unglazed=True)


def painted(shape: Shape, paint: Paint) -> Shape:
    """The shape with all that is not glass in one paint; of glass a gloss alone is taken."""
    values = {"reflectance": paint.visible, "solar": paint.solar, "stated": None, "hue": GREY}
    values["gloss"] = paint.gloss
    styles = tuple(
        (replace(style, gloss=paint.gloss) if paint.gloss else style)
        if style.is_glass
        else replace(style, **values)
        for style in shape.styles
    )
    plain = SurfaceStyle("correction", paint.visible, 0.0, None, paint.solar, paint.gloss)
    index = np.where(shape.style_index < 0, len(styles), shape.style_index)
    return replace(shape, styles=(*styles, plain), style_index=index, is_painted=True)
