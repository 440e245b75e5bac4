"""A building from a file of any format that is read: its name's ending tells which.

One entry of `FORMATS` is all that a new format adds here; what fills the windows of a building
that is no IFC is in its `Window.states`.  Rooms are chosen by name; a missing one, or one without
windows, has its reason.

Buildings are stored in the cache: reading IFC files takes as long as tracing rooms.  A stored file
holds arrays and JSON, and on reading no other classes than those of `RECORDS` are made.  An object
that several parts of a building share (a construction, a gloss) is one object again.
"""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.account import Account, StoreyAccount
from bim.fenestration import AngularGValue, PlainGlass, ShadingState
from bim.ifc.corrections import corrections_beside, corrections_file
from bim.ifc.head import check_head
from bim.model import Building, Construction, Element, Face, Georeference, MaterialLayer, Space, SpaceGroup, Window
from bim.names import AmbiguousName, UnknownName, has_words, label_of, name_key, unknown_room
from bim.report.issue import Effect, Issue, Phrase, Term, issue_text
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import read_json, sha256
from mitsuba_cfs.gloss import Gloss
from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache
from mitsuba_cfs.processes import ended_processes

RECORDS = {
    kind.__name__: kind
    for kind in (
        Account,
        AngularGValue,
        Building,
        Construction,
        Effect,
        Element,
        Face,
        Georeference,
        Gloss,
        Issue,
        MaterialLayer,
        Phrase,
        PlainGlass,
        ShadingState,
        Space,
        SpaceGroup,
        StoreyAccount,
        Term,
        Window,
    )
}
PLAIN = (str, int, float, bool, type(None))
SEQUENCES = {"tuple": tuple, "list": list}
# of a STEP file: the attributes of what has rooms, a text in them, letters beyond ASCII in a text
NAMED = re.compile(rb"=\s*IFC(?:SPACE|ZONE|BUILDINGSTOREY|FACILITYPART)\s*\(((?:[^';]|'[^']*')*);", re.IGNORECASE)
TEXT = re.compile(r"'((?:[^']|'')*)'")
WIDE = re.compile(r"\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\")
READER = "bim.building_file"  # the module that reads and stores; its source is a part of the key

log = logging.getLogger(__name__)


class _NotStored(Exception):
    """The building holds an object of another class."""


def read_once(
    read: Callable[[], Building],
    files: Sequence[Path],
    options: Sequence[object],
    cache: MatrixCache,
    *,
    corrected: bool = True,
) -> Building:
    """The building of IFC files from the cache; read and stored where it is not in it.

    It is not stored where a process of its reading was stopped or crashed: another time, with more
    memory or less other work, the building may have what it lacks now.

    Args:
        options: of the reader, besides the files and the corrections beside them.
        corrected: whether it reads these corrections.
    """
    entry = _entry(files, options, cache, corrected)
    building = None if entry is None else entry.read(_restored)
    if building is None:
        with ended_processes() as ended:
            building = read()
        # files that changed while they were read are not those of the key
        if entry is not None and not ended and entry == _entry(files, options, cache, corrected):
            _store(entry, building)
    return building


def _entry(files: Sequence[Path], options: Sequence[object], cache: MatrixCache, corrected: bool) -> CacheEntry | None:
    """The entry by the content of all files; None where one of them cannot be read."""
    corrections = [corrections_file(file) for file in files]
    try:
        contents = [sha256(file) for file in files]
        contents += [sha256(file) if corrected and file.is_file() else "" for file in corrections]
    except OSError:
        return None
    return cache.entry("building", [*map(str, files)], contents, list(options), by=READER)


def _store(entry: CacheEntry, building: Building) -> None:
    try:
        entry.write(stored(building))
    except _NotStored as error:
        log.info("the building is not cached: it holds a %s", error)


def stored(building: Building) -> dict[str, NDArray[Any]]:
    """A building as arrays.

    Raises: `_NotStored` where an object in it is none of `RECORDS`, plain values and arrays.
    """
    records: list[Any] = []
    number: dict[int, int] = {}
    arrays: list[NDArray[Any]] = []

    def plain(value: Any) -> Any:
        """A value as JSON has it: lists have a tag in front."""
        kind = type(value)
        if kind in PLAIN:
            return value
        if RECORDS.get(kind.__name__) is kind:
            if id(value) not in number:
                record = [kind.__name__, *(plain(getattr(value, f.name)) for f in fields(value))]
                number[id(value)] = len(records)
                records.append(record)
            return ["record", number[id(value)]]
        if kind is np.ndarray and value.dtype.kind in "fiub":
            arrays.append(value)
            return ["array", len(arrays) - 1]
        if isinstance(value, Path):
            return ["path", str(value)]
        if kind is dict:
            return ["dict", *([plain(key), plain(one)] for key, one in value.items())]
        if kind.__name__ in SEQUENCES and kind is SEQUENCES[kind.__name__]:
            return [kind.__name__, *map(plain, value)]
        raise _NotStored(kind.__name__)

    whole = plain(building)
    shapes = [[a.dtype.str, *a.shape] for a in arrays]
    text = json.dumps([whole, records, shapes]).encode()
    flat = [np.ascontiguousarray(a).reshape(-1).view(np.uint8) for a in arrays if a.size]
    none = np.empty(0, dtype=np.uint8)
    return {"text": np.frombuffer(text, np.uint8), "values": np.concatenate([none, *flat])}


def _restored(data: Mapping[str, NDArray[Any]]) -> Building:
    whole, records, shapes = json.loads(data["text"].tobytes())
    values, first = data["values"], 0
    arrays: list[NDArray[Any]] = []
    for kind, *shape in shapes:
        array = np.empty(shape, kind)
        array.reshape(-1).view(np.uint8)[:] = values[first : first + array.nbytes]
        arrays.append(array)
        first += array.nbytes
    made: list[Any] = []

    def value(of: Any) -> Any:
        if not isinstance(of, list):
            return of
        tag, *rest = of
        if tag == "record":
            return made[rest[0]]
        if tag == "array":
            return arrays[rest[0]]
        if tag == "path":
            return Path(rest[0])
        if tag == "dict":
            return {value(key): value(one) for key, one in rest}
        return SEQUENCES[tag](map(value, rest))

    for name, *held in records:
        kind = RECORDS[name]
        record = object.__new__(kind)  # as it was stored: nothing is checked or derived again
        for field, one in zip(fields(kind), held, strict=True):
            object.__setattr__(record, field.name, value(one))
        made.append(record)
    building = value(whole)
    if not isinstance(building, Building):
        raise ValueError("no building")
    return building


# Properties of an element that a selector names, by its keys
KEYS = {
    "name": "name",
    "material": "material",
    "layer": "layer",
    "storey": "storey",
    "location": "storey",
    "class": "ifc_class",
}
FACET = re.compile(r'\s*(\w+)\s*(!?=)\s*("[^"]*"|/[^/]*/|[^,+]+)')


def selected(elements: Iterable[Element], selector: str, file: str | Path = "") -> frozenset[str]:
    """GUIDs of the elements that a selector chooses.

    A selector has facets with commas between them that all hold: a GUID, or `name=`, `material=`,
    `layer=`, `storey=` or `class=` with a text or a regular expression (`name=/PV.*/`), `!=` for
    the others; `+` joins groups.

    Raises: `DataError` for a text that is no selector.
    """
    elements = list(elements)
    guids = {element.guid for element in elements}
    names: set[str] = set()
    for group in re.split(r'\+(?=(?:[^"/]|"[^"]*"|/[^/]*/)*$)', selector):
        rest = FACET.sub("", group).strip(" ,")
        named = {text.strip() for text in rest.split(",") if text.strip()}
        if not group.strip() or not named <= guids:
            wrong = ", ".join(sorted(named - guids)) or "nothing"
            message = f"expected a GUID, or {', '.join(KEYS)} with = and a value, got {wrong}"
            raise DataError(message, file=file or None, field=selector)
        facets = [_facet(*match.groups(), selector, file) for match in FACET.finditer(group)]
        names |= {
            element.guid
            for element in elements
            if (not named or element.guid in named) and all(holds(element) for holds in facets)
        }
    return frozenset(names)


def _facet(key: str, sign: str, value: str, selector: str, file: str | Path) -> Callable[[Element], bool]:
    """Whether an element has a property."""
    field, value = KEYS.get(key.lower()), value.strip()
    if field is None:
        message = f"expected one of {', '.join(KEYS)}, got {key!r}"
        raise DataError(message, file=file or None, field=selector)
    if value.startswith("/") and value.endswith("/"):
        try:
            pattern = re.compile(value[1:-1])
        except re.error as error:
            message = f"{value} is no regular expression: {error}"
            raise DataError(message, file=file or None, field=selector) from None
        return lambda element: bool(pattern.match(getattr(element, field))) == (sign == "=")
    text = value.strip('"')
    return lambda element: (getattr(element, field) == text) == (sign == "=")


Progress = Callable[[str, float], None]
STAGES = {"opening": 0.4, "geometry": 0.3, "rooms": 0.2, "surroundings": 0.1}  # shares of the time


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What is chosen of a building's file; each format says which of them it has."""

    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether furniture is in the light and the views of its room
    apertures: tuple[str, ...] = ()  # materials of the surfaces that are windows
    surroundings: tuple[Path, ...] = ()  # files of the surroundings, of any format
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
    facade_panes: tuple[str, ...] = ()  # materials of panes before dark rooms: they mirror
    linked: tuple[Path, ...] = ()  # further files of the same building: facade, structure, site
    rooms: tuple[str, ...] = ()  # names that are asked for, to refuse wrong ones at once
    storeys: tuple[str, ...] = ()  # that are read, with the next above and below; none: all


@dataclass(frozen=True, slots=True)
class BuildingFormat:
    """How files of some endings are checked and read; the readers load what they need."""

    name: str
    suffixes: tuple[str, ...]
    check: Callable[[Path], None]  # what can be said at once, before anything heavy is loaded
    reader: Callable[[Path, ReadOptions, Progress], Building]
    has: tuple[str, ...] = ()  # fields of `ReadOptions` that it knows


def read_building_file(
    path: str | PathLike[str],
    options: ReadOptions | None = None,
    progress: Progress | None = None,
    *,
    cache: MatrixCache | None = None,
) -> Building:
    """The building of an IFC file, with the corrections kept beside it, or of another format.

    Args:
        progress: called with the stage's name and the fraction of it that is done.
        cache: of buildings read from IFC files, which are not read again while they are the same.

    Raises: `DataError` for a file that cannot be used, or an option that its format has not.
    """
    options = options or ReadOptions()
    path, *linked = building_files((path, *options.linked))
    options = replace(options, linked=tuple(linked))
    refuse_unread_format(path)
    kind = _format(path)
    for field in FLAGS:
        if getattr(options, field) and field not in kind.has:
            raise DataError(f"not for {kind.name} files", file=path, field=f"--{FLAGS[field]}")
    read = partial(kind.reader, path, options, progress or (lambda stage, fraction: None))
    if cache is not None and kind is IFC:
        chosen = options.join, options.furniture, options.storeys
        building = read_once(read, (path, *linked), chosen, cache)
    else:
        building = read()
    return surrounded(building, options.surroundings, options.surroundings_offset)


def read_elements(
    path: Path,
    select: Sequence[str],
    *,
    options: ReadOptions | None = None,
    leave_out: Sequence[str] = (),
    reflectance: float | None = None,
    selected_in: str | Path = "",
    progress: Progress | None = None,
) -> tuple[Building, tuple[frozenset[str], ...]]:
    """Building without rooms, of a file of any format, and the GUIDs that each selector chooses.

    Args:
        select: selectors, in an IFC file those of ifcopenshell, else those of `selected`.
        options: of the reader; leave_out: selectors of elements that are not there.
        reflectance: of all opaque elements instead of the file's.
        selected_in: the file that has the selectors, for messages.

    Raises: `DataError` for a file that cannot be used, or a text that is no selector.
    """
    if is_ifc(path):
        from bim.ifc.corrections import corrections_beside
        from bim.ifc.outdoor_model import read_outdoor_model

        beside = corrections_beside(path)
        corrections = replace(
            beside,
            leave_out=(*beside.leave_out, *leave_out),
            surroundings=beside.surroundings if reflectance is None else reflectance,
        )
        return read_outdoor_model(
            path,
            select,
            linked=() if options is None else options.linked,
            corrections=corrections,
            selected_in=selected_in,
            progress=progress,
        )
    options = options or ReadOptions()
    if _format(path) is RADIANCE:
        from bim.radiance.building import read_radiance_elements

        elements, issues = read_radiance_elements(path, options.facade_panes)
        name = path.stem
    else:
        building = read_building_file(path, options, progress)
        elements, issues, name = building.elements, building.issues, building.name
    gone = frozenset().union(*(selected(elements, one, selected_in) for one in leave_out))
    elements = tuple(element for element in elements if element.guid not in gone)
    chosen = tuple(selected(elements, one, selected_in) for one in select)
    if reflectance is not None:
        both = {"reflectance_visible": reflectance, "reflectance_solar": reflectance}
        elements = tuple(replace(element, **both) for element in elements)
    return Building(name, (), elements, tuple(issues), file=path), chosen


def surrounded(building: Building, files: Sequence[Path], offset: tuple[float, float, float] | None) -> Building:
    """The building with what files hold of its surroundings, if there are any."""
    if not files:
        return building
    from bim.surroundings.placement import with_surroundings

    return with_surroundings(building, files, offset)


def check_building_file(path: str | PathLike[str]) -> None:
    """What can be said at once of a building's file, and of the corrections beside it.

    Raises: `DataError` for a file that is none of its format, or of a format that is not read.
    """
    refuse_unread_format(Path(path))
    _format(Path(path)).check(Path(path))


def check_room_names(paths: Sequence[Path], rooms: Sequence[str]) -> None:
    """Refuse names that no room of IFC files can have, before anything heavy is loaded.

    The text of the files is searched for a space, zone or storey of each name. The model is opened
    only for a name that is not found so.

    Raises: `DataError`.
    """
    if not (rooms and paths and all(map(is_ifc, paths))):
        return
    names = {key for path in paths for key in _written_names(path.read_bytes())}
    absent = [room for room in rooms if name_key(room) not in names]
    if absent:
        from bim.ifc.project import open_all
        from bim.ifc.spaces import check_rooms

        check_rooms([*open_all(paths).values()], absent, paths[0], corrections_beside(paths[0]).room_names)


def _written_names(text: bytes) -> Iterator[str]:
    """Keys of the texts of each space, zone and storey of a STEP file, and of its two names as a label."""
    for entity in NAMED.finditer(text):
        texts = [one.replace("''", "'") for one in TEXT.findall(entity[1].decode("latin-1"))]
        texts = [WIDE.sub(lambda code: bytes.fromhex(code[1]).decode("utf-16-be", "replace"), one) for one in texts]
        yield from map(name_key, texts)
        # GlobalId, Name, then a description or an object type if any, LongName
        yield from (name_key(label_of(texts[1], one, "")) for one in texts[2:])


def refuse_unread_format(path: Path) -> None:
    """Raise `DataError` for a known format that is not read; it says which file to give instead."""
    reason = UNREAD.get(path.suffix.lower())
    if reason is None and path.is_file() and path.suffix.lower() not in IFC.suffixes[1:]:
        with path.open("rb") as stream:
            start = stream.read(4096)
        reason = next((UNREAD[kind] for mark, kind in MARKS if mark in start), None)
    if reason is not None:
        raise DataError(reason, file=path)


def building_files(paths: Iterable[str | PathLike[str]]) -> tuple[Path, ...]:
    """The files of a building; a folder is the IFC files in it, the one with most spaces first.

    Raises: `DataError` for a folder without any, and for a file that is no IFC beside others.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        inside = [path]
        if path.is_dir():
            inside = sorted(one for one in path.iterdir() if one.suffix.lower() in IFC.suffixes[:2])
            inside.sort(key=lambda one: -one.read_bytes().upper().count(b"IFCSPACE("))
            if not inside:
                raise DataError("expected IFC files in the folder, found none", file=path)
        files += inside
    for path in files if len(files) > 1 else ():
        if not is_ifc(path):
            raise DataError("of several files of a building each must be IFC", file=path)
    return tuple(files)


def is_ifc(path: str | PathLike[str]) -> bool:
    """Whether the file is read as IFC."""
    return _format(Path(path)) is IFC


def held_states(windows: Iterable[Window], path: str | PathLike[str]) -> dict[str, tuple[ShadingState, ...]]:
    """The shading states that a building's file holds for its windows, by GUID."""
    held: dict[str, tuple[ShadingState, ...]] = {}
    if is_ifc(path):
        from bim.ifc.fenestration_read import read_fenestration

        held = read_fenestration(path)
    return held | {window.guid: window.states for window in windows if window.states}


def files_beside(path: str | PathLike[str]) -> tuple[Path, ...]:
    """The files that change what is read of a building's file, besides itself."""
    corrections = corrections_file(path)
    return (corrections,) if is_ifc(path) and corrections.is_file() else ()


def _format(path: Path) -> BuildingFormat:
    """The format of a file's ending; IFC where the ending is unknown, whose check names it."""
    ending = path.suffix.lower()
    return next((kind for kind in FORMATS if ending in kind.suffixes), IFC)


def check_ifc(path: Path) -> None:
    """What can be said at once of an IFC file, and of the corrections beside it."""
    check_head(path)
    corrections_beside(path)


def _read_ifc(path: Path, options: ReadOptions, progress: Progress) -> Building:
    from bim.ifc.building import read_ifc

    return read_ifc(
        path,
        linked=options.linked,
        join=options.join,
        furniture=options.furniture,
        rooms=options.rooms,
        storeys=options.storeys,
        progress=progress,
    )


def _check_there(path: Path) -> None:
    if not path.is_file():
        raise DataError("no such file", file=path)


def _read_radiance(path: Path, options: ReadOptions, progress: Progress) -> Building:
    from bim.radiance.building import read_radiance_building

    progress("opening", 0.0)
    return read_radiance_building(path, options.apertures, options.facade_panes)


def _read_honeybee(path: Path, options: ReadOptions, progress: Progress) -> Building:
    from bim.honeybee.building import read_honeybee

    progress("rooms", 0.0)
    return read_honeybee(path, join=options.join, furniture=options.furniture)


def _check_gbxml(path: Path) -> None:
    from bim.gbxml.document import read_document

    read_document(path)


def _read_gbxml(path: Path, options: ReadOptions, progress: Progress) -> Building:
    from bim.gbxml.building import read_gbxml

    progress("rooms", 0.0)
    return read_gbxml(path, join=options.join, furniture=options.furniture)


FLAGS = {"join": "join", "apertures": "aperture", "facade_panes": "facade-pane", "storeys": "only-storey"}
UNREAD = {  # by suffix: what it is, and the file to give instead
    ".oct": "is a Radiance octree; give the scene files (.rad) that it was made of",
    ".ifcxml": "is ifcXML; export the model as IFC (.ifc), or convert it with IfcConvert",
    ".dfjson": "is a dragonfly model; write honeybee's HBJSON of it (Model.to_honeybee)",
    ".idf": "is an EnergyPlus input; give the building as gbXML or HBJSON",
    ".epjson": "is an EnergyPlus input; give the building as gbXML or HBJSON",
    ".osm": "is an OpenStudio model; export it as gbXML",
    ".epw": "is a weather file, not a building: give it as the weather",
    ".wea": "is a weather file, not a building: give it as the weather",
    ".hdr": "is a picture, not a building: the glare command rates it",
    ".pic": "is a picture, not a building: the glare command rates it",
    ".toml": "is a TOML file, not a building: give the building first, and this as an operation or a study",
    ".rvt": "is a Revit model; export it as IFC or gbXML",
    "bsdf": "is a BSDF, not a building: give it as the fenestration system",
    ".skp": "is a SketchUp model; export it as IFC, gbXML or HBJSON",
}
MARKS = (  # in the first bytes of a file of any suffix
    (b"#?RADIANCE\noconv", ".oct"),
    (b"<ifcXML", ".ifcxml"),
    (b":ifcXML", ".ifcxml"),
    (b"ISO_10303_28", ".ifcxml"),
    (b"dragonfly_version", ".dfjson"),
    (b"#?RADIANCE\nFORMAT=32-bit", ".hdr"),
    (b"LOCATION,", ".epw"),
    (b"<WindowElement", "bsdf"),
)
IFC = BuildingFormat("IFC", (".ifc", ".ifczip", ".zip"), check_ifc, _read_ifc, ("join", "linked", "storeys"))
RADIANCE = BuildingFormat("Radiance", (".rad",), _check_there, _read_radiance, ("apertures", "facade_panes"))
HONEYBEE = BuildingFormat("honeybee", (".hbjson",), read_json, _read_honeybee, ("join",))
GBXML = BuildingFormat("gbXML", (".gbxml", ".xml"), _check_gbxml, _read_gbxml, ("join",))
FORMATS: tuple[BuildingFormat, ...] = (IFC, RADIANCE, HONEYBEE, GBXML)


QUOTED = 3  # problems of the model that one message quotes


def chosen_spaces(
    building: Building,
    names: Sequence[str],
    path: Path,
    lit: Callable[[Space], bool] = lambda space: bool(space.windows),
) -> list[Space]:
    """The spaces of those names or GUIDs, or every space with a window.

    Args: lit: whether a space has one, or what counts as one.

    Raises: `DataError` that quotes what the model's problems say about a room that is not there.
    """
    chosen = named_spaces(building, names, path)
    if names:
        groups = [*map(building.zone, names), *map(building.storey, names)]
        zoned = {space.guid for group in groups for space in group}
        chosen = [space for space in chosen if lit(space) or space.guid not in zoned]
        for space in chosen:
            if not lit(space):
                about = [p for p in _lost(building, "window") if _names(p, space.name)]
                why = f": {_quoted(about)}" if about else ""
                raise DataError(f"has no window{why}", file=path, element=f"space {space.label}")
        return chosen
    chosen = [space for space in chosen if lit(space)]
    if not chosen:
        raise no_window(building, path)
    return chosen


def no_window(building: Building, path: Path) -> DataError:
    """That no space has a window, with what the model's problems say of it."""
    why = _because(building, "window") or _because(building, "room")
    what = f"no space has a window to the outside{why}"
    return DataError(what, file=path, element="IfcWindow")


def named_spaces(building: Building, names: Sequence[str], path: Path) -> list[Space]:
    """The spaces of those names or GUIDs, or of zones, each once, or all; with windows or not."""
    if not building.spaces:
        raise DataError(f"has no rooms (IfcSpace){_because(building, 'room')}", file=path)
    if not names:
        return list(building.spaces)
    chosen = (space for name in names for space in _spaces(building, name, path))
    return list({space.guid: space for space in chosen}.values())


def _spaces(building: Building, name: str, path: Path) -> Sequence[Space]:
    """The space of a name, else those of the zone or the storey of that name."""
    try:
        return (building.space(name),)
    except (UnknownName, AmbiguousName) as error:
        zone = building.zone(name) or building.storey(name)
        if zone and isinstance(error, UnknownName):
            return zone
        lost = [p for p in _lost(building, "room") if p.where == name or _names(p, name)]
        if isinstance(error, UnknownName) and lost:
            message = f"space {name!r} was left out: {_quoted(lost)}"
        else:
            message = unknown_room(error, name, (zone.name for zone in building.zones))
        raise DataError(message, file=path, field="space") from error


def _lost(building: Building, kind: str) -> list[Issue]:
    """The problems for which a "room" or "window" is not there."""
    return [issue for issue in building.issues if issue.effect.lost == kind]


def _names(issue: Issue, name: str) -> bool:
    """Whether an issue concerns rooms of that name, or with that name as whole words in theirs."""
    rooms = issue.values.get("rooms", issue.values.get("room", ""))
    text = " + ".join(map(str, rooms)) if isinstance(rooms, tuple) else str(rooms)
    return has_words(text, name)


def _because(building: Building, kind: str) -> str:
    cut_off = [issue for issue in building.issues if issue.code == "file-cut-off"]
    lost = [*cut_off, *_lost(building, kind)]
    return f": {_quoted(lost)}" if lost else ""


def _quoted(issues: Sequence[Issue]) -> str:
    """The first problems in one line, and how many more there are."""
    texts = [issue_text(issue, "command") for issue in issues[:QUOTED]]
    shown = "; ".join(f"{text.what} ({text.effect})" for text in texts)
    more = len(issues) - QUOTED
    return f"{shown}; and {more} more" if more > 0 else shown
