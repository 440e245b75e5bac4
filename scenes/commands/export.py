"""`cfs export`: the rooms of a building for other programs, with what is known of their windows."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import check_file
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    FILE,
    PrintedHead,
    height_option,
    input_options,
    no_cache_option,
    spacing_option,
    subdivision_option,
)
from scenes.input_options import InputOptions
from scenes.result_folder import ResultFolder

if TYPE_CHECKING:
    from bim.model import Building, Space
    from scenes.fenestration_exports import KnownFenestration

BANDS = ("Visible", "Solar")
PATTERNS = {  # of the files that an export writes
    "--radiance": ("*.rad", "*.pts", "*.vf", "windows_*.xml", "run.sh", "Makefile"),
    "--mitsuba": ("scene.xml", "glass_*.xml", "*.ply"),
}


@click.command(cls=StrictCommand)
@input_options("all", weather="", system=False)
@click.option(
    "--radiance",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for Radiance scenes, with a subfolder for each room.",
)
@click.option(
    "--mitsuba",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for Mitsuba scenes, with a subfolder for each room with a window.",
)
@click.option("--epjson", type=click.Path(path_type=Path), help="EnergyPlus input file.")
@click.option(
    "--weather", "weather", type=FILE, help="Hourly weather file (EPW); for the ground temperatures of --epjson."
)
@click.option("--gltf", type=click.Path(path_type=Path), help="Binary glTF file (.glb).")
@click.option("--honeybee", type=click.Path(path_type=Path), help="Honeybee model (.hbjson).")
@click.option("--gbxml", type=click.Path(path_type=Path), help="gbXML file (.gbxml).")
@click.option(
    "--band",
    type=click.Choice(BANDS, case_sensitive=False),
    default="Visible",
    show_default=True,
    help="Spectral band of the BSDF: Visible or Solar; of the Radiance and Mitsuba scenes.",
)
@spacing_option
@height_option
@subdivision_option
@no_cache_option
def command(
    *,
    radiance: Path | None,
    mitsuba: Path | None,
    epjson: Path | None,
    gltf: Path | None,
    honeybee: Path | None,
    gbxml: Path | None,
    band: str,
    weather: Path | None,
    sensor_spacing: float,
    sensor_height: float,
    subdivision: str,
    **chosen,
) -> None:
    """Write the rooms for Radiance, Mitsuba, EnergyPlus, Honeybee, gbXML or glTF viewers.

    BUILDING is a honeybee model (.hbjson), gbXML, a Radiance scene (.rad) or IFC: one file or
    several of one building (architecture, facade, site), a folder or an .ifczip of them.

    Windows are written with the BSDF, U, g and transmittance that the file holds or states;
    sources, assumptions and unknown values are printed.
    """
    options = InputOptions(**chosen, weather=None)
    building = options.building
    files = {"--epjson": epjson, "--gltf": gltf, "--honeybee": honeybee, "--gbxml": gbxml}
    asked = {"--radiance": radiance, "--mitsuba": mitsuba, **files}
    if not any(asked.values()):
        raise click.UsageError(f"nothing to write: give one of {', '.join(asked)}")
    for field, path in files.items():
        if path is not None:
            check_file(path, field=field, inputs=options.building_files)
    folders = result_folders({"--radiance": radiance, "--mitsuba": mitsuba})

    from bim.building_file import named_spaces
    from scenes.commands.progress_bar import ProgressBar
    from scenes.fenestration_exports import known_fenestration
    from scenes.head import head_of
    from scenes.input_files import building_of, overrides_of

    with ProgressBar() as progress:
        read = building_of(options, progress)
    spaces = named_spaces(read, options.rooms, building)
    known = known_fenestration(spaces, building, overrides_of(options, None, light_only=True))
    head = PrintedHead()
    head(head_of(read, light_only=True).with_assumptions(known.notes()))
    writers = room_writers(
        known, band.lower(), spacing=sensor_spacing, height=sensor_height, sky_division=int(subdivision)
    )
    export_folders(read, spaces, writers, folders)
    exported = replace(read, spaces=tuple(spaces))
    files = {"epjson": epjson, "honeybee": honeybee, "gbxml": gbxml}
    ground = None if weather is None or epjson is None else ground_temperatures(weather)
    assumed = export_files(exported, known, files, ground)
    if gltf is not None:
        from bim.to_gltf import write_gltf

        write_gltf(exported, gltf)
        click.echo(gltf)
    head.notes(assumed)


def result_folders(asked: Mapping[str, Path | None]) -> dict[Path, tuple[ResultFolder, list[str]]]:
    """The folders to write, each with the options that name it: formats may share one."""
    formats: dict[Path, list[str]] = {}
    for option, parent in asked.items():
        if parent is not None:
            formats.setdefault(parent, []).append(option)
    return {
        parent: (ResultFolder(parent, "export", adding=True, field=options[0]), options)
        for parent, options in formats.items()
    }


def export_folders(
    read: Building,
    chosen: Sequence[Space],
    writers: Mapping[str, Callable],
    folders: Mapping[Path, tuple[ResultFolder, list[str]]],
) -> None:
    """Write a folder for each room that the formats have into each folder of results."""
    for parent, (folder, options) in folders.items():
        written: list[str] = []
        kinds = {pattern for option in options for pattern in PATTERNS[option]}

        def of_these(name: str, written=written, kinds=kinds) -> bool:
            file = Path(name).name
            return name.partition("/")[0] in written and any(fnmatch(file, k) for k in kinds)

        with folder.replaced(gone=of_these) as place:
            written += _export_rooms(read, chosen, place, [writers[one] for one in options])
        for name in written:
            click.echo(parent / name)


def room_writers(known: KnownFenestration, band: str, **grid) -> dict[str, Callable]:
    """What writes a room's scene into a folder, by option; `grid`: sensors and sky of Radiance."""
    from bim.to_mitsuba import write_mitsuba
    from bim.to_radiance import write_radiance

    def radiance_room(space: Space, building: Building, folder: Path) -> None:
        write_radiance(space, building, folder, band=band, filled=known.groups(space), **grid)

    def mitsuba_room(space: Space, building: Building, folder: Path) -> None:
        if space.windows:
            write_mitsuba(space, building, folder, band=band, bsdfs=known.bsdfs(band))

    return {"--radiance": radiance_room, "--mitsuba": mitsuba_room}


