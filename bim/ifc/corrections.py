"""A project's corrections of its model, kept beside it in a small TOML file.

`model.corrections.toml` beside `model.ifc` is used without being asked for:

    leave_out = ['IfcBuildingElementProxy', 'IfcSlab, type="Canopy"']   # selectors of ifcopenshell
    opaque = ['IfcWindow, Name="Sign"']  # what is drawn transparent there is no glass
    keep = ['IfcShadingDevice, Name=/Louvre.*/']   # traced, though a BSDF with a shade is behind it
    only = ['IfcWall', 'IfcSlab', 'IfcWindow', 'IfcSpace']              # nothing else is read
    join = [["Hall", "Living"]] # rooms open to each other that are to be one
    surroundings = 0.2          # diffuse reflectance of everything outdoors
    north = 30                  # direction of the model's +y axis, in degrees from north to east
    outdoors = ['IfcSpace, LongName="Loggia"']     # spaces that are no rooms
    indoors = ['IfcSpace, Name="A.12"']            # rooms, whatever their shape and name
    as_drawn = ['IfcSpace, Name="A.13"']           # spaces whose drawn height holds
    close_gaps = 0.3            # in a file without spaces: gaps between elements to close [m]

    [[reflectance]]
    select = 'IfcWall, material="Brick"'
    visible = 0.3
    solar = 0.35                # the visible one if left out
    specular = 0.04             # like a mirror besides, at normal incidence; 0 if left out
    roughness = 0.05            # of that, Radiance's (Ward's alpha); 0, a mirror, if left out

    [[material]]
    name = "Sandwich panel*"    # of the file's materials; * stands for any text
    conductivity = 0.025        # W/(m K); or u = 0.3, of a wall of this layer alone, W/(m2 K)
    density = 40                # kg/m3; as the file or the table of materials, if left out
    heat_capacity = 1400        # J/(kg K); likewise

    [[room]]
    select = 'IfcSpace, Name="3"'
    name = "1.03"               # number or short name; the file's, if left out
    long_name = "Kitchen"       # likewise

    [[glass]]
    select = 'IfcWindow, Name="W1"'   # windows, doors, and openings that nothing fills
    area = 1.8                  # m2 of glass in each; 0: none

Selectors choose by GUID, class, name, type, material, storey (location), property and more:
https://docs.ifcopenshell.org/ifcopenshell-python/selector_syntax.html; and by CAD layer, which is
ours: 'IfcWall, layer="A-WALL"'.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bim.material_names import MaterialCorrection
from mitsuba_cfs.errors import DataError, no_such_key
from mitsuba_cfs.files import reason
from mitsuba_cfs.gloss import ROUGHEST, Gloss, lacquer

if TYPE_CHECKING:
    import ifcopenshell

LAYER = re.compile(r'(?:^|,)\s*layer\s*=\s*("[^"]*"|[^,+]+)')  # CAD layer: ours, not ifcopenshell's
KEYS = (
    "leave_out",
    "only",
    "opaque",
    "keep",
    "join",
    "surroundings",
    "reflectance",
    "north",
    "outdoors",
    "indoors",
    "material",
    "close_gaps",
    "as_drawn",
    "room",
    "glass",
)
OPEN = "open"  # asks for the rooms that are open to each other by more than a door
PAINT_KEYS = ("select", "visible", "solar", "specular", "roughness")
MATERIAL_KEYS = {  # of [[material]]: lowest and highest value
    "conductivity": (0.005, 500.0),
    "u": (0.05, 10.0),
    "density": (0.5, 12000.0),
    "heat_capacity": (100.0, 5000.0),
}


@dataclass(frozen=True, slots=True)
class Paint:
    """Reflectances for the elements that a selector chooses."""

    select: str
    visible: float
    solar: float
    gloss: Gloss | None = None


@dataclass(frozen=True, slots=True)
class RoomName:
    """Names of the spaces that a selector chooses; None: as in the file."""

    select: str
    name: str | None
    long_name: str | None


@dataclass(frozen=True, slots=True)
class Corrections:
    """What to leave out of a model and what to repaint."""

    leave_out: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    paints: tuple[Paint, ...] = ()
    surroundings: float | None = None
    join: tuple[tuple[str, ...], ...] = ()  # names or GUIDs of rooms to make one
    file: str = ""
    keep: tuple[str, ...] = ()  # shading devices that are traced before any BSDF
    opaque: tuple[str, ...] = ()  # elements without glass, whatever they are drawn as
    join_open: bool = False  # rooms open to each other by more than a door are one
    north_deg: float | None = None  # direction of the model's +y axis, from north to east
    outdoors: tuple[str, ...] = ()  # spaces that are no rooms
    indoors: tuple[str, ...] = ()  # spaces that are rooms
    materials: tuple[MaterialCorrection, ...] = ()  # the first that matches counts
    as_drawn: tuple[str, ...] = ()  # spaces that are neither cut nor raised
    close_gaps: float | None = None  # between elements, where rooms are searched [m]
    room_names: tuple[RoomName, ...] = ()
    glass: tuple[tuple[str, float], ...] = ()  # selectors and area of glass [m2]

    def removed(self, model: ifcopenshell.file) -> set[int]:
        """STEP ids of the products that are not to be read."""
        gone: set[int] = set()
        for query in self.leave_out:
            gone |= chosen(model, query, self.file)
        if self.only:
            only: set[int] = set()
            for query in self.only:
                only |= chosen(model, query, self.file)
            openings = {one.id() for one in model.by_type("IfcOpeningElement")}
            gone |= {one.id() for one in model.by_type("IfcProduct")} - only - openings
        return gone

    def drawn_shades(self, model: ifcopenshell.file) -> set[int]:
        """STEP ids of the products that `keep` chooses."""
        return set().union(*(chosen(model, query, self.file) for query in self.keep))

    def unglazed(self, model: ifcopenshell.file) -> set[int]:
        """STEP ids of the products that `opaque` chooses."""
        return set().union(*(chosen(model, query, self.file) for query in self.opaque))

    def stated_outdoors(self, model: ifcopenshell.file) -> dict[int, bool]:
        """Whether spaces are outdoors, by STEP id, where the corrections say so."""
        result: dict[int, bool] = {}
        for queries, outdoors in ((self.outdoors, True), (self.indoors, False)):
            for query in queries:
                result |= dict.fromkeys(chosen(model, query, self.file), outdoors)
        return result

    def heights_as_drawn(self, model: ifcopenshell.file) -> set[int]:
        """STEP ids of the spaces whose drawn height holds."""
        return set().union(*(chosen(model, query, self.file) for query in self.as_drawn))

    def named(self, model: ifcopenshell.file) -> dict[int, RoomName]:
        """The names of spaces, by STEP id; later entries win."""
        return {step_id: one for one in self.room_names for step_id in chosen(model, one.select, self.file)}

    def glass_areas(self, model: ifcopenshell.file) -> dict[str, float]:
        """Area of glass [m2] of windows, doors and openings, by GUID; later entries win."""
        return {
            model.by_id(step_id).GlobalId: area
            for select, area in self.glass
            for step_id in chosen(model, select, self.file)
        }

    def painted(self, model: ifcopenshell.file) -> dict[int, Paint]:
        """The paint by STEP id; later entries win."""
        result: dict[int, Paint] = {}
        for paint in self.paints:
            for step_id in chosen(model, paint.select, self.file):
                result[step_id] = paint
        return result


def chosen(model: ifcopenshell.file, query: str, file: str | PathLike[str] = "") -> set[int]:
    """STEP ids of the elements that a selector chooses; `DataError` where it is none."""
    # here, so that a mistake in the small file is found before these are loaded
    from ifcopenshell.util.selector import filter_elements

    from bim.ifc.damage import raised_by_ifcopenshell
    from bim.ifc.elements import cad_layers_of

    step_ids: set[int] = set()
    for group in re.findall(r'(?:"[^"]*"|[^"+])+', query) if LAYER.search(query) else [query]:
        rest = LAYER.sub("", group).strip(" ,")
        try:
            elements = filter_elements(model, rest) if rest else set(model.by_type("IfcProduct"))
        except Exception as error:
            if not raised_by_ifcopenshell(error):  # the selector's parser raises many types
                raise
            reason = str(error).strip().splitlines()[0] if str(error).strip() else "no selector"
            raise DataError(reason, file=file or None, field=query) from None
        layers = {name.strip().strip('"') for name in LAYER.findall(group)}
        step_ids |= {one.id() for one in elements if layers <= set(cad_layers_of(one))}
    return step_ids


def corrections_file(model_path: str | PathLike[str]) -> Path:
    """Where the corrections of a model are kept: `<model>.corrections.toml` beside it."""
    return Path(model_path).with_suffix(".corrections.toml")


def corrections_beside(model_path: str | PathLike[str], join: Sequence[str] = ()) -> Corrections:
    """The corrections in the file beside the model, if there is one, and rooms to join besides.

    Args: join: texts of room names with a plus between them, as "Hall + Living"; or "open": all
        rooms that an opening larger than a door leads between.
    Raises: `DataError` for a wrong entry, or a text that names one room only.
    """
    path = corrections_file(model_path)
    corrections = read_corrections(path) if path.is_file() else Corrections()
    named = [text for text in join if text != OPEN]
    groups = [tuple(name.strip() for name in text.split("+") if name.strip()) for text in named]
    for text, group in zip(named, groups, strict=True):
        if len(group) < 2:
            message = f"expected rooms with a plus between them, as 'Hall + Living', got {text!r}"
            raise DataError(message, field="join")
    joined = (*corrections.join, *groups)
    return replace(corrections, join=joined, join_open=len(named) < len(join))


def read_corrections(path: str | PathLike[str]) -> Corrections:
    """Corrections from a TOML file; `DataError` names the entry that is wrong."""
    path = Path(path)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise DataError(f"is not TOML: {error}", file=path) from None
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    _check_keys(table, KEYS, path)
    paints = tuple(_paint(entry, path) for entry in _tables(table, "reflectance", path))
    surroundings = table.get("surroundings")
    if surroundings is not None:
        surroundings = _share(surroundings, path, "surroundings")
    groups = table.get("join", [])
    if not isinstance(groups, list):
        raise DataError("expected a list of lists of names", file=path, field="join")
    join = tuple(_texts({"join": group}, "join", path) for group in groups)
    return Corrections(
        _texts(table, "leave_out", path),
        _texts(table, "only", path),
        paints,
        surroundings,
        join,
        str(path),
        _texts(table, "keep", path),
        _texts(table, "opaque", path),
        north_deg=_north(table, path),
        outdoors=_texts(table, "outdoors", path),
        indoors=_texts(table, "indoors", path),
        materials=tuple(_material(entry, path) for entry in _tables(table, "material", path)),
        as_drawn=_texts(table, "as_drawn", path),
        close_gaps=(None if "close_gaps" not in table else _share(table["close_gaps"], path, "close_gaps")),
        room_names=tuple(_room_name(entry, path) for entry in _tables(table, "room", path)),
        glass=tuple(_glass(entry, path) for entry in _tables(table, "glass", path)),
    )


def _tables(table: dict[str, Any], key: str, path: Path) -> list[Any]:
    entries = table.get(key, [])
    if not isinstance(entries, list):
        raise DataError(f"expected tables, [[{key}]]", file=path, field=key)
    return entries


def _north(table: dict[str, Any], path: Path) -> float | None:
    value = table.get("north")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not -360 <= value <= 360:
        message = f"expected degrees from -360 to 360, got {value!r}"
        raise DataError(message, file=path, field="north")
    return float(value)


def _room_name(entry: dict[str, Any], path: Path) -> RoomName:
    select = _selector(entry, path, "room")
    _check_keys(entry, ("select", "name", "long_name"), path, "room.")
    texts = {key: value for key, value in entry.items() if key != "select"}
    if not texts or not all(isinstance(value, str) and value.strip() for value in texts.values()):
        raise DataError("expected name = '...', long_name = '...'", file=path, field="room")
    return RoomName(select, texts.get("name"), texts.get("long_name"))


def _glass(entry: dict[str, Any], path: Path) -> tuple[str, float]:
    select = _selector(entry, path, "glass")
    _check_keys(entry, ("select", "area"), path, "glass.")
    area = entry.get("area")
    if isinstance(area, bool) or not isinstance(area, int | float) or not 0 <= area <= 1e4:
        message = f"expected square metres from 0 to 10000, got {area!r}"
        raise DataError(message, file=path, field="glass.area")
    return select, float(area)


def _selector(entry: object, path: Path, key: str) -> str:
    if not isinstance(entry, dict) or not isinstance(entry.get("select"), str):
        raise DataError("expected select = '...'", file=path, field=key)
    return str(entry["select"])


def _material(entry: dict[str, Any], path: Path) -> MaterialCorrection:
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
        raise DataError("expected name = '...'", file=path, field="material")
    _check_keys(entry, ("name", *MATERIAL_KEYS), path, "material.")
    values = {key: value for key, value in entry.items() if key != "name"}
    if not values or {"conductivity", "u"} <= set(values):
        message = "expected conductivity or u, density, heat_capacity"
        raise DataError(message, file=path, field="material")
    for key, value in values.items():
        low, high = MATERIAL_KEYS[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            message = f"expected a number from {low:g} to {high:g}, got {value!r}"
            raise DataError(message, file=path, field=f"material.{key}")
    return MaterialCorrection(entry["name"], {k: float(v) for k, v in values.items()})


def _check_keys(table: dict[str, Any], known: Sequence[str], path: Path, prefix: str = "") -> None:
    """Refuse a key that there is not, naming the nearest."""
    for key in table:
        if key not in known:
            raise DataError(no_such_key(key, known), file=path, field=prefix + key)


def _paint(entry: dict[str, Any], path: Path) -> Paint:
    select = _selector(entry, path, "reflectance")
    _check_keys(entry, PAINT_KEYS, path, "reflectance.")
    if "visible" not in entry:
        raise DataError("expected visible = 0 to 1", file=path, field="reflectance")
    visible = _share(entry["visible"], path, "visible")
    solar = _share(entry.get("solar", visible), path, "solar")
    specular = _share(entry.get("specular", 0.0), path, "specular")
    roughness = _share(entry.get("roughness", 0.0), path, "roughness")
    if roughness > ROUGHEST:
        raise DataError(f"expected 0 to {ROUGHEST:g}, got {roughness:g}", file=path, field="roughness")
    if max(visible, solar) + specular > 1:
        message = "expected at most 1 together with visible and with solar"
        raise DataError(message, file=path, field="specular")
    return Paint(select, visible, solar, lacquer(specular, roughness) if specular else None)


def _share(value: object, path: Path, field: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1:
        raise DataError(f"expected a number from 0 to 1, got {value!r}", file=path, field=field)
    return float(value)


def _texts(table: dict[str, Any], key: str, path: Path) -> tuple[str, ...]:
    values = table.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise DataError("expected a list of texts", file=path, field=key)
    return tuple(values)
