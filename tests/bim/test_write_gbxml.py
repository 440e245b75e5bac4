"""Buildings as gbXML, read again."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bim.exported_glazing import ExportedGlazing
from bim.gbxml.building import read_gbxml
from bim.gbxml.write import write_gbxml
from bim.shell import open_edges
from bim.shoebox import WindowRectangle, shoebox


@pytest.mark.parametrize("recess", [0.0, 0.2])
@pytest.mark.parametrize("frame", [0.0, 0.1])
def test_a_room_comes_back(tmp_path, recess, frame):
    windows = [
        WindowRectangle(0.5, 0.9, 3.0, 1.5, frame=frame),
        WindowRectangle(1.0, 1.0, 1.0, 2.0, "ceiling", frame=frame),
    ]
    box = shoebox(
        4, 5, 3, windows=windows, recess=recess, latitude_deg=50.0, longitude_deg=8.0, reflectance_solar={"floor": 0.35}
    )
    (room,) = box.spaces
    glass = tuple(replace(w, visible_transmittance=0.7) for w in room.windows)
    box = replace(box, spaces=(replace(room, windows=glass),))
    write_gbxml(box, tmp_path / "box.gbxml", glazing={glass[0].guid: ExportedGlazing(1.1, 0.5, 0.7)})
    found = read_gbxml(tmp_path / "box.gbxml")
    (space,), (own,) = found.spaces, box.spaces
    assert (found.latitude_deg, found.longitude_deg) == (50.0, 8.0)
    assert space.volume == pytest.approx(own.volume, rel=1e-5)
    assert space.floor_area == pytest.approx(own.floor_area, rel=1e-5)
    assert not open_edges(space.shell)
    # a face made for a window is a thousandth wider either way
    areas = sorted(window.area for window in space.windows)
    assert areas == pytest.approx(sorted(window.area for window in own.windows), rel=2.1e-3)
    first = max(space.windows, key=lambda window: window.area)
    assert (first.u_value, first.g_value, first.visible_transmittance) == (1.1, 0.5, 0.7)
    floor, before = (next(f for f in s.faces if f.kind == "floor") for s in (space, own))
    assert floor.reflectance_visible == pytest.approx(before.reflectance_visible)
    assert floor.reflectance_solar == pytest.approx(0.35)
    names = [layer.name for layer in floor.construction.layers]
    assert names == [layer.name for layer in before.construction.layers]
    assert floor.adjacency == before.adjacency
