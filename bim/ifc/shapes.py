"""Triangles of every product of an IFC file, openings cut, with the look of each triangle."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import numpy as np
from numpy.typing import NDArray

from bim.ifc.surface_styles import SurfaceStyle, surface_style
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Issue
from mitsuba_cfs.processes import ProcessEnded, Told, beside

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
SMALL = 400_000  # files of fewer bytes are meshed sooner than another process begins
LIMIT_S = 3600.0  # for the half of a model in another process
# what meshing costs beside a plain body: an opening that is cut out, a body of several operands
OPENING, OPERANDS = 12, 100
Half = Future[tuple[frozenset[int], dict[int, "Shape"]]]  # STEP ids that were tried, and their shapes


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
    half: Half | None = None,
) -> tuple[dict[int, Shape], list[Issue]]:
    """Shapes by STEP id, in the file's order; products that cannot be meshed are issues.

    Args:
        progress: called with the fraction done, 0 to 1.
        without: STEP ids of products to leave alone.
        cut_openings: whether windows and doors are cut out of their walls.
        skipped: classes that are not meshed.
        half: of the same file, from `half_of_shapes`.
    """
    drawn = _with_bodies(model, skipped)
    wanted = [product for product in drawn if product.id() not in without]
    here = wanted if half is None else [product for product in _halves(drawn)[0] if product.id() not in without]
    shapes = _meshed(model, here, progress, cut_openings)
    if half is not None:
        tried, others = _result(half)
        shapes |= others
        done = {product.id() for product in here} | tried
        shapes |= _meshed(model, [product for product in wanted if product.id() not in done], None, cut_openings)
    issues = [
        Issue("geometry-not-meshed", p.GlobalId, {"element": f"{p.is_a()} {p.Name or ''}"})
        for p in wanted
        if p.id() not in shapes
    ]
    # the iterator gives shapes as its threads finish them, in an order that changes from run to run: in
    # that order a model would have another hash in the cache, and other sums, each time it is read
    return {p.id(): shapes[p.id()] for p in wanted if p.id() in shapes}, issues


def half_of_shapes(path: Path) -> Half | None:
    """Begin to mesh half of an IFC file's products in another process; None where that is not faster.

    The engine's own threads are of no use on two cores: a further one gives them their work and
    never sleeps (AC11: 8.4 processor seconds with two threads, 4.4 with one).
    """
    if os.cpu_count() != 2 or not path.is_file() or path.stat().st_size < SMALL:
        return None
    return beside(_half, path, limit_s=LIMIT_S)


def _half(path: Path, tell: Told) -> tuple[frozenset[int], dict[int, Shape]]:
    """In the other process: STEP ids of the second half, and their shapes."""
    from bim.ifc.project import open_ifc

    model = open_ifc(path)
    products = _halves(_with_bodies(model, SKIPPED))[1]
    return frozenset(product.id() for product in products), _meshed(model, products, None, True)


def _result(half: Half) -> tuple[frozenset[int], dict[int, Shape]]:
    """The shapes of the other process; none where it ended."""
    try:
        return half.result()
    except ProcessEnded as error:
        LOG.info("geometry in another process: %s", error)
        return frozenset(), {}


def _with_bodies(model: ifcopenshell.file, skipped: Sequence[str]) -> list[ifcopenshell.entity_instance]:
    classes = tuple(skipped)
    return [one for one in model.by_type("IfcProduct") if not one.is_a().startswith(classes) and _has_body(one)]


def _halves(products: Sequence[ifcopenshell.entity_instance]) -> tuple[list[ifcopenshell.entity_instance], ...]:
    """Products in two parts of about the same work; those of one drawing stay together."""
    drawings: dict[int, list[ifcopenshell.entity_instance]] = {}
    for product in products:
        drawings.setdefault(_drawing(product), []).append(product)
    work = {key: sum(map(_work, same)) for key, same in drawings.items()}
    halves: tuple[list[ifcopenshell.entity_instance], ...] = ([], [])
    sums = [0, 0]
    for key in sorted(drawings, key=lambda key: -work[key]):
        less = sums.index(min(sums))
        halves[less].extend(drawings[key])
        sums[less] += work[key]
    return halves


def _drawing(product: ifcopenshell.entity_instance) -> int:
    """STEP id of the drawing that products share, else of the product."""
    items = product.Representation.Representations[-1].Items or ()
    return int(items[0].MappingSource.id() if items and items[0].is_a("IfcMappedItem") else product.id())


def _work(product: ifcopenshell.entity_instance) -> int:
    bodies = (item for one in product.Representation.Representations for item in one.Items or ())
    several = any(item.is_a("IfcBooleanResult") for item in bodies)
    return 1 + OPENING * len(getattr(product, "HasOpenings", None) or ()) + OPERANDS * several


def _meshed(
    model: ifcopenshell.file,
    products: Sequence[ifcopenshell.entity_instance],
    progress: Callable[[float], None] | None,
    cut_openings: bool,
) -> dict[int, Shape]:
    """Shapes by STEP id, in any order."""
    if not products:
        return {}
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
    threads = max((os.cpu_count() or 1) - 1, 1)  # one core is that of the thread that gives them their work
    try:
        iterator = ifcopenshell.geom.iterator(settings, model, threads, include=list(products), geometry_library=KERNEL)
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
    return shapes


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
