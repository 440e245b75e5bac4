"""IGSDB's shades: sizes, round threads by their closed form, blinds by WINDOW's engine."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from mitsuba_cfs.bsdf import generate
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.screens import thread_screen
from mitsuba_cfs.bsdf.shade_file import read_shade_file
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes import cli
from tests.bim.bim_fuzz import changed, mutations, odd_values
from tests.bsdf.test_generate import Centres

SPECTRUM = [{"wavelength": w, "T": 0.0, "Rf": 0.2, "Rb": 0.8} for w in (0.3, 0.55, 0.8, 2.5)]
SIZES = {
    "venetian": {"slat_width": 16.0, "slat_spacing": 12.0, "slat_tilt": 30.0, "slat_curvature": 0},
    "woven": {"thread_diameter": 0.4, "thread_spacing": 1.0, "shade_thickness": 0.8},
    "perforated-screen": {"dimension_x": 0.25, "spacing_x": 1.0, "spacing_y": 1.0, "perforation_type": "Circular"},
}


def product(kind):
    """An IGSDB product as the database's version 2 writes shades."""
    material = {
        "name": "Sheet",
        "type": "material",
        "measured_data": {
            "thickness": 0.2,
            "conductivity": 160.0,
            "emissivity_front": 0.9,
            "emissivity_back": 0.8,
            "tir_front": 0.0,
            "is_specular": True,
        },
        "spectral_data": {"spectral_data": copy.deepcopy(SPECTRUM)},
        "integrated_results_summary": [{"calculation_standard_name": "NFRC"}],
    }
    part = {"child_product": material, "extra_data": {"geometry": dict(SIZES[kind])}}
    return {
        "name": "Shade",
        "manufacturer_name": "Maker",
        "type": "shading",
        "subtype": kind,
        "measured_data": {"is_specular": False},
        "composition": [part],
    }


def written(tmp_path, content):
    path = tmp_path / "shade.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("kind", "openness", "table"),
    [
        ("venetian", 0, "slats = { width = 0.016, spacing = 0.012, tilt_deg = 30 }"),
        ("woven", 0.36, "threads = { diameter = 0.0004, spacing = 0.001 }"),
        ("perforated-screen", np.pi / 16, "holes = { diameter = 0.0005, spacing = 0.001 }"),
    ],
)
def test_sizes_are_metres_and_sides_are_kept_apart(tmp_path, kind, openness, table):
    shade = read_shade_file(written(tmp_path, product(kind)))
    assert shade.openness == pytest.approx(openness)
    said = shade.thermal_layer()
    assert table in said and "emissivity = [0.9, 0.8], conductivity = 160" in said
    (sheet,) = shade.layer().materials
    assert sheet.reflectance_front == pytest.approx((0.2, 0.2))
    assert sheet.reflectance_back == pytest.approx((0.8, 0.8))


def test_square_holes_are_sides_of_squares(tmp_path):
    content = product("perforated-screen")
    content["composition"][0]["extra_data"]["geometry"]["perforation_type"] = "Square"
    shade = read_shade_file(written(tmp_path, content))
    assert shade.openness == pytest.approx(1 / 16)
    assert "openness = 0.0625" in shade.thermal_layer()


def test_black_round_threads_pass_what_lies_between_them(variant):
    diameter, spacing = 0.4e-3, 1e-3
    layer = thread_screen(plastic("black", 0.0), diameter=diameter, spacing=spacing)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=8192, seed=3).bsdf[0]
    axis = (np.arange(32) + 0.5) / 32
    u, v = (part.ravel() for part in np.meshgrid(axis, axis))
    theta, phi = KLEMS_QUARTER.angles_within(np.arange(41)[:, None], u, v)
    slopes = np.tan(theta) * np.array([np.cos(phi), np.sin(phi)])
    shadows = diameter / spacing * np.sqrt(1 + slopes**2)
    expected = np.maximum(1 - shadows, 0).prod(axis=0).mean(axis=1)
    found = bsdf.direct_hemispherical(bsdf.transmission_front)
    np.testing.assert_allclose(found, expected, atol=0.017)  # 3 sigma of 8192 random paths


