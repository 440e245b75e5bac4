"""Which glass of an IFC file belongs to which room, and what becomes of the glass that does not.

Openings that nothing fills, with a room on one side and the open air on the other, are closed by
one of two rules.  One that its name calls a door, or that reaches down to the room's floor and is
no wider than 1.3 m, is taken as a door, opaque; any other is taken as a window whose file lost its
glass, with the default frame.  One that faces up is a rooflight only below the open sky, and where
no stair or lift goes through it and no shaft stands on it.  A room with a hole in its wall has no
temperature of its own, so none stays open.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.apertures import Aperture, Filling, aperture_of, framed_by, main_direction, shadow
from bim.ifc.fillings import read_fillings, unfilled_openings
from bim.ifc.project import storey_of
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.ifc.transparent import is_phantom
from bim.model import Space
from bim.names import plain_text
from bim.neighbours import FAR, is_open
from bim.planes import plane_through, polygons_of, triangulated
from bim.rays import RayMesh
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import Attachment, attachments_of
from mitsuba_cfs.errors import DataError

SMALLEST_OPENING = 0.1  # smaller ones are for ducts [m2]
DOOR_SILL, DOOR_WIDTH = 0.3, 1.3  # an opening to the floor up to this width is a door [m]
ASIDE = 0.5  # points asked on both sides of glass lie this far from it [m]
CLEAR_WAY = 1.0  # an opening goes through where nothing stands in it this far to both sides [m]
LEAST_MORE = 1e-3  # stated glass exceeds its opening by more than this [m2]
LEAST_LOST = 0.01  # share of a pane whose loss is reported
TALLEST_GAP = 30.0  # between the top of a room and glass above it [m]
DOOR_NAME = re.compile(r"\b(tur|tuer|door|porte?|deur|puerta|porta|ajto|drzwi|dvere|ovi)", re.I)
SHAFT_NAME = re.compile(
    r"schacht|kamin|aufzug|treppe|shaft|\bduct|chimney|\blift|elevator|stair|gaine|cheminee|ascens"
    r"|escalier|escal(a|era)|scala|cavedio|\btrap|sachta|schody|szyb|lepcso",
    re.I,
)
STAIRS = ("IfcStair", "IfcRamp", "IfcTransport")
UP = 0.7  # cosine to the vertical from which an opening faces up
OVERHEAD = 0.5  # share of an opening's area below the open sky, for a rooflight
SHAFT_RAYS = 16  # level rays that all meet a wall in a shaft
NOT_FILLED = "IfcOpeningElement"


@dataclass(frozen=True, slots=True)
class GlassAccount:
    """The glass of one window, glazed door or panel, and what became of it."""

    guid: str
    storey: str
    out: float  # area that faces the outdoors [m2]
    used: float  # of it: before a room [m2]
    assumed: bool  # its outline is not drawn in the file
    low: SpaceRecord | None = None  # the room that ends below it
    heights: tuple[float, float] = (0.0, 0.0)  # of its lowest and highest point [m]


@dataclass(frozen=True, slots=True)
class GlassOfRooms:
    """The glass of the rooms, all glass to the outdoors, and the openings that were closed."""

    attachments: tuple[Attachment, ...]
    glass: tuple[GlassAccount, ...]
    closed: float  # openings to the outdoors closed without glass [m2]
    issues: tuple[Issue, ...]


def apertures_in(source: Source) -> tuple[list[Aperture], list[Issue]]:
    """The windows, doors and glazed panels of a file, each in its plane."""
    fillings, issues = read_fillings(source.model, source.shapes, source.damage)
    apertures = []
    areas = source.corrections.glass_areas(source.model)
    for filling in fillings:
        aperture, more = _corrected(filling, areas, source.corrections.file)
        issues += more
        apertures += [] if aperture is None else [aperture]
    kept = []
    for aperture, other in zip(apertures, framed_by(apertures), strict=True):
        if other is None:
            kept.append(aperture)
            continue
        filling = aperture.filling
        label = f"{filling.ifc_class} {filling.name}"
        values = {"element": label, "other": other.filling.name}
        issues.append(Issue("frame-of-window", filling.guid, values))
    return kept, issues


def _corrected(filling: Filling, areas: Mapping[str, float], file: str) -> tuple[Aperture | None, list[Issue]]:
    """The filling in its plane, with the area of glass [m2] by GUID that the corrections state.

    Raises: `DataError` for an area larger than the opening.
    """
    area = areas.get(filling.guid)
    aperture, issues = aperture_of(replace(filling, glass_area=area))
    if aperture is not None and area is not None and area > aperture.opening.area + LEAST_MORE:
        message = f"{area:g} m2 is more than the opening of {aperture.opening.area:.3g} m2"
        label = f"{filling.ifc_class} {filling.name}"
        raise DataError(message, file=file, element=label, field="glass.area")
    return aperture, issues


def glass_of_rooms(
    source: Source, apertures: Sequence[Aperture], records: Sequence[SpaceRecord], building: RayMesh
) -> GlassOfRooms:
    """Which part of which window, door or glazed opening each room has, and the rest's account.

    Args: building: everything but the terrain, openings cut.
    """
    attachments: list[Attachment] = []
    glass: list[GlassAccount] = []
    issues: list[Issue] = []
    for aperture in apertures:
        attached = _without_floors(attachments_of(aperture, [r.solid for r in records]), issues)
        attachments += attached
        if not records or aperture.glass.is_empty:
            continue
        one = _account(aperture, attached, source, records, building)
        glass.append(one)
        issues += _issues_of(aperture, attached, one, records)
    unfilled = _unfilled(source, records, building, attachments)
    return GlassOfRooms(
        (*attachments, *unfilled.attachments), (*glass, *unfilled.glass), unfilled.closed, (*issues, *unfilled.issues)
    )


def lost_glass(attachments: Sequence[Attachment], spaces: Sequence[Space], repeated: Collection[str]) -> list[Issue]:
    """Glass before a room that is no window of the finished room; rooms left out say so themselves.

    None is known: the last net under the cutting of solids.

    Args: repeated: GUIDs of windows that are drawn again, of which one counts.
    """
    issues = []
    for space in spaces:
        windows: dict[str, float] = {}
        for window in space.windows:
            windows[window.guid] = windows.get(window.guid, 0.0) + window.area
        for one in attachments:
            if one.room != space.guid or one.neighbour is not None or one.glass.is_empty:
                continue
            filling, area = one.aperture.filling, one.glass.area
            lost = area - windows.get(filling.guid, 0.0)
            if lost > LEAST_LOST * area and filling.guid not in repeated:
                label = f"{filling.ifc_class} {filling.name}"
                values = {"element": label, "area": lost, "room": space.label}
                issues.append(Issue("glass-lost", filling.guid, values, Effect(glass=lost)))
    return issues


def _without_floors(attached: list[Attachment], issues: list[Issue]) -> list[Attachment]:
    """Attachments without the glass of floors: walls and slabs that face down."""
    real = []
    for one in attached:
        filling = one.aperture.filling
        if not is_phantom(filling.ifc_class, one.aperture.plane.normal):
            real.append(one)
        elif one.neighbour is None:
            values = {"element": f"{filling.ifc_class} {filling.name}"}
            effect = Effect(glass=one.glass.area)
            issues.append(Issue("transparent-facing-down", filling.guid, values, effect))
    return real


def _account(
    aperture: Aperture,
    attached: Sequence[Attachment],
    source: Source,
    records: Sequence[SpaceRecord],
    building: RayMesh,
) -> GlassAccount:
    """How much of a filling's glass faces the outdoors, and how much of that a room has."""
    filling = aperture.filling
    storey = storey_of(source.model.by_guid(filling.guid))
    used = sum(a.glass.area for a in attached if a.neighbour is None)
    inner = sum(a.glass.area for a in attached if a.neighbour is not None) / 2  # one of each side
    rest = max(aperture.glass.area - used - inner, 0.0)
    out, low = used, None
    if rest > 0.01 * aperture.glass.area:
        inside = _inner_point(aperture, attached, building)
        if inside is not None:
            out += rest
            low = _room_below(inside, records, building)
    assumed = not filling.transparent.any() and filling.glass_area is None
    z = aperture.plane.to_world(shapely.get_coordinates(aperture.glass))[:, 2]
    heights = float(z.min()), float(z.max())
    return GlassAccount(filling.guid, storey, out, used, assumed, low, heights)


