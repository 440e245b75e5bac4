"""Extension of mkdocstrings (in mkdocs.yml): docstrings as they are meant, not as Markdown.

Shapes and units in brackets ("[S, 3] [m]") are no links; Markdown would take two in a row for one.
A section that begins on the line of its name ("Args: points: ...") is a paragraph of its own.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

TWO_BRACKETS = re.compile(r"\](\s*)\[")
SECTION = re.compile(r"^(Args|Returns|Raises|Source): (?=\S)", re.MULTILINE)


def as_markdown(text: str) -> str:
    """The text with sections as paragraphs, and brackets escaped but in indented examples."""
    lines, example, blank = [], False, True
    for line in text.split("\n"):
        indented = line.startswith("    ")
        example = indented and (example or blank)
        lines.append(line if example else TWO_BRACKETS.sub(r"]\1\\[", line))
        blank = not line.strip()
    return SECTION.sub(r"\n**\1:** ", "\n".join(lines))


class PlainBrackets(griffe.Extension):
    """Escapes them in every docstring that is collected."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Called for each module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
