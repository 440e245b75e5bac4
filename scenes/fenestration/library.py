"""Generic glazings and shades that come with the program, and the window systems made of them.

`library.toml` has them; a system is a BSDF file (Klems) with the layers beside it, from which U and
g follow by ISO 15099. Blinds and perforated sheets are traced, fabrics follow from their values.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.glazing import Pane, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.screens import FabricBand, fabric_klems
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, write_text
from mitsuba_cfs.progress import Progress, silent
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_system import checked_system
from scenes.toml_file import Positive, Share, TomlTable, read_table, validated

FOLDER = Path(str(files(__package__)))
ENTRIES, SHEETS = FOLDER / "library.toml", FOLDER / "library.csv"
BANDS = ("Visible", "Solar")
PATHS = 65_536  # for each incident patch and side
DISTANCE = {"external": 0.10, "internal": 0.05}  # of a shade from the glass [m]
EDGE = 0.01  # open at each edge of a shade [m]
GLAZED = "double low-e"  # the glazing of a shade, where none is named
COLUMNS = ("glazing", "shade", "tau_v", "tau_v_hemispherical", "tau_e", "u_value", "g_value")


class GlazingEntry(TomlTable):
    """A glazing: its panes from outside to inside, as `[[layers]]` of a thermal file."""

    name: str
    title: str
    source: str
    layers: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]


class SlatEntry(TomlTable):
    """Slats of a blind [m], [deg]."""

    depth: Positive
    spacing: Positive
    tilt_deg: float
    radius: Positive = float("inf")


class HoleEntry(TomlTable):
    """Holes of a sheet [m]."""

    spacing: Positive
    openness: Share
    thickness: Positive


class FabricEntry(TomlTable):
    """A fabric at normal incidence in one band; front is outdoors."""

    transmittance: Share
    direct: Share
    reflectance_front: Share
    reflectance_back: Share


class ShadeEntry(TomlTable):
    """A shade: slats or holes in a grey material, or a fabric by its values."""

    name: str
    title: str
    source: str
    place: Literal["external", "internal"]
    fixed: bool = False  # it cannot be drawn up
    slats: SlatEntry | None = None
    holes: HoleEntry | None = None
    reflectance: Share = 0.5  # of slats and sheets, in both bands
    visible: FabricEntry | None = None
    solar: FabricEntry | None = None
    openness: Share = 0.0  # of sheets and fabrics, for the heat
    emissivity: tuple[Share, Share] = (0.9, 0.9)


class LibraryFile(TomlTable):
    """`library.toml`."""

    glazing: tuple[GlazingEntry, ...]
    shade: tuple[ShadeEntry, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """Figures of a system at normal incidence; U [W/(m2 K)] and g as in the heat balance (ISO 15099, 0 and 20 degC)."""

    glazing: str
    shade: str  # "": none
    tau_v: float
    tau_v_hemispherical: float
    tau_e: float
    u_value: float
    g_value: float

    @property
    def line(self) -> str:
        """The figures in one line."""
        name = f"{self.shade} + {self.glazing}" if self.shade else self.glazing
        return (
            f"{name}: tau_v {self.tau_v:.3f} (hemispherical {self.tau_v_hemispherical:.3f}), "
            f"tau_e {self.tau_e:.3f}, g {self.g_value:.3f}, U {self.u_value:.2f} W/(m2 K)"
        )


@cache
def library() -> LibraryFile:
    """The glazings and shades."""
    return validated(LibraryFile, read_table(ENTRIES), ENTRIES)


def glazing_entry(name: str) -> GlazingEntry:
    """A glazing by name; `DataError` names those that there are."""
    return _named(name, library().glazing, "--glazing")


def shade_entry(name: str) -> ShadeEntry:
    """A shade by name; `DataError` names those that there are."""
    return _named(name, library().shade, "--shade")


def _named(name: str, entries: Any, field: str) -> Any:
    entry = next((one for one in entries if one.name == name), None)
    if entry is None:
        known = ", ".join(repr(one.name) for one in entries)
        raise DataError(f"expected one of {known}, got {name!r}", field=field)
    return entry


def write_library_system(glazing: str, shade: str, path: Path, *, seed: int = 0, progress: Progress = silent) -> Sheet:
    """Write the BSDF file of a glazing with a shade ("": none) and the `.toml` beside it.

    Raises: `DataError` for names that the library has not, or files that cannot be written.
    """
    glass, cover = glazing_entry(glazing), shade_entry(shade) if shade else None
    layers = [dict(one) for one in glass.layers]
    bands = {band: [_pane(one, band) for one in layers] for band in BANDS}
    if cover is not None:
        traced = _traced(cover, seed, progress)
        outside = cover.place == "external"
        for band, panes in bands.items():
            layer = traced or _fabric(cover, band)
            panes.insert(0 if outside else len(panes), layer)
        heat, gap = _heat_layer(cover), {"width": DISTANCE[cover.place]}
        if outside:
            layers.insert(0, heat | {"gap": gap})
        else:
            layers[-1]["gap"] = gap
            layers.append(heat)
    title = glass.title if cover is None else f"{cover.title}, {glass.title.lower()}"
    file = BsdfFile(
        {band: combine_layers(panes).bsdf for band, panes in bands.items()},
        name=title,
        manufacturer="generic",
        thickness=_thickness(layers),
    )
    write_bsdf_xml(file, path, digits=5)
    write_text(path.with_suffix(".toml"), _beside(glass, cover, layers))
    return sheet_of(path, glazing, shade)


def sheet_of(path: Path, glazing: str, shade: str) -> Sheet:
    """The figures of a system's file."""
    system = read_system(path)
    heat = checked_system(system, path)
    tau = system.visible.direct_hemispherical(system.visible.blocks()["transmission_front"])
    weights = KLEMS_FULL.projected_solid_angles()
    return Sheet(
        glazing,
        shade,
        float(tau[0]),
        float(weights @ tau / weights.sum()),
        float(heat.transmittance[0]),
        heat.fenestration.u_value,
        float(heat.g_value[0]),
    )


