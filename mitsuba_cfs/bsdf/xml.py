"""BSDF XML files of LBNL WINDOW, genBSDF and similar programs: reading and writing.

Front of a file is the exterior.  A wavelength's blocks may be spread over several
`WavelengthData` elements; the last of one direction counts, as in Radiance.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from os import PathLike
from typing import Any, TypeVar
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.energy import ENERGY_LIMIT, check_energy
from mitsuba_cfs.bsdf.klems import STANDARD_BASES, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_text import format_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, replacing, wrong_encoding

__all__ = ["BsdfFile", "read_bsdf_xml", "write_bsdf_xml"]

Block = TypeVar("Block", TensorTree, tuple[KlemsBasis, KlemsBasis, NDArray[np.float64]])
MOST_BYTES = 128 << 20  # of a file: tens of times the biggest known; memory is 20 times as much
MOST_LETTERS = 64  # of a number with its separator
UNIT_METRES = {"meter": 1.0, "foot": 0.3048, "inch": 0.0254, "centimeter": 0.01, "millimeter": 1e-3}
BAND_NAMES = {name.lower(): name for name in ("Visible", "Solar", "CIE-X", "CIE-Y", "CIE-Z")}
BLOCK_NAMES = {
    "transmission front": "transmission_front",
    "transmission back": "transmission_back",
    "reflection front": "reflection_front",
    "reflection back": "reflection_back",
}


def read_bsdf_xml(path: str | PathLike[str], *, energy_limit: float = ENERGY_LIMIT) -> BsdfFile:
    """The content of a BSDF XML file: Klems matrices or tensor trees, every band.

    Negative values are read as zero (as Radiance does) and noted, and so are directions that
    scatter a little more light than they get.  `DataError` for a file that is not readable, not
    complete, not finite, bigger than 128 MiB, or that scatters too much (`check_energy`).
    """
    notes: list[str] = []
    layer = _optical_layer(path, notes)
    structure = _text(_need(layer, "DataDefinition/IncidentDataStructure", path))
    if structure.lower() in ("columns", "rows"):
        bases = _angle_bases(layer, path)
        bands = _read_blocks(layer, path, notes, _KlemsReader(bases, structure.lower() == "rows"))
    elif structure.lower() in ("tensortree3", "tensortree4"):
        bands = _read_blocks(layer, path, notes, _TreeReader(int(structure[-1])))
    else:
        raise DataError(
            f"expected Columns, Rows, TensorTree3 or TensorTree4, got {structure!r}",
            file=path,
            element="DataDefinition",
            field="IncidentDataStructure",
        )
    for band, bsdf in bands.items():
        if band in ("Visible", "Solar"):
            notes += check_energy(bsdf, energy_limit, file=path, band=band)
    return BsdfFile(bands, **_material(layer, path), notes=tuple(notes))


def _content(path: str | PathLike[str]) -> bytes:
    """The file's bytes; `DataError` where it cannot be read or is too big to be."""
    try:
        with open(path, "rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    if len(content) > MOST_BYTES:
        most = f"at most {MOST_BYTES >> 20} MiB are read (a tensor tree can be reduced)"
        raise DataError(f"is too big: {most}", file=path)
    return content


def _optical_layer(path: str | PathLike[str], notes: list[str]) -> ElementTree.Element:
    """The file's one Optical/Layer element, without namespaces."""
    content = _content(path)
    start = max(content.find(b"<"), 0)
    if content[:start].strip(b" \t\r\n\xef\xbb\xbf"):  # genBSDF may leave a line of its own
        notes.append(f"{start} bytes before the XML left out")
    _refuse_entities(content[start:], path)
    try:
        root = ElementTree.fromstring(content[start:])
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        message = wrong_encoding(content) or f"is not well-formed XML: {error}"
        raise DataError(message, file=path) from None
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    if root.tag != "WindowElement":
        raise DataError(f"expected WindowElement as root, got {root.tag}", file=path)
    layers = root.findall("Optical/Layer")
    if len(layers) != 1:
        raise DataError(f"expected one Optical/Layer, got {len(layers)}", file=path)
    return layers[0]


class _RootStarts(Exception):
    """The part of a document that may declare entities has ended."""


def _refuse_entities(content: bytes, path: str | PathLike[str]) -> None:
    """Raise `DataError` for a document type with entities, which grow when they are read."""

    def refuse(*_: object) -> None:
        raise DataError("declares entities, which are not read", file=path)

    def stop(*_: object) -> None:
        raise _RootStarts

    parser = expat.ParserCreate()
    parser.EntityDeclHandler, parser.StartElementHandler = refuse, stop
    try:
        parser.Parse(content, True)
    except (_RootStarts, expat.ExpatError, LookupError):
        return  # no XML: told by the reader of the whole
    except ValueError as error:
        if isinstance(error, DataError):
            raise


def _angle_bases(layer: ElementTree.Element, path: str | PathLike[str]) -> dict[str, KlemsBasis]:
    """The standard bases and those that the file defines, by lower-case name."""
    bases = {basis.name.lower(): basis for basis in STANDARD_BASES}
    for element in layer.findall("DataDefinition/AngleBasis"):
        name = _text(_need(element, "AngleBasisName", path))
        bounds, counts = [0.0], []
        for block in element.findall("AngleBasisBlock"):
            lower = _number(_need(block, "ThetaBounds/LowerTheta", path), path)
            if abs(lower - bounds[-1]) > 1e-3:
                raise DataError("theta bounds disagree", file=path, element=name, field="LowerTheta")
            bounds.append(_number(_need(block, "ThetaBounds/UpperTheta", path), path))
            counts.append(int(_number(_need(block, "nPhis", path), path)))
        try:
            basis = KlemsBasis(name, tuple(np.radians(bounds).tolist()), tuple(counts))
        except ValueError as error:
            raise DataError(str(error), file=path, element="AngleBasis", field=name) from None
        known = bases.get(name.lower())
        if (
            known is None
            or known.phi_counts != basis.phi_counts
            or not np.allclose(known.theta_bounds, basis.theta_bounds, atol=1e-5)
        ):
            bases[name.lower()] = basis
    return bases


KlemsBlock = tuple[KlemsBasis, KlemsBasis, NDArray[np.float64]]


@dataclass(frozen=True)
class _KlemsReader:
    """Reads matrix blocks, and puts a band's blocks together."""

    bases: dict[str, KlemsBasis]
    rows: bool

    def block(self, element: ElementTree.Element, where: str, path: str | PathLike[str]) -> KlemsBlock:
        basis_in = self._basis(element, "ColumnAngleBasis", where, path)
        basis_out = self._basis(element, "RowAngleBasis", where, path)
        text = _text(_need(element, "ScatteringData", path))
        expected, got = basis_in.size * basis_out.size, "far more"
        if len(text) <= MOST_LETTERS * expected + MOST_LETTERS:
            values = parse_numbers(text, file=path, element=where)
            got = str(len(values))
        if got != str(expected):
            raise DataError(
                f"expected {basis_out.size} x {basis_in.size} = {expected} values ({basis_in.name}), got {got}",
                file=path,
                element=where,
                field="ScatteringData",
            )
        if self.rows:
            return basis_in, basis_out, values.reshape(basis_in.size, basis_out.size).T.copy()
        return basis_in, basis_out, values.reshape(basis_out.size, basis_in.size)

    def band(self, blocks: Mapping[str, KlemsBlock], where: str, path: str | PathLike[str]) -> KlemsBsdf:
        bases = {(basis_in, basis_out) for basis_in, basis_out, _ in blocks.values()}
        if len(bases) != 1:
            raise DataError("the blocks are on different angle bases", file=path, element=where)
        values: dict[str, Any] = {name: block for name, (*_, block) in blocks.items()}
        return KlemsBsdf(*bases.pop(), **values)

    def _basis(self, element: ElementTree.Element, tag: str, where: str, path: str | PathLike[str]) -> KlemsBasis:
        name = _text(_need(element, tag, path))
        if name.lower() not in self.bases:
            raise DataError(f"unknown angle basis {name!r}", file=path, element=where, field=tag)
        return self.bases[name.lower()]


@dataclass(frozen=True)
class _TreeReader:
    """Reads tensor trees, and puts a band's trees together."""

    rank: int

    def block(self, element: ElementTree.Element, where: str, path: str | PathLike[str]) -> TensorTree:
        basis = _text(_need(element, "AngleBasis", path))
        if basis.lower() != "lbnl/shirley-chiu":
            raise DataError(f"expected LBNL/Shirley-Chiu, got {basis!r}", file=path, element=where, field="AngleBasis")
        text = _text(_need(element, "ScatteringData", path))
        try:
            return TensorTree.from_text(text, self.rank)
        except ValueError as error:
            raise DataError(str(error), file=path, element=where, field="ScatteringData") from None

    def band(self, blocks: Mapping[str, Any], where: str, path: str | PathLike[str]) -> TensorTreeBsdf:
        return TensorTreeBsdf(**blocks)


def _read_blocks(
    layer: ElementTree.Element, path: str | PathLike[str], notes: list[str], reader: _KlemsReader | _TreeReader
) -> dict[str, Bsdf]:
    """BSDF of every band; `reader` interprets the blocks."""
    blocks: dict[str, dict[str, Any]] = {}
    for data in layer.findall("WavelengthData"):
        band = _text(_need(data, "Wavelength", path))
        band = BAND_NAMES.get(band.lower(), band)
        for element in data.findall("WavelengthDataBlock"):
            direction = _text(_need(element, "WavelengthDataDirection", path))
            where = f"{band} {direction}"
            name = BLOCK_NAMES.get(direction.lower())
            if name is None:
                notes.append(f"{where}: not a known direction, left out")
                continue
            if name in blocks.get(band, {}):
                notes.append(f"{where}: given twice, the last counts")
            block: Any = reader.block(element, where, path)
            blocks.setdefault(band, {})[name] = _without_negatives(block, where, notes)
    if not blocks:
        raise DataError("no scattering data", file=path, element="WavelengthData")
    return {band: reader.band(result, band, path) for band, result in blocks.items()}


def _without_negatives(block: Block, where: str, notes: list[str]) -> Block:
    """The block with its negative values set to zero, and a note where there were any."""
    values = block.values if isinstance(block, TensorTree) else block[-1]
    negative = values < 0
    if negative.any():
        notes.append(f"{where}: {np.count_nonzero(negative)} negative values (lowest {values.min():.3g}) read as zero")
        values[negative] = 0.0
    return block


def parse_numbers(
    text: str, *, file: str | PathLike[str], element: str, field: str = "ScatteringData"
) -> NDArray[np.float64]:
    """The finite numbers [N] of a text that separates them by commas or white space."""
    words = text.replace(",", " ").split()
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError:
        bad = next(word for word in words if not _is_number(word))
        raise DataError(f"not a number: {bad[:40]!r}", file=file, element=element, field=field) from None
    if not np.isfinite(values).all():
        where = int(np.flatnonzero(~np.isfinite(values))[0])
        raise DataError(f"value {where} is not finite: {words[where]}", file=file, element=element, field=field)
    return values


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _material(layer: ElementTree.Element, path: str | PathLike[str]) -> dict[str, Any]:
    """Fields of `BsdfFile` in the Material element."""
    material = layer.find("Material")
    if material is None:
        return {}
    result: dict[str, Any] = {
        "name": "" if (name := _text(material.find("Name"))) == "Name" else name,  # genBSDF's own
        "manufacturer": _text(material.find("Manufacturer")),
        "device_type": _text(material.find("DeviceType")) or "Other",
    }
    for tag in ("Thickness", "Width", "Height"):
        element = material.find(tag)
        if element is not None and _text(element):
            unit = element.get("unit", "Meter")
            if unit.lower() not in UNIT_METRES:
                raise DataError(f"unknown unit {unit!r}", file=path, element="Material", field=tag)
            result[tag.lower()] = _number(element, path, 0.0) * UNIT_METRES[unit.lower()]
    for tag, name, most in (
        ("EmissivityFront", "emissivity_front", 1.0),
        ("EmissivityBack", "emissivity_back", 1.0),
        ("TIR", "infrared_transmittance", 1.0),
        ("ThermalConductivity", "conductivity", math.inf),
    ):
        element = material.find(tag)
        if element is not None and _text(element):
            result[name] = _number(element, path, 0.0, most)
    return result


def _need(element: ElementTree.Element, tags: str, path: str | PathLike[str]) -> ElementTree.Element:
    need = element.find(tags)
    if need is None:
        raise DataError("is missing", file=path, element=element.tag, field=tags)
    return need


def _text(element: ElementTree.Element | None) -> str:
    return "" if element is None else (element.text or "").strip()


def _number(
    element: ElementTree.Element, path: str | PathLike[str], least: float = -math.inf, most: float = math.inf
) -> float:
    try:
        value = float(_text(element))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"expected a number, got {_text(element)[:40]!r}", file=path, field=element.tag)
    if not least <= value <= most:
        bounds = f"of at least {least:g}" if most == math.inf else f"from {least:g} to {most:g}"
        raise DataError(f"expected a number {bounds}, got {value:g}", file=path, field=element.tag)
    return value


