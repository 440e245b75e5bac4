"""Notes for the reader of results: English text that keeps its template and its values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class Note(str):
    """An English sentence made from a template, so that a page can show it in another language.

    Attributes:
        template: the sentence with fields in braces.
        singular: the template where the value `count` is 1; "" where that is the same.
        values: of the fields; a value may be a `Note` itself.
    """

    __slots__ = ("singular", "template", "values")

    template: str
    singular: str
    values: Mapping[str, object]

    def __new__(cls, template: str, singular: str = "", /, **values: object) -> Note:
        """The sentence with its fields filled."""
        self = super().__new__(cls, filled(template, singular, **values))
        self.template, self.singular, self.values = template, singular, values
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """For copies and other processes."""
        return _note, (self.template, self.singular, dict(self.values))


def filled(template: str, singular: str = "", /, **values: object) -> str:
    """A template with its fields filled; `singular` in its place where the value `count` is 1."""
    text = singular if singular and values["count"] == 1 else template
    return text.format(**values) if values else text


def _note(template: str, singular: str, values: Mapping[str, object]) -> Note:
    return Note(template, singular, **values)
