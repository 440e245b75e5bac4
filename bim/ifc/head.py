"""What can be said of an IFC file from its first lines, before it is opened."""

from __future__ import annotations

import re
import zipfile
from os import PathLike
from pathlib import Path

from mitsuba_cfs.errors import DataError

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")
HEAD = 65_536  # bytes: a header that is longer is left to the parser
ZIPPED = (".ifczip", ".zip")
LARGEST = 2**30  # of a zipped model, unpacked [bytes]: reading takes ten times that in memory
SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'")


def check_head(path: str | PathLike[str]) -> None:
    """Raise `DataError` where a file is no IFC model (.ifc, .ifczip) of our schemas."""
    path = Path(path)
    if not path.is_file():
        raise DataError("no such file", file=path)
    if path.suffix.lower() in ZIPPED:
        starts = _zipped_starts(path)
    else:
        with path.open("rb") as stream:
            starts = [stream.read(HEAD)]
    for start in starts:
        _check_start(start, path)


def _check_start(start: bytes, path: Path) -> None:
    if b"ISO-10303-21" not in start[:4096]:
        raise DataError("not an IFC file: 'ISO-10303-21' is missing at its start", file=path)
    stated = SCHEMA.search(start)
    if stated is not None and not stated[1].upper().startswith(tuple(s.encode() for s in SCHEMAS)):
        schema = stated[1].decode(errors="replace")
        raise DataError(f"schema {schema}, expected one of {SCHEMAS}", file=path)


def model_names(archive: zipfile.ZipFile, path: Path) -> list[str]:
    """The names of the models in a zipped file, in order; `DataError` where there is none."""
    names = sorted(name for name in archive.namelist() if name.lower().endswith(".ifc"))
    if not names:
        xml = [name for name in archive.namelist() if name.lower().endswith((".ifcxml", ".xml"))]
        other = f"{xml[0]}, which is ifcXML: export the model as IFC (.ifc)" if xml else "none"
        raise DataError(f"expected an .ifc inside, found {other}", file=path)
    # zipfile unpacks no more than it says here
    size = sum(archive.getinfo(name).file_size for name in names)
    if size > LARGEST:
        message = f"unpacks to {size / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f} GB: unzip it first"
        raise DataError(message, file=path)
    return names


def _zipped_starts(path: Path) -> list[bytes]:
    try:
        with zipfile.ZipFile(path) as archive:
            starts = []
            for name in model_names(archive, path):
                with archive.open(name) as stream:
                    starts.append(stream.read(HEAD))
            return starts
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise DataError(f"cannot be unzipped: {error}", file=path) from None
