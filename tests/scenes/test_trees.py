"""Trees that change with the months: light, glare and heat of a room behind them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bim.model import Building, seasons
from bim.rays import ray_mesh
from bim.surroundings.city_models import read_trees
from bim.surroundings.placement import _attenuations, with_surroundings
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods.light import direct_sun
from scenes import cli
from scenes.demo import WEATHER
from scenes.head import head_of, model_notes
from scenes.room.daylight import room_daylight
from scenes.room.glare import annual_glare, room_glare
from scenes.room.inputs import RoomInputs, room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.room import lit_room, operated_zone
from scenes.room.shading import shading_states
from scenes.room.solar import facade_irradiance, seasonal_outdoors, window_irradiance
from scenes.room.windows import in_all_windows
from scenes.room.zone import zone_surfaces
from tests.conftest import REPOSITORY
from tests.scenes.small_box import BOX, HOURS, SMALL

CENTRE, RADIUS = np.array([1.5, -8.0, 5.5]), 5.5
LIST = """
[[tree]]
at = [1.5, -8.0]
height = 11.0
crown_radius = 5.5
crown_base = 0.0
transmittance = "deciduous"
"""
WINTER, SUMMER = [0, 3], [1, 2]  # of HOURS


@pytest.fixture(scope="module")
def behind(tmp_path_factory) -> Building:
    path = tmp_path_factory.mktemp("trees") / "trees.toml"
    path.write_text(LIST)
    return with_surroundings(replace(BOX, latitude_deg=41.98), [path])


def room_of(building, system, weather, skies, options=SMALL, **more) -> RoomInputs:
    (space,) = building.spaces
    systems = in_all_windows(space, system)
    return room_inputs(building, space, systems, weather, options, skies=skies, **more)


def illuminance(room: RoomInputs) -> np.ndarray:
    """Illuminance of the work plane in `HOURS` [hours, S] [lx]."""
    return room_daylight(room, room_light(room), shading_states(room)).illuminance[list(HOURS)]


def sun_of(room: RoomInputs) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance of the window groups [H, G] and of the outside of the zone [H, F] [W/m2]."""
    outdoors, surfaces = seasonal_outdoors(room, room_light(room)), zone_surfaces(room)
    count = len(surfaces.room.zone.surfaces)
    facade = facade_irradiance(outdoors, surfaces.outer, count, room.skies)
    return window_irradiance(outdoors, room.skies), facade


@pytest.mark.parametrize(
    "method",
    [
        "three-phase",
        pytest.param("five-phase", marks=pytest.mark.slow),
        pytest.param("point-in-time", marks=pytest.mark.slow),
    ],
)
def test_light_of_an_hour_is_that_of_its_month(method, variant, behind, weather, skies, milk):
    options = replace(SMALL, method=method)
    found = illuminance(room_of(behind, milk, weather, skies, options))
    for season, hours in zip(seasons(behind), (SUMMER, WINTER), strict=True):
        alone = room_of(season.building, milk, weather, skies, options)
        expected = illuminance(alone)
        np.testing.assert_allclose(found[hours], expected[hours], rtol=0.05)
        others = [hour for hour in range(len(HOURS)) if hour not in hours]
        assert not np.allclose(found[others], expected[others], rtol=0.2)


@pytest.mark.slow
def test_heat_and_glare_of_an_hour_are_those_of_its_month(variant, behind, weather, skies, glass):
    room = room_of(behind, glass, weather, skies)
    lit = np.array(HOURS)
    light, state = room_light(room), shading_states(room)
    (irradiance, facade), year = sun_of(room), annual_glare(room, light, state)
    sun, facade = irradiance[lit].T, facade[lit]
    shown = room_glare(room, light, state, list(HOURS))
    zone = operated_zone(room)
    seen = []
    for season, hours in zip(seasons(behind), (SUMMER, WINTER), strict=True):
        alone = room_of(season.building, glass, weather, skies)
        irradiance, outside = sun_of(alone)
        np.testing.assert_allclose(sun[:, hours], irradiance[lit[hours]].T, rtol=0.03)
        np.testing.assert_allclose(facade[hours], outside[lit[hours]], rtol=1e-6)
        light = room_light(alone)
        expected = annual_glare(alone, light, state)
        assert year.dgp.iloc[lit[hours]].to_numpy() == pytest.approx(expected.dgp.iloc[lit[hours]].to_numpy(), abs=0.02)
        assert year.ev.iloc[lit[hours]].to_numpy() == pytest.approx(expected.ev.iloc[lit[hours]].to_numpy(), rel=0.06)
        of_month = {one.hour: one.glare["ev"] for one in room_glare(alone, light, state, list(HOURS)).pictures}
        for one in shown.pictures:
            if one.hour in lit[hours]:
                assert one.glare["ev"] == pytest.approx(of_month[one.hour], rel=0.06)
        seen.append(operated_zone(alone).zone.windows[0].sky_seen)
    # of the longwave from the sky, the mean of the year
    assert zone.zone.windows[0].sky_seen == pytest.approx(np.mean(seen))
    assert seen[0] < seen[1] - 0.1


