"""Write the demo's building, a two-room office in IFC4: `python -m tests.demo.make_office [FILE]`.

Plan (metres, project coordinates; z = 0 is the finished floor, rooms are 3.0 high):

    y=6  +-----------------+--------------+
         |  A              |  B           |
         |  4.0 x 6.0     door  3.5 x 6.0 W   W: window of B, 2.0 x 1.5, faces east
         |                 |              |
    y=0  +----WWWWWWW------+--------------+
         x=0  W: window of A, 3.0 x 1.5, faces south      x=7.625

The project's north is turned by 10 degrees: true north is not +y, so the windows face 170
and 80 degrees from north, clockwise. The site is that of the demo's weather file.
"""

from __future__ import annotations

import argparse
import functools
import operator
import uuid
from dataclasses import dataclass
from pathlib import Path

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.georeference
import ifcopenshell.api.material
import ifcopenshell.api.project
import ifcopenshell.api.pset
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.style
import ifcopenshell.api.unit
import numpy as np
from numpy.typing import NDArray

from scenes.demo import OFFICE


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
        made = ifcopenshell.api.material.add_material(model, name=substance.name, category=substance.category)
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
        layers = ifcopenshell.api.material.add_material_set(model, name=name, set_type="IfcMaterialLayerSet")
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


Entity = ifcopenshell.entity_instance
Point = tuple[float, float]

FRAME_WIDTH, FRAME_DEPTH = 0.07, 0.08  # of a window's frame, seen and through the wall [m]
PANE = 0.024  # double glazing 4/16/4 [m]
REVEAL = 0.20  # from the wall's inner face to the frame: in the insulation's plane [m]


