"""Times as people write them: 90s, 20min, 2h."""

from __future__ import annotations

import re

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def seconds_of(text: str) -> float:
    """The seconds [s] of a time such as "20min"; `ValueError` for anything else."""
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*(s|min|h)\s*", text)
    if not match or float(match[1]) == 0:
        raise ValueError(f"expected a time such as 90s, 20min or 2h, got {text!r}")
    return float(match[1]) * UNITS[match[2]]


def spoken_time(seconds: float) -> str:
    """A time in the unit that suits it, three digits."""
    unit = "s" if seconds < 120 else "min" if seconds < 7200 else "h"
    return f"{seconds / UNITS[unit]:.3g} {unit}"


def share_of(text: str) -> float:
    """The share 0 to 1 of a text such as "10%" or "0.1"; `ValueError` for anything else."""
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*(%?)\s*", text)
    value = float(match[1]) / (100.0 if match[2] else 1.0) if match else 0.0
    if not 0 < value <= 1:
        raise ValueError(f"expected a share such as 10%, got {text!r}")
    return value
