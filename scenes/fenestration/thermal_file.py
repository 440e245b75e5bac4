"""Thermal and angular data of a fenestration system, from the `.toml` file beside its BSDF.

    [angular]                    # exact angular transmittance of a specular system
    table = "glass.csv"          # columns theta_deg, transmittance (, reflectance_front, _back)

    [angular.roos]               # or a whole glazing unit after Roos et al. 2001
    transmittance = 0.70
    reflectance_front = 0.12
    reflectance_back = 0.13
    panes = 2
    category = 4

    [[angular.pane]]             # or its panes, the outer one first
    product = "coated.json"      # of the IGSDB; or transmittance, reflectance_front, _back, coated
    flipped = true

    [angular]
    glazing = "system.json"      # or a glazing system with its `layers`

Paths are relative to the TOML file.  The angular function is for the visible band.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from bim.colours import linear_of_display
from mitsuba_cfs.bsdf.angular import AngularTable, roos_table, stack_table
from mitsuba_cfs.bsdf.colour import reflectance_of_colour
from mitsuba_cfs.bsdf.glazing import Glazing, Pane
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_factor import SlatLight, SpectralFactor
from mitsuba_cfs.bsdf.spectral_pane import (
    VISIBLE_NM,
    SpectralPane,
    read_glazing_layers,
    read_pane_file,
    read_product_file,
    read_spectral_pane,
    spectral_glazing,
)
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, reason, write_text
from mitsuba_cfs.spectra.detectors import NANOMETRES
from scenes import plausible
from scenes.toml_file import Positive, Share, TomlTable, read_table, validated
from thermal.blackbox import LayerResistance, conductance_table
from thermal.closure import U_MODELS, Closure
from thermal.errors import ThermalInputError
from thermal.gases import GAS_NAMES
from thermal.glazing import GASES, Gap
from thermal.glazing_unit import (
    GasGap,
    GlazingLayer,
    GlazingUnit,
    perforated_layer,
    sheet_layer,
    venetian_layer,
    woven_layer,
)
from thermal.gvalue import TYPICAL_SYSTEMS

ANGULAR_COLUMNS = ("theta_deg", "transmittance")
ANGULAR_OPTIONAL = ("reflectance_front", "reflectance_back")
SPECTRUM_COLUMNS = ("wavelength_nm", "transmittance")
WIDEST_GAP_NM = 50.0  # between visible data of a pane, which files have every 5 to 20 nm
REFLECTANCE_COLUMNS = ("wavelength_nm", "reflectance")
SLAT_STEP = 10  # nanometres between the reflectances in a file of coloured slats
SLAT_NAMES = ("wavelength_nm", "reflectance", "shares")  # of that file
LARGEST_SHARE = 100.0  # in amount: shares are coefficients of a polynomial, of which only the sum is a share
SPECTRUM_OPTIONAL = ("reflectance",)  # of the side of a shade that faces the panes
Film = Annotated[Positive, plausible.RESISTANCE]  # [m2 K/W]
PATCHES = KLEMS_FULL.size
ByPatch = Annotated[tuple[float, ...], Field(min_length=PATCHES, max_length=PATCHES)]
Table = TypeVar("Table", bound="ClosureTable")
WindowTable = TypeVar("WindowTable", bound="WindowHeatTable")
# the model of U that a key belongs to
OF_MODEL = {"gap": "gap", "surface": "surface", "conductance": "surface", "layers": "layers", "u_slope": "linear"}
SHADES = ("slats", "threads", "holes", "openness")  # what makes a layer a shade


class PaneTable(TomlTable):
    """A pane: a product of the IGSDB, or its values at normal incidence."""

    product: Path | None = None
    flipped: bool = False  # the product's front is towards the room
    transmittance: Share | None = None
    reflectance_front: Share | None = None
    reflectance_back: Share | None = None
    coated: bool = False

    @model_validator(mode="after")
    def _has_values(self) -> PaneTable:
        if (self.product is None) == (self.transmittance is None):
            raise ValueError("expected either product or transmittance")
        if self.product is None and self.reflectance_front is None:
            raise ValueError("transmittance needs reflectance_front")
        return self

    def pane(self, folder: Path) -> Pane:
        """The pane as the formulas take it; `ValueError` where its values cannot be."""
        if self.product is not None:
            return replace(read_pane_file(folder / self.product), turned=self.flipped).visible_pane()
        front, back = self.reflectance_front, self.reflectance_back
        back = front if back is None else back
        sides = (back, front) if self.flipped else (front, back)
        return Pane("pane", self.transmittance, *sides, self.coated or front != back)


class RoosTable(TomlTable):
    """A glazing unit by its values at normal incidence, after Roos."""

    transmittance: Share
    reflectance_front: Share
    reflectance_back: Share
    panes: Annotated[int, Field(ge=1, le=3)] = 2
    category: Annotated[float, Field(ge=1, le=10)] = 4.0


class AngularData(TomlTable):
    """What is known of a specular system at every angle; one of the four."""

    table: Path | None = None
    roos: RoosTable | None = None
    pane: tuple[PaneTable, ...] = ()
    glazing: Path | None = None

    @model_validator(mode="after")
    def _is_one(self) -> AngularData:
        if len(self.model_fields_set) != 1 or not any((self.table, self.roos, self.pane, self.glazing)):
            raise ValueError("expected one of table, roos, pane and glazing")
        return self

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it names, as they stand there."""
        named = (self.table, self.glazing, *(one.product for one in self.pane))
        return tuple(file for file in named if file is not None)

    def read(self, path: Path) -> AngularTable:
        """The function of the file `path`; `DataError` where it cannot be."""
        folder = path.parent
        if self.table is not None:
            return read_angular_table(folder / self.table)
        try:
            if self.roos is not None:
                return roos_table(Glazing("glazing", **self.roos.model_dump()))
            if self.glazing is not None:
                layers = read_glazing_layers(folder / self.glazing)
                return stack_table([layer.visible_pane() for layer in layers])
            return stack_table([one.pane(folder) for one in self.pane])
        except DataError:
            raise
        except ValueError as error:
            raise DataError(str(error), file=path, field="angular") from error


