"""The error a user can cause in thermal input: it names the item."""

from __future__ import annotations


class ThermalInputError(ValueError):
    """Invalid thermal data: names the item, the expected and the actual value."""

    def __init__(self, item: str, message: str) -> None:
        self.item, self.message = item, message
        super().__init__(f"{item}: {message}")


def require(condition: bool, item: str, message: str) -> None:
    """Raise `ThermalInputError` naming `item` unless `condition` holds."""
    if not condition:
        raise ThermalInputError(item, message)


def require_range(value: float, low: float, high: float, item: str, unit: str = "") -> None:
    """Raise `ThermalInputError` unless low <= value <= high (NaN fails)."""
    expected = f"expected {low:g} to {high:g} {unit}".rstrip()
    require(bool(low <= value <= high), item, f"{expected}, got {value:g}")
