"""What a material is by its name, in eighteen languages: properties from `material_names.toml`.

A name is cut into words.  A row of the table lists stems: "wool" begins a word, "=pur" is a whole
word, "-wolle" is anywhere in one (German compounds; Chinese and Japanese, which do not part words;
Cyrillic compounds), and "glass wool" is words that follow each other.  The longest stems are taken
first and use up their words, so that glass wool is no glass and sandwich no sand.  Insulation and
air come before other matter, then the order of the table.  A name that has insulation or air and
something that carries it, such as "concrete with insulation", does not tell what the layer is.

Conductivities and densities in a name ("Mineralwolle 035", "WLG 032", "0.035 W/mK", "2400 kg/m3")
come before the table's.
"""

from __future__ import annotations

import fnmatch
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path

from bim.defaults import GAP_RESISTANCE, UNKNOWN_MATERIAL
from bim.model import MaterialLayer
from bim.names import plain_text

THICKEST = 0.9  # m: thicker layers of air are none
# of air layers in walls: thickness [m] up to which the resistance holds [m2 K/W]; EN ISO 6946, t. 8
AIR_RESISTANCE = ((0.005, 0.11), (0.007, 0.13), (0.010, 0.15), (0.015, 0.17), (math.inf, GAP_RESISTANCE))


@dataclass(frozen=True, slots=True)
class Kind:
    """A row of the table."""

    layer: MaterialLayer
    group: str
    stems: tuple[str, ...]


TABLE = Path(__file__).with_suffix(".toml")
# Groups of the table.  "insulating": words for insulation of any matter; "air" and "frame": gaps;
# "panel": sold with its skins; "carrier" and "board": what insulation is mounted on; "nothing":
# words that do not tell the matter
LAYERED = ("insulation", "insulating", "frame", "air", "panel")
MIXED = ("carrier", "board")
CONCRETE = "reinforced concrete"
METALS = ("steel", "aluminium alloy")  # skins of sandwich panels, studs of framed gaps
GYPSUM = ["gypsum plasterboard", "gypsum plaster"]
CLASS_OF_CONCRETE = re.compile(r"\b(?:l?c|b)\s?\d{2}\s?/\s?\d{2}\b")
CONDUCTIVITY = (
    re.compile(r"(?:^|[^\d.,])(0[.,]\d{2,4})\s*w\s*/?\s*\(?m"),
    re.compile(r"(?:lambda|λ|λd|ld)\s*[=:]?\s*(0[.,]\d{2,4})"),
    re.compile(r"\b(?:wlg|wls|wlz)\s*[-_.]?\s*(0?\d{2})\b"),
    re.compile(r"\b(0\d{2})\b"),  # "EPS 035": of insulation only
)
DENSITY = (
    (re.compile(r"(\d+(?:[.,]\d+)?)\s*kg\s*/?\s*(?:m3|m³|m\^3|cbm)"), 1.0),
    (re.compile(r"(\d+(?:[.,]\d+)?)\s*кг\s*/?\s*(?:м3|м³)"), 1.0),
    (re.compile(r"(\d+(?:[.,]\d+)?)\s*(?:g\s*/\s*cm[3³]|t\s*/\s*m[3³]|kg\s*/\s*dm[3³])"), 1000.0),
    (re.compile(r"(\d+(?:[.,]\d+)?)\s*(?:pcf|lbs?\s*/\s*(?:ft3|ft³|cu\s?ft))"), 16.0185),
)
WORD = re.compile(r"[^\W\d_]+|\d+")
CAMEL = re.compile(r"(?<=[a-z]{3})(?=[A-Z][a-z]{2})")


@dataclass(frozen=True, slots=True)
class NamedMaterial:
    """A material of no thickness yet, by its name and what the file and corrections state."""

    layer: MaterialLayer
    # row of the table that its conductivity is of; "unknown" where the name does not tell, "mixed"
    # where it tells two, "" where the conductivity is stated
    group: str
    resistance: float | None = None  # whatever its thickness [m2 K/W]; of a stated U-value

    @property
    def is_known(self) -> bool:
        """Whether the name tells what the material is."""
        return self.group not in ("unknown", "mixed")

    def of_thickness(self, thickness: float) -> MaterialLayer:
        """The layer of a thickness [m]; of air one with the resistance of such a gap."""
        resistance = self.resistance
        if resistance is None:
            if self.group not in ("air", "frame") or thickness > THICKEST:
                return replace(self.layer, thickness=thickness)
            resistance = next(r for limit, r in AIR_RESISTANCE if thickness <= limit)
        return replace(self.layer, thickness=thickness, conductivity=thickness / resistance)


