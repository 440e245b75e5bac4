"""A blind drawn before a window whose BSDF holds it is traced once; what is fixed stays."""

from __future__ import annotations

import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.report.issue import issue_text
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.inputs import read_inputs
from scenes.room.windows import has_shade
from scenes.run.options import JobOptions
from tests.bim.small_ifc import OPENING, WALL, WIDTH, SmallIfc, box_room
from tests.issues import of_code

X, SILL, W, H = OPENING
SPACING, DEPTH, THICK = 0.07, 0.08, 0.002  # of the slats [m]


def slats(y: float) -> list:
    """Flat slats over the whole window: light passes between them, rays along y all of it."""
    levels = np.arange(SILL, SILL + H, SPACING)
    return [((X, y, float(z)), (W, DEPTH, THICK), None) for z in levels]


DEVICES = {  # name: boxes
    "blind outside": slats(-WALL - 0.15),
    "blind inside": slats(0.02),
    "half drawn": slats(-WALL - 0.15)[-8:],
    "overhang": [((0, -WALL - 1.0, SILL + H), (WIDTH, 1.0, 0.1), None)],
    "short overhang": [((0, -WALL - 0.3, SILL + H), (WIDTH, 0.3, 0.1), None)],
    "fins": [((x, -WALL - 0.3, SILL), (0.05, 0.3, H), None) for x in (X, X + W - 0.05)],
    "light shelf": [((X, -WALL - 0.3, SILL + 1.0), (W, 0.3, 0.05), None)],
    "neighbour's blind": slats(-8.0),
    "blind of the wall beside": [
        ((X + W + 0.2, -WALL - 0.15, z), (3.0, DEPTH, THICK), None) for z in (1.0, 1.07, 1.14)
    ],
}
DRAWN = {"blind outside", "blind inside", "half drawn"}
NAMED = {"Vorhang 2": True, "Rideau": True, "Curtain Wall": False, "Kasten": False}  # are shades


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The room with every device."""
    path = tmp_path_factory.mktemp("shades") / "room.ifc"
    model = box_room()
    body = next(c for c in model.by_type("IfcGeometricRepresentationSubContext"))
    small = SmallIfc(model, body, model.by_type("IfcBuildingStorey")[0], 1.0)
    for name, boxes in DEVICES.items():
        device = small.box("IfcShadingDevice", name, (0, 0, 0), (1, 1, 1))
        small.show(device, boxes)
    for name in NAMED:
        proxy = small.box("IfcBuildingElementProxy", name, (0, 0, 0), (1, 1, 1))
        small.show(proxy, slats(0.02))
    model.write(str(path))
    return path


def devices(building) -> set[str]:
    return {e.name for e in building.elements if e.ifc_class == "IfcShadingDevice"}


def inputs(model, folder, toml: str):
    """What a run traces with the demo's blind and this file beside it."""
    system = folder / "system.xml"
    system.write_bytes(VENETIAN_BLIND.read_bytes())
    system.with_suffix(".toml").write_text(toml)
    return read_inputs(JobOptions(model, WEATHER, system=system)).building


def test_the_blind_of_the_bsdf_is_left_out_and_named_with_its_area(model, tmp_path, caplog):
    building = inputs(model, tmp_path, "u_value = 1.1\n")
    assert devices(building) == set(DEVICES) - DRAWN
    issues = of_code(building, "shade-drawn-and-in-system")
    elements = {str(i.values["element"]).partition(" ")[::2]: i.values for i in issues}
    said = {name: values for (kind, name), values in elements.items() if "Proxy" not in kind}
    assert set(said) == DRAWN
    # the outline of the slats: from the lowest to the highest, as wide as the window
    high = SPACING * (len(slats(0)) - 1) + THICK
    assert said["blind outside"]["area"] == pytest.approx(W * high, abs=0.005)
    assert said["blind outside"]["windows"] == ("W1",)
    assert all("keep = [" in issue_text(issue).fix for issue in issues)
    assert "blind outside" in caplog.text  # which the command line shows


def test_a_proxy_is_a_shade_where_its_name_says_so(model, tmp_path):
    left = {e.name for e in inputs(model, tmp_path, "u_value = 1.1\n").elements} & set(NAMED)
    assert left == {name for name, shade in NAMED.items() if not shade}


def test_the_blind_before_a_glazing_alone_stays(model, tmp_path):
    building = inputs(model, tmp_path, 'shading_position = "none"\n')
    assert devices(building) == devices(read_ifc(model)) >= DRAWN


def test_the_corrections_keep_what_they_name(model, tmp_path):
    there = tmp_path / "room.ifc"
    there.write_bytes(model.read_bytes())
    text = "keep = ['IfcShadingDevice, Name=\"blind outside\"']\n"
    there.with_suffix(".corrections.toml").write_text(text)
    assert DRAWN & devices(inputs(there, tmp_path, "")) == {"blind outside"}


def test_a_shade_is_known_by_the_light_that_it_scatters():
    assert has_shade(read_system(VENETIAN_BLIND))
    straight = np.diag(0.7 / KLEMS_FULL.projected_solid_angles())
    none = np.zeros_like(straight)
    clear = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, straight, straight, none, none)
    assert not has_shade(FenestrationSystem("clear", clear, clear))
    assert has_shade(FenestrationSystem("clear", clear, clear, shading_position="internal"))
