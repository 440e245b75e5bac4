"""Heat flow to the ground by ISO 13370:2017: slabs, suspended floors, basements, with phase lag.

Per element of a building: U, the periodic heat transfer coefficient outdoors (H_pe), and the
virtual layer and temperature that a transient balance puts below the construction (annex F).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range
from thermal.zone import Layer

R_SE = 0.04  # [m2 K/W] ISO 6946
R_SI_DOWN, R_SI_ACROSS = 0.17, 0.13
SOIL_LAYER = 0.5  # [m] of soil that takes part in the balance, ISO 52016-1 6.5.8.2
YEAR = 365 * 24.0  # [h]
MONTH = YEAR / 12
CELLAR_AIR = 0.3  # [1/h] of an unheated basement, ISO 13370 7.4
AIR_WH = 0.33  # [Wh/(m3 K)]
SHIELDS = {"sheltered": 0.02, "average": 0.05, "exposed": 0.10}  # f_w, ISO 13370 table 8


@dataclass(frozen=True, slots=True)
class Soil:
    """Ground around a building."""

    conductivity: float  # [W/(m K)]
    heat_capacity: float  # by volume [J/(m3 K)]

    @property
    def penetration(self) -> float:
        """Periodic penetration depth of the year [m]: sqrt(3.15e7 lambda/(pi rho c)) (H.1)."""
        return float(np.sqrt(3.15e7 * self.conductivity / (np.pi * self.heat_capacity)))


# ISO 13370:2017, table 7
SOILS = {"clay": Soil(1.5, 3.0e6), "sand": Soil(2.0, 2.0e6), "rock": Soil(3.5, 2.0e6)}


@dataclass(frozen=True, slots=True)
class Footprint:
    """A building's floor on the ground."""

    area: float  # [m2]
    perimeter: float  # exposed: to outdoors or unheated rooms [m]
    wall_thickness: float  # of the walls above [m]
    soil: Soil

    def __post_init__(self) -> None:
        require(self.area > 0, "ground", f"the area must be positive, got {self.area} m2")
        require(self.perimeter > 0, "ground", f"no exposed perimeter: {self.perimeter} m")
        require_range(self.wall_thickness, 0.0, 3.0, "ground: wall thickness", "m")

    @property
    def dimension(self) -> float:
        """Characteristic dimension B' = A/(P/2) [m] (2)."""
        return 2.0 * self.area / self.perimeter

    def equivalent_thickness(self, resistance: float, r_si: float = R_SI_DOWN) -> float:
        """Equivalent thickness d = w + lambda (R_si + R + R_se) [m] (3)."""
        return self.wall_thickness + self.soil.conductivity * (r_si + resistance + R_SE)


@dataclass(frozen=True, slots=True)
class GroundElement:
    """Floor or wall to the ground; heat flow: U (T_i - mean T_e) plus a periodic part."""

    u_value: float  # [W/(m2 K)] to the mean of outdoors
    swing: float  # H_pe/A [W/(m2 K)] of the outdoor swing
    lag: float  # [months] of that behind outdoors
    resistance: float  # of the construction, without films [m2 K/W]
    r_si: float  # [m2 K/W]
    soil: Soil | None  # that lies against it; None: air

    def layers(self, construction: tuple[Layer, ...]) -> tuple[Layer, ...]:
        """The construction with soil and virtual layer before it (F.1), outermost first."""
        missing = 1.0 / self.u_value - self.r_si - self.resistance
        require(missing > 0, "ground", "the construction alone insulates better than U says")
        if self.soil is None:
            return (_resistance(missing), *construction)
        depth = min(SOIL_LAYER, 0.9 * missing * self.soil.conductivity)
        ground = Layer(depth, self.soil.conductivity, 2000.0, self.soil.heat_capacity / 2000.0)
        virtual = missing - depth / self.soil.conductivity
        return (_resistance(virtual), ground, *construction)

    def temperature(
        self, indoor_c: float, mean_c: float, swing_c: float, coldest: float, hours: ArrayLike
    ) -> NDArray[np.float64]:
        """Temperature [H] [degC] beyond the virtual layer (F.2, C.3), indoors at a steady mean.

        Args: mean_c, swing_c, coldest: of the outdoor year's harmonic, `harmonic`; hours: [H] of
            the year.
        """
        phase = 2 * np.pi * (np.asarray(hours, dtype=float) - coldest - self.lag * MONTH) / YEAR
        flow = self.u_value * (indoor_c - mean_c) + self.swing * swing_c * np.cos(phase)
        return indoor_c - flow / self.u_value


