"""Every type of Radiance's modifiers and primitives: its status is that of the docs' table."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bim.building_file import read_building_file
from bim.model import Building
from bim.report.issue import area_words
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.screens import FabricBand, fabric_klems
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import triangle_areas
from mitsuba_cfs.trace.paths.scene import without_peaks
from tests.radiance import run

DOCS = Path(__file__).parents[2] / "docs"
OFFICE = (DOCS / "tutorials/office.rad").read_text()
PANE = "void glass glazing\n0\n0\n3 .87 .87 .87\n"
SHEET = "12  1 1 1  2 1 1  2 2 1  1 2 1"
NUMBERS = {
    "plastic": "5 .5 .5 .5 0 0",
    "metal": "5 .5 .5 .5 .3 .1",
    "plastic2": "6 .5 .5 .5 .03 .1 .2",
    "metal2": "6 .5 .5 .5 .3 .1 .2",
    "mirror": "3 .8 .8 .8",
    "trans": "7 .8 .8 .8 0 0 .6 .2",
    "trans2": "8 .8 .8 .8 0 0 0 .6 .2",
    "glass": "3 .6 .6 .6",
    "dielectric": "5 .9 .9 .9 1.5 0",
    "interface": "8 .9 .9 .9 1.5 .9 .9 .9 1",
    "light": "3 1 1 1",
    "glow": "4 1 1 1 0",
    "illum": "3 1 1 1",
    "spotlight": "7 1 1 1 60 0 0 -1",
    "mist": "0",
    "BRTDfunc": "9 .1 .1 .1 .1 .1 .1 .02 .02 .02",
}
STRINGS = {
    "BRTDfunc": "10 0 0 0 .1 .1 .1 0 0 0 .",
    "BSDF": "6 0 shade.xml 0 0 1 .",
    "aBSDF": "5 shade.xml 0 0 1 .",
    "brightfunc": "2 .5+.1*Px .",
    "colorfunc": "4 .3+.1*Px .4 .3 .",
}
MIXED = {"window": "4 carpet void .5+.1*Px .", "surface": "4 carpet plaster .5+.1*Px ."}
SHAPES = {
    "polygon": SHEET,
    "ring": "8  1 1 1  0 0 1  0 .5",
    "cylinder": "7  1 1 0  1 1 1  .2",
    "tube": "7  1 1 0  1 1 1  .2",
    "cone": "8  1 1 0  1 1 1  .2 .1",
    "cup": "8  1 1 0  1 1 1  .2 .1",
    "sphere": "4  1 1 1  .2",
    "bubble": "4  1 1 1  .2",
    "source": "4  0 0 1  180",
    "mesh": "0",
    "instance": "0",
}

TUBE, CONE, BALL = 2 * np.pi * 0.2, np.pi * 0.3 * np.hypot(1, 0.1), 4 * np.pi * 0.2**2
FACE = 0.0426  # reflectance of a face of glass
PANE_PASSES = (1 - FACE) ** 2 * 0.6 / (1 - (FACE * 0.6) ** 2)
PATTERN = {"brightfunc": 0.5 + 0.1 * 2, "colorfunc": 0.265 * 0.5 + 0.67 * 0.4 + 0.065 * 0.3}
# of a surface its area, or diffuse and specular reflectance; of a window its transmittance at
# normal incidence, all and straight on
EXPECTED: dict[tuple[str, str], tuple[float, ...]] = {
    ("polygon", "surface"): (1.0,),
    ("ring", "surface"): (np.pi * 0.5**2,),
    **{(kind, "surface"): (TUBE,) for kind in ("cylinder", "tube")},
    **{(kind, "surface"): (CONE,) for kind in ("cone", "cup")},
    **{(kind, "surface"): (BALL,) for kind in ("sphere", "bubble")},
    ("plastic", "surface"): (0.5, 0.0),
    ("plastic2", "surface"): (0.97 * 0.5, 0.03),
    **{(kind, "surface"): (0.7 * 0.5, 0.3 * 0.5) for kind in ("metal", "metal2")},
    ("mirror", "surface"): (0.0, 0.8),
    **{(kind, "window"): (0.8 * 0.6, 0.8 * 0.6 * 0.2) for kind in ("trans", "trans2")},
    ("glass", "window"): (PANE_PASSES, PANE_PASSES),
    ("BRTDfunc", "window"): (0.12, 0.1),
    **{(kind, "window"): (0.2, 0.1) for kind in ("BSDF", "aBSDF")},
    ("mixfunc", "window"): (0.3, 0.3),
    ("mixfunc", "surface"): (0.65 * 0.25 + 0.35 * 0.7, 0.0),
    **{(kind, "pattern on glass"): (0.917 * 0.87 * mean,) * 2 for kind, mean in PATTERN.items()},
}


def rows() -> list[tuple[str, str, str]]:
    text = (DOCS / "radiance.md").read_text().partition("## Modifiers and primitives")[2]
    text = text.partition("\n## ")[0]
    found = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4 and cells[0].startswith("`"):
            found += [(kind, cells[1], cells[2]) for kind in re.findall(r"`(\w+)`", cells[0])]
    return found


def figures(building: Building, use: str) -> list[tuple[float, ...]]:
    """What of a building compares with `EXPECTED`: of the surface, or of the window."""
    if "glass" in use or use == "window":
        (window,) = building.windows
        if window.glass is not None:
            return [(window.glass.transmittance,) * 2]
        (state,) = window.states
        bsdf = state.bands["Visible"]
        whole = float(bsdf.direct_hemispherical(bsdf.transmission_front)[0])
        peaks = without_peaks(bsdf, "transmission")
        beam = whole - float(peaks.direct_hemispherical(peaks.transmission_front)[0])
        return [(whole, beam if state.angular is None else state.angular.transmittance[0])]
    (room,) = building.spaces
    name = "floor" if "pattern" in use else "thing"
    parts = [part for part in (*room.furniture, *room.faces) if part.name.startswith(name)]
    areas = [float(triangle_areas(part.triangles).sum()) for part in parts]
    shares = [(part.reflectance_visible, 0.0 if part.gloss is None else part.gloss.at_normal) for part in parts]
    return [(area,) for area in areas] + shares


def scene_of(kind: str, use: str) -> str:
    strings = MIXED[use] if kind == "mixfunc" else STRINGS.get(kind, "0")
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


def test_every_type_of_radiance_is_in_the_table() -> None:
    """Source: `otypes.h` of Radiance 6; `alias` has a test of its own."""
    types = """
        source polygon cone sphere ring cylinder cup bubble tube instance mesh plastic metal trans
        interface plasfunc metfunc brightfunc brightdata brighttext colorpict glow light illum
        spotlight mist mirror transfunc BRTDfunc BSDF aBSDF WGMDfunc plasdata metdata transdata
        colorfunc antimatter colordata colortext texfunc texdata mixfunc mixdata mixtext mixpict
        prism1 prism2 plastic2 metal2 trans2 ashik2 glass dielectric spectrum specfile specfunc
        specdata specpict
    """
    assert {kind for kind, _, _ in rows()} == set(types.split())


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
        assert_figures(building, kind, use)
    else:
        severities = {"approximated": {"assumption"}, "left out": {"loss", "unused"}}[status]
        assert {issue.severity for issue in issues} <= severities
        if status == "approximated":
            assert_figures(building, kind, use)
        assert any(re.search(r"scene\.rad:\d+$", issue.where) for issue in issues)


def assert_figures(building: Building, kind: str, use: str) -> None:
    """The surface or window has the figures of its definition."""
    plain = (0.25 * PATTERN.get(kind, 1.0), 0.0)  # of the carpet
    expected = EXPECTED.get((kind, use), plain)
    values = figures(building, use)
    assert any(one == pytest.approx(expected, rel=0.02, abs=1e-6) for one in values), values


def test_an_illum_is_its_other_material_or_is_not_there(tmp_path):
    path = tmp_path / "scene.rad"
    sheet = OFFICE[OFFICE.index("glazing polygon window") :].split("\n\n")[0]
    for strings, count in (("0", 0), ("1 void", 0), ("1 plaster", 1)):
        illum = f"\nvoid illum lit\n{strings}\n0\n3 1 1 1\n"
        path.write_text(OFFICE + illum + f"\nlit polygon thing\n0\n0\n{SHEET}\n")
        building = read_building_file(path)
        assert len(building.windows) == 1
        assert len(figures(building, "surface")) == 2 * count
    path.write_text(OFFICE + "\nvoid illum lit\n1 glazing\n0\n3 1 1 1\n")
    path.write_text(path.read_text() + sheet.replace("glazing polygon window", "lit polygon thing"))
    assert {window.name for window in read_building_file(path).windows} <= {"window", "thing"}


MIXED_PANE = """
void plastic enamel
0
0
5 .8 .6 .4 .05 0
void mixfunc frit
4 glazing enamel if(mod(Pz*20,1)-.6,1,0) .
0
0
"""


def test_a_mixture_of_glass_and_enamel_transmits_what_rtrace_sees_through_it(tmp_path):
    pane = OFFICE.replace("glazing polygon window", "frit polygon window")
    (tmp_path / "scene.rad").write_text(pane.replace(PANE, PANE + MIXED_PANE))
    (window,) = read_building_file(tmp_path / "scene.rad").windows
    table, count = window.states[0].angular, 4000
    sky = "void glow sky\n0\n0\n4 1 1 1 0\nsky source all\n0\n0\n4 0 1 0 180\n"
    sheet = "frit polygon window\n0\n0\n12  0 0 0  1 0 0  1 0 1  0 0 1\n"
    (tmp_path / "pane.rad").write_text(sky + PANE + MIXED_PANE + sheet)
    points = np.insert(np.random.default_rng(0).uniform(0, 1, (count, 2)), 1, 0.0, axis=1)
    for angle in np.radians([0.0, 40.0, 70.0]):
        way = np.array([np.sin(angle), np.cos(angle), 0.0])
        np.savetxt(tmp_path / "rays", np.hstack([points - 0.01 * way, np.tile(way, (count, 1))]))
        command = "oconv pane.rad > pane.oct && rtrace -h -ab 0 pane.oct < rays"
        seen = np.array(run(command, tmp_path).split(), dtype=float)[1::3]  # all channels are grey
        passed = np.interp(angle, table.theta, table.transmittance)
        # four standard errors of the share 0.4 of the points that are glass
        assert seen.mean() == pytest.approx(passed, abs=4 * np.sqrt(0.24 / count))


def test_mixtures_that_are_not_computed_are_left_out_with_their_area(tmp_path):
    wall = "\nvoid mixfunc mixed\n4 plaster carpet noise_of(P) .\n0\n0\n"
    for text, kind in ((wall, "mixfunc"), (wall.replace("carpet", "odd"), "ashik2")):
        odd = "\nvoid ashik2 odd\n4 0 0 1 .\n0\n8 .5 .5 .5 .1 .1 .1 9 9\n"
        path = tmp_path / "scene.rad"
        path.write_text(OFFICE + odd + text + f"\nmixed polygon thing\n0\n0\n{SHEET}\n")
        building = read_building_file(path)
        issues = {(one.code, one.values.get("type")): one for one in building.issues}
        values = {"count": 1, "type": kind, "first": "thing", "area": area_words(1.0)}
        assert issues["surfaces-not-read", kind].values == values
        assert ("primitives-not-read", kind) not in issues  # the definition of that surface


def test_a_mixture_of_itself_is_refused(tmp_path):
    path = tmp_path / "scene.rad"
    path.write_text(
        OFFICE + f"\nvoid mixfunc a\n4 plaster b .5 .\n0\n0\nvoid alias b a\na polygon thing\n0\n0\n{SHEET}\n"
    )
    with pytest.raises(DataError, match="modifies itself"):
        read_building_file(path)


def test_the_table_has_all_types_that_are_known():
    from bim.radiance.materials import MATERIALS, MIXTURE, PATTERNS
    from bim.radiance.scene import KINDS

    assert {*MATERIALS, *PATTERNS, *KINDS, MIXTURE} <= {kind for kind, _, _ in rows()}
