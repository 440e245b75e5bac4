"""Constructions and window types of a gbXML file: layers, and what windows state."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import cached_property

from bim.defaults import EPS, resistance_layer
from bim.gbxml.document import Document
from bim.model import Construction, MaterialLayer
from bim.polygon_rooms import GlazingValues, SurfaceFinish
from bim.report.issue import Issue

# of a window type or an opening: not read
PARTS = (
    "Glaze", "Gap", "Frame", "Blind", "Shade", "ShadeControl", "ShadingCoeff", "Reflectance",
    "Emittance", "GlazeConductivity",
)  # fmt: skip
ANGLES = ("incidentAngle", "solarIncidentAngle")  # attributes [deg]
SHADES = ("interiorShadeType", "exteriorShadeType")  # attributes of an opening, not read


class Constructions:
    """What the surfaces and openings of a document refer to, read when they do."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.issues: list[Issue] = []
        self._finishes: dict[str, SurfaceFinish] = {}
        self._windows: dict[str, GlazingValues] = {}

    @cached_property
    def _by_id(self) -> dict[str, dict[str, ElementTree.Element]]:
        return self.document.by_id(("Construction", "Layer", "Material", "WindowType"))

    def finish(self, name: str | None) -> SurfaceFinish:
        """Layers and reflectances of a construction; what it does not state is None."""
        if name is None:
            return SurfaceFinish()
        if name not in self._finishes:
            one = self._by_id["Construction"].get(name)
            if one is None:
                self._missing("constructionIdRef", f"no Construction {name!r:.60}", name)
            self._finishes[name] = SurfaceFinish() if one is None else self._finish(one)
        return self._finishes[name]

    def _missing(self, field: str, reason: str, where: str) -> None:
        issue = Issue("value-not-read", where, {"field": field, "reason": reason})
        if issue not in self.issues:
            self.issues.append(issue)

    def _finish(self, one: ElementTree.Element) -> SurfaceFinish:
        layers = self.document.optional(lambda: self._layers(one), self.issues) or []
        name = _name(one)
        construction = (
            Construction(name, tuple(layers), self.document.file.name) if layers else None
        )
        visible, solar = (
            self._share(one, "Reflectance", kind) for kind in ("IntVisible", "IntSolar")
        )
        outer = self._share(one, "Reflectance", "ExtVisible")
        absorbed = self._share(one, "Absorptance", "IntSolar")
        if solar is None and absorbed is not None:
            solar = 1.0 - absorbed
        emissivity = self._share(one, "Emittance", "IntIR")
        found = SurfaceFinish(construction, visible, solar, outer=outer)
        return found if emissivity is None else replace(found, emissivity=emissivity)

    def _layers(self, one: ElementTree.Element) -> list[MaterialLayer]:
        """The layers of a construction, outermost first, as gbXML orders them."""
        found = []
        for reference in one.iterfind("LayerId"):
            layer = self._referred(one, "Layer", reference.get("layerIdRef"))
            for inner in layer.iterfind("MaterialId"):
                material = self._referred(layer, "Material", inner.get("materialIdRef"))
                found += self._layer(material)
        return found

    def _referred(
        self, owner: ElementTree.Element, kind: str, name: str | None
    ) -> ElementTree.Element:
        return self.document.referred(owner, kind, name, self._by_id)

    def _layer(self, material: ElementTree.Element) -> list[MaterialLayer]:
        """The layer of a material; none where it states no resistance."""
        name = _name(material)
        fields = ("Thickness", "Conductivity", "Density", "SpecificHeat")
        thickness, conductivity, density, capacity = (
            self._quantity(material, field) for field in fields
        )
        resistance = self._quantity(material, "R-value")
        if not thickness or not conductivity:
            if not resistance:
                values = {"material": name}
                self.issues.append(Issue("resistance-missing", material.get("id", ""), values))
                return []
        try:
            if thickness and conductivity:
                layer = replace(EPS, name=name, thickness=thickness, conductivity=conductivity)
            else:
                layer = resistance_layer(name, resistance, thickness)
            heavy = density or layer.density, capacity or layer.heat_capacity
            return [replace(layer, density=heavy[0], heat_capacity=heavy[1])]
        except ValueError as error:
            raise self.document.fault(str(error), material) from None

    def is_glass(self, opening: ElementTree.Element) -> bool:
        """Whether an opening of any type has a window type, or a construction that passes light."""
        return opening.get("windowTypeIdRef", "") in self._by_id["WindowType"] or bool(
            self.transmittance(opening)
        )

    def transmittance(self, surface: ElementTree.Element) -> float | None:
        """Visible transmittance that a surface's construction states."""
        one = self._by_id["Construction"].get(surface.get("constructionIdRef", ""))
        return None if one is None else self._share(one, "Transmittance", "Visible")

    def window(self, opening: ElementTree.Element) -> GlazingValues:
        """What an opening's window type, else its construction states."""
        name = opening.get("windowTypeIdRef") or opening.get("constructionIdRef") or ""
        guid = opening.get("id", "")
        for shade in SHADES:
            if opening.get(shade, "None") not in ("None", "NoShade", ""):
                values = {"element": _name(opening), "part": shade, "glazing": name}
                self.issues.append(Issue("glazing-part-not-read", guid, values))
        known = self._by_id["WindowType"].get(name)
        if known is None:
            known = self._by_id["Construction"].get(name)
        if known is None and name:
            self._missing("windowTypeIdRef", f"no WindowType {name!r:.60}", guid)
        if name not in self._windows:
            values = GlazingValues(name=name) if known is None else self._values(known)
            self._windows[name] = values
        of_type, own = self._windows[name], self._values(opening)  # the opening's own go first
        stated = {
            field: getattr(own, field) for field in ("u_value", "g_value", "visible", "solar")
        }
        return replace(of_type, **{field: v for field, v in stated.items() if v is not None})

    def _values(self, known: ElementTree.Element) -> GlazingValues:
        """What a window type states; where its U and g are both nought, it states nothing."""
        name, panes = _name(known), len(known.findall("Glaze")) or None
        g_value = self._share(known, "SolarHeatGainCoeff")
        u_value = self._quantity(known, "U-value") or None
        if u_value is None and g_value == 0:
            values = {"type": name}
            self.issues.append(Issue("window-type-of-zeros", known.get("id", ""), values))
            return GlazingValues(panes=panes, name=name)
        visible, solar = (self._share(known, "Transmittance", k) for k in ("Visible", "Solar"))
        unread = {one.tag for one in known if one.tag in PARTS}
        if None not in (u_value, g_value, visible):  # those of panes and gaps are not needed
            unread -= {"Glaze", "Gap"}
        for part in sorted(unread):
            values = {"element": name, "part": part, "glazing": known.get("id", "")}
            self.issues.append(Issue("glazing-part-not-read", known.get("id", ""), values))
        return GlazingValues(u_value, g_value, visible, solar, panes, name)

    def _quantity(self, owner: ElementTree.Element, name: str) -> float | None:
        """A quantity [SI]; None where it is not stated or cannot be read."""
        return self.document.optional(lambda: self.document.quantity(owner, name), self.issues)

    def _share(
        self, owner: ElementTree.Element, what: str, kind: str | None = None
    ) -> float | None:
        """A share of 1 of that kind at normal incidence; None as for `_quantity`."""
        return self.document.optional(lambda: self._stated(owner, what, kind), self.issues)

    def _stated(self, owner: ElementTree.Element, what: str, kind: str | None) -> float | None:
        """Raises: `DataError` where it is stated at other angles alone."""
        kinds = (kind, kind and kind.replace("Visible", "Vis"))  # of the schema, earlier exports
        stated = [one for one in owner.iterfind(what) if kind is None or one.get("type") in kinds]
        for one in stated:
            if {one.get(angle, "0") for angle in ANGLES} <= {"0", "0.0", ""}:
                return self._fraction(owner, one)
        if stated:
            raise self.document.fault("expected the value of normal incidence", owner, what)
        return None

    def _fraction(self, owner: ElementTree.Element, one: ElementTree.Element) -> float:
        """A number from 0 to 1, or in per cent."""
        value = self.document.number(one, least=0.0, most=100.0)
        unit = one.get("unit", "Fraction")
        if unit not in ("Fraction", "Percent"):
            message = f"unit {unit[:40]!r}, expected Fraction or Percent"
            raise self.document.fault(message, owner, one.tag)
        value = value / 100.0 if unit == "Percent" else value
        if value > 1:
            raise self.document.fault(f"expected 0 to 1, got {value:g}", owner, one.tag)
        return value


def _name(element: ElementTree.Element) -> str:
    return (element.findtext("Name") or "").strip() or element.get("id", "")
