"""BSDF, angular g and U through IFC files and back, exact to the number."""

from __future__ import annotations

from dataclasses import replace

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.validate
import numpy as np
import pytest
from click.testing import CliRunner

from bim.fenestration import AngularGValue, ShadingState, read_g_table
from bim.ifc.attach import attach
from bim.ifc.fenestration_read import read_states
from bim.ifc.fenestration_write import set_name
from bim.ifc.property_sets import list_of_numbers
from bim.ifc.targets import Targets
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes.commands.ifc import command
from tests.bim.small_ifc import box_room

BLOCKS = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")


def g_table() -> AngularGValue:
    return AngularGValue(np.radians([0, 31, 87]), np.radians([0, 90]), np.arange(6).reshape(3, 2) / 7)


def klems(seed: int) -> KlemsBsdf:
    """Random numbers that use all their digits; large ones too, as a clear pane has."""
    size = KLEMS_QUARTER.size
    values = np.random.default_rng(seed).random((4, size, size)) / 7
    values[0][np.diag_indices(size)] = 50 / 3
    return KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, *values)


def tree() -> TensorTreeBsdf:
    rng = np.random.default_rng(7)
    depths = np.array([1] * 7 + [2] * 8)
    return TensorTreeBsdf(
        transmission_front=TensorTree(3, depths, rng.random(15) / 3),
        reflection_back=TensorTree(3, np.array([0]), np.array([1 / 30])),
    )


@pytest.fixture(params=["IFC2X3", "IFC4", "IFC4X3"])
def path(request, tmp_path):
    path = tmp_path / "in.ifc"
    box_room(request.param).write(str(path))
    return path


def states_of(path) -> tuple[ShadingState, ...]:
    (states,) = read_states(ifcopenshell.open(str(path)), path.parent).values()
    return states


def faults(path) -> list[str]:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(path), logger)
    return sorted(str(one.get("message")) for one in logger.statements)


def test_klems_tree_g_and_u_come_back_bit_for_bit(path, tmp_path):
    out, again = tmp_path / "one.ifc", tmp_path / "two.ifc"
    g = g_table()
    bare = ShadingState("", {"Visible": klems(1), "Solar": klems(2)}, g, 1.1)
    blind = ShadingState("blind 45", {"Visible": tree()}, None, 0.1 + 0.2)
    assert attach(path, out, bare, Targets(every_window=True)) == 1
    attach(out, again, blind, Targets(every_window=True))
    first, second = states_of(again)
    assert (first.name, first.u_value, second.name, second.u_value) == ("", 1.1, "blind 45", 0.1 + 0.2)
    for band, bsdf in bare.bands.items():
        back = first.bands[band]
        assert back.basis_in == KLEMS_QUARTER and back.basis_out == KLEMS_QUARTER
        for name in BLOCKS:
            np.testing.assert_array_equal(getattr(back, name), getattr(bsdf, name))
    for name in BLOCKS:
        there, back = getattr(tree(), name), getattr(second.bands["Visible"], name)
        assert (there is None) == (back is None)
        if there is not None:
            np.testing.assert_array_equal(back.values, there.values)
            np.testing.assert_array_equal(back.depths, there.depths)
    for name in ("polar", "azimuth", "values"):
        np.testing.assert_array_equal(getattr(first.g_value, name), getattr(g, name))
    assert faults(again) == faults(path)  # nothing but what the small model lacked before


def test_state_of_the_same_name_is_replaced(path, tmp_path):
    out = tmp_path / "out.ifc"
    attach(path, out, ShadingState(u_value=1.1), Targets(every_window=True))
    attach(out, out, ShadingState(u_value=0.8), Targets(every_window=True))
    (state,) = states_of(out)
    assert state.u_value == 0.8


def test_type_passes_its_data_to_its_windows(path, tmp_path):
    out = tmp_path / "out.ifc"
    model = ifcopenshell.open(str(path))
    (window,) = model.by_type("IfcWindow")
    window.ObjectType = "fixed 3 x 1.5"
    model.write(str(path))
    assert attach(path, out, ShadingState(u_value=1.3), Targets(types=["fixed 3 x 1.5"])) == 1
    assert states_of(out)[0].u_value == 1.3


