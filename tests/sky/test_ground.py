"""Skies under given suns, and gendaylit's ground, against gendaylit itself."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from mitsuba_cfs.sky.annual import annual_sky, given_sky
from mitsuba_cfs.sky.epw import read_epw, read_wea, write_wea
from mitsuba_cfs.sky.matrix import gendaylit_ground, reflected_ground, series_for_suns, sky_series
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.perez import relative_luminance
from mitsuba_cfs.sky.sun import direction

NEW_YEAR = 1  # the day whose distance to the sun `gendaylit -ang` takes
# overcast, three between, clear, low and high suns: altitude [degrees], direct, diffuse [W/m2]
MOMENTS = np.array(
    [[30, 0, 200], [30, 500, 100], [5, 100, 30], [60, 900, 80], [45, 200, 300], [12, 700, 60]], dtype=float
)


def gendaylit(radiance, altitude, direct, diffuse) -> tuple[float, list[float]]:
    """Luminance of its sun, and the arguments of its sky: scale, ground, a to e, sun [3]."""
    command = [radiance / "gendaylit", "-ang", str(altitude), "30", "-W", str(direct), str(diffuse)]
    run = subprocess.run([*command, "-O", "2"], capture_output=True, check=True, text=True)
    three, ten = (
        next(line for line in run.stdout.splitlines() if line.startswith(start)).split()[1:] for start in ("3 ", "10 ")
    )
    return float(three[0]), [float(text) for text in ten]


def sun():
    return direction(np.radians(MOMENTS[:, 0]), np.radians(210.0))


def moments(**options):
    return given_sky(sun(), *MOMENTS.T[1:], 1, day_of_year=NEW_YEAR, **options)


def moments_series():
    return series_for_suns(sun(), *MOMENTS.T[1:], day_of_year=NEW_YEAR)


@pytest.mark.peer
def test_the_ground_of_gendaylit_is_its_own(radiance):
    """From its own zenith: its sky is scaled by 145 patches of equal weight, ours by area."""
    found, theirs, n = [], [], len(MOMENTS)
    for row, clearness in zip(MOMENTS, moments_series().model.clearness, strict=True):
        disc, (scale, ground, *shape, x, y, z) = gendaylit(radiance, *row)
        level = relative_luminance(np.array(shape)[:, None], np.ones(1), np.full((1, 1), z))
        sun = np.array([[x, y, z]])
        lit = disc * 6.8e-5 * z if clearness > 1 else 0.0
        found.append(gendaylit_ground(scale * level[0], np.array([lit]), clearness, sun, 0.2)[0])
        theirs.append(ground)
    assert found == pytest.approx(theirs, rel=2e-3)  # four digits are printed of each
    plain, whole = moments().whole[0], moments(ground="gendaylit").whole[0]
    assert np.ptp(plain / theirs) > 0.2
    assert len(whole) == n and np.all(np.abs(whole / theirs - 1) < 0.1 * np.ptp(plain / theirs))


@pytest.mark.peer
def test_a_given_sun_stands_where_it_is_given(radiance):
    found = moments()
    _, row = gendaylit(radiance, *MOMENTS[1])
    assert found.direction[1][2] == pytest.approx(row[-1], abs=1e-6)
    sky = ReinhartSky(1)
    assert sky.index(found.direction[1]) in np.argsort(-found.sun[:, 1])[:2]
    horizontal = found.illuminance[1] * found.direction[1][2]
    assert sky.horizontal_weights @ found.sun[:, 1] == pytest.approx(horizontal, rel=0.05)


def test_given_suns_make_the_weathers_own_sky(chicago):
    weather = read_epw(chicago).select(np.arange(4000, 4048))
    ours = annual_sky(weather, 1, sun_model="radiance", solar=True)
    series = sky_series(weather, sun_model="radiance")
    again = given_sky(
        series.sun,
        weather.direct_normal,
        weather.diffuse_horizontal,
        1,
        solar=True,
        day_of_year=weather.midpoints.day_of_year.to_numpy(),
        dew_point_c=_three_hours(weather.dew_point_c),
    )
    for name in ("whole", "sun", "solar", "direction", "illuminance", "lit"):
        assert np.array_equal(getattr(ours, name), getattr(again, name)), name
    exact = annual_sky(weather, 1)
    apart = np.degrees(np.arccos(np.sum(exact.direction * ours.direction, axis=1)))
    assert 0.05 < apart.max() < 1.5


def test_a_filtered_wea_gives_the_hours_it_holds(chicago, tmp_path):
    weather = read_epw(chicago)
    kept = np.flatnonzero(weather.direct_normal > 500)[::7]
    write_wea(weather, tmp_path / "whole.wea")
    lines = (tmp_path / "whole.wea").read_text().splitlines(keepends=True)
    rows = [lines[6 + hour] for hour in kept]
    (tmp_path / "some.wea").write_text("".join(lines[:6] + rows))
    some = annual_sky(read_wea(tmp_path / "some.wea", whole_year=False), 1, sun_model="radiance")
    whole = annual_sky(read_wea(tmp_path / "whole.wea"), 1, sun_model="radiance", hours=kept)
    assert np.array_equal(some.whole, whole.whole)
    assert np.array_equal(some.direction, whole.direction)


def test_what_does_not_fit_is_refused():
    sun = np.array([[0.0, 0.6, 0.8]])
    with pytest.raises(ValueError, match=r"expected \[H, 3\]"):
        given_sky(sun, [100.0, 200.0], [50.0], 1, day_of_year=1)
    with pytest.raises(ValueError, match="ground: expected one of"):
        given_sky(sun, [100.0], [50.0], 1, day_of_year=1, ground="grass")


def _three_hours(dew):
    padded = np.concatenate([[dew[0]] * 2, dew])
    return np.convolve(padded, np.full(3, 1 / 3), mode="valid")


def test_ground_of_three_skies_by_gendaylits_formulas():
    """Zenith 1,000 cd/m2, sun at 50 degrees with 3,000 lx on the ground, reflectance 0.3."""
    h = np.radians(50.0)
    suns = direction(np.full(3, h), np.full(3, 2.0))
    found = gendaylit_ground(np.full(3, 1e3), np.full(3, 3e3), np.array([1.0, 5.99, 6.0]), suns, 0.3)
    x, below = (50.0 - 45.0) / 45.0, np.pi / 2 - h
    clear = 0.274 * (0.91 + 10 * np.exp(-3 * below) + 0.45 * np.sin(h) ** 2)
    series = 2.766521 + 0.547665 * x - 0.369832 * x**2 + 0.009237 * x**3 + 0.059229 * x**4
    between = 2.739 + 0.9891 * np.sin(0.3119 + 2.6 * h)
    between *= np.exp(-below * (0.4441 + 1.48 * h))
    middle = 3.5556 - 2.7152 * x - 1.3081 * x**2 + 1.0660 * x**3 + 0.60227 * x**4
    factors = np.array([0.777778, middle / between / np.pi, series / clear / np.pi])
    assert found == pytest.approx(0.3 * (1e3 * factors + 3e3 / np.pi))
    # x = -1 at the horizon, where the polynomials' odd terms change sign
    low = gendaylit_ground(np.full(1, 1e3), np.zeros(1), np.array([7.0]), np.array([[0.0, 1.0, 0.0]]), 1.0)
    clear = 0.274 * (0.91 + 10 * np.exp(-1.5 * np.pi))
    series = 2.766521 - 0.547665 - 0.369832 - 0.009237 + 0.059229
    assert low == pytest.approx(1e3 * series / clear / np.pi)
    assert reflected_ground(np.array([1e4]), 0.2) == pytest.approx(2e3 / np.pi)
