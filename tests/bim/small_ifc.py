"""A box-shaped room as an IFC file, sound or with a defect planted, in either schema."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.material
import ifcopenshell.api.owner
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.style
import ifcopenshell.api.unit
import numpy as np

WIDTH, DEPTH, HEIGHT, WALL = 4.0, 6.0, 3.0, 0.3  # of the room and its walls [m]
OPENING = (0.5, 0.9, 3.0, 1.5)  # x, sill, width, height of the window in the south wall [m]
FRAME = 0.1  # width of the window's frame [m]
GLASS_AREA = (3.0 - 0.2) * (1.5 - 0.2)
GLASS_Y = -0.15  # of the middle of the pane: the middle of the south wall [m]
WALLS = {  # name: low corner, size
    "south": ((-WALL, -WALL, 0.0), (WIDTH + 2 * WALL, WALL, HEIGHT)),
    "north": ((-WALL, DEPTH, 0.0), (WIDTH + 2 * WALL, WALL, HEIGHT)),
    "west": ((-WALL, 0.0, 0.0), (WALL, DEPTH, HEIGHT)),
    "east": ((WIDTH, 0.0, 0.0), (WALL, DEPTH, HEIGHT)),
}


@dataclass
class SmallIfc:
    """A model being made; `box` adds a product with a box-shaped body."""

    model: ifcopenshell.file
    body: ifcopenshell.entity_instance
    storey: ifcopenshell.entity_instance
    scale: float  # model units per metre

    def box(self, ifc_class: str, name: str, low, size, style=None, **attributes):
        """A product whose body is a box; numbers in metres."""
        product = ifcopenshell.api.root.create_entity(self.model, ifc_class=ifc_class, name=name)
        self.show(product, [(low, size, style)])
        if ifc_class == "IfcSpace":
            ifcopenshell.api.aggregate.assign_object(self.model, products=[product], relating_object=self.storey)
        elif ifc_class != "IfcOpeningElement":
            ifcopenshell.api.spatial.assign_container(self.model, products=[product], relating_structure=self.storey)
        for key, value in attributes.items():
            setattr(product, key, value)
        return product

    def show(self, product, boxes) -> None:
        """Give the product a body of boxes (low corner, size, style or None)."""
        items = []
        for low, size, style in boxes:
            item = self._solid(np.array(low) * self.scale, np.array(size) * self.scale)
            if style is not None:
                ifcopenshell.api.style.assign_item_style(self.model, item=item, style=style)
            items.append(item)
        representation = self.model.create_entity("IfcShapeRepresentation", self.body, "Body", "SweptSolid", items)
        ifcopenshell.api.geometry.edit_object_placement(self.model, product=product)
        product.Representation = self.model.create_entity("IfcProductDefinitionShape", Representations=[representation])

    def _solid(self, low, size):
        create, point = self.model.create_entity, self._point
        x, y, z = (float(value) for value in size)
        profile = create(
            "IfcRectangleProfileDef",
            "AREA",
            None,
            create("IfcAxis2Placement2D", create("IfcCartesianPoint", (x / 2, y / 2))),
            x,
            y,
        )
        position = create("IfcAxis2Placement3D", point(low))
        up = create("IfcDirection", (0.0, 0.0, 1.0))
        return create("IfcExtrudedAreaSolid", profile, position, up, z)

    def _point(self, values):
        return self.model.create_entity("IfcCartesianPoint", tuple(float(v) for v in values))

    def style(self, name: str, grey: float, transparency: float = 0.0, *, linear: bool = True):
        """A surface style; linear: the grey is a reflection coefficient, not a screen value."""
        style = ifcopenshell.api.style.add_style(self.model, name=name)
        rgb = {"Name": None, "Red": grey, "Green": grey, "Blue": grey}
        attributes = {"SurfaceColour": rgb, "Transparency": transparency, "ReflectanceMethod": "MATT"}
        if linear:
            attributes["DiffuseColour"] = dict(rgb)
        ifcopenshell.api.style.add_surface_style(
            self.model, style=style, ifc_class="IfcSurfaceStyleRendering", attributes=attributes
        )
        return style

    def opening(self, wall, place, name: str = "opening", *, size=None, axes: bool = False):
        """An opening through the south wall; with `axes` a box: low corner `place`, and `size`."""
        low = place
        if not axes:
            x, sill, width, height = place
            low, size = (x, -WALL - 0.1, sill), (width, WALL + 0.2, height)
        opening = self.box("IfcOpeningElement", name, low, size)
        ifcopenshell.api.feature.add_feature(self.model, feature=opening, element=wall)
        return opening

    def window(
        self,
        wall,
        *,
        shift: float = 0.0,
        hosted: bool = True,
        glazed: bool = True,
        name: str = "W1",
        place: tuple[float, ...] = OPENING,
    ):
        """A window of the south wall, its body moved by `shift` along the wall."""
        x, sill, width, height = place
        opening = self.opening(wall, place) if hosted else None
        window = ifcopenshell.api.root.create_entity(self.model, ifc_class="IfcWindow", name=name)
        frame = self.style("frame", 0.7)
        pane = self.style("glass", 0.9, 0.8) if glazed else frame
        left, y, inner = x + shift, GLASS_Y, (width - 2 * FRAME, height - 2 * FRAME)
        self.show(
            window,
            [
                ((left, y - 0.03, sill), (FRAME, 0.06, height), frame),
                ((left + width - FRAME, y - 0.03, sill), (FRAME, 0.06, height), frame),
                ((left + FRAME, y - 0.03, sill), (inner[0], 0.06, FRAME), frame),
                ((left + FRAME, y - 0.03, sill + height - FRAME), (inner[0], 0.06, FRAME), frame),
                ((left + FRAME, y - 0.01, sill + FRAME), (inner[0], 0.02, inner[1]), pane),
            ],
        )
        ifcopenshell.api.spatial.assign_container(self.model, products=[window], relating_structure=self.storey)
        if opening is not None:
            ifcopenshell.api.feature.add_filling(self.model, opening=opening, element=window)
        return window


def empty_project(
    schema: str = "IFC4", *, unit: str = "METRE", true_north: tuple[float, float] | None = (0.0, 1.0)
) -> SmallIfc:
    """A project with one storey; unit "METRE", "MILLIMETRE" or "wrong": metres said, mm drawn."""
    model = ifcopenshell.file(schema=schema)
    _sign(model)
    project = ifcopenshell.api.root.create_entity(model, ifc_class="IfcProject", name="small")
    prefix = {"length": {"is_metric": True, "raw": "MILLIMETERS"}}
    metre = {"length": {"is_metric": True, "raw": "METERS"}}
    ifcopenshell.api.unit.assign_unit(model, **(prefix if unit == "MILLIMETRE" else metre))
    context = ifcopenshell.api.context.add_context(model, context_type="Model")
    if true_north is not None:
        context.TrueNorth = model.create_entity("IfcDirection", true_north)
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context
    )
    parts = [
        ifcopenshell.api.root.create_entity(model, ifc_class=name, name=name)
        for name in ("IfcSite", "IfcBuilding", "IfcBuildingStorey")
    ]
    for child, parent in zip(parts, [project, *parts], strict=False):
        ifcopenshell.api.aggregate.assign_object(model, products=[child], relating_object=parent)
    parts[0].RefLatitude, parts[0].RefLongitude = (48, 30, 0, 0), (-7, -30, 0, 0)
    parts[2].Elevation = 0.0
    ifcopenshell.api.geometry.edit_object_placement(model, product=parts[2])
    scale = {"METRE": 1.0, "MILLIMETRE": 1000.0, "wrong": 1000.0}[unit]
    return SmallIfc(model, body, parts[2], scale)


def _sign(model: ifcopenshell.file) -> None:
    """The author that IFC2X3 demands."""
    person = ifcopenshell.api.owner.add_person(model)
    organisation = ifcopenshell.api.owner.add_organisation(model)
    ifcopenshell.api.owner.add_person_and_organisation(model, person=person, organisation=organisation)
    ifcopenshell.api.owner.add_application(model)


def box_room(
    schema: str = "IFC4",
    *,
    unit: str = "METRE",
    true_north: tuple[float, float] | None = (0.0, 1.0),
    space: bool = True,
    space_inset: float = 0.0,
    gap: float = 0.0,
    shift: float = 0.0,
    hosted: bool = True,
    glazed: bool = True,
    doubled_wall: bool = False,
    slab_as_wall: bool = False,
    window: bool = True,
    places: Sequence[tuple[float, ...]] = (OPENING,),
    post: bool = False,
) -> ifcopenshell.file:
    """The file of `box_model`: a room of 4 x 6 x 3 m with one window to the south."""
    return box_model(**locals())[0].model


def box_model(
    schema: str = "IFC4",
    *,
    unit: str = "METRE",
    true_north: tuple[float, float] | None = (0.0, 1.0),
    space: bool = True,
    space_inset: float = 0.0,
    space_height: float = HEIGHT,
    gap: float = 0.0,
    shift: float = 0.0,
    hosted: bool = True,
    glazed: bool = True,
    doubled_wall: bool = False,
    slab_as_wall: bool = False,
    window: bool = True,
    places: Sequence[tuple[float, ...]] = (OPENING,),
    post: bool = False,
    roof: bool = True,
    upper: bool = False,
) -> tuple[SmallIfc, dict]:
    """The model and its walls by name; each argument plants a defect.

    Args:
        space_inset: how far the space stops short of the walls [m].
        gap: width of a slit from floor to roof between the south and the east wall [m].
        places: of the windows W1, W2, ... in the south wall.
        shift: how far the window's body lies beside its opening [m].
        post: whether a thin post stands beside the house.
        upper: whether a storey of the same walls stands on it, with a window and without a space.
    """
    small = empty_project(schema, unit=unit, true_north=true_north)
    grey = small.style("wall", 0.5)
    walls = {}
    for name, (low, size) in WALLS.items():
        if name == "east":
            low, size = (low[0], low[1] + gap, low[2]), (size[0], size[1] - gap, size[2])
        walls[name] = small.box("IfcWall", name, low, size, grey)
    if post:
        small.box("IfcColumn", "post", (-2.0, 1.0, 0.0), (0.1, 0.1, HEIGHT))
    if doubled_wall:
        small.box("IfcWall", "south again", *WALLS["south"], grey)
    slab = "IfcWall" if slab_as_wall else "IfcSlab"
    outline = (WIDTH + 2 * WALL, DEPTH + 2 * WALL, 0.2)
    small.box(slab, "floor", (-WALL, -WALL, -0.2), outline, small.style("floor", 0.3))
    if roof:
        small.box("IfcSlab", "roof", (-WALL, -WALL, HEIGHT), outline, small.style("ceiling", 0.8))
    if window:
        for number, place in enumerate(places, 1):
            small.window(walls["south"], shift=shift, hosted=hosted, glazed=glazed, name=f"W{number}", place=place)
    if space:
        low = (space_inset, space_inset, 0.0)
        size = (WIDTH - 2 * space_inset, DEPTH - 2 * space_inset, space_height)
        small.box("IfcSpace", "R1", low, size, LongName="Room")
    if upper:
        _upper_storey(small, grey, outline)
    return small, walls


def _upper_storey(small: SmallIfc, grey, outline) -> None:
    """Walls, a window and a roof on top of the room, on a storey of their own."""
    above = HEIGHT + 0.2
    storey = ifcopenshell.api.root.create_entity(small.model, ifc_class="IfcBuildingStorey", name="attic")
    building = small.model.by_type("IfcBuilding")[0]
    ifcopenshell.api.aggregate.assign_object(small.model, products=[storey], relating_object=building)
    ifcopenshell.api.geometry.edit_object_placement(small.model, product=storey)
    storey.Elevation = above
    small.storey = storey
    for name, (low, size) in WALLS.items():
        wall = small.box("IfcWall", f"upper {name}", (*low[:2], above), size, grey)
        if name == "south":
            x, sill, width, height = OPENING
            small.window(wall, name="W above", place=(x, sill + above, width, height))
    small.box("IfcSlab", "upper roof", (-WALL, -WALL, above + HEIGHT), outline, grey)


def add_material(model: ifcopenshell.file, product, name: str) -> None:
    """Give the product one material."""
    material = ifcopenshell.api.material.add_material(model, name=name)
    ifcopenshell.api.material.assign_material(model, products=[product], material=material)
