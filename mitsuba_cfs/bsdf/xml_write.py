"""Writing BSDF XML files that WINDOW, Radiance and this project read."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike
from xml.sax.saxutils import escape

import numpy as np

from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_text import format_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree
from mitsuba_cfs.files import replacing

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


def _lines(bsdf: BsdfFile, digits: int) -> Iterator[str]:
    yield HEADER
    yield from _material(bsdf)
    yield from _definition(list(bsdf.bands.values()))
    for band, data in bsdf.bands.items():
        for name, block in data.blocks().items():
            yield from _block(band, name, data, block, digits)
    yield FOOTER


def _material(bsdf: BsdfFile) -> Iterator[str]:
    yield "<Material>\n"
    yield f"\t<Name>{escape(bsdf.name)}</Name>\n"
    yield f"\t<Manufacturer>{escape(bsdf.manufacturer)}</Manufacturer>\n"
    for tag, length in (
        ("Thickness", bsdf.thickness),
        ("Width", bsdf.width),
        ("Height", bsdf.height),
    ):
        if length is not None:
            yield f'\t<{tag} unit="meter">{length:.9g}</{tag}>\n'
    yield f"\t<DeviceType>{escape(bsdf.device_type)}</DeviceType>\n"
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
    yield f"\t<AngleBasis>\n\t<AngleBasisName>{escape(basis.name)}</AngleBasisName>\n"
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


def _block(band: str, name: str, bsdf: Bsdf, block, digits: int) -> Iterator[str]:
    kind, side = name.split("_")
    source, detector = SPECTRA.get(band, SPECTRA["Visible"])
    yield (
        f'<WavelengthData>\n\t<LayerNumber>System</LayerNumber>\n\t<Wavelength unit="Integral">'
        f"{escape(band)}</Wavelength>\n\t<SourceSpectrum>{source}</SourceSpectrum>\n"
        f"\t<DetectorSpectrum>{detector}</DetectorSpectrum>\n\t<WavelengthDataBlock>\n"
        f"\t<WavelengthDataDirection>{kind.title()} {side.title()}</WavelengthDataDirection>\n"
    )
    if isinstance(block, TensorTree):
        yield "\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n"
    else:
        yield f"\t<ColumnAngleBasis>{escape(bsdf.basis_in.name)}</ColumnAngleBasis>\n"
        yield f"\t<RowAngleBasis>{escape(bsdf.basis_out.name)}</RowAngleBasis>\n"
    data_type = "BTDF" if kind == "transmission" else "BRDF"
    yield f"\t<ScatteringDataType>{data_type}</ScatteringDataType>\n\t<ScatteringData>\n"
    if isinstance(block, TensorTree):
        yield from format_tree(block.rank, block.depths, block.values, digits)
    else:
        pattern = f"%.{digits}g"
        for row in block:
            yield ", ".join(pattern % value for value in row) + ",\n"
    yield "\t</ScatteringData>\n\t</WavelengthDataBlock>\n</WavelengthData>\n"
