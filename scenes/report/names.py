"""What each quantity of the results is called, its unit and digits, and what it means."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from importlib.resources import files

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
    return tuple(sorted(WORDS["glossary"].items(), key=lambda item: item[0].lower()))


def option_words(key: str) -> tuple[str, str]:
    """Label and meaning of an option of the run."""
    entry = WORDS["options"].get(key, {})
    return entry.get("label", key.replace("_", " ")), entry.get("meaning", "")


def quantity(key: str) -> Quantity:
    """The quantity of that name; for an unknown one a label made from the name."""
    if key in WORDS["quantities"]:
        entry = WORDS["quantities"][key]
        return Quantity(**{**entry, "values": tuple(entry.get("values", ()))})
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
        worth = "useful with some electric light" if dim else "neither too dark nor too bright"
        what = f"between {first} and {second} lx, {worth}"
    elif first and side:
        word = "below" if side in ("below", "under") else "above"
        label, what = f"UDI {word} {first} lx", f"{word} {first} lx"
    else:
        label, what = "UDI", "in the useful range"
    meaning = f"Useful daylight illuminance: share of the occupied hours {what}."
    return Quantity(label, PERCENT, 0, meaning)


def _within(limit: str) -> Quantity:
    """A column or figure of adaptive comfort."""
    if limit.isdigit():
        meaning = f"the adaptive comfort band that {limit} % of people accept"
        label = f"Within the {limit} % limits"
    else:
        meaning = label = f"Within {limit.replace('_', ' ')}"
    return Quantity(label, PERCENT, 0, f"Share of the occupied hours in {meaning}.")
