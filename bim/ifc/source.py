"""An IFC file opened, meshed, corrected and placed in the world: what every later step reads.

With storeys that are read alone, the next ones above and below are read: they hold the slabs and
rooms that these border on.  Of further storeys what reaches into these is read, by its placement
and the height of its extrusions: facades and shafts that are drawn once for the whole building.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.placement
import numpy as np
from numpy.typing import NDArray

from bim.colours import GREY
from bim.ifc.corrections import Corrections, Paint, corrections_file
from bim.ifc.damage import Damage, placement_of
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
    storey_of,
    storeys_in,
)
from bim.ifc.quantities import QuantityScales
from bim.ifc.shapes import NO_ELEMENTS, Shape, half_of_shapes, read_shapes
from bim.ifc.spaces import check_rooms
from bim.ifc.surface_styles import SurfaceStyle
from bim.ifc.transparent import judged_transparent
from bim.names import listed
from bim.report.issue import Issue, Phrase
from mitsuba_cfs.errors import DataError

Entity = Any  # of ifcopenshell, which has no types
STOREY = 2.0  # levels that lie nearer are half storeys, floor finishes or wall tops [m]
DEEPEST = 20  # operands of operands of a body
# Names of a project in the templates of Revit (English, German, French, Spanish, Chinese, Russian), ArchiCAD, Bonsai
TEMPLATE_NAMES = {
    *("project", "project name", "project number", "0001", "my project", "default project", "projektname"),
    *("projektnummer", "nom du projet", "numéro de projet", "nombre de proyecto", "número de proyecto"),
    *("项目名称", "项目编号", "наименование проекта", "номер проекта", "unnamed", "undefined", "default"),
}


def keep_storeys(
    model: ifcopenshell.file, names: Sequence[str], file: str | PathLike[str], damage: Damage
) -> list[Issue]:
    """Remove the products of other storeys from a model; the issue says how many.

    Args: names: of storeys, whatever their capitals; none: nothing is removed.

    Raises: `DataError` for a name that no storey has.
    """
    if not names:
        return []
    unit = length_scale(model)
    levels = {storey.id(): _level(storey, unit, damage) for storey in storeys_in(model)}
    chosen = _chosen(model, names, file)
    low, high = _range(chosen, levels)
    near = {storey.Name or "" for storey in storeys_in(model) if low <= levels[storey.id()] <= high}
    heights = _Heights(unit, damage)
    left_out: dict[int, bool] = {}

    def is_left_out(product: Entity) -> bool:
        """Whether it is of another storey; openings and what fills them follow their wall.

        An opening of a whole without a body of its own (a roof of slabs) is decided by itself.
        """
        if product.id() not in left_out:
            host = _host(product)
            if host is not None and host.Representation is not None:
                answer = is_left_out(host)
            else:
                storey = storey_of(product)
                answer = storey not in {*near, ""} and product.Representation is not None
                if answer and not product.is_a("IfcSpace"):
                    answer = not heights.within(product, low, high)
            left_out[product.id()] = answer
        return left_out[product.id()]

    products: list[Entity] = list(model.by_type("IfcProduct"))
    removed = [product for product in products if is_left_out(product)]
    spaces = sum(product.is_a("IfcSpace") for product in removed)
    values: dict[str, int | tuple[str | Phrase, ...]] = {
        "storeys": tuple(storey.Name or "" for storey in chosen),
        "near": tuple(sorted(near - {storey.Name or "" for storey in chosen})),
        "elements": sum(product.is_a("IfcElement") for product in removed),
        "spaces": spaces,
    }
    for product in removed:
        model.remove(product)
    return [Issue("storeys-alone", "project", values)]


def _host(product: Entity) -> Entity | None:
    """The wall of an opening, the opening of what fills it."""
    for relations, attribute in (
        ("FillsVoids", "RelatingOpeningElement"),
        ("VoidsElements", "RelatingBuildingElement"),
    ):
        for relation in getattr(product, relations, None) or ():
            if (host := getattr(relation, attribute, None)) is not None:
                return host
    return None


def check_storeys(models: Sequence[ifcopenshell.file], names: Sequence[str], file: str | PathLike[str]) -> None:
    """Raise `DataError` for a name that no storey of the models has."""
    there = [storey for model in models for storey in storeys_in(model)]
    for name in names:
        _named(there, name, file)


def _chosen(model: ifcopenshell.file, names: Sequence[str], file: str | PathLike[str]) -> list[Entity]:
    storeys = storeys_in(model)
    return [storey for name in names for storey in _named(storeys, name, file)]


def _named(storeys: Collection[Entity], name: str, file: str | PathLike[str]) -> list[Entity]:
    key = " ".join(name.split()).casefold()
    of_name = [one for one in storeys if " ".join((one.Name or "").split()).casefold() == key]
    if not of_name:
        there = listed(name, (storey.Name or "" for storey in storeys))
        message = f"no storey {name!r}; there are: {there}"
        raise DataError(message, file=file, field="storey")
    return of_name


def _level(storey: Entity, unit: float, damage: Damage) -> float:
    """Height of a storey's placement [m]; its elevation where it has none."""
    matrix = placement_of(storey, damage)
    return float(matrix[2, 3] if matrix is not None else storey.Elevation or 0.0) * unit


