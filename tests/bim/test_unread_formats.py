"""Formats that are not read are refused by name, with the file to give instead."""

from __future__ import annotations

from pathlib import Path

import pytest

from bim.building_file import UNREAD, check_building_file, read_building_file
from mitsuba_cfs.errors import DataError


@pytest.mark.parametrize("suffix", list(UNREAD))
def test_a_suffix_is_refused_with_a_remedy(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"model{suffix}"
    path.write_text("content")
    for read in (check_building_file, read_building_file):
        with pytest.raises(DataError, match=r"; (give|export|write)|as IFC"):
            read(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("scene.rad", b"#?RADIANCE\noconv a.rad\nFORMAT=Radiance_octree\n\n", "octree"),
        ("model.ifc", b'<?xml version="1.0"?>\n<ifc:ifcXML xmlns="x">', "ifcXML"),
        ("model.xml", b'<?xml version="1.0"?>\n<ifcXML xmlns="x">', "ifcXML"),
        ("model.hbjson", b'{"type": "Model", "dragonfly_version": "1.0"}', "dragonfly"),
    ],
)
def test_content_is_refused_whatever_the_suffix(tmp_path, name, content, words) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DataError, match=words):
        check_building_file(path)
