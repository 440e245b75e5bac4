"""Triangles of every product of an IFC file, openings cut, with the look of each triangle."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import ifcopenshell
import ifcopenshell.geom
import numpy as np
from numpy.typing import NDArray

from bim.ifc.surface_styles import SurfaceStyle, surface_style
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Issue

LOG = logging.getLogger(__name__)
# exact polyhedra first, OpenCASCADE for curved bodies: half the time of OpenCASCADE alone on the
# files tried, and one of them (247 walls, 5 MB zipped) was not finished by it in five minutes
KERNEL = "hybrid-cgal-simple-opencascade"
NO_ELEMENTS = ("IfcSpace", "IfcOpeningElement", "IfcOpeningStandardCase")
SKIPPED = (  # classes that neither bound a room nor shade a window: they are not meshed at all
    "IfcAnnotation",
    "IfcGrid",
    "IfcVirtualElement",
    "IfcPort",
    "IfcDistribution",
    "IfcSpatialZone",
    "IfcExternalSpatial",
    "IfcFurnishing",
    "IfcFurniture",
    "IfcSystemFurniture",
    "IfcFlow",
    "IfcEnergyConversion",
    "IfcSanitary",
    "IfcLight",
    "IfcLamp",
    "IfcElectric",
    "IfcOutlet",
    "IfcTransport",
    "IfcAirTerminal",
    "IfcDuct",
    "IfcPipe",
    "IfcDiscreteAccessory",
    "IfcFastener",
    "IfcMechanicalFastener",
    "IfcReinforcing",
)


@dataclass(frozen=True, slots=True)
class Shape:
    """One product's triangles in SI metres and model axes."""

    guid: str
    step_id: int
    ifc_class: str
    name: str
    triangles: NDArray[np.float64]  # [N, 3, 3]
    styles: tuple[SurfaceStyle, ...]
    style_index: NDArray[np.int64]  # [N] index into styles, -1 where the file has no style
    item: NDArray[np.int64]  # [N] STEP id of the representation item of each triangle
    is_painted: bool = False  # whether its reflectances come from the user's corrections
    is_unglazed: bool = False  # whether the user's corrections say that it has no glass

    @property
    def transparent(self) -> NDArray[np.bool_]:
        """Which triangles [N] are seen through."""
        clear = np.array([style.is_glass for style in self.styles] + [False])
        return clear[self.style_index]


def read_shapes(
    model: ifcopenshell.file,
    progress: Callable[[float], None] | None = None,
    *,
    without: Collection[int] = (),
    cut_openings: bool = True,
    skipped: Sequence[str] = SKIPPED,
) -> tuple[dict[int, Shape], list[Issue]]:
    """Shapes by STEP id, in the file's order; products that cannot be meshed are issues.

    Args:
        progress: called with the fraction done, 0 to 1.
        without: STEP ids of products to leave alone.
        cut_openings: whether windows and doors are cut out of their walls.
        skipped: classes that are not meshed.
    """
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("weld-vertices", True)
    # its own colours would make unstyled windows wholly glass and walls white, without a word
    settings.set("apply-default-materials", False)
    settings.set("mesher-linear-deflection", 0.005)
    settings.set("mesher-angular-deflection", 0.35)
    settings.set("disable-opening-subtractions", not cut_openings)
    shapes: dict[int, Shape] = {}
    styles = _Styles(model)
    try:
        wanted = [
            product
            for product in model.by_type("IfcProduct")
            if product.id() not in without and not product.is_a().startswith(tuple(skipped)) and _has_body(product)
        ]
        if not wanted:
            return {}, []
        iterator = ifcopenshell.geom.iterator(
            settings, model, os.cpu_count() or 1, include=wanted, geometry_library=KERNEL
        )
        if iterator.initialize():
            while True:
                shape = _shape(iterator.get(), styles)
                if shape is not None:
                    shapes[shape.step_id] = shape
                if progress is not None:
                    progress(iterator.progress() / 100)
                if not iterator.next():
                    break
    except RuntimeError as error:
        LOG.warning("geometry: %s", error)
    issues = [
        Issue("geometry-not-meshed", p.GlobalId, {"element": f"{p.is_a()} {p.Name or ''}"})
        for p in wanted
        if p.id() not in shapes
    ]
    # the iterator gives shapes as its threads finish them, which no two runs do alike: in that
    # order a model would have another hash in the cache, and other sums, each time it is read
    return {p.id(): shapes[p.id()] for p in wanted if p.id() in shapes}, issues


def _has_body(product: ifcopenshell.entity_instance) -> bool:
    if product.Representation is None:
        return False
    kinds = ("Body", "Facetation", "Body-FallBack", "Tessellation", "SurfaceModel", "Surface")
    return any((r.RepresentationIdentifier or "Body") in kinds for r in product.Representation.Representations or ())


def _shape(element, reader: _Styles) -> Shape | None:
    """Shape of one result of the iterator; None where it has no triangles."""
    geometry = element.geometry
    vertices = np.array(geometry.verts, dtype=float).reshape(-1, 3)
    faces = np.array(geometry.faces, dtype=np.int64).reshape(-1, 3)
    if not len(faces) or not np.isfinite(vertices).all():
        return None
    styles = tuple(reader.read(style) for style in geometry.materials)
    index = np.array(geometry.material_ids, dtype=np.int64)
    if len(index) != len(faces):
        index = np.full(len(faces), -1)
    index = np.where(index < len(styles), index, -1)
    item = np.array(geometry.item_ids, dtype=np.int64)
    item = item if len(item) == len(faces) else np.zeros(len(faces), dtype=np.int64)
    return Shape(element.guid, element.id, element.type, element.name, vertices[faces], styles, index, item)


class _Styles:
    """Reads each surface style once."""

    def __init__(self, model: ifcopenshell.file) -> None:
        self._model = model
        self._known: dict[str, SurfaceStyle] = {}

    def read(self, style) -> SurfaceStyle:
        """A style of the geometry engine."""
        if style.name not in self._known:
            colour = style.diffuse
            values = colour.components if hasattr(colour, "components") else colour
            transparency = style.transparency if np.isfinite(style.transparency) else 0.0
            self._known[style.name] = surface_style(self._model, style.name, tuple(values)[:3], transparency)
        return self._known[style.name]


def mesh_of(shapes: Sequence[Shape]) -> RayMesh:
    """All triangles of the shapes, in their order, ready for rays."""
    return ray_mesh(np.concatenate([s.triangles for s in shapes] or [np.empty((0, 3, 3))]))
