"""The building as data: what every source (IFC, shoebox) yields and everything downstream reads.

SI units; world x east, y north, z up, true north applied.  Face and window normals point out of
the room: from its air towards what lies beyond.  The faces of a space and its windows together are
one closed surface round the room's air: the room and the recesses of its windows up to the glass.

`Georeference` leads from map coordinates to the building's world; `seasons` are
its surroundings by month, with and without leaves.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.account import Account
from bim.colours import GREY, Colour
from bim.fenestration import PlainGlass, ShadingState
from bim.held_sensors import ModelGrid, ModelView
from bim.names import AmbiguousName, UnknownName, item_named, label_of
from bim.report.issue import Issue
from bim.use import StatedUse
from mitsuba_cfs.errors import DataError, check_number
from mitsuba_cfs.gloss import Gloss
from mitsuba_cfs.surfaces import area_vectors, triangle_areas

LONGITUDE_LATITUDE = "OGC:CRS84"  # degrees, as GeoJSON has them (RFC 7946)
EQUATOR, FLATTENING = 6378137.0, 1 / 298.257223563  # WGS 84 [m], [1]


@dataclass(frozen=True, slots=True)
class Georeference:
    """The map that a building lies on, and the way from its coordinates to the world's."""

    crs: str  # of the map: "EPSG:25832"
    to_world: NDArray[np.float64]  # [4, 4] of east, north, height [m]


def crs_name(text: str) -> str:
    """One spelling of a coordinate reference system: "EPSG:25832" for its code, URN or URL.

    Of a compound system only the name is kept; GeoJSON's CRS84 has one of its own, and so have the
    German surveys' ETRS89_UTM31 to 33.
    """
    if re.search(r"CRS84", text, re.IGNORECASE):
        return LONGITUDE_LATITUDE
    zone = re.search(r"ETRS89_UTM(3[123])(?!\d)", text, re.IGNORECASE)
    if zone:
        return f"EPSG:258{zone[1]}"
    match = re.search(r"EPSG\D+(?:[\d.]+[:/]+)?(\d{4,6})\b", text, re.IGNORECASE)
    return f"EPSG:{match[1]}" if match else text.strip()


def local_metres(lon_lat: NDArray[np.float64], longitude_deg: float, latitude_deg: float) -> NDArray[np.float64]:
    """East and north [N, 2] [m] of places [N, 2] [deg] from one among them.

    By the ellipsoid's two radii of curvature there, to the second order of the distance (a parallel
    is curved): 0.01 m off at 3 km and 50 degrees.
    """
    phi = np.radians(latitude_deg)
    e2 = FLATTENING * (2 - FLATTENING)
    root = 1 - e2 * np.sin(phi) ** 2
    across, along = EQUATOR / np.sqrt(root), EQUATOR * (1 - e2) / root**1.5
    north = np.radians(lon_lat[:, 1] - latitude_deg)
    longitude = np.radians((lon_lat[:, 0] - longitude_deg + 180) % 360 - 180)
    east = longitude * (across * np.cos(phi) - north * along * np.sin(phi))
    return np.column_stack([east, north * along + east**2 * np.tan(phi) / (2 * across)])


def transformed(points: NDArray[np.float64], crs: str, target: str, *, file: str) -> NDArray[np.float64]:
    """Map coordinates [N, 2] of one system in another one, easting or longitude first.

    Raises: `DataError` where `pyproj` is not installed, or knows one of the two not.
    """
    if crs == target:
        return points
    try:
        import pyproj
    except ImportError:
        message = f"{crs} to {target}: needs pyproj (pip install 'mitsuba-cfs[georeference]')"
        raise DataError(message, file=file, field="coordinate system") from None
    try:
        change = pyproj.Transformer.from_crs(crs, target, always_xy=True)
        moved = np.column_stack(change.transform(points[:, 0], points[:, 1]))
    except pyproj.exceptions.ProjError as error:
        reason = str(error).splitlines()[0]
        raise DataError(reason, file=file, field="coordinate system") from None
    if not np.isfinite(moved).all():
        message = f"coordinates lie outside of {crs} or {target}"
        raise DataError(message, file=file, field="coordinate system")
    return moved


