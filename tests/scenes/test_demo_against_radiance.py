"""Illuminance of the demo's room over a year, against Radiance's own three-phase method.

Radiance gets the geometry that this project exports, the same BSDF file and the same weather; V,
D, the sky and the product are its own (rfluxmtx, gendaymtx, dctimestep).
"""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from tests import radiance

pytest.importorskip("pyradiance")
pytestmark = [pytest.mark.early, pytest.mark.peer, pytest.mark.usefixtures("variant")]

DEMO = Path(str(files("scenes") / "demo"))
WEATHER = DEMO / "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
SYSTEM = DEMO / "venetian_blind.xml"
RAYS = "-n 2 -ab 8 -ad 60000 -lw 1e-6"
SPACING = 1.0  # [m] 24 sensors and less keep Radiance's part of the test short


def radiance_illuminance(space, building, folder: Path) -> np.ndarray:
    """Illuminance [S, H] [lx] of every hour of the year by Radiance."""
    from bim.to_radiance import write_radiance

    files = write_radiance(space, building, folder, sky_division=4, spacing=SPACING)
    sensors = files.sensors.read_bytes()
    count = sensors.count(b"\n")
    radiance.run(f"epw2wea {WEATHER} year.wea", folder)
    radiance.run("gendaymtx -of -m 4 year.wea > sky.smx", folder)
    total = 0.0
    for name, window in files.windows.items():
        room, outdoors = (
            f"{files.materials.name} {part.name}" for part in (files.room, files.outdoors)
        )
        radiance.run(
            f"rfluxmtx -faf -I+ {RAYS} -y {count} - {window.name} {room} > {name}.vmx",
            folder,
            sensors,
        )
        radiance.run(
            f"rfluxmtx -ff -n 2 -ab 4 -ad 1 -lw 1e-6 -c 10000 {window.name} {files.sky.name} "
            f"{outdoors} > {name}.dmx",
            folder,
        )
        command = f"dctimestep -of {name}.vmx {SYSTEM} {name}.dmx sky.smx"
        out = radiance.run(command, folder)  # gendaymtx's sky is bluish: all channels count
        total = total + radiance.read_float_matrix(out, radiance.LUMINANCE)
    return total


# room A is the quick twin of B: Radiance takes most of a minute for each
@pytest.mark.parametrize("name", ["A", pytest.param("B", marks=pytest.mark.slow)])
def test_year_of_illuminance(name, tmp_path):
    from bim.ifc.building import read_ifc
    from mitsuba_cfs import variants
    from scenes.fenestration.systems import read_system
    from scenes.room.options import RoomOptions
    from scenes.room.room import compute_room
    from scenes.room.windows import in_all_windows
    from scenes.run.inputs import read_weather

    variants.activate()
    building = read_ifc(DEMO / "office.ifc")
    space = building.space(name)
    # one D for a whole window, as Radiance has it
    options = RoomOptions.of(method="three-phase", sensor_spacing=SPACING, window_parts=1)
    system = read_system(SYSTEM)
    # windows are black from the room in Radiance's chain: with their reflection ours is 2 % above
    black = replace(system.visible, reflection_back=np.zeros((145, 145)))
    systems = in_all_windows(space, replace(system, visible=black))
    ours = compute_room(
        building, space, systems, read_weather(WEATHER), options, pictures=False
    ).daylight
    theirs = radiance_illuminance(space, building, tmp_path).T
    assert theirs.shape == ours.illuminance.shape
    lit = theirs.mean(axis=1) > 1.0  # daylit hours
    assert lit.sum() > 4000
    mean = ours.illuminance[lit].mean() / theirs[lit].mean()
    sensor = ours.illuminance.mean(axis=0) / theirs.mean(axis=0)
    print(f"room {name}: mean {mean:.4f}, sensors {sensor.min():.4f} to {sensor.max():.4f}")
    assert mean == pytest.approx(1, abs=0.02), mean
    assert sensor == pytest.approx(np.ones_like(sensor), abs=0.05), sensor
