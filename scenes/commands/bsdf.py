"""`cfs bsdf`: read, check, evaluate, plot and make BSDF files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.checks import Finding, check_bsdf, missing_data
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, json_text, replacing, write_table, write_text
from scenes.commands.examples import CommandGroup
from scenes.commands.room_options import seed_option
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS

if TYPE_CHECKING:
    from mitsuba_cfs.bsdf.measured import Pattern, ScatteringInterpolant
    from mitsuba_cfs.bsdf.measured_file import Measurement


class Number(click.FloatRange):
    """A finite number within bounds."""

    def convert(self, value, param, ctx) -> float:
        """The number; a usage error where it is none."""
        number = super().convert(value, param, ctx)
        if not np.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return number


basis_option = click.option(
    "--basis", type=click.Choice(["full", "half", "quarter"]), default="full", show_default=True, help="Klems basis."
)
tensor_tree_option = click.option(
    "--tensor-tree", type=click.IntRange(1, 6), help="Write a tensor tree of 4^N cells per hemisphere instead."
)
cull_option = click.option(
    "--cull", type=Number(0, 1, max_open=True), default=0.9, help="Fraction of the tensor tree's cells to merge."
)


INFO_ANGLES_DEG = (0, 10, 20, 30, 40, 50, 60, 70, 80)
INFO_SIDES = {"sky": 90.0, "right": 0.0, "ground": -90.0, "left": 180.0}  # where the light is
SHAPES = ("venetian", "louvre", "perforated", "woven", "pleated", "prism", "radiance", "fabric", "product")
FILE = click.Path(path_type=Path)
PLACES = ("external", "internal", "integrated")

ANGLES = (Number(), Number())
LENGTH, SHARE = Number(min=0, min_open=True), Number(0, 1)
PERIOD = (LENGTH, LENGTH)
BAND_OPTION = click.option(
    "--band", default="Visible", show_default=True, help="Spectral band of the BSDF: Visible or Solar; of the file."
)


@click.group("bsdf", cls=CommandGroup)
def command() -> None:
    """Read, check, plot and make BSDF files."""


@command.command()
@click.argument("file", type=FILE)
def check(file: Path) -> None:
    """List errors and remarks on FILE, each with its consequence.

    Exits with an error where the file should not be used.
    """
    findings = check_bsdf(read_bsdf_xml(file, energy_limit=np.inf))
    for finding in findings:
        click.echo(_finding_line(finding))
    errors = sum(finding.severity == "error" for finding in findings)
    if errors:
        raise DataError(f"{errors} finding(s) forbid its use", file=file)


def _finding_line(finding: Finding) -> str:
    return f"{finding.severity}: {finding.where}: {finding.what} -> {finding.consequence}"


@command.command()
@click.argument("file", type=FILE)
def info(file: Path) -> None:
    """Print transmittance and reflectance of FILE by band and angle of incidence."""
    data = read_bsdf_xml(file, energy_limit=np.inf)
    for line in _description(data):
        click.echo(line)
    for band, bsdf in data.bands.items():
        click.echo(f"\n{band}: direct-hemispherical, light from the side of ...")
        click.echo("theta  where    Tfront   Rfront    Tback    Rback")
        for theta, where, values in _by_direction(bsdf):
            click.echo(f"{theta:>5s}  {where:7s}" + "".join(f"{v:9.4f}" for v in values))


def _by_direction(bsdf: Bsdf) -> Iterator[tuple[str, str, list[float]]]:
    """Angle of incidence, side of the light, values; one row where all sides are equal, last diffuse light."""
    for theta in INFO_ANGLES_DEG:
        rows = {side: _hemispherical(bsdf, theta, azimuth) for side, azimuth in INFO_SIDES.items()}
        first = rows["sky"]
        if all(np.allclose(values, first, rtol=0, atol=5e-5) for values in rows.values()):
            rows = {"normal" if theta == 0 else "all": first}
        for where, values in rows.items():
            yield str(theta), where, values
    yield "", "diffuse", [_diffuse(bsdf, block, side) for block, side in _columns()]


def _columns() -> list[tuple[str, str]]:
    return [(f"{kind}_{side}", side) for side in ("front", "back") for kind in ("transmission", "reflection")]


def _hemispherical(bsdf: Bsdf, theta_deg: float, azimuth_deg: float) -> list[float]:
    return [direct_hemispherical(bsdf, block, _towards(theta_deg, azimuth_deg, side))[0] for block, side in _columns()]


def _diffuse(bsdf: Bsdf, block: str, side: str) -> float:
    """Share of light of equal radiance from all directions, by the Klems patches."""
    towards = KLEMS_FULL.incident_directions(back=side == "back")
    weights = KLEMS_FULL.projected_solid_angles()
    return float(np.average(direct_hemispherical(bsdf, block, towards), weights=weights))


def _towards(theta_deg: float, azimuth_deg: float, side: str) -> np.ndarray:
    """Unit vector of the window frame; azimuth from the right, up positive."""
    theta, phi = np.radians([theta_deg, azimuth_deg])
    z = np.cos(theta) * (1 if side == "front" else -1)
    return np.array([[np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z]])


def _description(data: BsdfFile) -> list[str]:
    lines = [f"name: {data.name or '-'}", f"manufacturer: {data.manufacturer or '-'}"]
    lines.append(f"device type: {data.device_type}")
    if data.thickness is not None:
        lines.append(f"thickness: {1000 * data.thickness:.1f} mm")
    for label, value in (
        ("emissivity front", data.emissivity_front),
        ("emissivity back", data.emissivity_back),
        ("infrared transmittance", data.infrared_transmittance),
        ("conductivity [W/(m K)]", data.conductivity),
    ):
        if value is not None:
            lines.append(f"{label}: {value:g}")
    for band, bsdf in data.bands.items():
        if isinstance(bsdf, KlemsBsdf):
            kind = f"{bsdf.basis_in.name}, {bsdf.basis_out.size} x {bsdf.basis_in.size}"
        else:
            kind = f"tensor tree of rank {next(iter(bsdf.blocks().values())).rank}"
        blocks = ", ".join(name.replace("_", " ") for name in bsdf.blocks())
        lines.append(f"{band}: {kind}: {blocks}")
    lines += [f"note: {note}" for note in data.notes]
    return [*lines, *map(_finding_line, missing_data(data))]


@command.command("eval")
@click.argument("file", type=FILE)
@click.argument("pairs", required=False, type=click.Choice(["-"]))
@click.option(
    "--incident", type=ANGLES, metavar="THETA PHI", help="Direction to the light [degrees]; together with --outgoing."
)
@click.option("--outgoing", type=ANGLES, metavar="THETA PHI", help="Direction in which light leaves [degrees].")
@BAND_OPTION
def evaluate(file: Path, pairs: str | None, incident, outgoing, band: str) -> None:
    """Print the BSDF [1/sr] of FILE, angles in Radiance's frame.

    With `-` instead of --incident and --outgoing: one `theta_in phi_in theta_out phi_out` a line
    from standard input, answered by the same with the value last.  Radiance's frame has z into the
    room, x to the left seen from outside and y up; both directions point away from the window.
    """
    if (pairs is None) == (incident is None or outgoing is None):
        raise click.UsageError("give either --incident THETA PHI --outgoing THETA PHI, or -")
    bsdf = read_bsdf_xml(file, energy_limit=np.inf).bands.get(band)
    if bsdf is None:
        raise DataError(f"has no {band} band", file=file)
    if pairs is None:
        angles = np.array([[*incident, *outgoing]])
        click.echo(f"{bsdf_values(bsdf, *_from_radiance(angles))[0]:.9g}")
        return
    lines = [line.strip() for line in sys.stdin if line.strip()]
    values = bsdf_values(bsdf, *_from_radiance(_angles(lines))) if lines else []
    click.echo("\n".join(f"{line} {value:.9g}" for line, value in zip(lines, values, strict=True)))


def _angles(lines: list[str]) -> np.ndarray:
    """The four angles [N, 4] of each line."""
    rows = []
    for number, line in enumerate(lines, 1):
        try:
            row = [float(word) for word in line.replace(",", " ").split()]
        except ValueError:
            row = []
        if len(row) != 4 or not np.isfinite(row).all():
            raise DataError(f"expected four angles, got {line[:60]!r}", file="standard input", element=f"line {number}")
        rows.append(row)
    return np.array(rows)


def _from_radiance(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Incident and outgoing unit vectors [N, 3] (window frame) from Radiance's angles [deg]."""
    pairs = np.radians(angles)
    vectors = []
    for theta, phi in (pairs[:, :2].T, pairs[:, 2:].T):
        x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        vectors.append(np.stack([-x, y, -z], -1))
    return vectors[0], vectors[1]


