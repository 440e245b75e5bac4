"""A building from rooms that a file draws as polygons: what honeybee and gbXML have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bim.account import Account, StoreyAccount
from bim.defaults import FACADE_REFLECTANCE, GLASS_REFLECTANCE
from bim.doorways import panes_between
from bim.model import Building, Element, Space
from bim.names import JOINT, AmbiguousName, UnknownName, item_named, label_of
from bim.outdoors import shut_in_area, simplified, unblinded
from bim.polygon_rooms import DrawnFace, DrawnOpening, DrawnRoom, space_of
from bim.report.issue import Effect, Issue
from bim.shell import open_edges
from mitsuba_cfs.errors import DataError, RoomError


@dataclass(frozen=True, slots=True)
class DrawnModel:
    """What a file of polygons holds."""

    path: Path
    name: str
    rooms: tuple[DrawnRoom, ...]
    elements: tuple[Element, ...] = ()  # shades and context
    furniture: Mapping[str, tuple[Element, ...]] = field(default_factory=dict)  # by room
    issues: tuple[Issue, ...] = ()
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    elevation: float = 0.0  # [m]


def drawn_building(model: DrawnModel, *, join: Sequence[str] = (), furniture: bool = False) -> Building:
    """The building with closed rooms, and the account of its import.

    Args:
        join: rooms to make one, as "Hall + Living".
        furniture: whether furniture is in the light and the views of its room.
    """
    rooms = _unique(model.rooms, model.path)
    for text in join:
        rooms = _joined(rooms, text, model.path)
    issues = list(model.issues)
    spaces: list[Space] = []
    for room in rooms:
        try:
            space, more = space_of(room)
        except RoomError as error:
            label = label_of(room.name, room.long_name, room.guid)
            values = {"room": label, "reason": str(error)}
            effect = Effect("room", _glass(room))
            issues.append(Issue("room-not-closed", room.guid, values, effect))
            continue
        issues += more
        spaces.append(space)
    spaces, more = _furnished(spaces, model, furniture)
    issues += [*more, *_inner_glass(spaces)]
    elements = [*_envelope(rooms, spaces), *model.elements]
    outdoors = unblinded(elements, spaces)
    traced, fine = simplified(list(outdoors.elements))
    issues += [*outdoors.issues, *fine]
    return Building(
        model.name,
        tuple(spaces),
        tuple(traced),
        tuple(dict.fromkeys(issues)),
        model.latitude_deg,
        model.longitude_deg,
        model.elevation,
        model.path,
        _account(model, rooms, spaces, issues),
    )


def _unique(rooms: Sequence[DrawnRoom], path: Path) -> list[DrawnRoom]:
    """The rooms with openings of an identity each; the systems of windows go by it.

    Raises: `DataError` for two rooms of one identity.
    """
    count: Counter[str] = Counter()
    names: set[str] = set()

    def own(opening: DrawnOpening) -> DrawnOpening:
        count[opening.guid] += 1
        number = count[opening.guid]
        return opening if number == 1 else replace(opening, guid=f"{opening.guid} ({number})")

    unique = []
    for room in rooms:
        if room.guid in names:
            raise DataError("two rooms have this identifier", file=path, element=room.guid)
        names.add(room.guid)
        faces = [replace(face, openings=tuple(map(own, face.openings))) for face in room.faces]
        unique.append(replace(room, faces=tuple(faces)))
    return unique


def _joined(rooms: Sequence[DrawnRoom], text: str, path: Path) -> list[DrawnRoom]:
    """The rooms with those that a text names made one; air between them goes."""
    names = [name.strip() for name in text.split("+") if name.strip()]
    if len(names) < 2:
        message = f"expected rooms with a plus between them, as 'Hall + Living', got {text!r}"
        raise DataError(message, field="join")
    try:
        own = [item_named([_Labelled(room) for room in rooms], name, "room") for name in names]
    except (UnknownName, AmbiguousName) as error:
        raise DataError(str(error.args[0]), file=path, field="join") from None
    chosen = {one.guid: one.room for one in own}
    first = own[0].room
    faces = tuple(
        face for room in chosen.values() for face in room.faces if not (face.is_open and face.neighbour in chosen)
    )
    areas = [room.stated_area for room in chosen.values()]
    volumes = [room.stated_volume for room in chosen.values()]
    one = replace(
        first,
        name=JOINT.join(label_of(r.name, r.long_name, r.guid) for r in chosen.values()),
        long_name="",
        faces=faces,
        stated_area=None if None in areas else sum(areas),
        stated_volume=None if None in volumes else sum(volumes),
    )
    others = [_towards(room, chosen, first.guid) for room in rooms if room.guid not in chosen]
    return [_towards(one, chosen, first.guid), *others]


def _towards(room: DrawnRoom, joined: Mapping[str, DrawnRoom], guid: str) -> DrawnRoom:
    """The room with faces that lie towards joined rooms lying towards the one they became."""
    faces = (replace(face, neighbour=guid) if face.neighbour in joined else face for face in room.faces)
    return replace(room, faces=tuple(faces))


@dataclass(frozen=True, slots=True)
class _Labelled:
    """A drawn room by the names that people use."""

    room: DrawnRoom

    @property
    def guid(self) -> str:
        return self.room.guid

    @property
    def name(self) -> str:
        return self.room.name

    @property
    def long_name(self) -> str:
        return self.room.long_name

    @property
    def label(self) -> str:
        return label_of(self.name, self.long_name, self.guid)


def _furnished(spaces: Sequence[Space], model: DrawnModel, wanted: bool) -> tuple[list[Space], list[Issue]]:
    count = sum(len(model.furniture.get(space.guid, ())) for space in spaces)
    if not count or not wanted:
        left = Issue("furniture-left-out", "furniture", {"count": count})
        return list(spaces), [left] if count else []
    furnished = [replace(s, furniture=tuple(model.furniture.get(s.guid, ()))) for s in spaces]
    return furnished, [Issue("furniture-included", "furniture", {"count": count})]


def _inner_glass(spaces: Sequence[Space]) -> list[Issue]:
    """Glass between two rooms; that which the room beyond does not have is opaque."""
    rooms = {space.guid: space for space in spaces}
    issues: dict[tuple[str, str], Issue] = {}
    for space in spaces:
        pairs = panes_between(spaces, space)
        both = {face.name for own in pairs.values() for face, _ in own}
        for face in space.faces:
            if face.pane is None:
                continue
            beyond = rooms.get(face.neighbour or "")
            names = tuple(sorted({space.label, beyond.label if beyond else face.neighbour or ""}))
            values = {"element": face.pane.name, "rooms": names}
            code = "glass-between-rooms" if face.name in both else "glass-on-one-side"
            where = face.pane.guid
            issues.setdefault((code, where), Issue(code, where, values, Effect("window")))
    return list(issues.values())


def _envelope(rooms: Sequence[DrawnRoom], spaces: Sequence[Space]) -> list[Element]:
    """The building's own skin as it shades and reflects outdoors: exterior faces and glass."""
    drawn = {face.guid: face for room in rooms for face in room.faces}
    finishes = {one.guid: one.finish for face in drawn.values() for one in (face, *face.openings)}
    elements = []
    for space in spaces:
        for face in space.faces:
            if face.adjacency == "outside":
                outer = finishes[face.element].outer
                value = FACADE_REFLECTANCE if outer is None else outer
                name, kind = face.name, "IfcDoor" if face.kind == "door" else "IfcWall"
                elements.append(Element(face.element or "", name, kind, face.triangles, value, value))
        elements += [
            Element(w.guid, w.name, "IfcWindow", w.triangles, GLASS_REFLECTANCE, GLASS_REFLECTANCE)
            for w in space.windows
        ]
    return elements