@dataclass(frozen=True, slots=True)
class MaterialCorrection:
    """Thermal properties of the materials that a pattern names, in place of the file's."""

    name: str  # a pattern of names: * stands for any text
    values: Mapping[str, float]  # by name, `u` among them

    def matches(self, name: str) -> bool:
        """Whether a material is meant; capitals do not count."""
        return fnmatch.fnmatchcase(name.casefold(), self.name.casefold())


@cache
def table() -> tuple[Kind, ...]:
    """The rows of the table."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["material"]
    keys = ("name", "thickness", "conductivity", "density", "heat_capacity")
    return tuple(
        Kind(
            MaterialLayer(*(row[key] if key == "name" else float(row[key]) for key in keys)),
            row["group"],
            tuple(stem for part in row["stems"].split(",") if (stem := part.strip())),
        )
        for row in rows
    )


@lru_cache(maxsize=4096)
def material_named(name: str) -> NamedMaterial:
    """What a material is by its name, with the conductivity and density that the name states."""
    kind = _kind_named(name)
    text = plain_text(name)
    layer = kind.layer
    if kind.group not in ("air", "frame"):
        layer = replace(layer, **_stated(text, insulates=kind.group in ("insulation", "insulating", "panel")))
    return NamedMaterial(layer, kind.group)


def _kind_named(name: str) -> Kind:
    text = plain_text(CAMEL.sub(" ", name))
    matches = _matches(tuple(WORD.findall(text)))
    if not matches and CLASS_OF_CONCRETE.search(text):
        return next(kind for kind in table() if kind.layer.name == CONCRETE)
    best = [kind for kind in matches if kind.group in LAYERED]
    others = [kind for kind in matches if kind.group in MIXED]
    skinned = [kind.group for kind in best if kind.group in ("panel", "frame")]
    if skinned:
        skins = METALS if skinned[0] == "panel" else (*METALS, "softwood")
        others = [kind for kind in others if kind.layer.name not in skins]
    filled = [kind for kind in best if kind.group in ("insulation", "insulating")]
    if best and best[0].group == "frame" and filled:
        best = filled  # studs with insulation between them
    if best and others:
        return Kind(UNKNOWN_MATERIAL, "mixed", ())
    glass = [kind for kind in matches if kind.group == "glass"]
    if best and glass and best[0].group == "insulating":
        best = glass  # insulating glass
    chosen = best or [kind for kind in matches if kind.group != "nothing"]
    if [kind.layer.name for kind in chosen[:2]] == GYPSUM:
        chosen = chosen[1:]  # plaster of gypsum, no board
    return chosen[0] if chosen else Kind(UNKNOWN_MATERIAL, "unknown", ())


def _matches(words: tuple[str, ...]) -> list[Kind]:
    """The rows that a name has stems of, in the order of the table."""
    free = [True] * len(words)
    matches: set[int] = set()
    hits = sorted(_hits(words), key=lambda hit: (-hit[0], hit[1]))
    for _, row, start, stop in hits:
        if all(free[start:stop]):
            free[start:stop] = [False] * (stop - start)
            matches.add(row)
    return [table()[row] for row in sorted(matches)]


def _hits(words: tuple[str, ...]) -> Iterator[tuple[int, int, int, int]]:
    """Length of a stem, its row, and the words [start, stop) that it is in."""
    for row, parts in _stems():
        for start in range(len(words) - len(parts) + 1):
            if all(map(_is_in, parts, words[start : start + len(parts)])):
                length = sum(len(part.lstrip("=-")) for part in parts)
                length += 10 * (len(parts) > 1)
                if table()[row].group == "insulating":  # gives way to the matter in one word with it
                    length = min(length, 4)
                yield length, row, start, start + len(parts)


@cache
def _stems() -> list[tuple[int, tuple[str, ...]]]:
    """Row and words of each stem, written as names are compared."""
    return [
        (row, tuple(plain_text(part) for part in stem.split()))
        for row, kind in enumerate(table())
        for stem in kind.stems
        if stem
    ]


def _is_in(stem: str, word: str) -> bool:
    if stem[0] == "=":
        return word == stem[1:]
    return stem[1:] in word if stem[0] == "-" else word.startswith(stem)


def _stated(text: str, *, insulates: bool) -> dict[str, float]:
    """Conductivity and density that a name states, in SI units."""
    values: dict[str, float] = {}
    for pattern in CONDUCTIVITY if insulates else CONDUCTIVITY[:2]:
        match = pattern.search(text)
        if match:
            number = float(match[1].replace(",", "."))
            values["conductivity"] = number if number < 1 else number / 1000
            break
    for density, scale in DENSITY:
        match = density.search(text)
        if match:
            values["density"] = scale * float(match[1].replace(",", "."))
            break
    limits = {"conductivity": (0.005, 5.0), "density": (5.0, 9000.0)}
    return {k: v for k, v in values.items() if limits[k][0] <= v <= limits[k][1]}
