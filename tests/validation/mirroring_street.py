r"""Five phases between mirroring facades, beside path tracing.

    python -m tests.validation mirroring_street [--hours 53] [--share 0.15]

A room in one of two facades, 14 m apart and 15 m high, that mirror a share of all light and are
black otherwise; the street reflects a fifth.  Sunny hours of the demo's weather, spread over the
year; illuminance of eight sensors by both methods.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import numpy as np
import pandas as pd

import mitsuba_cfs as cfs
from mitsuba_cfs.gloss import mirror
from mitsuba_cfs.methods.light import illuminance_with_noise
from mitsuba_cfs.metrics.noise import Noise
from mitsuba_cfs.surfaces import Surfaces
from scenes.demo import WEATHER
from tests.trace import rooms

HALF, HIGH, LOW, WIDE = 60.0, 15.0, -6.0, 14.0  # the street: half length, facades, width [m]
GROUND = 0.2
SUNNY_LX = 30_000.0  # of the sun, normal to it
POINTS = np.array([(x, y, 0.85) for y in (0.6, 1.5, 2.5, 3.5) for x in (0.9, 2.7)])
GLASS = (0.0, 0.3, 0.5, 0.6, 0.65)  # transmittance by even steps of the cosine
BEYOND = 0.1


def street(share: float) -> Surfaces:
    """Both facades, with a hole for the room's window, and the ground."""
    quad, z0, z1 = rooms.quad, rooms.Z0, rooms.Z1

    def upright(x0: float, x1: float, low: float, high: float) -> np.ndarray:
        return quad((x0, 0, low), (x1, 0, low), (x1, 0, high), (x0, 0, high))

    facades = [
        upright(-HALF, HALF, z1, HIGH),
        upright(-HALF, HALF, LOW, z0),
        upright(-HALF, rooms.X0, z0, z1),
        upright(rooms.X1, HALF, z0, z1),
        quad((HALF, -WIDE, LOW), (-HALF, -WIDE, LOW), (-HALF, -WIDE, HIGH), (HALF, -WIDE, HIGH)),
    ]
    ground = quad((-HALF, -WIDE, LOW), (HALF, -WIDE, LOW), (HALF, 0, LOW), (-HALF, 0, LOW))
    triangles = np.concatenate([*facades, ground])
    surface = np.repeat([0, 0, 0, 0, 1, 2], 2)
    glosses = mirror(share), mirror(share), None
    return Surfaces(triangles, np.where(surface == 2, GROUND, 0.0), surface, (), glosses)


def main(
    *,
    hours: Annotated[int, "with sun"] = 53,
    share: Annotated[float, "that the facades mirror"] = 0.15,
    paths: Annotated[int, "of a sensor in an hour"] = 65536,
) -> pd.DataFrame:
    """A row for the mean of the sensors and for single sensors: deviations from path tracing."""
    room, groups = rooms.test_room()
    up = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
    scene = cfs.DaylightScene(room, street(share), groups, points=POINTS, normals=up)
    year = cfs.annual_sky(cfs.read_epw(WEATHER))
    sunny = np.flatnonzero(year.illuminance > SUNNY_LX)
    sky = year.part(sunny[np.linspace(0, len(sunny) - 1, hours).astype(np.int64)])
    lux, errors = [], []
    for method in ("five-phase", "point-in-time"):
        sampling = cfs.Sampling(hour_samples=paths)
        light = cfs.daylight(scene, [[cfs.AngularOptics(GLASS)]], sky, method=method, sampling=sampling)
        values, noise = illuminance_with_noise(light)
        lux.append(values)
        errors.append(hourly_errors(noise, values.shape))
    stated = np.hypot(*errors)
    rows = []
    for name, (five, by_paths) in (
        ("mean of the sensors", [values.mean(axis=0) for values in lux]),
        ("single sensors", lux),
    ):
        off = five / by_paths - 1
        row = {
            "illuminance": name,
            "values": off.size,
            "beyond 10 %": int((np.abs(off) > BEYOND).sum()),
            "mean %": 100 * float(off.mean()),
            "median %": 100 * float(np.median(np.abs(off))),
            "most %": 100 * float(np.abs(off).max()),
        }
        if five.ndim == 2:
            within, far = np.abs(five - by_paths) < 2 * stated, np.abs(off) > BEYOND
            row["within 2 standard errors %"] = 100 * float(within.mean())
            row["of those beyond 10 %"] = 100 * float(within[far].mean())
            row["error of five phases %"], row["error of paths %"] = (
                100 * float(np.median(one / by_paths)) for one in errors
            )
        rows.append(row)
    return pd.DataFrame(rows).round(1)


def hourly_errors(noise: Callable[[np.ndarray], Noise], shape: tuple[int, ...]) -> np.ndarray:
    """Standard error of each hour of each sensor [S, L] [lx] by `illuminance_with_noise`."""
    found = np.zeros(shape)
    for hour in range(shape[1]):
        weights = np.zeros(shape)
        weights[:, hour] = 1.0
        found[:, hour] = noise(weights).standard_error()
    return found
