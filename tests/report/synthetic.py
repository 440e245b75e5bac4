"""A made-up but physically shaped run of two rooms, to try the report on without tracing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Element, Space
from bim.report.issue import Issue
from bim.sensors import sensor_grid, view_point
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.images.hdr import EFFICACY, LUMINANCE_WEIGHTS
from mitsuba_cfs.images.view import View, fisheye, rays
from scenes.results import (
    ColourPicture,
    DaylightResult,
    GlareResults,
    LuminancePicture,
    OperationResult,
    RoomYear,
    RunResult,
    ShadingYear,
    ThermalResult,
)

LATITUDE = np.radians(45.75)


def run_result(*, picture_size: int = 320, pictures: int = 4) -> RunResult:
    """A year in two rooms of an office in Lyon, one facing south and one west."""
    times = pd.date_range("2023-01-01 00:30", periods=8760, freq="h")
    sun = sun_directions(times)
    building = two_rooms()
    rooms = tuple(
        space_result(space, times, sun, picture_size, pictures, seed=i) for i, space in enumerate(building.spaces)
    )
    return RunResult(
        building,
        times,
        sun,
        rooms,
        issues(),
        manifest(),
        ("The venetian blind stays at 45° all year; it is not moved.",),
        "five-phase",
    )


def two_rooms() -> Building:
    """Two shoeboxes side by side with an overhang and a neighbour opposite."""
    wide = (WindowRectangle(0.4, 0.9, 1.9, 1.7, frame=0.06), WindowRectangle(2.7, 0.9, 1.9, 1.7))
    first = shoebox(5.0, 6.0, 3.0, windows=wide, recess=0.2, name="101").spaces[0]
    second = shoebox(4.0, 5.0, 3.0, facing_deg=270.0, recess=0.2, name="102 <corner>").spaces[0]
    first = replace(first, long_name="Open-plan office south")
    second = moved(replace(second, long_name="Meeting room west & archive"), [-7.0, 5.5, 0.0])
    neighbour = slab([-6, -22, 0], [14, -18, 9])
    overhang = slab([-0.2, -1.2, 3.1], [5.2, 0.0, 3.2])
    elements = (
        Element("g1", "Neighbour", "IfcWall", neighbour, 0.3, 0.3),
        Element("g2", "Overhang", "IfcSlab", overhang, 0.5, 0.5),
    )
    return Building("Demo office", (first, second), elements, issues(), 45.75, 4.85, 170.0)


def moved(space: Space, offset: list[float]) -> Space:
    """The room somewhere else."""
    faces = tuple(replace(f, triangles=f.triangles + offset) for f in space.faces)
    windows = tuple(replace(w, triangles=w.triangles + offset) for w in space.windows)
    return replace(space, faces=faces, windows=windows)


def slab(low: list[float], high: list[float]) -> np.ndarray:
    """The 12 triangles of a box."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.array([corners[[q[0], q[i], q[i + 1]]] for q in quads for i in (1, 2)])


def sun_directions(times: pd.DatetimeIndex) -> np.ndarray:
    """Directions to the sun by the textbook declination, in solar time."""
    day, hour = times.day_of_year.to_numpy(), times.hour.to_numpy() + times.minute.to_numpy() / 60
    declination = np.radians(23.45) * np.sin(2 * np.pi * (284 + day) / 365)
    angle = np.radians(15 * (hour - 12))
    up = np.sin(LATITUDE) * np.sin(declination)
    up = up + np.cos(LATITUDE) * np.cos(declination) * np.cos(angle)
    west = np.cos(declination) * np.sin(angle)
    south = np.sin(LATITUDE) * np.cos(declination) * np.cos(angle)
    south = south - np.cos(LATITUDE) * np.sin(declination)
    return np.stack([-west, -south, up], axis=1)