HEADER = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<WindowElement xmlns="http://windows.lbl.gov" '
    'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
    'xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">\n'
    "<WindowElementType>System</WindowElementType>\n<FileType>BSDF</FileType>\n"
    "<Optical>\n<Layer>\n"
)
FOOTER = "</Layer>\n</Optical>\n</WindowElement>\n"
SPECTRA = {
    "Visible": ("CIE Illuminant D65 1nm.ssp", "ASTM E308 1931 Y.dsp"),
    "CIE-X": ("CIE Illuminant D65 1nm.ssp", "ASTM E308 1931 X.dsp"),
    "CIE-Z": ("CIE Illuminant D65 1nm.ssp", "ASTM E308 1931 Z.dsp"),
    "Solar": ("CIE Illuminant D65 1nm.ssp", "None"),
}


def write_bsdf_xml(bsdf: BsdfFile, path: str | PathLike[str], *, digits: int = 7) -> None:
    """Write `bsdf` as an LBNL BSDF XML file, values with `digits` significant digits."""
    with replacing(path) as part, open(part, "w", encoding="utf-8") as file:
        file.writelines(_lines(bsdf, digits))


def bsdf_xml(bsdf: BsdfFile, *, digits: int = 7) -> str:
    """The text of `write_bsdf_xml`."""
    return "".join(_lines(bsdf, digits))


