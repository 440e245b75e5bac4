"""Every type of Radiance's modifiers and primitives: its status is that of the docs' table."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bim.building_file import read_building_file
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.fabric import FabricBand, fabric_klems
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError

DOCS = Path(__file__).parents[2] / "docs"
OFFICE = (DOCS / "tutorials/office.rad").read_text()
PANE = "void glass glazing\n0\n0\n3 .87 .87 .87\n"
SHEET = "12  1 1 1  2 1 1  2 2 1  1 2 1"
NUMBERS = {
    "plastic": "5 .5 .5 .5 0 0", "metal": "5 .5 .5 .5 .3 .1", "plastic2": "6 .5 .5 .5 .03 .1 .2",
    "metal2": "6 .5 .5 .5 .3 .1 .2", "mirror": "3 .8 .8 .8", "trans": "7 .8 .8 .8 0 0 .6 .2",
    "trans2": "8 .8 .8 .8 0 0 0 .6 .2", "glass": "3 .6 .6 .6", "dielectric": "5 .9 .9 .9 1.5 0",
    "interface": "8 .9 .9 .9 1.5 .9 .9 .9 1", "light": "3 1 1 1", "glow": "4 1 1 1 0",
    "illum": "3 1 1 1", "spotlight": "7 1 1 1 60 0 0 -1", "mist": "0",
    "BRTDfunc": "9 .1 .1 .1 .1 .1 .1 .02 .02 .02",
}  # fmt: skip
STRINGS = {"BRTDfunc": "10 0 0 0 .1 .1 .1 0 0 0 .", "BSDF": "6 0 shade.xml 0 0 1 .",
           "aBSDF": "5 shade.xml 0 0 1 .", "brightfunc": "2 .5+.1*Px .",
           "colorfunc": "4 .5 .4 .3 ."}  # fmt: skip
SHAPES = {
    "polygon": SHEET, "ring": "8  1 1 1  0 0 1  0 .5", "cylinder": "7  1 1 0  1 1 1  .2",
    "tube": "7  1 1 0  1 1 1  .2",
    "cone": "8  1 1 0  1 1 1  .2 .1", "cup": "8  1 1 0  1 1 1  .2 .1",
    "sphere": "4  1 1 1  .2", "bubble": "4  1 1 1  .2", "source": "4  0 0 1  180",
    "mesh": "0", "instance": "0",
}  # fmt: skip


def rows() -> list[tuple[str, str, str]]:
    text = (DOCS / "radiance.md").read_text().partition("## Modifiers and primitives")[2]
    text = text.partition("\n## ")[0]
    found = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4 and cells[0].startswith("`"):
            found += [(kind, cells[1], cells[2]) for kind in re.findall(r"`(\w+)`", cells[0])]
    return found


def scene_of(kind: str, use: str) -> str:
    strings = STRINGS.get(kind, "0")
    if kind in SHAPES:
        return OFFICE + f"\nplaster {kind} thing\n0\n0\n{SHAPES[kind]}\n"
    definition = f"\nvoid {kind} subject\n{strings}\n0\n{NUMBERS.get(kind, '0')}\n"
    if use == "pattern on glass":
        return definition + OFFICE.replace("void glass glazing", "subject glass glazing")
    if use == "pattern on surface":
        return definition + OFFICE.replace("void plastic carpet", "subject plastic carpet")
    if use == "window":
        return OFFICE.replace(PANE, definition.replace("subject", "glazing"))
    return OFFICE + definition + f"\nsubject polygon thing\n0\n0\n{SHEET}\n"


@pytest.mark.parametrize(("kind", "use", "status"), rows())
def test_a_type_has_the_status_of_the_table(tmp_path, kind, use, status):
    klems = fabric_klems(FabricBand(0.2, 0.1, 0.3, 0.3))
    write_bsdf_xml(BsdfFile({"Visible": klems}, name="shade"), tmp_path / "shade.xml")
    path = tmp_path / "scene.rad"
    path.write_text(scene_of(kind, use))
    if status == "refused":
        with pytest.raises(DataError, match=r"scene\.rad:\d+: "):
            read_building_file(path)
        return
    usual = {issue.code for issue in read_building_file(DOCS / "tutorials/office.rad").issues}
    building = read_building_file(path)
    issues = [issue for issue in building.issues if issue.code not in usual]
    if status == "computed":
        assert not issues
        assert len(building.windows) == 1
    else:
        severities = {"approximated": {"assumption"}, "left out": {"loss", "unused"}}[status]
        assert {issue.severity for issue in issues} <= severities
        assert any(re.search(r"scene\.rad:\d+$", issue.where) for issue in issues)


def test_the_table_has_all_types_that_are_known():
    from bim.radiance.materials import MATERIALS, PATTERNS
    from bim.radiance.shapes import KINDS

    assert {*MATERIALS, *PATTERNS, *KINDS} <= {kind for kind, _, _ in rows()}