def harmonic(outdoor_c: ArrayLike, hours: ArrayLike) -> tuple[float, float, float]:
    """Mean, amplitude [K] and coldest hour of the first harmonic of a year of temperatures [H]."""
    outdoor, hour = np.asarray(outdoor_c, dtype=float), np.asarray(hours, dtype=float)
    angle = 2 * np.pi * hour / YEAR
    terms = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    mean, cosine, sine = np.linalg.lstsq(terms, outdoor, rcond=None)[0]
    coldest = np.mod(np.arctan2(-sine, -cosine) / (2 * np.pi) * YEAR, YEAR)
    return float(mean), float(np.hypot(cosine, sine)), float(coldest)


def slab_u(place: Footprint, thickness: float) -> float:
    """U of a floor on the ground of that equivalent thickness [m] (4), (5)."""
    b, k = place.dimension, place.soil.conductivity
    if thickness < b:
        return float(2 * k / (np.pi * b + thickness) * np.log(np.pi * b / thickness + 1))
    return float(k / (0.457 * b + thickness))


def edge_transmittance(place: Footprint, thickness: float, width: float, resistance: float, *, vertical: bool) -> float:
    """Psi_g,ed [W/(m K)] of edge insulation (annex D); negative: what it saves.

    Args: width: horizontal width or vertical depth [m]; resistance: of the insulation [m2 K/W].
    """
    k, reach = place.soil.conductivity, width * (2.0 if vertical else 1.0)
    more = k * resistance - _soil_replaced(resistance)
    saved = np.log(reach / thickness + 1) - np.log(reach / (thickness + more) + 1)
    return float(-k / np.pi * saved)


def slab_on_ground(
    place: Footprint, resistance: float, *, edge: tuple[float, float] | None = None, vertical: bool = True
) -> GroundElement:
    """A slab on the ground; edge: depth or width [m] and resistance [m2 K/W] of its insulation.

    Source: ISO 13370:2017, 7.1, annex D, H.4 and H.5.
    """
    d, k, depth = place.equivalent_thickness(resistance), *_soil(place)
    u, swing = slab_u(place, d), np.log(depth / d + 1)
    if edge is not None:
        width, insulation = edge
        more = k * insulation - _soil_replaced(insulation)
        u += 2 * edge_transmittance(place, d, width, insulation, vertical=vertical) / (place.dimension)
        left = np.exp(-(2.0 if vertical else 1.0) * width / depth)
        swing = (1 - left) * np.log(depth / (d + more) + 1) + left * swing
    share = 0.37 * place.perimeter * k * swing / place.area
    return GroundElement(float(u), float(share), 1.0, resistance, R_SI_DOWN, place.soil)


