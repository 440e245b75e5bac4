"""Modules found among a model's elements, and their irradiance hour by hour."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bim.model import Element
from mitsuba_cfs.sky.epw import read_epw
from scenes.photovoltaics.modules import pv_modules
from tests.validation.pv_rows import CASES, quadrature, uniform

pytestmark = pytest.mark.usefixtures("variant")

DEMO = Path(__file__).parent.parent.parent / "scenes" / "demo"
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(guid: str, low, high, *, reflectance: float = 0.0) -> Element:
    """A closed box along the axes."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    p = np.array(
        [
            [x0, y0, z0],
            [x1, y0, z0],
            [x1, y1, z0],
            [x0, y1, z0],
            [x0, y0, z1],
            [x1, y0, z1],
            [x1, y1, z1],
            [x0, y1, z1],
        ],
        dtype=float,
    )
    triangles = [[p[f[0]], p[f[i]], p[f[i + 1]]] for f in FACES for i in (1, 2)]
    return Element(guid, guid, "IfcSolarDevice", np.array(triangles), reflectance, reflectance)


WALL = box("wall", (-5, 0, 0), (5, 0.3, 8))
PANEL = box("panel", (-0.5, -0.14, 1), (0.5, -0.10, 3))  # south of the wall, upright


def test_active_face_is_the_one_away_from_the_wall():
    (module,) = pv_modules([WALL, PANEL], frozenset({"panel"}), substrings=2, along=5)
    np.testing.assert_allclose(module.normal, [0, -1, 0], atol=1e-9)
    assert (module.azimuth_deg, module.tilt_deg) == pytest.approx((180, 90))
    assert module.area == pytest.approx(2.0)
    assert module.points[:, 1] == pytest.approx(-0.145)
    # strips across the short side x, groups along z
    for strip in range(2):
        own = module.points[module.substring == strip]
        assert np.ptp(own[:, 0]) == pytest.approx(0)
        assert sorted(own[:, 2]) == pytest.approx([1.2, 1.6, 2.0, 2.4, 2.8])
    sides = np.linalg.norm(module.edges, axis=-1)
    assert sides == pytest.approx(np.tile([0.5, 0.4], (10, 1)))


def test_lone_sheet_looks_to_the_free_side():
    a, b, c, d = [-1.0, -0.2, 1], [1, -0.2, 1], [1, -0.2, 3], [-1, -0.2, 3]
    sheet = Element("s", "s", "IfcPlate", np.array([[c, b, a], [d, c, a]], dtype=float), 0.1, 0.1)
    (module,) = pv_modules([WALL, sheet], frozenset({"s"}))
    np.testing.assert_allclose(module.normal, [0, -1, 0], atol=1e-9)


@pytest.fixture(scope="module")
def two_days():
    """A clear and a cloudy day of the demo's weather."""
    weather = read_epw(next(DEMO.glob("*.epw")))
    return weather.select(np.arange(24 * 170, 24 * 172))


def test_free_flat_module_gets_the_global_horizontal_irradiance(variant, two_days):
    from mitsuba_cfs.sky.matrix import sky_series
    from scenes.photovoltaics.irradiance import cell_irradiance

    flat = box("m", (0, 0, 5), (1, 2, 5.04))
    modules = pv_modules([flat], frozenset({"m"}))
    found = cell_irradiance([flat], modules, two_days)
    series = sky_series(two_days, "solar")
    expected = series.global_horizontal[found.steps]
    # 1 %: the sky's patches against the cosine inside each; the sampling error is below 0.3 %
    np.testing.assert_allclose(found.plain.mean(axis=0), expected, rtol=0.01, atol=1.0)
    assert np.all(found.effective < found.plain * 1.001)
    assert 0.93 < found.effective.sum() / found.plain.sum() < 0.99
    assert found.diffuse_error < 0.01


def test_free_upright_modules_have_the_sky_that_pvlib_gives_tilted_planes(variant, two_days):
    """Perez 1990, as for the heat: of two modules back to back, 2 % of the diffuse light each."""
    from pvlib import irradiance

    from mitsuba_cfs.sky.matrix import sky_series
    from mitsuba_cfs.sky.perez import SOLAR_CONSTANT, air_mass, eccentricity
    from scenes.photovoltaics.irradiance import cell_irradiance

    sheets = [
        box("south", (0, 0, 5), (1, 0.04, 7)),
        box("wall", (0, 0.05, 5), (1, 0.1, 7)),
        box("north", (0, 0.11, 5), (1, 0.15, 7)),
    ]
    modules = pv_modules(sheets, frozenset({"south", "north"}))
    found = cell_irradiance(sheets, modules, two_days)
    series = sky_series(two_days, "solar")
    sun, steps = series.sun[found.steps], found.steps
    zenith = np.arccos(sun[:, 2])
    direct, diffuse = series.direct_normal[steps], series.diffuse_horizontal[steps]
    ground = 0.5 * 0.2 * series.global_horizontal[steps]
    days = two_days.midpoints.day_of_year.to_numpy()[steps]
    for number, module in enumerate(modules):
        azimuth = module.azimuth_deg
        sky = irradiance.perez(
            90.0,
            azimuth,
            diffuse,
            direct,
            SOLAR_CONSTANT * eccentricity(days),
            np.degrees(zenith),
            np.degrees(np.arctan2(sun[:, 0], sun[:, 1])),
            air_mass(zenith),
            model="allsitescomposite1990",
        )
        beam = direct * np.maximum(sun @ module.normal, 0.0)
        ours = found.plain[found.module == number].mean(axis=0)
        assert abs((ours - beam - ground - sky).sum()) < 0.02 * diffuse.sum()