def _lines(bsdf: BsdfFile, digits: int) -> Iterator[str]:
    yield HEADER
    yield from _material_lines(bsdf)
    yield from _definition(list(bsdf.bands.values()))
    for band, data in bsdf.bands.items():
        for name, block in data.blocks().items():
            yield from _block(band, name, data, block, digits)
    yield FOOTER


def _material_lines(bsdf: BsdfFile) -> Iterator[str]:
    yield "<Material>\n"
    yield f"\t<Name>{escape(bsdf.name, quote=False)}</Name>\n"
    yield f"\t<Manufacturer>{escape(bsdf.manufacturer, quote=False)}</Manufacturer>\n"
    for tag, length in (("Thickness", bsdf.thickness), ("Width", bsdf.width), ("Height", bsdf.height)):
        if length is not None:
            yield f'\t<{tag} unit="meter">{length:.9g}</{tag}>\n'
    yield f"\t<DeviceType>{escape(bsdf.device_type, quote=False)}</DeviceType>\n"
    for tag, value in (
        ("ThermalConductivity", bsdf.conductivity),
        ("EmissivityFront", bsdf.emissivity_front),
        ("EmissivityBack", bsdf.emissivity_back),
        ("TIR", bsdf.infrared_transmittance),
    ):
        if value is not None:
            yield f"\t<{tag}>{value:.9g}</{tag}>\n"
    yield "</Material>\n"