def suspended_floor(
    place: Footprint,
    resistance: float,
    *,
    height: float,
    wall_u: float,
    vents: float,
    wind: float,
    shield: str = "average",
    ground_resistance: float = 0.0,
) -> GroundElement:
    """A floor over a ventilated crawl space.

    Args: height: of the floor above the ground outside [m]; wall_u: of the space's walls
        [W/(m2 K)]; vents: opening per perimeter [m2/m]; wind: year's mean at 10 m [m/s].

    Source: ISO 13370:2017, 7.2 and H.6.
    """
    require(shield in SHIELDS, "ground", f"shield {shield!r} is none of {', '.join(SHIELDS)}")
    k, depth = _soil(place)
    d, b = place.equivalent_thickness(ground_resistance), place.dimension
    floor = 1.0 / (2 * R_SI_DOWN + resistance)
    around = 2 * height * wall_u / b + 1450 * vents * wind * SHIELDS[shield] / b
    ground = 2 * k / (np.pi * b + d) * np.log(np.pi * b / d + 1)
    u = 1.0 / (1.0 / floor + 1.0 / (ground + around))
    edge = 0.37 * place.perimeter * k * np.log(depth / d + 1) / place.area
    swing = floor * (edge + around) / (k / depth + around + floor)
    return GroundElement(float(u), float(swing), 0.0, resistance, R_SI_DOWN, None)


def basement(
    place: Footprint, floor_resistance: float, wall_resistance: float, depth: float
) -> tuple[GroundElement, GroundElement]:
    """Floor and walls of a heated basement whose floor lies that deep [m].

    Source: ISO 13370:2017, 7.3 and H.7; the swing's two terms are those of floor and walls.
    """
    require_range(depth, 0.05, 50.0, "ground: depth of the basement", "m")
    k, reach = _soil(place)
    d, p = place.equivalent_thickness(floor_resistance), place.perimeter
    wall = k * (R_SI_ACROSS + wall_resistance + R_SE)
    floor_u = _basement_floor_u(place, d, depth)
    wall_u = 2 * k / (np.pi * depth) * (1 + 0.5 * d / (d + depth)) * np.log(depth / wall + 1)
    left = np.exp(-depth / reach)
    floor_swing = 0.37 * p * k * left * np.log(reach / d + 1) / place.area
    wall_swing = 0.37 * k * 2 * (1 - left) * np.log(reach / wall + 1) / depth
    return (
        GroundElement(floor_u, float(floor_swing), 1.0, floor_resistance, R_SI_DOWN, place.soil),
        GroundElement(float(wall_u), float(wall_swing), 1.0, wall_resistance, R_SI_ACROSS, place.soil),
    )


def over_unheated_basement(
    place: Footprint,
    resistance: float,
    *,
    depth: float,
    height: float,
    wall_u: float,
    floor_resistance: float = 0.0,
    wall_resistance: float = 0.0,
) -> GroundElement:
    """A floor over an unheated cellar; height: of its walls above the ground outside [m].

    Source: ISO 13370:2017, 7.4 and H.8.
    """
    (floor, wall), (k, reach) = (basement(place, floor_resistance, wall_resistance, depth), _soil(place))
    a, p = place.area, place.perimeter
    above = 1.0 / (2 * R_SI_DOWN + resistance)
    air = AIR_WH * CELLAR_AIR * a * (depth + height)
    outdoors = height * p * wall_u + air
    u = 1.0 / (1.0 / above + a / (a * floor.u_value + depth * p * wall.u_value + outdoors))
    d = place.equivalent_thickness(floor_resistance)
    ground = 0.37 * p * k * (2 - np.exp(-depth / reach)) * np.log(reach / d + 1)
    total = (a + depth * p) * k / reach + outdoors + a * above
    swing = above * (ground + outdoors) / total
    return GroundElement(float(u), float(swing), 1.0, resistance, R_SI_DOWN, None)


def _basement_floor_u(place: Footprint, thickness: float, depth: float) -> float:
    """U of a basement's floor (13), (14)."""
    return slab_u(place, thickness + 0.5 * depth)


def _soil(place: Footprint) -> tuple[float, float]:
    return place.soil.conductivity, place.soil.penetration


def _soil_replaced(resistance: float) -> float:
    """Thickness [m] of the soil that edge insulation of 0.035 W/(m K) replaces (D.2)."""
    return 0.035 * resistance


def _resistance(value: float) -> Layer:
    """A layer without capacity."""
    return Layer(1.0, 1.0 / value, 0.0, 0.0)
