"""Tables of fabrics with the quantities of EN 14501, as ES-SO's database and data sheets have them.

A CSV file (UTF-8; comma, semicolon or tabulator; decimal point or comma) with a row a fabric.
Titles are read by their letters and digits alone, Greek or spelt out: "tau_e,n-h", "τe,n-h [%]"
and "Ts" are one column.  Front is outdoors; a back side's title says "back" or has a prime.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from mitsuba_cfs.bsdf.screens import FabricBand
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

TEXTS = {
    "name": "name product productname fabric fabricname collection reference",
    "colour": "colour color colourname colorname",
    "manufacturer": "manufacturer company brand supplier",
}
SHARES = {  # quantity: its titles, without a side
    "tau_e": "tauenh taue ts tsol solartransmittance",
    "tau_e,n-n": "tauenn",
    "rho_e": "rhoenh rhoe rs rsol solarreflectance",
    "alpha_e": "alphaenh alphae as asol solarabsorptance",
    "tau_v": "tauvnh tauv tv tvis visibletransmittance lighttransmittance",
    "tau_v,n-n": "tauvnn",
    "tau_v,n-dif": "tauvndif tauvnd",
    "rho_v": "rhovnh rhov rv rvis visiblereflectance lightreflectance",
    "openness": "openness of opennessfactor co opennesscoefficient",
    "tau_UV": "tauuv tauuvnh tuv uvtransmittance",
    "emissivity": "emissivity epsilon eps",
    "tau_IR": "tauir tir irtransmittance infraredtransmittance",
}
SIDED = ("rho_e", "rho_v", "emissivity")
THICKNESS = ("thickness",)
THICKEST = 0.05  # [m]
LENGTHS = {"mm": 1e-3, "m": 1.0}
GREEK = {"τ": "tau", "ρ": "rho", "α": "alpha", "ε": "epsilon", "ϵ": "epsilon"}
NOTHING = ("", "-", "–", "n/a", "na")
ROUNDING = 0.005  # of values in whole percents: a normal-normal share may exceed the whole by it
CLOSED = 0.02  # by which stated tau + rho + alpha may differ from 1: three such roundings
UNIT = re.compile(r"[\[(]\s*(%|-|mm|m)\s*[\])]|(%)\s*$")


@dataclass(frozen=True, slots=True)
class FabricShade:
    """Fabric of one row; front is outdoors, None is not stated."""

    name: str
    manufacturer: str
    solar: FabricBand
    visible: FabricBand
    openness: float  # of air
    emissivity: tuple[float | None, float | None]  # of the sheet, front and back
    infrared_transmittance: float | None
    ultraviolet: float | None  # transmittance
    thickness: float | None  # [m]
    line: int
    notes: tuple[str, ...]  # values that the row does not state, and their replacements


@dataclass(frozen=True, slots=True)
class _Column:
    quantity: str  # of TEXTS, SHARES with a side, or "thickness"
    title: str  # as written in the file
    unit: str | None
    place: int


@dataclass(frozen=True, slots=True)
class _Row:
    path: Path
    line: int
    cells: dict[str, str]  # by quantity
    titles: dict[str, str]
    values: dict[str, float]  # shares of 1 and metres that are stated

    def error(self, message: str, quantity: str) -> DataError:
        """The error that names file, line and column."""
        title = self.titles.get(quantity, quantity)
        return DataError(message, file=self.path, element=f"line {self.line}", field=title)


def read_fabric_table(path: str | PathLike[str]) -> tuple[list[FabricShade], tuple[str, ...]]:
    """Fabrics of a table, and notes on its columns.

    Raises: `DataError` that names file, line and column.
    """
    path = Path(path)
    lines = _lines(path)
    first, titles = lines[0]
    columns, unknown = _columns(path, first, titles)
    for line, cells in lines[1:]:
        if len(cells) != len(titles):
            message = f"expected {len(titles)} cells as in line {first}, got {len(cells)}"
            raise DataError(message, file=path, element=f"line {line}")
    rows = [_row(path, line, cells, columns) for line, cells in lines[1:]]
    percents, shares = _scale(path, first, columns, rows)
    notes = {
        "columns not read": unknown,
        "without a unit, in percent as some values are above 1": percents,
        "without a unit, shares of 1 as no value is above it": shares,
    }
    summary = tuple(f"{what}: {', '.join(titles)}" for what, titles in notes.items() if titles)
    return [_shade(row) for row in rows], summary


def named_fabric(shades: Sequence[FabricShade], name: str | None, path: Path) -> FabricShade:
    """The fabric of that name; `DataError` where there is none, or more than one."""
    result = [s for s in shades if name is None or s.name.casefold() == name.strip().casefold()]
    if len(result) == 1:
        return result[0]
    known = "; ".join(dict.fromkeys(s.name for s in shades[:12])) + (" ..." * (len(shades) > 12))
    if name is None:
        raise DataError(f"holds {len(shades)} fabrics, name one: {known}", file=path)
    if not result:
        raise DataError(f"has no fabric {name!r}, but {known}", file=path)
    lines = " and ".join(str(s.line) for s in result)
    raise DataError(f"lines {lines} are both {name!r}", file=path)


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Number and cells of each line that is not empty; the titles first."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise DataError("is not UTF-8", file=path) from None
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    head = next((line for line in text.splitlines() if line.strip()), "")
    mark = ";" if ";" in head else "\t" if "\t" in head else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    try:
        read = [(reader.line_num, [" ".join(c.split()) for c in cells]) for cells in reader]
    except csv.Error as error:
        where = f"line {reader.line_num}"
        raise DataError(f"is no CSV: {error}", file=path, element=where) from None
    lines = [(line, cells) for line, cells in read if any(cells)]
    if len(lines) < 2:
        raise DataError("expected a line of titles and a row a fabric", file=path)
    return lines


def _columns(path: Path, line: int, titles: list[str]) -> tuple[list[_Column], list[str]]:
    """The columns that are known, and the titles of the others."""
    known: dict[str, _Column] = {}
    unknown = []
    for place, title in enumerate(titles):
        quantity, unit = _quantity(title), UNIT.search(title)
        if quantity is None:
            unknown.append(title or f"column {place + 1}")
            continue
        if quantity in known:
            message = f"states the same as {known[quantity].title!r}"
            raise DataError(message, file=path, element=f"line {line}", field=title)
        result = None if unit is None else unit[1] or unit[2]
        if quantity == "thickness" and result not in LENGTHS:
            message = "expected its unit, [mm] or [m]"
            raise DataError(message, file=path, element=f"line {line}", field=title)
        if quantity not in TEXTS and quantity != "thickness" and result in LENGTHS:
            message = f"expected a share in [%] or [-], got [{result}]"
            raise DataError(message, file=path, element=f"line {line}", field=title)
        known[quantity] = _Column(quantity, title, result, place)
    return list(known.values()), unknown


def _quantity(title: str) -> str | None:
    """Quantity of a column, with " back" for a back side; None if unknown."""
    text = UNIT.sub(" ", title.casefold())
    for letter, word in GREEK.items():
        text = text.replace(letter, word)
    text, primes = re.subn(r"['′’]", "", text)
    text, backs = re.subn(r"\bback\b|_back\b", "", text)
    letters = re.sub(r"[^a-z0-9]", "", re.sub(r"\bfront\b|_front\b", "", text))
    back = bool(primes or backs)
    for quantity, words in (TEXTS | SHARES).items():
        if letters in words.split() and (quantity in SIDED or not back):
            return f"{quantity} back" if back else quantity
    return "thickness" if letters in THICKNESS and not back else None


def _row(path: Path, line: int, cells: list[str], columns: list[_Column]) -> _Row:
    """Row with its numbers as written; those with their own % as shares of 1."""
    by_quantity = {one.quantity: cells[one.place] for one in columns}
    row = _Row(path, line, by_quantity, {one.quantity: one.title for one in columns}, {})
    for column in columns:
        text = cells[column.place]
        if column.quantity in TEXTS or text.casefold() in NOTHING:
            continue
        number = text.removesuffix("%").strip()
        if not re.fullmatch(r"[+]?\d+([.,]\d+)?", number):
            raise row.error(f"{text[:40]!r} is no number of 0 or more", column.quantity)
        row.values[column.quantity] = float(number.replace(",", "."))
    return row


def _scale(path: Path, line: int, columns: list[_Column], rows: list[_Row]) -> tuple[list[str], list[str]]:
    """Bring all values to shares of 1 and metres.

    A column without a unit is in percent where it has values above 1; if all its values are 0 to
    1 while others are in percent, it could be either and is refused.  Emissivities are each by
    themselves: data sheets state them as shares even if other columns are in percent.

    Returns: titles without a unit that are in percent by their values; that are shares.
    """
    shares = [column for column in columns if column.quantity not in TEXTS and column.quantity != "thickness"]
    bare = {one.quantity: _bare(one, rows) for one in shares}
    by_value = [share for share in shares if max(bare[share.quantity], default=0) > 1]
    whole = [one for one in shares if any(bare[one.quantity]) and one not in by_value]
    percent = {one.quantity for one in [*by_value, *(c for c in shares if c.unit == "%")]}
    written = any(text.endswith("%") for row in rows for text in row.cells.values())
    doubtful = [one for one in whole if not one.quantity.startswith("emissivity")]
    if doubtful and (written or percent - {"emissivity", "emissivity back"}):
        message = "values of 0 to 1 beside others in percent: write [%] or [-] behind its title"
        raise DataError(message, file=path, element=f"line {line}", field=doubtful[0].title)
    metres = {one.quantity: LENGTHS[one.unit] for one in columns if one.unit in LENGTHS}
    for row in rows:
        for quantity, value in row.values.items():
            in_percent = quantity in percent or row.cells[quantity].endswith("%")
            row.values[quantity] = value / 100 if in_percent else value * metres.get(quantity, 1.0)
        _check_range(row)
    return [one.title for one in by_value], [one.title for one in whole]


def _bare(column: _Column, rows: list[_Row]) -> list[float]:
    """Numbers of a column without a unit, neither in its title nor after the numbers."""
    if column.unit is not None:
        return []
    name = column.quantity
    return [row.values[name] for row in rows if name in row.values and row.cells[name][-1] != "%"]


def _check_range(row: _Row) -> None:
    for quantity, value in row.values.items():
        text = row.cells[quantity]
        if quantity != "thickness" and value > 1:
            raise row.error(f"{text[:40]!r} is more than all", quantity)
        if quantity == "thickness" and not 0 < value <= THICKEST:
            raise row.error(f"{text[:40]!r}: expected up to {1000 * THICKEST:g} mm", quantity)


def _shade(row: _Row) -> FabricShade:
    """The fabric of a row, checked."""
    at, notes = row.values, []
    for quantity in ("tau_e", "rho_e", "tau_v"):
        if quantity not in at:
            raise row.error("is not stated", quantity)
    name = " ".join(row.cells[key] for key in ("name", "colour") if row.cells.get(key))
    if not name:
        raise row.error("is not stated", "name")
    direct, source = _direct(row)
    if "tau_e,n-n" not in at:
        notes.append(f"tau_e,n-n is not stated: as for light, by {source}")
        solar = _band(row, "e", direct, source, notes)
    else:
        solar = _band(row, "e", at["tau_e,n-n"], "tau_e,n-n", notes)
    if "alpha_e" in at:
        whole = at["tau_e"] + at["rho_e"] + at["alpha_e"]
        if abs(whole - 1) > CLOSED:
            raise row.error(f"with tau_e and rho_e it makes {whole:.3f}, not 1", "alpha_e")
    visible = _band(row, "v", direct, source, notes)
    front = at.get("emissivity")
    back = at.get("emissivity back", front)
    infrared = at.get("tau_IR")
    for quantity, value in (("emissivity", front), ("emissivity back", back)):
        if value is not None and infrared is not None and value + infrared > 1 + 1e-9:
            raise row.error(f"with tau_IR it makes {value + infrared:.3f}, above 1", quantity)
    openness = at.get("openness", direct)
    return FabricShade(
        name,
        row.cells.get("manufacturer", ""),
        solar,
        visible,
        openness,
        (front, back),
        infrared,
        at.get("tau_UV"),
        at.get("thickness"),
        row.line,
        tuple(notes),
    )


def _direct(row: _Row) -> tuple[float, str]:
    """Direct transmittance, and the column that states it."""
    at = row.values
    if "openness" in at and at["openness"] > at["tau_v"] + ROUNDING:
        message = f"{at['openness']:.3f} is open, but tau_v is {at['tau_v']:.3f}"
        raise row.error(message, "openness")
    if "tau_v,n-n" in at:
        return at["tau_v,n-n"], "tau_v,n-n"
    if "tau_v,n-dif" in at:
        if at["tau_v,n-dif"] > at["tau_v"] + ROUNDING:
            raise row.error("more is scattered than passes (tau_v)", "tau_v,n-dif")
        return max(at["tau_v"] - at["tau_v,n-dif"], 0.0), "tau_v,n-dif"
    if "openness" in at:
        return at["openness"], "openness"
    raise row.error("is not stated, nor is openness", "tau_v,n-n")


def _band(row: _Row, band: str, direct: float, source: str, notes: list[str]) -> FabricBand:
    """Solar ("e") or visible ("v") values at normal incidence, checked.

    Args: direct, source: direct transmittance, and the quantity that states it.
    """
    at, tau, rho = row.values, f"tau_{band}", f"rho_{band}"
    if direct > at[tau] + ROUNDING:
        raise row.error(f"{direct:.3f} goes straight on, but {tau} is {at[tau]:.3f}", source)
    front = at.get(rho)
    if front is None:
        front = at["rho_e"]
        notes.append("rho_v is not stated: as rho_e")
    back = at.get(f"{rho} back")
    if back is None:
        back = front if rho in at else at.get("rho_e back", front)
        if rho in at:
            notes.append(f"{rho} back is not stated: as in front")
    for quantity, value in ((rho, front), (f"{rho} back", back)):
        if at[tau] + value > 1 + 1e-9:
            message = f"{tau} and {rho} make {at[tau] + value:.3f}, above 1"
            raise row.error(message, quantity)
    return FabricBand(at[tau], min(direct, at[tau]), front, back)
