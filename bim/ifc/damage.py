"""Data of an IFC file that ifcopenshell cannot read: left out, and reported as issues.

Only errors that ifcopenshell itself raises count as damage.  An error of our own code, such as a
wrong argument, ends the reading of the file.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import ifcopenshell
import ifcopenshell.util.element
import ifcopenshell.util.placement
import numpy as np
from numpy.typing import NDArray

from bim.report.issue import Issue, Phrase

PACKAGE = str(Path(ifcopenshell.__file__).parent)
Result = TypeVar("Result")
Default = TypeVar("Default")


class Damage:
    """Issues of the data that cannot be read, one for each element and kind of data."""

    def __init__(self) -> None:
        self._issues: dict[tuple[str, str], Issue] = {}

    @property
    def issues(self) -> list[Issue]:
        """The issues so far."""
        return list(self._issues.values())

    def read(
        self,
        function: Callable[..., Result],
        *arguments: Any,
        of: ifcopenshell.entity_instance | None,
        data: str,
        default: Default,
        **options: Any,
    ) -> Result | Default:
        """The result of a function of ifcopenshell; `default` where it fails on the file's data.

        Args:
            of: the element that the data belong to; None for the project.
            data: key of the phrase "data-..." that names them.
        """
        try:
            return function(*arguments, **options)
        except Exception as error:
            if not raised_by_ifcopenshell(error):
                raise
            self._report(of, data, error)
            return default

    def _report(self, of: ifcopenshell.entity_instance | None, data: str, error: Exception) -> None:
        guid = "project" if of is None else str(getattr(of, "GlobalId", None) or f"#{of.id()}")
        named = getattr(of, "Name", None) or ""
        label = "The project" if of is None else f"{of.is_a()} {named}"
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        values: dict[str, str | Phrase] = {"element": label, "data": Phrase(f"data-{data}"), "reason": reason}
        self._issues.setdefault((guid, data), Issue("damaged-data", guid, values))


def raised_by_ifcopenshell(error: Exception) -> bool:
    """Whether the function that was called is ifcopenshell's and raised the error itself."""
    called = _next(error.__traceback__)
    return called is not None and called.tb_frame.f_code.co_filename.startswith(PACKAGE)


def instances(model: ifcopenshell.file, name: str) -> list[ifcopenshell.entity_instance]:
    """The entities of a class; none where the file's schema does not have the class."""
    try:
        return list(model.by_type(name))
    except RuntimeError:
        return []


def type_of(element: ifcopenshell.entity_instance, damage: Damage | None = None) -> ifcopenshell.entity_instance | None:
    """The type of an element; None where the file states none."""
    damage = Damage() if damage is None else damage
    type_ = damage.read(ifcopenshell.util.element.get_type, element, of=element, data="type", default=None)
    return next(iter(entities(type_)), None)


def placement_of(element: ifcopenshell.entity_instance, damage: Damage | None = None) -> NDArray[np.float64] | None:
    """Placement [4, 4] of an element in the file's units; None where the file states none."""
    if element.ObjectPlacement is None:
        return None
    damage = Damage() if damage is None else damage
    matrix = damage.read(
        ifcopenshell.util.placement.get_local_placement,
        element.ObjectPlacement,
        of=element,
        data="placement",
        default=None,
    )
    return None if matrix is None else np.asarray(matrix, dtype=float)


def entities(value: Any) -> list[ifcopenshell.entity_instance]:
    """The entities of an attribute's value, which a damaged file may lack or have others in."""
    values = value if isinstance(value, tuple | list) else (value,)
    return [one for one in values if isinstance(one, ifcopenshell.entity_instance)]


def _next(traceback: TracebackType | None) -> TracebackType | None:
    return None if traceback is None else traceback.tb_next
