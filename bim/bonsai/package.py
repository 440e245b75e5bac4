"""The add-on as a zip that Blender installs: `write_add_on`."""

from __future__ import annotations

import io
import zipfile
from importlib import resources
from os import PathLike
from pathlib import Path

from mitsuba_cfs.files import write_bytes

MANIFEST = """\
schema_version = "1.0.0"
id = "cfs_bonsai"
version = "1.0.0"
name = "Daylight, glare and comfort of rooms (mitsuba-cfs)"
tagline = "Runs cfs on the IFC file open in Bonsai and colours its rooms"
maintainer = "mitsuba-cfs"
type = "add-on"
blender_version_min = "4.2.0"
license = ["SPDX:MIT"]

[permissions]
files = "Reads the IFC file and the tables of results"
"""
DATE = (2026, 1, 1, 0, 0, 0)  # the same bytes every time


def write_add_on(path: str | PathLike[str]) -> None:
    """Write the zip, for Blender's "Install from Disk"."""
    source = (resources.files("bim.bonsai") / "addon.py").read_bytes()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (("__init__.py", source), ("blender_manifest.toml", MANIFEST.encode())):
            archive.writestr(zipfile.ZipInfo(name, DATE), text)
    write_bytes(Path(path), content.getvalue())
