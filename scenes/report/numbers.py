"""Numbers as a reader wants them: sensible digits, true minus signs, thousands set apart."""

from __future__ import annotations

import math

from scenes.language.catalogue import decimal, said

NARROW_SPACE = "\u202f"
MISSING = "–"


def rounded(value: float, digits: int) -> str:
    """Fixed decimals, for prose and cards; thousands set apart by a narrow space."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:,.{digits}f}".replace(",", NARROW_SPACE)
    if text.startswith("-"):
        text = text[1:] if not text.strip("-0.") else "−" + text[1:]
    return decimal(text)


def counted(number: int, noun: str) -> str:
    """So many of something."""
    return f"{rounded(number, 0)} {said(noun if number == 1 else noun + 's')}"


def significant(value: float, digits: int = 3) -> str:
    """So many significant digits, without an exponent from 1e-4 to 1e9."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 1e9:
        return decimal(f"{value:.{digits - 1}e}")
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return rounded(round(value, decimals), max(decimals, 0))


def percent(value: float) -> str:
    """A percentage: whole from 10 on, one decimal below; 100 only when nothing is missing."""
    if value is None or not math.isfinite(value):
        return MISSING
    if 99.5 <= value < 100:
        return rounded(min(value, 99.9), 1)
    return rounded(value, 0 if abs(value) >= 9.95 or value == 0 else 1)


def cell(value: float, digits: int) -> str:
    """Fixed decimals for a table that is copied into a spreadsheet: no thousands marks."""
    return decimal(f"{value:.{digits}f}") if value is not None and math.isfinite(value) else ""


def share(value: float) -> str:
    """A fraction as a percentage with two significant digits, for errors."""
    return significant(100 * value, 2)
