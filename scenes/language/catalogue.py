"""Text of a page in its language: English keys, their translations in a file for each language.

The language holds while a page is filled, as gettext's does: its text is made in many small
functions that know nothing else of the page.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.resources import files
from typing import Literal

Language = Literal["en", "de", "fr"]
MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip


def _catalogue(language: str) -> Mapping[str, str]:
    return tomllib.loads((files("scenes.language") / f"{language}.toml").read_text("utf-8"))


CATALOGUES: dict[str, Mapping[str, str]] = {name: _catalogue(name) for name in ("de", "fr")}
_now: ContextVar[str] = ContextVar("language", default="en")


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Within, pages are filled in that language."""
    before = _now.set(language)
    try:
        yield
    finally:
        _now.reset(before)


def said(text: str, **values: object) -> str:
    """English text in the page's language, its fields in braces filled.

    What the catalogue does not have stays English; a test sees to it that it has all that is shown.
    """
    found = CATALOGUES[_now.get()].get(text, text) if _now.get() != "en" else text
    return found.format(**values) if values else found


def decimal(number: str) -> str:
    """A number as text with the decimal mark of the page's language."""
    return number if _now.get() == "en" else number.replace(".", ",")


def month_name(month: int) -> str:
    """The name of a month, 1 to 12."""
    return said(MONTHS[month - 1])


def short_month(month: int) -> str:
    """The short name of a month, 1 to 12."""
    return said(MONTHS[month - 1][:3])
