"""Notes of the thermal models: a template with fields in braces and its values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class ThermalNote(NamedTuple):
    """An English text and the values of its fields; a value may be such a note itself."""

    template: str
    values: Mapping[str, Any] = {}

    def __str__(self) -> str:
        """The text with its fields filled."""
        return self.template.format(**self.values)
