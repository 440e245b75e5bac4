"""Recipes of blinds: the BSDF that layers give, what changes with the slats, and where a run knows it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.shoebox import shoebox
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from scenes import read_operation, read_system, read_weather, simulate
from scenes.cli import run
from scenes.demo import WEATHER
from scenes.fenestration.slats import greatest_step, has_recipe, layers_bsdf, moved_slats
from scenes.fenestration.systems import FenestrationSystem
from scenes.fenestration.thermal_file import ClosureTable
from scenes.fenestration.tilts import tilt_states
from scenes.toml_file import validated
from tests.validation.sensitivities import slat_rows

PANES = """
[[layers]]
thickness = 0.004
solar = [0.84, 0.075, 0.075]
visible = [0.90, 0.08, 0.08]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[layers]]
thickness = 0.004
emissivity = [0.03, 0.84]
solar = [0.62, 0.27, 0.20]
visible = [0.88, 0.05, 0.055]
"""
BLIND = """shading_position = "external"
see_through = "specular"
[[layers]]
slats = { width = 0.08, spacing = 0.072, tilt_deg = TILT, visible = 0.55, solar = 0.5 }
gap = { width = 0.1 }
"""
SPACING, WIDTH, TILT = 0.072, 0.06, 30.0


def black_slats(**changes: float) -> ClosureTable:
    slats = {"width": WIDTH, "spacing": SPACING, "tilt_deg": TILT, "visible": 0.0} | changes
    clear = {"thickness": 0.004, "solar": [1.0, 0.0, 0.0]}
    layers = [{"slats": slats, "gap": {"width": 0.1}}, clear]
    return validated(ClosureTable, {"layers": layers}, Path("slats.toml"))


def written(folder: Path, tilt: float, *, paths: int = 512) -> Path:
    """The system of a blind at a tilt, by the command."""
    layers = folder / f"layers_{tilt:g}.toml"
    layers.write_text(BLIND.replace("TILT", f"{tilt:g}") + PANES, "utf-8")
    out = folder / f"blind_{tilt:g}.xml"
    assert run(["bsdf", "system", str(layers), "--paths", str(paths), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def blinds(variant, tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("blinds")
    return [written(folder, tilt) for tilt in (30.0, 60.0)]


def normal_transmittance(system: FenestrationSystem) -> float:
    tau = system.visible.direct_hemispherical(system.visible.blocks()["transmission_front"])
    return float(tau[0])


@pytest.mark.parametrize(
    ("key", "step", "slope"),
    [
        ("slat_width_mm", 2.0, -np.sin(np.radians(TILT)) / SPACING / 1e3),
        ("tilt_deg", 3.0, -WIDTH / SPACING * np.cos(np.radians(TILT)) * np.pi / 180),
    ],
)
def test_black_slats_pass_what_is_between_them(variant, key, step, slope):
    """At normal incidence flat black slats pass 1 - (width / spacing) sin(tilt)."""
    (bands,) = layers_bsdf(black_slats().layers, paths=4096)
    system = FenestrationSystem("slats", bands["Visible"], bands["Solar"], recipe=black_slats())
    assert np.isclose(normal_transmittance(system), 1 - WIDTH / SPACING * np.sin(np.radians(TILT)), atol=0.005)
    ((low,),), ((high,),) = moved_slats([(system,)], key, step)
    difference = (normal_transmittance(high) - normal_transmittance(low)) / (2 * step)
    assert np.isclose(difference, slope, rtol=0.02)  # patch 0 is a cone of 5 degrees: its mean is 0.4 % off


def test_more_reflectance_passes_more(variant, blinds):
    system = read_system(blinds[0])
    ((low,),), ((high,),) = moved_slats([(system,)], "slat_reflectance", 0.05)
    weights = KLEMS_FULL.projected_solid_angles()
    for band in ("visible", "solar"):
        tau = [
            weights @ getattr(one, band).direct_hemispherical(getattr(one, band).transmission_front)
            for one in (low, high)
        ]
        assert tau[1] > 1.02 * tau[0]


def test_the_recipe_moves_the_layers_of_the_heat(blinds):
    ((low,),), ((high,),) = moved_slats([(read_system(blinds[0]),)], "slat_width_mm", 2.0)
    widths = [one.closure.unit.layers[0] for one in (low, high)]
    assert widths[0] != widths[1]


def test_tilts_between_two_files_move_with_them(blinds):
    family = [read_system(path) for path in blinds]
    family = [replace(one, tilt_deg=tilt) for one, tilt in zip(family, (30.0, 60.0), strict=True)]
    states = tilt_states(family, 15.0)
    assert all(map(has_recipe, states))
    (low,), (high,) = moved_slats([states], "tilt_deg", 3.0)
    assert low[1].between.low is low[0] and high[1].between.high is high[2]
    transmitted = [normal_transmittance(one) for one in (low[1], states[1], high[1])]
    assert transmitted[0] > transmitted[1] > transmitted[2]


def test_a_run_knows_the_recipe_of_a_state(blinds, tmp_path):
    operation = tmp_path / "office.toml"
    operation.write_text(
        f'[[system]]\nbsdf = "{blinds[0]}"\n[[system]]\nbsdf = "{blinds[1]}"\ntilt_deg = 60\n', "utf-8"
    )
    assert all(map(has_recipe, read_operation(operation).systems))


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        (", visible = 0.55, solar = 0.5", ", solar = 0.5"),
        (", visible = 0.55, solar = 0.5", ""),
        ("tilt_deg = TILT,", "tilt_deg = TILT, radius = 0.03,"),
    ],
)
def test_layers_without_a_recipe_are_refused(tmp_path, capsys, changed, field):
    layers = tmp_path / "layers.toml"
    layers.write_text(BLIND.replace(changed, field).replace("TILT", "30") + PANES, "utf-8")
    assert run(["bsdf", "system", str(layers), "--out", str(tmp_path / "blind.xml")]) != 0
    assert "slats" in capsys.readouterr().err


def test_slats_that_touch_are_refused(variant):
    with pytest.raises(DataError):
        layers_bsdf(black_slats(tilt_deg=30.0, radius=0.02).layers, paths=64)


def test_steps_stay_in_their_range():
    assert greatest_step(black_slats(), "slat_reflectance") == 0.0
    assert np.isclose(greatest_step(black_slats(visible=0.97), "slat_reflectance"), 0.03)
    assert greatest_step(black_slats(tilt_deg=-88.0), "tilt_deg") == 2.0


@pytest.mark.slow
def test_slats_have_rows_of_light_and_heat(blinds):
    building = shoebox()
    few = {"quick": True, "sensor_spacing": 2.0, "sensor_samples": 64, "patch_samples": 64, "picture_size": 16}
    room = building.room(building.spaces[0].label)
    year = simulate(
        room, str(blinds[0]), read_weather(WEATHER), sensitivities=True, sun_points=16, picture_count=1, **few
    )
    rows = year.sensitivities.set_index(["input", "figure"])
    for key in ("tilt_deg", "slat_width_mm", "slat_reflectance"):
        assert {"mean_illuminance_lx", "da300", "mean_air_c"} <= set(rows.loc[key].index)
    assert (rows.loc["tilt_deg", "input_value"] == 30.0).all()
    assert rows.loc[("slat_reflectance", "mean_air_c"), "derivative"] > 0


@pytest.mark.slow
def test_slats_agree_with_whole_runs(variant, tmp_path):
    """Runs of systems with other slats, written by `cfs bsdf system` with another seed."""
    few = {"sensor_samples": 256, "patch_samples": 256, "picture_size": 16, "sun_points": 16}
    for key, figure, value, difference in slat_rows(tmp_path, ("slats",), paths=65_536, **few):
        if figure in ("mean_illuminance_lx", "da300", "lighting_kwh", "heating_kwh", "mean_air_c"):
            assert np.isclose(value, difference, rtol=0.02), (key, figure)
