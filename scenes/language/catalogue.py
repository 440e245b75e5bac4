"""Text of the pages in English, German and French: gettext messages with fields in braces.

The English text in code, templates and tables is the message; `de.po` and `fr.po` beside this
module hold its translations and are read when a page in their language is first filled.  The
language is a context variable: a page's text is made in many small functions.  `make catalogues`
brings the files up to date with the code.
"""

from __future__ import annotations

import io
import string
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from gettext import GNUTranslations, NullTranslations
from importlib.resources import files
from typing import TYPE_CHECKING, Literal

from mitsuba_cfs.notes import Note

if TYPE_CHECKING:
    from babel.messages import Catalog

Language = Literal["en", "de", "fr"]
TRANSLATED = ("de", "fr")
NARROW_SPACE = "\N{NARROW NO-BREAK SPACE}"
_language: ContextVar[str] = ContextVar("language", default="en")


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Within, text is in that language."""
    token = _language.set(language)
    try:
        yield
    finally:
        _language.reset(token)


def current_language() -> str:
    """The language of the page that is being filled."""
    return _language.get()


def gettext(message: str, singular: str = "", /, **values: object) -> str:
    """A message in the page's language, its fields in braces filled.

    Numbers have the decimal mark of the language; what is not in the catalogue stays English.

    Args: singular: the message where the value `count` is 1, where that differs.
    """
    known = translations(_language.get())
    if singular:
        text = known.ngettext(singular, message, values["count"])
    else:
        text = known.gettext(message) if message else ""
        if text == message:  # it may be the singular of another message
            text = known.ngettext(message, message, 1)
    return FORMATTER.format(text, **values) if values else text


def ngettext(singular: str, plural: str, count: int, **values: object) -> str:
    """A message on a counted thing in the page's language; `{count}` is the number."""
    text = translations(_language.get()).ngettext(singular, plural, count)
    return FORMATTER.format(text, count=f"{count:,}".replace(",", NARROW_SPACE), **values)


def translated(text: str) -> str:
    """A note in the page's language; other text as it is."""
    return gettext(text.template, text.singular, **text.values) if isinstance(text, Note) else text


def N_(message: str) -> str:
    """Mark a message for the catalogue; it is translated where it is shown."""
    return message


def decimal(number: str) -> str:
    """A number as text with the decimal mark of the page's language."""
    return number if _language.get() == "en" else number.replace(".", ",")


class _Formatter(string.Formatter):
    """`str.format` whose numbers have the decimal mark of the page's language."""

    def format_field(self, value: object, format_spec: str) -> str:
        if isinstance(value, Note):
            value = translated(value)
        text = super().format_field(value, format_spec)
        return decimal(text) if isinstance(value, float) else text


FORMATTER = _Formatter()


@cache
def messages(language: str) -> Catalog:
    """The catalogue of a language with the files that each message is from."""
    from babel.messages.pofile import read_po

    with (files("scenes.language") / f"{language}.po").open("rb") as file:
        return read_po(file, locale=language)


@cache
def translations(language: str) -> NullTranslations:
    """The translations of a language; English has none."""
    if language == "en":
        return NullTranslations()
    from babel.messages.mofile import write_mo

    compiled = io.BytesIO()
    write_mo(compiled, messages(language))
    compiled.seek(0)
    return GNUTranslations(compiled)