class Office:
    """One storey being furnished with building elements; all lengths in metres."""

    def __init__(
        self,
        model: ifcopenshell.file,
        storey: Entity,
        body: Entity,
        axis: Entity,
        *,
        palette: Palette | None = None,
        origin: Point = (0.0, 0.0),
    ) -> None:
        """Add to this storey, with bodies and axes in these contexts; heights from its elevation.

        Args: palette: of a storey made before, where there is one; origin: of plans on the site.
        """
        self._model, self._storey, self._body, self._axis = model, storey, body, axis
        self._shift = _shift(*origin, storey.Elevation or 0.0)
        self.palette = Palette(model) if palette is None else palette
        self._walls: dict[str, tuple[Entity, NDArray[np.float64], float]] = {}

    def slab(self, name: str, layers: str, outline: tuple[Point, ...], z: float, style: str):
        """A slab over the outline, its bottom at z: the ground floor or the roof."""
        kind = "ROOF" if layers == "Roof" else "BASESLAB"
        slab = self._element("IfcSlab", name, kind)
        solid = self._extruded(outline, thickness(layers))
        self._show(slab, [(solid, style)])
        self._place(slab, _frame((0.0, 0.0, z), (1.0, 0.0)))
        self._layered(slab, layers, "AXIS3")
        self._pset(
            slab, "Pset_SlabCommon", {"IsExternal": True, "LoadBearing": True, "ThermalTransmittance": u_value(layers)}
        )

    def wall(self, name: str, layers: str, start: Point, end: Point, height: float, style: str) -> None:
        """A wall whose reference line runs from start to end; its layers lie to the left."""
        run = np.subtract(end, start)
        length = float(np.hypot(*run))
        wall = self._element("IfcWall", name, "SOLIDWALL" if "wall" in name else "PARTITIONING")
        depth = thickness(layers)
        solid = self._extruded(_rectangle(0.0, 0.0, length, depth), height)
        self._show(wall, [(solid, style)])
        line = ifcopenshell.api.geometry.add_axis_representation(
            self._model, context=self._axis, axis=[(0.0, 0.0), (length, 0.0)]
        )
        ifcopenshell.api.geometry.assign_representation(self._model, product=wall, representation=line)
        frame = _frame((*start, 0.0), tuple(run / length))
        self._place(wall, frame)
        self._layered(wall, layers, "AXIS2")
        external = layers == "Outer wall"
        self._pset(
            wall,
            "Pset_WallCommon",
            {"IsExternal": external, "LoadBearing": external, "ThermalTransmittance": u_value(layers)},
        )
        self._walls[name] = (wall, frame, depth)

    def window(self, name: str, wall: str, along: float, sill: float, width: float, height: float) -> None:
        """A window in a wall: frame all round and one pane, behind an inner reveal."""
        opening, frame = self._opening(f"Opening of {name}", wall, along, sill, width, height)
        window = self._element("IfcWindow", name, "WINDOW")
        window.OverallWidth, window.OverallHeight = width, height
        window.PartitioningType = "SINGLE_PANEL"
        lining = self._ring(width, height, FRAME_WIDTH, FRAME_DEPTH)
        clear_width, clear_height = width - 2 * FRAME_WIDTH, height - 2 * FRAME_WIDTH
        middle = (FRAME_DEPTH - PANE) / 2
        pane = self._upright(FRAME_WIDTH, FRAME_WIDTH, clear_width, clear_height, middle, PANE)
        self._show(window, [(lining, "White frame"), (pane, "Clear glass")])
        self._place(window, frame @ _shift(0.0, REVEAL, 0.0))
        ifcopenshell.api.feature.add_filling(self._model, opening=opening, element=window)
        self._constituents(window, {"Lining": TIMBER, "Glazing": GLASS})
        area_fraction = clear_width * clear_height / (width * height)
        self._pset(
            window,
            "Pset_WindowCommon",
            {"IsExternal": True, "ThermalTransmittance": WINDOW_U, "GlazingAreaFraction": area_fraction},
        )
        self._pset(
            window,
            "Pset_DoorWindowGlazingType",
            {
                "GlassLayers": 2,
                "GlassThickness1": 0.004,
                "GlassThickness2": 0.004,
                "FillGas": "Argon",
                "IsTempered": False,
                "IsLaminated": False,
                "IsCoated": True,
                "VisibleLightTransmittance": GLAZING["visible"],
                "SolarTransmittance": GLAZING["solar"],
                "SolarHeatGainTransmittance": GLAZING["g"],
                "ThermalTransmittanceSummer": GLAZING["u"],
                "ThermalTransmittanceWinter": GLAZING["u"],
            },
        )
        self._quantities(window, "Qto_WindowBaseQuantities", {"Width": width, "Height": height, "Area": width * height})

    def door(self, name: str, wall: str, along: float, width: float, height: float) -> None:
        """A single-leaf inner door in a wall, its leaf in the middle of the wall."""
        opening, frame = self._opening(f"Opening of {name}", wall, along, 0.0, width, height)
        door = self._element("IfcDoor", name, "DOOR")
        door.OverallWidth, door.OverallHeight = width, height
        door.OperationType = "SINGLE_SWING_LEFT"
        leaf = 0.04
        self._show(door, [(self._upright(0.0, 0.0, width, height, 0.0, leaf), "Beech door")])
        middle = (self._walls[wall][2] - leaf) / 2
        self._place(door, frame @ _shift(0.0, middle, 0.0))
        ifcopenshell.api.feature.add_filling(self._model, opening=opening, element=door)
        self._constituents(door, {"Leaf": TIMBER})
        self._pset(door, "Pset_DoorCommon", {"IsExternal": False, "ThermalTransmittance": 2.0})

    def space(self, name: str, long_name: str, low: Point, high: Point, height: float) -> Entity:
        """A rectangular room from the inner faces of its walls, floor and ceiling."""
        width, depth = np.subtract(high, low)
        space = ifcopenshell.api.root.create_entity(
            self._model, ifc_class="IfcSpace", name=name, predefined_type="INTERNAL"
        )
        space.LongName = long_name
        ifcopenshell.api.aggregate.assign_object(self._model, products=[space], relating_object=self._storey)
        self._show(space, [(self._extruded(_rectangle(0, 0, width, depth), height), None)])
        self._place(space, _frame((*low, 0.0), (1.0, 0.0)))
        area = float(width * depth)
        self._pset(space, "Pset_SpaceCommon", {"Reference": "office", "IsExternal": False})
        self._pset(space, "Pset_SpaceOccupancyRequirements", {"OccupancyNumber": 2})
        self._quantities(
            space,
            "Qto_SpaceBaseQuantities",
            {
                "Height": height,
                "NetFloorArea": area,
                "GrossFloorArea": area,
                "NetVolume": area * height,
                "NetPerimeter": float(2 * (width + depth)),
            },
        )
        return space

    def desk(self, name: str, space: Entity, corner: NDArray[np.float64]) -> None:
        """A desk 1.6 x 0.8 x 0.74 m: a top and two side panels."""
        desk = ifcopenshell.api.root.create_entity(
            self._model, ifc_class="IfcFurniture", name=name, predefined_type="DESK"
        )
        ifcopenshell.api.spatial.assign_container(self._model, products=[desk], relating_structure=space)
        top = self._extruded(_rectangle(0.0, 0.0, 1.6, 0.8), 0.03, z=0.71)
        sides = [self._extruded(_rectangle(x, 0.05, 0.03, 0.7), 0.71) for x in (0.05, 1.52)]
        self._show(desk, [(solid, "Beech desk") for solid in (top, *sides)])
        self._place(desk, _frame(tuple(corner), (1.0, 0.0)))

    def _opening(
        self, name: str, wall: str, along: float, sill: float, width: float, height: float
    ) -> tuple[Entity, NDArray[np.float64]]:
        """The opening through a wall, and the frame of its lower corner on the reference line."""
        host, wall_frame, depth = self._walls[wall]
        frame = wall_frame @ _shift(along, 0.0, sill)
        opening = ifcopenshell.api.root.create_entity(
            self._model, ifc_class="IfcOpeningElement", name=name, predefined_type="OPENING"
        )
        self._show(opening, [(self._upright(0.0, 0.0, width, height, 0.0, depth), None)])
        self._place(opening, frame)
        ifcopenshell.api.feature.add_feature(self._model, feature=opening, element=host)
        return opening, frame

    def _element(self, ifc_class: str, name: str, kind: str) -> Entity:
        made = ifcopenshell.api.root.create_entity(self._model, ifc_class=ifc_class, name=name, predefined_type=kind)
        ifcopenshell.api.spatial.assign_container(self._model, products=[made], relating_structure=self._storey)
        return made

    def _place(self, product: Entity, frame: NDArray[np.float64]) -> None:
        ifcopenshell.api.geometry.edit_object_placement(self._model, product=product, matrix=self._shift @ frame)

    def _layered(self, product: Entity, layers: str, direction: str) -> None:
        """The layer set, from the reference line in the positive direction."""
        ifcopenshell.api.material.assign_material(
            self._model, products=[product], type="IfcMaterialLayerSetUsage", material=self.palette.layer_set(layers)
        )
        usage = product.HasAssociations[0].RelatingMaterial
        usage.LayerSetDirection, usage.DirectionSense = direction, "POSITIVE"
        usage.OffsetFromReferenceLine = 0.0

    def _constituents(self, product: Entity, parts: dict[str, object]) -> None:
        constituents = ifcopenshell.api.material.add_material_set(
            self._model, name=product.Name, set_type="IfcMaterialConstituentSet"
        )
        for name, substance in parts.items():
            ifcopenshell.api.material.add_constituent(
                self._model, constituent_set=constituents, name=name, material=self.palette.material(substance)
            )
        ifcopenshell.api.material.assign_material(
            self._model, products=[product], type="IfcMaterialConstituentSet", material=constituents
        )

    def _pset(self, product: Entity, name: str, properties: dict[str, object]) -> None:
        pset = ifcopenshell.api.pset.add_pset(self._model, product=product, name=name)
        ifcopenshell.api.pset.edit_pset(self._model, pset=pset, properties=properties)

    def _quantities(self, product: Entity, name: str, quantities: dict[str, float]) -> None:
        qto = ifcopenshell.api.pset.add_qto(self._model, product=product, name=name)
        ifcopenshell.api.pset.edit_qto(self._model, qto=qto, properties=quantities)

    def _show(self, product: Entity, solids: list[tuple[Entity, str | None]]) -> None:
        """Give a product its body, each solid with its surface style."""
        model = self._model
        body = model.create_entity("IfcShapeRepresentation", self._body, "Body", "SweptSolid", [s for s, _ in solids])
        ifcopenshell.api.geometry.assign_representation(model, product=product, representation=body)
        for solid, style in solids:
            if style is not None:
                ifcopenshell.api.style.assign_item_style(model, item=solid, style=self.palette.style(style))

    def _extruded(self, outline: tuple[Point, ...], height: float, z: float = 0.0) -> Entity:
        """The prism over a horizontal outline, from z upwards."""
        return self._solid(self._profile(self._polyline(outline)), height, (0.0, 0.0, z), upright=False)

    def _upright(self, x: float, z: float, width: float, height: float, y: float, depth: float) -> Entity:
        """The box over an upright rectangle of the x-z plane, from y in the direction of +y."""
        profile = self._profile(self._polyline(_rectangle(x, z, width, height)))
        return self._solid(profile, depth, (0.0, y, 0.0), upright=True)

    def _ring(self, width: float, height: float, border: float, depth: float) -> Entity:
        """A frame of the x-z plane, from y = 0 in the direction of +y."""
        inner = _rectangle(border, border, width - 2 * border, height - 2 * border)
        profile = self._model.create_entity(
            "IfcArbitraryProfileDefWithVoids",
            "AREA",
            None,
            self._polyline(_rectangle(0.0, 0.0, width, height)),
            [self._polyline(inner)],
        )
        return self._solid(profile, depth, (0.0, 0.0, 0.0), upright=True)

    def _solid(self, profile: Entity, depth: float, origin: tuple[float, ...], *, upright: bool) -> Entity:
        """The profile swept along +z, or, put upright (its y up), along +y."""
        make = self._model.create_entity
        axis = (0.0, -1.0, 0.0) if upright else (0.0, 0.0, 1.0)
        position = make(
            "IfcAxis2Placement3D",
            make("IfcCartesianPoint", [float(value) for value in origin]),
            make("IfcDirection", axis),
            make("IfcDirection", (1.0, 0.0, 0.0)),
        )
        sweep = (0.0, 0.0, -1.0) if upright else (0.0, 0.0, 1.0)
        return make("IfcExtrudedAreaSolid", profile, position, make("IfcDirection", sweep), depth)

    def _profile(self, curve: Entity) -> Entity:
        return self._model.create_entity("IfcArbitraryClosedProfileDef", "AREA", None, curve)

    def _polyline(self, outline: tuple[Point, ...]) -> Entity:
        points = [self._model.create_entity("IfcCartesianPoint", [float(x), float(y)]) for x, y in outline]
        return self._model.create_entity("IfcPolyline", [*points, points[0]])