def _inner_point(aperture: Aperture, attached: Sequence[Attachment], building: RayMesh) -> NDArray[np.float64] | None:
    """A point [3] on the room side of glass without a room; None where it faces no outdoors.

    Where both sides are enclosed, as below a canopy, the rest of a pane faces the same side as
    the part of it with a room.
    """
    left = aperture.glass
    for one in attached:
        turned = one.aperture.plane.normal @ aperture.plane.normal < 0
        region = shapely.transform(one.region, lambda p: p * [-1.0, 1.0]) if turned else one.region
        left = left.difference(region)
    left = shapely.union_all(polygons_of(left))
    if left.is_empty:
        return None
    middle = shapely.get_coordinates(shapely.point_on_surface(left))
    point, normal = aperture.plane.to_world(middle)[0], aperture.plane.normal
    open_sides = [is_open(point + s * ASIDE * normal, s * normal, building) for s in (1.0, -1.0)]
    out = open_sides[0] - open_sides[1]
    if not any(open_sides):
        sides = [a.aperture.plane.normal @ normal for a in attached if a.neighbour is None]
        out = min(sides, default=0) if min(sides, default=0) == max(sides, default=0) else 0
    if out == 0:  # within the building, or free-standing outdoors
        return None
    return point - np.sign(out) * ASIDE * normal


