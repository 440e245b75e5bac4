"""Reading the three inputs of a run, and checking that they belong together."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.resample import klems_of
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather, read_epw


@dataclass(frozen=True, slots=True)
class System:
    """A fenestration system: glazing and shade as one, in both bands."""

    name: str
    visible: KlemsBsdf  # Klems full, all blocks
    solar: KlemsBsdf
    u_value: float | None = None  # [W/(m2 K)]
    g_value: float | None = None  # at normal incidence
    g_by_patch: NDArray[np.float64] | None = None  # [K] by incident patch, before g_value
    notes: tuple[str, ...] = ()
    tree: TensorTreeBsdf | None = None  # visible, where the data are a tree: for sun and pictures

    @property
    def fine(self) -> Bsdf:
        """The visible band as finely as the data have it."""
        return self.visible if self.tree is None else self.tree


@dataclass(frozen=True, slots=True)
class ThermalFile:
    """U and g of a system, from the file beside its BSDF."""

    u_value: float | None = None
    g_value: float | None = None
    g_value_by_patch: NDArray[np.float64] | None = None  # [K]

    @classmethod
    def read(cls, path: Path) -> ThermalFile:
        """The values of the file; nothing where there is none."""
        if not path.is_file():
            return cls()
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise DataError(f"is not TOML: {error}", file=path) from error

        def number(field: str) -> float | None:
            value = table.get(field)
            if value is not None and (
                isinstance(value, bool) or not isinstance(value, int | float)
            ):
                raise DataError(f"expected a number, got {value!r}", file=path, field=field)
            return None if value is None else float(value)

        patches, field = table.get("g_value_by_patch"), "g_value_by_patch"
        if patches is not None:
            try:
                patches = np.array(patches, dtype=float)
            except (TypeError, ValueError) as error:
                raise DataError("expected a list of numbers", file=path, field=field) from error
            if patches.shape != (KLEMS_FULL.size,):
                message = f"expected {KLEMS_FULL.size} numbers, got {patches.size}"
                raise DataError(message, file=path, field=field)
        return cls(number("u_value"), number("g_value"), patches)


def read_system(
    path: Path, *, u_value: float | None = None, g_value: float | None = None
) -> System:
    """The system of a BSDF XML file, with U and g given, or of the `.toml` file beside it.

    The `.toml` file has the name of the XML file and may hold `u_value` [W/(m2 K)], `g_value` (at
    normal incidence) and `g_value_by_patch` (for each incident patch of the Klems full basis).
    """
    file = read_bsdf_xml(path)
    beside = ThermalFile.read(path.with_suffix(".toml"))
    return system_of(
        file.bands,
        file.name or path.stem,
        path=path,
        u_value=beside.u_value if u_value is None else u_value,
        g_value=beside.g_value if g_value is None else g_value,
        g_by_patch=beside.g_value_by_patch if g_value is None else None,
        notes=file.notes,
    )


def system_of(
    bands: Mapping[str, Bsdf],
    name: str,
    *,
    path: Path,
    notes: Sequence[str] = (),
    **thermal: float | NDArray[np.float64] | None,
) -> System:
    """The system of BSDF data by band, Klems full or tensor trees.

    Args: path: the file that the data come from; thermal: `u_value`, `g_value`, `g_by_patch`.
    """
    notes = list(notes)
    if "Visible" not in bands and "Solar" not in bands:
        raise DataError("has neither a Visible nor a Solar band", file=path, field="WavelengthData")
    for band, other in (("Visible", "Solar"), ("Solar", "Visible")):
        if band not in bands:
            notes.append(f"{name} has no {band} band: its {other} band stands in for it.")
    visible = bands.get("Visible") or bands["Solar"]
    solar = bands.get("Solar") or bands["Visible"]
    klems = _klems(visible, path, "Visible")
    return System(
        name,
        klems,
        klems if solar is visible else _klems(solar, path, "Solar"),
        notes=tuple(notes),
        tree=visible if isinstance(visible, TensorTreeBsdf) else None,
        **thermal,
    )


def _klems(bsdf: Bsdf, path: Path, band: str) -> KlemsBsdf:
    """The band as Klems full matrices with all blocks."""
    if isinstance(bsdf, KlemsBsdf) and {bsdf.basis_in, bsdf.basis_out} != {KLEMS_FULL}:
        raise DataError(
            f"has {bsdf.basis_out.size}x{bsdf.basis_in.size} patches; "
            f"the run needs the Klems full basis of 145x145",
            file=path,
            field=band,
        )
    return klems_of(bsdf)


def read_weather(path: Path) -> Weather:
    """Hourly weather of one year from an EPW file."""
    weather = read_epw(path)
    if weather.step_h != 1.0:
        raise DataError(f"has steps of {weather.step_h:g} h; the run needs hours", file=path)
    return weather


def chosen_spaces(building: Building, names: tuple[str, ...], path: Path) -> list[Space]:
    """The spaces of those names or GUIDs, or every space with a window."""
    if not building.spaces:
        raise DataError("has no rooms (IfcSpace)", file=path)
    if names:
        chosen = [_space(building, name, path) for name in names]
        for space in chosen:
            if not space.windows:
                raise DataError("has no window", file=path, element=f"space {space.name}")
        return list({space.guid: space for space in chosen}.values())
    chosen = [space for space in building.spaces if space.windows]
    if not chosen:
        raise DataError("no space has a window to the outside", file=path, element="IfcWindow")
    return chosen


def _space(building: Building, name: str, path: Path) -> Space:
    try:
        return building.space(name)
    except (KeyError, ValueError) as error:
        raise DataError(str(error.args[0]), file=path, field="--space") from error


def sha256(path: Path) -> str:
    """Hash of a file's bytes."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
