"""What each quantity of the results is called, its unit and digits, and what it means."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from scenes.language.catalogue import N_, gettext, ngettext
from scenes.language.numbers import colon

PERCENT = "%"
WITHIN = re.compile(r"^within_(.+)$")
UDI = re.compile(r"^udi_?(below|under|above|over)?_?(\d+)?_?(?:to_)?(\d+)?(?:_lx)?$")
ENDINGS = {
    "_percent": PERCENT,
    "_pct": PERCENT,
    "_c": "°C",
    "_w": "W",
    "_kwh": "kWh",
    "_lx": "lx",
    "_hours": "h",
    "_h": "h",
    "_m2": "m²",
}


@dataclass(frozen=True, slots=True)
class Quantity:
    """A named number of the results."""

    label: str
    unit: str = ""
    digits: int = 2
    meaning: str = ""
    values: tuple[str, ...] = ()  # names of the values 0, 1, 2, ... where they are classes

    @property
    def with_unit(self) -> str:
        """Label and unit, as a column's head."""
        return self.label if self.unit in self.label else f"{self.label} [{self.unit}]"


def _words() -> dict[str, Any]:
    """The package's table of quantities and the glossary."""
    return tomllib.loads((files("scenes.report") / "words.toml").read_text("utf-8"))


WORDS = _words()


def glossary() -> tuple[tuple[str, str], ...]:
    """Terms and their meanings, in the alphabet's order."""
    result = ((gettext(term), gettext(meaning)) for term, meaning in WORDS["glossary"].items())
    return tuple(sorted(result, key=lambda item: item[0].lower()))


STAGES = {  # whose seconds are noted
    "view matrix": N_("view matrix"),
    "view matrices": N_("view matrices"),
    "daylight matrix": N_("daylight matrix"),
    "direct sun": N_("direct sun"),
    "annual product": N_("annual product"),
    "daylight": N_("daylight"),
    "holes": N_("check for leaks"),
    "annual glare": N_("annual glare"),
    "glare map": N_("glare map"),
    "glare": N_("glare"),
    "pictures": N_("pictures"),
    "colour": N_("colour picture"),
    "explorer": N_("explorer"),
    "thermal": N_("heat balance"),
    "leaks": N_("check for leaks"),
    "reading": N_("reading of files"),
    "view and sunlight": N_("view out and sunlight"),
    "V and D": N_("matrices V and D"),
    "light and blinds of every hour": N_("light and blinds of every hour"),
    "temperatures": N_("temperatures"),
    "what else light takes": N_("other steps of the light"),
}


def stage_words(stage: str) -> str:
    """A stage of the computation in words."""
    name = stage.replace("_", " ")
    return gettext(STAGES.get(name, name))


def rooms_counted(count: int) -> str:
    """A number of rooms."""
    return ngettext("{count} room", "{count} rooms", count)


def systems_counted(count: int) -> str:
    """A number of fenestration systems."""
    return ngettext("{count} system", "{count} systems", count)


def option_words(key: str) -> tuple[str, str]:
    """Label and meaning of an option of the run."""
    entry = WORDS["options"].get(key, {})
    label, meaning = entry.get("label", key.replace("_", " ")), entry.get("meaning", "")
    return gettext(label), gettext(meaning)


def quantity(key: str) -> Quantity:
    """The quantity of that name; for an unknown one a label made from the name."""
    if key in WORDS["quantities"]:
        entry = WORDS["quantities"][key]
        label, meaning = map(gettext, (entry["label"], entry["meaning"]))
        values = tuple(gettext(value) for value in entry.get("values", ()))
        return Quantity(label, entry["unit"], entry["digits"], meaning, values)
    if match := UDI.match(key):
        return _useful_illuminance(*match.groups())
    if match := WITHIN.match(key):
        return _within(match.group(1))
    if key.endswith("_s"):
        stage = colon(gettext("Computing time"), stage_words(key.removesuffix("_s")))
        return Quantity(stage, "s", 1)
    ending = next((e for e in ENDINGS if key.endswith(e)), "")
    text = key.removesuffix(ending).replace("_", " ").strip()
    return Quantity(text[:1].upper() + text[1:], ENDINGS.get(ending, ""), 1 if ending else 3)


def _useful_illuminance(side: str | None, first: str | None, second: str | None) -> Quantity:
    """Useful daylight illuminance: the share of hours in, below or above the useful range."""
    if first and second:
        label, range_lx = f"UDI {first}–{second} lx", {"first": first, "second": second}
        meaning = (
            gettext(
                "Useful daylight illuminance: share of the occupied hours with {first} to {second} "
                "lx, useful with supplementary electric light.",
                **range_lx,
            )
            if int(second) <= 300
            else gettext(
                "Useful daylight illuminance: share of the occupied hours with {first} to {second} "
                "lx, neither too dark nor too bright.",
                **range_lx,
            )
        )
    elif first and side in ("below", "under"):
        label = gettext("UDI below {limit} lx", limit=first)
        meaning = gettext("Useful daylight illuminance: share of the occupied hours below {limit} lx.", limit=first)
    elif first and side:
        label = gettext("UDI above {limit} lx", limit=first)
        meaning = gettext("Useful daylight illuminance: share of the occupied hours above {limit} lx.", limit=first)
    else:
        label = "UDI"
        meaning = gettext("Useful daylight illuminance: share of the occupied hours in the useful range.")
    return Quantity(label, PERCENT, 0, meaning)


def _within(limit: str) -> Quantity:
    """A column or figure of adaptive comfort."""
    if limit.isdigit():
        label = gettext("Within the {limit} % limits", limit=limit)
        meaning = gettext(
            "Share of the occupied hours within the adaptive comfort band for {limit} % acceptability.", limit=limit
        )
        return Quantity(label, PERCENT, 0, meaning)
    band = limit.replace("_", " ")
    meaning = gettext("Share of the occupied hours within the comfort band {band}.", band=band)
    return Quantity(gettext("Within {band}", band=band), PERCENT, 0, meaning)