def read_angular_table(path: Path) -> AngularTable:
    """A CSV file of `ANGULAR_COLUMNS`, and of `ANGULAR_OPTIONAL` those that are known."""
    columns = csv_columns(path, ANGULAR_COLUMNS, ANGULAR_OPTIONAL)
    try:
        return AngularTable(np.radians(columns.pop("theta_deg")), **columns)
    except ValueError as error:
        raise DataError(str(error), file=path) from error


def csv_columns(path: Path, required: Sequence[str], optional: Sequence[str] = ()) -> dict[str, NDArray[np.float64]]:
    """The columns of numbers of a CSV file; `DataError` where one is missing or no number."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(line for line in stream if line.strip()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    if not rows or not set(required) <= set(rows[0]):
        raise DataError(f"expected the columns {', '.join(required)}", file=path)
    names = [*required, *(name for name in optional if name in rows[0])]
    values: dict[str, list[float]] = {name: [] for name in names}
    for number, row in enumerate(rows, start=2):
        for name in names:
            try:
                values[name].append(float(row[name]))
            except (TypeError, ValueError):
                values[name].append(np.nan)
            if not np.isfinite(values[name][-1]):
                message = f"{row[name]!r} is not a number"
                raise DataError(message, file=path, element=f"line {number}", field=name)
    return {name: np.array(column) for name, column in values.items()}


Length = Annotated[Positive, plausible.LAYER]
Both = tuple[Share, Share]  # front (outdoors) and back


class LayerGapTable(TomlTable):
    """The space behind a layer, towards the room."""

    width: Annotated[Positive, plausible.GAP]  # [m]
    gas: dict[Literal[GAS_NAMES], Share] = Field({"air": 1.0})  # volume fractions


class SlatTable(TomlTable):
    """The slats of a venetian blind; with `visible` the recipe of their BSDF."""

    width: Length
    spacing: Length
    tilt_deg: Annotated[float, Field(ge=-90, le=90)] = 0.0  # positive lowers the outer edge
    thickness: Length = 0.0005  # 0 in light where it is not stated
    radius: Length | None = None  # of the curvature, the hollow side down; None: flat
    visible: Share | None = None  # reflectance
    solar: Share | None = None  # None: as visible
    specular: Share = 0.0  # as of `cfs bsdf generate`
    roughness: Share = 0.0

    @model_validator(mode="after")
    def _has_its_reflectance(self) -> SlatTable:
        for key in ("solar", "specular", "roughness"):
            if key in self.model_fields_set and self.visible is None:
                raise ValueError(f"{key}: needs `visible`, the reflectance of the slats")
        if self.radius is not None and self.radius < self.width / 2:
            raise ValueError("radius: expected at least half the width")
        return self

    @property
    def reflectances(self) -> tuple[float, float]:
        """Visible and solar reflectance; 0 where it is not stated."""
        visible = self.visible or 0.0
        return visible, visible if self.solar is None else self.solar


class CellTable(TomlTable):
    """Threads of a fabric or round holes of a screen: their diameter and spacing."""

    diameter: Length
    spacing: Length


class GlazingLayerTable(TomlTable):
    """A pane, from a file by wavelength or by its values; or a shade."""

    pane: Path | None = None  # Optics or IGSDB file
    turned: bool = False  # the pane's back is outdoors
    thickness: Length | None = None  # [m]
    conductivity: Annotated[float, plausible.CONDUCTIVITY] | None = None  # [W/(m K)]
    emissivity: Both | None = None  # of a shade: of its material
    infrared_transmittance: Share | None = None
    solar: tuple[Share, Share, Share] | None = None  # transmittance, reflectance front and back
    visible: tuple[Share, Share, Share] | None = None  # the same; without: as the sun's
    slats: SlatTable | None = None
    threads: CellTable | None = None
    holes: CellTable | None = None
    openness: Share | None = None  # open share of a shade of no known cell
    edges: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # [m] top, bottom, left, right
    gap: LayerGapTable | None = None  # none behind the innermost layer

    @model_validator(mode="after")
    def _is_one_kind(self) -> GlazingLayerTable:
        kinds = [name for name in ("pane", *SHADES) if getattr(self, name) is not None]
        if len(kinds) > 1:
            raise ValueError(f"{kinds[0]} and {kinds[1]} exclude each other")
        shade = self.is_shade
        if not kinds and self.thickness is None:
            raise ValueError("expected a pane (a file, or its thickness) or one of " + _listed())
        for key in ("solar", "visible") if shade else ():
            if getattr(self, key) is not None:
                raise ValueError(f"{key}: is of panes; what a shade absorbs follows from the BSDF")
        if not shade and any(self.edges):
            raise ValueError("edges: are of shades: " + _listed())
        return self

    @property
    def is_shade(self) -> bool:
        """Whether the layer is no pane."""
        return any(getattr(self, name) is not None for name in SHADES)

    def layer(self) -> GlazingLayer:
        """The layer; `DataError` for a pane's file that cannot be read."""
        stated = {"conductivity": self.conductivity, "emissivity": self.emissivity}
        given = {name: value for name, value in stated.items() if value is not None}
        if self.slats is not None:
            s = self.slats
            return venetian_layer(s.width, s.spacing, s.tilt_deg, slat_thickness=s.thickness, edges=self.edges, **given)
        if self.thickness is not None:
            given["thickness"] = self.thickness
        if self.pane is not None:
            return self._of_file()
        if self.infrared_transmittance is not None and self.openness is None:
            given["infrared_transmittance"] = self.infrared_transmittance
        if self.threads is not None:
            return woven_layer(self.threads.diameter, self.threads.spacing, edges=self.edges, **given)
        if self.holes is not None:
            return perforated_layer(self.holes.diameter, self.holes.spacing, edges=self.edges, **given)
        if self.openness is not None:
            passed = self.infrared_transmittance
            return sheet_layer(self.openness, edges=self.edges, infrared_transmittance=passed, **given)
        return GlazingLayer(solar=self.solar, **given)

    def spectral(self) -> SpectralPane:
        """The pane of the file, as it is turned."""
        pane = read_spectral_pane(self.pane, thickness=self.thickness)
        return pane.turned() if self.turned else pane

    def _of_file(self) -> GlazingLayer:
        pane = self.spectral()
        sun = spectral_glazing([pane])["Solar"]
        values = (sun.transmittance, sun.reflectance_front, sun.reflectance_back)
        return GlazingLayer(
            self.thickness or pane.thickness,
            self.conductivity or pane.conductivity,
            self.emissivity or pane.emissivity,
            pane.infrared_transmittance,
            solar=self.solar or tuple(float(v[0]) for v in values),
        )


