"""Reading and writing BSDF XML: round trips, and one clear line for every broken file."""

from __future__ import annotations

import re

import numpy as np
import pytest
from test_tensor_tree import random_tree

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError


@pytest.fixture
def system() -> BsdfFile:
    """A small asymmetric system in two bands."""
    generator = np.random.default_rng(1)
    blocks = generator.uniform(0, 0.1, (8, 41, 41))
    names = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
    bands = {
        band: KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, **dict(zip(names, values, strict=True)))
        for band, values in (("Visible", blocks[:4]), ("Solar", blocks[4:]))
    }
    return BsdfFile(bands, name="blind & glass", thickness=0.024, emissivity_front=0.84)


@pytest.fixture
def text(system, tmp_path) -> str:
    write_bsdf_xml(system, tmp_path / "system.xml")
    return (tmp_path / "system.xml").read_text()


def write(tmp_path, text: str):
    path = tmp_path / "broken.xml"
    path.write_text(text)
    return path


def test_what_is_written_is_read(system, tmp_path):
    write_bsdf_xml(system, tmp_path / "system.xml", digits=17)
    again = read_bsdf_xml(tmp_path / "system.xml")
    assert (again.name, again.thickness, again.emissivity_front) == ("blind & glass", 0.024, 0.84)
    for band, bsdf in system.bands.items():
        assert again.band(band).basis_in == KLEMS_QUARTER
        for name, block in bsdf.blocks().items():
            np.testing.assert_array_equal(getattr(again.band(band), name), block)


def test_custom_basis_and_rows(tmp_path):
    basis_in = KlemsBasis("in", (0.0, 0.5, np.pi / 2), (1, 4))
    basis_out = KlemsBasis("out", (0.0, 0.7, np.pi / 2), (1, 6))
    block = np.arange(35.0).reshape(7, 5) / 200
    system = BsdfFile({"Visible": KlemsBsdf(basis_in, basis_out, reflection_front=block)})
    write_bsdf_xml(system, tmp_path / "columns.xml")
    columns = read_bsdf_xml(tmp_path / "columns.xml").band("Visible")
    np.testing.assert_allclose(columns.reflection_front, block)
    assert columns.basis_out.phi_counts == (1, 6)
    text = (tmp_path / "columns.xml").read_text().replace(">Columns<", ">Rows<")
    rows = read_bsdf_xml(write(tmp_path, text)).band("Visible")
    np.testing.assert_allclose(rows.reflection_front, block.reshape(5, 7).T)


def test_every_real_file_survives_a_round_trip(real_data, tmp_path):
    for path in sorted((real_data / "bsdf").glob("*/*.xml")):
        if path.name == "radiance_testBSDF.xml":
            continue
        file = read_bsdf_xml(path)
        write_bsdf_xml(file, tmp_path / path.name)
        again = read_bsdf_xml(tmp_path / path.name)
        for band, bsdf in file.bands.items():
            for name, block in bsdf.blocks().items():
                copy = getattr(again.band(band), name)
                if isinstance(block, TensorTree):
                    np.testing.assert_array_equal(copy.depths, block.depths)
                    block, copy = block.values, copy.values
                np.testing.assert_allclose(copy, block, rtol=1e-6, err_msg=f"{path} {name}")


def test_negative_values_are_zero_and_noted(text, tmp_path):
    first = text.index("<ScatteringData>") + len("<ScatteringData>")
    file = read_bsdf_xml(write(tmp_path, text[:first] + "-0.01, " + drop_first(text[first:])))
    assert file.band("Visible").transmission_front.min() == 0
    assert "negative" in file.notes[0]


def test_the_placeholder_that_genbsdf_writes_is_no_name(text, tmp_path):
    """Its template has <Name>Name</Name>; the file's own name is shown then."""
    file = read_bsdf_xml(write(tmp_path, text.replace("blind &amp; glass", "Name")))
    assert file.name == ""


def drop_first(numbers: str) -> str:
    return numbers.split(",", 1)[1]


