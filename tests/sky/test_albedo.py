"""Ground reflectance by number, month, weather file and snow, and what it changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.annual import MANY_HOURS, SNOW, SNOW_CM, TOO_WARM_C, annual_sky, with_albedo
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER

MONTHS = tuple(0.1 + 0.05 * month for month in range(12))


@pytest.fixture(scope="module")
def weather():
    return read_epw(WEATHER)


def snowed(weather, cm: float = 12.0, warmest: float = -2.0):
    """The weather with snow in cold hours and none else."""
    depth = np.where(weather.dry_bulb_c < warmest, cm, 0.0)
    return replace(weather, snow_depth_cm=depth)


def test_ground_of_the_sky_follows_number_and_month(weather):
    """Patch 0 is rho E_gh / pi: in proportion to the albedo of its hour, all others unchanged."""
    before = annual_sky(weather, 1, solar=True, sun=False)
    half = annual_sky(with_albedo(weather, 0.1), 1, solar=True, sun=False)
    np.testing.assert_allclose(half.whole[0], before.whole[0] / 2, rtol=1e-5)
    np.testing.assert_array_equal(half.whole[1:], before.whole[1:])
    monthly = annual_sky(with_albedo(weather, MONTHS), 1, solar=True, sun=False)
    month = weather.midpoints.month.to_numpy()[before.lit] - 1
    ratio = np.array(MONTHS)[month] / 0.2
    for part in ("whole", "solar"):
        a, b = getattr(monthly, part), getattr(before, part)
        np.testing.assert_allclose(a[0], b[0] * ratio, rtol=1e-5)


def test_snow_and_the_files_albedo(weather):
    snow = snowed(weather)
    bright = with_albedo(snow, "snow").albedo
    assert set(np.unique(bright)) == {0.2, SNOW}
    assert ((bright == SNOW) == (snow.snow_depth_cm >= 1)).all()
    stated = np.where(weather.dry_bulb_c < 0, np.nan, 0.31)
    filed = with_albedo(replace(weather, stated_albedo=stated), "file")
    assert set(np.unique(filed.albedo)) == {0.2, 0.31}
    assert "albedo: missing or impossible in" in str(filed.notes[-1])
    (note,) = set(with_albedo(snow, None).notes) - set(weather.notes)
    assert "snow lies in" in str(note)
    assert with_albedo(weather, None).notes == weather.notes


def test_gaps_of_six_hours_are_interpolated_and_named(weather):
    """Longer ones are bare ground of 0.2, and are named too."""
    depth = np.full(8760, 12.0)
    depth[100:106] = depth[200:207] = np.nan
    cold = replace(weather, dry_bulb_c=np.full(8760, -5.0), snow_depth_cm=depth)
    snow = with_albedo(cold, "snow")
    assert (snow.albedo != SNOW).sum() == 7 and (snow.albedo[200:207] == 0.2).all()
    stated = np.linspace(0.1, 0.97, 8760)
    gaps = stated.copy()
    gaps[100:106] = gaps[-1] = np.nan
    filed = with_albedo(replace(weather, stated_albedo=gaps), "file")
    np.testing.assert_allclose(filed.albedo[:-1], stated[:-1])
    assert filed.albedo[-1] == 0.2
    bright = np.count_nonzero(stated[:-1] > 0.95)
    for year, words in (
        (snow, ["snow depth: 6 missing values", "snow depth: missing or impossible in 7 hours"]),
        (filed, ["albedo: 6 missing values", "impossible in 1 hour; 0.2", f"above 0.95 in {bright} hours"]),
    ):
        notes = [str(note) for note in year.notes[len(weather.notes) :]]
        assert all(word in note for word, note in zip(words, notes, strict=True)), notes


def test_what_cannot_be_is_refused(weather):
    no_snow = replace(weather, snow_depth_cm=None, stated_albedo=None)
    for source, message in (("snow", "no snow depth"), ("file", "no albedo")):
        with pytest.raises(DataError, match=message):
            with_albedo(no_snow, source)
    with pytest.raises(DataError, match="days warmer than 10 °C"):
        with_albedo(snowed(weather, warmest=99.0), "snow")
    for wrong in (1.2, (0.2, 0.3), "grass"):
        with pytest.raises(DataError, match="expected a number"):
            with_albedo(weather, wrong)


def test_columns_of_an_epw(tmp_path):
    """Snow depth and albedo are columns 31 and 33; 999 and 0 are no albedo."""
    lines = WEATHER.read_text(encoding="latin-1").splitlines()
    rows = [line.split(",") for line in lines[8:]]
    for i, row in enumerate(rows):
        row[30], row[32] = ("15", "0.63") if i < 10 else ("0", "0")
    path = tmp_path / "city.epw"
    path.write_text("\n".join([*lines[:8], *map(",".join, rows)]) + "\n", encoding="latin-1")
    weather = read_epw(path)
    np.testing.assert_allclose(weather.stated_albedo[:10], 0.63)
    assert np.isnan(weather.stated_albedo[10:]).all()
    np.testing.assert_allclose(weather.snow_depth_cm[:11], [15.0] * 10 + [0.0])


def test_numbers_of_the_sources():
    """Liu and Jordan: 0.7 under snow; days warmer than 10 degC and 100 hours are this program's."""
    assert (SNOW, SNOW_CM, TOO_WARM_C, MANY_HOURS) == (0.7, 1.0, 10.0, 100)


