"""The elements of a model of any format that a selector chooses."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from bim.model import Element
from mitsuba_cfs.errors import DataError

# Properties of an element that a selector names, by its keys
KEYS = {
    "name": "name", "material": "material", "layer": "layer", "storey": "storey",
    "location": "storey", "class": "ifc_class",
}  # fmt: skip
FACET = re.compile(r'\s*(\w+)\s*(!?=)\s*("[^"]*"|/[^/]*/|[^,+]+)')


def selected(elements: Iterable[Element], selector: str, file: str | Path = "") -> frozenset[str]:
    """GUIDs of the elements that a selector chooses.

    A selector has facets with commas between them that all hold: a GUID, or `name=`, `material=`,
    `layer=`, `storey=` or `class=` with a text or a regular expression (`name=/PV.*/`), `!=` for
    the others; `+` joins groups.

    Raises: `DataError` for a text that is no selector.
    """
    elements = list(elements)
    guids = {element.guid for element in elements}
    found: set[str] = set()
    for group in re.split(r'\+(?=(?:[^"/]|"[^"]*"|/[^/]*/)*$)', selector):
        rest = FACET.sub("", group).strip(" ,")
        named = {text.strip() for text in rest.split(",") if text.strip()}
        if not group.strip() or not named <= guids:
            wrong = ", ".join(sorted(named - guids)) or "nothing"
            message = f"expected a GUID, or {', '.join(KEYS)} with = and a value, got {wrong}"
            raise DataError(message, file=file or None, field=selector)
        facets = [_facet(*match.groups(), selector, file) for match in FACET.finditer(group)]
        found |= {
            element.guid
            for element in elements
            if (not named or element.guid in named) and all(holds(element) for holds in facets)
        }
    return frozenset(found)


def _facet(
    key: str, sign: str, value: str, selector: str, file: str | Path
) -> Callable[[Element], bool]:
    """Whether an element has a property."""
    field, value = KEYS.get(key.lower()), value.strip()
    if field is None:
        message = f"expected one of {', '.join(KEYS)}, got {key!r}"
        raise DataError(message, file=file or None, field=selector)
    if value.startswith("/") and value.endswith("/"):
        try:
            pattern = re.compile(value[1:-1])
        except re.error as error:
            message = f"{value} is no regular expression: {error}"
            raise DataError(message, file=file or None, field=selector) from None
        return lambda element: bool(pattern.match(getattr(element, field))) == (sign == "=")
    text = value.strip('"')
    return lambda element: (getattr(element, field) == text) == (sign == "=")