@command.command()
@click.argument("file", type=FILE)
@click.option(
    "--incident",
    type=ANGLES,
    required=True,
    metavar="THETA PHI",
    help="Direction to the light [degrees]; theta above 90: from outdoors.",
)
@BAND_OPTION
@click.option("--out", type=FILE, required=True, help="PNG, PDF or SVG to write.")
def plot(file: Path, incident: tuple[float, float], band: str, out: Path) -> None:
    """Draw both hemispheres for the light from one direction (Radiance's frame, degrees)."""
    from matplotlib.backend_bases import FigureCanvasBase

    if out.suffix.lstrip(".").lower() not in FigureCanvasBase.get_supported_filetypes():
        raise click.UsageError(f"--out {out}: expected a file name that ends in .png, .pdf, .svg")
    check_file(out, inputs=[file])
    data = read_bsdf_xml(file, energy_limit=np.inf)
    if band not in data.bands:
        raise DataError(f"has no {band} band", file=file)
    direction = _from_radiance(np.array([[*incident, 0.0, 0.0]]))[0][0]
    side = "outdoors" if direction[2] > 0 else "the room"
    title = (
        f"{file.name}: BSDF, {band.lower()} band, light from {side} "
        f"(theta {incident[0]:g}°, phi {incident[1]:g}°), both hemispheres seen from outdoors"
    )
    from scenes.plots import plot_hemispheres

    figure = plot_hemispheres(data.bands[band], direction, title)
    with replacing(out) as part:
        figure.savefig(part)