def _range(chosen: Sequence[Entity], levels: dict[int, float]) -> tuple[float, float]:
    """Heights [m] of the lowest and the highest storey that are read with the chosen ones."""
    own = [levels[storey.id()] for storey in chosen]
    low = max((z for z in levels.values() if z <= min(own) - STOREY), default=-np.inf)
    high = min((z for z in levels.values() if z >= max(own) + STOREY), default=np.inf)
    return low, high


class _Heights:
    """Heights of products, each placement computed once."""

    def __init__(self, unit: float, damage: Damage) -> None:
        self._unit, self._damage = unit, damage
        self._placed: dict[int, NDArray[np.float64]] = {}

    def within(self, product: Entity, low: float, high: float) -> bool:
        """Whether a product begins, or an extrusion of it ends, between two heights [m]."""
        placement = product.ObjectPlacement
        if placement is None or not placement.is_a("IfcLocalPlacement"):
            return True
        start = float(self._matrix(placement)[2, 3]) * self._unit
        if start >= high:
            return False
        rise = max(map(_rise, product.Representation.Representations), default=0.0)
        return start + rise * self._unit > low

    def _matrix(self, placement: Entity) -> NDArray[np.float64]:
        if placement.id() not in self._placed:
            own = ifcopenshell.util.placement.get_axis2placement(placement.RelativePlacement)
            beneath = placement.PlacementRelTo
            local = beneath is not None and beneath.is_a("IfcLocalPlacement")
            self._placed[placement.id()] = self._matrix(beneath) @ own if local else own
        return self._placed[placement.id()]


def _rise(representation: Entity) -> float:
    """Greatest height of the extrusions of a representation, in the file's unit."""
    return max((_rise_of(item, DEEPEST) for item in representation.Items or ()), default=0.0)


def _rise_of(item: Entity, depth: int) -> float:
    if item.is_a("IfcExtrudedAreaSolid"):
        place = item.Position
        start = place.Location.Coordinates[2] if place is not None else 0.0
        return float(start + item.Depth)
    if item.is_a("IfcBooleanResult") and depth:
        return _rise_of(item.FirstOperand, depth - 1)
    if item.is_a("IfcMappedItem") and depth:
        return max((_rise_of(one, depth - 1) for one in item.MappingSource.MappedRepresentation.Items), default=0.0)
    return 0.0


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
    damage: Damage = field(default_factory=Damage)  # gathers what cannot be read, as it is asked for

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
        """Name of the project, else of the file; names that templates of authoring programs hold are none."""
        project = self.model.by_type("IfcProject")
        names = (project[0].LongName, project[0].Name) if project else ()
        return next((name for name in names if not _of_template(name)), self.path.stem)

    def quantity_scales(self) -> QuantityScales:
        """Factors from the file's units of length, area and volume to m, m2 and m3."""
        return QuantityScales(
            length_scale(self.model), area_scale(self.model, "AREAUNIT"), area_scale(self.model, "VOLUMEUNIT")
        )


def _of_template(name: str | None) -> bool:
    """Whether a project's name says nothing of the project."""
    plain = " ".join((name or "").replace("/", " ").casefold().split())
    return not plain or plain in TEMPLATE_NAMES


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
    whole = not linked and not storeys and Path(path).suffix.lower() == ".ifc"
    half = half_of_shapes(Path(path)) if whole else None
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
    shapes, faults = read_shapes(model, lambda fraction: tell("geometry", fraction), without=removed, half=half)
    unglazed = corrections.unglazed(model)
    shapes |= {key: opaque(shapes[key]) for key in unglazed if key in shapes}
    shapes, phantoms = judged_transparent(model, shapes, damage)
    issues += more + site + faults + phantoms
    for step_id, paint in corrections.painted(model).items():
        if step_id in shapes:
            shapes[step_id] = painted(shapes[step_id], paint)
    if corrections.file:
        values = {"removed": len(removed), "repainted": len(corrections.painted(model)), "unglazed": len(unglazed)}
        issues.append(Issue("corrections-used", corrections.file, values))
    placed = in_world(shapes, rotation)
    return Source(
        Path(path), model, placed, corrections, latitude, longitude, elevation, tuple([*issues, *placed.issues]), damage
    )


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
        (replace(style, gloss=paint.gloss) if paint.gloss else style) if style.is_glass else replace(style, **values)
        for style in shape.styles
    )
    plain = SurfaceStyle("correction", paint.visible, 0.0, None, paint.solar, paint.gloss)
    index = np.where(shape.style_index < 0, len(styles), shape.style_index)
    return replace(shape, styles=(*styles, plain), style_index=index, is_painted=True)