def spectral_panes(layers: Sequence[GlazingLayerTable]) -> tuple[SpectralPane, ...]:
    """The panes of layers that all come from files of spectra; none where one does not."""
    if any(layer.pane is None for layer in layers):
        return ()
    return tuple(layer.spectral() for layer in layers)


def _listed() -> str:
    return ", ".join(SHADES)


def glazing_unit(layers: tuple[GlazingLayerTable, ...], height: float, width: float, tilt_deg: float) -> GlazingUnit:
    """The unit of layers from outside to inside; `ThermalInputError` where they are none."""
    gaps = tuple(GasGap(one.gap.width, tuple(one.gap.gas.items())) for one in layers if one.gap is not None)
    return GlazingUnit(tuple(one.layer() for one in layers), gaps, height, width, tilt_deg)


class GapTable(TomlTable):
    """The gas gap between the panes, for `u_model = "gap"`; triple glazing has two."""

    width: Annotated[Positive, plausible.GAP]  # [m]
    gas: dict[Literal[tuple(GASES)], Share] = Field({"argon": 0.9, "air": 0.1})
    emissivity: tuple[Share, Share] = (0.837, 0.03)  # of the two faces that bound it


class ConductanceTable(TomlTable):
    """Conductance between the outermost and the innermost face by their temperatures, on a regular grid."""

    mean_c: Annotated[tuple[float, ...], Field(min_length=2)]  # mean of both faces [degC]
    difference_k: Annotated[tuple[float, ...], Field(min_length=2)]  # between them [K]
    values: tuple[tuple[Positive, ...], ...]  # [W/(m2 K)], one row for each mean

    @model_validator(mode="after")
    def _is_a_grid(self) -> ConductanceTable:
        for name in ("mean_c", "difference_k"):
            steps = np.diff(getattr(self, name))
            if steps.min() <= 0 or np.ptp(steps) > 1e-6 * steps.max():
                raise ValueError(f"{name}: expected values that rise by equal steps")
        if {len(row) for row in self.values} != {len(self.difference_k)} or len(self.values) != len(self.mean_c):
            raise ValueError(f"values: expected {len(self.mean_c)} rows of {len(self.difference_k)}")
        return self

    def resistance(self) -> LayerResistance:
        """R(T_m, dT)."""
        return conductance_table(self.mean_c, self.difference_k, self.values)


