"""Numbers and dates as a reader of the page's language wants them.

Digits are rounded as Python rounds; thousands are set apart by a narrow space in every language
(ISO 80000-1); names of months and the order of a date are those of CLDR, by Babel.
"""

from __future__ import annotations

import math
from datetime import date
from functools import lru_cache
from typing import TYPE_CHECKING

from scenes.language.catalogue import NARROW_SPACE, current_language, decimal, gettext

if TYPE_CHECKING:
    import pandas as pd

MISSING = "–"
LOCALES = {"en": "en_GB", "de": "de_DE", "fr": "fr_FR"}


def rounded(value: float, digits: int) -> str:
    """Fixed decimals, for prose and cards; thousands set apart by a narrow space."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:,.{digits}f}".replace(",", NARROW_SPACE)
    if text.startswith("-"):
        text = text[1:] if not text.strip("-0.") else "−" + text[1:]
    return decimal(text)


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


def colon(name: str, text: str) -> str:
    """A text after its name, with the language's space before the colon."""
    return gettext("{name}: {text}", name=name, text=text)


def semicolons(parts: list[str] | tuple[str, ...]) -> str:
    """Parts of a list that have commas of their own."""
    return gettext("; ").join(parts)


def inside(name: str) -> str:
    """A name as it stands inside a sentence; German nouns keep their capital, as do acronyms."""
    if current_language() == "de" or not name[1:2].islower():
        return name
    return name[:1].lower() + name[1:]


def listed(names: list[str]) -> str:
    """Names with "and" before the last."""
    if len(names) == 1:
        return names[0]
    return gettext("{names} and {last}", names=", ".join(names[:-1]), last=names[-1])


def month_name(month: int) -> str:
    """The name of a month, 1 to 12, as it stands by itself."""
    return _months("wide", _locale())[month]


def short_month(month: int) -> str:
    """The short name of a month, 1 to 12."""
    return _months("abbreviated", _locale())[month]


def day_and_month(time: pd.Timestamp, *, short: bool = False) -> str:
    """A date without its year: the year of a weather file means nothing."""
    return _date(time.date(), "MMMd" if short else "MMMMd", _locale())


@lru_cache(maxsize=512)  # Babel takes 0.1 ms; a chart names each of its days 24 times, in every room
def _date(day: date, skeleton: str, locale: str) -> str:
    from babel.dates import format_skeleton

    return format_skeleton(skeleton, day, locale=locale)


def spoken(time: pd.Timestamp) -> str:
    """A date and a clock time in a sentence."""
    return gettext("{date} at {clock}", date=day_and_month(time), clock=f"{time:%H:%M}")


@lru_cache(maxsize=16)
def _months(width: str, locale: str) -> dict[int, str]:
    from babel.dates import get_month_names

    return dict(get_month_names(width, context="stand-alone", locale=locale))


def _locale() -> str:
    return LOCALES.get(current_language(), LOCALES["en"])
