"""Sun that the panes of a building reflect to points outdoors: when, how bright, and from where.

Each pane is a plane mirror of its glass: at a point the mirrored sun is seen where the ray to it
first meets a pane, and the sun where it is seen from there.  The sun is a point: its disc of 0.53
degrees adds a minute at either end.
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building
from bim.rays import RayMesh, ray_mesh
from mitsuba_cfs.bsdf.glazing import Glazing, glazing_values
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.sun import altitude, azimuth, direction
from scenes.comply.outdoors import OutdoorMesh, outdoors_of
from scenes.site.sun_year import SunYear

FloatArray = NDArray[np.float64]

COLUMNS, SIGHT = ("name", "x", "y", "z"), ("sight_azimuth_deg", "sight_altitude_deg")
SAME_PLANE = 3  # digits of a normal by which panes are one mirror
APART_DEG = 10.0  # between sun and reflection, below which the sun itself dazzles from there
BESIDE_DEG = 30.0  # of the line of sight
FARTHEST = 1e9  # of a coordinate [m]
NEAR = 0.02  # of a pane, which its element may cover [m]
SUN_SR = 6.79e-5  # solid angle of the sun's disc
TRANSMITTANCE = 0.8  # of a clear double glazing, whose reflectance then follows from the angle


@dataclass(frozen=True, slots=True)
class Observer:
    """A point outdoors that the sun may be reflected to."""

    name: str
    point: FloatArray  # [3] of the eye [m]
    sight: FloatArray | None = None  # [3] unit vector of the line of sight


@dataclass(frozen=True, slots=True)
class Mirrors:
    """The panes of a building, and what is in the way."""

    planes: tuple[tuple[FloatArray, RayMesh, tuple[str, ...]], ...]  # normal, glass, window of each triangle
    outdoors: OutdoorMesh
    panes: NDArray[np.bool_]  # [E] elements that are windows
    reflectance: float  # at normal incidence


def read_observers(file: str | PathLike[str]) -> list[Observer]:
    """The points of a CSV file: name, x, y, z [m], and if wanted sight_azimuth_deg, sight_altitude_deg.

    Raises: `DataError` for a column or a number that is missing.
    """
    try:
        table = pd.read_csv(file)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise DataError(f"is no table: {error}", file=file) from None
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing or not len(table):
        raise DataError(f"expected the columns {', '.join(COLUMNS)} and at least one row", file=file, field="header")
    sights = SIGHT[0] in table.columns
    numbers = [*COLUMNS[1:], *(name for name in SIGHT if name in table.columns)]
    for name in numbers:
        values = pd.to_numeric(table[name], errors="coerce")
        wrong = ~(values.abs() <= FARTHEST) & (table[name].notna() if name in SIGHT else True)
        if wrong.any():
            row = int(np.flatnonzero(wrong)[0])
            raise DataError(f"expected a number, got {table[name].iloc[row]!r} in row {row + 2}", file=file, field=name)
        table[name] = values
    found = []
    for row in table.to_dict("records"):
        sight = None
        if sights and np.isfinite(row[SIGHT[0]]):
            tilt = row.get(SIGHT[1], 0.0)
            sight = direction(np.radians(tilt if np.isfinite(tilt) else 0.0), np.radians(row[SIGHT[0]]))
        found.append(Observer(str(row["name"]), np.array([row[axis] for axis in "xyz"], dtype=float), sight))
    return found


def mirrors_of(building: Building, reflectance: float) -> Mirrors:
    """The exterior panes of all rooms, those of one direction together.

    Raises: `DataError` for a building without any.
    """
    by_normal: dict[tuple[float, ...], list[tuple[FloatArray, str]]] = {}
    for space in building.spaces:
        for window in space.windows:
            key = tuple(np.round(window.normal, SAME_PLANE) + 0.0)
            name = f"{space.label}: {window.name or window.guid}"
            by_normal.setdefault(key, []).append((window.triangles, name))
    if not by_normal:
        raise DataError("no room has an exterior window", element=building.name or None)
    planes = []
    for normal, parts in by_normal.items():
        names = tuple(name for triangles, name in parts for _ in triangles)
        planes.append((np.array(normal), ray_mesh(np.concatenate([t for t, _ in parts])), names))
    outdoors = outdoors_of(building)
    guids = {window.guid for window in building.windows}
    return Mirrors(
        tuple(planes), outdoors, np.array([guid in guids for guid in outdoors.guids], dtype=bool), reflectance
    )


def reflections(observer: Observer, mirrors: Mirrors, sun: SunYear) -> pd.DataFrame:
    """Each moment in which a pane reflects the sun to a point, cloudless: window, direction, illuminance.

    Illuminance is that of the weather, normal to the ray; `shines` says whether the sun shines then.
    """
    found = []
    for normal, glass, names in mirrors.planes:
        towards = sun.directions @ normal
        rays = sun.directions - 2 * towards[:, None] * normal  # from the point to the mirrored sun
        origin = np.tile(observer.point, (len(rays), 1))
        far, triangle = glass.first_hits(origin, rays)
        steps = np.flatnonzero((towards > 0) & np.isfinite(far))
        rays, cosine, far, triangle = rays[steps], towards[steps], far[steps], triangle[steps]
        free = mirrors.outdoors.first_hits(origin[steps], rays, mirrors.panes)[0] > far - NEAR
        steps, rays, cosine, far, triangle = steps[free], rays[free], cosine[free], far[free], triangle[free]
        at = observer.point + far[:, None] * rays + NEAR * normal
        free = ~np.isfinite(mirrors.outdoors.first_hits(at, sun.directions[steps], mirrors.panes)[0])
        steps, rays, cosine, triangle = steps[free], rays[free], cosine[free], triangle[free]
        share = _reflectance(np.arccos(np.clip(cosine, 0, 1)), mirrors.reflectance)
        apart = np.degrees(np.arccos(np.clip(np.sum(rays * sun.directions[steps], axis=1), -1, 1)))
        table = pd.DataFrame(
            {
                "time": sun.times[steps],
                "window": [names[n] for n in triangle],
                "azimuth_deg": np.degrees(azimuth(rays)),
                "altitude_deg": np.degrees(altitude(rays)),
                "reflectance": share,
                "lux": share * sun.illuminance[steps],
                "luminance_cd_m2": share * sun.illuminance[steps] / SUN_SR,
                "apart_from_sun_deg": apart,
                "shines": sun.shines[steps],
            }
        )
        if observer.sight is not None:
            table["from_sight_deg"] = np.degrees(np.arccos(np.clip(rays @ observer.sight, -1, 1)))
        found.append(table)
    return pd.concat(found, ignore_index=True).sort_values(["time", "lux"]).reset_index(drop=True)


def observer_row(observer: Observer, table: pd.DataFrame, step_h: float) -> dict[str, Any]:
    """The year of a point: hours, longest day, brightest moment; hours of one moment count once."""
    row: dict[str, Any] = {"point": observer.name}
    for name, part in (("cloudless", table), ("weather", table[table["shines"]])):
        times = part["time"].drop_duplicates()
        row[f"hours_{name}"] = step_h * len(times)
        row[f"longest_day_min_{name}"] = 60 * step_h * int(times.dt.date.value_counts().max()) if len(times) else 0.0
    far = table[table["apart_from_sun_deg"] >= APART_DEG]
    row["hours_cloudless_apart_10_deg"] = step_h * far["time"].nunique()
    if observer.sight is not None:
        near = table[table["from_sight_deg"] <= BESIDE_DEG]
        row["hours_cloudless_within_30_deg_of_sight"] = step_h * near["time"].nunique()
    if len(table):
        worst = table.iloc[int(table["lux"].to_numpy().argmax())]
        for key in ("lux", "luminance_cd_m2", "time", "window", "azimuth_deg", "altitude_deg"):
            row[f"brightest_{key}"] = worst[key]
    return row


def _reflectance(theta: FloatArray, normal: float) -> FloatArray:
    """Reflectance of a glazing at angles of incidence [rad], from that at normal incidence."""
    glazing = Glazing("glazing", min(TRANSMITTANCE, 1.0 - normal), normal, normal)
    return np.asarray(glazing_values(glazing, theta)[1])
