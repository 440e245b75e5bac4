"""`cfs bsdf`: read, check, evaluate, plot and make BSDF files."""

from __future__ import annotations

import sys
from pathlib import Path

import click
import numpy as np

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.checks import check_bsdf
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, replacing, write_table
from scenes.commands.bsdf_interpolation import interpolate
from scenes.commands.bsdf_options import Number, basis_option, cull_option, tensor_tree_option
from scenes.commands.bsdf_thermal import thermal
from scenes.commands.room_options import seed_option

INFO_ANGLES_DEG = (0, 10, 20, 30, 40, 50, 60, 70, 80)
INFO_SIDES = {"sky": 90.0, "right": 0.0, "ground": -90.0, "left": 180.0}  # where the light is
SHAPES = (
    "venetian",
    "louvre",
    "perforated",
    "woven",
    "pleated",
    "prism",
    "radiance",
    "fabric",
    "product",
)
FILE = click.Path(path_type=Path)

ANGLES = (Number(), Number())
LENGTH, SHARE = Number(min=0, min_open=True), Number(0, 1)
PERIOD = (LENGTH, LENGTH)
BAND_OPTION = click.option(
    "--band",
    default="Visible",
    show_default=True,
    help="Spectral band of the BSDF: Visible or Solar; of the file.",
)


@click.group("bsdf")
def command() -> None:
    """Read, check, plot and make BSDF files."""


command.add_command(thermal)
command.add_command(interpolate)


@command.command()
@click.argument("file", type=FILE)
def check(file: Path) -> None:
    """List errors and remarks on FILE, each with its consequence.

    Exits with an error where the file should not be used.
    """
    findings = check_bsdf(read_bsdf_xml(file, energy_limit=np.inf))
    for finding in findings:
        click.echo(f"{finding.severity}: {finding.where}: {finding.what} -> {finding.consequence}")
    errors = sum(finding.severity == "error" for finding in findings)
    if errors:
        raise DataError(f"{errors} finding(s) forbid its use", file=file)


@command.command()
@click.argument("file", type=FILE)
def info(file: Path) -> None:
    """Print transmittance and reflectance of FILE by band and angle of incidence."""
    data = read_bsdf_xml(file, energy_limit=np.inf)
    for line in _description(data):
        click.echo(line)
    for band, bsdf in data.bands.items():
        click.echo(f"\n{band}: direct-hemispherical, light from the side of ...")
        click.echo("theta  where   Tfront   Rfront    Tback    Rback")
        for theta in INFO_ANGLES_DEG:
            for where, azimuth in INFO_SIDES.items():
                if theta == 0 and where != "sky":
                    continue
                values = [
                    direct_hemispherical(bsdf, f"{kind}_{side}", _towards(theta, azimuth, side))[0]
                    for side in ("front", "back")
                    for kind in ("transmission", "reflection")
                ]
                label = "normal" if theta == 0 else where
                click.echo(f"{theta:5d}  {label:6s}" + "".join(f"{v:9.4f}" for v in values))


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
    return [*lines, *(f"note: {note}" for note in data.notes)]


@command.command("eval")
@click.argument("file", type=FILE)
@click.argument("pairs", required=False, type=click.Choice(["-"]))
@click.option(
    "--incident", type=ANGLES, metavar="THETA PHI",
    help="Direction to the light [degrees]; together with --outgoing.",
)  # fmt: skip
@click.option(
    "--outgoing",
    type=ANGLES,
    metavar="THETA PHI",
    help="Direction in which light leaves [degrees].",
)
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
            raise DataError(
                f"expected four angles, got {line[:60]!r}",
                file="standard input",
                element=f"line {number}",
            )
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
    help="Direction to the light [degrees].",
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
    title = f"{file.name}, {band}, light from theta {incident[0]:g}°, phi {incident[1]:g}°"
    from scenes.bsdf_plots import plot_hemispheres

    figure = plot_hemispheres(data.bands[band], direction, title)
    with replacing(out) as part:
        figure.savefig(part)