def _rectangle(x: float, y: float, width: float, height: float) -> tuple[Point, ...]:
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))


def _frame(origin: tuple[float, ...], along: tuple[float, ...]) -> NDArray[np.float64]:
    """[4, 4] placement with local x along a horizontal direction and z up."""
    matrix = np.eye(4)
    matrix[:2, 0] = along
    matrix[:2, 1] = -along[1], along[0]
    matrix[:3, 3] = origin
    return matrix


def _shift(x: float, y: float, z: float) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


HEIGHT = 3.0
DEPTH = 6.0
WIDTH_A, WIDTH_B = 4.0, 3.5
TRUE_NORTH_DEG = -10.0  # angle of true north from +y, counter-clockwise: it lies towards +x
LATITUDE, LONGITUDE, ELEVATION = (41, 58, 48, 0), (-87, -55, -12, 0), 201.0  # O'Hare, as the EPW
NAMESPACE = uuid.UUID("6f0b5f0e-9d1c-4c57-8f5b-5a3c2c0d7a11")  # of the repeatable GlobalIds


def office() -> ifcopenshell.file:
    """The whole model; the same entities with the same GlobalIds at every call."""
    model = ifcopenshell.api.project.create_file(version="IFC4")
    storey, body, axis = project(model)
    parts = Office(model, storey, body, axis)
    _structure(parts)
    _openings(parts)
    _rooms(parts)
    _fix_identity(model)
    return model


