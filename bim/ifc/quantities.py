"""Floor area and volume that an IFC file states for its spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

AREA_NAMES = (
    "GrossFloorArea",
    "NetFloorArea",
    "GSA BIM Area",
    "Area",
    "Gross Area",
    "FloorArea",
    "Gemessene Nettofläche",
)
VOLUME_NAMES = ("NetVolume", "GrossVolume", "Volume", "Gross Volume")
HEIGHT_NAMES = ("Height", "FinishCeilingHeight")
BASE_SETS = ("Qto_SpaceBaseQuantities", "BaseQuantities")
SAME = 1e-4  # of two numbers that the exporter computed from each other


@dataclass(frozen=True, slots=True)
class QuantityScales:
    """Factors from a file's units to SI."""

    length: float  # [m]
    area: float  # [m2]
    volume: float  # [m3]


def stated_quantities(psets: dict[str, dict[str, Any]], scales: QuantityScales) -> tuple[float | None, float | None]:
    """Stated floor area [m2] and volume [m3]; base quantities first, then other property sets."""
    return (_first(psets, AREA_NAMES, scales.area), _first(psets, VOLUME_NAMES, scales.volume))


def _first(psets: dict[str, dict[str, Any]], names: tuple[str, ...], scale: float) -> float | None:
    values = _all(psets, names)
    return values[0] * scale if values else None


def _all(psets: dict[str, dict[str, Any]], names: tuple[str, ...]) -> list[float]:
    """Every positive number of those names, the likeliest first."""
    order = sorted(psets, key=lambda name: (name not in BASE_SETS, name))
    values = (psets[pset].get(name) for name in names for pset in order)
    return [
        float(value) for value in values if isinstance(value, int | float) and not isinstance(value, bool) and value > 0
    ]


def checked_volume(
    stated: float | None, drawn: float, psets: dict[str, dict[str, Any]], length_scale: float
) -> tuple[float | None, tuple[str, dict[str, float]] | None]:
    """The stated volume [m3] without the exporter's error of unit; code and values of that error.

    Revit writes GrossVolume as area in m2 times height in mm: a thousand times too much. Where that
    height is not the room's own (it ends at the level above), the file states no volume of the
    room at all: None.

    Args:
        drawn: volume of the space's body [m3].
        psets: of the space, as the file has them.
        length_scale: metres of the file's unit of length.
    """
    if stated is None:
        return None, None
    for factor in (1e3, 1e-3, 1e9, 1e-9):
        if abs(stated / (factor * drawn) - 1) < 0.02:
            slip = {"stated": stated, "factor": factor}
            return stated / factor, ("volume-in-other-unit", slip)
    areas, heights = (_all(psets, names) for names in (AREA_NAMES, HEIGHT_NAMES))
    for height in heights:
        mixed = any(abs(stated / (area * height) - 1) < SAME for area in areas)
        if mixed and abs(length_scale - 1) > SAME:
            slip = {"stated": stated, "height": height, "height_m": height * length_scale}
            return None, ("volume-from-mixed-units", slip)
    return stated, None