@command.command()
@click.option("--shape", type=click.Choice(SHAPES), default="venetian", show_default=True)
@click.option("--depth-mm", type=LENGTH, help="Chord width of a slat, or depth of a pleat.")
@click.option("--spacing-mm", type=LENGTH, help="Distance between slats, holes, threads or pleats.")
@click.option("--openness", type=SHARE, help="Open area fraction of a perforated or woven sheet.")
@click.option("--geometry", type=FILE, help="Radiance scene of one cell, in genBSDF's frame.")
@click.option("--period-mm", type=PERIOD, metavar="WIDTH HEIGHT", help="Size of that cell.")
@click.option(
    "--tilt-deg",
    type=Number(-90, 90),
    default=0.0,
    help="Slat tilt; positive lowers the exterior edge.",
)
@click.option("--radius-mm", type=LENGTH, help="Radius of curvature; default: flat.")
@click.option("--thickness-mm", type=Number(min=0), default=0.0)
@click.option(
    "--index",
    type=Number(min=1),
    help="Refractive index of a prism panel, whose angle is --tilt-deg.",
)
@click.option(
    "--product", type=FILE, help="JSON file of a shade from the IGSDB, for --shape product."
)
@click.option("--fabrics", type=FILE, help="CSV file of fabrics by EN 14501, for --shape fabric.")
@click.option("--fabric", help="Name and colour of a fabric, if the file has several.")
@click.option("--visible", type=SHARE, help="Visible reflectance (Radiance plastic).")
@click.option("--solar", type=SHARE, help="Solar reflectance; default: the visible one.")
@click.option("--specular", type=SHARE, default=0.0)
@click.option("--roughness", type=Number(min=0), default=0.0)
@basis_option
@tensor_tree_option
@click.option("--isotropic", is_flag=True, help="Tensor tree of rank 3: mean over azimuths.")
@cull_option
@click.option(
    "--paths", type=click.IntRange(min=1), default=32_768, help="Paths for each direction and side."
)
@seed_option
@click.option("--name", default="", help="Name to write into the file.")
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def generate(out: Path, **options) -> None:
    """Trace the BSDF of a blind, screen or Radiance geometry and write it.

    A fabric is not traced: its BSDF follows from what a data sheet states (ES-SO, EN 14501).
    """
    from scenes.bsdf_generation import generated_file
    from scenes.commands.progress_bar import ProgressBar

    check_file(out, inputs=[options[name] for name in ("geometry", "product", "fabrics")])
    with ProgressBar() as progress:
        file, exact = generated_file(progress=progress, **options)
    write_bsdf_xml(file, out)
    click.echo(f"{out}: {exact}")


@command.command()
@click.argument("layers", nargs=-1, required=True, type=FILE, metavar="OUTER.xml ... INNER.xml")
@click.option("--name", default="", help="Name to write into the file.")
@click.option(
    "--absorptances", type=FILE, help="CSV file of the absorptance of each layer by patch."
)
@click.option("--out", type=FILE, required=True, help="XML file to write.")
def combine(layers: tuple[Path, ...], name: str, absorptances: Path | None, out: Path) -> None:
    """Combine layers, the exterior one first, by Klems matrix algebra.

    All inter-reflections are included; the gaps between the layers are empty.
    """
    from scenes.bsdf_combination import combined_file

    for option, path in (("--out", out), ("--absorptances", absorptances)):
        if path is not None:
            check_file(path, field=option, inputs=layers)
    file, table = combined_file(layers, name)
    write_bsdf_xml(file, out)
    if absorptances is not None:
        write_table(table, absorptances, index=False, float_format="%.6g")
    for band in file.bands:
        tau = direct_hemispherical(file.band(band), "transmission_front", [0.0, 0.0, 1.0])[0]
        click.echo(f"{out}: {band}: transmittance at normal incidence {tau:.4f}")
