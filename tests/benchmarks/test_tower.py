"""The generated tower: every room closed, with its windows, its doors and the storey above."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from ifcopenshell.util.placement import get_local_placement

from bim.ifc.building import read_ifc
from bim.shell import open_edges
from tests.benchmarks import tower as benchmark
from tests.benchmarks.tower import LENGTH, NORTH, OUTER, ROOMS, SOUTH, STREET, tower
from tests.demo.make_office import HEIGHT
from tests.scripts import run_script


@pytest.fixture(scope="module")
def model():
    return tower(20)


def test_each_storey_has_ten_rooms_eleven_windows_and_nine_doors(model):
    counts = [len(model.by_type(f"Ifc{name}")) for name in ("Space", "Window", "Door", "Slab")]
    assert counts == [20, 22, 18, 3]
    low, high = (storey.Elevation for storey in model.by_type("IfcBuildingStorey"))
    assert (low, high) == (0.0, pytest.approx(HEIGHT + 0.38))


@pytest.mark.parametrize("rooms", [0, 7, -10])
def test_half_a_storey_is_refused(rooms):
    with pytest.raises(ValueError, match="a multiple of 10 rooms"):
        tower(rooms)


def test_houses_stand_on_both_sides_of_a_street():
    model = tower(80, houses=4)
    names = [space.Name for space in model.by_type("IfcSpace")]
    assert len(set(names)) == 80 and len(model.by_type("IfcBuildingStorey")) == 8
    slabs = [slab for slab in model.by_type("IfcSlab") if slab.Name == "Roof"]
    places = [get_local_placement(slab.ObjectPlacement)[:3, 3] for slab in slabs]
    assert len({tuple(place.round(6)) for place in places}) == 4
    apart = {round(float(abs(np.subtract(*pair)[1]) - LENGTH - 2 * OUTER), 6) for pair in combinations(places, 2)}
    assert STREET in apart
    with pytest.raises(ValueError, match="4 houses have a multiple of 40 rooms"):
        tower(50, houses=4)


def test_options_go_to_the_command(monkeypatch, capsys):
    asked = []

    def measured(rooms, options, *, houses, of):
        asked.append((rooms, options, houses, of))
        return benchmark.Used(rooms, 10.0, 6.0, 1.0)

    monkeypatch.setattr(benchmark, "measured", measured)
    words = ["tower", "10", "30", "--of", "check", "--options=--processes 2"]
    assert run_script("tests.benchmarks", words) == 0
    assert asked == [(10, ["--processes", "2"], 1, "check"), (30, ["--processes", "2"], 1, "check")]
    assert "| 30 | 10.0 | 6 | 0.33 | 0.00 | 1.00 |" in capsys.readouterr().out


@pytest.mark.slow
def test_rooms_are_closed_and_border_on_each_other(model, tmp_path):
    model.write(str(tmp_path / "tower.ifc"))
    building = read_ifc(tmp_path / "tower.ifc")
    assert len(building.spaces) == 2 * ROOMS
    assert [open_edges(space.shell) for space in building.spaces] == [0] * 20
    assert building.account.share_used == pytest.approx(1.0)
    storeys = [[s for s in building.spaces if s.storey == name] for name in ("Ground floor", "Storey 1")]
    for below, above in zip(*storeys, strict=True):
        ceilings = [face for face in below.faces if face.normal[2] > 0.9 and face.area > 1.0]
        assert {face.neighbour for face in ceilings} == {above.guid}
        (windows,) = {len(below.windows), len(above.windows)}
        assert windows == (2 if below.long_name == "Corridor" else 1)
    hall = storeys[0][-1]
    doors = {face.neighbour for face in hall.faces if face.kind == "door"}
    assert len(doors) == SOUTH + NORTH