def ground_temperatures(weather: Path) -> list[float]:
    """Monthly temperature [12] of the ground at 0.5 m from a year of outdoor air [degC]."""
    import pandas as pd

    from scenes.input_files import read_weather
    from thermal.climate import undisturbed_ground

    year = read_weather(weather)
    middles = year.times - pd.Timedelta(hours=0.5 * year.step_h)
    values = pd.Series(undisturbed_ground(year.dry_bulb_c), index=middles)
    return values.groupby(middles.month).mean().tolist()


def export_files(
    building: Building,
    known: KnownFenestration,
    files: Mapping[str, Path | None],
    ground_c: Sequence[float] | None = None,
) -> tuple[str, ...]:
    """Write the models that state U and g of windows, by format; their assumptions.

    Args: files: by "honeybee", "gbxml", "epjson"; ground_c: [12] for EnergyPlus [degC].
    """
    from bim.gbxml.write import write_gbxml
    from bim.honeybee.write import write_honeybee
    from bim.to_energyplus import write_epjson

    if not any(files.values()):
        return ()
    epjson = partial(write_epjson, ground_c=ground_c)
    writers = {"honeybee": write_honeybee, "gbxml": write_gbxml, "epjson": epjson}
    glazing, assumed = known.glazings()
    for name, write in writers.items():
        path = files.get(name)
        if path is not None:
            assumed += tuple(f"{note}." for note in write(building, path, glazing=glazing))
            click.echo(path)
    return assumed


def _export_rooms(building: Building, spaces: Sequence[Space], place: Path, writers: Sequence[Callable]) -> list[str]:
    """Write a folder for each room that one of the writers has a scene of; their names."""
    from bim.names import folder_names

    written = []
    for space, name in zip(spaces, folder_names(spaces), strict=True):
        try:
            for write in writers:
                write(space, building, place / name)
        except RoomError as error:  # a void too low for a work plane or an eye
            click.echo(f"{space.label}: left out: {error}", err=True)
            shutil.rmtree(place / name, ignore_errors=True)
            continue
        written += [name] if (place / name).is_dir() else []
    return written
