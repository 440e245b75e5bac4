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
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from mitsuba_cfs.bsdf.angular import AngularTable, roos_table, stack_table
from mitsuba_cfs.bsdf.glazing import Glazing, Pane
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.klems_peak import through_peak
from mitsuba_cfs.bsdf.pane_file import read_glazing_layers, read_pane_file
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from scenes.toml_file import Share, TomlTable

COLUMNS = ("theta_deg", "transmittance")
OPTIONAL = ("reflectance_front", "reflectance_back")
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
            return replace(
                read_pane_file(folder / self.product), turned=self.flipped
            ).visible_pane()
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
                layers = read_glazing_layers(folder / self.glazing)
                return stack_table([layer.visible_pane() for layer in layers])
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
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
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