def space_result(space: Space, times, sun, size: int, pictures: int, seed: int) -> RoomYear:
    """Everything for one room."""
    rng = np.random.default_rng(seed)
    cloud = np.repeat(rng.beta(0.8, 0.8, len(times) // 24), 24)  # clearness by day
    outside = np.where(sun[:, 2] > 0, sun[:, 2] * 90000 * (0.25 + 0.75 * cloud), 0.0)
    facing = np.clip(sun @ space.windows[0].normal, 0, 1) * (sun[:, 2] > 0)
    daylight = daylight_result(space, outside, facing * cloud, rng)
    hours = np.argsort(-(facing * cloud * outside))[::400][:pictures]
    operation, year = None, None
    if seed:  # the second room has all there can be
        operation = operation_result(times, facing * cloud, daylight)
        year = annual_glare(times, sun, facing * cloud)
    return RoomYear(
        space,
        daylight,
        glare_results(space, hours, daylight.illuminance, size),
        thermal_result(space, times, facing * cloud, cloud, rng),
        {"view matrix": 4.21, "daylight matrix": 11.8, "annual product": 0.92, "pictures": 8.3},
        operation,
        year,
    )


def operation_result(times, beam, daylight) -> OperationResult:
    """A blind that closes in the sun, heating in winter, cooling in summer."""
    day, hour = times.day_of_year.to_numpy(), times.hour.to_numpy()
    winter = np.cos(2 * np.pi * (day - 20) / 365)
    used = (hour >= 7) & (hour < 19)
    lamps = 200 * used * np.clip(1 - daylight.illuminance.mean(axis=1) / 500, 0, 1)
    hours = pd.DataFrame(
        {
            "shading_state": np.digitize(beam, [0.2, 0.5]),
            "heating_w": 900 * np.clip(winter, 0, 1) * used,
            "cooling_w": 700 * np.clip(-winter, 0, 1) * used,
            "lighting_w": lamps,
        },
        index=times,
    )
    summary = {f"{n}_kwh": float(hours[f"{n}_w"].sum() / 1e3) for n in ("heating", "cooling")}
    summary |= {"lighting_kwh": float(lamps.sum() / 1e3), "peak_heating_w": 900.0}
    states = hours["shading_state"].to_numpy()[:, None]
    shading = ShadingYear(
        ("S",), ("irradiance",), states, np.zeros(1, dtype=np.int64), views=(np.array([True, False]),)
    )
    return OperationResult(("open", "slats 40°", "closed <70°>"), hours, summary, shading)


def annual_glare(times, sun, beam) -> pd.DataFrame:
    """Glare that follows the sun on the facade, missing at night."""
    dgp = np.where(sun[:, 2] > 0, 0.2 + 0.35 * beam, np.nan)
    columns = {"dgp": dgp, "dgp_standard_error": 0 * dgp + 2e-5, "ev": (dgp - 0.184) / 6.22e-5}
    return pd.DataFrame(columns, index=times)


def daylight_result(space: Space, outside, beam, rng) -> DaylightResult:
    """Illuminance that falls off with the distance from the windows."""
    points, _ = sensor_grid(space, 0.5)
    depth = np.min([(w.centre - points) @ w.normal for w in space.windows], axis=0)
    factor = 0.09 * np.exp(-depth / 1.9) + 0.004
    light = outside[:, None] * factor * (1 + 2.5 * beam[:, None] * np.exp(-depth / 1.2))
    light = (light * rng.lognormal(0, 0.03, light.shape)).astype(np.float32)
    day = (outside > 0) | True
    used = day & np.tile((np.arange(24) >= 8) & (np.arange(24) < 18), len(outside) // 24)
    share = lambda condition: 100 * condition[used].mean(axis=0)  # noqa: E731
    metrics = pd.DataFrame(
        {
            "x": points[:, 0],
            "y": points[:, 1],
            "z": points[:, 2],
            "da300": share(light >= 300),
            "cda300": 100 * np.minimum(light[used] / 300, 1).mean(axis=0),
            "udi_below_100": share(light < 100),
            "udi_100_300": share((light >= 100) & (light < 300)),
            "udi_300_3000": share((light >= 300) & (light <= 3000)),
            "udi_above_3000": share(light > 3000),
            "sunlit_hours": 800.0 * np.exp(-depth / 1.2),
            "daylight_factor": 100 * factor,
        }
    )
    direct = light * (beam[:, None] > 0.25)
    room = {
        "sda300_50": float((metrics["da300"] >= 50).mean() * 100),
        "ase1000_250": float(((direct[used] >= 1000).sum(axis=0) > 250).mean() * 100),
        "daylight_factor": float(metrics["daylight_factor"].mean()),
        "en17037_level": 1.0,
        "en17037_target_lx": 412.0,
        "en17037_minimum_lx": 131.0,
    }
    error = 0.006 + 0.01 * rng.random(len(points))
    return DaylightResult(points, light, error, metrics, room)


def glare_results(space: Space, hours, illuminance, size: int) -> GlareResults:
    """Fisheye pictures: a dim room, bright windows, a sun behind slats."""
    view = fisheye(*view_point(space), size)
    pictures = []
    for rank, hour in enumerate(hours):
        luminance, mask = fisheye_luminance(space, view, 9000.0 / (1 + rank), seed=int(hour))
        ev = float(illuminance[hour].mean() * 0.7)
        dgp = float(np.clip(5.87e-5 * ev + 0.22 - 0.02 * rank, 0.18, 1.0))
        glare = {
            "dgp": dgp,
            "ev": ev,
            "dgi": 19.2 - rank,
            "ugr": 21.7 - rank,
            "vcp": 43.0,
            "cgi": 24.1 - rank,
            "sources": float(3 - min(rank, 2)),
            "dgp_standard_error": 2e-5,
        }
        pictures.append(LuminancePicture(int(hour), luminance, glare, mask))
    shown = max(pictures, key=lambda picture: picture.glare["ev"], default=None)
    colour = None if shown is None else ColourPicture(shown.hour, warm(shown.luminance))
    return GlareResults(view, tuple(pictures), colour=colour)


def warm(luminance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Radiance [ny, nx, 3] of a luminance picture, redder than grey."""
    tint = np.array([1.3, 0.95, 0.6])
    return luminance[..., None] / EFFICACY * (tint / (tint @ np.asarray(LUMINANCE_WEIGHTS)))


def fisheye_luminance(space: Space, view: View, sky: float, seed: int):
    """Luminance [ny, nx] and the mask of the pixels that glare."""
    rng = np.random.default_rng(seed)
    x, y = (np.arange(view.width) + 0.5) / view.width, (np.arange(view.height) + 0.5) / view.height
    directions, exists = rays(view, x[None, :], 1 - y[:, None])
    luminance = np.where(directions[..., 2] < -0.2, 60.0, 110.0) * (1 + 0.4 * directions[..., 2])
    mask = np.zeros(exists.shape, bool)
    for window in space.windows:
        low, high = (f(window.triangles.reshape(-1, 3), axis=0) for f in (np.min, np.max))
        facing = directions @ window.normal
        t = (window.centre - view.position) @ window.normal / np.where(facing > 0.01, facing, np.nan)
        hit = np.asarray(view.position) + t[..., None] * directions
        inside = np.all((hit >= low - 1e-3) & (hit <= high + 1e-3), axis=-1)
        slat = np.mod(hit[..., 2], 0.08) < 0.05
        luminance = np.where(inside, np.where(slat, 0.15 * sky, sky), luminance)
        mask |= inside & ~slat & (sky > 2000)
    luminance = luminance * rng.lognormal(0, 0.08, luminance.shape)
    return np.where(exists, luminance, 0.0).astype(np.float32), mask & exists


def thermal_result(space: Space, times, beam, cloud, rng) -> ThermalResult:
    """Free-floating temperatures that follow the seasons, the sun and the day."""
    day, hour = times.day_of_year.to_numpy(), times.hour.to_numpy()
    outdoor = 12.5 - 10 * np.cos(2 * np.pi * (day - 20) / 365)
    outdoor = outdoor - 4 * (0.5 + cloud) * np.cos(2 * np.pi * (hour - 3) / 24)
    area = sum(w.area for w in space.windows)
    incident = area * (700 * beam + 80 * np.clip(np.sin(np.pi * (hour - 6) / 12), 0, 1))
    smooth = pd.Series(incident, times).ewm(halflife=20).mean().to_numpy()
    air = outdoor * 0.75 + 6.5 + smooth / 150 + rng.normal(0, 0.1, len(times))
    radiant = pd.Series(air + smooth / 500, times).ewm(halflife=6).mean().to_numpy()
    operative = (air + radiant) / 2
    running = pd.Series(outdoor, times).ewm(halflife=72).mean().to_numpy()
    comfort_c, covered = 0.31 * running + 17.8, (running > 10) & (running < 33.5)
    occupied = (hour >= 8) & (hour < 18) & (times.day_of_week.to_numpy() < 5)
    off = np.abs(operative - comfort_c)
    comfort = pd.DataFrame(
        {
            "occupied": occupied,
            "running_mean_c": running,
            "comfort_c": comfort_c,
            "applicable": covered,
            "within_80": (off <= 3.5) & covered,
            "within_90": (off <= 2.5) & covered,
        },
        index=times,
    )
    temperatures = pd.DataFrame(
        {
            "outdoor_c": outdoor,
            "air_c": air,
            "mrt_c": radiant,
            "operative_c": operative,
            "floor_c": radiant - 0.3,
            "ceiling_c": radiant + 0.4,
        },
        index=times,
    )
    gains = pd.DataFrame(
        {
            "incident_w": incident,
            "transmitted_w": 0.21 * incident,
            "absorbed_outer_w": 0.28 * incident,
            "absorbed_inner_w": 0.11 * incident,
            "absorbed_room_w": 0.18 * incident,
        },
        index=times,
    )
    used = comfort[occupied]
    summary = {
        "within_80": 100 * used.within_80.mean(),
        "within_90": 100 * used.within_90.mean(),
        "too_warm_hours": 210.0,
        "outside_the_model_hours": 1092.0,
    }
    fenestration = {
        "system": "Venetian blind <45>",
        "u_value": 1.27,
        "g_value": 0.314,
        "visible_transmittance": 0.187,
        "solar_transmittance": 0.121,
        "solar_reflectance": 0.402,
    }
    return ThermalResult(temperatures, gains, comfort, summary, (fenestration,))


def issues() -> tuple[Issue, ...]:
    """Faults as the IFC reader reports them."""
    return (
        Issue("construction-assumed", "2O2Fr$t4X7Zf8NOew3FLOH", {"room": "Office <blank>", "count": 2}),
        Issue("site-without-position", "office.ifc"),
    )


def manifest() -> dict:
    """What run.json holds."""
    return {
        "inputs": {
            "building": {"path": "office.ifc", "sha256": "9f2c" * 16, "bytes": 182331},
            "weather": {"path": "FRA_Lyon.074810_IWEC.epw", "sha256": "01ab" * 16},
            "system": {"path": "venetian45.xml", "sha256": "77de" * 16},
        },
        "options": {"weather": "x.epw", "sky_subdivision": 1, "sensor_spacing": 0.5, "spaces": []},
        "versions": {"mitsuba-cfs": "0.2.0", "mitsuba": "3.9.1", "drjit": "1.5.0"},
        "seed": 1,
        "variant": "llvm_ad_mono",
        "seconds": 51.0,
    }
