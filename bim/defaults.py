"""Optical and thermal properties where the model states none: one table, each row with its source.

Reflectances.  Room: EN 17037:2018, B.3 and IES LM-83-12, 2.2.6 (ceiling 0.7, walls 0.5, floor 0.2);
facades outdoors 0.3, frames and furniture 0.5: IES LM-83-12.  Glass of other windows seen
from outdoors: near normal reflectance of clear double glazing, 0.15 (Fresnel, four surfaces of
n = 1.52).
Solar reflectance equals the visible one where nothing is known; emissivity 0.9 as in EN ISO 6946
for ordinary building surfaces.

Layers: design values of EN ISO 10456:2007, table 3.  Thicknesses are ours: a heavy building with
insulation of the first energy standards; each use is reported as a issue of the model.
"""

from __future__ import annotations

from dataclasses import replace

from bim.model import Construction, MaterialLayer
from mitsuba_cfs.gloss import pane

ROOM_REFLECTANCE = {
    "floor": 0.2,
    "ceiling": 0.7,
    "roof": 0.7,
    "wall": 0.5,
    "door": 0.5,
    "window frame": 0.5,
    "reveal": 0.5,
}
FACADE_REFLECTANCE = 0.3
FURNITURE_REFLECTANCE = 0.5
SITE_REFLECTANCE = 0.2  # EN 17037:2018, B.3: ground outdoors
GLASS_REFLECTANCE = 0.15
TREE_LAYER = "tree crown"  # of elements that are leaves
CLEAR_GLAZING = pane(transmissivity=0.985, panes=2)  # what that glazing mirrors, 0.15 straight on
EMISSIVITY = 0.9
FRAME_FRACTION = 0.3  # of the opening: EN ISO 10077-1:2017, annex (typical window, 30 % frame)
GAP_RESISTANCE = 0.18  # of an unventilated air layer of 25 mm and more: EN ISO 6946:2017 [m2 K/W]
LOWEST_REFLECTANCE, HIGHEST_REFLECTANCE = 0.02, 0.9  # black paint; fresh white paint

PLASTER = MaterialLayer("gypsum plaster", 0.015, 0.57, 1300.0, 1000.0)
BRICK = MaterialLayer("brick masonry", 0.24, 0.80, 1800.0, 1000.0)
CONCRETE = MaterialLayer("reinforced concrete", 0.20, 2.3, 2300.0, 1000.0)
INSULATION = MaterialLayer("mineral wool", 0.12, 0.040, 50.0, 1030.0)
RENDER = MaterialLayer("cement render", 0.015, 1.0, 1800.0, 1000.0)
SCREED = MaterialLayer("cement screed", 0.05, 1.4, 2000.0, 1000.0)
EPS = MaterialLayer("expanded polystyrene", 0.10, 0.040, 20.0, 1450.0)
TIMBER = MaterialLayer("softwood", 0.04, 0.13, 500.0, 1600.0)
FRAME = MaterialLayer("window frame, softwood", 0.068, 0.13, 500.0, 1600.0)

EXTERIOR_WALL = Construction("default exterior wall", (RENDER, INSULATION, BRICK, PLASTER))
INTERIOR_WALL = Construction("default interior wall", (PLASTER, BRICK, PLASTER))
GROUND_FLOOR = Construction("default ground floor", (EPS, CONCRETE, SCREED))
UPPER_FLOOR = Construction("default floor slab", (CONCRETE, SCREED))
CEILING_SLAB = Construction("default ceiling slab", (SCREED, CONCRETE))
ROOF = Construction("default roof", (INSULATION, CONCRETE, PLASTER))
DOOR = Construction("default door", (TIMBER,))
WINDOW_FRAME = Construction("default window frame", (FRAME,))

GLASS = Construction("glass", (MaterialLayer("soda lime glass", 0.006, 1.0, 2500.0, 750.0),))
FILMS = 0.17  # [m2 K/W] both films of a window whose U is stated, ISO 10077-1


def resistance_layer(name: str, resistance: float, thickness: float = 0.0) -> MaterialLayer:
    """A layer of which a model states the resistance [m2 K/W] alone, as insulation of it."""
    thickness = thickness or EPS.conductivity * resistance
    return replace(EPS, name=name, thickness=thickness, conductivity=thickness / resistance)


def glass_construction(u_value: float | None) -> Construction:
    """Glass to another room: a layer of its stated U [W/(m2 K)] without films, else one pane."""
    if u_value is None:
        return GLASS
    resistance = max(1.0 / u_value - FILMS, GLASS.resistance)
    return Construction(f"glass, U {u_value:g}", (resistance_layer("glazing", resistance),))


def air_layer(thickness: float, name: str = "air layer") -> MaterialLayer:
    """An unventilated air layer of a wall [m]."""
    return MaterialLayer(name, thickness, thickness / GAP_RESISTANCE, 1.23, 1008.0)


def default_construction(kind: str, adjacency: str) -> Construction:
    """Construction of a face of that kind towards that neighbour (see the table above)."""
    if kind == "door":
        return DOOR
    if kind == "window frame":
        return WINDOW_FRAME
    outdoors = adjacency in ("outside", "ground")
    if kind == "floor":
        return GROUND_FLOOR if outdoors else UPPER_FLOOR
    if kind == "roof" or (kind == "ceiling" and outdoors):
        return ROOF
    if kind == "ceiling":
        return CEILING_SLAB
    return EXTERIOR_WALL if outdoors else INTERIOR_WALL


UNKNOWN_MATERIAL = MaterialLayer("brick masonry (unknown material)", 0.24, 0.80, 1800.0, 1000.0)