def sheets() -> dict[tuple[str, str], Sheet]:
    """The figures of every system of the library, by glazing and shade, as `library.csv` has them.

    `python -m scenes.fenestration.library` makes that file.
    """
    with SHEETS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found = (Sheet(row["glazing"], row["shade"], *(float(row[name]) for name in COLUMNS[2:])) for row in rows)
    return {(one.glazing, one.shade): one for one in found}


def _pane(layer: dict[str, Any], band: str) -> KlemsBsdf:
    tau, front, back = layer["visible" if band == "Visible" else "solar"]
    return specular_klems(Pane("pane", tau, front, back, coated=front != back), KLEMS_FULL)


@lru_cache(maxsize=1)
def _traced(shade: ShadeEntry, seed: int, progress: Progress) -> KlemsBsdf | None:
    """The BSDF of slats or holes, the same in both bands; None of a fabric."""
    if shade.slats is None and shade.holes is None:
        return None
    from mitsuba_cfs.bsdf.blinds import venetian_blind
    from mitsuba_cfs.bsdf.generate import generate_klems
    from mitsuba_cfs.bsdf.screens import perforated_screen

    grey = plastic(f"{100 * shade.reflectance:.0f} % grey", shade.reflectance)
    if shade.slats is not None:
        slats = shade.slats
        layer = venetian_blind(
            grey, depth=slats.depth, spacing=slats.spacing, tilt=np.radians(slats.tilt_deg), radius=slats.radius
        )
    elif shade.holes is not None:
        holes = shade.holes
        layer = perforated_screen(grey, spacing=holes.spacing, openness=holes.openness, thickness=holes.thickness)
    return generate_klems(layer, samples=PATHS, seed=seed, progress=progress).bsdf[0]


def _fabric(shade: ShadeEntry, band: str) -> KlemsBsdf:
    values = shade.visible if band == "Visible" else shade.solar
    if values is None:
        raise DataError("is missing", file=ENTRIES, element=shade.name, field=band.lower())
    return fabric_klems(FabricBand(**values.model_dump()), KLEMS_FULL)


def _heat_layer(shade: ShadeEntry) -> dict[str, Any]:
    """The shade as one of the `[[layers]]` of a thermal file."""
    layer: dict[str, Any] = {"emissivity": list(shade.emissivity), "edges": [EDGE] * 4}
    if shade.slats is not None:
        slats = shade.slats
        layer["slats"] = {"width": slats.depth, "spacing": slats.spacing, "tilt_deg": slats.tilt_deg}
        if np.isfinite(slats.radius):
            layer["slats"]["radius"] = slats.radius
        layer["slats"]["visible"] = shade.reflectance
    else:
        layer["openness"] = shade.openness
    return layer


def _thickness(layers: list[dict[str, Any]]) -> float:
    gaps = sum(one["gap"]["width"] for one in layers if "gap" in one)
    return float(gaps + sum(one.get("thickness", 0.0) for one in layers))


def _beside(glass: GlazingEntry, shade: ShadeEntry | None, layers: list[dict[str, Any]]) -> str:
    """The `.toml` beside a system's file: place, kind of the transmission peak, layers."""
    lines = ["# written by cfs bsdf library", f"# {glass.title}: {glass.source}"]
    if shade is not None:
        lines += [f"# {shade.title}: {shade.source}", f'shading_position = "{shade.place}"']
        lines += ['see_through = "specular"']
    for layer in layers:
        lines += ["", "[[layers]]"]
        lines += [f"{key} = {_toml(value)}" for key, value in layer.items()]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json_text(value)


def main() -> None:
    """Make every system and write their figures to `library.csv`."""
    from mitsuba_cfs.files import scratch_folder

    shades = ("", *(one.name for one in library().shade))
    pairs = [(one.name, shade) for shade in shades for one in library().glazing]
    rows: list[tuple[str, ...]] = [COLUMNS]
    with scratch_folder() as folder:
        for glazing, shade in pairs:
            sheet = write_library_system(glazing, shade, folder / "system.xml")
            figures = (f"{getattr(sheet, name):.3f}" for name in COLUMNS[2:])
            rows.append((glazing, shade, *figures))
            print(*rows[-1], sep="\t", flush=True)
    with SHEETS.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
