"""Transparent walls, slabs, roofs, coverings and proxies: which of them are glass.

A display colour may be transparent for many reasons: a roof that is to let one look into the house,
the line that separates two rooms, glass.  A window, a glazed door, and the plates, members and
curtain walls of a facade are glass where they are transparent.  Of the other classes, in this
order:

1. What the file calls air (all its materials: "Surfaces d'air") or a separation of rooms (its name:
   "Contact direct") stands for no body: it is left out, and the rooms on both sides end there.
2. What its surface style, a material or a material's category names after a glass or a clear
   plastic is glass.
3. What else is thinner than 1 mm stands for no body either.
4. What a material names otherwise is opaque.
5. What has no material, or one that says nothing, is glass where it is as thin as a pane (60 mm)
   and lets half of the light of the screen through; opaque else.
6. A sheet of these that lies on something else, as a banner on a wall or a film on a pane, is left
   out.

A transparent member is opaque where it is a bar, no wider than 0.2 m: the style of the panes is
often that of the whole curtain wall.

What faces down from a room is never glass (`is_phantom`), and between two rooms none of them is.
The thicknesses are our own judgement.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import replace

import ifcopenshell
import numpy as np

from bim.apertures import FLAT, main_direction
from bim.ifc.damage import Damage
from bim.ifc.materials import own_materials
from bim.ifc.shapes import NO_ELEMENTS, Shape
from bim.material_names import material_named
from bim.names import plain_text
from bim.planes import principal_extents
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Effect, Issue, Phrase
from mitsuba_cfs.surfaces import area_vectors

JUDGED = ("IfcWall", "IfcSlab", "IfcRoof", "IfcCovering", "IfcBuildingElementProxy")
THINNEST, THICKEST = 0.001, 0.06  # of a pane with its spacers [m]
NO_GLASS = (  # codes of the issues of transparent surfaces that are no glass
    "transparent-taken-as-opaque",
    "transparent-left-out",
    "transparent-facing-down",
)
BAR = 0.2  # width up to which a member is no pane [m]
LIES_ON = 0.03  # from a sheet to what it lies on [m]
WITHIN = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]]  # triangles
HALF = 0.5  # display transparency of a pane that nothing else names; share of a sheet's area
DOWN = -0.5  # z of an outward normal from which a face looks down: 30 degrees below the horizon
AIR = re.compile(r"(?<![^\W_])(air|luft|aire|aria|lucht|ilma)(?![^\W_])|空気|воздух")
SEPARATION = re.compile(r"contact direct|(room|space) separat|raumtrennlinie|separation de pieces?|virtual|virtuel")
NOT_AIR = re.compile(r"air (barrier|infiltration|gap)|luftdicht|luftschicht|lame d'air")
GLASS = re.compile(
    r"glas|glaz|verre|vitr|cristal|vidr|vetr[oa]|szk[lł]|\bsklo|cam\b|lasi\b|polycarb|polikarb"
    r"|plexi|acryl|pmma|etfe|ガラス|硝子|玻璃|стекл|γυαλ"
)
NOT_GLASS = re.compile(
    r"glass ?wool|glaswol|glasvlies|laine de verre|fib\w* ?(de )?(glas|verre)"
    r"|glasfa|fiberglas|fibreglas|lana de vidrio|グラスウール"
)


def judged_transparent(
    model: ifcopenshell.file, shapes: dict[int, Shape], damage: Damage | None = None
) -> tuple[dict[int, Shape], list[Issue]]:
    """Shapes whose transparent looks are glass, the others opaque or left out, and which they were.

    Args: shapes: by STEP id [m].
    """
    kept: dict[int, Shape] = {}
    issues = []
    judgements = {
        key: _judged(model.by_id(key), shape, damage)
        for key, shape in shapes.items()
        if shape.ifc_class.startswith((*JUDGED, "IfcMember")) and shape.transparent.any()
    }
    sheets = {key for key, (judged, _) in judgements.items() if judged is shapes[key]}
    lying = _lying(shapes, sheets, set(judgements))
    for key, shape in shapes.items():
        if key not in judgements:
            kept[key] = shape
            continue
        on_another = None, "on-another-body"
        judged, why = on_another if key in lying else judgements[key]
        if judged is not None:
            kept[key] = judged
        if judged is not shape:
            area = transparent_area(shape)
            values = {"element": f"{shape.ifc_class} {shape.name}", "area": area, "reason": Phrase(why)}
            code = "transparent-left-out" if judged is None else "transparent-taken-as-opaque"
            issues.append(Issue(code, shape.guid, values, Effect(glass=area)))
    return kept, issues


def is_phantom(ifc_class: str, normal: np.ndarray) -> bool:
    """Whether glass in such an element that a room has along this outward normal [3] is none."""
    return ifc_class.startswith(JUDGED) and normal[2] < DOWN


def transparent_area(shape: Shape) -> float:
    """Area [m2] of the transparent surfaces of a body, one side of it."""
    return float(0.5 * np.linalg.norm(area_vectors(shape.triangles[shape.transparent]), axis=1).sum())


def _judged(element: ifcopenshell.entity_instance, shape: Shape, damage: Damage | None) -> tuple[Shape | None, str]:
    """The shape as it is, opaque, or None where it is no body, and the phrase that says why."""
    if shape.ifc_class.startswith("IfcMember"):
        if not _is_bar(shape):
            return shape, ""
        solid = tuple(replace(style, transparency=0.0) for style in shape.styles)
        return replace(shape, styles=solid), "bar"
    materials = _material_texts(element, damage)
    names = plain_text(f"{element.Name or ''} {getattr(element, 'ObjectType', None) or ''}")
    thickness = _thickness(shape)
    if SEPARATION.search(names) or (materials and all(_is_air(text) for text in materials)):
        return None, "air"
    styles = tuple(
        style if not style.is_glass or _is_pane(style, materials, thickness) else replace(style, transparency=0.0)
        for style in shape.styles
    )
    if styles == shape.styles:
        return shape, ""
    if thickness < THINNEST:
        return None, "no-thickness"
    if any(_names_a_body(text) for text in materials):
        return replace(shape, styles=styles), "other-material"
    return replace(shape, styles=styles), "not-called-glass"


def _lying(shapes: Mapping[int, Shape], sheets: Collection[int], judged: Collection[int]) -> set[int]:
    """STEP ids of those sheets that lie on another body, or another window.

    Args: judged: transparent elements, on which no other one lies.
    """
    if not sheets:
        return set()
    bodies = [
        shape.triangles
        for key, shape in shapes.items()
        if key not in judged and shape.ifc_class not in NO_ELEMENTS and not shape.ifc_class.startswith("IfcSite")
    ]
    mesh = ray_mesh(np.concatenate(bodies or [np.empty((0, 3, 3))]))
    return {key for key in sheets if _lies_on(shapes[key], mesh)}


def _lies_on(shape: Shape, bodies: RayMesh) -> bool:
    """Whether something stands at most of a sheet's area, on either side."""
    clear = shape.triangles[shape.transparent]
    direction = main_direction(clear)
    if direction is None:
        return False
    vectors = area_vectors(clear)
    flat = np.abs(vectors @ direction) > FLAT * np.linalg.norm(vectors, axis=1)
    heights = clear[flat] @ direction
    middle, thickness = 0.5 * (heights.max() + heights.min()), float(np.ptp(heights))
    points = np.einsum("pk,tkd->tpd", WITHIN, clear[flat])
    points += (middle - points @ direction)[..., None] * direction
    origins = np.repeat(points.reshape(-1, 3), 2, axis=0)
    sides = np.tile([direction, -direction], (len(origins) // 2, 1))
    _, hit = bodies.first_hits(origins, sides, 0.5 * thickness + LIES_ON)
    stands = (hit >= 0).reshape(-1, len(WITHIN), 2).any(axis=2).mean(axis=1)
    return bool(np.average(stands, weights=np.linalg.norm(vectors[flat], axis=1)) > HALF)


def _is_pane(style, materials: list[str], thickness: float) -> bool:
    if any(_is_glass(text) for text in (plain_text(style.name), *materials)):
        return True
    if any(_names_a_body(text) for text in materials):
        return False
    return THINNEST <= thickness <= THICKEST and style.transparency >= HALF


def _is_glass(text: str) -> bool:
    return bool(GLASS.search(NOT_GLASS.sub("", text)))


def _is_air(text: str) -> bool:
    return bool(AIR.search(NOT_AIR.sub("", text)))


def _names_a_body(text: str) -> bool:
    return material_named(text).group != "unknown"


def _material_texts(element: ifcopenshell.entity_instance, damage: Damage | None) -> list[str]:
    """Name and category of each material, as `plain_text`."""
    return [
        plain_text(f"{one.Name or ''} {getattr(one, 'Category', None) or ''}") for one in own_materials(element, damage)
    ]


def _is_bar(shape: Shape) -> bool:
    """Whether the body is narrow in two of its three directions."""
    corners = np.unique(shape.triangles.reshape(-1, 3).round(6), axis=0)
    return bool(principal_extents(corners)[-2] <= BAR)


def _thickness(shape: Shape) -> float:
    """Extent [m] of the body across its biggest faces."""
    direction = main_direction(shape.triangles)
    return 0.0 if direction is None else float(np.ptp(shape.triangles @ direction))
