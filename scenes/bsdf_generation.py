"""What `cfs bsdf generate` makes of its options: a traced layer, or a data sheet's fabric."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
import tomlkit
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator

from bim.radiance.cell import read_radiance_layer
from mitsuba_cfs.bsdf import klems
from mitsuba_cfs.bsdf.blinds import venetian_blind, vertical_louvre
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.checks import missing_data
from mitsuba_cfs.bsdf.colour import with_visible
from mitsuba_cfs.bsdf.evaluate import klems_of
from mitsuba_cfs.bsdf.fabric_table import FabricShade, named_fabric, read_fabric_table
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial, plastic
from mitsuba_cfs.bsdf.screens import fabric_klems, perforated_screen, pleated_shade, prism_panel, woven_screen
from mitsuba_cfs.bsdf.shade_file import read_shade_file
from mitsuba_cfs.bsdf.spectral_factor import SlatLight
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.spectra.detectors import visible_mean
from scenes.fenestration.slats import layers_bsdf, recipe_slats
from scenes.fenestration.thermal_file import ThermalTable, read_reflectance, reflectance_of_code
from scenes.toml_file import read_table, validated, with_absolute_files

SHEETS = ("venetian", "louvre", "perforated", "woven", "pleated")  # shapes of one material
# shares of the largest reflectance at which coloured sheets are traced: zeros of Chebyshev's polynomial and the ends
LEVELS = (1 - np.cos(np.linspace(0, np.pi, 5))) / 2
LEAST_SHARE = 1e-9  # of the largest value, below which a pair of patches passes nothing
BASES = {"full": klems.KLEMS_FULL, "half": klems.KLEMS_HALF, "quarter": klems.KLEMS_QUARTER}


def generated_file(
    *,
    basis: str,
    tensor_tree: int | None,
    isotropic: bool,
    cull: float,
    paths: int,
    seed: int,
    name: str,
    fabrics: Path | None = None,
    fabric: str | None = None,
    spectrum: Path | None = None,
    sheet_colour: str | None = None,
    progress: Progress = silent,
    **options,
) -> tuple[BsdfFile, str, SlatLight | None]:
    """The layer's BSDF file (Visible and Solar), how exact it is in words, and its light by wavelength.

    Args: spectrum: CSV file of the sheets' reflectance; sheet_colour: "#rrggbb" instead.  None: grey.
    """
    reflectance = None
    if spectrum is not None or sheet_colour is not None:
        if options["shape"] not in SHEETS or tensor_tree is not None or basis != "full":
            raise click.UsageError(f"--spectrum and --sheet-colour need --shape {', '.join(SHEETS)} and --basis full")
        if spectrum is not None and sheet_colour is not None:
            raise click.UsageError("--spectrum and --sheet-colour exclude each other")
        reflectance = _sheet_reflectance(spectrum, sheet_colour, options["visible"])
        options["visible"] = float(visible_mean(reflectance))
    if options["shape"] == "fabric":
        if tensor_tree is not None:
            raise click.UsageError("--shape fabric is written on a Klems basis, as no tensor tree")
        return *fabric_file(fabrics=fabrics, fabric=fabric, basis=basis, name=name), None
    if fabrics is not None or fabric is not None:
        raise click.UsageError("--fabrics and --fabric belong to --shape fabric")
    product = options["product"]
    if product is not None and options["shape"] != "product":
        raise click.UsageError("--product belongs to --shape product")
    from mitsuba_cfs.bsdf.generate import generate_klems, generate_tensor_tree

    notes: list[str] = []
    levels = () if reflectance is None else tuple(float(reflectance.max()) * LEVELS)
    try:
        layer = described_layer(notes=notes, levels=levels, **options)
    except DataError:
        raise
    except ValueError as error:  # sizes that do not go together
        raise click.UsageError(str(error)) from None
    if tensor_tree is None:
        result = generate_klems(layer, BASES[basis], samples=paths, seed=seed, progress=progress)
        systems, area = result.bsdf[:2], BASES[basis].projected_solid_angles()[:, None]
        worst = max(
            float(np.sqrt(((area * block) ** 2).sum(axis=0)).max())
            for error in result.error
            for block in error.blocks().values()
        )
        exact = f"hemispherical values within {worst:.1e} (one standard error, worst)"
    else:
        systems, bound = generate_tensor_tree(
            layer, tensor_tree, rank=3 if isotropic else 4, samples=paths, cull=cull, seed=seed, progress=progress
        )
        leaves = sum(len(tree.values) for tree in systems[0].blocks().values())
        merged = f"{100 * bound:.0f} % and three" if bound else "three"
        exact = f"{leaves} leaves, merged within {merged} standard errors of a cell's value"
    slats = None
    if reflectance is not None:
        of_levels = result.bsdf[2:]
        systems = (visible_bsdf(of_levels, levels, reflectance), systems[1])
        slats = slat_light([one.transmission_front for one in of_levels], levels, reflectance)
    exact += "".join(f"\nnote: {note}" for note in notes)
    bands = dict(zip(("Visible", "Solar"), systems, strict=True))
    file = BsdfFile(bands, name=name or options["shape"], thickness=layer.thickness)
    if options["shape"] == "venetian":
        exact += f"\nas one of the layers of a .toml: {slat_layer(options)}"
    if product is not None:
        shade = read_shade_file(product)
        file = replace(file, name=name or shade.name, manufacturer=shade.manufacturer)
        exact += f"\nas one of the layers of a .toml: {shade.thermal_layer()}"
    return file, exact, slats


def slat_light(
    passed: Sequence[NDArray[np.float64]], levels: Sequence[float], reflectance: NDArray[np.float64]
) -> SlatLight:
    """Colour of the light of sheets of a reflectance [N], from what they pass at a few reflectances.

    That is a polynomial of the reflectance, whose coefficients are the numbers of reflections; the
    highest has those beyond it too.

    Args: passed: [K out, K in] at each level; levels: reflectances, 0 first, the largest last.
    """
    most, blocks = max(levels), np.array(passed)
    scaled = np.linalg.inv(np.vander(np.array(levels) / most, increasing=True))
    orders = np.tensordot(scaled, blocks, 1)  # [n, K, K] of (rho / most)^n, between the slats first
    mean = visible_mean((reflectance / most) ** np.arange(len(levels))[:, None])
    visible = np.tensordot(mean, orders, 1)
    lit = visible > LEAST_SHARE * blocks.max(axis=(1, 2))[-1]
    shares = mean[1:, None, None] * orders[1:]
    return SlatLight(reflectance, np.divide(shares, visible, out=np.zeros_like(shares), where=lit))


def visible_bsdf(systems: Sequence[KlemsBsdf], levels: Sequence[float], reflectance: NDArray[np.float64]) -> KlemsBsdf:
    """The mean over visible light of sheets of a reflectance [N], from systems at a few reflectances.

    More than at the mean reflectance: light that is reflected twice grows with its square.
    """
    weights = visible_mean(BarycentricInterpolator(np.array(levels), np.eye(len(levels)))(reflectance).T)
    blocks = [one.blocks() for one in systems]
    means = {name: sum(w * of[name] for w, of in zip(weights, blocks, strict=True)) for name in blocks[0]}
    return replace(systems[0], **{name: np.maximum(mean, 0.0) for name, mean in means.items()})


def _sheet_reflectance(spectrum: Path | None, colour: str | None, visible: float | None) -> NDArray[np.float64]:
    """Reflectance of the sheets [N]; that of visible light as stated, if it is."""
    try:
        shape = read_reflectance(spectrum) if spectrum is not None else reflectance_of_code(str(colour))
    except DataError:
        raise
    except ValueError as error:
        raise click.UsageError(f"--sheet-{error}") from None
    return shape if visible is None else with_visible(shape[None], np.array([visible]))[0]


def fabric_file(*, fabrics: Path | None, fabric: str | None, basis: str, name: str) -> tuple[BsdfFile, str]:
    """The BSDF file of a fabric in a table (`read_fabric_table`), and what is to be said of it."""
    _needed("fabric", fabrics=fabrics)
    shades, notes = read_fabric_table(fabrics)
    shade = named_fabric(shades, fabric, fabrics)
    bands = {"Visible": shade.visible, "Solar": shade.solar}
    layer, more = layer_of_fabric(shade)
    message = [f"{shade.name} (line {shade.line} of {fabrics})"]
    for band, at in bands.items():
        message.append(
            f"{band}: transmittance {at.transmittance:.3f}, straight on {at.direct:.3f}; "
            f"reflectance {at.reflectance_front:.3f}, back {at.reflectance_back:.3f}"
        )
    message += [f"as one of the layers of a .toml: {layer}"]
    message += [f"note: {note}" for note in (*notes, *shade.notes, *more)]
    file = BsdfFile(
        {band: fabric_klems(at, BASES[basis]) for band, at in bands.items()},
        name=name or shade.name,
        manufacturer=shade.manufacturer,
        thickness=shade.thickness,
        emissivity_front=shade.emissivity[0],
        emissivity_back=shade.emissivity[1],
        infrared_transmittance=shade.infrared_transmittance,
    )
    return file, "\n".join(message)


def layer_of_fabric(shade: FabricShade) -> tuple[str, tuple[str, ...]]:
    """A fabric as an inline table of `[[layers]]`, and notes.

    There an emissivity is the material's; data sheets state that of the sheet with its holes.
    """
    passed = shade.infrared_transmittance
    keys, notes = [f"openness = {shade.openness:.4g}"], []
    if passed is None:
        notes.append("tau_IR is not stated: as openness")
    else:
        keys.append(f"infrared_transmittance = {passed:.4g}")
    if shade.thickness is not None:
        keys.append(f"thickness = {shade.thickness:.4g}")
    if None in shade.emissivity:
        notes.append("an emissivity is not stated: 0.9 of the material")
    else:
        solid = max(1 - (shade.openness if passed is None else passed), 1e-4)
        sides = [e / solid for e in shade.emissivity]
        if max(sides) > 1:
            notes.append("the emissivity is more than holes leave: 1 of the material")
        keys.append(f"emissivity = [{', '.join(f'{min(e, 1.0):.4g}' for e in sides)}]")
    if shade.ultraviolet is not None:
        notes.append(f"tau_UV {shade.ultraviolet:.3f} is stated and has no place in the file")
    return "{ " + ", ".join(keys) + " }", tuple(notes)


def described_layer(
    *,
    shape: str,
    product: Path | None,
    geometry: Path | None,
    period_mm: tuple[float, float] | None,
    depth_mm: float | None,
    spacing_mm: float | None,
    openness: float | None,
    tilt_deg: float,
    radius_mm: float | None,
    thickness_mm: float,
    index: float | None,
    visible: float | None,
    solar: float | None,
    specular: float,
    roughness: float,
    notes: list[str],
    levels: Sequence[float] = (),
) -> PeriodicLayer:
    """The layer that the options of the command line describe, in two channels, and some more of sheets.

    Args: notes: takes what the user should know of the layer; levels: reflectances of more channels.
    """
    if shape == "product":
        _needed(shape, product=product)
        return read_shade_file(product).layer()
    if shape == "radiance":
        _needed(shape, geometry=geometry, period_mm=period_mm)
        layer, remarks = read_radiance_layer(geometry, (period_mm[0] / 1000, period_mm[1] / 1000))
        notes += remarks
        return replace(layer, materials=tuple(_twice(sheet) for sheet in layer.materials))
    if shape == "prism":
        _needed(shape, spacing_mm=spacing_mm, index=index)
        return prism_panel(
            index,
            pitch=spacing_mm / 1000,
            angle=np.radians(tilt_deg),
            thickness=max(thickness_mm, 0.1) / 1000,
            channels=2,
        )
    _needed(shape, spacing_mm=spacing_mm, visible=visible)
    colour = (visible, visible if solar is None else solar, *levels)
    sheet = plastic("sheet", *colour, specular=specular, roughness=roughness)
    spacing, thickness = spacing_mm / 1000, thickness_mm / 1000
    if shape in ("perforated", "woven"):
        _needed(shape, openness=openness)
        make = perforated_screen if shape == "perforated" else woven_screen
        return make(sheet, spacing=spacing, openness=openness, thickness=thickness)
    _needed(shape, depth_mm=depth_mm)
    if shape == "pleated":
        return pleated_shade(sheet, depth=depth_mm / 1000, spacing=spacing)
    make = venetian_blind if shape == "venetian" else vertical_louvre
    return make(
        sheet,
        depth=depth_mm / 1000,
        spacing=spacing,
        tilt=np.radians(tilt_deg),
        radius=np.inf if radius_mm is None else radius_mm / 1000,
        thickness=thickness,
    )


def _needed(shape: str, **values: object) -> None:
    for name, value in values.items():
        if value is None:
            raise click.UsageError(f"--shape {shape} needs --{name.replace('_', '-')}")


def _twice(sheet: SlatMaterial) -> SlatMaterial:
    """Visible and solar of a Radiance material: both its luminance."""
    return replace(
        sheet,
        reflectance_front=2 * sheet.reflectance_front,
        reflectance_back=2 * sheet.reflectance_back,
        transmittance=2 * sheet.transmittance,
    )


def layers_file(path: Path, *, paths: int, seed: int, name: str = "") -> tuple[BsdfFile, str]:
    """The BSDF file of the panes and slats of a `.toml` file, and that file's text for another folder.

    Raises: `DataError` for layers that do not give their BSDF.
    """
    table = read_table(path)
    placed = validated(ThermalTable, table, path).placed(path.parent)
    if placed.recipe is None:
        message = "expected panes with `pane` or `solar`, and one layer of `slats` with `visible`"
        raise DataError(message, file=path, field="layers")
    try:
        (bands,) = layers_bsdf(placed.layers, paths=paths, seed=seed)
    except DataError as error:
        raise DataError(error.message, file=path, field=error.field) from None
    slats = recipe_slats(placed)
    described = f"slats {1e3 * slats.width:g} mm at {slats.tilt_deg:g} deg"
    return BsdfFile(dict(bands), name=name or f"{path.stem}, {described}"), tomlkit.dumps(
        with_absolute_files(table, path.parent)
    )


def slat_layer(options: Mapping[str, Any]) -> str:
    """The slats of the options of `cfs bsdf generate` as one of the `[[layers]]` of a thermal file."""
    lengths = {"width": "depth_mm", "spacing": "spacing_mm", "radius": "radius_mm", "thickness": "thickness_mm"}
    keys = {key: (options[name] or 0.0) / 1000 for key, name in lengths.items()}
    keys |= {key: options[key] for key in ("tilt_deg", "visible", "solar", "specular", "roughness")}
    stated = (f"{key} = {value:g}" for key, value in keys.items() if value or key in ("tilt_deg", "visible"))
    return f"{{ slats = {{ {', '.join(stated)} }} }}"


def combined_file(paths: Sequence[Path], name: str = "") -> tuple[BsdfFile, pd.DataFrame, tuple[str, ...]]:
    """The layers' system in the bands that all files have, and the absorptance of each layer.

    Tensor trees and other bases are brought to the Klems full basis.

    Returns: the file; one row for each band, side that the light comes from, incident patch
        and layer with its absorptance; what the files lack, and what is used instead.
    Args: paths: the exterior layer first.
    """
    files = [read_bsdf_xml(path) for path in paths]
    bands = [band for band in files[0].bands if all(band in file.bands for file in files[1:])]
    if not bands:
        raise DataError("has no band that all the other layers have", file=paths[0])
    systems, tables = {}, []
    for band in bands:
        system = combine_layers([klems_of(file.band(band)) for file in files])
        systems[band] = system.bsdf
        for side, shares in (("front", system.absorptance_front), ("back", system.absorptance_back)):
            layer, patch = np.indices(shares.shape)
            tables.append(
                pd.DataFrame(
                    {
                        "band": band,
                        "side": side,
                        "patch": patch.ravel() + 1,
                        "layer": [str(paths[k]) for k in layer.ravel()],
                        "absorptance": shares.ravel(),
                    }
                )
            )
    thicknesses = [file.thickness for file in files]
    combined = BsdfFile(
        systems,
        name=name or " + ".join(f.name or p.stem for f, p in zip(files, paths, strict=True)),
        thickness=None if None in thicknesses else float(sum(thicknesses)),
        emissivity_front=files[0].emissivity_front,
        emissivity_back=files[-1].emissivity_back,
    )
    return combined, pd.concat(tables, ignore_index=True), tuple(_lacking(files, paths, bands))


def _lacking(files: Sequence[BsdfFile], paths: Sequence[Path], bands: Sequence[str]) -> Iterator[str]:
    """Sentences on bands and blocks that the layers of a system lack."""
    for path, file in zip(paths, files, strict=True):
        for finding in missing_data(file):
            band = finding.where.split(" ")[0]
            if band in bands:
                yield f"{path.name}: {finding.where} {finding.what}: {finding.consequence}"
            elif band == "file" and {one for other in files for one in other.bands} - set(bands):
                yield f"{path.name}: {finding.what}, so the system has none: {finding.consequence}"
