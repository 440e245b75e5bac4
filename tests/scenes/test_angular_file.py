"""The `[angular]` table beside a BSDF: what it may hold, and what is said of its faults."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_cfs.bsdf.angular import roos_table, stack_table
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.glazing import Glazing, Pane, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_file import files_beside

THETA = np.radians([0, 40, 70, 85])
UNIT = Glazing("unit", 0.70, 0.12, 0.13)
TABLE = "theta_deg,transmittance\n" + "\n".join(
    f"{d},{roos_table(UNIT).transmitted(np.radians(d)):.5f}" for d in range(0, 91, 5)
)
PRODUCT = {
    "type": "glazing",
    "name": "a pane",
    "coated_side": "Neither",
    "measured_data": {"is_specular": True},
    "integrated_results_summary": [{"tfvis": 0.88, "rfvis": 0.08, "rbvis": 0.08}],
}
ROOS = "[angular.roos]\ntransmittance = 0.7\nreflectance_front = 0.12\nreflectance_back = 0.13"
FLOAT = Pane("a pane", 0.88, 0.08, 0.08)


def system(folder, toml: str, glass=UNIT):
    path = folder / "glass.xml"
    write_bsdf_xml(BsdfFile({"Visible": specular_klems(glass, KLEMS_FULL)}, "glass"), path)
    (folder / "glass.csv").write_text(TABLE)
    (folder / "pane.json").write_text(json.dumps(PRODUCT))
    path.with_suffix(".toml").write_text(toml)
    return read_system(path)


@pytest.mark.parametrize(
    ("toml", "glass", "expected"),
    [
        ('[angular]\ntable = "glass.csv"', UNIT, roos_table(UNIT)),
        (ROOS, UNIT, roos_table(UNIT)),
        ('[[angular.pane]]\nproduct = "pane.json"', FLOAT, stack_table([FLOAT])),
        ("[[angular.pane]]\ntransmittance = 0.88\nreflectance_front = 0.08", FLOAT, stack_table([FLOAT])),
    ],
)
def test_a_system_has_the_function_that_stands_beside_it(tmp_path, toml, glass, expected):
    found = system(tmp_path, toml, glass).angular
    assert found.transmitted(THETA) == pytest.approx(expected.transmitted(THETA), abs=2e-3)
    assert files_beside(tmp_path / "glass.xml")[0].suffix == ".toml"


def test_without_the_table_there_is_none_and_nothing_else_is_beside(tmp_path):
    assert system(tmp_path, "u_value = 1.1").angular is None
    assert len(files_beside(tmp_path / "glass.xml")) == 1


def test_a_coated_pane_may_be_turned(tmp_path):
    coated = PRODUCT | {"coated_side": "Front"}
    coated["integrated_results_summary"] = [{"tfvis": 0.7, "rfvis": 0.10, "rbvis": 0.15}]
    (tmp_path / "coated.json").write_text(json.dumps(coated))
    glass = Pane("coated", 0.7, 0.15, 0.10, coated=True)
    toml = '[[angular.pane]]\nproduct = "coated.json"\nflipped = true'
    found = system(tmp_path, toml, glass).angular
    assert found.reflected("front", 0.0) == pytest.approx(0.15, abs=2e-3)


def test_layers_of_a_glazing_system_are_read(tmp_path, real_data):
    from mitsuba_cfs.bsdf.spectral_pane import read_glazing_layers

    path = real_data / "bsdf/products_spectral/afc_glazing_system_dgl00_clr.json"
    panes = [layer.visible_pane() for layer in read_glazing_layers(path)]
    told = json.loads(path.read_text())
    omega = KLEMS_FULL.projected_solid_angles()
    means = np.diag(np.array(told["visible_front_transmittance"])) * omega
    # the file's own matrices, by WINDOW's engine and at the middles of rings, to 40 degrees: above,
    # it adds up reflections without polarisation (4 % at 60)
    rings = KLEMS_FULL.ring_starts[:5]
    theta, _ = KLEMS_FULL.centres()
    assert stack_table(panes).transmitted(theta[rings]) == pytest.approx(means[rings], rel=0.02)


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        ('[angular]\ntable = "none.csv"', r"none.csv: cannot be read"),
        ('[angular]\ntable = "glass.xml"', "expected the columns theta_deg"),
        ("[angular]", "expected one of table, roos, pane and glazing"),
        ('[[angular.pane]]\nproduct = "glass.csv"', "is no spectral row"),
        ("[[angular.pane]]\ncoated = true", "either product or transmittance"),
        ("[[angular.pane]]\ntransmittance = 0.3\nreflectance_front = 0.1", "not the same system"),
        (ROOS.replace("0.7", "0.95"), "expected shares of 1"),
    ],
)
def test_faults_are_one_line_that_names_the_file(tmp_path, toml, words):
    with pytest.raises(DataError, match=words) as caught:
        system(tmp_path, toml)
    assert "glass" in str(caught.value) or "none.csv" in str(caught.value)


def test_what_scatters_has_no_function_of_an_angle(tmp_path):
    even = np.full((KLEMS_FULL.size, KLEMS_FULL.size), 0.3 / np.pi)
    path = tmp_path / "shade.xml"
    shade = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, even, even)
    write_bsdf_xml(BsdfFile({"Visible": shade}, "shade"), path)
    path.with_suffix(".toml").write_text(ROOS)
    with pytest.raises(DataError, match="scatters 100 %"):
        read_system(path)


def test_reflectances_of_a_table_are_read(tmp_path):
    names = ("theta_deg", "transmittance", "reflectance_front", "reflectance_back")
    rows = ["0,0.7,0.12,0.2", "60,0.6,0.2,0.3", "90,0,1,1"]
    (tmp_path / "sides.csv").write_text("\n".join([",".join(names), *rows]))
    found = system(tmp_path, '[angular]\ntable = "sides.csv"').angular
    assert found.reflected("front", 0.0) == pytest.approx(0.12)
    assert found.reflected("back", np.radians(60)) == pytest.approx(0.3)


def test_a_stated_pane_may_be_turned(tmp_path):
    toml = "[[angular.pane]]\ntransmittance = 0.7\nreflectance_front = 0.10\nreflectance_back = 0.15\nflipped = true"
    glass = Pane("coated", 0.7, 0.15, 0.10, coated=True)
    found = system(tmp_path, toml, glass).angular
    assert found.reflected("front", 0.0) == pytest.approx(0.15, abs=2e-3)
    assert found.reflected("back", 0.0) == pytest.approx(0.10, abs=2e-3)


def test_a_unit_has_as_many_panes_as_it_says(tmp_path):
    one = Glazing("unit", 0.70, 0.12, 0.13, 1)
    found = system(tmp_path, ROOS + "\npanes = 1", one).angular
    assert found.transmitted(THETA) == pytest.approx(roos_table(one).transmitted(THETA))
    assert abs(found.transmitted(THETA[2]) - roos_table(UNIT).transmitted(THETA[2])) > 0.01


def test_the_files_that_it_names_are_beside_it(tmp_path):
    system(tmp_path, '[angular]\ntable = "glass.csv"')
    assert [p.name for p in files_beside(tmp_path / "glass.xml")] == ["glass.toml", "glass.csv"]