FACE_KINDS = ("floor", "ceiling", "roof", "wall", "door", "window frame", "reveal")
# Sides of a box-shaped room as seen from outdoors in front of it, and the other kinds of its faces
BOX_SIDES = ("front", "right", "back", "left", "floor", "ceiling")
BOX_PARTS = (*BOX_SIDES, "wall", "window frame", "reveal")
COLOURS = ("red", "green", "blue")  # bands of colour pictures
ADJACENCIES = ("outside", "ground", "space", "adiabatic", "unknown")


@dataclass(frozen=True, slots=True)
class MaterialLayer:
    """One homogeneous layer of a construction."""

    name: str
    thickness: float  # [m]
    conductivity: float  # [W/(m K)]
    density: float  # [kg/m3]
    heat_capacity: float  # specific heat capacity [J/(kg K)]

    def __post_init__(self) -> None:
        for name in ("thickness", "conductivity", "density", "heat_capacity"):
            check_number(f"layer {self.name}: {name}", getattr(self, name), 1e-9)

    @property
    def resistance(self) -> float:
        """Thermal resistance [m2 K/W]."""
        return self.thickness / self.conductivity


@dataclass(frozen=True, slots=True)
class Construction:
    """Layers of an opaque building element, from the far side to the room."""

    name: str
    layers: tuple[MaterialLayer, ...]  # first layer: outermost
    source: str = "default"  # where layers and properties come from

    @property
    def thickness(self) -> float:
        """Sum of the layers' thickness [m]."""
        return sum(layer.thickness for layer in self.layers)

    @property
    def resistance(self) -> float:
        """Thermal resistance without surface resistances [m2 K/W]."""
        return sum(layer.resistance for layer in self.layers)


def _in_band(surface: Face | Element, band: str) -> float:
    """Diffuse reflectance; in a band of colour no more than the gloss leaves."""
    if band in COLOURS:
        most = 1.0 - (0.0 if surface.gloss is None else surface.gloss.at_normal)
        return min(surface.reflectance_visible * surface.hue[COLOURS.index(band)], most)
    return {"visible": surface.reflectance_visible, "solar": surface.reflectance_solar}[band]


@dataclass(frozen=True, slots=True)
class Face:
    """A plane opaque part of a room's boundary: one element, one construction, one neighbour."""

    name: str
    kind: str  # one of FACE_KINDS
    triangles: NDArray[np.float64]  # [T, 3, 3] vertices [m], counter-clockwise seen from outside
    adjacency: str  # one of ADJACENCIES: what lies beyond
    construction: Construction
    reflectance_visible: float  # diffuse
    reflectance_solar: float
    emissivity: float = 0.9
    neighbour: str | None = None  # GUID of the other space where adjacency is "space"
    element: str | None = None  # GUID of the building element
    gloss: Gloss | None = None  # what it reflects like a mirror besides, in both bands
    pane: Window | None = None  # the glass or the opening to the neighbour that the face is
    hue: Colour = GREY  # of what it reflects diffusely: linear sRGB of luminance 1
    normal: NDArray[np.float64] = field(init=False)  # [3] unit normal, out of the room
    area: float = field(init=False)  # [m2]

    def __post_init__(self) -> None:
        if self.kind not in FACE_KINDS:
            raise ValueError(f"face {self.name}: kind {self.kind!r} is none of {FACE_KINDS}")
        if self.adjacency not in ADJACENCIES:
            raise ValueError(f"face {self.name}: {self.adjacency!r} is none of {ADJACENCIES}")
        for value in (self.reflectance_visible, self.reflectance_solar, self.emissivity):
            if not 0 <= value <= 1:
                raise ValueError(f"face {self.name}: reflectance or emissivity {value} not in 0..1")
        if max(self.total_reflectance("visible"), self.total_reflectance("solar")) > 1 + 1e-6:
            raise ValueError(f"face {self.name}: reflects more than it gets")
        set_normal_and_area(self)

    def reflectance(self, band: str) -> float:
        """Diffuse reflectance in the band "visible", "solar", "red", "green" or "blue"."""
        return _in_band(self, band)

    def total_reflectance(self, band: str) -> float:
        """Reflectance in a band at normal incidence, diffuse and like a mirror."""
        return self.reflectance(band) + (0.0 if self.gloss is None else self.gloss.at_normal)


