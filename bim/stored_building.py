"""Buildings in the cache: reading IFC files takes as long as tracing rooms.

The file holds arrays and JSON, and on reading no other classes than those of `RECORDS` are made.
An object that several parts of a building share (a construction, a gloss) is one object again.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.account import Account, StoreyAccount
from bim.fenestration import AngularGValue, PlainGlass, ShadingState
from bim.ifc.corrections import corrections_file
from bim.model import (
    Building,
    Construction,
    Element,
    Face,
    Georeference,
    MaterialLayer,
    Space,
    SpaceGroup,
    Window,
)
from bim.report.issue import Effect, Issue, Phrase
from mitsuba_cfs.files import sha256
from mitsuba_cfs.gloss import Gloss
from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache
from mitsuba_cfs.processes import ended_processes

RECORDS = {
    kind.__name__: kind
    for kind in (
        Account, AngularGValue, Building, Construction, Effect, Element, Face, Georeference, Gloss,
        Issue, MaterialLayer, Phrase, PlainGlass, ShadingState, Space, SpaceGroup, StoreyAccount,
        Window,
    )
}  # fmt: skip
PLAIN = (str, int, float, bool, type(None))
SEQUENCES = {"tuple": tuple, "list": list}
READER = "bim.building_file"  # the module that reads and stores; its source is a part of the key

log = logging.getLogger(__name__)


class _NotStored(Exception):
    """The building holds an object of another class."""


def read_once(
    read: Callable[[], Building],
    files: Sequence[Path],
    options: Sequence[object],
    cache: MatrixCache,
) -> Building:
    """The building of IFC files from the cache; read and stored where it is not in it.

    It is not stored where a process of its reading was stopped or crashed: another time, with more
    memory or less other work, the building may have what it lacks now.

    Args: options: of the reader, besides the files and the corrections beside them.
    """
    entry = _entry(files, options, cache)
    building = None if entry is None else entry.read(_restored)
    if building is None:
        with ended_processes() as ended:
            building = read()
        # files that changed while they were read are not those of the key
        if entry is not None and not ended and entry == _entry(files, options, cache):
            _store(entry, building)
    return building


def _entry(
    files: Sequence[Path], options: Sequence[object], cache: MatrixCache
) -> CacheEntry | None:
    """The entry by the content of all files; None where one of them cannot be read."""
    corrections = [corrections_file(file) for file in files]
    try:
        contents = [sha256(file) for file in files]
        contents += [sha256(file) if file.is_file() else "" for file in corrections]
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