def test_bsdf_by_reference(path, tmp_path):
    out, folder = tmp_path / "out.ifc", tmp_path / "systems"
    folder.mkdir()
    file = folder / "a b.xml"
    # not a random matrix: the reader checks the conservation of energy
    tame = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, *(np.full((4, 41, 41), 0.05)))
    write_bsdf_xml(BsdfFile({"Visible": tame}, "system"), file)
    attach(path, out, ShadingState(), Targets(every_window=True), bsdf_reference=file)
    back = states_of(out)[0].bands["Visible"]
    np.testing.assert_allclose(back.transmission_front, 0.05, rtol=1e-6)  # 7 digits in the XML


def test_command_line(path, tmp_path):
    table, out = tmp_path / "g.csv", tmp_path / "out.ifc"
    table.write_text("polar_deg,g\n0,0.6\n60,0.5\n90,0\n")
    (window,) = ifcopenshell.open(str(path)).by_type("IfcWindow")
    arguments = ["attach", str(path), "--window", window.GlobalId, "--g", str(table), "--u", "1.1"]
    result = CliRunner().invoke(command, [*arguments, "-o", str(out)], catch_exceptions=False)
    assert result.exit_code == 0 and "windows and window types: 1" in result.output
    (state,) = states_of(out)
    np.testing.assert_array_equal(state.g_value.values[:, 0], [0.6, 0.5, 0.0])
    result = CliRunner().invoke(command, ["attach", str(path), "--all", "-o", str(out)])
    assert result.exit_code == 2 and "nothing to attach" in result.output


def test_wrong_targets_and_tables_are_named(path, tmp_path):
    out, state = tmp_path / "out.ifc", ShadingState(u_value=1.0)
    with pytest.raises(DataError, match="no element"):
        attach(path, out, state, Targets(windows=["nonsense"]))
    wall = ifcopenshell.open(str(path)).by_type("IfcWall")[0].GlobalId
    with pytest.raises(DataError, match="no window"):
        attach(path, out, state, Targets(windows=[wall]))
    with pytest.raises(DataError, match="no window type"):
        attach(path, out, state, Targets(types=["nonsense"]))
    assert not out.exists()
    table = tmp_path / "g.csv"
    for text, message in (
        ("polar,g\n0,1\n", "columns"),
        ("polar_deg,g\n0,x\n", "line 2"),
        ("polar_deg,g\n0,1.2\n", "out of range"),
        ("polar_deg,azimuth_deg,g\n0,0,1\n0,90,1\n30,0,1\n", "no g at polar 30, azimuth 90"),
    ):
        table.write_text(text)
        with pytest.raises(DataError, match=message):
            read_g_table(table)


def test_damaged_set_is_named(path, tmp_path):
    out = tmp_path / "out.ifc"
    attach(path, out, ShadingState(bands={"Visible": klems(1)}), Targets(every_window=True))
    model = ifcopenshell.open(str(out))
    values = next(one for one in model.by_type("IfcPropertyListValue") if one.Name == "Transmittance front values")
    values.ListValues = values.ListValues[:-1]
    with pytest.raises(DataError, match="BlackBox Model"):
        read_states(model, tmp_path)


