"""The systems of a design that are made of panes and a venetian blind: their BSDF and states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import write_text
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.source_code import code_version
from scenes.design.design_file import BlindTable, DesignSystem
from scenes.fenestration.systems import system_of_panes
from scenes.toml_file import TomlTable

BANDS = ("Visible", "Solar")
SLAT_RULES = ("cut-off",)  # rules that need the size of the slats


def states_of(system: DesignSystem, folder: Path, *, traced: bool = True) -> list[dict[str, Any]]:
    """The `[[system]]` tables of an operation file: the panes alone, then the blind at its tilts.

    Args: folder: of the BSDF files; traced: they are made where they are missing.

    Raises: `DataError` for sizes that do not go together.
    """
    panes = [_plain(layer) for layer in system.layers]
    raised: dict[str, Any] = {"layers": panes}
    if system.blind is None:
        return [raised]
    return [raised, *(_lowered(system, system.blind, tilt, folder, traced) for tilt in system.blind.tilts)]


def with_slats(control: dict[str, Any], blind: BlindTable) -> dict[str, Any]:
    """The table of a control whose rules know the size of the slats, where it states none."""
    changed = dict(control)
    if changed.get("rule") in SLAT_RULES:
        changed = {"slat_width": blind.slat_width, "slat_spacing": blind.slat_spacing} | changed
    for key in ("parts", "group"):
        if key in changed:
            changed[key] = [with_slats(one, blind) for one in changed[key]]
    return changed


def write_once(folder: Path, stem: str, suffix: str, text: str) -> Path:
    """A file named by its content."""
    path = folder / f"{stem}-{digest(text)[:16]}{suffix}"
    if not path.is_file():
        write_text(path, text)
    return path


def operation_text(table: dict[str, Any]) -> str:
    """An operation file as TOML."""
    return tomlkit.dumps(table)


def _lowered(system: DesignSystem, blind: BlindTable, tilt: float, folder: Path, traced: bool) -> dict[str, Any]:
    """The state with the blind at a tilt."""
    slats = {"width": blind.slat_width, "spacing": blind.slat_spacing, "tilt_deg": tilt}
    shade: dict[str, Any] = {"slats": slats, "emissivity": [blind.emissivity, blind.emissivity]}
    panes = [_plain(layer) for layer in system.layers]
    if blind.position == "outdoors":
        layers = [shade | {"gap": {"width": blind.distance}}, *panes]
    else:
        layers = [*panes[:-1], panes[-1] | {"gap": {"width": blind.distance}}, shade]
    return {
        "bsdf": str(_bsdf_file(system, blind, tilt, folder, traced)),
        "tilt_deg": tilt,
        "see_through": "specular",
        "layers": layers,
    }


def _bsdf_file(system: DesignSystem, blind: BlindTable, tilt: float, folder: Path, traced: bool) -> Path:
    """The BSDF file of the panes with the blind at a tilt, traced where it is missing."""
    of_light = blind.model_dump_json(exclude={"tilt_deg", "tilts_deg", "emissivity", "distance"})
    panes = [layer.model_dump_json() for layer in system.layers]
    key = digest(code_version("mitsuba_cfs.bsdf.generate"), code_version(__name__), of_light, tilt, panes)
    path = folder / f"blind-{key[:16]}.xml"
    if path.is_file() or not traced:
        return path
    glazing = system_of_panes(system.layers)
    slats = _slats(blind, tilt)
    blocks = {"Visible": glazing.visible, "Solar": glazing.solar}
    outdoors = blind.position == "outdoors"
    bands: dict[str, Bsdf] = {}
    for band, own in zip(BANDS, slats, strict=True):
        order = [own, blocks[band]] if outdoors else [blocks[band], own]
        bands[band] = combine_layers(order).bsdf
    name = f"{system.name}, {tilt:g} deg"
    write_bsdf_xml(BsdfFile(bands, name=name, emissivity_front=blind.emissivity, emissivity_back=0.84), path, digits=5)
    return path


def _slats(blind: BlindTable, tilt: float) -> tuple[KlemsBsdf, ...]:
    """The BSDF of the slats in both bands."""
    from mitsuba_cfs.bsdf.generate import generate_klems

    solar = blind.visible if blind.solar is None else blind.solar
    try:
        layer = venetian_blind(
            plastic("slats", blind.visible, solar, specular=blind.specular, roughness=blind.roughness),
            depth=blind.slat_width,
            spacing=blind.slat_spacing,
            tilt=np.radians(tilt),
            radius=blind.slat_radius or np.inf,
        )
    except ValueError as error:  # sizes that do not go together
        raise DataError(str(error), field="system.blind") from None
    return generate_klems(layer, samples=blind.paths, seed=blind.seed).bsdf


def _plain(table: TomlTable) -> dict[str, Any]:
    """A table as TOML holds it: stated keys alone, paths as texts."""
    return table.model_dump(mode="json", exclude_unset=True, exclude_none=True)
