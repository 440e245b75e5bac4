"""TOML files as checked tables: every fault is one line that names the file and the key.

What a key is called, what a table holds and what a value may be comes from the models alone: a
new field of a table needs no word here.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mitsuba_cfs.errors import DataError, no_such_key
from mitsuba_cfs.files import reason

T = TypeVar("T", bound=BaseModel)
Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Key = Annotated[str, Field(max_length=200)]  # a path of keys, as "box.window.0.width"

# What is wrong with a value, by pydantic's name of the fault; its `ctx` fills the braces
WANTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "too_short": "at least {min_length} entries",
    "too_long": "at most {max_length} entries",
    "string_too_short": "a text that is not empty",
    "string_too_long": "a text of at most {max_length} characters",
    "finite_number": "a finite number",
    "literal_error": "{expected}",
}
KINDS = {  # by the first word of "float_type", "float_parsing" and the like
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "string": "a text",
    "path": "the path of a file",
    "tuple": "a list",
    "list": "a list",
    "dict": "a table",
    "model": "a table",
}


class TomlTable(BaseModel):
    """A table that takes no key which it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def read_table(path: Path) -> dict[str, Any]:
    """What a TOML file holds; `DataError` where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DataError(f"is not TOML: {error}", file=path) from error
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error


def validated(model: type[T], table: dict[str, Any], path: Path) -> T:
    """The table as the model; `DataError` that names the first wrong key and how many more.

    A key that there is not comes first: what is missing or wrong besides often follows from it.
    """
    try:
        return model.model_validate(table)
    except ValidationError as error:
        faults = sorted(error.errors(include_url=False), key=lambda fault: not _is_key(fault))
        first, *others = faults
        place = [str(part) for part in first["loc"] if part != "[key]"]
        more = f" (and {len(others)} more)" if others else ""
        field = ".".join(place) or None
        raise DataError(_message(first, model) + more, file=path, field=field) from error


def check_kinds(model: type[BaseModel], table: Mapping[str, Any], path: Path) -> None:
    """`DataError` for the first value of a table that is of another kind than the model's.

    Keys that are missing, and values out of their range, pass: the table may be incomplete.
    """
    try:
        model.model_validate(table)
    except ValidationError as error:
        for fault in error.errors(include_url=False):
            if fault["type"].endswith("_type"):
                field = ".".join(map(str, fault["loc"]))
                raise DataError(_message(fault, model), file=path, field=field) from error


def tables_of(annotation: object) -> Iterator[type[BaseModel]]:
    """The models inside a type: its own, in its alternatives, entries or values."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from tables_of(inner)


def keys_of(annotation: object) -> tuple[str, ...] | None:
    """The keys that a type of table takes; None where it takes any, or is no table."""
    for alternative in _alternatives(annotation):
        if isinstance(alternative, type) and issubclass(alternative, BaseModel):
            return tuple(alternative.model_fields)
        if get_origin(alternative) is dict:
            key = next(_alternatives(get_args(alternative)[0]))
            return tuple(map(str, get_args(key))) if get_origin(key) is Literal else None
    return None


def _is_key(fault: Mapping[str, Any]) -> bool:
    return fault["type"] == "extra_forbidden" or fault["loc"][-1:] == ("[key]",)


def _message(fault: Mapping[str, Any], model: type[BaseModel]) -> str:
    """A fault as a message: the expected and the actual value."""
    *place, last = fault["loc"] or ("",)
    if last == "[key]":
        *place, last = place
    kind = fault["type"]
    if _is_key(fault):
        return no_such_key(str(last), keys_of(_at(model, place)) or ())
    if kind == "missing":
        return f"expected {last + 1} values" if isinstance(last, int) else "is missing"
    if kind == "value_error":
        return fault["msg"].removeprefix("Value error, ")
    wanted = WANTED.get(kind, "").format_map(fault.get("ctx", {}))
    if not wanted:
        wanted = KINDS.get(kind.partition("_")[0], fault["msg"])
    if kind == "tuple_type" and any(tables_of(_at(model, [*place, last]))):
        wanted = f"a list of tables, [[{'.'.join(map(str, [*place, last]))}]]"
    if "literal" in kind:
        return f"expected {wanted}, got {_shown(fault['input'])}{_near(fault, model)}"
    return f"expected {wanted}, got {_shown(fault['input'])}"