class ClosureTable(TomlTable):
    """How a system's thermal model is closed: in a study, and beside a BSDF file."""

    u_model: Literal[U_MODELS] | None = None  # None: that of the other keys, else typical
    gap: GapTable | None = None
    u_slope: Annotated[float, Field(ge=-0.05, le=0.05)] | None = None  # of U for "linear" [1/K]
    # 1/R = c0 + c1 x + c2 d + c3 d2 + c4 x d + c5 x2, see thermal.blackbox.LayerResistance
    surface: Annotated[tuple[float, ...], Field(min_length=6, max_length=6)] | None = None
    conductance: ConductanceTable | None = None
    layers: tuple[GlazingLayerTable, ...] = ()  # outermost first: ISO 15099
    glazing_height: Annotated[Positive, plausible.LENGTH] = 1.5  # [m] of the layers
    glazing_width: Annotated[Positive, plausible.LENGTH] = 1.0  # [m]: open edges at its sides
    glazing_tilt_deg: Annotated[float, Field(ge=0, le=180)] = 90.0  # from horizontal
    realised_inner_resistance: Film | None = None  # [m2 K/W], see thermal.blackbox
    realised_outer_resistance: Film | None = None

    @model_validator(mode="after")
    def _fits_its_model(self) -> ClosureTable:
        stated = [key for key in OF_MODEL if getattr(self, key)]
        models = {OF_MODEL[key] for key in stated}
        if len(models) > 1:
            raise ValueError(f"{stated[0]} and {stated[1]} exclude each other")
        model = self.u_model
        if model in OF_MODEL.values() and model != "linear" and model not in models:
            raise ValueError(f'u_model "{model}" and {model} belong together')
        if model is not None and models and models != {model}:
            raise ValueError(f'{stated[0]}: belongs to u_model "{OF_MODEL[stated[0]]}"')
        films = (self.realised_inner_resistance, self.realised_outer_resistance)
        if "layers" in models and films != (None, None):
            raise ValueError("layers: give the realised films, which are not to be stated too")
        return self

    def placed(self: Table, folder: Path) -> Table:
        """The table with the files of its panes in a folder."""
        if not self.layers:  # so that the table does not state any
            return self
        layers = tuple(
            layer if layer.pane is None else layer.model_copy(update={"pane": folder / layer.pane})
            for layer in self.layers
        )
        return self.model_copy(update={"layers": layers})

    def closure(self) -> Closure | None:
        """What the table states; None where it states nothing."""
        if not self.model_fields_set & set(ClosureTable.model_fields):
            return None
        gap, unit = self.gap, None
        if gap is not None:
            gap = Gap(gap.width, tuple(gap.gas.items()), gap.emissivity)
        if self.layers:
            unit = glazing_unit(self.layers, self.glazing_height, self.glazing_width, self.glazing_tilt_deg)
        stated = [OF_MODEL[key] for key in OF_MODEL if getattr(self, key)]
        if self.realised_inner_resistance or self.realised_outer_resistance:
            stated.append("constant")
        more = {} if self.u_slope is None else {"slope": self.u_slope}
        return Closure(
            self.u_model or [*stated, "typical"][0],
            gap,
            self.realised_inner_resistance,
            self.realised_outer_resistance,
            surface=self._resistance(),
            unit=unit,
            **more,
        )

    @property
    def recipe(self: Table) -> Table | None:
        """The table where its layers give the system's BSDF: panes with their light, slats with their reflectance."""
        slats = [layer.slats for layer in self.layers if layer.is_shade]
        known = len(slats) == 1 and slats[0] is not None and slats[0].visible is not None
        panes = [layer for layer in self.layers if not layer.is_shade]
        return self if known and panes and all(pane.pane or pane.solar for pane in panes) else None

    def _resistance(self) -> LayerResistance | None:
        """R(T_m, dT) as stated, by coefficients or by a table."""
        if self.conductance is not None:
            return self.conductance.resistance()
        return None if self.surface is None else LayerResistance("surface", self.surface)


