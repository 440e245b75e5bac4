"""Table 15's room: its zone, its climate and its sun, from REFERENCE.md's parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.weather import Weather
from tests.validation.facade_sun import FacadeSun
from tests.validation.reference_systems import Optics, ReferenceSystem, at_directions
from tests.validation.room_exchange import area_view_factors, spread_evenly
from tests.validation.sunlit_room import BeamTable, BoxRoom, diffuse_hits, first_hits
from thermal.blackbox import Fenestration
from thermal.climate import Climate, Solar, sky_temperature
from thermal.emitters import IdealLoads
from thermal.zone import Gains, Layer, OpaqueSurface, WindowElement, Zone, work_hours

FloatArray = NDArray[np.float64]
ORIENTATIONS = {"S": 180, "SE": 135, "E": 90, "NE": 45, "N": 0, "NW": 315, "W": 270, "SW": 225}
ROOM = BoxRoom(4.0, 5.0, 3.0, (0.5, 3.5), (1.0, 2.5))
REFLECTANCE = np.array([0.5, 0.5, 0.5, 0.5, 0.2, 0.7])  # facade, left, right, back, floor, ceiling

FINISH = Layer(0.01, 0.25, 900.0, 1050.0)
EXTERIOR_FINISH = Layer(0.05, 2.3, 2300.0, 1000.0)
INSULATION = Layer(0.14, 0.03, 35.0, 840.0)
MASSIVE, MASSIVE_THIN = Layer(0.19, 2.3, 2300.0, 1000.0), Layer(0.05, 2.3, 2300.0, 1000.0)


def facade_normal(orientation: str) -> FloatArray:
    """Exterior normal [3] of the facade."""
    azimuth = np.radians(ORIENTATIONS[orientation])
    return np.array([np.sin(azimuth), np.cos(azimuth), 0.0])


def zone(orientation: str, fenestration: Fenestration, *, loads: IdealLoads | None = None) -> Zone:
    """The room with one window system."""
    out = facade_normal(orientation)
    right = np.array([-out[1], out[0], 0.0])  # seen from outside
    up = np.array([0.0, 0.0, 1.0])
    facade = (EXTERIOR_FINISH, INSULATION, MASSIVE, FINISH)
    wall, slab = (FINISH, MASSIVE_THIN, FINISH), (FINISH, MASSIVE, FINISH)
    walls = (
        ("facade", facade, out, "outdoor"),
        ("left", wall, -right, "twin"),
        ("right", wall, right, "twin"),
        ("back", wall, -out, "twin"),
        ("floor", slab, -up, "twin"),
        ("ceiling", slab, up, "twin"),
    )
    surfaces = tuple(
        OpaqueSurface(
            name,
            area,
            layers,
            normal,
            outside,
            absorptance_in=1 - rho,
            absorptance_out=0.5,
            roughness="medium rough",
            height=1.5,
        )
        for (name, layers, normal, outside), area, rho in zip(walls, ROOM.areas, REFLECTANCE, strict=True)
    )
    window = WindowElement("window", ROOM.window_area, out, (fenestration,), 1.5, height=1.75)
    occupied = work_hours(8, 18)
    heat = (160.0 + 75.0) * 0.5 * occupied
    faces = [s.normal for s in surfaces] + [out]
    return Zone(
        "room",
        60.0,
        surfaces,
        (window,),
        infiltration_ach=0.5,
        gains=Gains(convective=heat, radiant=heat),
        loads=IdealLoads() if loads is None else loads,
        view_factors=area_view_factors(np.append(ROOM.areas, ROOM.window_area), faces),
    )


def climate(weather: Weather) -> Climate:
    """What `thermal` needs of a weather file."""
    return Climate(
        outdoor_c=weather.dry_bulb_c,
        sky_c=sky_temperature(weather.horizontal_infrared),
        wind_speed=weather.wind_speed,
        wind_direction_deg=weather.wind_direction_deg,
        ground_c=np.full(len(weather.times), 18.0),
        pressure=weather.pressure_pa,
    )


class RoomLight:
    """First hits in the room, computed once: of the beam, of diffuse light, of scattered light."""

    def __init__(self) -> None:
        self.beam = BeamTable(ROOM)
        self.diffuse = diffuse_hits(ROOM)

    def scattered(self, optics: Optics) -> FloatArray:
        """First hits [6] of the light that leaves towards each outgoing direction [K, 6]."""
        sine, z = np.sin(optics.theta), np.cos(optics.theta)
        # outgoing azimuth = atan2(o_y, -o_x)
        x, y = -sine * np.cos(optics.phi), sine * np.sin(optics.phi)
        return first_hits(ROOM, np.stack([x, y, -z], axis=1))


def solar(sun: FacadeSun, system: ReferenceSystem, light: RoomLight) -> Solar:
    """The sun's work in the room at every step."""
    optics = system.optics
    sky_ground = np.stack([sun.sky, sun.ground], axis=1)
    lit = sun.beam > 0
    direct = {key: np.zeros(len(sun.beam)) for key in ("tau", "outer", "inner", "middle")}
    local = sun.local[lit]
    for key, values in (
        ("tau", optics.tau),
        ("outer", system.direct.outer),
        ("inner", system.direct.inner),
        ("middle", np.broadcast_to(system.direct.middle, optics.tau.shape)),
    ):
        direct[key][lit] = at_directions(values, optics, local)
    hits = _first_hits(sun, system, light, direct["tau"], lit, sky_ground)
    area = np.append(ROOM.areas, ROOM.window_area)
    rho = np.append(REFLECTANCE, optics.back["rho_back"])
    first = np.concatenate([hits, np.zeros((len(hits), 1))], axis=1)
    kept = spread_evenly(first, rho, area)
    lost = 1.0 - optics.back["rho_back"]
    at_window = kept[:, 6] / ROOM.window_area / lost
    outer = sun.beam * direct["outer"] + sky_ground @ system.diffuse.outer
    inner = sun.beam * direct["inner"] + sky_ground @ system.diffuse.inner
    of_diffuse = np.broadcast_to(system.diffuse.middle, (2,))
    middle = sun.beam * direct["middle"] + sky_ground @ of_diffuse
    facade = np.zeros((len(hits), 6))
    facade[:, 0] = sun.total
    return Solar(
        absorbed_outer=(outer + at_window * system.back_layers[0])[:, None],
        absorbed_inner=(inner + at_window * system.back_layers[1])[:, None],
        inside=kept[:, :6],
        facade=facade,
        absorbed_middle=middle[:, None],
    )


def _first_hits(
    sun: FacadeSun,
    system: ReferenceSystem,
    light: RoomLight,
    tau: FloatArray,
    lit: NDArray[np.bool_],
    sky_ground: FloatArray,
) -> FloatArray:
    """Transmitted sun on the surfaces [T, 6] [W] before any reflection."""
    optics = system.optics
    diffuse = (sky_ground @ optics.diffuse[:, 0]) * ROOM.window_area
    beam = sun.beam * tau * ROOM.window_area
    if optics.scatter is None and system.fenestration.name == "dgu":
        hits = diffuse[:, None] * light.diffuse
        hits[lit] += beam[lit, None] * light.beam(sun.local[lit])
        return hits
    if optics.scatter is None:
        return (diffuse + beam)[:, None] * light.diffuse
    spread = optics.scatter.T @ light.scattered(optics)  # [K incident, 6]
    share = spread / np.maximum(spread.sum(axis=1, keepdims=True), 1e-12)
    hits = diffuse[:, None] * light.diffuse
    for s in range(6):
        hits[lit, s] += beam[lit] * at_directions(share[:, s], optics, sun.local[lit])
    return hits