def project(model: ifcopenshell.file) -> tuple[ifcopenshell.entity_instance, ...]:
    """The ground floor and the contexts of bodies and axes of a project on the demo's site."""
    create = ifcopenshell.api.root.create_entity
    project = create(model, ifc_class="IfcProject", name="mitsuba-cfs demo office")
    units = [
        ifcopenshell.api.unit.add_si_unit(model, unit_type=kind)
        for kind in ("LENGTHUNIT", "AREAUNIT", "VOLUMEUNIT", "PLANEANGLEUNIT", "THERMODYNAMICTEMPERATUREUNIT")
    ]
    ifcopenshell.api.unit.assign_unit(model, units=units)
    project.UnitsInContext.Units = units  # assigned as a set, in an order of their own
    add_context = ifcopenshell.api.context.add_context
    whole = add_context(model, context_type="Model")
    plan = add_context(model, context_type="Plan")
    body = add_context(model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=whole)
    axis = add_context(model, context_type="Plan", context_identifier="Axis", target_view="GRAPH_VIEW", parent=plan)
    ifcopenshell.api.georeference.edit_true_north(model, true_north=TRUE_NORTH_DEG)
    site = create(model, ifc_class="IfcSite", name="Site")
    site.RefLatitude, site.RefLongitude, site.RefElevation = LATITUDE, LONGITUDE, ELEVATION
    building = create(model, ifc_class="IfcBuilding", name="Office")
    storey = create(model, ifc_class="IfcBuildingStorey", name="Ground floor")
    storey.Elevation = 0.0
    for child, parent in ((site, project), (building, site), (storey, building)):
        ifcopenshell.api.aggregate.assign_object(model, products=[child], relating_object=parent)
    return storey, body, axis


