"""The errors a user can cause: all derive from `CfsError` and carry one clear line."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable
from difflib import get_close_matches
from os import PathLike
from typing import Any


class CfsError(Exception):
    """Root of every error that the command line prints as one line, without a traceback."""


class DataError(CfsError, ValueError):
    """A file or table that cannot be used: names the file, the element and the field."""

    def __init__(
        self,
        message: str,
        *,
        file: str | PathLike[str] | None = None,
        element: str | None = None,
        field: str | None = None,
    ) -> None:
        self.message, self.file, self.element, self.field = message, file, element, field
        where = [str(part) for part in (file, element, field) if part is not None]
        super().__init__(": ".join([*where, message]))


class RoomError(CfsError, ValueError):
    """A room that cannot be computed: no work plane, no closed zone.  Other rooms may go on."""


class VariantError(CfsError, RuntimeError):
    """No usable Mitsuba variant or LLVM library: says what to install."""


def check_number(name: str, value: Any, low: float, high: float = math.inf, *, whole: bool = False) -> None:
    """Raise `ValueError` that names an argument unless it is a finite number from low to high.

    Args: whole: whether it must be a whole number.
    """
    kinds = numbers.Integral if whole else numbers.Real
    is_number = isinstance(value, kinds) and not isinstance(value, bool)
    if is_number and math.isfinite(value) and low <= value <= high:
        return
    noun = "a whole number" if whole else "a number"
    limits = f"of {low:g} or more" if high == math.inf else f"from {low:g} to {high:g}"
    raise ValueError(f"{name}: expected {noun} {limits}, got {value!r:.60}")


def check_type(name: str, value: Any, kind: type) -> None:
    """Raise `ValueError` that names an argument unless it is of a type."""
    if not isinstance(value, kind):
        raise ValueError(f"{name}: expected {kind.__name__}, got {value!r:.60}")


def no_such_key(key: str, known: Iterable[str]) -> str:
    """Message for an unknown key: the known key that resembles it most, or all known keys."""
    folded = {one.casefold(): one for one in known}
    near = get_close_matches(key.casefold(), folded, n=1)
    instead = f"did you mean {folded[near[0]]}?" if near else "there are " + ", ".join(folded.values())
    return f"no such key; {instead}"
