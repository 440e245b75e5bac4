"""The options that commands share, each spelled, typed and explained once; the demo's room.

What a command means by one of them beside that stands behind a semicolon in its help:
`tests/scenes/test_option_names.py` holds every command to it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from mitsuba_cfs.sky.options import GROUNDS, SUBDIVISIONS, SUN_MODELS
from mitsuba_cfs.spectra.channels import CHANNEL_SETS
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS
from scenes.room.options import GLARE_SOURCES, GLARE_SUN, Outputs, SensorGrid

if TYPE_CHECKING:
    from scenes.head import Head
    from scenes.heat.study_file import StudyFile
    from scenes.language.catalogue import Language
    from scenes.study.study_file import Study as Grid


class IfcFile(click.Path):
    """An IFC file whose head and corrections file are sound; nothing heavy is loaded for that."""

    def convert(self, value, param, ctx) -> Path:
        """The path; `DataError` where the file is not of a kind that is read."""
        from bim.building_file import check_ifc

        path = super().convert(value, param, ctx)
        check_ifc(path)
        return path


class BuildingFile(click.Path):
    """A file of any format that a building is read from, sound as far as it can be seen at once."""

    def convert(self, value, param, ctx) -> Path:
        """The path; `DataError` where the file is not of a kind that is read."""
        from bim.building_file import check_building_file

        path = super().convert(value, param, ctx)
        if not path.is_dir():
            check_building_file(path)
        return path


def _first_and_linked(context: click.Context, _: click.Parameter, value: tuple[Path, ...]) -> Path | None:
    """The first file of a building; further ones, and those of folders, are `linked`."""
    from bim.building_file import building_files, check_building_file

    files = building_files(value)
    for path in files:
        check_building_file(path)
    context.params["linked"] = tuple(files[1:])
    return files[0] if files else None


def check_is_ifc(path: Path, field: str) -> None:
    """Raise `DataError` for what only an IFC file can do, asked of another format."""
    from bim.building_file import is_ifc
    from mitsuba_cfs.errors import DataError

    if not is_ifc(path):
        raise DataError(f"needs an IFC file, got {path.name}", field=field)


FILE = click.Path(exists=True, dir_okay=False, readable=True, path_type=Path)
BUILDING_FILE = BuildingFile(exists=True, readable=True, path_type=Path)
IFC_FILE = IfcFile(exists=True, dir_okay=False, readable=True, path_type=Path)


quick_option = click.option(
    "--quick", is_flag=True, help="Fast preview: few rays, coarse sensor grid, one small picture."
)


def stated_options() -> set[str]:
    """Names of the parameters of the command under way that do not have their default."""
    context = click.get_current_context()
    return {
        name for name in context.params if context.get_parameter_source(name) not in (ParameterSource.DEFAULT, None)
    }


Study = TypeVar("Study", "StudyFile", "Grid")
Option = Callable[[Callable], Callable]
_GRID = SensorGrid()
LANGUAGE = "cfs.language"  # where `--language` is kept of a call
REPLACE = "cfs.replace"  # where `--replace` is kept of a call

out_folder_option = click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder of results.")
replace_option = click.option(
    "--replace",
    is_flag=True,
    expose_value=False,
    callback=lambda context, _, value: context.meta.update({REPLACE: value}),
    help="Replace earlier results of other inputs in --out; without it they are kept, and the command ends.",
)


def results_folder_option(command: Callable) -> Callable:
    """`--out` of a folder of results of some inputs, with `--replace`."""
    return out_folder_option(replace_option(command))


def replacing() -> bool:
    """Whether the command under way may replace results of other inputs."""
    return click.get_current_context().meta.get(REPLACE, False)


join_option = click.option(
    "--join",
    multiple=True,
    metavar="'ROOM + ROOM'",
    help="Merge rooms that are open to each other; 'open' (IFC): wherever the opening is no door.",
)
storey_option = click.option(
    "--only-storey",
    "only_storeys",
    multiple=True,
    metavar="NAME",
    help="Read this storey of an IFC model, with the next above and below; its rooms only.",
)
furniture_option = click.option(
    "--furniture", is_flag=True, help="Include the furniture of the model in light and views."
)
facade_pane_option = click.option(
    "--facade-pane",
    "facade_panes",
    multiple=True,
    metavar="MATERIAL",
    help="Material of panes with no room behind them in a Radiance scene (.rad); they mirror.",
)
aperture_option = click.option(
    "--aperture",
    "apertures",
    multiple=True,
    metavar="MATERIAL",
    help="Window material of a Radiance scene (.rad); default: all glass and BSDF materials.",
)
surroundings_option = click.option(
    "--surroundings",
    multiple=True,
    type=FILE,
    help="Surroundings: OBJ, STL, PLY, glTF, CityJSON, CityGML, GeoJSON or PVGIS horizon.",
)
surroundings_offset_option = click.option(
    "--surroundings-offset",
    type=float,
    nargs=3,
    metavar="X Y Z",
    help="Offset added to the surroundings' coordinates [m], instead of georeferences.",
)


class Albedo(click.ParamType):
    """A number, twelve by month, `file` or `snow`."""

    name = "albedo"

    def convert(self, value, param, ctx) -> float | tuple[float, ...] | str:
        """The albedo as of `with_albedo`."""
        if value in ("file", "snow") or not isinstance(value, str):
            return value
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in (1, 12) or not all(0 <= number <= 1 for number in numbers):
            self.fail(f"expected a number from 0 to 1, twelve, 'file' or 'snow'; got {value!r}")
        return numbers[0] if len(numbers) == 1 else numbers


albedo_option = click.option(
    "--albedo",
    type=Albedo(),
    metavar="A",
    help="Ground reflectance: a number, 12 by month, 'file' or 'snow' (EPW); default: 0.2.",
)
needed_weather_option = click.option("--weather", required=True, type=FILE, help="Hourly weather file (EPW).")
weather_option = click.option(
    "--weather", type=FILE, help="Hourly weather file (EPW); also WEA, required with BUILDING."
)
system_option = click.option(
    "--cfs",
    "system",
    type=FILE,
    help="BSDF XML file (Klems full or tensor tree) for all windows; default: those in BUILDING.",
)
glazing_option = click.option(
    "--glazing",
    type=click.Choice(list(GENERIC_GLAZINGS)),
    help="Reference glazing by name; of windows whose file states no glazing data.",
)
tau_option = click.option(
    "--tau",
    "visible_transmittance",
    type=click.FloatRange(0, 1, min_open=True),
    help="Visible transmittance of windows without a BSDF.",
)
see_through_option = click.option(
    "--see-through",
    multiple=True,
    metavar="FILE=KIND",
    help="Whether the transmission peak of a BSDF is 'specular', a 'lobe', or the specular share.",
)
u_option = click.option("--u", "u_value", type=click.FloatRange(0.1, 7), help="U-value of the windows [W/(m2 K)].")
eye_height_option = click.option(
    "--eye-height",
    type=click.FloatRange(0.3, 3),
    default=1.2,
    show_default=True,
    help="Height of the eye above the floor [m].",
)
grid_option = click.option(
    "--grid", type=click.FloatRange(0.1, 20), help="Spacing of a grid of eye positions [m]; default: one position."
)
directions_option = click.option(
    "--directions",
    type=click.IntRange(1, 64),
    default=1,
    show_default=True,
    help="View directions per eye position; the first faces the largest window.",
)
seed_option = click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the random numbers."
)
spacing_option = click.option(
    "--spacing",
    "sensor_spacing",
    type=click.FloatRange(0.05, 10),
    default=_GRID.spacing,
    show_default=True,
    help="Sensor spacing [m].",
)
height_option = click.option(
    "--height",
    "sensor_height",
    type=click.FloatRange(0, 5),
    default=_GRID.height,
    show_default=True,
    help="Height of the work plane above the floor [m]; of the grid of sensors.",
)
subdivision_option = click.option(
    "-m",
    "--subdivision",
    type=click.Choice([str(mf) for mf in SUBDIVISIONS]),
    default="1",
    show_default=True,
    help="Reinhart subdivision MF: 145, 577, 2305 or 5185 patches.",
)
subdivide_option = click.option(
    "--subdivide",
    "window_parts",
    type=click.IntRange(0, 64),
    default=0,
    show_default=True,
    help="Subgroups of each window group; 0: choose from the surroundings.",
)
glare_sources_option = click.option(
    "--glare-sources",
    type=click.Choice(GLARE_SOURCES),
    default=GLARE_SOURCES[0],
    show_default=True,
    help="Group bright pixels into glare sources as evalglare does, or rate each pixel.",
)
glare_sun_option = click.option(
    "--glare-sun",
    type=click.Choice(GLARE_SUN),
    default=GLARE_SUN[0],
    show_default=True,
    help="Treat the sun's disc as a separate glare source, or spread it over its pixels.",
)
sun_option = click.option(
    "--sun-model",
    type=click.Choice(SUN_MODELS),
    default=SUN_MODELS[0],
    show_default=True,
    help="Sun position by NREL's SPA, by Radiance's formula (gendaymtx), or by EnergyPlus'.",
)
sky_ground_option = click.option(
    "--sky-ground",
    type=click.Choice(GROUNDS),
    default=GROUNDS[0],
    show_default=True,
    help="Ground luminance: of a diffusely reflecting plane, or as in gendaylit.",
)
annual_glare_option = click.option("--annual-glare", is_flag=True, help="Compute DGP for every daylight hour.")

spectral_option = click.option(
    "--spectral", is_flag=True, help="Compute melanopic illuminance and colour of the light; see docs/spectral.md."
)
sensitivities_option = click.option(
    "--sensitivities",
    is_flag=True,
    help="Derivatives of the results by reflectances, g, U, gains and others; see docs/sensitivities.md.",
)
bands_option = click.option(
    "--bands",
    is_flag=True,
    help="Results as medians with 5 and 95 %, rules as probabilities, by the usual uncertainty of the inputs.",
)
channels_option = click.option(
    "--channels",
    type=click.Choice(list(map(str, CHANNEL_SETS))),
    default=str(Outputs().channels),
    show_default=True,
    callback=lambda _context, _parameter, value: int(value),
    help="Bands of wavelength for --spectral.",
)


def _keep_language(context: click.Context, _: click.Parameter, value: str | None) -> None:
    context.meta[LANGUAGE] = value


def chosen_language() -> Language | None:
    """The language of `--language`; None where it is not given."""
    return click.get_current_context().meta.get(LANGUAGE)


def page_option(command: Callable) -> Callable:
    """`--page` and `--language`; the latter is had by `chosen_language`."""
    language = click.option(
        "--language",
        type=click.Choice(["en", "de", "fr"]),
        expose_value=False,
        callback=_keep_language,
        help="Language of the page; default: of --page, else English.",
    )
    file = click.option(
        "--page",
        type=FILE,
        metavar="FILE.toml",
        help="Title, author, logo, language and sections of the page; see docs/quickstart.md.",
    )
    return file(language(command))


set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Set an option of the `[options]` table of study files, such as sensor_samples=4096.",
)
no_cache_option = click.option(
    "--no-cache",
    "cache",
    is_flag=True,
    flag_value=False,
    default=True,
    help="Neither read nor write the cache of buildings and traced matrices.",
)


def with_flags(study: Study, surroundings: tuple[Path, ...], offset: tuple[float, float, float] | None) -> Study:
    """A study with the files of `--surroundings` beside those that it names itself."""
    update: dict[str, object] = {"surroundings": (*study.surroundings, *surroundings)}
    if offset is not None:
        update["surroundings_offset"] = offset
    return study.model_copy(update=update)


def space_option(name: str, what: str, *, several: bool = True) -> Option:
    """`--space` into the parameter `name`; `what` it is for, or which room without it."""
    text = f"Name or GUID of a room; {what}."
    shared = {"metavar": "NAME", "help": text}
    if several:
        return click.option("--space", name, multiple=True, **shared)
    return click.option("--space", name, callback=_only, **shared)


def _only(_context: click.Context, _option: click.Parameter, value: str | None) -> tuple[str, ...]:
    """A value that may be given once, as the tuple of the options."""
    return () if value is None else (value,)


def method_option(methods: Sequence[str], what: str, *, default: str | None = None) -> Option:
    """`--method`, of the methods that the command has."""
    return click.option(
        "--method",
        type=click.Choice(methods),
        default=default,
        show_default=default is not None,
        help=f"Daylight method; {what}.",
    )


def size_option(name: str, default: int, why: str) -> Option:
    """`--size` of pictures into the parameter `name`; `why` it is that by default."""
    return click.option(
        "--size",
        name,
        type=click.IntRange(16, 4096),
        default=default,
        show_default=True,
        help=f"Pixels of a picture's longer side; {why}.",
    )


def input_options(
    spaces: str, *, several: bool = True, weather: str = "needed", system: bool = True, glazing: bool = True
) -> Option:
    """The argument and the options of every command, named as in `InputOptions`.

    Args:
        spaces: what `--space` chooses by default, "" without rooms; several: may be repeated.
        weather: "needed", "demo" (with the demo's building where there is none) or "" (none).
        system: whether `--cfs` is one of them; glazing: whether `--glazing` and `--tau` are.
    """
    demo = weather == "demo"
    weathers = {"needed": [needed_weather_option], "demo": [weather_option], "": []}
    return _all_of(
        click.argument(
            "building",
            type=BUILDING_FILE,
            required=not demo,
            nargs=-1,
            callback=_first_and_linked,
            metavar="[BUILDING...]" if demo else "BUILDING...",
        ),
        *weathers[weather],
        *([albedo_option] if weather else []),
        *([system_option] if system else []),
        *([glazing_option, tau_option] if glazing else []),
        *([see_through_option] if weather and system else []),
        *(
            []
            if not spaces
            else [
                space_option("spaces", f"default: {spaces}", several=several),
                join_option,
                storey_option,
                furniture_option,
                surroundings_option,
                surroundings_offset_option,
            ]
        ),
        aperture_option,
        facade_pane_option,
    )


def light_options(command: Callable) -> Callable:
    """The options that every command which rates glare has."""
    return _all_of(glare_sources_option, glare_sun_option, sun_option, sky_ground_option, seed_option)(command)


def room_options(command: Callable) -> Callable:
    """The options that `cfs run` and `cfs comply` share beside the inputs."""
    return _all_of(
        results_folder_option,
        annual_glare_option,
        subdivide_option,
        light_options,
        set_option,
        no_cache_option,
        quick_option,
        page_option,
    )(command)


def taken(options: type, chosen: dict[str, Any]) -> dict[str, object]:
    """The parameters of a command that are fields of its options; they leave `chosen`."""
    names = [field.name for field in fields(options) if field.name in chosen]
    return {name: chosen.pop(name) for name in names}


def _all_of(*options: Option) -> Option:
    """Options one after the other."""

    def decorated(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def named_settings(settings: Sequence[str], but: Collection[str] = ()) -> dict[str, object]:
    """What `--set` chooses, by the names of `scenes.room.options.NAMES`.

    Args: but: names that mean nothing to the command.
    """
    if not settings:
        return {}
    from scenes.study.study_file import OptionsTable  # takes a second to load
    from scenes.toml_file import validated

    table: dict[str, object] = {}
    for text in settings:
        name, equals, value = text.partition("=")
        if not equals or name in but:
            reason = "means nothing to this command" if equals else "expected NAME=VALUE"
            raise click.UsageError(f"--set {text!r}: {reason}")
        try:
            table[name] = tomllib.loads(f"value = {value}")["value"]
        except (tomllib.TOMLDecodeError, RecursionError):
            table[name] = value  # a word needs no quotes
    result = validated(OptionsTable, table, Path("--set"))
    return {name: getattr(result, name) for name in table}


def processes_option(default: int | None, rest: str) -> Option:
    """`--processes`; the `rest`: how many are the default."""
    help_text = f"Rooms or cases computed in parallel; {rest}."
    return click.option("--processes", type=click.IntRange(1, 64), default=default, help=help_text)


BY_MACHINE = "by default as many as cores and memory allow, with at least eight rooms or cases each"
scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Dask scheduler, such as tcp://host:8786, whose workers compute the rooms or cases.",
)


def samples_option(default: int, why: str) -> Option:
    """`--samples` of pictures; `why` they are that many by default."""
    return click.option(
        "--samples", type=click.IntRange(1, 4096), default=default, show_default=True, help=f"Paths per pixel; {why}."
    )


def explore_option(rest: str = "") -> Option:
    """`--explore`; the `rest`: what this command's explorer holds."""
    return click.option(
        "--explore",
        is_flag=True,
        help="Write the explorer: picture, plan and temperatures of any hour, in a browser"
        + (f"; {rest}." if rest else "."),
    )


def write_ifc_option(sets: str) -> Option:
    """`--write-ifc`; which `sets` there are."""
    return click.option(
        "--write-ifc",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="OUT.ifc",
        help=f"Write a copy of the building with results in property sets; {sets}.",
    )


def view_option(name: str, what: str, *, several: bool) -> Option:
    """`--view` into the parameter `name`."""
    return click.option(
        "--view",
        name,
        multiple=several,
        metavar="'-vta ...'|FILE.vf",
        help=f"View in Radiance's syntax; {what}, default: the view in an HBJSON file, else from "
        "the room's middle to its window.",
    )


def with_demo(chosen: dict[str, Any]) -> dict[str, Any]:
    """The parameters with the demo's building, weather and system where there is no building."""
    names = ("building", "weather", "system")
    building, weather, system = (chosen[name] for name in names)
    if building is not None:
        if weather is None:
            raise click.UsageError("--weather is required with BUILDING: give the EPW file of its location")
        return chosen
    demo = ["office"]
    demo += ["weather"] * (weather is None) + ["venetian blind"] * (system is None)
    click.echo(f"no BUILDING given: the demo's {', '.join(demo)}")
    files = (OFFICE, weather or WEATHER, system or VENETIAN_BLIND)
    return chosen | dict(zip(names, files, strict=True))


class PrintedHead:
    """Prints a head once it is known, and afterwards only notes that it does not have."""

    def __init__(self) -> None:
        """Nothing is printed yet."""
        self._lines: dict[str, None] = {}
        self.record: dict[str, list[Any]] = {}  # of the head

    def __call__(self, head: Head) -> None:
        """Print the lines of a head that were not printed yet."""
        for line in head.lines:
            if line not in self._lines:
                click.echo(line)
        self.record = head.record
        self._lines |= dict.fromkeys((*head.lines, *head.notes))

    def notes(self, notes: Iterable[str]) -> None:
        """Print the notes of a result that are not in the head."""
        for note in notes:
            if note not in self._lines:
                click.echo(f"note: {note}")
