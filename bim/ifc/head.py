"""What can be said of an IFC file from its first lines, before it is opened."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

from mitsuba_cfs.errors import DataError

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")
HEAD = 65_536  # bytes: a header that is longer is left to the parser
ZIPPED = (".ifczip", ".zip")
LARGEST = 2**30  # of a zipped model, unpacked [bytes]: reading takes ten times that in memory
SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'")


def check_head(path: str | Path) -> None:
    """Raise `DataError` where a file is no IFC model (.ifc, or .ifczip with one) of our schemas."""
    path = Path(path)
    if not path.is_file():
        raise DataError("no such file", file=path)
    if path.suffix.lower() in ZIPPED:
        start = _zipped_start(path)
    else:
        with path.open("rb") as stream:
            start = stream.read(HEAD)
    if b"ISO-10303-21" not in start[:4096]:
        raise DataError("not an IFC file: 'ISO-10303-21' is missing at its start", file=path)
    stated = SCHEMA.search(start)
    if stated is not None and not stated[1].upper().startswith(tuple(s.encode() for s in SCHEMAS)):
        schema = stated[1].decode(errors="replace")
        raise DataError(f"schema {schema}, expected one of {SCHEMAS}", file=path)


def model_name(archive: zipfile.ZipFile, path: Path) -> str:
    """The name of the one model in a zipped file; `DataError` where there is not one."""
    names = [name for name in archive.namelist() if name.lower().endswith(".ifc")]
    if len(names) != 1:
        raise DataError(f"expected one .ifc inside, found {len(names)}", file=path)
    size = archive.getinfo(names[0]).file_size  # zipfile unpacks no more than it says here
    if size > LARGEST:
        message = (
            f"unpacks to {size / 1e9:.1f} GB, more than {LARGEST / 1e9:.1f} GB: unzip it first"
        )
        raise DataError(message, file=path)
    return names[0]


def _zipped_start(path: Path) -> bytes:
    try:
        with zipfile.ZipFile(path) as archive, archive.open(model_name(archive, path)) as stream:
            return stream.read(HEAD)
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise DataError(f"cannot be unzipped: {error}", file=path) from None
