"""Named objects of a honeybee file's extensions and the sets that give surfaces theirs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mitsuba_cfs.errors import DataError

OUTDOORS = ("Outdoors", "Ground")
PARTS = {"Wall": "wall_set", "Floor": "floor_set", "RoofCeiling": "roof_ceiling_set"}
MOST = 1e9  # a number of a file beyond this is a fault of it
NAMED = 4  # of many things so many are named


class NamedObjects:
    """The objects of one extension by identifier, those of its global set among them."""

    def __init__(
        self, properties: Mapping[str, Any], kinds: tuple[str, ...], sets: str, file: Path
    ) -> None:
        """kinds: lists of objects, such as "materials"; sets: the extension's noun."""
        self.file = file
        default = properties.get(f"global_{sets}_set")
        self._global = default if isinstance(default, dict) else {}
        inner = {kind: self._listed(self._global, kind) for kind in kinds}
        self._objects = {kind: inner[kind] | self._listed(properties, kind) for kind in kinds}
        self._sets = self._listed(properties, f"{sets}_sets")
        self._noun = sets

    def find(self, kind: str, name: str) -> dict[str, Any] | None:
        """The object of that identifier."""
        return self._objects[kind].get(name)

    def name(
        self, own: Mapping[str, Any], room: Mapping[str, Any], part: str, field: str
    ) -> str | None:
        """What a surface names itself, else its room's set, else the global one; None if none does.

        Args: part, field: where a set has it, such as "wall_set"; part "": in the set itself.
        """
        if isinstance(own.get(self._noun), str):
            return own[self._noun]
        for one in (self._sets.get(str(room.get(f"{self._noun}_set")), {}), self._global):
            inner = one.get(part) if part else one
            found = inner.get(field) if isinstance(inner, dict) else None
            if isinstance(found, str):
                return found
        return None

    def number(
        self,
        thing: Mapping[str, Any],
        field: str,
        default: float | None = None,
        *,
        least: float = 0.0,
        most: float = MOST,
    ) -> float:
        """A field's number in its limits; the default where it is not stated or "automatic"."""
        value = thing.get(field)
        value = default if value is None or isinstance(value, dict) else value
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not least <= value <= most:
            between = f"from {least:g} to {most:g}" if most < MOST else f"of at least {least:g}"
            raise self.fault(f"expected a number {between}, got {value!r:.60}", thing, field)
        return float(value)

    def fault(self, message: str, thing: Mapping[str, Any], field: str) -> DataError:
        """An error that names the file, the object and the field."""
        name = str(thing.get("identifier", thing.get("type", "")))
        return DataError(message, file=self.file, element=name, field=field)

    def _listed(self, properties: Mapping[str, Any], kind: str) -> dict[str, dict[str, Any]]:
        listed = properties.get(kind) or []
        if not isinstance(listed, list):
            raise DataError("expected a list", file=self.file, field=kind)
        for one in listed:
            if not isinstance(one, dict) or not isinstance(one.get("identifier"), str):
                raise DataError("expected objects with an identifier", file=self.file, field=kind)
        return {one["identifier"]: one for one in listed}
