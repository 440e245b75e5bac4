"""The rooms and climates that the thermal tests share."""

from __future__ import annotations

import numpy as np

from thermal.blackbox import Fenestration
from thermal.climate import Climate, Solar
from thermal.zone import Layer, OpaqueSurface, WindowElement, Zone

CONCRETE = Layer(0.19, 2.3, 2300.0, 1000.0)
INSULATION = Layer(0.14, 0.03, 35.0, 840.0)
PLASTER = Layer(0.01, 0.25, 900.0, 1050.0)


def climate(hours: int = 48, *, outdoor=0.0, sky=None, wind: float = 3.0) -> Climate:
    """A climate of constant values, or of arrays."""
    outdoor = np.broadcast_to(np.asarray(outdoor, dtype=float), (hours,))
    sky = outdoor if sky is None else np.broadcast_to(np.asarray(sky, dtype=float), (hours,))
    return Climate(
        outdoor_c=outdoor,
        sky_c=sky,
        wind_speed=np.full(hours, wind),
        wind_direction_deg=np.full(hours, 180.0),
        ground_c=np.full(hours, 10.0),
        pressure=np.full(hours, 101325.0),
    )


def box(*, window: Fenestration | None = None, window_area: float = 4.5, outside: str = "twin", **changes) -> Zone:
    """A 4 x 5 x 3 m room with one facade to the south."""
    partition = (PLASTER, Layer(0.05, 2.3, 2300.0, 1000.0), PLASTER)
    slab = (PLASTER, CONCRETE, PLASTER)
    windows = ()
    if window is not None:
        windows = (WindowElement("window", window_area, np.array([0.0, -1.0, 0.0]), (window,)),)
    surfaces = (
        OpaqueSurface("facade", 7.5, (INSULATION, CONCRETE), np.array([0.0, -1.0, 0.0])),
        OpaqueSurface("west", 15.0, partition, np.array([-1.0, 0.0, 0.0]), outside),
        OpaqueSurface("east", 15.0, partition, np.array([1.0, 0.0, 0.0]), outside),
        OpaqueSurface("back", 12.0, partition, np.array([0.0, 1.0, 0.0]), outside),
        OpaqueSurface("floor", 20.0, slab, np.array([0.0, 0.0, -1.0]), outside),
        OpaqueSurface("ceiling", 20.0, slab, np.array([0.0, 0.0, 1.0]), outside),
    )
    return Zone("room", 60.0, surfaces, windows, **changes)


def sun(hours: int, zone: Zone, *, strength: float = 1.0) -> Solar:
    """A sun that shines by day on all that a zone has."""
    day = strength * np.clip(np.sin((np.arange(hours) % 24 - 6) / 12 * np.pi), 0.0, None)
    glass, walls = len(zone.windows), len(zone.surfaces)
    return Solar(
        absorbed_outer=np.outer(day, np.full(glass, 60.0)),
        absorbed_inner=np.outer(day, np.full(glass, 40.0)),
        inside=np.outer(day, np.linspace(20.0, 200.0, walls)),
        facade=np.outer(day, np.full(walls, 500.0)),
    )