@pytest.mark.parametrize("wrong", [-0.01, 1.01, (0.2,) * 11, (*(0.2,) * 11, 1.5), (*(0.2,) * 11, -0.1), (-0.1,) * 12])
def test_reflectances_outside_of_their_range_are_refused(weather, wrong):
    with pytest.raises(DataError, match="from 0 to 1"):
        with_albedo(weather, wrong)


def test_all_of_zero_and_one_are_reflectances(weather):
    assert with_albedo(weather, 0.0).albedo == 0.0
    months = (1.0, *(0.0,) * 11)
    by_hour = with_albedo(weather, months).albedo
    assert by_hour[:744].all() and not by_hour[744:].any()


def test_snow_counts_in_hours_of_any_light(weather):
    """There is a note from 100 hours of daylight on: a sky without sun counts, night does not."""
    day = np.flatnonzero((weather.direct_normal == 0) & (weather.diffuse_horizontal > 0))
    night = np.flatnonzero(weather.direct_normal + weather.diffuse_horizontal == 0)
    cold = replace(weather, dry_bulb_c=np.full(8760, 0.0), notes=())
    for hours, noted in ((day[:100], True), (day[:99], False), (night[:300], False)):
        depth = np.zeros(8760)
        depth[hours] = 1.0
        assert bool(with_albedo(replace(cold, snow_depth_cm=depth), None).notes) == noted
        thin = replace(cold, snow_depth_cm=0.99 * depth)
        assert not with_albedo(thin, None).notes
    assert len(day) >= 100 and len(night) >= 300


def test_gaps_are_counted_in_hours_and_snow_needs_temperatures(weather):
    """Ten half hours are five hours; without temperatures no snow is credible."""
    stated = np.full(8760, 0.3)
    stated[100:110] = np.nan
    halves = with_albedo(replace(weather, step_h=0.5, stated_albedo=stated), "file")
    np.testing.assert_allclose(halves.albedo, 0.3)
    bare = replace(snowed(weather), dry_bulb_c=None)
    assert with_albedo(bare, None) is bare


def test_snow_of_half_hours_is_counted_in_hours(weather):
    """100 steps of half an hour are 50 hours, for which there is no note; 200 are 100."""

    def half(values):
        return np.repeat(values, 2)

    day = weather.direct_normal + weather.diffuse_horizontal > 0
    steps = np.flatnonzero(half(day))
    ends = pd.date_range(weather.times[0] - pd.Timedelta(minutes=30), periods=17520, freq="30min")
    for count, noted in ((100, False), (198, False), (200, True)):
        depth = np.zeros(17520)
        depth[steps[:count]] = 5.0
        series = {name: half(getattr(weather, name)) for name in weather.series()}
        fine = replace(weather, **series | {"times": ends, "step_h": 0.5, "notes": ()})
        cold = replace(fine, dry_bulb_c=np.full(17520, -1.0), snow_depth_cm=depth)
        assert bool(with_albedo(cold, None).notes) == noted


def test_snow_on_a_warm_day_is_not_believed_and_the_note_names_the_weather(weather):
    assert not with_albedo(replace(snowed(weather, warmest=99.0), notes=()), None).notes
    cold = replace(snowed(weather), notes=())
    (note,) = with_albedo(cold, None).notes
    assert str(note).startswith(f"{WEATHER.name}: snow lies in")
    (note,) = with_albedo(replace(cold, file=None, site="Chicago"), None).notes
    assert str(note).startswith("Chicago: snow lies in")