def _room_below(point: NDArray[np.float64], records: Sequence[SpaceRecord], building: RayMesh) -> SpaceRecord | None:
    """The room whose top lies below a point with no slab between."""
    below = [
        r
        for r in records
        if np.all(r.solid.low[:2] < point[:2])
        and np.all(r.solid.high[:2] > point[:2])
        and 0 < point[2] - r.solid.high[2] < TALLEST_GAP
    ]
    if not below:
        return None
    room = max(below, key=lambda r: r.solid.high[2])
    down = np.array([[0.0, 0.0, -1.0]])
    _, hit = building.first_hits(point[None], down, point[2] - room.solid.high[2])
    return room if hit[0] < 0 else None


def _issues_of(
    aperture: Aperture, attached: Sequence[Attachment], one: GlassAccount, records: Sequence[SpaceRecord]
) -> list[Issue]:
    """What there is to say of a filling's glass and the rooms beside it."""
    filling = aperture.filling
    label = f"{filling.ifc_class} {filling.name}"
    names = {record.solid.guid: record.solid.name for record in records}
    issues = []
    lost = one.out - one.used
    if one.low is not None and lost > 0:
        values = {"element": label, "area": lost, "room": one.low.label}
        effect = Effect("window" if one.used == 0 else "", lost)
        issues.append(Issue("glass-above-room", filling.guid, values, effect))
    elif not attached:
        values, effect = {"element": label}, Effect("window", max(lost, 0.0))
        issues.append(Issue("window-without-room", filling.guid, values, effect))
    elif lost > 0:
        values, effect = {"element": label, "area": lost}, Effect(glass=lost)
        issues.append(Issue("window-partly-without-room", filling.guid, values, effect))
    inner = sorted({names[a.room] for a in attached if a.neighbour is not None})
    if inner:
        values, effect = {"element": label, "rooms": tuple(inner)}, Effect("window")
        issues.append(Issue("glass-between-rooms", filling.guid, values, effect))
    rooms = sorted({names[a.room] for a in attached if a.neighbour is None})
    if len(rooms) > 1:
        values = {"element": filling.name, "rooms": tuple(rooms)}
        issues.append(Issue("window-of-several-rooms", filling.guid, values))
    return issues


def _unfilled(
    source: Source, records: Sequence[SpaceRecord], building: RayMesh, filled: Sequence[Attachment]
) -> GlassOfRooms:
    """Openings to the outdoors that nothing fills: glazed, or closed as doors."""
    attachments, glass, issues, closed = [], [], [], 0.0
    solids = [record.solid for record in records]
    lows = {record.solid.guid: float(record.solid.low[2]) for record in records}
    panes = [a.aperture.plane.to_world(shapely.get_coordinates(a.region)) for a in filled]
    middles = np.array([pane.mean(axis=0) for pane in panes]).reshape(-1, 3)
    areas = source.corrections.glass_areas(source.model)
    for opening, host in unfilled_openings(source.model) if records else ():
        filling = None if host is None else _pane_of(source, opening, host)
        if filling is None or _holds_one(filling, middles):
            continue
        aperture, _ = _corrected(filling, areas, source.corrections.file)
        if aperture is None or aperture.opening.area < SMALLEST_OPENING:
            continue
        if not _goes_through(aperture, building):
            continue
        attached = [
            a
            for a in attachments_of(aperture, solids)
            if a.neighbour is None
            and not is_phantom("IfcWall", a.aperture.plane.normal)
            and _faces_outdoors(a, building)
        ]
        if not attached:
            continue
        area = sum(a.glass.area for a in attached)
        label = f"opening {opening.Name or ''} in {host.is_a()} {host.Name or ''}"
        if filling.guid in areas:
            attachments += attached
            glass.append(GlassAccount(filling.guid, storey_of(host), area, area, False))
            continue
        if no_rooflight := _no_rooflight(attached[0], opening.Name or "", source, building):
            values = {"element": label, "reason": Phrase(no_rooflight)}
            issues.append(Issue("opening-closed", filling.guid, values))
            continue
        named = DOOR_NAME.search(plain_text(opening.Name or "")) is not None
        if named or _is_door(attached[0], lows[attached[0].room]):
            closed += area
            reason = Phrase("called-door" if named else "reaches-floor")
            code, values = "opening-closed", {"element": label, "reason": reason}
        else:
            attachments += attached
            glass.append(GlassAccount(filling.guid, storey_of(host), area, area, True))
            code, values = "opening-glazed", {"element": label}
        issues.append(Issue(code, filling.guid, values, Effect(glass=area)))
    return GlassOfRooms(tuple(attachments), tuple(glass), closed, tuple(issues))


