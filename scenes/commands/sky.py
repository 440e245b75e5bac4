"""`cfs sky`: sun positions, sky matrices for Radiance's programs, and WEA files."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, write_table
from mitsuba_cfs.matrices.mtx_io import FORMATS, write_matrix
from mitsuba_cfs.sky.cie import KINDS
from mitsuba_cfs.sky.options import LABELS, LEAST_ALTITUDE_DEG, PARTS, SUN_PATCHES
from scenes.commands.examples import CommandGroup
from scenes.commands.room_options import subdivision_option, sun_option

if TYPE_CHECKING:
    from mitsuba_cfs.sky.weather import Weather
EFFICACY = 179.0  # [lm/W] luminance over the radiance that Radiance's visible files hold

OUTPUTS = {"0": "visible", "1": "solar"}
weather_argument = click.argument("weather", type=click.Path(path_type=Path))
out_argument = click.argument("out", type=click.Path(path_type=Path, dir_okay=False))
format_option = click.option(
    "-f",
    "--format",
    "kind",
    type=click.Choice(list(FORMATS)),
    default="float",
    show_default=True,
    help="Number format of the matrix.",
)
ground_option = click.option(
    "-g",
    "--ground",
    type=click.FloatRange(0, 1),
    default=None,
    help="Ground reflectance; default: the weather's albedo, 0.2.",
)


@click.group(cls=CommandGroup)
def command() -> None:
    """Sun positions and sky matrices of a weather file (EPW or WEA)."""


@command.command()
@weather_argument
@out_argument
@subdivision_option
@click.option(
    "-O",
    "--output",
    type=click.Choice(list(OUTPUTS)),
    default="0",
    show_default=True,
    help="0: visible (radiance times 179 is luminance), 1: solar, both [W/m2/sr].",
)
@click.option("-d", "--sun-only", "part", flag_value="sun", help="Direct sun only.")
@click.option("-s", "--sky-only", "part", flag_value="sky", help="The sky without the sun.")
@click.option(
    "--part",
    "part",
    type=click.Choice(PARTS),
    default="all",
    show_default=True,
    help="Parts of the sky; the same as -d and -s.",
)
@click.option(
    "-r",
    "--rotate",
    type=float,
    default=0.0,
    show_default=True,
    help="Rotate sun and sky [degrees], counter-clockwise seen from above.",
)
@click.option("-u", "--sun-up", "only_up", is_flag=True, help="Only time steps with the sun above the horizon.")
@click.option(
    "-5",
    "--five-phase",
    is_flag=True,
    help="The sun of each time step as one 0.533 degree disc at the nearest patch (with -m 6).",
)
@click.option(
    "-c",
    "--color",
    type=float,
    nargs=3,
    default=(1.0, 1.0, 1.0),
    show_default=True,
    help="Red, green and blue of the sky; gendaymtx uses .96 1.004 1.118.",
)
@click.option(
    "--sun-patches",
    type=click.IntRange(1, 8),
    default=SUN_PATCHES,
    show_default=True,
    help="Number of nearest patches that share the sun.",
)
@click.option("--measured", is_flag=True, help="Use the illuminances in the file instead of Perez's luminous efficacy.")
@ground_option
@sun_option
@format_option
def matrix(
    weather: Path,
    out: Path,
    *,
    subdivision: str,
    output: str,
    part: str,
    rotate: float,
    only_up: bool,
    five_phase: bool,
    color: tuple[float, float, float],
    sun_patches: int,
    measured: bool,
    ground: float | None,
    sun_model: str,
    kind: str,
) -> None:
    """Write the Perez sky of WEATHER as a Radiance matrix OUT (.smx): patches x time steps.

    Patch 0 is the ground; the others are in the order of gendaymtx, whose options these are.
    """
    check_file(out, field="OUT", inputs=[weather])
    from mitsuba_cfs.sky.matrix import sun_matrix
    from scenes.commands.progress_bar import ProgressBar

    hours = read_weather(weather)
    band = OUTPUTS[output]
    if measured and (band == "solar" or hours.direct_normal_illuminance is None):
        raise DataError("has no illuminance for a visible sky (--measured)", file=weather)
    mf = int(subdivision)
    common = {"sun_model": sun_model, "rotation_deg": rotate, "measured_illuminance": measured}
    if five_phase:
        discs = sun_matrix(hours, mf, band, **common)
        coloured = (discs[:, sun_steps(hours, sun_model)] if only_up else discs).toarray()
    else:
        options = {
            **common,
            "sun_patches": sun_patches,
            "ground_reflectance": ground,
            "sun_up_only": only_up,
            "dtype": np.float32 if kind == "float" else np.float64,
        }
        with ProgressBar() as progress:
            coloured = _coloured_sky(hours, mf, band, part, color, progress=progress, **options)
    coloured = coloured / EFFICACY if band == "visible" else coloured
    place = f"LATLONG= {hours.latitude_deg:.8f} {hours.longitude_deg:.8f}"
    write_matrix(out, coloured, format=kind, components=3, lines=[_command_line(), place])
    click.echo(f"{out}: {coloured.shape[0]} patches x {coloured.shape[1]} time steps, {band}")


def _coloured_sky(hours, subdivision, band, part, color, *, progress, **options):
    """Values [P, H], or [P, H, 3] where sky and sun have different colours."""
    from mitsuba_cfs.sky.matrix import sky_matrix

    if tuple(color) == (1.0, 1.0, 1.0) or part == "sun":
        return sky_matrix(hours, subdivision, band, part, **options, progress=progress)
    sky = sky_matrix(hours, subdivision, band, "sky", **options, progress=progress)
    result = sky[..., None] * np.array(color, dtype=sky.dtype)
    result[0] = sky[0, :, None]  # the ground stays grey, as in gendaymtx
    if part == "all":
        result += sky_matrix(hours, subdivision, band, "sun", **options)[..., None]
    return result


@command.command()
@weather_argument
@out_argument
@sun_option
def positions(weather: Path, out: Path, sun_model: str) -> None:
    """Write the sun of every time step of WEATHER to the CSV file OUT.

    Middle of the interval, altitude and azimuth (clockwise from north) in degrees, unit vector
    (x east, y north, z up), and the irradiances.
    """
    check_file(out, field="OUT", inputs=[weather])
    import pandas as pd

    from mitsuba_cfs.sky import sun as sun_positions

    hours = read_weather(weather)
    towards = sun_positions.sun_directions(hours, model=sun_model)
    table = pd.DataFrame(
        {
            "middle": hours.midpoints.strftime("%Y-%m-%d %H:%M:%S"),
            "altitude_deg": np.degrees(sun_positions.altitude(towards)),
            "azimuth_deg": np.degrees(sun_positions.azimuth(towards)),
            "x": towards[:, 0],
            "y": towards[:, 1],
            "z": towards[:, 2],
            "direct_normal": hours.direct_normal,
            "diffuse_horizontal": hours.diffuse_horizontal,
        }
    )
    write_table(table, out, index=False, float_format="%.6f")
    click.echo(f"{out}: {len(table)} time steps, {int((towards[:, 2] > 0).sum())} with the sun up")


@command.command()
@weather_argument
@out_argument
def wea(weather: Path, out: Path) -> None:
    """Write the irradiances of WEATHER (EPW) as a Radiance WEA file OUT."""
    check_file(out, field="OUT", inputs=[weather])
    from mitsuba_cfs.sky.epw import write_wea

    hours = read_weather(weather)
    write_wea(hours, out)
    click.echo(f"{out}: {hours.site}, {len(hours.times)} time steps of {hours.step_h:g} h")


@command.command()
@click.argument("table", type=click.Path(path_type=Path))
@out_argument
@click.option("--latitude", type=click.FloatRange(-90, 90), required=True, help="Latitude, north positive [degrees].")
@click.option(
    "--longitude", type=click.FloatRange(-180, 180), required=True, help="Longitude, east positive [degrees]."
)
@click.option("--timezone", type=click.FloatRange(-14, 14), required=True, help="Time zone, hours ahead of UTC.")
@click.option("--elevation", type=float, default=0.0, show_default=True, help="Elevation above sea level [m].")
@click.option(
    "--label",
    type=click.Choice(list(LABELS)),
    default="middle",
    show_default=True,
    help="Moment of the interval that a time stamp denotes.",
)
@click.option(
    "--least-altitude",
    type=click.FloatRange(0, 20),
    default=LEAST_ALTITUDE_DEG,
    show_default=True,
    help="No direct sun below this altitude [degrees].",
)
def measured(
    table: Path,
    out: Path,
    *,
    latitude: float,
    longitude: float,
    timezone: float,
    elevation: float,
    label: str,
    least_altitude: float,
) -> None:
    """Write measured global and diffuse irradiance as a WEA file OUT.

    TABLE is a CSV file with the columns time, global_horizontal and diffuse_horizontal [W/m2];
    direct normal is (global - diffuse)/sin(altitude).
    """
    check_file(out, field="OUT", inputs=[table])
    from mitsuba_cfs.sky.epw import write_wea
    from mitsuba_cfs.sky.measured import read_measured

    hours = read_measured(
        table,
        latitude_deg=latitude,
        longitude_deg=longitude,
        timezone_h=timezone,
        elevation_m=elevation,
        label=label,
        least_altitude_deg=least_altitude,
    )
    _tell(hours)
    write_wea(hours, out)
    click.echo(f"{out}: {len(hours.times)} time steps of {hours.step_h:g} h")


@command.command()
@click.argument("kind_of_sky", metavar="KIND")
@out_argument
@subdivision_option
@click.option(
    "--horizontal",
    type=click.FloatRange(min=0),
    default=10_000.0,
    show_default=True,
    help="Diffuse horizontal illuminance [lx].",
)
@click.option(
    "--altitude", type=click.FloatRange(0, 90), default=45.0, show_default=True, help="Solar altitude [degrees]."
)
@click.option(
    "--azimuth", type=float, default=180.0, show_default=True, help="Solar azimuth, clockwise from north [degrees]."
)
@click.option(
    "-g",
    "--ground",
    type=click.FloatRange(0, 1),
    default=0.2,
    show_default=True,
    help="Ground reflectance; of the whole ground.",
)
@format_option
def cie(
    kind_of_sky: str,
    out: Path,
    *,
    subdivision: str,
    horizontal: float,
    altitude: float,
    azimuth: float,
    ground: float,
    kind: str,
) -> None:
    """Write a CIE sky as a Radiance sky vector OUT (patches x 1), without its sun.

    KIND: overcast, clear, intermediate, uniform, or 1 to 15 of ISO 15469.
    """
    check_file(out, field="OUT")
    number = int(kind_of_sky) if kind_of_sky.isdecimal() else kind_of_sky
    if number not in (*KINDS, *range(1, 16)):
        raise click.BadParameter(f"expected {', '.join(KINDS)} or 1 to 15", param_hint="KIND")
    from mitsuba_cfs.sky import sun as sun_positions
    from mitsuba_cfs.sky.cie import cie_patches
    from mitsuba_cfs.sky.patches import ReinhartSky

    sun = sun_positions.direction(np.radians(altitude), np.radians(azimuth))
    sky = ReinhartSky(int(subdivision))
    values = cie_patches(number, sky, horizontal, sun=sun, ground_reflectance=ground) / EFFICACY
    write_matrix(out, values[:, None], format=kind, components=3, lines=[_command_line()])
    click.echo(f"{out}: {kind_of_sky} sky, {sky.size} patches, {horizontal:g} lx")


def sun_steps(weather: Weather, sun_model: str) -> np.ndarray:
    """Indices of the time steps with any of the sun above the horizon."""
    from mitsuba_cfs.sky.matrix import sun_up

    return np.flatnonzero(sun_up(weather, sun_model=sun_model))


def read_weather(path: Path) -> Weather:
    """An EPW or a WEA file, by its first word."""
    from mitsuba_cfs.sky.epw import is_wea, read_epw, read_wea

    weather = read_wea(path, whole_year=False) if is_wea(path) else read_epw(path)
    _tell(weather)
    return weather


def _tell(weather: Weather) -> None:
    for note in weather.notes:
        click.echo(f"note: {note}", err=True)


def _command_line() -> str:
    """The command as typed, which Radiance's programs keep in the header."""
    return shlex.join(["cfs", *sys.argv[1:]])
