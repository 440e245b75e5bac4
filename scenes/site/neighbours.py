"""Daylight and sun that the windows of a building lose by a proposed neighbour, after BRE's guide.

Vertical sky component (VSC): illuminance of the overcast sky on the window's plane over that of
unobstructed ground.  Annual probable sunlight hours (APSH): share of the hours in which the sun
shines on unobstructed ground that reach the window.  No-sky line: share of a room's working plane
from which some sky is visible through its windows.

Source: P. Littlefair, S. King, G. Howlett, C. Ticleanu, A. Longfield, "Site layout planning for
daylight and sunlight: a guide to good practice", BR 209 (BRE 2022), sections 2.2 and 3.2 and
appendix D, by secondary sources (lightinganalysts.co.uk, right-of-light.co.uk) and from memory.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.rays import RayMesh, ray_mesh
from bim.sensors import sensor_grid
from mitsuba_cfs.sky.cie import relative_luminance
from scenes.comply.openings import Opening, openings_of
from scenes.comply.outdoors import OutdoorMesh, opaque_room, outdoors_of
from scenes.site.sun_year import SunYear

FloatArray = NDArray[np.float64]

VSC_PERCENT, RATIO = 27.0, 0.8
APSH_PERCENT, WINTER_PERCENT, APSH_LOSS = 25.0, 5.0, 4.0
GRID = 0.25  # of its points [m]
SKY_STEP_DEG = 1.5  # of the sky that VSC adds up
DEEPEST_REVEAL, REVEAL_STEP = 0.6, 0.02  # outside the glass [m]
ACROSS = 8  # points of a glass in each direction through which the sky is looked for


@dataclass(frozen=True, slots=True)
class Site:
    """A building among what is outdoors, as rays see it."""

    building: Building
    outdoors: OutdoorMesh

    @classmethod
    def of(cls, building: Building) -> Site:
        """With the elements of the building and its surroundings."""
        return cls(building, outdoors_of(building))


def window_table(before: Site, after: Site, sun: SunYear) -> pd.DataFrame:
    """VSC and APSH [%] of each window before and after, and whether the guide is met.

    Sunlight is asked of windows that face within 90 degrees of the equator.
    """
    rows = []
    north = after.building.latitude_deg is None or after.building.latitude_deg >= 0
    for space in before.building.spaces:
        own_before, own_after = (site.outdoors.windows_of(space) for site in (before, after))
        for opening in openings_of(space):
            if opening.is_horizontal:
                continue
            point = reference_point(opening, before.outdoors, own_before)
            row: dict[str, object] = {"room": space.label, "window": opening.window.name or opening.window.guid}
            for name, site, own in (("before", before, own_before), ("after", after, own_after)):
                row[f"vsc_{name}_percent"] = 100 * vertical_sky_component(point, opening.normal, site.outdoors, own)
                year, winter = sunlight_hours(point, opening.normal, site.outdoors, own, sun)
                row[f"apsh_{name}_percent"], row[f"apsh_winter_{name}_percent"] = 100 * year, 100 * winter
            faces_sun = (opening.normal[1] < 0) == north
            row["vsc_met"] = vsc_met(row["vsc_before_percent"], row["vsc_after_percent"])
            row["apsh_met"] = apsh_met(row) if faces_sun else None
            rows.append(row)
    return pd.DataFrame(rows)


def room_table(before: Site, after: Site, *, height: float) -> pd.DataFrame:
    """Share of each room's working plane with a view of the sky, before and after, and whether the guide is met."""
    rows = []
    for space in before.building.spaces:
        if not space.windows:
            continue
        points, _ = sensor_grid(space, GRID, height, 0.0)
        first, last = (100 * sees_sky(points, space, site.outdoors).mean() for site in (before, after))
        rows.append(
            {
                "room": space.label,
                "floor_m2": space.floor_area,
                "sky_visible_before_percent": first,
                "sky_visible_after_percent": last,
                "no_sky_line_met": bool(last >= RATIO * first),
            }
        )
    return pd.DataFrame(rows)


def vsc_met(before: object, after: object) -> bool:
    """Whether VSC is 27 % or 0.8 times what it was."""
    return bool(float(after) >= VSC_PERCENT or float(after) >= RATIO * float(before))  # type: ignore[arg-type]


def apsh_met(row: dict[str, object]) -> bool:
    """Whether a window has 25 % (5 % in winter), or 0.8 times what it had, or loses at most 4 % of the year."""
    (year_0, year), (winter_0, winter) = (
        (float(row[f"{key}_before_percent"]), float(row[f"{key}_after_percent"]))  # type: ignore[arg-type]
        for key in ("apsh", "apsh_winter")
    )
    enough = year >= APSH_PERCENT and winter >= WINTER_PERCENT
    kept = year >= RATIO * year_0 and winter >= RATIO * winter_0
    return bool(enough or kept or year_0 - year <= APSH_LOSS)