def _glazed(room: DrawnRoom) -> list[tuple[DrawnFace, DrawnOpening]]:
    """The openings of a room with exterior glass, with their faces."""
    return [
        (face, opening)
        for face in room.faces
        for opening in face.openings
        if face.adjacency == "outside" and opening.glazing is not None
    ]


def _glass(room: DrawnRoom) -> float:
    """Area of a room's exterior glass, as drawn [m2]."""
    return sum(opening.area for _, opening in _glazed(room))


def _account(
    model: DrawnModel, rooms: Sequence[DrawnRoom], spaces: Sequence[Space], issues: Sequence[Issue]
) -> Account:
    """The account of the file's rooms and glass."""
    failed = {issue.where for issue in issues if issue.effect.lost == "room"}
    drawn = Counter(room.storey for room in model.rooms)
    # a joined room is as many rooms as the file had of it
    lost = Counter(room.storey for room in rooms if room.guid in failed)
    out: Counter[str] = Counter()
    used: Counter[str] = Counter()
    for room in rooms:
        out[room.storey] += _glass(room)
    for space in spaces:
        used[space.storey] += sum(window.area for window in space.windows)
    glazed = sum(len(_glazed(room)) for room in rooms)
    return Account(
        tuple(
            StoreyAccount(name, drawn[name] - lost[name], drawn[name], out[name], min(used[name], out[name]))
            for name in drawn
        ),
        glazed,
        sum(len(space.windows) for space in spaces),
        0.0,
        0.0,
        sum(_glass(room) for room in rooms if room.guid in failed),
        0.0,
        0.0,
        missing=tuple(label_of(room.name, room.long_name, room.guid) for room in rooms if room.guid in failed),
        leaking=tuple(space.label for space in spaces if open_edges(space.shell)),
        shut_in=shut_in_area(issues),
    )
