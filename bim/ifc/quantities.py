"""Floor area and volume that an IFC file states for its spaces."""

from __future__ import annotations

AREA_NAMES = ("GrossFloorArea", "NetFloorArea", "GSA BIM Area", "Area", "Gross Area", "FloorArea",
              "Gemessene Nettofläche")  # fmt: skip
VOLUME_NAMES = ("NetVolume", "GrossVolume", "Volume", "Gross Volume")
BASE_SETS = ("Qto_SpaceBaseQuantities", "BaseQuantities")


def stated_quantities(
    psets: dict[str, dict], area_scale: float, volume_scale: float
) -> tuple[float | None, float | None]:
    """Stated floor area [m2] and volume [m3]; base quantities first, then other property sets."""
    return (
        _first(psets, AREA_NAMES, area_scale),
        _first(psets, VOLUME_NAMES, volume_scale),
    )


def _first(psets: dict[str, dict], names: tuple[str, ...], scale: float) -> float | None:
    order = sorted(psets, key=lambda name: (name not in BASE_SETS, name))
    for name in names:
        for pset in order:
            value = psets[pset].get(name)
            if isinstance(value, int | float) and not isinstance(value, bool) and value > 0:
                return float(value) * scale
    return None


def checked_volume(stated: float | None, drawn: float) -> tuple[float | None, str]:
    """The stated volume [m3], freed of a slip of the exporter's unit, and what the slip was.

    Revit writes GrossVolume as area in m2 times height in mm: a thousand times too much.
    """
    if stated is None:
        return None, ""
    for factor in (1e3, 1e-3, 1e9, 1e-9):
        if abs(stated / (factor * drawn) - 1) < 0.02:
            return stated / factor, f"stated volume {stated:g} is {factor:g} times the drawn one"
    return stated, ""