def _near(fault: Mapping[str, Any], model: type[BaseModel]) -> str:
    """The choice that a wrong one most resembles."""
    choices = [str(c) for alternative in _alternatives(_at(model, fault["loc"])) for c in get_args(alternative)]
    near = get_close_matches(str(fault["input"]), choices, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _shown(value: object) -> str:
    """A value as it may stand in a line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _at(annotation: object, place: list[str | int] | tuple[str | int, ...]) -> object:
    """The type at a path inside a type."""
    for part in place:
        result = None
        for alternative in _alternatives(annotation):
            if isinstance(alternative, type) and issubclass(alternative, BaseModel):
                field = alternative.model_fields.get(str(part))
                result = result or (field and field.annotation)
            elif get_origin(alternative) is dict:
                result = result or get_args(alternative)[1]
            elif get_origin(alternative) in (tuple, list) and isinstance(part, int):
                result = result or get_args(alternative)[0]
        annotation = result
    return annotation


def _alternatives(annotation: object) -> Iterator[object]:
    """The types that a type may be, without what annotates them."""
    if get_origin(annotation) is Annotated:
        yield from _alternatives(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, UnionType):
        for arg in get_args(annotation):
            yield from _alternatives(arg)
    else:
        yield annotation


class ReadTable(TomlTable):
    """How a building's file is read, see `bim.building_file.ReadOptions`."""

    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether furniture is in the light and the views of its room
    apertures: tuple[str, ...] = ()  # materials of a Radiance scene's windows
    facade_panes: tuple[str, ...] = ()  # materials of a Radiance scene's panes before dark rooms


class OutdoorTable(TomlTable):
    """What is around a building: files of obstructions, and the ground's reflectance."""

    surroundings: tuple[Path, ...] = ()  # of buildings, terrain, trees and horizons outdoors
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
    # of the ground: a number, twelve by month, "file" (the weather's albedo) or "snow" (its depth)
    albedo: (
        Share | Annotated[tuple[Share, ...], Field(min_length=12, max_length=12)] | Literal["file", "snow"] | None
    ) = None


def read_options(*tables: TomlTable) -> dict[str, object]:
    """The keys of these tables as options of `InputOptions`."""
    names = (*ReadTable.model_fields, *OutdoorTable.model_fields)
    return {name: getattr(table, name) for table in tables for name in names if name in type(table).model_fields}


def set_key(table: Any, parts: list[str], value: Any, *, made: bool) -> None:
    """Set a key down a path; a list without a number is all of its entries."""
    first, *rest = parts
    if isinstance(table, list | tuple):
        if first.isdecimal():
            if int(first) >= len(table):
                raise DataError(f"there is no entry {first}: there are {len(table)}")
            if not rest and isinstance(table, list):
                table[int(first)] = value
                return
            set_key(table[int(first)], rest, value, made=made)
            return
        if not table:
            raise DataError(f"there is no entry to set {first!r} in")
        for one in table:
            set_key(one, parts, value, made=made)
        return
    if not isinstance(table, dict):
        raise DataError(f"there is no table to set {first!r} in, but {_shown(table)}")
    if not rest:
        table[first] = value
        return
    if table.get(first) is None:
        if not made:
            raise DataError(no_such_key(first, tuple(name for name, one in table.items() if one is not None)))
        table[first] = {}
    if isinstance(table[first], tuple):
        table[first] = list(table[first])
    set_key(table[first], rest, value, made=made)


def with_absolute_files(value: Any, folder: Path) -> Any:
    """A table whose texts that name files of a folder are their absolute paths."""
    if isinstance(value, dict):
        return {key: with_absolute_files(one, folder) for key, one in value.items()}
    if isinstance(value, list):
        return [with_absolute_files(one, folder) for one in value]
    if isinstance(value, str) and value and (folder / value).is_file():
        return str((folder / value).absolute())
    return value