def test_bsdf_by_library_reference(path, tmp_path):
    file = tmp_path / "system.xml"
    tame = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, *(np.full((4, 41, 41), 0.05)))
    write_bsdf_xml(BsdfFile({"Visible": tame}, "system"), file)
    model = ifcopenshell.open(str(path))
    library = model.create_entity("IfcLibraryReference", Location="system.xml", Name="BSDF")
    model.create_entity(
        "IfcRelAssociatesLibrary",
        ifcopenshell.guid.new(),
        model.by_type("IfcOwnerHistory")[0],
        RelatedObjects=model.by_type("IfcWindow"),
        RelatingLibrary=library,
    )
    out = tmp_path / "out.ifc"
    model.write(str(out))
    back = states_of(out)[0].bands["Visible"]
    np.testing.assert_allclose(back.transmission_front, 0.05, rtol=1e-6)  # 7 digits in the XML
    assert faults(out) == faults(path)


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4", "IFC4X3"])
def test_every_number_comes_back_bit_for_bit(schema):
    numbers = [0.0, -0.0, 1e-5, -2.5e-9, 1 / 3, 123456789.0, 1e22, 1.7e308, 5e-324]
    model = ifcopenshell.file(schema=schema)
    listed = list_of_numbers(model, "the pane's, \xe9", "IfcReal", numbers)
    whole = list_of_numbers(model, "depths", "IfcInteger", [0, -3, 2**31 - 1])
    again = ifcopenshell.file.from_string(model.to_string())
    for made in (listed, again.by_id(listed.id())):
        assert made.Name == "the pane's, \xe9" and made.Unit is None
        assert [repr(one.wrappedValue) for one in made.ListValues] == [repr(n) for n in numbers]
    assert [one.wrappedValue for one in again.by_id(whole.id()).ListValues] == [0, -3, 2**31 - 1]


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize(
    "name", ["klems_full/fener_649_VS413001b_klems.xml", "tensortree/pyradiance_room_blindsT3.xml"]
)
def test_real_bsdf_files_come_back_bit_for_bit(real_data, tmp_path, schema, name):
    path, out = tmp_path / "in.ifc", tmp_path / "out.ifc"
    box_room(schema).write(str(path))
    bands = read_bsdf_xml(real_data / "bsdf" / name).bands
    attach(path, out, ShadingState("", bands), Targets(every_window=True))
    (state,) = states_of(out)
    assert state.bands.keys() == bands.keys()
    for band, bsdf in bands.items():
        for block in BLOCKS:
            there, back = getattr(bsdf, block), getattr(state.bands[band], block)
            assert (there is None) == (back is None)
            if isinstance(there, TensorTree):
                np.testing.assert_array_equal(back.values, there.values)
                np.testing.assert_array_equal(back.depths, there.depths)
            elif there is not None:
                np.testing.assert_array_equal(back, there)


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_the_same_command_gives_the_same_bytes(tmp_path, schema):
    """Identifiers of what is attached depend on the model and the state, not on chance."""
    path, again = tmp_path / "box.ifc", tmp_path / "again.ifc"
    box_room(schema).write(str(path))
    state = ShadingState("", u_value=1.1, g_normal=0.5)
    texts = []
    for name in ("a.ifc", "b.ifc"):
        attach(path, tmp_path / name, state, Targets(every_window=True), bsdf_reference="blind.xml")
        texts.append((tmp_path / name).read_bytes())
    assert texts[0] == texts[1]
    attach(tmp_path / "a.ifc", again, state, Targets(every_window=True), bsdf_reference="blind.xml")
    assert again.read_bytes() == texts[0]  # attached twice: nothing is left of the first time
    other = replace(state, name="blind", g_value=g_table(), bands={"Visible": klems(1)})
    attach(again, again, other, Targets(every_window=True))
    whole = again.read_bytes()
    attach(again, again, other, Targets(every_window=True))
    assert again.read_bytes() == whole
    attach(again, again, replace(other, name="up"), Targets(every_window=True))
    model = ifcopenshell.open(again)
    guids = [one.GlobalId for one in model.by_type("IfcRoot")]
    assert len(set(guids)) == len(guids)
    names = {one.Name for one in model.by_type("IfcPropertySet")}
    assert names >= {set_name(name) for name in ("", "blind", "up")}


def test_a_state_of_a_type_is_replaced_without_a_trace(tmp_path):
    """Its set is taken off the type alone; a window that shares it with others has its own."""
    path, out = tmp_path / "box.ifc", tmp_path / "out.ifc"
    box_room("IFC4").write(str(path))
    model = ifcopenshell.open(str(path))
    (window,) = model.by_type("IfcWindow")
    guid = ifcopenshell.guid.new()
    kind = model.create_entity(
        "IfcWindowType", guid, Name="fixed", PredefinedType="WINDOW", PartitioningType="SINGLE_PANEL"
    )
    relation = ifcopenshell.guid.new()
    model.create_entity("IfcRelDefinesByType", relation, RelatedObjects=[window], RelatingType=kind)
    model.write(str(path))
    state = ShadingState("", u_value=1.1, g_normal=0.5)
    attach(path, out, state, Targets(types=["fixed"]))
    once = out.read_bytes()
    attach(out, out, state, Targets(types=["fixed"]))
    assert out.read_bytes() == once
    attach(out, out, replace(state, u_value=0.8), Targets(types=["fixed"]))
    (there,) = ifcopenshell.open(str(out)).by_guid(guid).HasPropertySets
    assert there.Name == "BlackBox Model"
    assert len(ifcopenshell.open(str(out)).by_type("IfcPropertySet")) == 1
