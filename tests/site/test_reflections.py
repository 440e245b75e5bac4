"""Reflections of the sun by panes, against the mirrored point in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from scenes import cli
from scenes.comply.openings import openings_of
from scenes.demo import OFFICE, WEATHER
from scenes.site.reflections import Observer, mirrors_of, observer_row, read_observers, reflections
from scenes.site.sun_year import SunYear
from tests.comply.obstructions import facing_wall

POINT = np.array([0.5, -6.0, 0.3])


def suns(count: int = 20_000) -> SunYear:
    """Directions all over the sky, 10,000 lx each."""
    random = np.random.default_rng(1)
    z, turn = random.random(count), 2 * np.pi * random.random(count)
    across = np.sqrt(1 - z**2)
    directions = np.column_stack([across * np.sin(turn), across * np.cos(turn), z])
    times = pd.date_range("2001-01-01", periods=count, freq="5min")
    return SunYear(times, directions, np.arange(count) % 2 == 0, np.full(count, 1e4), 1 / 12)


def mirrored(point, opening, directions):
    """Which suns the window shows at a point: from the point behind the glass they lie within its edges."""
    behind = point - 2 * ((point - opening.centre) @ opening.normal) * opening.normal
    towards = directions @ opening.normal
    far = np.divide(
        (opening.centre - behind) @ opening.normal, towards, where=towards > 0, out=np.full(len(towards), np.nan)
    )
    at = behind + far[:, None] * directions - opening.centre
    inside = (np.abs(at @ opening.along) < opening.width / 2) & (np.abs(at @ opening.up) < opening.height / 2)
    return (towards > 0) & inside


def test_a_pane_shows_the_sun_where_its_mirror_image_does():
    building, sun = shoebox(), suns()
    (opening,) = openings_of(building.spaces[0])
    found = reflections(Observer("eye", POINT), mirrors_of(building, 0.15), sun)
    wanted = mirrored(POINT, opening, sun.directions)
    assert 50 < wanted.sum() < len(wanted) / 2
    assert set(found["time"]) == set(sun.times[wanted])
    straight = found.loc[found["apart_from_sun_deg"].idxmax()]
    assert straight["reflectance"] == pytest.approx(0.15, abs=0.05)
    grazing = found.loc[found["apart_from_sun_deg"].idxmin()]
    assert grazing["reflectance"] > straight["reflectance"]
    assert found["lux"].tolist() == pytest.approx((1e4 * found["reflectance"]).tolist())


def test_walls_hide_the_pane_and_the_sun():
    sun = suns()
    open_site = reflections(Observer("eye", POINT), mirrors_of(shoebox(), 0.15), sun)
    before_the_eye = replace(shoebox(), elements=(facing_wall(3.0, 50.0),))
    assert not len(reflections(Observer("eye", POINT), mirrors_of(before_the_eye, 0.15), sun))
    behind_the_eye = replace(shoebox(), elements=(facing_wall(12.0, 6.0),))
    part = reflections(Observer("eye", POINT), mirrors_of(behind_the_eye, 0.15), sun)
    assert 0 < len(part) < len(open_site)


def test_a_year_counts_moments_once_and_names_the_brightest():
    sun = suns()
    eye = Observer("eye", POINT, np.array([0.0, 1.0, 0.0]))
    table = reflections(eye, mirrors_of(shoebox(), 0.15), sun)
    row = observer_row(eye, pd.concat([table, table]), sun.step_h)
    assert row["hours_cloudless"] == pytest.approx(len(table) / 12)
    assert row["hours_weather"] == pytest.approx(table["shines"].sum() / 12)
    assert row["brightest_lux"] == table["lux"].max()
    assert row["hours_cloudless_within_30_deg_of_sight"] <= row["hours_cloudless"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [("name,x,y\na,1,2\n", "expected the columns"), ("name,x,y,z\na,1,2,up\n", "expected a number, got 'up' in row 2")],
)
def test_a_table_of_points_with_a_fault_is_refused(tmp_path, text, fault):
    file = tmp_path / "points.csv"
    file.write_text(text)
    with pytest.raises(DataError, match=fault):
        read_observers(file)


def test_points_may_state_a_line_of_sight(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("name,x,y,z,sight_azimuth_deg\ndriver,1,2,1.5,90\nwindow,0,0,5,\n")
    driver, window = read_observers(file)
    assert driver.sight == pytest.approx([1.0, 0.0, 0.0], abs=1e-12) and window.sight is None


@pytest.mark.parametrize(("z", "reached"), [(0.2, True), (40.0, False)])
def test_the_command_writes_moments_with_their_times(tmp_path: Path, z: float, reached: bool) -> None:
    """To an eye below the window, and to one above, whom no pane shows the sun: the table has its head, too."""
    (tmp_path / "street.csv").write_text(f"name,x,y,z,sight_azimuth_deg\nopposite,2,-3,{z},\n")
    words = ["--weather", WEATHER, "--points", tmp_path / "street.csv", "--out", tmp_path / "out"]
    assert cli.run([str(word) for word in ("site", "reflections", OFFICE, *words)]) == 0
    moments = pd.read_csv(tmp_path / "out" / "moments.csv")
    assert (len(moments) > 0) == reached and set(moments["time"].str[:4]) == ({"2017"} if reached else set())


def test_a_building_without_windows_is_refused() -> None:
    bare = shoebox()
    bare = replace(bare, spaces=tuple(replace(space, windows=()) for space in bare.spaces))
    with pytest.raises(DataError, match="no room has an exterior window"):
        mirrors_of(bare, 0.15)