@command.command()
@click.option(
    "--shape",
    type=click.Choice(SHAPES),
    default="venetian",
    show_default=True,
    help="Geometry to trace, or the data sheet of a fabric or product.",
)
@click.option("--depth-mm", type=LENGTH, help="Chord width of a slat, or depth of a pleat.")
@click.option("--spacing-mm", type=LENGTH, help="Distance between slats, holes, threads or pleats.")
@click.option("--openness", type=SHARE, help="Open area fraction of a perforated or woven sheet.")
@click.option("--geometry", type=FILE, help="Radiance scene of one cell, in genBSDF's frame.")
@click.option("--period-mm", type=PERIOD, metavar="WIDTH HEIGHT", help="Size of that cell.")
@click.option("--tilt-deg", type=Number(-90, 90), default=0.0, help="Slat tilt; positive lowers the exterior edge.")
@click.option("--radius-mm", type=LENGTH, help="Radius of curvature; default: flat.")
@click.option("--thickness-mm", type=Number(min=0), default=0.0, help="Thickness of a slat or sheet.")
@click.option("--index", type=Number(min=1), help="Refractive index of a prism panel, whose angle is --tilt-deg.")
@click.option("--product", type=FILE, help="JSON file of a shade from the IGSDB, for --shape product.")
@click.option("--fabrics", type=FILE, help="CSV file of fabrics by EN 14501, for --shape fabric.")
@click.option("--fabric", help="Name and colour of a fabric, if the file has several.")
@click.option("--visible", type=SHARE, help="Visible reflectance (Radiance plastic).")
@click.option("--solar", type=SHARE, help="Solar reflectance; default: the visible one.")
@click.option("--spectrum", type=FILE, help="CSV file of the sheets' reflectance: wavelength_nm, reflectance.")
@click.option("--sheet-colour", metavar="#RRGGBB", help="Colour of the sheets (sRGB), in place of --spectrum.")
@click.option("--specular", type=SHARE, default=0.0, help="Specular reflectance (Radiance plastic).")
@click.option("--roughness", type=Number(min=0), default=0.0, help="Roughness of the specular part (Radiance plastic).")
@basis_option
@tensor_tree_option
@click.option("--isotropic", is_flag=True, help="Tensor tree of rank 3: mean over azimuths.")
@cull_option
@click.option("--paths", type=click.IntRange(min=1), default=32_768, help="Paths for each direction and side.")
@seed_option
@click.option("--name", default="", help="Name to write into the file.")
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def generate(out: Path, **options) -> None:
    """Trace the BSDF of a blind, screen or Radiance geometry and write it.

    A fabric is not traced: its BSDF follows from what a data sheet states (ES-SO, EN 14501).

    Of coloured slats or sheets the light by wavelength goes into a JSON file beside --out.
    """
    from scenes.bsdf_generation import generated_file
    from scenes.commands.progress_bar import ProgressBar
    from scenes.fenestration.thermal_file import write_slat_light

    check_file(out, inputs=[options[name] for name in ("geometry", "product", "fabrics", "spectrum")])
    of_slats = out.with_name(f"{out.stem}_slats.json")
    if options["spectrum"] is not None or options["sheet_colour"] is not None:
        check_file(of_slats, inputs=[options["spectrum"]])
    with ProgressBar() as progress:
        file, exact, slats = generated_file(progress=progress, **options)
    write_bsdf_xml(file, out)
    if slats is not None:
        write_slat_light(slats, of_slats)
        exact += f'\nas [spectral] of a .toml: slats = "{of_slats.name}"'
    click.echo(f"{out}: {exact}")