@dataclass(frozen=True, slots=True)
class Window:
    """A plane glazed aperture of a room, with the opening it sits in."""

    guid: str
    name: str
    triangles: NDArray[np.float64]  # [T, 3, 3] glass [m], counter-clockwise seen from outdoors
    host: str | None = None  # GUID of the wall or roof
    opening_area: float = 0.0  # area of the opening in the glazing plane [m2]
    u_value: float | None = None  # of the whole window as the file states it [W/(m2 K)]
    g_value: float | None = None  # as the file states it
    visible_transmittance: float | None = None  # as the file states it
    type_name: str = ""
    solar_transmittance: float | None = None  # as the file states it
    panes: int | None = None  # of the glazing, as the file states it
    states: tuple[ShadingState, ...] = ()  # of a file that is no IFC: what it holds of the window
    is_open: bool = False  # no glass: a doorway, or where two rooms touch with nothing between
    glass: PlainGlass | None = None  # where the file describes the glazing as a single pane
    up: NDArray[np.float64] | None = None  # [3] up of its BSDF; world up (north if horizontal)
    covered_area: float = 0.0  # of the glass, by layers that belong to another window [m2]
    normal: NDArray[np.float64] = field(init=False)  # [3] unit normal, outdoors
    area: float = field(init=False)  # of the glass, without what is covered [m2]

    def __post_init__(self) -> None:
        set_normal_and_area(self)
        object.__setattr__(self, "area", max(self.area - self.covered_area, 0.0))

    @property
    def frame_area(self) -> float:
        """Area of the opening that is not glass [m2]."""
        return max(self.opening_area - self.area, 0.0)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of the glass [3] [m]."""
        return centroid(self.triangles)


@dataclass(frozen=True, slots=True, repr=False)
class Space:
    """A room: its air, what bounds it and its windows to the outside."""

    guid: str
    name: str
    storey: str
    volume: float  # of the air inside the faces and the glass [m3]
    floor_area: float  # [m2]
    faces: tuple[Face, ...]  # axis F
    windows: tuple[Window, ...]
    room_volume: float = 0.0  # of the room without its window recesses [m3]
    stated_area: float | None = None  # the file's own floor area [m2]
    stated_volume: float | None = None  # the file's own volume [m3]
    long_name: str = ""
    area_to_middles: float | None = None  # floor to the middle of the walls, if that is stated [m2]
    type_name: str = ""  # of the IfcSpaceType, or the space's ObjectType
    raised: float = 0.0  # of room_volume: above the space as drawn, up to what covers it [m3]
    cut: float = 0.0  # drawn beyond the slab, roof or ceiling that ends the room [m3]
    furniture: tuple[Element, ...] = ()  # in light and views, not in the heat balance

    @property
    def label(self) -> str:
        """Number and name of the room as people use them; its GUID where it has neither."""
        return label_of(self.name, self.long_name, self.guid)

    @property
    def area_as_stated(self) -> float:
        """Floor area measured as the file measures its own: between or to the middle of walls."""
        return self.floor_area if self.area_to_middles is None else self.area_to_middles

    @property
    def drawn_volume(self) -> float:
        """Volume of the space as the file draws it [m3]."""
        return self.room_volume - self.raised + self.cut

    @property
    def shell(self) -> NDArray[np.float64]:
        """Triangles [N, 3, 3] of the closed surface: faces, then glass; normals out of the room."""
        parts = [face.triangles for face in self.faces] + [w.triangles for w in self.windows]
        return np.concatenate(parts) if parts else np.empty((0, 3, 3))

    @property
    def floor_level(self) -> float:
        """Height of the biggest floor face, or of the lowest vertex without any [m]."""
        floors = [face for face in self.faces if face.kind == "floor"]
        if not floors:
            return float(self.shell[..., 2].min())
        return float(max(floors, key=lambda face: face.area).triangles[..., 2].mean())

    def __repr__(self) -> str:
        size = f"{self.floor_area:.1f} m2, {self.volume:.1f} m3, {len(self.windows)} windows"
        return f"<Space {self.label!r}: {size}, {len(self.faces)} faces>"


@dataclass(frozen=True, slots=True)
class Element:
    """An object outdoors, or a piece of furniture, that shades and reflects."""

    guid: str
    name: str
    ifc_class: str
    triangles: NDArray[np.float64]  # [T, 3, 3] [m], openings cut
    reflectance_visible: float
    reflectance_solar: float
    layer: str = ""
    storey: str = ""
    material: str = ""
    is_kept: bool = False  # the corrections say so, whatever stands behind it
    gloss: Gloss | None = None  # what it reflects like a mirror besides, in both bands
    hue: Colour = GREY  # of what it reflects diffusely: linear sRGB of luminance 1
    months: tuple[int, ...] = ()  # 1 to 12 in which it stands; all of them where empty

    def reflectance(self, band: str) -> float:
        """Diffuse reflectance in the band "visible", "solar", "red", "green" or "blue"."""
        return _in_band(self, band)


@dataclass(frozen=True, slots=True)
class ModelLuminaire:
    """A luminaire that a model holds."""

    name: str
    position: tuple[float, float, float]  # [m]
    turned_deg: float  # of its x axis from +x, anticlockwise
    watts: float | None  # None: not stated
    photometry: str  # name of its file; empty: not stated


@dataclass(frozen=True, slots=True)
class SpaceGroup:
    """Rooms that belong together: a dwelling, a thermal zone, a fire compartment."""

    name: str
    kind: str  # what the file says it is, "" where it does not
    rooms: tuple[str, ...]  # GUIDs of spaces


@dataclass(frozen=True, slots=True, repr=False)
class Building:
    """Rooms, their surroundings, and the issues of the model."""

    name: str
    spaces: tuple[Space, ...]
    elements: tuple[Element, ...] = ()
    issues: tuple[Issue, ...] = ()
    latitude_deg: float | None = None
    longitude_deg: float | None = None  # east positive
    elevation: float = 0.0  # above the sea [m]
    file: Path | None = None  # that it was read from
    account: Account | None = None  # of the import; None where there is no file
    georeference: Georeference | None = None  # position on a map, as its file states it
    from_model: NDArray[np.float64] | None = None  # [4, 4] of its file's own axes [m] to these
    uses: Mapping[str, StatedUse] = field(default_factory=dict)  # of rooms, by the space's GUID
    grids: tuple[ModelGrid, ...] = ()  # sensors that the file holds
    views: tuple[ModelView, ...] = ()  # that the file holds
    zones: tuple[SpaceGroup, ...] = ()  # of the rooms, as the file has them
    luminaires: tuple[ModelLuminaire, ...] = ()  # that the file holds

    @property
    def windows(self) -> tuple[Window, ...]:
        """The windows of all spaces."""
        return tuple(window for space in self.spaces for window in space.windows)

    def space(self, name_or_guid: str) -> Space:
        """The space of that GUID, number, name or both; see `bim.names.item_named`."""
        return item_named(self.spaces, name_or_guid, "space")

    def zone(self, name: str) -> tuple[Space, ...]:
        """The spaces of the zones of that name; none where there is none."""
        key = " ".join(name.split()).casefold()
        rooms = {guid for z in self.zones if " ".join(z.name.split()).casefold() == key for guid in z.rooms}
        return tuple(space for space in self.spaces if space.guid in rooms)

    def storey(self, name: str) -> tuple[Space, ...]:
        """The spaces of the storeys of that name; none where there is none."""
        key = " ".join(name.split()).casefold()
        return tuple(s for s in self.spaces if " ".join(s.storey.split()).casefold() == key)

    def room(self, name_or_guid: str) -> Room:
        """The space of that GUID, number, name or both, together with its building.

        Raises: `DataError` that lists the nearest names.
        """
        try:
            return Room(self, self.space(name_or_guid))
        except (UnknownName, AmbiguousName) as error:
            raise DataError(str(error.args[0]), file=self.file, field="space") from None

    def __repr__(self) -> str:
        sizes = f"{len(self.spaces)} spaces, {len(self.windows)} windows"
        return f"<Building {self.name!r}: {sizes}, {len(self.issues)} issues>"


@dataclass(frozen=True, slots=True)
class Room:
    """A space and the building that it is in, whose elements shade it."""

    building: Building
    space: Space


def set_normal_and_area(surface: Face | Window) -> None:
    """Set normal and area of a frozen surface from its triangles; `ValueError` without area."""
    t = np.asarray(surface.triangles, dtype=float)
    if t.ndim != 3 or t.shape[1:] != (3, 3) or len(t) == 0:
        raise ValueError(f"{surface.name}: expected triangles [T, 3, 3], got {t.shape}")
    vector = area_vectors(t).sum(axis=0)
    if not np.linalg.norm(vector) > 0:
        raise ValueError(f"{surface.name}: has no area")
    object.__setattr__(surface, "triangles", t)
    object.__setattr__(surface, "normal", vector / np.linalg.norm(vector))
    object.__setattr__(surface, "area", float(triangle_areas(t).sum()))


def centroid(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area-weighted centre [3] [m] of triangles [T, 3, 3]."""
    return np.average(triangles.mean(axis=1), axis=0, weights=triangle_areas(triangles))


