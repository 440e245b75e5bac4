"""What each quantity of the results is called, its unit and digits, and what it means."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from importlib.resources import files

from scenes.language.catalogue import said

PERCENT = "%"
WITHIN = re.compile(r"^within_(.+)$")
UDI = re.compile(r"^udi_?(below|under|above|over)?_?(\d+)?_?(?:to_)?(\d+)?(?:_lx)?$")
ENDINGS = {
    "_percent": PERCENT, "_pct": PERCENT, "_c": "°C", "_w": "W", "_kwh": "kWh", "_lx": "lx",
    "_hours": "h", "_h": "h", "_m2": "m²",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Quantity:
    """A named number of the results."""

    label: str
    unit: str = ""
    digits: int = 2
    meaning: str = ""
    values: tuple[str, ...] = ()  # names of the values 0, 1, 2, ... where they are classes


def _words() -> dict:
    """The package's table of quantities and the glossary."""
    return tomllib.loads((files("scenes.report") / "words.toml").read_text("utf-8"))


WORDS = _words()


def glossary() -> tuple[tuple[str, str], ...]:
    """Terms and their meanings, in the alphabet's order."""
    found = ((said(term), said(meaning)) for term, meaning in WORDS["glossary"].items())
    return tuple(sorted(found, key=lambda item: item[0].lower()))


def option_words(key: str) -> tuple[str, str]:
    """Label and meaning of an option of the run."""
    entry = WORDS["options"].get(key, {})
    return said(entry.get("label", key.replace("_", " "))), said(entry.get("meaning", ""))


def quantity(key: str) -> Quantity:
    """The quantity of that name; for an unknown one a label made from the name."""
    if key in WORDS["quantities"]:
        entry = WORDS["quantities"][key]
        label, meaning = said(entry["label"]), said(entry["meaning"])
        values = tuple(said(value) for value in entry.get("values", ()))
        return Quantity(label, entry["unit"], entry["digits"], meaning, values)
    if match := UDI.match(key):
        return _useful_illuminance(*match.groups())
    if match := WITHIN.match(key):
        return _within(match.group(1))
    ending = next((e for e in ENDINGS if key.endswith(e)), "")
    text = key.removesuffix(ending).replace("_", " ").strip()
    return Quantity(text[:1].upper() + text[1:], ENDINGS.get(ending, ""), 1 if ending else 3)


def _useful_illuminance(side: str | None, first: str | None, second: str | None) -> Quantity:
    """Useful daylight illuminance: the share of hours in, below or above the useful range."""
    if first and second:
        label = f"UDI {first}–{second} lx"
        dim = int(second) <= 300
        what = (
            "between {first} and {second} lx, useful with some electric light"
            if dim
            else "between {first} and {second} lx, neither too dark nor too bright"
        )
    elif first and side:
        below = side in ("below", "under")
        label = said("UDI below {first} lx" if below else "UDI above {first} lx", first=first)
        what = "below {first} lx" if below else "above {first} lx"
    else:
        label, what = "UDI", "in the useful range"
    what = said(what, first=first, second=second)
    meaning = said("Useful daylight illuminance: share of the occupied hours {what}.", what=what)
    return Quantity(label, PERCENT, 0, meaning)


def _within(limit: str) -> Quantity:
    """A column or figure of adaptive comfort."""
    if limit.isdigit():
        label = said("Within the {limit} % limits", limit=limit)
        meaning = said(
            "Share of the occupied hours in the adaptive comfort band that {limit} % of people "
            "accept.",
            limit=limit,
        )
        return Quantity(label, PERCENT, 0, meaning)
    label = f"Within {limit.replace('_', ' ')}"
    return Quantity(label, PERCENT, 0, f"Share of the occupied hours in {label}.")
