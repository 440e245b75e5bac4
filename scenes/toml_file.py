"""TOML files as checked tables: every fault is one line that names the file and the key."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mitsuba_cfs.errors import DataError

T = TypeVar("T", bound=BaseModel)
Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]


class TomlTable(BaseModel):
    """A table that takes no key which it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def read_table(path: Path) -> dict[str, Any]:
    """What a TOML file holds; `DataError` where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DataError(f"is not TOML: {error}", file=path) from error
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", file=path) from error


def validated(model: type[T], table: dict[str, Any], path: Path) -> T:
    """The table as the model; `DataError` that names the first wrong key and how many more."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        first, *others = error.errors(include_url=False)
        field = ".".join(str(part) for part in first["loc"])
        more = f" (and {len(others)} more)" if others else ""
        raise DataError(_said(first, model) + more, file=path, field=field or None) from error


def _said(fault: Mapping[str, Any], model: type[BaseModel]) -> str:
    """A fault in words: those of pydantic, but for keys that there are not."""
    if fault["type"] == "missing":
        return "is missing"
    if fault["type"] != "extra_forbidden":
        return fault["msg"].removeprefix("Value error, ")
    *place, key = fault["loc"]
    known = _keys(model, place)
    near = get_close_matches(str(key), known, n=1)
    return f"no such key; {f'did you mean {near[0]}?' if near else 'there are ' + ', '.join(known)}"


def _keys(model: type[BaseModel], place: list[str | int]) -> list[str]:
    """The keys of the table at a place inside a model."""
    for part in place:
        field = None if isinstance(part, int) else model.model_fields.get(part)
        if field is not None:
            model = next(_models(field.annotation), model)
    return list(model.model_fields)


def _models(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)
