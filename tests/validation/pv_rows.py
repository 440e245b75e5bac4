"""Photovoltaic modules in rows that shade each other, front and back, against pvlib's models.

    python -m tests.validation pv_rows CITY.epw

Rows of modules above a ground that reflects 0.2, tilted, or upright as the two facades of a street
seen from both sides.  pvlib's `bifacial.infinite_sheds` has rows without ends, black, and its
`shading.shaded_fraction1d` the shaded share of a row in every hour.  That of mitsuba-cfs is `cell_irradiance` of
`cfs pv`, for modules in the middle of the middle row; a back is a sheet of its own, 4 cm behind.

Under a uniform sky both are compared with a quadrature in the plane across the rows: the sky that
each place of the ground and of a module sees, and the ground that a module sees, place by place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import pvlib
from numpy.typing import NDArray

from bim.model import Element
from bim.to_tracer import element_surfaces
from mitsuba_cfs import variants
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.perez import SOLAR_CONSTANT, eccentricity
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from scenes.photovoltaics.irradiance import cell_irradiance
from scenes.photovoltaics.modules import pv_modules

FloatArray = NDArray[np.float64]
WIDTH, LENGTH, MODULE = 2.0, 80.0, 4.0  # of a row up its slope, along it; of the judged module [m]
ROWS = 5  # to each side of the middle one
APART = 0.04  # front from back [m]
MANY_ROWS, ANGLES, PLACES = 60, 2000, 200  # of the quadrature
ALBEDO = 0.2
# tilt [degrees], pitch of the rows, height of their middle [m]
CASES = {
    "tilted 30, ground covered 0.4": (30.0, 5.0, 1.5),
    "tilted 30, ground covered 0.7": (30.0, 2.857, 1.5),
    "upright, pitch 4 of the height": (90.0, 8.0, 1.0),
    "upright, pitch 1.5 of the height": (90.0, 3.0, 1.0),
}


def sheet(guid: str, corners: FloatArray, reflectance: float = 0.0) -> Element:
    """A rectangle [4, 3] that faces one way."""
    triangles = corners[[[0, 1, 2], [0, 2, 3]]]
    return Element(guid, guid, "IfcPlate", triangles, reflectance, reflectance)


def rows(tilt_deg: float, pitch: float, height: float, albedo: float = ALBEDO) -> list[Element]:
    """Rows that face south, and the ground; the judged front and back are "front" and "back"."""
    tilt = np.radians(tilt_deg)
    up = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    normal = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    elements = []
    for number in range(-ROWS, ROWS + 1):
        middle = np.array([0.0, number * pitch, height])
        cuts = [(-LENGTH / 2, LENGTH / 2, "")]
        if number == 0:
            cuts = [(-LENGTH / 2, -MODULE / 2, ""), (-MODULE / 2, MODULE / 2, "judged"), (MODULE / 2, LENGTH / 2, "")]
        for start, end, kind in cuts:
            for side in (1.0, -1.0):
                at = middle + side * APART / 2 * normal
                along = [start, end, end, start]
                ring = at + np.outer([-1.0, -1.0, 1.0, 1.0], up) * WIDTH / 2
                ring[:, 0] += along
                name = ("front" if side > 0 else "back") if kind else f"{number} {start} {side}"
                elements.append(sheet(name, ring if side > 0 else ring[::-1]))
    far = 3.0 * LENGTH
    ground = np.array([[-far, -far, 0], [far, -far, 0], [far, far, 0], [-far, far, 0]])
    return [*elements, sheet("ground", ground, albedo)]


def ours(case: tuple[float, float, float], weather: Weather) -> dict[str, FloatArray]:
    """Irradiance of front and back [h] [W/m2], means of their cells, and the lit steps."""
    elements = rows(*case)
    modules = pv_modules(elements, frozenset({"front", "back"}), substrings=6, along=4)
    found = cell_irradiance(elements, modules, weather)
    means = {"steps": found.steps}
    for number, module in enumerate(modules):
        means[module.guid] = found.plain[found.module == number].mean(axis=0, dtype=float)
    return means


def theirs(case: tuple[float, float, float], weather: Weather, model: str) -> pd.DataFrame:
    """pvlib's irradiance of rows without ends in every hour; the sun's place is ours."""
    tilt, pitch, height = case
    series = sky_series(weather, "solar")
    zenith = np.degrees(np.arccos(series.sun[:, 2]))
    azimuth = np.degrees(np.arctan2(series.sun[:, 0], series.sun[:, 1])) % 360.0
    days = weather.midpoints.day_of_year.to_numpy()
    return pvlib.bifacial.infinite_sheds.get_irradiance(
        tilt,
        180.0,
        pd.Series(zenith),
        pd.Series(azimuth),
        WIDTH / pitch,
        height,
        pitch,
        pd.Series(series.global_horizontal),
        pd.Series(series.diffuse_horizontal),
        pd.Series(series.direct_normal),
        ALBEDO,
        model=model,
        dni_extra=pd.Series(SOLAR_CONSTANT * eccentricity(days)),
        bifaciality=1.0,
        shade_factor=0.0,
    )


def shaded(case: tuple[float, float, float], weather: Weather) -> tuple[FloatArray, FloatArray]:
    """Shaded share of the front in the hours in which the sun is on it: ours, pvlib's."""
    sun_only = replace(weather, diffuse_horizontal=np.full(len(weather.times), 0.01))
    elements = [e for e in rows(*case) if e.guid != "ground"]
    modules = pv_modules(elements, frozenset({"front"}), substrings=6, along=4)
    found = cell_irradiance(elements, modules, replace(sun_only, albedo=0.0), samples=256)
    series = sky_series(sun_only, "solar")
    sun, direct = series.sun[found.steps], series.direct_normal[found.steps]
    tilt = np.radians(case[0])
    cosine = sun @ np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    lit = (cosine > 0.1) & (sun[:, 2] > 0.1) & (direct > 50.0)
    share = found.plain.mean(axis=0, dtype=float)[lit] / (direct * cosine)[lit]
    zenith = np.degrees(np.arccos(sun[lit, 2]))
    azimuth = np.degrees(np.arctan2(sun[lit, 0], sun[lit, 1])) % 360.0
    fraction = pvlib.shading.shaded_fraction1d(
        zenith, azimuth, axis_azimuth=90.0, shaded_row_rotation=case[0], collector_width=WIDTH, pitch=case[1]
    )
    return 1.0 - share, np.asarray(fraction)