def _structure(parts: Office) -> None:
    """Slabs and walls; a wall's reference line is its inner face, its layers go outwards."""
    wall, partition = thickness("Outer wall"), thickness("Partition")
    width = WIDTH_A + partition + WIDTH_B
    outline = ((-wall, -wall), (width + wall, -wall), (width + wall, DEPTH + wall), (-wall, DEPTH + wall))
    parts.slab("Floor", "Ground floor", outline, -thickness("Ground floor"), "Grey floor")
    parts.slab("Roof", "Roof", outline, HEIGHT, "White ceiling")
    corners = {
        "South wall": ((width + wall, 0.0), (-wall, 0.0)),
        "West wall": ((0.0, 0.0), (0.0, DEPTH)),
        "North wall": ((-wall, DEPTH), (width + wall, DEPTH)),
        "East wall": ((width, DEPTH), (width, 0.0)),
    }
    for name, (start, end) in corners.items():
        parts.wall(name, "Outer wall", start, end, HEIGHT, "White wall")
    start, end = (WIDTH_A + partition, 0.0), (WIDTH_A + partition, DEPTH)
    parts.wall("Partition A-B", "Partition", start, end, HEIGHT, "Light partition")


def _openings(parts: Office) -> None:
    """Windows and door; `along` is measured from the start of the wall's reference line."""
    wall, partition = thickness("Outer wall"), thickness("Partition")
    width = WIDTH_A + partition + WIDTH_B
    parts.window("Window A", "South wall", width + wall - 3.5, 0.9, 3.0, 1.5)
    parts.window("Window B", "East wall", DEPTH - 4.0, 0.9, 2.0, 1.5)
    parts.door("Door A-B", "Partition A-B", 4.5, 0.9, 2.1)


def _rooms(parts: Office) -> None:
    left = WIDTH_A + thickness("Partition")
    room_a = parts.space("A", "South office", (0.0, 0.0), (WIDTH_A, DEPTH), HEIGHT)
    parts.space("B", "East office", (left, 0.0), (left + WIDTH_B, DEPTH), HEIGHT)
    parts.desk("Desk A", room_a, np.array([1.2, 1.0, 0.0]))


def _fix_identity(model: ifcopenshell.file) -> None:
    """Give every entity a GlobalId that depends on its place in the file; fix order and date."""
    for relation in model.by_type("IfcRelationship"):
        for name in ("RelatedElements", "RelatedObjects"):
            if hasattr(relation, name):
                ordered = sorted(getattr(relation, name), key=lambda entity: entity.id())
                setattr(relation, name, ordered)
    for number, root in enumerate(model.by_type("IfcRoot")):
        name = f"{number} {root.is_a()} {root.Name}"
        root.GlobalId = ifcopenshell.guid.compress(uuid.uuid5(NAMESPACE, name).hex)
    header = model.header.file_name
    header.name = "office.ifc"
    header.time_stamp = "2026-01-01T00:00:00"
    header.author = ("mitsuba-cfs contributors",)
    header.organization = ("mitsuba-cfs",)
    header.originating_system = "tests/demo/make_office.py"


def main() -> None:
    """Write the model to the file named, by default the one that is shipped."""
    parser = argparse.ArgumentParser(description="Write the demo's building, a two-room office.")
    parser.add_argument("file", type=Path, nargs="?", default=OFFICE)
    target = parser.parse_args().file
    office().write(str(target))
    print(f"{target}: two rooms")


if __name__ == "__main__":
    main()
