"""Notes for the reader of results: English text that keeps its template and its values."""

from __future__ import annotations

from collections.abc import Mapping


class Note(str):
    """An English sentence made from a template, so that a page can show it in another language.

    Attributes:
        template: the sentence with fields in braces.
        values: of the fields; a value may be a `Note` itself.
    """

    __slots__ = ("template", "values")

    template: str
    values: Mapping[str, object]

    def __new__(cls, template: str, /, **values: object) -> Note:
        """The sentence with its fields filled."""
        self = super().__new__(cls, template.format(**values) if values else template)
        self.template, self.values = template, values
        return self

    def __reduce__(self) -> tuple:
        """For copies and other processes."""
        return _note, (self.template, dict(self.values))


def _note(template: str, values: Mapping[str, object]) -> Note:
    return Note(template, **values)