def test_text_before_the_xml_is_left_out(text, tmp_path):
    assert "before" in read_bsdf_xml(write(tmp_path, "Recover using\n" + text)).notes[0]


BROKEN = {
    "truncated": (lambda t: t[: len(t) // 2], "well-formed"),
    "not XML": (lambda t: "hello", "well-formed"),
    "empty": (lambda t: "", "well-formed"),
    "other root": (lambda t: "<a/>", "WindowElement"),
    "no layer": (lambda t: t.replace("Layer>", "Lager>"), "Optical/Layer"),
    "one value more": (lambda t: t.replace("<ScatteringData>", "<ScatteringData>1,", 1), "1682"),
    "wrong basis": (lambda t: t.replace("LBNL/Klems Quarter</Col", "LBNL/Klems Full</Col"), "145"),
    "unknown basis": (lambda t: t.replace("LBNL/Klems Quarter</Row", "mine</Row"), "mine"),
    "not finite": (lambda t: t.replace("<ScatteringData>", "<ScatteringData>nan, ", 1), "not finite"),
    "not a number": (lambda t: t.replace("<ScatteringData>", "<ScatteringData>1, x7, ", 1), "not a number: 'x7'"),
    "gains energy": (lambda t: t.replace("<ScatteringData>\n0", "<ScatteringData>\n1000", 1), "scatters"),
    "structure": (lambda t: t.replace(">Columns<", ">Heaps<"), "Heaps"),
    "no basis": (lambda t: t.replace("ColumnAngleBasis", "Kolumn"), "ColumnAngleBasis"),
    "unit": (lambda t: t.replace('unit="meter"', 'unit="ell"'), "ell"),
    "bounds": (lambda t: t.replace("<UpperTheta>27<", "<UpperTheta>99<"), "theta bounds"),
    "bounds off by little": (lambda t: t.replace("<UpperTheta>27<", "<UpperTheta>27.01<"), "theta bounds disagree"),
    "no data": (lambda t: t.replace("WavelengthDataBlock", "Block"), "no scattering data"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_gives_one_clear_line(text, tmp_path, name):
    breaking, expected = BROKEN[name]
    with pytest.raises(DataError, match=expected) as caught:
        read_bsdf_xml(write(tmp_path, breaking(text)))
    assert "broken.xml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_gives_one_clear_line(tmp_path):
    with pytest.raises(DataError, match="No such file"):
        read_bsdf_xml(tmp_path / "nowhere.xml")


def test_energy_names_direction_and_amount(real_data):
    with pytest.raises(DataError, match=r"Visible: reflection back: incident direction .* %"):
        read_bsdf_xml(real_data / "bsdf/tensortree/radiance_testBSDF.xml")


@pytest.fixture
def tree_text(tmp_path) -> str:
    tree = random_tree(4, seed=1, depth=2)
    write_bsdf_xml(BsdfFile({"Visible": TensorTreeBsdf(tree, tree)}), tmp_path / "tree.xml")
    return (tmp_path / "tree.xml").read_text()


@pytest.mark.parametrize("kind", ["matrix", "tree"])
@pytest.mark.parametrize("seed", range(120))
def test_mutated_files_never_crash(text, tree_text, tmp_path, seed, kind):
    """Random bytes changed, cut out or doubled: either a file or a `DataError`."""
    generator = np.random.default_rng(seed)
    data = bytearray((text if kind == "matrix" else tree_text).encode())
    for _ in range(generator.integers(1, 6)):
        start = int(generator.integers(0, len(data)))
        length = int(generator.integers(1, 200))
        change = generator.integers(0, 3)
        if change == 0:
            data[start : start + length] = generator.bytes(length)
        elif change == 1:
            del data[start : start + length]
        else:
            data[start:start] = data[start : start + length]
    path = tmp_path / "mutated.xml"
    path.write_bytes(bytes(data))
    try:
        read_bsdf_xml(path)
    except DataError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_are_refused(text, tmp_path, encoding):
    """Ten of ten of ten: a file of a kilobyte fills the memory."""
    start = text.index("<WindowElement")
    bomb = '<!DOCTYPE WindowElement [<!ENTITY a "0.1 0.1"><!ENTITY b "&a;&a;">]>'
    path = tmp_path / "bomb.xml"
    path.write_bytes((f'<?xml version="1.0" encoding="{encoding}"?>{bomb}' + text[start:]).encode(encoding))
    with pytest.raises(DataError, match="declares entities"):
        read_bsdf_xml(path)


@pytest.mark.parametrize(
    ("unit", "metres"), [("meter", 1.0), ("foot", 0.3048), ("inch", 0.0254), ("centimeter", 0.01), ("millimeter", 1e-3)]
)
def test_lengths_are_metres(text, tmp_path, unit, metres):
    changed = text.replace('<Thickness unit="meter">0.024<', f'<Thickness unit="{unit}">0.5<')
    assert changed != text
    assert read_bsdf_xml(write(tmp_path, changed)).thickness == pytest.approx(0.5 * metres)


@pytest.mark.parametrize(
    ("field", "value", "message"), [("Thickness", -0.5, "of at least 0"), ("EmissivityFront", 8.4, "from 0 to 1")]
)
def test_a_number_beyond_its_bounds_is_refused_with_them(text, tmp_path, field, value, message):
    changed = re.sub(f"(<{field}[^>]*>)[^<]*<", rf"\g<1>{value}<", text)
    assert changed != text
    with pytest.raises(DataError, match=f"{field}: expected a number {message}, got {value:g}"):
        read_bsdf_xml(write(tmp_path, changed))


@pytest.mark.parametrize(
    ("element", "expected"), [("", "Other"), ("<DeviceType/>", "Other"), ("<DeviceType>Shade</DeviceType>", "Shade")]
)
def test_the_type_of_a_device_is_other_where_none_is_stated(text, tmp_path, element, expected):
    changed = re.sub("<DeviceType>[^<]*</DeviceType>", element, text)
    assert changed != text or element
    assert read_bsdf_xml(write(tmp_path, changed)).device_type == expected


def test_a_ring_around_the_normal_of_several_patches_has_its_own_middle(tmp_path):
    """Only a single patch lies at 0 degrees; the middle of other rings is that of their bounds."""
    basis = KlemsBasis("four in the middle", (0.0, np.pi / 6, np.pi / 2), (4, 2))
    block = np.zeros((6, 6))
    file = tmp_path / "b.xml"
    write_bsdf_xml(BsdfFile({"Visible": KlemsBsdf(basis, basis, block, block, block, block)}), file)
    assert re.findall("<Theta>(.*?)</Theta>", file.read_text()) == ["15", "60"]


@pytest.mark.parametrize(
    ("basis", "middles"),
    [
        (KLEMS_FULL, "0 10 20 30 40 50 60 70 82.5"),
        (KLEMS_HALF, "0 13 26 39 52 65 80.75"),
        (KLEMS_QUARTER, "0 18 36 54 76.5"),
    ],
)
def test_rings_have_the_middles_of_windows_engine(basis, middles, tmp_path):
    """Source: LBNL, Windows-CalcEngine, `BSDFHemisphere`."""
    file = tmp_path / "a.xml"
    zero = np.zeros((basis.size, basis.size))
    write_bsdf_xml(BsdfFile({"Visible": KlemsBsdf(basis, basis, transmission_front=zero)}), file)
    assert re.findall("<Theta>(.*?)</Theta>", file.read_text()) == middles.split()


def test_a_file_of_one_byte_too_many_is_refused(text, tmp_path, monkeypatch):
    file = tmp_path / "a.xml"
    file.write_text(text)
    monkeypatch.setattr("mitsuba_cfs.bsdf.xml.MOST_BYTES", len(text))
    assert read_bsdf_xml(file).bands
    monkeypatch.setattr("mitsuba_cfs.bsdf.xml.MOST_BYTES", len(text) - 1)
    with pytest.raises(DataError, match="is too big"):
        read_bsdf_xml(file)