def test_shade_of_a_black_fin_is_sharp_and_reflections_count(variant, two_days):
    from mitsuba_cfs.sky.matrix import sky_series
    from scenes.photovoltaics.irradiance import cell_irradiance

    flat = box("m", (0, 0, 5), (1, 2, 5.04))
    south = box("screen", (-50, -0.2, 0), (50, -0.1, 60))
    modules = pv_modules([flat], frozenset({"m"}))
    series = sky_series(two_days, "solar")
    dark, bright = (
        cell_irradiance([flat, Element(**{**_fields(south), "reflectance_solar": r})], modules, two_days)
        for r in (0.0, 0.8)
    )
    sun = series.sun[dark.steps]
    hidden = (sun[:, 1] < -0.05) & (sun[:, 2] > 0.05)
    assert hidden.sum() > 8
    beam = series.direct_normal[dark.steps] * sun[:, 2]
    # half the sky is left at most, and none of the sun
    left = dark.plain.mean(axis=0)[hidden]
    assert np.all(left < 0.75 * series.diffuse_horizontal[dark.steps][hidden] + 1)
    assert beam[hidden].max() > 300
    north = (sun[:, 1] > 0.05) & (beam > 20)
    gain = (bright.plain - dark.plain).mean(axis=0)
    assert np.all(gain > -1) and np.all(gain[north] > 1)


def _fields(element: Element) -> dict:
    return {name: getattr(element, name) for name in element.__slots__}


def test_command_from_ifc_to_yield(variant, tmp_path, capsys):
    from scenes import cli
    from scenes.demo.make_facade import facade

    model = tmp_path / "facade.ifc"
    facade().write(str(model))
    text = (DEMO / "facade_pv.toml").read_text()
    head = text[: text.index("[[subsystem]]")].replace(
        "'IfcElement, material=\"PV laminate\"'", "'IfcElement, Name=/PV 09 row 0 .*/'"
    )
    study = tmp_path / "pv.toml"
    study.write_text(head)
    out = tmp_path / "out"
    weather = next(DEMO.glob("*.epw"))
    run = ["pv", str(model), "--weather", str(weather), "--out", str(out), "--no-cache"]
    assert cli.run([*run, "--study", str(study)]) == 0
    table = pd.read_csv(out / "modules.csv")
    assert len(table) == 6
    assert table.azimuth_deg.to_numpy() == pytest.approx(135)
    assert table.tilt_deg.to_numpy() == pytest.approx(15)
    found = pd.read_csv(out / "yield.csv").iloc[0]
    assert found.modules == 6 and found.subsystem == "roof"
    # Chicago, 15 degrees to the south-east: PVWatts-like 1200 to 1350 kWh/kW free of shade
    assert 950 < found.kwh_per_kw < 1350
    hourly = pd.read_parquet(out / "power_w.parquet")
    assert hourly.roof.sum() / 1000 == pytest.approx(found.yield_kwh, rel=1e-4)
    assert list(out.glob("irradiation_from_*.png"))

    for wrong, said in (
        (head.replace("cells = 60", "cells = 6"), "no two-diode cell"),
        (head.replace("PV 09 row 0 .*", "nothing"), "chooses no element"),
        (head.replace("current = 8.05", "current = -1"), "module.current"),
        (head + '\n[[subsystem]]\nname = "x"\nselect = "IfcSlab"\n', "none of the modules"),
        (head.replace("select = 'Ifc", "select = 'Ifc,,("), "pv.toml: Ifc,,("),
    ):
        study.write_text(wrong)
        capsys.readouterr()
        assert cli.run([*run, "--study", str(study)]) == 1
        error = [line for line in capsys.readouterr().err.splitlines() if "error" in line]
        assert len(error) == 1 and said in error[0], error


def test_the_facade_comes_with_its_study(tmp_path) -> None:
    from scenes.demo.make_facade import write_facade
    from scenes.photovoltaics.study_file import read_pv_study

    write_facade(tmp_path / "facade.ifc")
    assert read_pv_study(tmp_path / "facade_pv.toml").module.cells > 1
    assert "IFC4" in (tmp_path / "facade.ifc").read_text(encoding="utf-8")


def test_rows_under_a_uniform_sky_are_the_quadratures(variant) -> None:
    """Front 0.5 %; back 2 %: our sheets are 4 cm apart. pvlib's ground has one mean: 8 % more."""
    case = CASES["tilted 30, ground covered 0.4"]
    found, expected = uniform(case), quadrature(case)
    for side, share in (("front", 0.005), ("back", 0.02)):
        judge = expected[f"{side}, quadrature"]
        assert found[f"{side}, mitsuba-cfs"] == pytest.approx(judge, rel=share)
    assert found["back, pvlib"] > 1.05 * expected["back, quadrature"]