MONTHS = range(1, 13)


@dataclass(frozen=True, slots=True)
class Season:
    """Months in which the same stands outdoors."""

    months: tuple[int, ...]  # 1 to 12
    building: Building  # with the surroundings of these months


def seasons(building: Building) -> tuple[Season, ...]:
    """The seasons of a building, that with most leaves first; one where nothing changes."""
    stands: dict[tuple[bool, ...], list[int]] = {}
    changing = [element.months for element in building.elements if element.months]
    for month in MONTHS:
        kind = tuple(month in months for months in changing)
        stands.setdefault(kind, []).append(month)
    if len(stands) == 1:
        return (Season(tuple(MONTHS), building),)
    found = [Season(tuple(months), in_month(building, months[0])) for months in stands.values()]
    return tuple(sorted(found, key=lambda season: -_triangles(season.building)))


def in_month(building: Building, month: int) -> Building:
    """The building with the surroundings of a month, 1 to 12, as if they were there all year."""
    if not any(element.months for element in building.elements):
        return building
    kept = (e for e in building.elements if not e.months or month in e.months)
    return replace(building, elements=tuple(replace(e, months=()) for e in kept))


def season_of(seasons: tuple[Season, ...], month: NDArray[np.integer]) -> NDArray[np.int64]:
    """The number of the season [n] of each month [n]."""
    of_month = np.zeros(13, dtype=np.int64)
    for number, season in enumerate(seasons):
        of_month[list(season.months)] = number
    return of_month[np.asarray(month)]


def _triangles(building: Building) -> int:
    return sum(len(element.triangles) for element in building.elements)
