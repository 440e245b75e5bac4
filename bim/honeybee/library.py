"""Named objects of a honeybee file's extensions and the sets that give surfaces theirs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError

OUTDOORS = ("Outdoors", "Ground")
PARTS = {"Wall": "wall_set", "Floor": "floor_set", "RoofCeiling": "roof_ceiling_set"}
MOST = 1e9  # a number of a file beyond this is a fault of it
NAMED = 4  # of many things so many are named


class NamedObjects:
    """The objects of one extension by identifier, those of its global set among them."""

    def __init__(self, properties: Mapping[str, Any], kinds: tuple[str, ...], sets: str, file: Path) -> None:
        """kinds: lists of objects, such as "materials"; sets: the extension's noun."""
        self.file = file
        self.issues: list[Issue] = []  # names of objects that are not in the file
        self._sets = self._listed(properties, f"{sets}_sets")
        default = properties.get(f"global_{sets}_set")
        default = self._sets.get(default) if isinstance(default, str) else default
        self._global = default if isinstance(default, dict) else {}
        inner = {kind: self._listed(self._global, kind) for kind in kinds}
        self._objects = {kind: inner[kind] | self._listed(properties, kind) for kind in kinds}
        self._noun, self._kind = sets, kinds[-1]

    def find(self, kind: str, name: str) -> dict[str, Any] | None:
        """The object of that identifier."""
        return self._objects[kind].get(name)

    def name(self, own: Mapping[str, Any], room: Mapping[str, Any], part: str, field: str) -> str | None:
        """What a surface names itself, else its room's set, else the global one; None if none does.

        An object in place of a name, as files that are not abridged have it, is known by its name
        from then on; a name that the file lacks is reported, and the next one counts.

        Args: part, field: where a set has it, such as "wall_set"; part "": in the set itself.
        """
        of_room = room.get(f"{self._noun}_set")
        if isinstance(of_room, str) and of_room not in self._sets:
            self._missing(f"{self._noun}_set", of_room)
        sets = of_room if isinstance(of_room, dict) else self._sets.get(str(of_room), {})
        candidates = [own.get(self._noun)]
        for one in (sets, self._global):
            inner = one.get(part) if part else one
            candidates.append(inner.get(field) if isinstance(inner, dict) else None)
        for one in candidates:
            if isinstance(one, dict) and isinstance(one.get("identifier"), str):
                return self._held(one)
            if isinstance(one, str) and one in self._objects[self._kind]:
                return one
            if one is not None:
                self._missing(self._noun, one)
        return None

    def _held(self, one: dict[str, Any]) -> str:
        """The identifier of an object that stands in place of its name.

        Raises: `DataError` where another object has that identifier.
        """
        name = one["identifier"]
        if self._objects[self._kind].setdefault(name, one) != one:
            raise self.fault("there is another one with this identifier", one, self._noun)
        return name

    def _missing(self, field: str, name: Any) -> None:
        """Report a name that nothing in the file has."""
        values = {"field": field, "reason": f"{name!r:.60} is not in the file"}
        issue = Issue("value-not-read", self.file.name, values)
        if issue not in self.issues:
            self.issues.append(issue)

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
