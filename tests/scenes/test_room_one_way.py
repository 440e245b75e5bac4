"""`cfs run`, `cfs thermal` and `cfs study` on the same inputs: one room, the same numbers."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.model import Building, Element
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import silent
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system
from scenes.heat.study import run_study, study_inputs
from scenes.heat.study_file import read_study
from scenes.room.inputs import RoomInputs, room_inputs
from scenes.room.light import room_light
from scenes.room.operation import read_operation
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room, operated_zone
from scenes.room.solar import seasonal_outdoors, window_irradiance
from scenes.room.windows import in_all_windows
from scenes.run.options import JobOptions
from scenes.run.run import run_job
from scenes.study.one_case import compute_case
from scenes.study.plan import plan_of
from scenes.study.study_file import read_study as read_grid

pytestmark = pytest.mark.early

SCENES = Path(__file__).parents[2] / "scenes"
SAMPLING = {
    "sensor_spacing": 1.0,
    "sensor_samples": 1024,
    "patch_samples": 512,
    "sun_points": 128,
    "sky_subdivision": 1,
    "picture_size": 64,
    "picture_samples": 2,
    "seed": 3,
}
TABLES = """
[gains]
lighting_w_m2 = 10
persons = 2
[air]
infiltration_ach = 0.4
night_ach = 2.0
[loads]
heating_c = 20
cooling_c = 26
"""
TRACE = "\n".join(f"{name} = {value}" for name, value in SAMPLING.items())


@pytest.fixture(scope="module")
def weather() -> Weather:
    return read_epw(WEATHER)


@pytest.mark.parametrize("method", ["three-phase", pytest.param("five-phase", marks=pytest.mark.slow)])
def test_three_commands_give_the_same_numbers(variant, tmp_path, method) -> None:
    """A room of the demo's office with lamps that daylight dims: bit for bit."""
    operation, thermal, grid = (tmp_path / name for name in ("o.toml", "t.toml", "s.toml"))
    operation.write_text(TABLES)
    thermal.write_text(
        f'weather = "{WEATHER}"\nbuilding = "{OFFICE}"\nspaces = ["A"]\n'
        f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n{TABLES}'
        f'[trace]\nview_factors = false\nmethod = "{method}"\n{TRACE}\n'
    )
    grid.write_text(
        f'methods = ["{method}"]\nglare = "none"\noperation = "{operation}"\n'
        f'[[room]]\nbuilding = "{OFFICE}"\nspaces = ["A"]\n'
        f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n[[climate]]\nweather = "{WEATHER}"\n'
        f"[options]\n{TRACE}\n"
    )
    options = JobOptions(
        OFFICE,
        WEATHER,
        VENETIAN_BLIND,
        ("A",),
        operation=operation,
        room=RoomOptions.of(method=method, picture_hours=("06-21 12",), **SAMPLING),
    )
    (room,) = run_job(options).spaces
    (year,), _ = run_study(read_study(thermal), silent)
    (case,) = plan_of(read_grid(grid)).cases
    row = compute_case(case)

    light, heat, ran = room.daylight, room.heat.temperatures, room.operation
    plane = light.illuminance.mean(axis=1, dtype=float)
    assert np.ptp(plane) > 100 and ran.summary["cooling_kwh"] > 0
    np.testing.assert_array_equal(year.hours["daylight_lx"], plane)
    for name in ("air_c", "mrt_c", "operative_c"):
        np.testing.assert_array_equal(year.hours[name], heat[name], err_msg=name)
    for name in ("heating_w", "cooling_w", "shading_state"):
        np.testing.assert_array_equal(year.hours[name], ran.hours[name], err_msg=name)
    for name in ("heating_kwh", "cooling_kwh", "peak_heating_w", "peak_cooling_w"):
        assert row.figures[name] == ran.summary[name] == year.summary[name], name
    assert row.figures["lighting_kwh"] == ran.summary["lighting_kwh"]
    np.testing.assert_array_equal(row.arrays["mean_illuminance"], light.illuminance.mean(axis=0))
    for name in ("air_c", "operative_c"):
        kept = heat[name].to_numpy(np.float32)
        np.testing.assert_array_equal(row.arrays[f"temperature/{name}"], kept, err_msg=name)


def test_a_study_has_the_light_by_wavelength_of_a_run(variant, tmp_path) -> None:
    grid = tmp_path / "s.toml"
    grid.write_text(
        f'methods = ["three-phase"]\nglare = "none"\n[[room]]\nbuilding = "{OFFICE}"\nspaces = ["A"]\n'
        f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n[[climate]]\nweather = "{WEATHER}"\n'
        f"[options]\n{TRACE}\nspectral = true\nchannels = 3\n"
    )
    options = RoomOptions.of(method="three-phase", picture_hours=("06-21 12",), spectral=True, channels=3, **SAMPLING)
    (room,) = run_job(JobOptions(OFFICE, WEATHER, VENETIAN_BLIND, ("A",), room=options)).spaces
    (case,) = plan_of(read_grid(grid)).cases
    row = compute_case(case)
    assert room.spectral is not None and room.spectral.summary["melanopic_250_percent"] > 0
    for name, value in room.spectral.summary.items():
        assert row.figures[name] == value, name


