"""The demo office's constructions, reflectances and glass, as data and as IFC entities."""

from __future__ import annotations

import functools
import operator
from dataclasses import dataclass

import ifcopenshell
import ifcopenshell.api.material
import ifcopenshell.api.pset
import ifcopenshell.api.style

Entity = ifcopenshell.entity_instance


@dataclass(frozen=True, slots=True)
class Substance:
    """A building material with its design values."""

    name: str
    category: str
    conductivity: float  # [W/(m K)]
    density: float  # [kg/m3]
    heat_capacity: float  # [J/(kg K)]


# Design values of EN ISO 10456:2007, table 3.
PLASTER = Substance("Gypsum plaster", "gypsum", 0.57, 1300.0, 1000.0)
GYPSUM_BOARD = Substance("Gypsum plasterboard", "gypsum", 0.25, 900.0, 1000.0)
CONCRETE = Substance("Reinforced concrete", "concrete", 2.3, 2300.0, 1000.0)
MINERAL_WOOL = Substance("Mineral wool", "insulation", 0.036, 90.0, 1030.0)
INSULATION = Substance("Expanded polystyrene", "insulation", 0.035, 20.0, 1450.0)
RENDER = Substance("Cement render", "render", 1.0, 1800.0, 1000.0)
SCREED = Substance("Cement screed", "screed", 1.4, 2000.0, 1000.0)
BITUMEN = Substance("Bitumen sheet", "membrane", 0.23, 1100.0, 1000.0)
TIMBER = Substance("Softwood", "wood", 0.13, 500.0, 1600.0)
GLASS = Substance("Glass", "glass", 1.0, 2500.0, 750.0)

# From the reference line on: from the room outwards, for the partition from room B to A,
# for slabs upwards from the bottom. Thickness in metres.
LAYERS: dict[str, tuple[tuple[Substance, float], ...]] = {
    "Outer wall": ((PLASTER, 0.015), (CONCRETE, 0.18), (MINERAL_WOOL, 0.16), (RENDER, 0.015)),
    "Partition": ((GYPSUM_BOARD, 0.025), (MINERAL_WOOL, 0.075), (GYPSUM_BOARD, 0.025)),
    "Ground floor": ((INSULATION, 0.12), (CONCRETE, 0.20), (SCREED, 0.06)),
    "Roof": ((PLASTER, 0.01), (CONCRETE, 0.20), (INSULATION, 0.20), (BITUMEN, 0.01)),
}
SURFACE_RESISTANCES = 0.17  # of a wall, both sides, EN ISO 6946:2017, table 7 [m2 K/W]

# Diffuse reflectance of the visible faces. Written as greys in sRGB (IEC 61966-2-1), as viewers
# show colours: the same in R, G and B, so that no weighting of the three matters.
REFLECTANCES = {
    "White wall": 0.5,
    "Light partition": 0.6,
    "White ceiling": 0.8,
    "Grey floor": 0.3,
    "White frame": 0.7,
    "Beech door": 0.4,
    "Beech desk": 0.4,
}
# Double glazing with a low-emissivity coating: U of the pane, g and tau of a usual product.
GLAZING = {"u": 1.1, "g": 0.62, "visible": 0.80, "solar": 0.53}
WINDOW_U = 1.3  # whole window [W/(m2 K)]


def thickness(name: str) -> float:
    """Thickness of a construction of `LAYERS` [m]."""
    return sum(depth for _, depth in LAYERS[name])


def u_value(name: str) -> float:
    """Thermal transmittance of a construction of `LAYERS` [W/(m2 K)], EN ISO 6946."""
    # `sum` adds with compensation from Python 3.12 on: the file's last digits would differ
    layers = (depth / substance.conductivity for substance, depth in LAYERS[name])
    resistance = functools.reduce(operator.add, layers)
    return 1.0 / (SURFACE_RESISTANCES + resistance)


def display_value(linear: float) -> float:
    """The sRGB value, 0 to 1, that shows a linear one: the transfer function of IEC 61966-2-1."""
    if linear <= 0.0031308:
        return 12.92 * linear
    return 1.055 * linear ** (1 / 2.4) - 0.055


class Palette:
    """The materials, layer sets and surface styles of one IFC file, each made at first use."""

    def __init__(self, model: ifcopenshell.file) -> None:
        """Start without any entity in the file."""
        self._model = model
        self._materials: dict[str, Entity] = {}
        self._layer_sets: dict[str, Entity] = {}
        self._styles: dict[str, Entity] = {}

    def material(self, substance: Substance) -> Entity:
        """The IfcMaterial with its Pset_MaterialCommon and Pset_MaterialThermal."""
        if substance.name not in self._materials:
            self._materials[substance.name] = self._new_material(substance)
        return self._materials[substance.name]

    def layer_set(self, name: str) -> Entity:
        """The IfcMaterialLayerSet of a construction of `LAYERS`."""
        if name not in self._layer_sets:
            self._layer_sets[name] = self._new_layer_set(name)
        return self._layer_sets[name]

    def style(self, name: str) -> Entity:
        """The IfcSurfaceStyle of `REFLECTANCES`, or "Clear glass"."""
        if name not in self._styles:
            glass = name == "Clear glass"
            reflectance = 0.9 if glass else REFLECTANCES[name]
            self._styles[name] = self._new_style(name, display_value(reflectance), glass)
        return self._styles[name]

    def _new_material(self, substance: Substance) -> Entity:
        model = self._model
        made = ifcopenshell.api.material.add_material(
            model, name=substance.name, category=substance.category
        )
        properties = {
            "Pset_MaterialCommon": {"MassDensity": substance.density},
            "Pset_MaterialThermal": {
                "ThermalConductivity": substance.conductivity,
                "SpecificHeatCapacity": substance.heat_capacity,
            },
        }
        for name, values in properties.items():
            pset = ifcopenshell.api.pset.add_pset(model, product=made, name=name)
            ifcopenshell.api.pset.edit_pset(model, pset=pset, properties=values)
        return made

    def _new_layer_set(self, name: str) -> Entity:
        model = self._model
        layers = ifcopenshell.api.material.add_material_set(
            model, name=name, set_type="IfcMaterialLayerSet"
        )
        for substance, depth in LAYERS[name]:
            layer = ifcopenshell.api.material.add_layer(
                model, layer_set=layers, material=self.material(substance), name=substance.name
            )
            ifcopenshell.api.material.edit_layer(
                model, layer=layer, attributes={"LayerThickness": depth, "IsVentilated": False}
            )
        return layers

    def _new_style(self, name: str, grey: float, glass: bool) -> Entity:
        model = self._model
        colour = {"Name": None, "Red": grey, "Green": grey, "Blue": grey}
        style = ifcopenshell.api.style.add_style(model, name=name)
        ifcopenshell.api.style.add_surface_style(
            model,
            style=style,
            ifc_class="IfcSurfaceStyleRendering",
            attributes={
                "SurfaceColour": colour,
                "Transparency": 1.0 - 0.2 if glass else 0.0,
                "ReflectanceMethod": "GLASS" if glass else "MATT",
            },
        )
        return style