def _pane_of(source: Source, opening, host) -> Filling | None:
    """The opening as a pane without glass drawn, in the middle of its host."""
    body, wall = source.shapes.get(opening.id()), source.shapes.get(host.id())
    direction = None if wall is None else main_direction(wall.triangles)
    if body is None or direction is None:
        return None
    # an opening may be deeper than it is wide: its plane is that of the wall
    heights = wall.triangles @ direction
    depths = body.triangles @ direction
    low, high = max(heights.min(), depths.min()), min(heights.max(), depths.max())
    if high <= low:
        return None
    plane = plane_through(0.5 * (low + high) * direction, direction)
    outline = shadow(body.triangles, plane)
    if outline.is_empty:
        return None
    pane = plane.to_world(np.concatenate([triangulated(p) for p in polygons_of(outline)]))
    return Filling(
        body.guid,
        opening.Name or body.guid,
        NOT_FILLED,
        pane,
        np.zeros(len(pane), dtype=bool),
        opening=pane,
        host=host.GlobalId,
    )


def _holds_one(filling: Filling, middles: NDArray[np.float64]) -> bool:
    """Whether a window or door that no relation ties to the opening stands in it."""
    corners = filling.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0) - ASIDE, corners.max(axis=0) + ASIDE
    return bool(np.any(np.all((middles > low) & (middles < high), axis=1)))


def _goes_through(aperture: Aperture, building: RayMesh) -> bool:
    """Whether nothing stands in the opening or before it."""
    middle = shapely.get_coordinates(shapely.point_on_surface(aperture.opening))
    point, normal = aperture.plane.to_world(middle), aperture.plane.normal
    _, hit = building.first_hits(np.repeat(point, 2, axis=0), np.stack([normal, -normal]), CLEAR_WAY)
    return bool(np.all(hit < 0))


def _faces_outdoors(one: Attachment, building: RayMesh) -> bool:
    middle = shapely.get_coordinates(shapely.point_on_surface(one.region))
    plane = one.aperture.plane
    return is_open(plane.to_world(middle)[0] + CLEAR_WAY * plane.normal, plane.normal, building)


def _no_rooflight(one: Attachment, name: str, source: Source, building: RayMesh) -> str:
    """Why an opening that faces up is no rooflight, as a phrase of the catalogue, else ""."""
    plane = one.aperture.plane
    if plane.normal[2] < UP:
        return ""
    if SHAFT_NAME.search(plain_text(name)):
        return "called-shaft"
    corners = plane.to_world(shapely.get_coordinates(one.region))
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = np.array([0.0, 0.0, ASIDE])
    for shape in source.elements:
        if shape.ifc_class.startswith(STAIRS) and len(shape.triangles):
            ends = shape.triangles.min(axis=(0, 1)), shape.triangles.max(axis=(0, 1))
            if np.all(ends[0] < high + near) and np.all(ends[1] > low - near):
                return "stair-in-opening"
    parts = np.concatenate([triangulated(p) for p in polygons_of(one.region)])
    areas = shapely.area(shapely.polygons(parts))
    middles = plane.to_world(parts.mean(axis=1)) + 0.01 * plane.normal
    _, hit = building.first_hits(middles, np.tile([0.0, 0.0, 1.0], (len(middles), 1)), FAR)
    if np.average(hit < 0, weights=areas) < OVERHEAD:
        return "no-sky-above"
    turn = 2 * np.pi * np.arange(SHAFT_RAYS) / SHAFT_RAYS
    level = np.stack([np.cos(turn), np.sin(turn), np.zeros(SHAFT_RAYS)], axis=1)
    middle = plane.to_world(shapely.get_coordinates(shapely.point_on_surface(one.region)))[0]
    above = middle + CLEAR_WAY * plane.normal
    reach = float(np.linalg.norm(high - low))
    _, hit = building.first_hits(np.tile(above, (SHAFT_RAYS, 1)), level, reach)
    return "shaft-above" if np.all(hit >= 0) else ""


def _is_door(one: Attachment, floor: float) -> bool:
    corners = one.aperture.plane.to_world(shapely.get_coordinates(one.region))
    across = np.cross(one.aperture.plane.normal, [0.0, 0.0, 1.0])
    if np.linalg.norm(across) < 0.3:  # in a roof
        return False
    width = float(np.ptp(corners @ (across / np.linalg.norm(across))))
    return bool(corners[:, 2].min() < floor + DOOR_SILL and width <= DOOR_WIDTH)
