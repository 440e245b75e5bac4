"""Where a building lies on the map: from map coordinates to the building's own world."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError

LONGITUDE_LATITUDE = "OGC:CRS84"  # degrees, as GeoJSON has them (RFC 7946)
EQUATOR, FLATTENING = 6378137.0, 1 / 298.257223563  # WGS 84 [m], [1]


@dataclass(frozen=True, slots=True)
class Georeference:
    """The map that a building lies on, and the way from its coordinates to the world's."""

    crs: str  # of the map: "EPSG:25832"
    to_world: NDArray[np.float64]  # [4, 4] of east, north, height [m]


def crs_name(text: str) -> str:
    """One spelling of a coordinate reference system: "EPSG:25832" for its code, URN or URL.

    Of a compound system only the name is kept; GeoJSON's CRS84 has one of its own, and so have the
    German surveys' ETRS89_UTM31 to 33.
    """
    if re.search(r"CRS84", text, re.IGNORECASE):
        return LONGITUDE_LATITUDE
    zone = re.search(r"ETRS89_UTM(3[123])(?!\d)", text, re.IGNORECASE)
    if zone:
        return f"EPSG:258{zone[1]}"
    found = re.search(r"EPSG\D+(?:[\d.]+[:/]+)?(\d{4,6})\b", text, re.IGNORECASE)
    return f"EPSG:{found[1]}" if found else text.strip()


def local_metres(
    lon_lat: NDArray[np.float64], longitude_deg: float, latitude_deg: float
) -> NDArray[np.float64]:
    """East and north [N, 2] [m] of places [N, 2] [deg] from one among them.

    By the ellipsoid's two radii of curvature there, to the second order of the distance (a parallel
    is curved): 0.01 m off at 3 km and 50 degrees.
    """
    phi = np.radians(latitude_deg)
    e2 = FLATTENING * (2 - FLATTENING)
    root = 1 - e2 * np.sin(phi) ** 2
    across, along = EQUATOR / np.sqrt(root), EQUATOR * (1 - e2) / root**1.5
    north = np.radians(lon_lat[:, 1] - latitude_deg)
    longitude = np.radians((lon_lat[:, 0] - longitude_deg + 180) % 360 - 180)
    east = longitude * (across * np.cos(phi) - north * along * np.sin(phi))
    return np.column_stack([east, north * along + east**2 * np.tan(phi) / (2 * across)])


def transformed(
    points: NDArray[np.float64], crs: str, target: str, *, file: str
) -> NDArray[np.float64]:
    """Map coordinates [N, 2] of one system in another one, easting or longitude first.

    Raises: `DataError` where `pyproj` is not installed, or knows one of the two not.
    """
    if crs == target:
        return points
    try:
        import pyproj
    except ImportError:
        message = f"{crs} to {target}: needs pyproj (pip install 'mitsuba-cfs[georeference]')"
        raise DataError(message, file=file, field="coordinate system") from None
    try:
        change = pyproj.Transformer.from_crs(crs, target, always_xy=True)
        moved = np.column_stack(change.transform(points[:, 0], points[:, 1]))
    except pyproj.exceptions.ProjError as error:
        reason = str(error).splitlines()[0]
        raise DataError(reason, file=file, field="coordinate system") from None
    if not np.isfinite(moved).all():
        message = f"coordinates lie outside of {crs} or {target}"
        raise DataError(message, file=file, field="coordinate system")
    return moved
