"""Sky matrices against gendaymtx, and their own identities."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from weather_files import epw_rows, write_epw

from mitsuba_cfs.sky.epw import read_epw, read_wea, write_wea
from mitsuba_cfs.sky.matrix import sky_matrix, sky_series, sun_matrix, sun_up
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.sky.weather import Weather

EFFICACY = 179.0  # [lm/W] of Radiance
CLIMATES = (
    "ISL_Reykjavik.040300_IWEC.epw",
    "SGP_Singapore.486980_IWEC.epw",
    "AUS_NSW.Sydney.947670_IWEC.epw",
    "ASHRAE140_725650TYCST_Denver.epw",
    "DEU_Mannheim.107290_IWEC.epw",
    "edge_leapday-test.epw",
)
# gendaymtx computes in float32 and takes cosines from a table: nothing else may differ, so the
# tolerance is ten float32 roundings, four orders below the 1 % that the project asks for
SINGLE = 1e-5


def gendaymtx(radiance, path, subdivision, *options):
    """What gendaymtx gives [P, H] with a white sky (green channel; times 179 if visible)."""
    command = [radiance / "gendaymtx", "-of", "-h", "-c", "1", "1", "1", "-m", str(subdivision)]
    run = subprocess.run([*command, *options, path], capture_output=True, check=True)
    size = ReinhartSky(subdivision).size
    values = np.frombuffer(run.stdout, dtype="<f4").reshape(size, -1, 3)[:, :, 1].astype(float)
    return values * (1.0 if "-O1" in options else EFFICACY)


def assert_same_sky(ours, theirs, subdivision):
    """Annual sum of each patch, and horizontal illuminance of each hour."""
    assert ours.shape == theirs.shape
    weights = ReinhartSky(subdivision).horizontal_weights
    np.testing.assert_allclose(ours.sum(axis=1), theirs.sum(axis=1), rtol=SINGLE)
    np.testing.assert_allclose(weights @ ours, weights @ theirs, rtol=SINGLE, atol=1e-6)
    np.testing.assert_allclose(ours, theirs, rtol=SINGLE, atol=SINGLE * theirs.max())


@pytest.mark.peer
@pytest.mark.parametrize(
    ("subdivision", "output", "band"), [(1, "-O0", "visible"), (1, "-O1", "solar"), (4, "-O0", "visible")]
)
def test_chicago_is_that_of_gendaymtx(chicago, radiance, subdivision, output, band):
    ours = sky_matrix(read_epw(chicago), subdivision, band, sun_model="radiance")
    assert_same_sky(ours, gendaymtx(radiance, chicago, subdivision, output), subdivision)


@pytest.mark.peer
@pytest.mark.parametrize(("output", "band"), [("-O0", "visible"), ("-O1", "solar")])
@pytest.mark.parametrize("name", CLIMATES)
def test_six_climates_are_those_of_gendaymtx(real_data, radiance, name, output, band):
    path = real_data / "epw" / name
    ours = sky_matrix(read_epw(path), 1, band, sun_model="radiance")
    assert_same_sky(ours, gendaymtx(radiance, path, 1, output), 1)


@pytest.mark.peer
@pytest.mark.parametrize(("output", "band"), [("-O0", "visible"), ("-O1", "solar")])
@pytest.mark.parametrize(("place", "leap"), [("-34.93,138.60,9.5,48.0", False), ("67.28,14.40,1.0,13.0", True)])
def test_years_made_here_are_those_of_gendaymtx(tmp_path, radiance, place, leap, output, band):
    """The southern hemisphere and a half-hour zone; the polar circle and a leap year."""
    path = write_epw(tmp_path / "a.epw", epw_rows(leap=leap))
    path.write_text(path.read_text().replace("48.0,8.0,1.0,250.0", place))
    ours = sky_matrix(read_epw(path), 1, band, sun_model="radiance")
    assert_same_sky(ours, gendaymtx(radiance, path, 1, output), 1)


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize(("output", "band"), [("-O0", "visible"), ("-O1", "solar")])
@pytest.mark.parametrize("name", CLIMATES)
def test_six_climates_on_fine_patches(real_data, radiance, name, output, band):
    path = real_data / "epw" / name
    ours = sky_matrix(read_epw(path), 4, band, sun_model="radiance")
    assert_same_sky(ours, gendaymtx(radiance, path, 4, output), 4)


@pytest.mark.peer
@pytest.mark.parametrize(
    ("options", "ours"),
    [
        (("-s",), {"parts": "sky"}),
        (("-d",), {"parts": "sun"}),
        (("-r", "37"), {"rotation_deg": 37.0}),
        (("-u",), {"sun_up_only": True}),
        (("-g", ".6", ".6", ".6"), {"ground_reflectance": 0.6}),
    ],
)
def test_options_are_those_of_gendaymtx(chicago, radiance, options, ours):
    matrix = sky_matrix(read_epw(chicago), 2, sun_model="radiance", **ours)
    assert_same_sky(matrix, gendaymtx(radiance, chicago, 2, *options), 2)


@pytest.mark.peer
def test_five_phase_suns_are_those_of_gendaymtx(tmp_path, chicago, radiance):
    """A month is enough: 5,186 rows for each hour."""
    path = tmp_path / "april.wea"
    write_wea(read_epw(chicago).select(np.arange(24 * 80, 24 * 110)), path)
    april = read_wea(path, whole_year=False)
    ours = sun_matrix(april, 6, sun_model="radiance").toarray()
    theirs = gendaymtx(radiance, path, 6, "-5", "0.533", "-d")
    np.testing.assert_array_equal(ours > 0, theirs > 0)
    # gendaymtx takes pi r^2 for the disc's solid angle: r^2/12 = 2e-6 off
    np.testing.assert_allclose(ours, theirs, rtol=SINGLE)


@pytest.mark.peer
def test_sub_hourly_wea_is_that_of_gendaymtx(tmp_path, radiance):
    weather = read_epw(write_epw(tmp_path / "a.epw", epw_rows(2), 2))
    path = tmp_path / "a.wea"
    write_wea(weather, path)
    ours = sky_matrix(read_wea(path), 1, sun_model="radiance")
    assert_same_sky(ours, gendaymtx(radiance, path, 1), 1)


@pytest.fixture(scope="module")
def weather(tmp_path_factory) -> Weather:
    return read_epw(write_epw(tmp_path_factory.mktemp("sky") / "a.epw", epw_rows()))


@pytest.mark.parametrize("band", ["visible", "solar"])
def test_sky_and_sun_add_up(weather, band):
    every, sky, sun = (sky_matrix(weather, 1, band, part) for part in ("all", "sky", "sun"))
    np.testing.assert_allclose(every, sky + sun, rtol=1e-12)
    assert np.all(every >= 0)
    assert np.all(sun[0] == 0)


def test_diffuse_horizontal_comes_out_exactly(weather):
    for subdivision in (1, 2):
        sky = sky_matrix(weather, subdivision, "solar", "sky")
        diffuse = ReinhartSky(subdivision).horizontal_weights @ sky
        np.testing.assert_allclose(diffuse, weather.diffuse_horizontal, rtol=1e-12)


def test_sun_keeps_its_normal_irradiance(weather):
    sun = sky_matrix(weather, 2, "solar", "sun")
    total = ReinhartSky(2).solid_angles @ sun
    np.testing.assert_allclose(total, weather.direct_normal, rtol=1e-12)
    assert np.max(np.count_nonzero(sun, axis=0)) == 4
    one = sky_matrix(weather, 2, "solar", "sun", sun_patches=1)
    lit = weather.direct_normal > 0
    up = sky_series(weather, "solar").sun[:, 2] > 0
    where = ReinhartSky(2).index(sky_series(weather, "solar").sun)
    # the nearest centre is nearly always that of the patch the sun is in
    assert np.mean(np.argmax(one, axis=0)[lit & up] == where[lit & up]) > 0.97
    disc = sun_matrix(weather, 2, "solar")
    np.testing.assert_array_equal(disc.toarray() > 0, one > 0)
    np.testing.assert_allclose(disc.sum(axis=0) * SUN_SOLID_ANGLE, weather.direct_normal)


def test_ground_is_what_it_reflects(weather):
    series = sky_series(weather, "solar")
    ground = sky_matrix(weather, 1, "solar", ground_reflectance=0.3)[0]
    np.testing.assert_allclose(ground * np.pi, 0.3 * series.global_horizontal)


def test_chunks_and_single_precision_change_nothing(weather, monkeypatch):
    whole = sky_matrix(weather, 1)
    monkeypatch.setattr("mitsuba_cfs.sky.matrix.CHUNK_BYTES", 8 * 146 * 100)
    np.testing.assert_allclose(sky_matrix(weather, 1), whole, rtol=1e-12)
    single = sky_matrix(weather, 1, dtype=np.float32)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, whole, rtol=1e-6)


def test_progress_rises_to_one(weather, monkeypatch):
    monkeypatch.setattr("mitsuba_cfs.sky.matrix.CHUNK_BYTES", 8 * 146 * 1000)
    seen = []
    sky_matrix(weather, 1, progress=lambda stage, fraction: seen.append(fraction))
    assert seen == sorted(seen) and len(seen) > 3 and seen[-1] == 1.0


def test_only_hours_with_sun(weather):
    up = sun_up(weather)
    only = sky_matrix(weather, 1, sun_up_only=True)
    np.testing.assert_allclose(only, sky_matrix(weather, 1)[:, up], rtol=1e-12)


def test_continuous_luminance_is_that_of_fine_patches(weather):
    two = weather.select(np.array([12, 24 * 180 + 9]))
    sky = ReinhartSky(6)
    ours = sky_series(two).luminance(sky.directions[1:], np.arange(2))
    np.testing.assert_allclose(ours, sky_matrix(two, 6, parts="sky")[1:], rtol=1e-12)


@pytest.mark.parametrize(
    "options",
    [
        {"band": "infrared"},
        {"parts": "moon"},
        {"sun_model": "sundial"},
        {"sun_patches": 0},
        {"measured_illuminance": True},
    ],
)
def test_unknown_options(weather, options):
    with pytest.raises(ValueError, match=r"expected|illuminance"):
        sky_matrix(weather, 1, **options)
