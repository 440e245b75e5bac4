"""Real exports of Revit, ArchiCAD, Renga and others: closed rooms, the files' own quantities."""

from __future__ import annotations

import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.shell import enclosed_volume, open_edges
from bim.to_energyplus import write_epjson
from bim.to_radiance import write_radiance
from mitsuba_cfs.errors import DataError
from tests.bim.test_exports import run_energyplus
from tests.bim.test_to_radiance import SKY_ALL_ROUND, TRACE, blackened, radiance, run, sky_share
from tests.issues import of_code

__all__ = ["radiance"]  # a fixture
FILES = {  # rooms, windows: counted by eye in the files' own lists of spaces and windows
    "buildings/ExampleHOM.ifc": (11, 13),
    # of 42 windows 14 lie in a storey without spaces, above a slab without openings
    "buildings/LargeBuilding.ifc": (8, 28),
    "buildings/TestModel_IFC4Add2_Revit2019.ifc": (2, 7),
    "buildings/SampleHouse4_Revit_IFC4.ifc": (4, 16),
}
ROOMS = {
    "buildings/AC20-FZK-Haus.ifc": "Wohnen",
    "buildings/Duplex_A_20110907.ifc": "A102",
    "buildings/SampleHouse4_Revit_IFC4.ifc": "2 - Bedroom",
    "buildings/LargeBuilding.ifc": "1",
    "buildings/ExampleHOM.ifc": "Living1",
}


@pytest.mark.parametrize("name", FILES)
def test_rooms_are_closed_and_have_their_stated_size(real_data, name):
    building = read_ifc(real_data / "ifc" / name)
    assert (len(building.spaces), len(building.windows)) == FILES[name]
    for space in building.spaces:
        assert open_edges(space.shell) == 0
        assert enclosed_volume(space.shell) == pytest.approx(space.volume, rel=1e-3)
        # 2 %: what the issue asks for; the files' own rounding is finer
        if space.stated_area is not None:
            assert space.floor_area == pytest.approx(space.stated_area, rel=0.02)
        if space.stated_volume is not None:
            assert space.drawn_volume == pytest.approx(space.stated_volume, rel=0.02)
        middle = space.shell.reshape(-1, 3).mean(axis=0)
        for window in space.windows:
            assert window.normal @ (window.centre - middle) > 0


def test_true_north_of_the_fzk_house(real_data):
    # TrueNorth (0.766, 0.643) lies 50 degrees clockwise from the model's +y: a facade towards the
    # model's -y has azimuth 180 - 50 = 130 degrees, and the others follow at right angles
    building = read_ifc(real_data / "ifc/buildings/AC20-FZK-Haus.ifc")
    azimuths = {round(float(np.degrees(np.arctan2(w.normal[0], w.normal[1])))) % 360 for w in building.windows}
    assert azimuths == {130, 220, 310, 40}


@pytest.mark.slow
def test_every_file_is_read_or_refused_in_one_line(real_data):
    within, stating = np.zeros(2), np.zeros(2)  # floor area, volume
    for path in sorted((real_data / "ifc").glob("*/*")):
        try:
            building = read_ifc(path)
        except DataError as error:
            assert path.name in str(error) and "\n" not in str(error)
            continue
        for space in building.spaces:
            reported = any(i.where == space.guid for i in of_code(building, "room-with-open-edges"))
            assert (open_edges(space.shell) > 0) == reported
            areas = space.area_as_stated, space.stated_area
            volumes = space.drawn_volume, space.stated_volume
            for k, (drawn, stated) in enumerate((areas, volumes)):
                stating[k] += stated is not None
                within[k] += stated is not None and abs(drawn / stated - 1) < 0.02
    assert np.all(within > 0.9 * stating) and np.all(stating > 100)


@pytest.mark.slow
@pytest.mark.peer
@pytest.mark.parametrize("name", ROOMS)
def test_exported_rooms_are_dark_but_for_their_windows(real_data, tmp_path, radiance, name):
    building = read_ifc(real_data / "ifc" / name)
    space = next(s for s in building.spaces if ROOMS[name] in (s.name, s.long_name))
    files = write_radiance(space, building, tmp_path, spacing=1.0)
    files.materials.write_text(blackened(files.materials.read_text()))
    (tmp_path / "white.rad").write_text(SKY_ALL_ROUND)
    for path in files.windows.values():
        black = path.read_text().replace("glow", "plastic").replace("4 1 1 1 0", "5 0 0 0 0 0")
        (tmp_path / f"shut_{path.name}").write_text(black)
    shut = run(
        "oconv materials.rad room.rad shut_*.rad white.rad > shut.oct && " + TRACE.format("shut"), tmp_path, radiance
    )
    assert np.all(np.array(shut.split(), dtype=float) == 0.0)
    lit = run("oconv materials.rad room.rad white.rad > open.oct && " + TRACE.format("open"), tmp_path, radiance)
    irradiance = np.array(lit.split(), dtype=float).reshape(-1, 3)[:, 0]
    faces = np.concatenate([face.triangles for face in space.faces])
    ours = np.pi * sky_share(faces, np.loadtxt(files.sensors)[:, :3])
    # over 30 runs a sensor spread by 0.14 of this bar at the most: 7 sigma
    np.testing.assert_allclose(irradiance, ours, rtol=0.03, atol=0.002)


@pytest.mark.slow
@pytest.mark.peer
@pytest.mark.parametrize("name", list(ROOMS)[:3])
def test_energyplus_runs_real_rooms(real_data, tmp_path, name):
    building = read_ifc(real_data / "ifc" / name)
    spaces = [s for s in building.spaces if ROOMS[name] in (s.name, s.long_name)]
    write_epjson(building, tmp_path / "room.epJSON", spaces=spaces)
    errors, rows = run_energyplus(tmp_path / "room.epJSON", tmp_path)
    assert "** Severe" not in errors and len(rows) == 8760