def _definition(bands: list[Bsdf]) -> Iterator[str]:
    kinds = {_structure(bsdf) for bsdf in bands}
    if len(kinds) != 1:
        raise ValueError(f"one file holds one kind of data, got {', '.join(sorted(kinds))}")
    yield f"<DataDefinition>\n\t<IncidentDataStructure>{kinds.pop()}</IncidentDataStructure>\n"
    bases = {b for k in bands if isinstance(k, KlemsBsdf) for b in (k.basis_in, k.basis_out)}
    for basis in sorted(bases, key=lambda basis: basis.name):
        yield from _angle_basis(basis)
    yield "</DataDefinition>\n"


def _structure(bsdf: Bsdf) -> str:
    if isinstance(bsdf, KlemsBsdf):
        return "Columns"
    ranks = {tree.rank for tree in bsdf.blocks().values()}
    if len(ranks) != 1:
        raise ValueError("one file holds tensor trees of one rank")
    return f"TensorTree{ranks.pop()}"


def _angle_basis(basis: KlemsBasis) -> Iterator[str]:
    yield f"\t<AngleBasis>\n\t<AngleBasisName>{escape(basis.name, quote=False)}</AngleBasisName>\n"
    bounds = np.degrees(basis.theta_bounds)
    for ring, count in enumerate(basis.phi_counts):
        middle = 0.0 if ring == 0 and count == 1 else 0.5 * (bounds[ring] + bounds[ring + 1])
        yield (
            f"\t<AngleBasisBlock><Theta>{middle:.9g}</Theta><nPhis>{count}</nPhis><ThetaBounds>"
            f"<LowerTheta>{bounds[ring]:.9g}</LowerTheta>"
            f"<UpperTheta>{bounds[ring + 1]:.9g}</UpperTheta>"
            "</ThetaBounds></AngleBasisBlock>\n"
        )
    yield "\t</AngleBasis>\n"


