"""Outdoor air, air between zones and emitters of all zones as arrays for the compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.convection import local_wind_factor
from thermal.errors import require
from thermal.ventilation import AirTransfer, SupplyAir, WindowAiring
from thermal.zone import Zone

SITE_HEIGHT = 10.0  # [m] of the wind that EN 16798-7 takes for open windows
_SHUT = WindowAiring(0.0, 0.0, share=0.0)


class AirPaths(NamedTuple):
    """Air flows into the zones Z."""

    leak: NDArray[np.float64]  # [Z, 8] a, b, c, d, s, m, w, n of `Leakage`
    wind: NDArray[np.float64]  # [Z] of the weather's, at the zone's height
    airing: NDArray[np.float64]  # [Z, 4] w, s, 1 where both are added, constant flow
    # [Z, 6] opened above, closed below [degC], least difference [K], greatest wind, least outdoor,
    # 1 where the zone may be heated while they are open
    opens: NDArray[np.float64]
    site: float  # wind on the site, of the weather's
    fan: NDArray[np.float64]  # [Z, 3] recovery, bypass above, least temperature
    bridges: NDArray[np.float64]  # [Z] [W/K]
    transfer: NDArray[np.int64]  # [Q, 2] zone that gives air, zone that takes it
    beside: NDArray[np.int64]  # [D] zone of each opening to a neighbour of known temperature
    buoyant: NDArray[np.float64]  # [D] its flow each way at |dT| = T [m3/s]


class Emitters(NamedTuple):
    """Heating and cooling of the zones Z."""

    radiant: NDArray[np.float64]  # [Z, 2] share of heating and cooling
    slab: NDArray[np.int64]  # [Z] face, -1 without
    power: NDArray[np.float64]  # [Z, 3] of the slab: heating, cooling [W], band [K]


def air_paths(zones: Sequence[Zone], transfers: Sequence[AirTransfer], terrain: str) -> AirPaths:
    """The air of the zones."""
    leaks, index = [zone.leakage for zone in zones], {zone.name: z for z, zone in enumerate(zones)}
    airings = [zone.airing or _SHUT for zone in zones]
    fans = [zone.supply or SupplyAir(0.0) for zone in zones]
    for one in transfers:
        for name in (one.source, one.target):
            require(name in index, "air between zones", f"no zone {name!r} is simulated")
    pairs = [(index[one.source], index[one.target]) for one in transfers]
    openings = [(z, one) for z, zone in enumerate(zones) for one in zone.beside]
    return AirPaths(
        leak=np.array(
            [(*x.factors, x.stack, x.stack_exponent, x.wind, x.wind_exponent) for x in leaks]
        ),
        wind=np.array([local_wind_factor(_height(zone), terrain) for zone in zones]),
        airing=np.array([(x.wind, x.stack, float(x.both), x.flow) for x in airings]),
        opens=np.array(
            [(x.open_above_c, x.close_below_c, x.least_difference, x.greatest_wind,
              x.least_outdoor_c, float(x.heating_while_open)) for x in airings]
        ),
        site=local_wind_factor(SITE_HEIGHT, terrain),
        fan=np.array([(x.recovery, x.bypass_above_c, x.least_c) for x in fans]),
        bridges=np.array([zone.bridges for zone in zones]),
        transfer=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        beside=np.array([z for z, _ in openings], dtype=np.int64),
        buoyant=np.array([one.buoyant for _, one in openings], dtype=np.float64),
    )  # fmt: skip


def slab_faces(zones: Sequence[Zone]) -> list[int]:
    """The face of each zone's heated slab among the faces of all, -1 without one."""
    face, found = 0, []
    for zone in zones:
        found.append(-1 if zone.slab is None else face + zone.index_of(zone.slab.surface))
        frames = sum(window.frame_area > 0 for window in zone.windows)
        face += len(zone.surfaces) + len(zone.windows) + frames
    return found


def emitters(
    zones: Sequence[Zone], slabs: Sequence[int], mode_count: NDArray[np.uint64]
) -> Emitters:
    """The emitters of the zones; slabs: their faces; mode_count: [N] of the faces' own walls."""
    power = []
    for zone, face in zip(zones, slabs, strict=True):
        here = zone.slab
        if here is None:
            power.append((0.0, 0.0, 1.0))
            continue
        item = f"heated slab {here.surface}"
        require(mode_count[face] > 0, item, "its layers belong to the zone at its other side")
        power.append((here.heating_limit, here.cooling_limit, here.band))
    loads = [zone.loads for zone in zones]
    return Emitters(
        radiant=np.array([(x.heating_radiant, x.cooling_radiant) for x in loads]),
        slab=np.array(slabs, dtype=np.int64),
        power=np.array(power),
    )


def _height(zone: Zone) -> float:
    """Mean height [m] of what faces outdoors, weighted by area."""
    out = [s for s in zone.surfaces if s.outside == "outdoor"] + list(zone.windows)
    if not out:
        return 1.5
    return float(np.average([e.height for e in out], weights=[e.area for e in out]))