@command.command("system")
@click.argument("layers", type=FILE, metavar="LAYERS.toml")
@click.option("--paths", type=click.IntRange(min=1), default=32_768, help="Paths for each direction and side.")
@seed_option
@click.option("--name", default="", help="Name to write into the file.")
@click.option("--out", type=FILE, required=True, help="XML file to write; LAYERS.toml goes beside it.")
def system(layers: Path, paths: int, seed: int, name: str, out: Path) -> None:
    """Trace the BSDF of panes and a blind by the `[[layers]]` of LAYERS.toml and write it.

    The slats state their reflectance (`visible`). A run with --sensitivities then derives its results
    by tilt, width and reflectance of the slats.
    """
    from scenes.bsdf_generation import layers_file

    beside = out.with_suffix(".toml")
    written = [out] if beside.absolute() == layers.absolute() else [out, beside]
    for one in written:
        check_file(one, inputs=[layers])
    file, text = layers_file(layers, paths=paths, seed=seed, name=name)
    write_bsdf_xml(file, out)
    if beside in written:
        write_text(beside, text)
    for band in file.bands:
        tau = direct_hemispherical(file.band(band), "transmission_front", [0.0, 0.0, 1.0])[0]
        click.echo(f"{out}: {band}: transmittance at normal incidence {tau:.4f}")


@command.command("library")
@click.option(
    "--glazing", type=click.Choice(list(GENERIC_GLAZINGS)), help="Reference glazing by name; of the system to write."
)
@click.option("--shade", metavar="NAME", help="Shade of the library; default: none.")
@seed_option
@click.option("--out", type=FILE, help="XML file to write; a .toml with the layers goes beside it.")
def library(glazing: str | None, shade: str | None, seed: int, out: Path | None) -> None:
    """List the generic glazings and shades that come with the program, or write a system of them.

    No entry is a product. U and g follow from the layers by ISO 15099; blinds are traced, fabrics
    follow from usual values. Without --out the figures of every pair are printed.
    """
    from scenes.fenestration import library as entries

    if out is None:
        if shade is not None:
            entries.shade_entry(shade)
        for sheet in entries.sheets().values():
            if glazing in (None, sheet.glazing) and shade in (None, sheet.shade):
                click.echo(sheet.line)
        for one in (*entries.library().glazing, *entries.library().shade):
            click.echo(f"{one.name}: {one.title}; {one.source}")
        return
    from scenes.commands.progress_bar import ProgressBar

    check_file(out)
    check_file(out.with_suffix(".toml"))
    with ProgressBar() as progress:
        sheet = entries.write_library_system(glazing or entries.GLAZED, shade or "", out, seed=seed, progress=progress)
    click.echo(f"{out}: {sheet.line}")