def _block(band: str, name: str, bsdf: Bsdf, block: NDArray[np.float64] | TensorTree, digits: int) -> Iterator[str]:
    kind, side = name.split("_")
    source, detector = SPECTRA.get(band, SPECTRA["Visible"])
    yield (
        f'<WavelengthData>\n\t<LayerNumber>System</LayerNumber>\n\t<Wavelength unit="Integral">'
        f"{escape(band, quote=False)}</Wavelength>\n\t<SourceSpectrum>{source}</SourceSpectrum>\n"
        f"\t<DetectorSpectrum>{detector}</DetectorSpectrum>\n\t<WavelengthDataBlock>\n"
        f"\t<WavelengthDataDirection>{kind.title()} {side.title()}</WavelengthDataDirection>\n"
    )
    if isinstance(bsdf, TensorTreeBsdf):
        yield "\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n"
    else:
        yield f"\t<ColumnAngleBasis>{escape(bsdf.basis_in.name, quote=False)}</ColumnAngleBasis>\n"
        yield f"\t<RowAngleBasis>{escape(bsdf.basis_out.name, quote=False)}</RowAngleBasis>\n"
    data_type = "BTDF" if kind == "transmission" else "BRDF"
    yield f"\t<ScatteringDataType>{data_type}</ScatteringDataType>\n\t<ScatteringData>\n"
    if isinstance(block, TensorTree):
        yield from format_tree(block.rank, block.depths, block.values, digits)
    else:
        pattern = f"%.{digits}g"
        for row in block:
            yield ", ".join(pattern % value for value in row) + ",\n"
    yield "\t</ScatteringData>\n\t</WavelengthDataBlock>\n</WavelengthData>\n"
