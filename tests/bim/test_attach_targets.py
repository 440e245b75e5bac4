"""Windows chosen by room, facade, storey and type; what is not there lists what is."""

from __future__ import annotations

import ifcopenshell
import pytest

from bim.fenestration import ShadingState
from bim.ifc.attach import attach
from bim.ifc.building import read_ifc
from bim.ifc.fenestration_read import read_fenestration
from bim.ifc.targets import Targets
from mitsuba_cfs.errors import DataError
from scenes import cli
from scenes.demo import OFFICE
from tests.bim.small_ifc import box_room


@pytest.fixture(scope="module")
def office():
    """The windows of the demo's rooms, by room."""
    building = read_ifc(OFFICE)
    return {space.name: {w.guid for w in space.windows} for space in building.spaces}


def got(tmp_path, **chosen) -> set[str]:
    out = tmp_path / "out.ifc"
    attach(OFFICE, out, ShadingState(u_value=1.1), Targets(**chosen))
    return set(read_fenestration(out))


def test_the_windows_of_a_room_by_any_of_its_names(tmp_path, office):
    assert office["A"] and office["B"] and not office["A"] & office["B"]
    for name in ("A", "South office", "a south office"):
        assert got(tmp_path, rooms=[name]) == office["A"]
    assert got(tmp_path, rooms=["A", "East office"]) == office["A"] | office["B"]


def test_a_storey_has_the_windows_of_its_rooms(tmp_path, office):
    (storey,) = {space.storey for space in read_ifc(OFFICE).spaces}
    assert got(tmp_path, storeys=[storey.upper()]) == office["A"] | office["B"]


def small(tmp_path, north: tuple[float, float]):
    path = tmp_path / "room.ifc"
    box_room(true_north=north).write(str(path))
    return path


@pytest.mark.parametrize(
    ("facade", "there"),
    [
        ("S", True),
        ("s", True),
        ("N", False),
        ("E", False),
        ("W", False),
        ("SE", False),
        ("170-190", True),
        ("180-181", True),
        ("181-180", True),
        ("181-179", False),
        ("0-360", True),
        ("roof", False),
    ],
)
def test_a_facade_is_a_sector_of_azimuths(tmp_path, facade, there):
    path, out = small(tmp_path, (0.0, 1.0)), tmp_path / "out.ifc"
    if there:
        assert attach(path, out, ShadingState(u_value=1.1), Targets(facades=[facade])) == 1
    else:
        with pytest.raises(DataError, match="no window is in all of these places"):
            attach(path, out, ShadingState(u_value=1.1), Targets(facades=[facade]))


def test_a_facade_is_that_of_the_world_not_of_the_model(tmp_path):
    """North of the model's +x: the wall that is drawn to the south faces east or west."""
    path, out = small(tmp_path, (1.0, 0.0)), tmp_path / "out.ifc"
    (window,) = read_ifc(path).windows
    facing = "E" if window.normal[0] > 0 else "W"
    assert abs(window.normal[0]) > 0.99
    assert attach(path, out, ShadingState(u_value=1.1), Targets(facades=[facing])) == 1


def test_places_narrow_each_other(tmp_path, office):
    with pytest.raises(DataError, match="no window is in all of these places"):
        got(tmp_path, rooms=["A"], facades=["roof"])
    one = sorted(office["A"])[0]
    assert got(tmp_path, rooms=["B"], windows=[one]) == office["B"] | {one}


def test_a_type_in_a_room(tmp_path):
    path, out = small(tmp_path, (0.0, 1.0)), tmp_path / "out.ifc"
    model = ifcopenshell.open(str(path))
    model.by_type("IfcWindow")[0].ObjectType = "Fixed A"
    model.write(str(path))
    state = ShadingState(u_value=1.1)
    assert attach(path, out, state, Targets(types=["Fixed A"], rooms=["Room"])) == 1


@pytest.mark.parametrize(
    ("option", "name", "message"),
    [
        ("--type", "Fixed B", "no window type 'Fixed B'; there are: Fixed A"),
        ("--space", "Rum", "no room 'Rum'; there are: R1 Room"),
        ("--storey", "EG", "no storey 'EG' with rooms; there are: IfcBuildingStorey"),
        ("--facade", "up", "windows face: S"),
        ("--facade", "400-20", "windows face: S"),
    ],
)
def test_what_is_not_there_lists_what_is(tmp_path, capsys, option, name, message):
    path, out = small(tmp_path, (0.0, 1.0)), tmp_path / "out.ifc"
    model = ifcopenshell.open(str(path))
    model.by_type("IfcWindow")[0].ObjectType = "Fixed A"
    model.write(str(path))
    call = ["ifc", "attach", str(path), option, name, "--u", "1.1", "-o", str(out)]
    assert cli.run(call) == 1
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_values_without_a_bsdf_name_what_light_needs(tmp_path, capsys):
    path, out = small(tmp_path, (0.0, 1.0)), tmp_path / "out.ifc"
    assert cli.run(["ifc", "attach", str(path), "--all", "--g", "0.5", "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "no BSDF: light is computed if" in printed and "--tau or --glazing" in printed
    assert "no U: a typical one" in printed