PEAK_SHARES = {"specular": 1.0, "lobe": 0.0}  # that pass straight on


class SpectralTable(TomlTable):
    """Spectrum of a system whose BSDF has a visible band alone: of its panes and its shade."""

    panes: tuple[Path, ...] = ()  # Optics or IGSDB files
    shade: Path | None = None  # CSV file of `SPECTRUM_COLUMNS`
    slats: Path | None = None  # JSON file that `cfs bsdf generate` writes of a coloured blind

    @model_validator(mode="after")
    def _has_some(self) -> SpectralTable:
        if not self.panes and self.shade is None and self.slats is None:
            raise ValueError("expected panes, shade or slats")
        if self.shade is not None and self.slats is not None:
            raise ValueError("expected shade or slats, got both")
        return self

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it names."""
        return (*self.panes, *(file for file in (self.shade, self.slats) if file is not None))

    def placed(self, folder: Path) -> SpectralTable:
        """The table with its files in a folder."""
        shade, slats = (None if file is None else folder / file for file in (self.shade, self.slats))
        panes = tuple(folder / pane for pane in self.panes)
        return self.model_copy(update={"panes": panes, "shade": shade, "slats": slats})

    def factor(self) -> SpectralFactor:
        """Transmittance by wavelength and angle; `DataError` for a file that cannot be read."""
        # no transmittance depends on the thickness, which some files do not state
        panes = [read_spectral_pane(pane, thickness=0.004) for pane in self.panes]
        for file, pane in zip(self.panes, panes, strict=True):
            if fault := visible_fault(pane):
                raise DataError(fault, file=file, field="spectral_data")
        if self.slats is not None:  # what the slats reflect of the room's light is not known by wavelength
            return replace(SpectralFactor.of_panes(panes), mirrored=None, slats=read_slat_light(self.slats))
        shade = (1.0, 0.0) if self.shade is None else read_spectrum(self.shade)
        return SpectralFactor.of_panes(panes, *shade)


def visible_fault(pane: SpectralPane) -> str:
    """Why the data of a pane do not tell its visible spectrum; "" where they do."""
    nm, (low, high) = pane.wavelength_nm, VISIBLE_NM
    if nm[0] > low or nm[-1] < high:
        return f"its spectrum is of {nm[0]:g} to {nm[-1]:g} nm, expected {low:g} to {high:g}"
    widest = int(np.argmax(np.where((nm[1:] > low) & (nm[:-1] < high), np.diff(nm), 0.0)))
    if nm[widest + 1] - nm[widest] <= WIDEST_GAP_NM:
        return ""
    return (
        f"its spectrum has nothing between {nm[widest]:g} and {nm[widest + 1]:g} nm, "
        f"expected steps of {WIDEST_GAP_NM:g} nm at most"
    )


def read_spectrum(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance at `NANOMETRES` of a CSV file of `SPECTRUM_COLUMNS`.

    The reflectance is 0 where the file has none.

    Raises: `DataError` for a file that cannot be read or does not span 380 to 780 nm.
    """
    columns = csv_columns(path, SPECTRUM_COLUMNS, SPECTRUM_OPTIONAL)
    nm, tau = columns["wavelength_nm"], columns["transmittance"]
    rho = columns.get("reflectance", np.zeros_like(nm))
    if len(nm) < 2 or np.any(np.diff(nm) <= 0) or tau.min() < 0 or not tau.any():
        message = "expected rising wavelengths and a transmittance that is not 0"
        raise DataError(message, file=path)
    if nm[0] > NANOMETRES[0] or nm[-1] < NANOMETRES[-1]:
        raise DataError("expected wavelengths from 380 to 780 nm", file=path)
    if rho.min() < 0 or (rho.any() and (tau + rho).max() > 1):
        message = "with a reflectance, expected shares of 1 that are 1 at most together"
        raise DataError(message, file=path)
    return np.interp(NANOMETRES, nm, tau), np.interp(NANOMETRES, nm, rho)


