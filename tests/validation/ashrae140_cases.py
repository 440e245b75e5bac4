"""ASHRAE 140-2020 building thermal envelope cases: their rooms, windows, schedules.

Geometry and materials: the standard's section 7.2, as in the OpenStudio model of the reference
folder.  South is the windows' side; x runs east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tests.validation.sunlit_facade import Device, Fin, Overhang
from tests.validation.sunlit_room import BoxRoom
from thermal.blackbox import Fenestration
from thermal.emitters import IdealLoads
from thermal.zone import Gains, Layer, OpaqueSurface, WindowElement, Zone, scheduled

FloatArray = NDArray[np.float64]
WIDTH, DEPTH, HEIGHT = 8.0, 6.0, 2.7
NORMALS = {
    "south": (0.0, -1.0, 0.0),
    "north": (0.0, 1.0, 0.0),
    "east": (1.0, 0.0, 0.0),
    "west": (-1.0, 0.0, 0.0),
    "floor": (0.0, 0.0, -1.0),
    "roof": (0.0, 0.0, 1.0),
}
# seen from outside: facade, left, right, back, floor, ceiling of `sunlit_room`
SEEN_FROM = {
    "south": ("south", "west", "east", "north", "floor", "roof"),
    "east": ("east", "south", "north", "west", "floor", "roof"),
    "west": ("west", "north", "south", "east", "floor", "roof"),
}

SIDING = Layer(0.009, 0.14, 530.0, 900.0)
LIGHT = {
    "wall": (SIDING, Layer(0.066, 0.04, 12.0, 840.0), Layer(0.012, 0.16, 950.0, 840.0)),
    "floor": (Layer(1.003, 0.04, 0.0, 0.0), Layer(0.025, 0.14, 650.0, 1200.0)),
    "roof": (Layer(0.019, 0.14, 530.0, 900.0), Layer(0.1118, 0.04, 12.0, 840.0), Layer(0.010, 0.16, 950.0, 840.0)),
}
HEAVY = {
    "wall": (SIDING, Layer(0.0615, 0.04, 10.0, 1400.0), Layer(0.100, 0.51, 1400.0, 1000.0)),
    "floor": (Layer(1.007, 0.04, 0.0, 0.0), Layer(0.080, 1.13, 1400.0, 1000.0)),
    "roof": LIGHT["roof"],
}
# increased insulation (680, 980): 0.25 and 0.40 m of quilt, 0.2452 m of foam
LIGHT_INSULATED = LIGHT | {
    "wall": (SIDING, Layer(0.250, 0.04, 12.0, 840.0), LIGHT["wall"][2]),
    "roof": (LIGHT["roof"][0], Layer(0.400, 0.04, 12.0, 840.0), LIGHT["roof"][2]),
}
HEAVY_INSULATED = HEAVY | {
    "wall": (SIDING, Layer(0.2452, 0.04, 10.0, 1400.0), HEAVY["wall"][2]),
    "roof": LIGHT_INSULATED["roof"],
}
COMMON_WALL = (Layer(0.20, 0.51, 1400.0, 1000.0),)
GROUND_C = 10.0


@dataclass(frozen=True, slots=True)
class Opening:
    """Windows of one facade, each (x range, y range) seen from outside, and what shades them."""

    facade: str
    windows: tuple[tuple[tuple[float, float], tuple[float, float]], ...]
    devices: tuple[Device, ...] = ()

    @property
    def area(self) -> float:
        """Area of all windows [m2]."""
        return float(sum(np.ptp(x) * np.ptp(y) for x, y in self.windows))


@dataclass(frozen=True, slots=True)
class TestCase:
    """One case of the standard."""

    name: str
    mass: dict[str, tuple[Layer, ...]]
    openings: tuple[Opening, ...]
    glazing: str = "double"
    heating: tuple[float, ...] | None = (20.0,) * 24  # [24] or [144] set points; None: floating
    cooling: tuple[float, ...] | None = (27.0,) * 24
    fan_ach: tuple[float, ...] = (0.0,) * 24


_TWO = (((0.5, 3.5), (0.2, 2.2)), ((4.5, 7.5), (0.2, 2.2)))
_SIDE = (((1.5, 4.5), (0.2, 2.2)),)
_SOUTH = Opening("south", _TWO)
_SOUTH_SHADED = Opening("south", _TWO, (Overhang(HEIGHT, (0.0, WIDTH), 1.0),))
_SIDES = (Opening("east", _SIDE), Opening("west", _SIDE))
_FINS = (Overhang(HEIGHT, (1.5, 4.5), 1.0), Fin(1.5, (0.0, HEIGHT), 1.0), Fin(4.5, (0.0, HEIGHT), 1.0))
_SIDES_SHADED = tuple(replace(o, devices=_FINS) for o in _SIDES)
# 10 degC from 23 to 7, linear to 20 degC from 7 to 8; [144] values of ten minutes
_SETBACK = (10.0,) * 42 + tuple(10.0 + 10.0 * k / 6 for k in range(1, 7)) + (20.0,) * 90
_SETBACK += (10.0,) * 6
_DAY_COOLING = (1e3,) * 7 + (27.0,) * 11 + (1e3,) * 6
_NO_HEATING = (-1e3,) * 24
_FAN = tuple(1703.16 / 129.6 if h < 7 or h >= 18 else 0.0 for h in range(24))


def cases() -> dict[str, TestCase]:
    """The single-zone cases by number (960 is built apart)."""
    found: dict[str, TestCase] = {}
    for first, mass, warm in (("6", LIGHT, LIGHT_INSULATED), ("9", HEAVY, HEAVY_INSULATED)):
        base = TestCase(f"{first}00", mass, (_SOUTH,))
        night = replace(base, heating=_NO_HEATING, cooling=_DAY_COOLING, fan_ach=_FAN)
        variants = (
            base,
            replace(base, name=f"{first}10", openings=(_SOUTH_SHADED,)),
            replace(base, name=f"{first}20", openings=_SIDES),
            replace(base, name=f"{first}30", openings=_SIDES_SHADED),
            replace(base, name=f"{first}40", heating=_SETBACK),
            replace(night, name=f"{first}50"),
            replace(base, name=f"{first}80", mass=warm),
            replace(base, name=f"{first}85", cooling=(20.0,) * 24),
            replace(base, name=f"{first}95", mass=warm, cooling=(20.0,) * 24),
            replace(base, name=f"{first}80FF", mass=warm, heating=None, cooling=None),
            replace(base, name=f"{first}00FF", heating=None, cooling=None),
            replace(night, name=f"{first}50FF", heating=None, cooling=None),
        )
        found |= {case.name: case for case in variants}
    found["660"] = replace(found["600"], name="660", glazing="low-e")
    found["670"] = replace(found["600"], name="670", glazing="single")
    return dict(sorted(found.items()))


def case_zone(case: TestCase, fenestration: Fenestration) -> Zone:
    """The thermal zone of a single-zone case."""
    areas = {"south": WIDTH * HEIGHT, "north": WIDTH * HEIGHT, "east": DEPTH * HEIGHT}
    areas |= {"west": DEPTH * HEIGHT, "floor": WIDTH * DEPTH, "roof": WIDTH * DEPTH}
    for opening in case.openings:
        areas[opening.facade] -= opening.area
    surfaces = tuple(surface(name, areas[name], case.mass) for name in NORMALS)
    windows = tuple(window(o, fenestration) for o in case.openings)
    return Zone(
        case.name,
        WIDTH * DEPTH * HEIGHT,
        surfaces,
        windows,
        infiltration_ach=0.5 + scheduled(case.fan_ach),
        gains=Gains(convective=80.0, radiant=120.0),
        loads=case_loads(case),
    )


def case_loads(case: TestCase) -> IdealLoads:
    """Set points of a case; infinite where it floats."""
    if case.heating is None or case.cooling is None:
        return IdealLoads()
    heating, cooling = (np.tile(np.array(day), 365) for day in (case.heating, case.cooling))
    return IdealLoads(heating, cooling)


def surface(name: str, area: float, mass: dict[str, tuple[Layer, ...]]) -> OpaqueSurface:
    """An opaque surface of the box."""
    return OpaqueSurface(
        name,
        area,
        mass.get(name, mass["wall"]),
        np.array(NORMALS[name]),
        "ground" if name == "floor" else "outdoor",
        absorptance_in=0.6,
        absorptance_out=0.6,
        roughness="rough",
        height=HEIGHT if name == "roof" else HEIGHT / 2,
    )


def window(opening: Opening, fenestration: Fenestration) -> WindowElement:
    """The windows of a facade as one element."""
    normal = np.array(NORMALS[opening.facade])
    name = f"{opening.facade} window"
    return WindowElement(name, opening.area, normal, (fenestration,), 2.0, height=1.2)


def opening_rooms(opening: Opening, depth: float | None = None) -> tuple[BoxRoom, ...]:
    """The box seen through each window of a facade."""
    width, far = (WIDTH, DEPTH) if opening.facade == "south" else (DEPTH, WIDTH)
    far = far if depth is None else depth
    return tuple(BoxRoom(width, far, HEIGHT, x, y) for x, y in opening.windows)
