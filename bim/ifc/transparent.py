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

What faces down from a room is never glass (`is_phantom`), and between two rooms none of them is.
The thicknesses are our own judgement.
"""

from __future__ import annotations

import contextlib
import re
from dataclasses import replace

import ifcopenshell
import ifcopenshell.util.element
import numpy as np

from bim.apertures import main_direction
from bim.defaults import UNKNOWN_MATERIAL
from bim.ifc.materials import default_material
from bim.ifc.shapes import Shape
from bim.model import Problem
from bim.names import plain_text
from bim.planes import area_vectors

JUDGED = ("IfcWall", "IfcSlab", "IfcRoof", "IfcCovering", "IfcBuildingElementProxy")
THINNEST, THICKEST = 0.001, 0.06  # of a pane with its spacers [m]
PHANTOM = "no glass"  # kinds of problems that begin so are of transparent surfaces without glass
HALF = 0.5  # display transparency of a pane that nothing else names
DOWN = -0.5  # z of an outward normal from which a face looks down: 30 degrees below the horizon
AIR = re.compile(r"(?<![^\W_])(air|luft|aire|aria|lucht|ilma)(?![^\W_])|空気|воздух")
SEPARATION = re.compile(
    r"contact direct|(room|space) separat|raumtrennlinie|separation de pieces?|virtual|virtuel"
)
NOT_AIR = re.compile(r"air (barrier|infiltration|gap)|luftdicht|luftschicht|lame d'air")
GLASS = re.compile(
    r"glas|glaz|verre|vitr|cristal|vidr|vetr[oa]|szk[lł]|\bsklo|cam\b|lasi\b|polycarb|polikarb"
    r"|plexi|acryl|pmma|etfe|ガラス|硝子|玻璃|стекл|γυαλ"
)
NOT_GLASS = re.compile(r"glass ?wool|glaswol|glasvlies|laine de verre|fib\w* ?(de )?(glas|verre)"
                       r"|glasfa|fiberglas|fibreglas|lana de vidrio|グラスウール")  # fmt: skip


def judged_transparent(
    model: ifcopenshell.file, shapes: dict[int, Shape]
) -> tuple[dict[int, Shape], list[Problem]]:
    """Shapes whose transparent looks are glass, the others opaque or left out, and which they were.

    Args: shapes: by STEP id [m].
    """
    kept: dict[int, Shape] = {}
    problems = []
    for key, shape in shapes.items():
        if not shape.ifc_class.startswith(JUDGED) or not shape.transparent.any():
            kept[key] = shape
            continue
        judged, why = _judged(model.by_id(key), shape)
        if judged is not None:
            kept[key] = judged
        if judged is not shape:
            area = transparent_area(shape)
            what = f"{shape.ifc_class} {shape.name}: {area:.2f} m2 transparent, {why}"
            done = "no glass: left out" if judged is None else "no glass: taken as opaque"
            problems.append(
                Problem(shape.guid, what, done, glass=area, kind=f"{PHANTOM} {why} {done}")
            )
    return kept, problems


def is_phantom(ifc_class: str, normal: np.ndarray) -> bool:
    """Whether glass in such an element that a room has along this outward normal [3] is none."""
    return ifc_class.startswith(JUDGED) and normal[2] < DOWN


def transparent_area(shape: Shape) -> float:
    """Area [m2] of the transparent surfaces of a body, one side of it."""
    return float(
        0.5 * np.linalg.norm(area_vectors(shape.triangles[shape.transparent]), axis=1).sum()
    )


def _judged(element: ifcopenshell.entity_instance, shape: Shape) -> tuple[Shape | None, str]:
    """The shape as it is, opaque, or None where it is no body, and why."""
    materials = _material_texts(element)
    own = plain_text(f"{element.Name or ''} {getattr(element, 'ObjectType', None) or ''}")
    thickness = _thickness(shape)
    if SEPARATION.search(own) or (materials and all(_is_air(text) for text in materials)):
        return None, "which the file calls air or a separation of rooms"
    looks = tuple(
        look if not look.is_glass or _is_pane(look, materials, thickness)
        else replace(look, transparency=0.0)
        for look in shape.looks
    )  # fmt: skip
    if looks == shape.looks:
        return shape, ""
    if thickness < THINNEST:
        return None, "without thickness"
    if any(_names_a_body(text) for text in materials):
        return replace(shape, looks=looks), "of a material that is no glass"
    return replace(shape, looks=looks), "which nothing calls glass"


def _is_pane(look, materials: list[str], thickness: float) -> bool:
    if any(_is_glass(text) for text in (plain_text(look.name), *materials)):
        return True
    if any(_names_a_body(text) for text in materials):
        return False
    return THINNEST <= thickness <= THICKEST and look.transparency >= HALF


def _is_glass(text: str) -> bool:
    return bool(GLASS.search(NOT_GLASS.sub("", text)))


def _is_air(text: str) -> bool:
    return bool(AIR.search(NOT_AIR.sub("", text)))


def _names_a_body(text: str) -> bool:
    return default_material(text) is not UNKNOWN_MATERIAL


def _material_texts(element: ifcopenshell.entity_instance) -> list[str]:
    """Name and category of each material, as `plain_text`."""
    with contextlib.suppress(Exception):  # damaged associations
        return [
            plain_text(f"{one.Name or ''} {getattr(one, 'Category', None) or ''}")
            for one in ifcopenshell.util.element.get_materials(element)
        ]
    return []


def _thickness(shape: Shape) -> float:
    """Extent [m] of the body across its biggest faces."""
    direction = main_direction(shape.triangles)
    return 0.0 if direction is None else float(np.ptp(shape.triangles @ direction))