def vertical_sky_component(
    point: FloatArray, normal: FloatArray, outdoors: OutdoorMesh, own: NDArray[np.bool_]
) -> float:
    """Illuminance of the overcast sky on a plane over that of unobstructed ground; 0.396 of a vertical one.

    Args: normal: [3] of the plane; own: elements [E] that are looked through.
    """
    directions, solid_angles = sky_directions()
    light = relative_luminance("overcast", directions) * solid_angles
    seen = directions @ normal > 0
    free = np.zeros(len(directions), dtype=bool)
    free[seen] = _free(point, directions[seen], outdoors, own)
    return float((light * np.clip(directions @ normal, 0, None))[free].sum() / (light @ directions[:, 2]))


def sunlight_hours(
    point: FloatArray, normal: FloatArray, outdoors: OutdoorMesh, own: NDArray[np.bool_], sun: SunYear
) -> tuple[float, float]:
    """Shares of the annual probable sunlight hours that a window gets: in the whole year, and in winter alone."""
    lit = sun.shines & (sun.directions @ normal > 0)
    lit[lit] = _free(point, sun.directions[lit], outdoors, own)
    total = max(int(sun.shines.sum()), 1)
    return float(lit.sum()) / total, float((lit & sun.winter).sum()) / total


def sees_sky(points: FloatArray, space: Space, outdoors: OutdoorMesh) -> NDArray[np.bool_]:
    """Which points [S, 3] of a room see sky through its windows."""
    room, own = opaque_room(space), outdoors.windows_of(space)
    found = np.zeros(len(points), dtype=bool)
    for opening in openings_of(space):
        targets = _points_of(opening, ray_mesh(opening.window.triangles))
        for target in targets:
            left = np.flatnonzero(~found)
            rays = target - points[left]
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            upwards = (rays[:, 2] > 0) & (rays @ opening.normal > 0)
            left, rays = left[upwards], rays[upwards]
            free = ~np.isfinite(room.first_hits(points[left], rays)[0])
            free[free] = ~np.isfinite(outdoors.first_hits(points[left][free], rays[free], own)[0])
            found[left[free]] = True
    return found


def _points_of(opening: Opening, glass: RayMesh) -> FloatArray:
    """Points [N, 3] on the glass of an opening, up to its edges, the uppermost first."""
    shares = np.linspace(-0.499, 0.499, ACROSS)
    x, y = (a.ravel() for a in np.meshgrid(shares * opening.width, -shares * opening.height))
    points = opening.centre + np.outer(x, opening.along) + np.outer(y, opening.up)
    start = points - 0.1 * opening.normal
    on_glass = np.isfinite(glass.first_hits(start, np.tile(opening.normal, (len(start), 1)), 0.2)[0])
    points = points[on_glass]
    return points[np.argsort(-points[:, 2], kind="stable")]


def reference_point(opening: Opening, outdoors: OutdoorMesh, own: NDArray[np.bool_]) -> FloatArray:
    """Middle [3] of a window in the outer face of its wall: where no jamb is beside it any more."""
    depths = np.arange(REVEAL_STEP / 2, DEEPEST_REVEAL, REVEAL_STEP)
    starts = opening.centre + np.outer(depths, opening.normal)
    reach = 0.5 * opening.width + 0.25
    beside = np.zeros(len(depths), dtype=bool)
    for side in (-1.0, 1.0):
        distance, _ = outdoors.first_hits(starts, np.tile(side * opening.along, (len(starts), 1)), own)
        beside |= distance < reach
    clear = int(np.argmin(beside)) if not beside.all() else 0  # the first depth without a jamb
    return np.asarray(opening.centre + (depths[clear] + REVEAL_STEP / 2) * opening.normal)


def sky_directions(step_deg: float = SKY_STEP_DEG) -> tuple[FloatArray, FloatArray]:
    """Directions [N, 3] of cells of the sky, and their solid angles [N] [sr]."""
    step = np.radians(step_deg)
    rows = round(np.pi / 2 / step)
    edges = np.linspace(0, np.pi / 2, rows + 1)
    columns = 4 * rows
    altitude = np.repeat(0.5 * (edges[1:] + edges[:-1]), columns)
    azimuth = np.tile((np.arange(columns) + 0.5) * 2 * np.pi / columns, rows)
    solid = np.repeat(np.diff(np.sin(edges)) * 2 * np.pi / columns, columns)
    across = np.cos(altitude)
    return np.column_stack([across * np.sin(azimuth), across * np.cos(azimuth), np.sin(altitude)]), solid


def _free(point: FloatArray, rays: FloatArray, outdoors: OutdoorMesh, own: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rays [N, 3] from a point meet nothing."""
    return ~np.isfinite(outdoors.first_hits(np.tile(point, (len(rays), 1)), rays, own)[0])