@command.command()
@click.argument("layers", nargs=-1, required=True, type=FILE, metavar="OUTER.xml ... INNER.xml")
@click.option("--name", default="", help="Name to write into the file.")
@click.option("--absorptances", type=FILE, help="CSV file of the absorptance of each layer by patch.")
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def combine(layers: tuple[Path, ...], name: str, absorptances: Path | None, out: Path) -> None:
    """Combine layers, the exterior one first, by Klems matrix algebra.

    All inter-reflections are included; the gaps between the layers are empty.
    """
    from scenes.bsdf_generation import combined_file

    for option, path in (("--out", out), ("--absorptances", absorptances)):
        if path is not None:
            check_file(path, field=option, inputs=layers)
    file, table, notes = combined_file(layers, name)
    write_bsdf_xml(file, out)
    if absorptances is not None:
        write_table(table, absorptances, index=False, float_format="%.6g")
    for band in file.bands:
        tau = direct_hemispherical(file.band(band), "transmission_front", [0.0, 0.0, 1.0])[0]
        click.echo(f"{out}: {band}: transmittance at normal incidence {tau:.4f}")
    for note in notes:
        click.echo(f"warning: {note}")
    if not out.with_suffix(".toml").exists():
        names = "u_value, g_value and shading_position"
        click.echo(f"state {names} in {out.with_suffix('.toml').name} beside it; a run assumes what is missing")


@command.command("interpolate")
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="MEASURED.txt ...")
@click.option(
    "--normal",
    type=click.Choice(["room", "outside"]),
    default="room",
    show_default=True,
    help="Side to which the sample's normal points.",
)
@basis_option
@tensor_tree_option
@cull_option
@click.option("--name", default="", help="Name to write into the file; default: the sample's.")
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def interpolate(
    files: tuple[Path, ...], *, normal: str, basis: str, tensor_tree: int | None, cull: float, name: str, out: Path
) -> None:
    """Convert goniophotometer files (pgII text, one or more per incident direction) to a BSDF.

    Prints the scattered fraction of each incident direction with its standard error, and the
    symmetry that was assumed.  A BSDF that scatters more light than it receives is refused, as
    `cfs bsdf check` refuses it.
    """
    from mitsuba_cfs.bsdf.energy import ENERGY_LIMIT, check_energy
    from mitsuba_cfs.bsdf.measured_file import read_measurement
    from mitsuba_cfs.bsdf.xml import write_bsdf_xml

    check_file(out, inputs=files)
    measured = [read_measurement(path, normal=normal) for path in files]
    grazing = sum(one.grazing for one in measured)
    if grazing:
        click.echo(f"{grazing} values along the sample's plane are left out")
    means = _klems(basis) if tensor_tree is None else _trees(tensor_tree, cull)
    file = BsdfFile(_interpolated(measured, means))
    others = f" and {len(files) - 1} more" * (len(files) > 1)
    for band, bsdf in file.bands.items():
        for note in check_energy(bsdf, ENERGY_LIMIT, file=f"{files[0]}{others}", band=band):
            click.echo(f"note: {note}", err=True)
    write_bsdf_xml(replace(file, name=name or measured[0].name), out)
    click.echo(f"{out}: {', '.join(file.bands)}")


def _interpolated(measured: Sequence[Measurement], means: _Means) -> dict[str, Bsdf]:
    """The BSDF of each band, of the blocks that were measured."""
    from mitsuba_cfs.bsdf.evaluate import BLOCKS
    from mitsuba_cfs.bsdf.measured import ScatteringInterpolant, patterns_of

    bands = measured[0].bands
    for one in measured:
        if one.bands != bands:
            raise DataError(
                f"has {', '.join(one.bands)}, {measured[0].path} {', '.join(bands)}", file=one.path, field="colorimetry"
            )
    blocks: dict[str, dict[str, Any]] = {band: {} for band in bands}
    for block in BLOCKS:
        patterns = patterns_of(measured, block)
        if not patterns:
            continue
        interpolant = ScatteringInterpolant(patterns)
        click.echo(f"{block.replace('_', ' ')}: {interpolant.symmetry}")
        _print_shares(patterns, bands.index("Visible"))
        for band, values in zip(bands, means.of(interpolant), strict=True):
            blocks[band][block] = values
    return {band: means.bsdf(result) for band, result in blocks.items()}


