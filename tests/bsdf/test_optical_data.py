"""Panes of building-envelope-data's optical data: the same as the IGSDB's own file of a pane."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.spectral_pane import read_pane_file, read_spectral_pane
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes import cli
from tests.bim.bim_fuzz import changed


def point(results, wavelengths, polar=8.0, emergence="hemispherical"):
    """A data point as the schema has it; a polar angle of None is light from everywhere."""
    return {
        "incidence": {"direction": "hemispherical" if polar is None else {"polar": polar}, "wavelengths": wavelengths},
        "emergence": {"direction": emergence},
        "results": results,
    }


def document(rows, *, emissivity=(0.84, 0.1), visible=(0.8, 0.08, 0.12), **igsdb):
    """Optical data of both surfaces: the non-prime one, often outdoors, is the front."""
    blocks = []
    for surface, column, own in (("prime", 3, 1), ("nonPrime", 2, 0)):
        points = [point({"transmittance": row[1], "reflectance": row[column]}, {"wavelength": row[0]}) for row in rows]
        results = {"transmittance": visible[0], "reflectance": visible[1 + own]}
        points.append(point(results, {"integral": "visible"}))
        results = {"transmittance": 0.0, "absorptanceEmittance": emissivity[own]}
        points.append(point(results, {"integral": "infrared"}, None))
        blocks.append({"componentCharacteristics": {"surface": surface}, "dataPoints": points})
    return {"data": blocks, "serverSpecific": {"igsdb": igsdb}} if igsdb else {"data": blocks}


ROWS = [(300, 0.1, 0.05, 0.07), (550, 0.8, 0.08, 0.12), (2500, 0.6, 0.1, 0.3)]


def written(tmp_path, content):
    path = tmp_path / "optical.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("name", ["CLEAR_3", "nfrc_2191", "nfrc_11561"])
def test_a_pane_is_that_of_the_igsdbs_own_file(real_data, tmp_path, name):
    product = read_pane_file(real_data / "bsdf" / "products_spectral" / f"{name}.json")
    pane = product.visible_pane()
    igsdb = {
        "physicalProperties": {"thickness": 1000 * product.thickness},
        "materialBulkProperties": {"conductivity": str(product.conductivity)},
        "marketingName": product.name,
    }
    visible = product.visible or (pane.transmittance, pane.reflectance_front, pane.reflectance_back)
    content = document(product.spectrum.tolist(), emissivity=product.emissivity, visible=visible, **igsdb)
    found = read_pane_file(written(tmp_path, content))
    np.testing.assert_allclose(found.spectrum, product.spectrum, rtol=1e-12)
    for field in ("name", "coated", "emissivity", "conductivity", "visible"):
        assert getattr(found, field) == getattr(product, field) or field == "visible", field
    assert found.thickness == pytest.approx(product.thickness)
    assert found.visible == pytest.approx(visible)
    np.testing.assert_allclose(
        read_spectral_pane(tmp_path / "optical.json").reflectance_back,
        read_spectral_pane(product.path).reflectance_back,
        rtol=1e-12,
    )


def test_numbers_with_uncertainty_text_and_noise_below_nothing_are_read(tmp_path):
    content = document(ROWS)
    results = content["data"][1]["dataPoints"][0]["results"]
    uncertain = {"uncertainValue": 0.06, "uncertainty": 0.001, "confidenceInterval": 95.4}
    results |= {"transmittance": "-0.003", "reflectance": uncertain}
    spectrum = read_pane_file(written(tmp_path, content)).spectrum
    np.testing.assert_allclose(spectrum[0], [300, 0, 0.06, 0.07])


def test_all_that_leaves_is_taken_and_other_angles_are_not(tmp_path):
    content = document(ROWS)
    points = content["data"][1]["dataPoints"]
    wavelengths = {"wavelength": 550}
    direct = {"transmittance": 0.79, "reflectance": 0.01}
    points.append(point(direct, wavelengths, emergence={"polar": 8}))
    points.append(point({"transmittance": 0.3, "reflectance": 0.5}, wavelengths, 60.0))
    points.append(point({"transmittance": 0.4}, wavelengths, None))
    polarized = point({"transmittance": 0.2}, wavelengths)
    polarized["incidence"]["polarization"] = {"s": 1, "p": 0}
    points.append(polarized)
    pane = read_pane_file(written(tmp_path, content))
    np.testing.assert_allclose(pane.spectrum[1], ROWS[1])
    assert pane.coated  # by its emissivity, as the file says nothing of a coating


@pytest.mark.parametrize(
    "wrapped",
    [
        lambda one: {"dataPoints": one["data"][1]["dataPoints"]},
        lambda one: {"components": [{"id": "x", "name": "Pane", "optical": [one]}]},
        lambda one: {"id": "x", "name": "Pane", "optical": [one]},
    ],
)
def test_the_older_form_and_components_are_read(tmp_path, wrapped):
    pane = read_pane_file(written(tmp_path, wrapped(document(ROWS))))
    np.testing.assert_allclose(pane.spectrum[:, :3], np.array(ROWS)[:, :3])
    assert pane.name in ("Pane", "optical")


def test_a_thickness_may_stand_beside_the_file(tmp_path):
    path = written(tmp_path, document(ROWS))
    assert read_spectral_pane(path, thickness=0.004).thickness == 0.004
    with pytest.raises(DataError, match="no thickness"):
        read_spectral_pane(path)


FIRST = ("data", 0, "dataPoints", 0)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("data",), [], "data"),
        (("data", 0), 3, "data 1.*dataPoints"),
        (("data", 0, "componentCharacteristics"), {"surface": "top"}, "data 1.*surface.*prime"),
        (("data", 0, "componentCharacteristics"), {"normalization": "relative"}, "normalization"),
        ((*FIRST, "incidence"), {"direction": {"polar": 100}}, "data point 1.*direction"),
        ((*FIRST, "incidence", "wavelengths"), {}, "data point 1.*wavelengths"),
        ((*FIRST, "emergence"), None, "data point 1.*direction"),
        ((*FIRST, "results", "transmittance"), "much", "transmittance.*much"),
        ((*FIRST, "results", "transmittance"), 80, "80 is no share"),
        (("data", 1, "dataPoints", 0, "results"), {"reflectance": 0.9, "transmittance": 0.5}, "reaches 1.4"),
        (
            ("data", 0, "dataPoints", 1, "incidence", "wavelengths"),
            {"wavelength": 300},
            "otherwise than data 1, data point 1",
        ),
        (("serverSpecific",), {"igsdb": {"physicalProperties": {"thickness": "x"}}}, "thickness"),
        (("components",), [], "components.*expected one"),
    ],
)
def test_what_is_no_pane_is_named(tmp_path, path, value, words):
    with pytest.raises(DataError, match=words) as caught:
        read_pane_file(written(tmp_path, changed(document(ROWS), *path, value=value)))
    assert "optical.json" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([point({"transmittance": 0.5}, {"wavelength": 500})], "500 nm.*reflectance"),
        ([point({"transmittance": 0.6}, {"integral": "solar"})], "near normal"),
        ([point({"transmittance": 0.6, "reflectance": 0.1}, {"wavelength": 500}, 60.0)], "near normal"),
        (
            [
                point({"transmittance": 0.6, "reflectance": 0.1}, {"wavelength": 500}),
                point({"transmittance": 0.2}, {"wavelength": 500}, emergence={"polar": 8}),
            ],
            "scatters 0.40",
        ),
    ],
)
def test_points_that_make_no_pane_are_named(tmp_path, points, words):
    with pytest.raises(DataError, match=words):
        read_pane_file(written(tmp_path, {"data": [{"dataPoints": points}]}))


def test_the_command_rates_it_as_the_same_pane_of_optics(tmp_path, capsys):
    """U, g and tau_e of a unit with a coating towards its gap, which an exchange of sides moves."""
    state = tmp_path / "unit.xml"
    block = np.diag(0.6 / KLEMS_FULL.projected_solid_angles())
    bands = dict.fromkeys(("Solar", "Visible"), KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block))
    write_bsdf_xml(BsdfFile(bands), state)
    written(tmp_path, document(ROWS, physicalProperties={"thickness": 6}))
    rows = "".join(f"{nm / 1000} {t} {f} {b}\n" for nm, t, f, b in ROWS)
    head = "{Units, Wavelength Units } SI Microns\n{Thickness } 6\n{Coated Side } Back\n"
    (tmp_path / "pane.dat").write_text(head + "{Emissivity, front back } 0.84 0.1\n" + rows)
    said = []
    for name in ("pane.dat", "optical.json"):
        layers = f'[[layers]]\npane = "{name}"\ngap = {{ width = 0.016 }}\n[[layers]]\n'
        layers += "thickness = 0.004\nemissivity = [0.84, 0.84]\nsolar = [0.8, 0.08, 0.08]\n"
        state.with_suffix(".toml").write_text(layers)
        assert cli.run(["bsdf", "thermal", str(state)]) == 0, capsys.readouterr().err
        said.append(capsys.readouterr().out)
    assert said[0] == said[1] and "EN 673" in said[0]