def test_each_side_of_round_threads_shows_its_own_colour(variant, tmp_path):
    layer = read_shade_file(written(tmp_path, product("woven"))).layer()
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=8192, seed=3).bsdf[0]
    front, back = (bsdf.direct_hemispherical(block)[0] for block in (bsdf.reflection_front, bsdf.reflection_back))
    # 0.64 of the light meets a thread; of a white one's 0.8 some goes on into the room
    assert 0.07 < front < 0.64 * 0.2 and 0.30 < back < 0.64 * 0.8


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "change", "worst", "rms"),
    [
        ("venetian_blind_CGDB_22034.json", {}, 0.005, 0.002),  # dark
        ("cgdb_3001.json", {}, 0.03, 0.015),  # white, 0.75
        # the sides of its slats of unlike colours
        ("cgdb_3001.json", {"Rf": 0.2, "Rb": 0.8}, 0.03, 0.015),
    ],
)
def test_blinds_are_those_of_windows_engine(variant, real_data, tmp_path, name, change, worst, rms):
    """Curved slats at 45 degrees.  The engine shares out diffuse light evenly over five strips of a
    slat (1 % at a reflectance of 0.1 and 0.2, see test_generate); more light, more of that."""
    pywincalc = pytest.importorskip("pywincalc")
    from mitsuba_cfs.bsdf.generate import TracedLayer
    from mitsuba_cfs.bsdf.traced_klems import TracedBasis

    content = json.loads((real_data / "bsdf" / "products_spectral" / name).read_text())
    material = content["composition"][0]["child_product"]
    if change:
        for row in material["spectral_data"]["spectral_data"]:
            row |= change
        material["integrated_results_summary"] = [{"calculation_standard_name": "NFRC"}]
    path = written(tmp_path, content)
    system = pywincalc.GlazingSystem(
        optical_standard=pywincalc.load_standard(str(pywincalc.standard_path / "W5_NFRC_2003.std")),
        solid_layers=[pywincalc.parse_json_file(str(path))],
        bsdf_hemisphere=pywincalc.BSDFHemisphere.create(pywincalc.BSDFBasisType.QUARTER),
    )
    engine = system.optical_method_results("PHOTOPIC").system_results
    sums, paths = generate.trace_bins(
        TracedLayer(read_shade_file(path).layer()),
        Centres(KLEMS_QUARTER),
        41,
        TracedBasis(KLEMS_QUARTER),
        41,
        rows=1,
        samples=16_384,
        seed=1,
    )
    shares = sums[0][0].sum(axis=-1) / paths  # [side in, patch in, side out]
    area = KLEMS_QUARTER.projected_solid_angles()
    pairs = {
        "Tf": (shares[0, :, 1], engine.front.transmittance),
        "Rf": (shares[0, :, 0], engine.front.reflectance),
        "Tb": (shares[1, :, 0], engine.back.transmittance),
        "Rb": (shares[1, :, 1], engine.back.reflectance),
    }
    for block, (ours, theirs) in pairs.items():
        off = ours - area @ np.array(theirs.matrix)
        assert np.abs(off).max() < worst, block
        assert np.sqrt((off**2).mean()) < rms, block


GEOMETRY = ("composition", 0, "extra_data", "geometry")


@pytest.mark.parametrize(
    ("kind", "path", "value", "words"),
    [
        ("venetian", ("type",), "glazing", "subtype.*expected shading"),
        ("venetian", ("subtype",), "cellular", "subtype.*cellular"),
        ("venetian", ("composition",), [], "composition"),
        ("venetian", ("composition", 0, "child_product"), 3, "child_product"),
        ("venetian", GEOMETRY, None, "geometry"),
        ("venetian", (*GEOMETRY, "slat_width"), "wide", "slat_width.*wide"),
        ("venetian", (*GEOMETRY, "slat_tilt"), 100, "slat_tilt.*100"),
        ("venetian", (*GEOMETRY, "slat_curvature"), 5, "radius"),
        ("woven", (*GEOMETRY, "thread_diameter"), 2.0, "diameter"),
        ("woven", (*GEOMETRY, "thread_spacing"), 0, "thread_spacing"),
        ("perforated-screen", (*GEOMETRY, "spacing_y"), 2.0, "no square grid"),
        ("perforated-screen", (*GEOMETRY, "dimension_x"), 0.6, "openness"),
        ("perforated-screen", (*GEOMETRY, "perforation_type"), "Hexagonal", "hexagonal"),
        ("venetian", ("composition", 0, "child_product", "spectral_data"), None, "spectral_data"),
    ],
)
def test_what_is_no_shade_is_named(tmp_path, kind, path, value, words):
    with pytest.raises(DataError, match=words) as caught:
        read_shade_file(written(tmp_path, changed(product(kind), *path, value=value))).layer()
    assert "shade.json" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", SIZES)
def test_a_spoilt_shade_is_read_or_refused(tmp_path, kind):
    path, content, refused = tmp_path / "shade.json", product(kind), 0
    texts = [json.dumps(one).encode() for one in odd_values(content, 150)]
    for text in (*texts, *mutations(json.dumps(content).encode(), 100)):
        path.write_bytes(text)
        try:
            shade = read_shade_file(path)
            shade.layer()
            shade.thermal_layer()
        except DataError as error:
            refused += 1
            assert "shade.json" in str(error) and "\n" not in str(error)
    assert refused > 20


def test_the_command_traces_it_and_says_its_layer(variant, tmp_path, capsys):
    path, out = written(tmp_path, product("venetian")), tmp_path / "out.xml"
    words = ["bsdf", "generate", "--shape", "product", "--basis", "quarter", "--paths", "256"]
    assert cli.run([*words, "--product", str(path), "--out", str(out)]) == 0
    assert "slats = { width = 0.016" in capsys.readouterr().out
    file = read_bsdf_xml(out)
    assert (file.name, file.manufacturer) == ("Shade", "Maker")
    assert cli.run([*words, "--out", str(out)]) != 0
    assert "needs --product" in capsys.readouterr().err
    words[3] = "venetian"
    assert cli.run([*words, "--product", str(path), "--out", str(out)]) != 0
    assert "belongs to --shape product" in capsys.readouterr().err
