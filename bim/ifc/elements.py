"""Building elements of an IFC file: those that bound rooms, and the surroundings."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bim.boundaries import ElementRecord, Finishes
from bim.colours import GREY
from bim.defaults import (
    FACADE_REFLECTANCE,
    GLASS_REFLECTANCE,
    HIGHEST_REFLECTANCE,
    LOWEST_REFLECTANCE,
    SITE_REFLECTANCE,
)
from bim.ifc.damage import Damage, entities
from bim.ifc.materials import MaterialReader, materials_of
from bim.ifc.project import storey_of
from bim.ifc.shapes import Shape
from bim.material_names import MaterialCorrection, NamedMaterial
from bim.model import Element
from bim.report.issue import Issue
from mitsuba_cfs.gloss import Gloss

BUILT_UP = ("IfcWall", "IfcSlab", "IfcRoof", "IfcCovering")  # of layers
NUMBER = re.compile(r"\d+(?:\.\d+)?")
SITE = ("IfcSite", "IfcGeographicElement")


def bounding_elements(
    model: ifcopenshell.file,
    shapes: Sequence[Shape],
    rotation: NDArray[np.float64],
    damage: Damage | None = None,
    *,
    materials: Sequence[MaterialCorrection] = (),
) -> tuple[list[ElementRecord], Finishes, list[Issue]]:
    """Record of each shape, what their triangles reflect, issues.

    Args:
        shapes: in world axes; rotation: [3, 3] from model axes to the world.
        materials: corrected properties.
    """
    reader = MaterialReader(model, Damage() if damage is None else damage, materials)
    records = [_record(model.by_id(shape.step_id), shape, reader, rotation) for shape in shapes]
    faults: dict[str, Issue] = {}
    values, gloss, hues = [], [], []
    for shape in shapes:
        glosses = np.array([*(style.gloss for style in shape.styles), None], dtype=object)
        by_look = np.full((len(shape.styles) + 1, 2), -1.0)
        hue = np.array([*(GREY if style.is_glass else style.hue for style in shape.styles), GREY])
        for i, style in enumerate(shape.styles):
            by_look[i] = GLASS_REFLECTANCE if style.is_glass else style.reflectances
            if style.stated is not None and not style.is_glass:
                values_of_style = {
                    "style": style.name,
                    "stated": style.stated,
                    "used": min(max(style.stated, LOWEST_REFLECTANCE), HIGHEST_REFLECTANCE),
                }
                issue = Issue("surface-style-bounded", style.name, values_of_style)
                faults.setdefault(style.name, issue)
        stated = reader.reflectances_of(model.by_id(shape.step_id))
        if stated is not None and not shape.transparent.any() and not shape.is_painted:
            mirrored = np.array([0.0 if g is None else g.at_normal for g in glosses])
            by_look[:] = np.maximum(np.array(stated) - mirrored[:, None], 0.0)
        values.append(by_look[shape.style_index])
        gloss.append(glosses[shape.style_index])
        hues.append(hue[shape.style_index])
    issues = [*reader.issues.values(), *faults.values()]
    finishes = Finishes(
        np.concatenate(values or [np.empty((0, 2))]),
        np.concatenate([np.empty(0, object), *gloss]),
        np.concatenate(hues or [np.empty((0, 3))]),
    )
    return records, finishes, issues


def _record(
    element: ifcopenshell.entity_instance, shape: Shape, reader: MaterialReader, rotation: NDArray[np.float64]
) -> ElementRecord:
    layers = reader.layers_of(element)
    of_items, known = reader.of_items(element, np.unique(shape.item).tolist())
    if layers is None:
        material, stated = reader.material(reader.single_material(element))
    else:
        material, stated = NamedMaterial(layers.layers[0], ""), layers.stated
    predefined = getattr(element, "PredefinedType", None)
    is_built_up = element.is_a().startswith(BUILT_UP) and len(np.unique(shape.item)) == 1
    shares = reader.shares_of(element) if layers is None and is_built_up else ()
    return ElementRecord(
        element.GlobalId,
        element.Name or element.is_a(),
        element.is_a(),
        material,
        () if layers is None else layers.layers,
        None if layers is None or layers.axis is None else rotation @ layers.axis,
        element.is_a("IfcRoof") or predefined == "ROOF",
        stated and known,
        of_items,
        shares,
        tuple(map(float, NUMBER.findall(element.Name or ""))),
    )


def outdoor_elements(
    model: ifcopenshell.file,
    shapes: Sequence[Shape],
    *,
    reflectance: float | None = None,
    drawn_shades: Collection[int] = (),
    panes: Gloss | None = None,
) -> list[Element]:
    """Every building element and terrain, one `Element` for each of its surface styles.

    Args:
        reflectance: of everything, in place of what the file says.
        drawn_shades: STEP ids of shading devices that are traced before any BSDF.
        panes: how glass mirrors whose style does not say it; None: it reflects diffusely.
    """
    result = []
    for shape in shapes:
        entity = model.by_id(shape.step_id)
        default = SITE_REFLECTANCE if shape.ifc_class.startswith(SITE) else FACADE_REFLECTANCE
        base = Element(
            shape.guid,
            shape.name or shape.ifc_class,
            shape.ifc_class,
            shape.triangles,
            default,
            default,
            next(iter(cad_layers_of(entity)), ""),
            storey_of(entity),
            material_name(entity),
            shape.step_id in drawn_shades,
        )
        for index in np.unique(shape.style_index):
            visible = solar = default
            gloss, hue = None, GREY
            if index >= 0:
                style = shape.styles[index]
                (visible, solar), gloss, hue = style.reflectances, style.gloss, style.hue
                if style.is_glass:
                    gloss = panes if gloss is None else gloss
                    # what a pane mirrors is no diffuse light
                    visible = solar = GLASS_REFLECTANCE if gloss is None else 0.0
                    hue = GREY
            if reflectance is not None:
                visible, solar, gloss, hue = reflectance, reflectance, None, GREY
            result.append(
                replace(
                    base,
                    triangles=shape.triangles[shape.style_index == index],
                    reflectance_visible=visible,
                    reflectance_solar=solar,
                    gloss=gloss,
                    hue=hue,
                )
            )
    return result


def cad_layers_of(entity: ifcopenshell.entity_instance) -> list[str]:
    """Names of the presentation layers (CAD layers) that an element's body is on."""
    names: list[str] = []
    shape = getattr(entity, "Representation", None)
    for representation in entities(getattr(shape, "Representations", None)):
        layers = entities(getattr(representation, "LayerAssignments", None))
        for item in entities(representation.Items):
            layers += entities(getattr(item, "LayerAssignment", None))  # IFC4
            layers += entities(getattr(item, "LayerAssignments", None))  # IFC2X3
        names += [layer.Name or "" for layer in layers]
    return names


def material_name(entity: ifcopenshell.entity_instance) -> str:
    """Name of an element's first material."""
    return next((material.Name or "" for material in materials_of(entity)), "")