@pytest.mark.slow
def test_the_sun_through_a_crown_by_month_is_that_of_beers_law(variant, weather, tmp_path, milk):
    """A window wholly in the crown's shadow: the sun that its milk glass scatters to the sensors.

    The path of each beam through the sphere is known; what is left is where the leaves happen to
    stand before this window, and that leaves stick out of the hull.
    """
    options = replace(SMALL, sampling=replace(SMALL.sampling, patch_samples=256))
    skies = skies_for(weather, options.sampling)
    path = tmp_path / "trees.toml"
    path.write_text(LIST)
    (one,) = read_trees(path).objects
    mesh, shares = ray_mesh(one.triangles), (0.033, 0.46)
    leafed, bare = _attenuations(mesh, one.name, shares)
    months = weather.midpoints[skies.lit].month.to_numpy()
    k = np.where((months >= 5) & (months <= 10), leafed, bare)
    u = np.stack(np.meshgrid(np.linspace(0.55, 2.45, 9), np.linspace(0.95, 2.35, 9)), -1)
    points = np.insert(u.reshape(-1, 2), 1, 0.0, axis=1) - CENTRE
    along = points @ skies.direction.T  # [N, L]
    root = np.maximum(along**2 - ((points**2).sum(-1) - RADIUS**2)[:, None], 0.0)
    passed = np.exp(-k * 2 * np.sqrt(root)).mean(axis=0)
    inside = (root > 1.0).all(axis=0) & (skies.direction[:, 1] < 0)

    def scattered(building: Building) -> np.ndarray:
        room = room_of(building, milk, weather, skies, options)
        sun = direct_sun(room_light(room).light).mean(axis=0)
        return np.where(inside, sun, 0.0)

    free = scattered(replace(BOX, latitude_deg=41.98))
    found = np.zeros(len(months))
    for number in range(4):  # other leaves each time
        other = path.with_stem(f"trees{number}")
        other.write_text(LIST)
        found += scattered(with_surroundings(replace(BOX, latitude_deg=41.98), [other])) / 4
    for season, bar in (((1, 2, 3, 4, 11, 12), 0.05), ((5, 6, 7, 8, 9, 10), 0.25)):
        own = np.isin(months, season)
        expected = (passed * free)[own].sum()
        print(season, found[own].sum() / free[own].sum(), expected / free[own].sum())
        assert found[own].sum() == pytest.approx(expected, rel=bar)


def test_what_trees_let_pass_is_said_at_the_head(behind):
    for notes in (model_notes(behind, behind.issues), head_of(behind).lines):
        (said,) = (note for note in notes if "tree" in note)
        assert "3 % from May to October, 46 % from November to April" in said


def test_the_explorer_is_refused_before_anything_is_traced(behind, weather, skies, glass):
    (space,) = behind.spaces
    with pytest.raises(DataError, match="one transmittance"):
        lit_room(behind, space, in_all_windows(space, glass), weather, SMALL, skies=skies, explore=True)


@pytest.mark.slow
def test_a_year_of_glare_behind_trees(variant, tmp_path, capfd):
    """Its tables say what they are of; winter is brighter at the eye than without the months."""
    model = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"
    found = {}
    for kind in ("deciduous", "evergreen"):
        trees, out = tmp_path / "trees.toml", tmp_path / kind
        trees.write_text(LIST.replace("deciduous", kind))
        words = [
            "dgp",
            model,
            "--space",
            "Office",
            "--surroundings",
            trees,
            "--weather",
            WEATHER,
            "--metric",
            "sDGP",
            "--size",
            64,
            "--samples",
            1,
            "--out",
            out,
        ]
        assert cli.run([str(word) for word in words]) == 0, capfd.readouterr().err
        manifest = json.loads((out / "glare_year.json").read_text())
        assert manifest["options"]["surroundings"] == [str(trees)]
        assert "crown transmits" in " ".join(manifest["notes"])
        (table,) = out.glob("*.parquet")
        year = pd.read_parquet(table)
        found[kind] = year["Ev"].groupby(year.index.month).mean()
    ratio = found["deciduous"] / found["evergreen"]
    np.testing.assert_allclose(ratio[5:10], 1.0, rtol=0.02)
    assert (ratio.drop(range(5, 11)) > 1.2).all()


@pytest.mark.slow
def test_a_study_says_what_trees_let_pass(variant, tmp_path, capfd):
    (tmp_path / "trees.toml").write_text(LIST)
    model = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"
    study = tmp_path / "study.toml"
    study.write_text(
        f'surroundings = ["trees.toml"]\n[[room]]\nbuilding = "{model.as_posix()}"\n'
        f'spaces = ["Office"]\n[[climate]]\nweather = "{WEATHER.as_posix()}"\n'
    )
    out = tmp_path / "out"
    assert cli.run(["study", str(study), "--quick", "--out", str(out)]) == 0, capfd.readouterr().err
    (table,) = out.glob("*.csv")
    (said,) = pd.read_csv(table)["trees"]
    assert "3 % from May to October, 46 % from November to April" in said
