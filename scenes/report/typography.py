"""How a sentence or a cell of a page is printed: exponents, and what stays together at the end of a line."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

EXPONENT = re.compile(r"(?<![\w.$-])(k?m|cm|mm)([23])(?![\w.$-])")
EXPONENTS = {"2": "²", "3": "³"}
# a sign and its number, a number and what it counts, a standard and its number
TOGETHER = re.compile(
    r"(?<=[≥≤]) (?=\d)|(?<=\d) (?=%|°|lx\b|h\b|m\b|m²|m³|s\b|K h\b|kWh|cd/m²|points?\b|credits?\b)"
    r"|(?<=\bK) (?=h\b)|(?<=\(m) (?=K\b)|(?<=\(m²) (?=K\b)"
    r"|(?:(?<=\bEN)|(?<=\bDIN)) (?=ISO \d|EN \d|V \d|\d)|(?<=\b(?:ISO|VDI)) (?=\d)"
)
UNBROKEN = re.compile(r"(?<!\w)--[a-z][\w-]*|\bLM-\d+(?:-\d+)?")  # a hyphen may end a line, but not these


def prose(text: str) -> str:
    """A sentence as it is printed: numbers stay with their signs and units, "W/(m2 K)" is "W/(m² K)"."""
    text = EXPONENT.sub(lambda found: found[1] + EXPONENTS[found[2]], text)
    return TOGETHER.sub("\N{NO-BREAK SPACE}", text)


def tied(text: object) -> Markup:
    """`prose` as HTML, in which options such as --quick and LM-83 are not broken at the end of a line."""
    return Markup(UNBROKEN.sub(r'<span class="option">\g<0></span>', str(escape(prose(str(text))))))
