"""The folders and files of `cfs ifc export`."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mitsuba_cfs.errors import RoomError
from scenes.result_folder import ResultFolder

if TYPE_CHECKING:
    from bim.model import Building, Space
    from scenes.fenestration_exports import KnownFenestration

PATTERNS = {  # of the files that an export writes
    "--radiance": ("*.rad", "*.pts", "*.vf", "windows_*.xml", "run.sh", "Makefile"),
    "--mitsuba": ("scene.xml", "glass_*.xml", "*.ply"),
}


def result_folders(asked: Mapping[str, Path | None]) -> dict[Path, tuple[ResultFolder, list[str]]]:
    """The folders to write, each with the options that name it: formats may share one."""
    formats: dict[Path, list[str]] = {}
    for option, parent in asked.items():
        if parent is not None:
            formats.setdefault(parent, []).append(option)
    return {
        parent: (ResultFolder(parent, "ifc export", adding=True, field=options[0]), options)
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


def export_files(
    building: Building, known: KnownFenestration, **files: Path | None
) -> tuple[str, ...]:
    """Write the models that state U and g of windows, by format; what of these is assumed."""
    from bim.gbxml.write import write_gbxml
    from bim.honeybee.write import write_honeybee
    from bim.to_energyplus import write_epjson

    if not any(files.values()):
        return ()
    writers = {"honeybee": write_honeybee, "gbxml": write_gbxml, "epjson": write_epjson}
    u_and_g, assumed = known.u_and_g()
    for name, write in writers.items():
        path = files[name]
        if path is not None:
            write(building, path, known=u_and_g)
            click.echo(path)
    return assumed


def _export_rooms(
    building: Building, spaces: Sequence[Space], place: Path, writers: Sequence[Callable]
) -> list[str]:
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