@dataclass(frozen=True)
class _Means:
    """What an interpolant is averaged over: its values in each band, and the BSDF they make."""

    of: Callable[[ScatteringInterpolant], list[Any]]
    bsdf: Callable[[dict[str, Any]], Bsdf]


def _klems(basis: str) -> _Means:
    from mitsuba_cfs.bsdf.klems import KlemsBsdf
    from scenes.bsdf_generation import BASES

    patches = BASES[basis]
    return _Means(
        of=lambda interpolant: list(interpolant.matrix(patches)),
        bsdf=lambda blocks: KlemsBsdf(patches, patches, **blocks),
    )


def _trees(levels: int, cull: float) -> _Means:
    from mitsuba_cfs.bsdf.tensor_merge import culled_tree
    from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf

    return _Means(
        of=lambda interpolant: [culled_tree(grid, cull)[0] for grid in interpolant.grid(levels)],
        bsdf=lambda blocks: TensorTreeBsdf(**blocks),
    )


def _print_shares(patterns: Sequence[Pattern], band: int) -> None:
    import numpy as np

    click.echo("theta   share  std error  noise of a value")
    for pattern in sorted(patterns, key=lambda pattern: float(np.hypot(*pattern.incident))):
        theta = np.degrees(np.arcsin(min(1.0, float(np.hypot(*pattern.incident)))))
        relative, error = pattern.noise()
        click.echo(f"{theta:5.1f} {pattern.share[band]:7.4f} {error:10.4f} {100 * relative:8.1f} %")


@command.command("thermal")
@click.argument("states", nargs=-1, required=True, type=FILE, metavar="STATE.xml ...")
@click.option("--place", type=click.Choice(PLACES), help="The files are shades alone, at this position.")
@click.option(
    "--glazing", type=click.Choice(["A", "B", "C", "D"]), help="Reference glazing by name; of EN 14501, with --place."
)
@click.option(
    "--kappa",
    type=click.FloatRange(0, 1),
    default=0.4,
    show_default=True,
    help="Parameter of Kuhn's formula for interior shades.",
)
@click.option("--out", type=FILE, help="Write the table as .csv, or as .json with g by patch.")
@click.option("--toml", type=FILE, help="Write the thermal data of one state for the heat balance.")
def thermal(
    states: tuple[Path, ...], place: str | None, glazing: str | None, kappa: float, out: Path | None, toml: Path | None
) -> None:
    """Print U, g_tot, tau_e, secondary heat and EN 14501 classes of each STATE of a system.

    A state is a BSDF file with a .toml file beside it that gives U and g, or the layers, which are
    rated by ISO 15099 (NFRC), ISO 52022-3, EN 673 and EN 410.  With --place and --glazing the
    files are shades alone, rated by EN 13363-1 and Kuhn.
    """
    from scenes.fenestration.ratings import printed, rated_state, thermal_toml

    if (place is None) != (glazing is None):
        raise click.UsageError("--place and --glazing belong together")
    if toml is not None and (len(states) != 1 or place is not None):
        raise click.UsageError("--toml writes the data of one state, not of a shade alone")
    for option, path in (("--out", out), ("--toml", toml)):
        if path is not None:
            check_file(path, field=option, inputs=states)
    missing = [path for path in states if not path.is_file()]
    if missing:
        raise DataError("no such file", file=missing[0])
    rated_states = [rated_state(path, place=place, glazing=glazing, kappa=kappa) for path in states]
    rows = [row for state in rated_states for row in state.rows()]
    for line in printed(rows):
        click.echo(line)
    for note in dict.fromkeys(n for s in rated_states for n in s.notes):
        click.echo(f"note: {note}")
    if out is not None and out.suffix == ".json":
        by_patch = {s.path.stem: [round(float(g), 5) for g in s.heat.g_value] for s in rated_states}
        record = {"rows": rows} if place else {"rows": rows, "g by patch": by_patch}
        write_text(out, json_text(record, indent=2) + "\n")
    elif out is not None:
        import pandas as pd

        write_table(pd.DataFrame(rows), out, index=False, float_format="%.4f")
    if toml is not None:
        write_text(toml, thermal_toml(rated_states[0]))
