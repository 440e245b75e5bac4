"""The exact angular function of a specular system, from the `[angular]` table of its TOML file.

    [angular]
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

Files are looked for beside the TOML file.  All of it is for the visible band.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from mitsuba_cfs.bsdf.angular import AngularTable, roos_table, stack_table
from mitsuba_cfs.bsdf.en410 import visible_value
from mitsuba_cfs.bsdf.glazing import Glazing, Pane
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.errors import DataError
from scenes.toml_file import Share, TomlTable

COLUMNS = ("theta_deg", "transmittance")
OPTIONAL = ("reflectance_front", "reflectance_back")
NO_PANE = ("shading", "material")  # types of the IGSDB
SCATTERED = 0.05  # share of what a specular system passes that may be scattered
APART = 0.05  # that function and BSDF may pass more or less of diffuse light


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
            found = read_product(folder / self.product)
            return flipped(found) if self.flipped else found
        front, back = self.reflectance_front, self.reflectance_back
        back = front if back is None else back
        coated = self.coated or front != back
        found = Pane("pane", self.transmittance, front, back, coated)
        return flipped(found) if self.flipped else found


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
        if len(self.model_fields_set) != 1 or not any(
            (self.table, self.roos, self.pane, self.glazing)
        ):
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
                return stack_table(read_layers(folder / self.glazing))
            return stack_table([one.pane(folder) for one in self.pane])
        except DataError:
            raise
        except ValueError as error:
            raise DataError(str(error), file=path, field="angular") from error


def read_angular_table(path: Path) -> AngularTable:
    """A CSV file of `COLUMNS`, and of `OPTIONAL` those that are known."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(line for line in stream if line.strip()))
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read: {error}", file=path) from None
    if not rows or not set(COLUMNS) <= set(rows[0]):
        raise DataError(f"expected the columns {', '.join(COLUMNS)}", file=path)
    names = [*COLUMNS, *(name for name in OPTIONAL if name in rows[0])]
    values: dict[str, list[float]] = {name: [] for name in names}
    for number, row in enumerate(rows, start=2):
        for name in names:
            try:
                values[name].append(float(row[name]))
            except (TypeError, ValueError):
                message = f"{row[name]!r} is not a number"
                raise DataError(message, file=path, element=f"line {number}", field=name) from None
    columns = {name: np.array(column) for name, column in values.items()}
    try:
        return AngularTable(np.radians(columns.pop("theta_deg")), **columns)
    except ValueError as error:
        raise DataError(str(error), file=path) from error


def read_product(path: Path) -> Pane:
    """A pane of glass of the IGSDB's JSON: its integrated visible values, else its spectrum's."""
    data = _json(path)
    kind, measured = data.get("type") or "no type", data.get("measured_data") or {}
    if kind in NO_PANE or not measured.get("is_specular"):
        raise DataError(f"expected a specular pane, got {kind}", file=path, field="type")
    summary = (data.get("integrated_results_summary") or [{}])[0]
    values = [summary.get(name) for name in ("tfvis", "rfvis", "rbvis")]
    if None in values:
        rows = (data.get("spectral_data") or {}).get("spectral_data") or []
        values = _of_spectrum(
            {1e3 * r["wavelength"]: (r["T"], r["Rf"], r["Rb"]) for r in rows}, path
        )
    return _pane(data.get("name") or path.stem, values, data.get("coated_side"), path)


def read_layers(path: Path) -> list[Pane]:
    """The panes of a glazing system's JSON, whose `layers` hold spectra, the outer one first."""
    data, panes = _json(path), []
    for number, layer in enumerate(data.get("layers") or [], start=1):
        where = f"layer {number}"
        if layer.get("product_type") != "glazing":
            kind = layer.get("product_type")
            raise DataError(f"is no glass ({kind})", file=path, element=where)
        rows = {float(nm): values for nm, values in (layer.get("spectral_data") or {}).items()}
        pane = _pane(where, _of_spectrum(rows, path), layer.get("coated_side"), path)
        panes.append(flipped(pane) if layer.get("flipped") else pane)
    if not panes:
        raise DataError("has no layers", file=path, field="layers")
    return panes


def flipped(pane: Pane) -> Pane:
    """The pane turned round."""
    front, back = pane.reflectance_front, pane.reflectance_back
    return Pane(pane.name, pane.transmittance, back, front, pane.coated)


def check_specular(klems: KlemsBsdf, angular: AngularTable | None, path: Path) -> None:
    """`DataError` where the BSDF is not that of a specular system with this function."""
    if angular is None:
        return
    omega = klems.basis_in.projected_solid_angles()
    peak = through_peak(klems.filled().transmission_front, klems.basis_in)
    beam, rest = omega @ peak.transmittance / np.pi, omega @ peak.scattered @ omega / np.pi
    if rest > SCATTERED * (beam + rest):
        share = 100 * rest / (beam + rest)
        message = f"the BSDF scatters {share:.0f} % of what it passes: no function of an angle"
        raise DataError(message, file=path, field="angular")
    means = float(omega @ angular.patch_means(klems.basis_in) / np.pi)
    if abs(means - beam) > APART:
        message = f"passes {means:.2f} of diffuse light, the BSDF {beam:.2f}: not the same system"
        raise DataError(message, file=path, field="angular")


def _json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", file=path) from error
    except ValueError as error:
        raise DataError(f"is not JSON: {error}", file=path) from error
    if not isinstance(data, dict):
        raise DataError("expected a table of a product", file=path)
    return data


def _of_spectrum(rows: dict[float, tuple[float, float, float]], path: Path) -> list[float]:
    if not rows or min(rows) > 400 or max(rows) < 760:
        raise DataError("has no spectrum from 400 to 760 nm", file=path, field="spectral_data")
    nm = np.array(sorted(rows))
    return [visible_value(nm, np.array([rows[n][i] for n in nm])) for i in range(3)]


def _pane(name: str, values: list[float], side: str | None, path: Path) -> Pane:
    """A pane; one without a coating has the mean of what its two faces were measured at."""
    tau, front, back = values
    coated = (side or "Neither").lower() not in ("neither", "none", "na", "n/a", "")
    if not coated:
        front = back = 0.5 * (front + back)
    try:
        return Pane(name, tau, front, back, coated)
    except ValueError as error:
        raise DataError(str(error), file=path) from error