def uniform(case: tuple[float, float, float]) -> dict[str, float]:
    """Irradiance under a uniform sky that gives the free ground 1: ours and pvlib's by side."""
    elements = rows(*case)
    modules = pv_modules(elements, frozenset({"front", "back"}), substrings=6, along=4)
    surfaces, found = element_surfaces(elements, "solar"), {}
    one, none = pd.Series([1.0]), pd.Series([0.0])
    peer = pvlib.bifacial.infinite_sheds.get_irradiance(
        case[0],
        180.0,
        one,
        one,
        WIDTH / case[1],
        case[2],
        case[1],
        one,
        one,
        none,
        ALBEDO,
        bifaciality=1.0,
        shade_factor=0.0,
    )
    for module in modules:
        normals = np.tile(module.normal, (len(module.points), 1))
        matrix = sky_irradiance_matrix(surfaces, module.points, normals, subdivision=2)
        found[f"{module.guid}, mitsuba-cfs"] = matrix.values[:, 1:].sum() / len(normals) / np.pi
        found[f"{module.guid}, pvlib"] = float(peer[f"poa_{module.guid}"].iloc[0])
    return found


def quadrature(case: tuple[float, float, float]) -> dict[str, float]:
    """The same of rows without ends, in the plane across them."""
    tilt, pitch, height = np.radians(case[0]), case[1], case[2]
    up, normal = np.array([np.cos(tilt), np.sin(tilt)]), np.array([-np.sin(tilt), np.cos(tilt)])
    middles = np.array([[k * pitch, height] for k in range(-MANY_ROWS, MANY_ROWS + 1)])
    ends = middles - up * WIDTH / 2, middles + up * WIDTH / 2

    def seen(points: FloatArray, facing: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weights [n, a] of directions that end in the sky, of those on the ground, and where."""
        angle = (np.arange(ANGLES) + 0.5) / ANGLES * np.pi - np.pi / 2
        weight = np.cos(angle) * np.pi / ANGLES / 2
        across = np.array([-facing[1], facing[0]])
        rays = np.cos(angle)[:, None] * facing + np.sin(angle)[:, None] * across
        free = np.ones((len(points), ANGLES), dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):
            onto = np.where(rays[:, 1] < 0, -points[:, 1:] / rays[:, 1], np.inf)  # the ground
            for start, end in zip(*ends, strict=True):
                side, gap = end - start, start - points[:, None]
                cross = rays[:, 0] * side[1] - rays[:, 1] * side[0]
                far = (gap[..., 0] * side[1] - gap[..., 1] * side[0]) / cross
                at = (gap[..., 0] * rays[:, 1] - gap[..., 1] * rays[:, 0]) / cross
                free &= ~((far > 1e-9) & (far < onto) & (at >= 0) & (at <= 1))
        place = points[:, :1] + np.where(np.isfinite(onto), onto, 0.0) * rays[:, 0]
        return weight * (free & np.isinf(onto)), weight * (free & np.isfinite(onto)), place

    ground = np.column_stack([(np.arange(PLACES) + 0.5) / PLACES * pitch, np.zeros(PLACES)])
    lit = seen(ground, np.array([0.0, 1.0]))[0].sum(axis=1)
    found = {}
    for side, facing in (("front", normal), ("back", -normal)):
        along = ((np.arange(6) + 0.5) / 6 - 0.5)[:, None] * WIDTH
        sky, below, place = seen(middles[MANY_ROWS] + along * up + 0.025 * facing, facing)
        number = (np.mod(place, pitch) / pitch * PLACES).astype(int) % PLACES
        found[f"{side}, quadrature"] = (sky + ALBEDO * below * lit[number]).sum() / 6
    return found


def main(epw: Path, *, cases: Annotated[Sequence[str], tuple(CASES)] = tuple(CASES)) -> dict[str, pd.DataFrame]:
    """Irradiation of a year of front and back [kWh/m2], shaded shares; both under a uniform sky."""
    variants.activate()
    weather = replace(read_epw(epw), albedo=ALBEDO)
    table, sky = [], []
    for name in cases:
        case = CASES[name]
        mine, row = ours(case, weather), {"rows": name}
        by_model = {model: theirs(case, weather, model) for model in ("isotropic", "haydavies")}
        for side in ("front", "back"):
            row[f"{side}"] = mine[side].sum() / 1e3
            for model, table_of in by_model.items():
                row[f"{side}, pvlib {model}"] = float(table_of[f"poa_{side}"].sum()) / 1e3
        share, fraction = shaded(case, weather)
        row["shaded share"], row["pvlib"] = share.mean(), fraction.mean()
        row["rms"] = float(np.sqrt(np.mean((share - fraction) ** 2)))
        table.append(row)
        plain = uniform(case) | quadrature(case)
        sky.append({"rows": name, **{key: plain[key] for key in sorted(plain)}})
    return {"A year [kWh/m2]": pd.DataFrame(table), "Uniform sky": pd.DataFrame(sky)}