def write_slat_light(light: SlatLight, path: Path) -> None:
    """A JSON file of coloured slats: reflectance, and shares [n][emergent][incident] that are reflected n times."""
    document = {
        "wavelength_nm": NANOMETRES[::SLAT_STEP].tolist(),
        "reflectance": [round(value, 5) for value in light.reflectance[::SLAT_STEP].tolist()],
        "shares": np.round(light.shares, 4).tolist(),
    }
    write_text(path, json_text(document, separators=(",", ":")) + "\n")


def read_slat_light(path: Path) -> SlatLight:
    """The colour of the slats of a file that `write_slat_light` wrote.

    Raises: `DataError` for another file.
    """
    document, size = read_product_file(path), KLEMS_FULL.size
    try:
        nm, rho, shares = (np.array(document[name], dtype=float) for name in SLAT_NAMES)
    except (KeyError, TypeError, ValueError):
        raise DataError(f"expected numbers of {', '.join(SLAT_NAMES)}", file=path) from None
    if shares.ndim != 3 or shares.shape[1:] != (size, size):
        raise DataError(f"expected {size} x {size} patches for each number of reflections", file=path, field="shares")
    if nm.shape != rho.shape or not np.array_equal(nm, NANOMETRES[::SLAT_STEP]):
        raise DataError(f"expected a reflectance every {SLAT_STEP} nm from 380 to 780", file=path, field="reflectance")
    if not ((rho >= 0) & (rho <= 1)).all():
        raise DataError("expected numbers from 0 to 1", file=path, field="reflectance")
    if not (np.abs(shares) <= LARGEST_SHARE).all():
        raise DataError(f"expected numbers from -{LARGEST_SHARE:g} to {LARGEST_SHARE:g}", file=path, field="shares")
    return SlatLight(np.interp(NANOMETRES, nm, rho), shares)


