"""From pieces of a room's boundary to faces and windows with all their properties."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bim.bodies import Span
from bim.colours import GREY, Colour
from bim.defaults import (
    EMISSIVITY,
    GLASS_REFLECTANCE,
    ROOM_REFLECTANCE,
    air_layer,
    default_construction,
    glass_construction,
)
from bim.material_names import NamedMaterial
from bim.model import Construction, Face, MaterialLayer, Window
from bim.neighbours import THICKEST_SPAN, Beyond
from bim.rooms import Piece
from bim.shell import conforming_triangles
from mitsuba_cfs.gloss import Gloss
from mitsuba_cfs.surfaces import area_vectors

SHALLOWEST_GAP = 0.01  # air between two elements from this on is a layer [m]


@dataclass(frozen=True, slots=True)
class ElementRecord:
    """What the boundary of a room needs to know of an element."""

    guid: str
    name: str
    ifc_class: str
    material: NamedMaterial  # of elements without layers
    layers: tuple[MaterialLayer, ...] = ()
    axis: NDArray[np.float64] | None = None  # [3] world: from the first layer to the last
    is_roof: bool = False
    stated: bool = False  # whether the thermal properties come from the file
    # of the bodies that the element is made of, by their representation items
    of_items: Mapping[int, NamedMaterial] = field(default_factory=dict)
    # listed without thicknesses, of a single body: materials and their shares of the thickness
    shares: tuple[tuple[NamedMaterial, float], ...] = ()
    named_mm: tuple[float, ...] = ()  # numbers in its name, which may be their thicknesses


@dataclass(frozen=True, slots=True)
class Finishes:
    """What the triangles of the elements' mesh reflect."""

    reflectance: NDArray[np.float64]  # [N, 2] visible and solar, negative where none is stated
    gloss: NDArray[np.object_]  # [N] `Gloss` or None
    hue: NDArray[np.float64]  # [N, 3] linear sRGB of luminance 1

    def of(self, triangle: int) -> tuple[float, float, Gloss | None, Colour]:
        """Visible and solar reflectance, gloss and hue of a triangle."""
        visible, solar = self.reflectance[triangle].tolist()
        red, green, blue = self.hue[triangle].tolist()
        return visible, solar, self.gloss[triangle], (red, green, blue)


def faces_and_windows(
    pieces: Sequence[Piece], beyond: Sequence[Beyond], records: Sequence[ElementRecord], finishes: Finishes
) -> tuple[list[Face], list[Window], Counter]:
    """Faces, windows, and how often something had to be assumed.

    Args: beyond: for each piece (ignored for glass); finishes: of the elements' mesh.
    """
    assumed: Counter = Counter()
    meshes = conforming_triangles([piece.facet for piece in pieces])
    faces: list[Face] = []
    glass: dict[str, list[tuple[Piece, NDArray[np.float64]]]] = {}
    counts: Counter = Counter()
    for piece, triangles, behind in zip(pieces, meshes, beyond, strict=True):
        if not len(triangles) or np.linalg.norm(area_vectors(triangles).sum(axis=0)) < 1e-9:
            continue
        if piece.role == "glass":
            key = f"{piece.attachment.aperture.filling.guid} {np.round(piece.facet.plane.normal, 3)}"
            glass.setdefault(key, []).append((piece, triangles))
            continue
        kind = _kind(piece, behind, records)
        counts[kind] += 1
        faces.append(
            _face(
                f"{kind} {counts[kind]}",
                kind,
                piece,
                triangles,
                behind,
                records=records,
                finishes=finishes,
                assumed=assumed,
            )
        )
    return faces, [_window(parts) for parts in glass.values()], assumed


def _kind(piece: Piece, behind: Beyond, records: Sequence[ElementRecord]) -> str:
    door = piece.attachment is not None and piece.attachment.aperture.filling.is_door
    if piece.role in ("frame", "door"):
        return "door" if door else "window frame"
    if piece.role == "reveal":
        return "reveal"
    z = piece.facet.plane.normal[2]
    if z < -0.7:
        return "floor"
    if z > 0.34:  # less than 70 degrees from level
        roof = bool(behind.spans) and records[behind.spans[0].element].is_roof
        return "roof" if roof or behind.adjacency == "outside" else "ceiling"
    return "wall"


