"""The add-on as a zip that Blender installs: `write_add_on`."""

from __future__ import annotations

import io
import zipfile
from importlib import resources
from os import PathLike
from pathlib import Path

from mitsuba_cfs.files import write_bytes

FILES = {"addon.py": "__init__.py", "blender_manifest.toml": "blender_manifest.toml"}
DATE = (2026, 1, 1, 0, 0, 0)  # the same bytes every time


def write_add_on(path: str | PathLike[str]) -> None:
    """Write the zip, for Blender's "Install from Disk"."""
    folder = resources.files("bim.bonsai")
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, inside in FILES.items():
            archive.writestr(zipfile.ZipInfo(inside, DATE), (folder / name).read_bytes())
    write_bytes(Path(path), content.getvalue())