def read_reflectance(path: Path) -> NDArray[np.float64]:
    """Reflectance at `NANOMETRES` of a CSV file of `REFLECTANCE_COLUMNS`.

    Raises: `DataError` for a file that cannot be read or does not span 380 to 780 nm.
    """
    columns = csv_columns(path, REFLECTANCE_COLUMNS)
    nm, rho = (columns[name] for name in REFLECTANCE_COLUMNS)
    if len(nm) < 2 or np.any(np.diff(nm) <= 0) or nm[0] > NANOMETRES[0] or nm[-1] < NANOMETRES[-1]:
        raise DataError("expected rising wavelengths from 380 to 780 nm", file=path)
    if rho.min() < 0 or rho.max() > 1 or not rho.any():
        raise DataError("expected reflectances from 0 to 1, not all 0", file=path, field="reflectance")
    return np.interp(NANOMETRES, nm, rho)


def reflectance_of_code(code: str) -> NDArray[np.float64]:
    """Smooth reflectance at `NANOMETRES` of a colour "#rrggbb" (sRGB); `ValueError` for another text."""
    if not re.fullmatch("#[0-9a-fA-F]{6}", code):
        raise ValueError(f"colour: expected #rrggbb, got {code!r}")
    return reflectance_of_colour(linear_of_display([int(code[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


class WindowHeatTable(ClosureTable):
    """What else is known of a system: in a study, and beside a BSDF file."""

    spectral: SpectralTable | None = None  # in place of the panes of `layers`

    u_value: Annotated[float, Field(ge=0.1, le=7)] | None = None  # [W/(m2 K)]
    g_value: Share | None = None  # at normal incidence
    g_value_by_angle: tuple[tuple[float, Share], ...] = ()  # angle of incidence [degrees] and g
    g_value_by_patch: ByPatch | None = None  # for each incident patch of the Klems full basis
    shading_position: Literal[tuple(TYPICAL_SYSTEMS)] | None = None  # of the shade
    see_through: Literal["specular", "lobe"] | Share | None = None  # of the transmission peak

    @model_validator(mode="after")
    def _has_one_g(self) -> WindowHeatTable:
        keys = ("g_value_by_angle", "g_value_by_patch")
        if all(getattr(self, key) for key in keys):
            raise ValueError(f"{keys[0]} and {keys[1]} exclude each other")
        angles = [angle for angle, _ in self.g_value_by_angle]
        if angles and (angles != sorted(set(angles)) or angles[0] < 0 or angles[-1] > 90):
            raise ValueError("g_value_by_angle: expected rising angles from 0 to 90 degrees")
        return self

    def placed(self: WindowTable, folder: Path) -> WindowTable:
        """The table with the files that it names in a folder."""
        whole = super().placed(folder)
        if self.spectral is None:
            return whole
        return whole.model_copy(update={"spectral": self.spectral.placed(folder)})

    def spectrum(self) -> SpectralFactor | None:
        """Spectrum that the table states, else that of the panes of its layers.

        None where it is not known: neither is there, or data of a pane are too coarse for colour.
        """
        if self.spectral is not None:
            return self.spectral.factor()
        files = [layer for layer in self.layers if layer.pane is not None]
        panes = [layer.spectral() for layer in files]
        if not panes or any(map(visible_fault, panes)):
            return None
        return replace(SpectralFactor.of_panes(panes), whole=len(panes) == len(self.layers))

    def g_by_patch(self) -> NDArray[np.float64] | None:
        """g [K] of the Klems full patches where it is stated by patch or by angle."""
        if self.g_value_by_patch is not None:
            return np.array(self.g_value_by_patch)
        if not self.g_value_by_angle:
            return None
        angles, values = np.array(self.g_value_by_angle, dtype=float).T
        return np.interp(KLEMS_FULL.centres()[0], np.radians(angles), values)

    @property
    def straight_share(self) -> float | None:
        """Share of the transmission peak that passes straight on; None: by the data."""
        if isinstance(self.see_through, str):
            return PEAK_SHARES[self.see_through]
        return self.see_through


class StateTable(WindowHeatTable):
    """One shading state: a BSDF file, or `layers` of panes alone, and what else was measured."""

    bsdf: Path | None = None
    tilt_deg: Annotated[float, Field(ge=-90, le=90)] | None = None  # of its slats, as in a family

    @model_validator(mode="after")
    def _has_optics(self) -> StateTable:
        if self.bsdf is None and not self.layers:
            raise ValueError("bsdf: is missing; only panes, as `layers`, go without one")
        if self.bsdf is None and self.see_through is not None:
            raise ValueError("see_through: panes are specular")
        for number, layer in enumerate(self.layers if self.bsdf is None else ()):
            if layer.is_shade:
                raise ValueError(f"layers.{number}: a shade's light needs a `bsdf` of the system")
            if layer.pane is None and layer.solar is None:
                message = "its transmittance and reflectances are missing, and there is no `bsdf`"
                raise ValueError(f"layers.{number}.solar: {message}")
        return self


class ThermalTable(WindowHeatTable):
    """The file beside a BSDF: the same as a study's [[system]], and the source of its g."""

    angular: AngularData | None = None  # of a specular system, visible
    # layer by layer; for readers, the balance takes g
    inward_fractions: tuple[Share, ...] = ()
    absorptance_blind: ByPatch | None = None
    absorptance_outer_pane: ByPatch | None = None
    absorptance_inner_pane: ByPatch | None = None
    kappa: Share | None = None  # of Kuhn's formula


def files_beside(bsdf: Path) -> tuple[Path, ...]:
    """The `.toml` file beside a BSDF's and the files that it names; none where there is none."""
    path = bsdf.with_suffix(".toml")
    if not path.is_file():
        return ()
    table = validated(ThermalTable, read_table(path), path)
    named = [layer.pane for layer in table.layers if layer.pane is not None]
    named += () if table.angular is None else table.angular.files
    if table.spectral is not None:
        named += table.spectral.files
    there = (path.parent / file for file in named)
    return path, *(file for file in there if file.is_file())


@dataclass(frozen=True, slots=True)
class ThermalFile:
    """U, g, closure, place of the shade and angular function, from the file beside a BSDF.

    The file has the name of the XML file; `ThermalTable` says what it may hold.
    """

    u_value: float | None = None
    g_value: float | None = None
    g_value_by_patch: NDArray[np.float64] | None = None  # [K]
    closure: Closure | None = None
    shading_position: str | None = None
    angular: AngularTable | None = None  # visible, of a specular system
    panes: tuple[SpectralPane, ...] = ()  # all layers, where each is a file of spectra
    spectrum: SpectralFactor | None = None  # None: not known
    see_through: float | None = None  # share of the transmission peak that passes straight on
    recipe: ClosureTable | None = None  # whose layers give the BSDF

    @classmethod
    def read(cls, path: Path) -> ThermalFile:
        """The values of the file; nothing where there is none."""
        if not path.is_file():
            return cls()
        table = validated(ThermalTable, read_table(path), path)
        try:
            placed = table.placed(path.parent)
            closure = placed.closure()
        except ThermalInputError as error:
            raise DataError(str(error), file=path) from error
        return cls(
            table.u_value,
            table.g_value,
            table.g_by_patch(),
            closure,
            table.shading_position,
            None if table.angular is None else table.angular.read(path),
            spectral_panes(placed.layers),
            placed.spectrum(),
            table.straight_share,
            placed.recipe,
        )