def _face(
    name: str,
    kind: str,
    piece: Piece,
    triangles: NDArray[np.float64],
    behind: Beyond,
    *,
    records: Sequence[ElementRecord],
    finishes: Finishes,
    assumed: Counter,
) -> Face:
    """One opaque face with what the file says of it, defaults where it says nothing."""
    filling = piece.attachment.aperture.filling if piece.attachment is not None else None
    is_open = filling is not None and filling.is_open  # closed by a wall's face
    own = filling is not None and not is_open and piece.role in ("frame", "door", "inner glass")
    spans = behind.spans
    record = records[spans[0].element] if spans else None
    nothing = (-1.0, -1.0, None, GREY)
    visible, solar, gloss, hue = finishes.of(spans[0].triangle) if spans else nothing
    if own:
        gloss, hue = None, filling.frame_hue
        visible = solar = -1.0 if filling.frame_reflectance is None else filling.frame_reflectance
    if piece.role == "inner glass" and not is_open:
        visible, solar, hue = GLASS_REFLECTANCE, GLASS_REFLECTANCE, GREY
    if visible < 0:
        assumed["reflectance"] += not is_open
        visible, solar, hue = ROOM_REFLECTANCE[kind], ROOM_REFLECTANCE[kind], GREY
    if record is None and not own and not is_open:
        assumed["element"] += 1
    frame = own and kind == "window frame"
    is_pane = piece.role == "inner glass" and behind.neighbour is not None
    if is_pane and own:
        construction = glass_construction(filling.u_value)
    else:
        construction = None if frame else construction_of(spans, records, piece.facet.plane.normal)
    if construction is None:
        assumed["construction"] += not (frame or is_open)
        construction = default_construction(kind, behind.adjacency)
    if behind.adjacency == "unknown":
        assumed["adjacency"] += 1
    guid = filling.guid if own else (record.guid if record is not None else None)
    return Face(
        name,
        kind,
        triangles,
        behind.adjacency,
        construction,
        visible,
        solar,
        EMISSIVITY,
        behind.neighbour,
        guid,
        gloss,
        _window([(piece, triangles)]) if is_pane else None,
        hue,
    )


def construction_of(
    spans: Sequence[Span], records: Sequence[ElementRecord], normal: NDArray[np.float64]
) -> Construction | None:
    """Layers, outermost first, of the elements that a ray out of the room went through."""
    outwards: list[MaterialLayer] = []
    reach, names, stated = -np.inf, [], True
    for span in spans:
        if span.stop <= reach + 1e-3:  # inside an element that is already counted
            continue
        start = max(span.start, reach) if outwards else span.start
        if outwards and start - reach > SHALLOWEST_GAP:
            gap = start - reach
            outwards.append(air_layer(gap))
        record = records[span.element]
        outwards += _layers(record, span, start, normal)
        names.append(record.name)
        stated &= record.stated
        reach = span.stop
    if not outwards:
        return None
    source = "IFC" if stated else "IFC, properties completed from EN ISO 10456"
    return Construction(" + ".join(names), tuple(outwards[::-1]), source)


def _layers(record: ElementRecord, span: Span, start: float, normal: NDArray[np.float64]) -> list[MaterialLayer]:
    """Layers of one element from the room outwards, from `start` on [m].

    Those of its layer set; without one, the bodies that the ray goes through, each of its own
    material or of the element's.
    """
    length = span.stop - start
    total = sum(layer.thickness for layer in record.layers)
    fits = 0.5 * total < length < 1.6 * total or length > THICKEST_SPAN
    across = record.axis is None or abs(record.axis @ normal) > 0.7
    if record.layers and fits and across:
        along = record.axis is not None and record.axis @ normal > 0
        # without an axis the first layer is the outer one, as the authoring tools write it
        return list(record.layers if along else record.layers[::-1])
    if record.shares and length <= THICKEST_SPAN:
        return _shared(record, length)[::-1]
    bodies: list[tuple[NamedMaterial, float]] = []  # materials and thicknesses
    for part in span.parts:
        material = record.of_items.get(part.item, record.material)
        if bodies and part.stop <= start + 1e-3:
            continue  # inside one that is already counted
        thickness = min(part.stop - max(part.start, start), THICKEST_SPAN)
        start = max(start, part.stop)
        if bodies and bodies[-1][0] == material:
            thickness += bodies.pop()[1]
        bodies.append((material, thickness))
    return [material.of_thickness(max(thickness, 1e-3)) for material, thickness in bodies]


def _shared(record: ElementRecord, length: float) -> list[MaterialLayer]:
    """The listed layers of one body of that thickness [m], in the order of the list.

    Thicknesses are the numbers in the element's name where as many of them in a row as there are
    layers add up to its own within 3 %, else its shares.
    """
    count = len(record.shares)
    for start in range(len(record.named_mm) - count + 1):
        some = record.named_mm[start : start + count]
        if min(some) > 0 and abs(sum(some) / (1000 * length) - 1) < 0.03:
            pairs = zip(record.shares, some, strict=True)
            return [one.of_thickness(length * mm / sum(some)) for (one, _), mm in pairs]
    return [one.of_thickness(length * share) for one, share in record.shares]


def _window(parts: Sequence[tuple[Piece, NDArray[np.float64]]]) -> Window:
    """All panes of one filling in one plane as one window."""
    attachment = parts[0][0].attachment
    filling = attachment.aperture.filling
    triangles = np.concatenate([triangles for _, triangles in parts])
    return Window(
        filling.guid,
        filling.name,
        triangles,
        filling.host,
        float(attachment.region.area),
        filling.u_value,
        filling.g_value,
        filling.visible_transmittance,
        filling.type_name,
        filling.solar_transmittance,
        filling.panes,
        is_open=filling.is_open,
    )


def floor_area(faces: Sequence[Face]) -> float:
    """Area [m2] of the room's floor seen from above, its window sills left out."""
    floors = [face for face in faces if face.kind == "floor"]
    return float(sum(face.area * -face.normal[2] for face in floors))
