"""Luminaires of an operation file: power, light of the work plane, dimming, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.electric_light import Luminaire, lamp_light
from bim.model import ModelLuminaire
from bim.sensors import sensor_grid
from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import read_photometry
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.room.luminaires import with_luminaires
from scenes.room.operation import read_operation
from scenes.room.operation_tables import OperationTables
from scenes.room.options import SensorGrid
from scenes.room.zone import lamp_daylight, lamp_lux, operated
from tests.metrics.test_photometry import GAMMA, ies
from tests.thermal.rooms import box

BUILDING = shoebox(4.0, 5.0, 3.0)
SPACE = BUILDING.spaces[0]
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
    tables = with_luminaires(read_operation(file()).tables, BUILDING, SPACE, GRID)
    assert tables.gains.lighting_w_m2 == pytest.approx(3 * 25.0 / 20.0)
    points = sensor_grid(SPACE, spacing=1.0, height=0.8, margin=0.5)[0]
    lamp = read_photometry(tmp_path / "lamp.ies")
    places = [(1.0, 1.5, 2.8), (3.0, 1.5, 2.8), (2.0, 3.5, 2.8)]
    light = lamp_light(SPACE, [Luminaire(lamp, place) for place in places], points)
    assert tables.gains.lighting_full_lx == pytest.approx(light.mean)
    assert light.reflected.mean() > 0.05 * light.direct.mean()


def test_lamps_are_dimmed_by_their_own_light(file) -> None:
    """Lamps of less than the target are at full power until daylight and lamps exceed it."""
    tables = with_luminaires(read_operation(file()).tables, BUILDING, SPACE, GRID)
    full, weather = tables.gains.lighting_full_lx, read_epw(WEATHER)
    day = np.resize([0.0, 100.0, 250.0, 400.0], 8760)
    _, lamps = operated(box(), tables, 20.0, weather, day)
    used = (np.arange(8760) % 24 >= 8) & (np.arange(8760) % 24 < 18)
    share = np.clip((300.0 - day) / full, 0.0, 1.0)
    assert lamps == pytest.approx(75.0 * share * used)
    lit = lamp_lux(tables, weather, day)
    assert lit == pytest.approx(full * share * used)
    assert lamp_lux(read_operation(file()).tables, weather, day) is None


ZONES = """
[[gains.lighting_zone]]
name = "facade"
at = [2.0, 0.5]
lighting_sensor_factor = 0.5
[[gains.lighting_zone]]
name = "back"
at = [2.0, 4.5]
lighting_dimmed = {dimmed}
"""


def in_zones(file, dimmed: str = "true"):
    path = file()
    text = (
        path.read_text()
        .replace("2.8]\nnumber", '2.8]\nzone = "facade"\nnumber')
        .replace("3.5, 2.8]", '3.5, 2.8]\nzone = "back"')
    )
    path.write_text(text + ZONES.format(dimmed=dimmed))
    return with_luminaires(read_operation(path).tables, BUILDING, SPACE, GRID)


@pytest.mark.parametrize("dimmed", ["true", "false"])
def test_zones_are_dimmed_by_sensors_of_their_own(file, tmp_path, dimmed) -> None:
    """Two lamps of three at the facade, whose sensor reads half the daylight; the third at the back."""
    tables, weather = in_zones(file, dimmed), read_epw(WEATHER)
    points = sensor_grid(SPACE, spacing=1.0, height=0.8, margin=0.5)[0]
    lamp = read_photometry(tmp_path / "lamp.ies")
    light = lamp_light(SPACE, [Luminaire(lamp, p) for p in [(1.0, 1.5, 2.8), (3.0, 1.5, 2.8), (2.0, 3.5, 2.8)]], points)
    numbers = [np.linalg.norm(points[:, :2] - at, axis=1).argmin() for at in ([2.0, 0.5], [2.0, 4.5])]
    full = (light.direct + light.reflected)[numbers]
    lit = np.zeros((8760, len(points)))
    lit[:, numbers[0]], lit[:, numbers[1]] = 400.0, 100.0
    day = lamp_daylight(tables, points, lit)
    assert day[:, 0].tolist() == [400.0, 100.0]
    _, lamps = operated(box(), tables, 20.0, weather, day)
    used = (np.arange(8760) % 24 >= 8) & (np.arange(8760) % 24 < 18)
    shares = np.clip([(300.0 - 200.0) / full[0], (300.0 - 100.0) / full[1]], 0.0, 1.0)
    if dimmed == "false":
        shares[1] = 1.0
    assert lamps == pytest.approx(25.0 * (2 * shares[0] + shares[1]) * used)


@pytest.mark.parametrize(
    ("zones", "words"),
    [
        ('[[gains.lighting_zone]]\nname = "a"\nshare = 0.4', "add up to 1"),
        (
            '[[gains.lighting_zone]]\nname = "a"\nshare = 0.4\n[[gains.lighting_zone]]\nname = "a"\nshare = 0.6',
            "same name",
        ),
        (TABLES.format(more="", last='zone = "b"').replace("[gains]", ""), "expected one of none"),
    ],
)
def test_zones_that_cannot_be_are_refused(tmp_path, zones, words) -> None:
    path = tmp_path / "office.toml"
    (tmp_path / "lamp.ies").write_text(ies([0.0], GAMMA, [ROW], watts=25.0))
    path.write_text("[gains]\nlighting_w_m2 = 8\n" + zones if "luminaire" not in zones else "[gains]\n" + zones)
    with pytest.raises(DataError, match=words):
        read_operation(path)


def test_luminaires_of_the_model(file, tmp_path) -> None:
    """Those in the room count, with the files beside the model; of power alone the light is the target."""
    path = tmp_path / "house.ifc"
    (tmp_path / "lamp.ies").write_text(ies([0.0], GAMMA, [ROW], watts=25.0))
    one = ModelLuminaire("L1", (1.0, 1.5, 2.8), 0.0, None, "lamp.ies")
    away, dark = replace(one, position=(9.0, 1.5, 2.8)), replace(one, watts=40.0, photometry="")
    tables = OperationTables.model_validate({"gains": {"luminaires": "model"}})

    def of(*luminaires):
        return with_luminaires(tables, replace(BUILDING, file=path, luminaires=luminaires), SPACE, GRID).gains

    assert of(one, away).lighting_w_m2 == pytest.approx(25.0 / 20.0) and of(one, away).lighting_full_lx > 0
    assert of(dark, away).lighting_w_m2 == pytest.approx(40.0 / 20.0) and of(dark).lighting_full_lx is None
    for wrong, words in (
        ((away,), "none in this room"),
        ((replace(dark, watts=None),), "neither photometry nor power"),
        ((replace(one, photometry="other.ldt"),), "no such file"),
    ):
        with pytest.raises(DataError, match=words):
            of(*wrong)


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
        with_luminaires(read_operation(file(more, last)).tables, BUILDING, SPACE, GRID)


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
