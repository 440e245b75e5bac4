"""Formats that are not read are refused by name, with the file to give instead."""

from __future__ import annotations

from pathlib import Path

import pytest

from bim.building_file import UNREAD, check_building_file, read_building_file
from mitsuba_cfs.errors import DataError


@pytest.mark.parametrize("suffix", list(UNREAD))
def test_a_suffix_is_refused_with_a_remedy(tmp_path: Path, suffix: str) -> None:
    by_content = not suffix.startswith(".")  # a BSDF: XML, as some buildings are
    path = tmp_path / ("model.xml" if by_content else f"model{suffix}")
    path.write_text("<WindowElement/>" if by_content else "content")
    for read in (check_building_file, read_building_file):
        with pytest.raises(DataError, match=r"[;:] (give|export|write|the glare command)|as IFC"):
            read(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("scene.rad", b"#?RADIANCE\noconv a.rad\nFORMAT=Radiance_octree\n\n", "octree"),
        ("model.ifc", b'<?xml version="1.0"?>\n<ifc:ifcXML xmlns="x">', "ifcXML"),
        ("model.xml", b'<?xml version="1.0"?>\n<ifcXML xmlns="x">', "ifcXML"),
        ("model.hbjson", b'{"type": "Model", "dragonfly_version": "1.0"}', "dragonfly"),
        ("model.hbjson", b'{"type": "Model", "identifier": "x", "buildings": []}', "to_honeybee"),
    ],
)
def test_content_is_refused_whatever_the_suffix(tmp_path, name, content, words) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DataError, match=words):
        read_building_file(path)


LATIN = "Büro".encode("latin-1")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("model.hbjson", b'{"type": "Model",\n"identifier": "' + LATIN + b'"}'),
        ("model.gbxml", b"<gbXML>\n<Campus><Name>" + LATIN + b"</Name></Campus></gbXML>"),
        ("model.xml", b'<?xml version="1.0" encoding="UTF-8"?><gbXML>\n<Campus id="' + LATIN + b'"/></gbXML>'),
    ],
)
def test_latin_1_bytes_give_one_line_with_the_remedy(tmp_path, name, content) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"line 2: byte 0xfc is not UTF-8; save the file"):
        read_building_file(path)


def test_latin_1_is_read_where_it_is_declared_or_does_no_harm(tmp_path) -> None:
    from bim.radiance.scene import read_radiance
    from mitsuba_cfs.sky.epw import read_epw
    from scenes.demo import FOLDER
    from tests.bim.test_read_gbxml import two_rooms

    text = two_rooms().replace("UTF-8", "ISO-8859-1").replace("<Name>Wall", "<Name>Büro")
    (tmp_path / "a.gbxml").write_bytes(text.encode("latin-1"))
    names = {f.construction.name for f in read_building_file(tmp_path / "a.gbxml").spaces[0].faces}
    assert "Büro" in names
    (tmp_path / "a.rad").write_bytes(
        b"# "
        + LATIN
        + b"\nvoid plastic "
        + LATIN
        + b"\n0\n0\n5 .5 .5 .5 0 0\n"
        + LATIN
        + b" polygon p\n0\n0\n9 0 0 0 1 0 0 0 1 0\n"
    )
    assert len(read_radiance(tmp_path / "a.rad").objects) == 1
    weather = next(FOLDER.glob("*.epw")).read_text().replace("Chicago", "Büro", 1)
    (tmp_path / "a.epw").write_bytes(weather.encode("latin-1"))
    assert len(read_epw(tmp_path / "a.epw").direct_normal) == 8760


def test_latin_1_in_a_bsdf_gives_one_line(tmp_path) -> None:
    from mitsuba_cfs.bsdf.xml import read_bsdf_xml

    (tmp_path / "a.xml").write_bytes(b"<?xml version='1.0'?>\n<WindowElement>" + LATIN)
    with pytest.raises(DataError, match="line 2: byte 0xfc is not UTF-8"):
        read_bsdf_xml(tmp_path / "a.xml")
