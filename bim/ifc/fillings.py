"""Windows, doors and glazed panels of an IFC file with their openings, hosts and stated values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bim.apertures import BESIDE, Filling
from bim.colours import GREY
from bim.ifc.damage import Damage, instances, type_of
from bim.ifc.project import definitions_of, length_scale, psets_of
from bim.ifc.shapes import Shape
from bim.report.issue import Effect, Issue
from mitsuba_cfs.surfaces import area_vectors

PANELS = (
    "IfcPlate",
    "IfcCurtainWall",
    "IfcWall",
    "IfcBuildingElementProxy",
    "IfcMember",
    "IfcRoof",
    "IfcSlab",
    "IfcCovering",
)
# of the glass, from which nothing is computed
UNREAD = (
    "FillGas",
    "GlassColor",
    "GlassThickness1",
    "GlassThickness2",
    "GlassThickness3",
    "ShadingCoefficient",
    "SolarAbsorption",
    "SolarReflectance",
    "Translucency",
    "ThermalTransmittanceSummer",
    "VisibleLightReflectance",
)
LEAST_GLASS = 0.05  # transparent area that makes a panel a window [m2]


def read_fillings(
    model: ifcopenshell.file, shapes: dict[int, Shape], damage: Damage | None = None
) -> tuple[list[Filling], list[Issue]]:
    """Every window and door, and every other element with transparent parts (curtain panels)."""
    issues: list[Issue] = []
    fillings = []
    scale = length_scale(model)
    for element in [*model.by_type("IfcWindow"), *model.by_type("IfcDoor")]:
        shape = shapes.get(element.id())
        if shape is not None and shape.is_unglazed and not element.is_a("IfcDoor"):
            continue  # a wall, to the room
        opening, host = _opening_and_host(element)
        body = None if opening is None else shapes.get(opening.id())
        if shape is None and body is None:
            code, values = "window-without-geometry-and-opening", {"element": _label(element)}
            issues.append(Issue(code, element.GlobalId, values, Effect("window")))
            continue
        if shape is None:
            values = {"element": _label(element)}
            issues.append(Issue("window-without-geometry", element.GlobalId, values))
        one = _filling(element, shape or body, body, host, scale, damage)
        issues += _unread_glazing(one, psets_of(element, damage))
        wall = None if host is None else shapes.get(host.id())
        fillings.append(replace(one, beside=beside_opening(wall, body)))
    for class_name in PANELS:
        for element in instances(model, class_name):
            panel = _panel(element, shapes.get(element.id()), scale, damage)
            if panel is None:
                continue
            fillings.append(panel)
            if class_name in ("IfcWall", "IfcSlab", "IfcRoof", "IfcCovering"):
                values = {"element": _label(element)}
                issues.append(Issue("transparent-element-as-window", element.GlobalId, values))
    return fillings, issues


def _label(element: ifcopenshell.entity_instance) -> str:
    return f"{element.is_a()} {element.Name or ''}"


def _opening_and_host(element: ifcopenshell.entity_instance):
    for relation in getattr(element, "FillsVoids", None) or ():
        opening = relation.RelatingOpeningElement
        return opening, _host_of(opening)
    return None, None


def _host_of(opening: ifcopenshell.entity_instance) -> ifcopenshell.entity_instance | None:
    """The element that an opening is cut out of, if any."""
    voids = getattr(opening, "VoidsElements", None) or ()
    return voids[0].RelatingBuildingElement if voids else None


def unfilled_openings(
    model: ifcopenshell.file,
) -> Iterator[tuple[ifcopenshell.entity_instance, ifcopenshell.entity_instance | None]]:
    """Openings that no relation fills, with the element that each is cut out of, if any."""
    for opening in model.by_type("IfcOpeningElement"):
        if not getattr(opening, "HasFillings", None):
            yield opening, _host_of(opening)


def beside_opening(host: Shape | None, opening: Shape | None) -> NDArray[np.float64] | None:
    """Triangles [K, 3, 3] of a wall or roof near one of its openings; None without either."""
    if host is None or opening is None:
        return None
    corners = opening.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0) - BESIDE, corners.max(axis=0) + BESIDE
    near = np.all(host.triangles.max(axis=1) > low, axis=1)
    return host.triangles[near & np.all(host.triangles.min(axis=1) < high, axis=1)]


def _panel(element, shape: Shape | None, scale: float, damage: Damage | None) -> Filling | None:
    """A curtain wall panel or other element as a window if enough of it is transparent."""
    if shape is None or not shape.transparent.any():
        return None
    clear = shape.triangles[shape.transparent]
    if 0.5 * np.linalg.norm(area_vectors(clear), axis=1).sum() < LEAST_GLASS:
        return None
    return _filling(element, shape, None, element, scale, damage)


def _filling(element, shape: Shape, body: Shape | None, host, scale: float, damage: Damage | None) -> Filling:
    psets = psets_of(element, damage)
    element_type = type_of(element, damage)
    opaque = [style for style in shape.styles if not style.is_glass]
    panes = _number(psets, "GlassLayers")
    return Filling(
        guid=element.GlobalId,
        name=element.Name or element.GlobalId,
        ifc_class=element.is_a(),
        triangles=shape.triangles,
        transparent=shape.transparent,
        opening=None if body is None else body.triangles,
        host=None if host is None else host.GlobalId,
        frame_width=_frame_width(element, element_type, scale),
        glazed_fraction=_number(psets, "GlazingAreaFraction"),
        u_value=_number(psets, "ThermalTransmittance", "ThermalTransmittanceWinter"),
        g_value=_number(psets, "SolarHeatGainTransmittance", "TotalSolarTransmittance"),
        visible_transmittance=_number(psets, "VisibleLightTransmittance"),
        type_name=(element_type.Name or "") if element_type is not None else "",
        frame_reflectance=opaque[0].reflectance if opaque else None,
        solar_transmittance=_number(psets, "SolarTransmittance"),
        panes=None if panes is None else round(panes),
        frame_hue=opaque[0].hue if opaque else GREY,
    )


def _unread_glazing(one: Filling, psets: dict[str, dict[str, Any]]) -> list[Issue]:
    """What the property sets state of the glass, where g or light's transmittance is missing."""
    if None not in (one.g_value, one.visible_transmittance):
        return []
    names = sorted({n for stated in psets.values() for n in stated} & set(UNREAD))
    values = {"element": f"{one.ifc_class} {one.name}", "part": ", ".join(names), "glazing": one.type_name}
    return [Issue("glazing-part-not-read", one.guid, values)] if names else []


def _number(psets: dict[str, dict[str, Any]], *names: str) -> float | None:
    """First positive number of one of those names in any property set."""
    for name in names:
        for properties in psets.values():
            value = properties.get(name)
            if isinstance(value, int | float) and not isinstance(value, bool) and value > 0:
                return float(value)
    return None


def _frame_width(element, element_type, scale: float) -> float | None:
    """Lining thickness and panel frame thickness together [m], where stated."""
    total = 0.0
    for source in (element_type, element):
        sets = definitions_of(source)
        for one in sets:
            if one.is_a("IfcWindowLiningProperties"):
                total += (one.LiningThickness or 0.0) * scale
        panels = [one for one in sets if one.is_a("IfcWindowPanelProperties")]
        if panels:
            total += max((one.FrameThickness or 0.0) for one in panels) * scale
        if total > 0:
            return total
    return None
