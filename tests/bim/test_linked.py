"""Several IFC files of one building: a building cut in three gives the results of the whole."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable
from pathlib import Path

import ifcopenshell
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.georeference
import ifcopenshell.util.unit
import numpy as np
import pytest

from bim.building_file import building_files
from bim.ifc.building import read_ifc
from bim.ifc.linked import move
from bim.ifc.project import length_scale
from bim.model import Building
from mitsuba_cfs.errors import DataError
from tests.bim.small_ifc import HEIGHT, WALL, WIDTH, box_model

FACADE = ("IfcWindow", "IfcDoor", "IfcCurtainWall", "IfcPlate", "IfcMember")
REST = ("IfcWall", "IfcSpace")  # what stays with the architect; else it is structure and site


def part_of(element: ifcopenshell.entity_instance) -> int:
    """0: architecture, 1: facade, 2: structure and site."""
    if element.is_a().startswith(FACADE):
        return 1
    return 0 if element.is_a().startswith(REST) else 2


def in_part(element: ifcopenshell.entity_instance, part: int) -> bool:
    """Whether a part has an element; an opening is with its host and with what fills it."""
    if not element.is_a("IfcOpeningElement"):
        return part_of(element) == part
    hosts = [r.RelatingBuildingElement for r in element.VoidsElements]
    filled = [r.RelatedBuildingElement for r in element.HasFillings]
    return any(part_of(one) == part for one in (*hosts, *filled))


def cut(path: Path, part: int) -> ifcopenshell.file:
    """One of three parts of a building."""
    model = ifcopenshell.open(str(path))
    drawn = [*model.by_type("IfcElement"), *model.by_type("IfcSpace")]
    gone = {one.id() for one in drawn if not in_part(one, part)}
    for relation in model.by_type("IfcRelationship"):
        for key, value in relation.get_info(recursive=False).items():
            ends = value if isinstance(value, tuple) else (value,)
            ends = [one for one in ends if isinstance(one, ifcopenshell.entity_instance)]
            rest = [one for one in ends if one.id() not in gone]
            if key.startswith("Relat") and ends and not rest:
                model.remove(relation)
                break
            if key.startswith("Relat") and len(rest) < len(ends):
                setattr(relation, key, rest)
    for step_id in gone:
        model.remove(model.by_id(step_id))
    return model


def write_parts(
    path: Path, folder: Path, changes: Callable[[ifcopenshell.file], None] = lambda model: None
) -> list[Path]:
    """The three parts of a building as files; `changes` are made to the second and third."""
    files = []
    for part, name in enumerate(("arch", "facade", "site")):
        model = cut(path, part)
        if part:
            changes(model)
        files.append(folder / f"{name}.ifc")
        model.write(str(files[-1]))
    return files


def figures(building: Building) -> list[tuple]:
    """What a room is: volume, area, its faces by kind and what is beyond, glass by window."""
    return sorted(
        (
            space.guid,
            space.storey,
            round(space.volume, 4),
            round(space.floor_area, 4),
            sorted(
                (f.kind, f.adjacency, round(f.area, 4), f.construction.name, round(f.construction.resistance, 4))
                for f in space.faces
            ),
            sorted((w.guid, round(w.area, 4), w.u_value) for w in space.windows),
        )
        for space in building.spaces
    )


def read(files: list[Path]) -> Building:
    return read_ifc(files[0], linked=files[1:])


def placed_by(building: Building) -> list[str]:
    return [i.values["by"].key for i in building.issues if i.code == "file-linked"]


def shift(model: ifcopenshell.file, *, east: float = 40.0, turn_deg: float = 30.0) -> None:
    """Other axes: the elements are turned and moved."""
    angle = math.radians(turn_deg)
    matrix = np.eye(4)
    matrix[:2, :2] = (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
    matrix[:3, 3] = east, -7.0, 1.5
    move(model, matrix, length_scale(model))


def on_map(model: ifcopenshell.file, east: float, north: float, height: float, turn: float) -> None:
    """A map conversion."""
    ifcopenshell.api.georeference.add_georeferencing(model)
    unit = 1.0  # the map is in metres, as the model
    x, y = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    ifcopenshell.api.georeference.edit_georeferencing(
        model,
        projected_crs={"Name": "EPSG:25832"},
        coordinate_operation={
            "Eastings": east * unit,
            "Northings": north,
            "OrthogonalHeight": height,
            "XAxisAbscissa": x,
            "XAxisOrdinate": y,
        },
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """A house of two storeys with a window on each and a space on the lower one."""
    path = tmp_path_factory.mktemp("whole") / "whole.ifc"
    model = box_model(upper=True, post=True, true_north=None)[0].model
    ifcopenshell.api.geometry.edit_object_placement(model, product=model.by_type("IfcSite")[0])
    model.write(str(path))
    return path


@pytest.fixture(scope="module")
def whole(file) -> Building:
    return read_ifc(file)


def test_a_building_cut_in_three_is_the_whole(tmp_path, file, whole) -> None:
    parts = read(write_parts(file, tmp_path))
    assert figures(parts) == figures(whole)
    assert placed_by(parts) == ["linked-by-site"] * 2
    assert not [i for i in parts.issues if i.code in ("guid-repeated", "file-apart")]
    alone = read_ifc(tmp_path / "arch.ifc")
    assert figures(alone) != figures(whole)


def test_units_of_the_first_file_hold(tmp_path, file, whole) -> None:
    files = write_parts(file, tmp_path)
    for path in files[1:]:  # ifcopenshell's own conversion is the judge
        model = ifcopenshell.open(str(path))
        ifcopenshell.util.unit.convert_file_length_units(model, "MILLIMETRE").write(str(path))
        assert length_scale(ifcopenshell.open(str(path))) == pytest.approx(0.001)
    assert figures(read(files)) == figures(whole)


def test_other_axes_are_placed_by_the_map(tmp_path, file, whole) -> None:
    """The turned and moved parts have the inverse of that in their map conversion."""

    def changed(model: ifcopenshell.file) -> None:
        shift(model, turn_deg=-25.0)
        # model = R(-25) first + (40, -7, 1.5): map = (1000, 2000, 100) + R(35) (model - ...)
        back = np.radians(35.0)
        turn = np.array([[np.cos(back), -np.sin(back)], [np.sin(back), np.cos(back)]])
        east, north = np.array([1000.0, 2000.0]) - turn @ (40.0, -7.0)
        on_map(model, east, north, 100.0 - 1.5, 35.0)

    files = write_parts(file, tmp_path, changed)
    first = ifcopenshell.open(str(files[0]))
    on_map(first, 1000.0, 2000.0, 100.0, 10.0)
    first.write(str(files[0]))
    parts = read(files)
    assert placed_by(parts) == ["linked-by-map"] * 2
    sizes = [(row[0], row[2], row[3]) for row in figures(parts)]
    assert sizes == [(row[0], row[2], row[3]) for row in figures(whole)]
    assert parts.account.glass_used == pytest.approx(whole.account.glass_used, abs=1e-3)
    assert parts.georeference is not None


def test_other_axes_are_placed_by_the_site(tmp_path, file, whole) -> None:
    parts = read(write_parts(file, tmp_path, shift))
    assert placed_by(parts) == ["linked-by-site"] * 2
    assert [row[2] for row in figures(parts)] == [row[2] for row in figures(whole)]
    assert parts.account.glass_used == pytest.approx(whole.account.glass_used, abs=1e-3)


def test_files_that_lie_apart_are_reported(tmp_path, file) -> None:
    def changed(model: ifcopenshell.file) -> None:
        model.by_type("IfcSite")[0].RefLatitude = None
        shift(model, east=500.0)

    parts = read(write_parts(file, tmp_path, changed))
    assert placed_by(parts) == ["linked-by-origin"] * 2
    assert {i.where for i in parts.issues if i.code == "file-apart"} == {"facade.ifc", "site.ifc"}


def test_what_two_files_have_is_used_once(tmp_path, file, whole) -> None:
    files = write_parts(file, tmp_path)
    parts = read([file, *files])
    assert figures(parts) == figures(whole)
    assert not [i for i in parts.issues if i.code == "guid-repeated"]
    counts = [i.values["elements"] for i in parts.issues if i.code == "file-linked"]
    assert counts == [0, 0, 0]


def test_another_schema_is_refused_by_name(tmp_path, file) -> None:
    model = ifcopenshell.file(schema="IFC2X3")
    model.create_entity("IfcProject", ifcopenshell.guid.new())
    model.write(str(tmp_path / "old.ifc"))
    with pytest.raises(DataError, match="has schema IFC2X3, whole"):
        read([file, tmp_path / "old.ifc"])


def test_a_window_that_no_relation_joins_to_its_opening_fills_it(tmp_path, file, whole) -> None:
    files = write_parts(file, tmp_path)
    facade = ifcopenshell.open(str(files[1]))
    for opening in facade.by_type("IfcOpeningElement"):
        facade.remove(opening.HasFillings[0])
        facade.remove(opening)
    facade.write(str(files[1]))
    parts = read(files)
    assert [w.guid for w in parts.windows] == [w.guid for w in whole.windows]
    assert sum(w.area for w in parts.windows) == pytest.approx(sum(w.area for w in whole.windows), rel=1e-6)
    assert [w.guid for w in read(files[:1]).windows] != [w.guid for w in whole.windows]


def test_folders_and_zips_hold_several_files(tmp_path, file, whole) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    files = write_parts(file, folder)
    assert building_files([folder])[0] == files[0] and len(building_files([folder])) == 3
    with zipfile.ZipFile(tmp_path / "all.ifczip", "w") as archive:
        for file in reversed(files):
            archive.write(file, file.name)
    assert figures(read_ifc(tmp_path / "all.ifczip")) == figures(whole)
    with pytest.raises(DataError, match="each must be IFC"):
        building_files([files[0], tmp_path / "room.hbjson"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["Duplex_A_20110907.ifc", "AC20-FZK-Haus.ifc", "SampleHouse4_Revit_IFC4.ifc", "ExampleHOM.ifc", "House_Renga.ifc"],
)
def test_a_real_building_cut_in_three_is_the_whole(tmp_path, real_data, name) -> None:
    path = real_data / "ifc/buildings" / name
    assert figures(read(write_parts(path, tmp_path))) == figures(read_ifc(path))


@pytest.mark.parametrize("outer_first", [False, True])
def test_two_doors_before_one_wall_are_told_apart_by_nearness(tmp_path, outer_first) -> None:
    """The room's own door, and that of a porch whose wall is 0.6 m off; the order says nothing."""
    small, walls = box_model(window=False)
    outer = small.box("IfcWall", "porch", (-WALL, -1.1, 0.0), (WIDTH + 2 * WALL, 0.2, HEIGHT))
    doors = [
        (walls["south"], "own", ((0.5, -WALL - 0.1, 0.0), (0.8, WALL + 0.2, 2.1)), -0.2),
        (outer, "porch", ((0.3, -1.2, 0.6), (1.4, 0.4, 1.8)), -1.0),
    ]
    for wall, name, (low, size), y in doors[::-1] if outer_first else doors:
        opening = small.opening(wall, low, size=size, axes=True)
        leaf = small.box("IfcDoor", name, (low[0], y, low[2]), (size[0], 0.05, size[2]))
        ifcopenshell.api.feature.add_filling(small.model, opening=opening, element=leaf)
    small.model.write(str(tmp_path / "porch.ifc"))
    (space,) = read_ifc(tmp_path / "porch.ifc").spaces
    guids = {door.Name: door.GlobalId for door in small.model.by_type("IfcDoor")}
    areas = {
        name: sum(f.area for f in space.faces if f.kind == "door" and f.element == guid) for name, guid in guids.items()
    }
    assert areas["own"] == pytest.approx(0.8 * 2.1, rel=1e-5)
    assert areas["porch"] == pytest.approx(1.4 * 1.8 - 0.8 * 1.5, rel=1e-5)
