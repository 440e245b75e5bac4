"""Luminaires of an operation file: power, light of the work plane, dimming, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from bim.electric_light import Luminaire, lamp_light
from bim.sensors import sensor_grid
from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import read_photometry
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.room.luminaires import with_luminaires
from scenes.room.operation import read_operation
from scenes.room.options import SensorGrid
from scenes.room.zone import lamp_lux, operated
from tests.metrics.test_photometry import GAMMA, ies
from tests.thermal.rooms import box

SPACE = shoebox(4.0, 5.0, 3.0).spaces[0]
ROW = 300.0 * np.cos(np.radians(GAMMA))
GRID = SensorGrid(spacing=1.0, height=0.8, margin=0.5)
TABLES = """
[gains]
lighting_target_lx = 300
{more}
[[gains.luminaire]]
file = "lamp.ies"
position = [1.0, 1.5, 2.8]
number = 2
step = [2.0, 0.0, 0.0]
[[gains.luminaire]]
file = "lamp.ies"
position = [2.0, 3.5, 2.8]
{last}
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "lamp.ies").write_text(ies([0.0], GAMMA, [ROW], watts=25.0))

    def of(more="", last=""):
        path = tmp_path / "office.toml"
        path.write_text(TABLES.format(more=more, last=last))
        return path

    return of


def test_luminaires_give_power_and_light(file, tmp_path) -> None:
    tables = with_luminaires(read_operation(file()).tables, SPACE, GRID)
    assert tables.gains.lighting_w_m2 == pytest.approx(3 * 25.0 / 20.0)
    points = sensor_grid(SPACE, spacing=1.0, height=0.8, margin=0.5)[0]
    lamp = read_photometry(tmp_path / "lamp.ies")
    places = [(1.0, 1.5, 2.8), (3.0, 1.5, 2.8), (2.0, 3.5, 2.8)]
    light = lamp_light(SPACE, [Luminaire(lamp, place) for place in places], points)
    assert tables.gains.lighting_full_lx == pytest.approx(light.mean)
    assert light.reflected.mean() > 0.05 * light.direct.mean()


def test_lamps_are_dimmed_by_their_own_light(file) -> None:
    """Lamps of less than the target are at full power until daylight and lamps exceed it."""
    tables = with_luminaires(read_operation(file()).tables, SPACE, GRID)
    full, weather = tables.gains.lighting_full_lx, read_epw(WEATHER)
    day = np.resize([0.0, 100.0, 250.0, 400.0], 8760)
    _, lamps = operated(box(), tables, 20.0, weather, day)
    used = (np.arange(8760) % 24 >= 8) & (np.arange(8760) % 24 < 18)
    share = np.clip((300.0 - day) / full, 0.0, 1.0)
    assert lamps == pytest.approx(75.0 * share * used)
    lit = lamp_lux(tables, weather, day)
    assert lit == pytest.approx(full * share * used)
    assert lamp_lux(read_operation(file()).tables, weather, day) is None


@pytest.mark.parametrize(
    ("more", "last", "words"),
    [
        ("lighting_w_m2 = 8", "", "follows from the luminaires"),
        ("", "number = 2", "a distance"),
        ("", "number = 2\nstep = [9.0, 0.0, 0.0]", "outside the room"),
        ("", "watts = 0", "watts"),
    ],
)
def test_what_no_luminaire_can_be_is_refused(file, more, last, words) -> None:
    with pytest.raises(DataError, match=words):
        with_luminaires(read_operation(file(more, last)).tables, SPACE, GRID)


def test_a_missing_file_is_named(file, tmp_path) -> None:
    path = file()
    (tmp_path / "lamp.ies").unlink()
    with pytest.raises(DataError, match="no such file") as error:
        read_operation(path)
    assert error.value.field == "gains.luminaire.0.file"


@pytest.mark.slow
def test_light_of_luminaires_is_that_of_radiance() -> None:
    from tests.validation.luminaires import compare

    pytest.importorskip("pyradiance")
    table = compare(paths=1024)
    assert (table["direct rms %"] < 0.1).all()
    # paths of both: each sensor has 1,024 here, Radiance's ambient samples there
    assert (table["rms %"] < 1.0).all()
    assert table["all lx"].to_numpy() == pytest.approx(table["Radiance, all"], rel=0.005)
