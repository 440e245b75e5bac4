"""What is known of a fenestration system besides its BSDF, from the `.toml` file beside it."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from scenes.fenestration.tables import ClosureTable
from thermal.closure import Closure
from thermal.errors import ThermalInputError
from thermal.gvalue import TYPICAL_SYSTEMS


@dataclass(frozen=True, slots=True)
class ThermalFile:
    """U, g, closure and the place of the shade of a system, from the file beside its BSDF.

    The file has the name of the XML file and may hold `u_value` [W/(m2 K)], `g_value` (at normal
    incidence), `g_value_by_patch` (for each incident patch of the Klems full basis),
    `shading_position` ("none", "external", "internal", "integrated") and, as a study's [[system]],
    `u_model`, a table `[gap]`, `realised_inner_resistance`, `realised_outer_resistance`.
    """

    u_value: float | None = None
    g_value: float | None = None
    g_value_by_patch: NDArray[np.float64] | None = None  # [K]
    closure: Closure | None = None
    shading_position: str | None = None

    @classmethod
    def read(cls, path: Path) -> ThermalFile:
        """The values of the file; nothing where there is none."""
        if not path.is_file():
            return cls()
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise DataError(f"is not TOML: {error}", file=path) from error
        return cls(
            _number(table, "u_value", path),
            _number(table, "g_value", path),
            _patches(table, path),
            _closure(table, path),
            _position(table, path),
        )


def _number(table: dict, field: str, path: Path) -> float | None:
    value = table.get(field)
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise DataError(f"expected a number, got {value!r}", file=path, field=field)
    return None if value is None else float(value)


def _patches(table: dict, path: Path) -> NDArray[np.float64] | None:
    patches, field = table.get("g_value_by_patch"), "g_value_by_patch"
    if patches is None:
        return None
    try:
        patches = np.array(patches, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError("expected a list of numbers", file=path, field=field) from error
    if patches.shape != (KLEMS_FULL.size,):
        message = f"expected {KLEMS_FULL.size} numbers, got {patches.size}"
        raise DataError(message, file=path, field=field)
    return patches


def _closure(table: dict, path: Path) -> Closure | None:
    known = {key: value for key, value in table.items() if key in ClosureTable.model_fields}
    try:
        return ClosureTable.model_validate(known).closure()
    except ThermalInputError as error:
        raise DataError(str(error), file=path) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        raise DataError(message, file=path, field=field or None) from error


def _position(table: dict, path: Path) -> str | None:
    position = table.get("shading_position")
    if position is not None and position not in TYPICAL_SYSTEMS:
        message = f"expected one of {', '.join(TYPICAL_SYSTEMS)}, got {position!r}"
        raise DataError(message, file=path, field="shading_position")
    return position