BOX = """
[box]
width = 3
depth = 4
height = 2.8
[[box.window]]
x = 0.5
sill = 0.9
width = 2
height = 1.5
"""
STATES = """
[[system]]
bsdf = "open.xml"
u_value = 1.3
[[system]]
bsdf = "shut.xml"
u_value = 1.1
u_model = "linear"
[control]
rule = {}
"""
RULES = {
    "irradiance": '"irradiance"\nclose_above = 150',
    "glare": '"glare"\nlimit_lx = 400',
    "cut-off": '"cut-off"\nslat_tilts_deg = [0, 40]',
    "temperature and sun": (
        '"all"\nparts = [{ rule = "irradiance", close_above = 100 }, '
        '{ rule = "operative temperature", close_above_c = 22, open_below_c = 21 }]'
    ),
    "schedule": f'"schedule"\nschedule = {[0] * 10 + [1] * 14}',
}


@pytest.mark.parametrize("rule", RULES)
def test_states_switch_in_the_same_hours(variant, tmp_path, weather, rule) -> None:
    """Two states under each rule of the control, `cfs run --operation` against `cfs thermal`."""
    text = STATES.format(RULES[rule]) + TABLES
    for name in ("open", "shut"):
        (tmp_path / f"{name}.xml").write_bytes(VENETIAN_BLIND.read_bytes())
    (tmp_path / "o.toml").write_text(text)
    (tmp_path / "t.toml").write_text(f'weather = "{WEATHER}"\n{BOX}{text}[trace]\nview_factors = false\n{TRACE}\n')
    study, operation = read_study(tmp_path / "t.toml"), read_operation(tmp_path / "o.toml")
    (year,), _ = run_study(study, silent)
    inputs = study_inputs(study)
    building, (space,) = inputs.building, inputs.spaces
    found = compute_room(
        building,
        space,
        in_all_windows(space, *operation.systems),
        weather,
        RoomOptions.of(**SAMPLING),
        operation=operation,
        pictures=False,
        cache=MatrixCache.of_user(),
    )
    ran = found.operation.hours
    assert 0 < ran["shading_state"].mean() < 1
    for name in ("shading_state", "heating_w", "cooling_w"):
        np.testing.assert_array_equal(year.hours[name], ran[name], err_msg=name)
    air = found.heat.temperatures["air_c"]
    np.testing.assert_array_equal(year.hours["air_c"], air)


def test_sun_on_the_windows_is_reflected_by_solar_reflectances(variant, weather) -> None:
    """What closes a blind by irradiance does not hang on how bright a wall looks."""
    box = shoebox(3.0, 4.0, 2.8, windows=(WindowRectangle(0.5, 0.9, 2.0, 1.5),))
    wall = np.array([[[-9, -6, 0], [12, -6, 0], [12, -6, 9]]], dtype=float)

    def irradiance(visible: float, solar: float) -> np.ndarray:
        opposite = Element("w", "wall", "IfcWall", wall, visible, solar)
        building = replace(box, elements=(opposite,))
        room = office(building, weather, RoomOptions.of(**SAMPLING))
        light = room_light(room)  # as in `cfs run`, whose matrices may serve both bands
        assert light.scene.groups
        return window_irradiance(seasonal_outdoors(room, light), room.skies)

    dark, bright, reflecting = irradiance(0.1, 0.1), irradiance(0.9, 0.1), irradiance(0.1, 0.9)
    np.testing.assert_array_equal(dark, bright)
    assert reflecting.sum() > 1.02 * dark.sum()


def test_a_room_without_windows_has_a_zone_in_the_dark(variant, weather) -> None:
    """Such rooms take part where rooms are coupled."""
    box = shoebox(3.0, 4.0, 2.8, windows=(WindowRectangle(0.5, 0.9, 2.0, 1.5),))
    blind = replace(box, spaces=(replace(box.spaces[0], windows=()),))
    tables = OperationTables.model_validate({"control": {"rule": "glare"}})
    zone = operated_zone(office(blind, weather, RoomOptions.of(**SAMPLING), tables))
    assert not zone.solar.inside.any() and zone.daylight is None and not zone.shading.states.any()
    assert zone.solar.facade.max() > 100  # the sun still warms its walls


def office(
    building: Building, weather: Weather, options: RoomOptions, tables: OperationTables | None = None
) -> RoomInputs:
    """The building's only room with the demo's blind."""
    (space,) = building.spaces
    systems = in_all_windows(space, read_system(VENETIAN_BLIND))
    cache = MatrixCache.of_user()
    return room_inputs(building, space, systems, weather, options, operation=tables, cache=cache)


def test_heat_is_computed_in_one_place() -> None:
    """One module of `scenes` calls each function that a year of heat is made of."""
    called: dict[str, list[str]] = {}
    once = ("absorption_matrix", "by_glare", "split_gains", "simulate_zones", "switched")
    for path in SCENES.rglob("*.py"):
        # design days are single days that repeat themselves, no year
        if path.name != "design_days.py":
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                for alias in node.names if isinstance(node, ast.ImportFrom) else ():
                    called.setdefault(alias.name, []).append(path.name)
    assert {name: len(called.get(name, [])) for name in once} == dict.fromkeys(once, 1)
