"""The thermal zone as frozen data: layers, surfaces, windows, gains, set points.

Normals point out of the room: a floor has (0, 0, -1), a ceiling (0, 0, 1), a facade its exterior
normal.  Layers are listed from outside to inside.  Temperatures are in degrees Celsius.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.blackbox import Fenestration
from thermal.emitters import HeatedSlab, IdealLoads
from thermal.errors import require, require_range
from thermal.ventilation import Leakage, NeighbourAir, SupplyAir, WindowAiring

FloatArray = NDArray[np.float64]
ROUGHNESS = {  # DOE-2 roughness multiplier R_f; EnergyPlus Engineering Reference
    "very rough": 2.17,
    "rough": 1.67,
    "medium rough": 1.52,
    "medium smooth": 1.13,
    "smooth": 1.11,
    "very smooth": 1.0,
}
OUTSIDE_ABSORPTANCE = 0.6  # solar, of what faces outdoors where nothing is known


@dataclass(frozen=True, slots=True)
class Layer:
    """A homogeneous layer of a construction; density 0 makes a pure resistance."""

    thickness: float  # [m]
    conductivity: float  # [W/(m K)]
    density: float  # [kg/m3]
    heat_capacity: float  # [J/(kg K)]

    def __post_init__(self) -> None:
        require(self.thickness > 0, "layer thickness", f"must be positive, got {self.thickness} m")
        require_range(self.conductivity, 1e-3, 500.0, "layer conductivity", "W/(m K)")
        require_range(self.density, 0.0, 2e4, "layer density", "kg/m3")
        require_range(self.heat_capacity, 0.0, 1e4, "layer heat capacity", "J/(kg K)")

    @property
    def resistance(self) -> float:
        """Thermal resistance [m2 K/W]."""
        return self.thickness / self.conductivity


@dataclass(frozen=True, slots=True)
class OpaqueSurface:
    """An opaque surface of a zone.

    `outside` is "outdoor", "ground" (the outer face has the climate's ground temperature), "known"
    (it has `beyond_c`), "adiabatic" (no heat flow at the outer face), "twin" (the same room behind
    it: the outer face copies the inner one, EnergyPlus "Adiabatic"), or the name of another zone;
    then `partner` names the surface of that zone which is the other face.
    """

    name: str
    area: float  # [m2]
    layers: tuple[Layer, ...]  # outside to inside
    normal: NDArray[np.float64]  # [3] unit vector out of the room
    outside: str = "outdoor"
    partner: str = ""
    emissivity_in: float = 0.9
    emissivity_out: float = 0.9
    absorptance_in: float = 0.5  # solar, used where transmitted sunlight is distributed
    absorptance_out: float = OUTSIDE_ABSORPTANCE  # solar
    roughness: str = "medium rough"
    height: float = 1.5  # [m] of the centroid above the ground outside, for the wind profile
    beyond_c: NDArray[np.float64] | float | None = None  # [H] or [T] of the outer face, "known"
    sky_seen: float = 1.0  # share of the sky above its plane that nothing outdoors hides

    def __post_init__(self) -> None:
        item = f"surface {self.name}"
        told = (self.beyond_c is not None) == (self.outside == "known")
        require(told, item, "a temperature beyond goes with outside = 'known', and that with it")
        require(self.area > 0, item, f"area must be positive, got {self.area} m2")
        require(len(self.layers) > 0, item, "has no layers (thickness, conductivity, density, cp)")
        _set_unit_normal(self, item)
        for value, label in (
            (self.emissivity_in, "inside emissivity"),
            (self.emissivity_out, "outside emissivity"),
            (self.absorptance_in, "inside solar absorptance"),
            (self.absorptance_out, "outside solar absorptance"),
            (self.sky_seen, "share of the sky that is seen"),
        ):
            require_range(value, 0.0, 1.0, f"{item}: {label}")
        known = ", ".join(ROUGHNESS)
        require(self.roughness in ROUGHNESS, item, f"roughness {self.roughness!r} is not of {known}")


@dataclass(frozen=True, slots=True)
class WindowElement:
    """A window of a zone: glazed area, frame, and one fenestration system per shading state."""

    name: str
    area: float  # [m2] glazed
    normal: NDArray[np.float64]  # [3] exterior unit normal
    states: tuple[Fenestration, ...]  # shading states; state 0 is used unless told otherwise
    glazing_height: float = 1.5  # [m] for the inside film (ISO 15099)
    frame_area: float = 0.0  # [m2]
    frame_u: float = 2.0  # [W/(m2 K)] with the films 0.04 and 0.13 m2 K/W
    frame_absorptance: float = OUTSIDE_ABSORPTANCE  # solar, outside
    height: float = 1.75  # [m] of the centroid above the ground outside
    sky_seen: float = 1.0  # share of the sky above its plane that nothing outdoors hides

    def __post_init__(self) -> None:
        item = f"window {self.name}"
        require_range(self.sky_seen, 0.0, 1.0, f"{item}: share of the sky that is seen")
        require(self.area > 0, item, f"area must be positive, got {self.area} m2")
        require(len(self.states) > 0, item, "has no fenestration system")
        require(self.glazing_height > 0, item, "glazing height must be positive")
        require(self.frame_area >= 0, item, f"frame area must not be negative: {self.frame_area}")
        if self.frame_area > 0:
            require_range(self.frame_u, 0.1, 5.5, f"{item}: frame U", "W/(m2 K)")
        require_range(self.frame_absorptance, 0.0, 1.0, f"{item}: frame solar absorptance")
        _set_unit_normal(self, item)


@dataclass(frozen=True, slots=True)
class Gains:
    """Internal heat gains of a zone, hourly; scalars hold for every hour."""

    convective: NDArray[np.float64] | float = 0.0  # [H] [W] to the air
    radiant: NDArray[np.float64] | float = 0.0  # [H] [W] longwave, spread over the surfaces


@dataclass(frozen=True, slots=True)
class Zone:
    """A room (or several with one air node): faces, air, heat sources."""

    name: str
    volume: float  # [m3] of air
    surfaces: tuple[OpaqueSurface, ...]
    windows: tuple[WindowElement, ...] = ()
    infiltration_ach: NDArray[np.float64] | float = 0.5  # [H] [1/h] outdoor air through leaks
    gains: Gains = field(default_factory=Gains)
    loads: IdealLoads = field(default_factory=IdealLoads)
    air_capacity_factor: float = 1.0  # multiplies the heat capacity of the air (furniture)
    # [N, N] view factors between inside faces (surfaces, then windows, then frames); None: star
    view_factors: NDArray[np.float64] | None = None
    leakage: Leakage = field(default_factory=Leakage)  # how wind and temperatures change the infiltration
    other_air_ach: NDArray[np.float64] | float = 0.0  # [H] [1/h] outdoor air that nothing changes
    supply: SupplyAir | None = None
    airing: WindowAiring | None = None
    beside: tuple[NeighbourAir, ...] = ()  # air exchanged with neighbours of known temperature
    bridges: float = 0.0  # thermal bridges, air to outdoors: sum of psi l and chi [W/K]
    slab: HeatedSlab | None = None

    def __post_init__(self) -> None:
        item = f"zone {self.name}"
        require(self.bridges >= 0, item, f"negative thermal bridges: {self.bridges} W/K")
        require(bool(np.all(np.asarray(self.other_air_ach) >= 0)), item, "negative outdoor air")
        require(self.volume > 0, item, f"volume must be positive, got {self.volume} m3")
        require(len(self.surfaces) > 0, item, "has no surfaces")
        names = [s.name for s in self.surfaces] + [w.name for w in self.windows]
        known = self.slab is None or self.slab.surface in names[: len(self.surfaces)]
        require(known, item, f"has no surface {getattr(self.slab, 'surface', '')!r} to be heated")
        twice = sorted({n for n in names if names.count(n) > 1})
        require(not twice, item, f"names used twice: {', '.join(twice)}")
        require(bool(np.all(np.asarray(self.infiltration_ach) >= 0)), item, "negative infiltration")
        require(self.air_capacity_factor >= 0, item, "negative air capacity factor")
        walls = sum(s.area for s in self.surfaces)
        for window in self.windows:
            message = f"window {window.name} of {window.area:g} m2 is larger than all walls"
            require(window.area + window.frame_area < walls, item, message)

    @property
    def floor_area(self) -> float:
        """Area [m2] of the surfaces that face up."""
        return sum(s.area for s in self.surfaces if s.normal[2] < -0.7)

    def index_of(self, name: str) -> int:
        """Position of the opaque surface called `name`."""
        for i, surface in enumerate(self.surfaces):
            if surface.name == name:
                return i
        raise ValueError(f"zone {self.name} has no surface {name!r}")


def scheduled(weekday_profile: ArrayLike, hours: int = 8760) -> NDArray[np.float64]:
    """Hourly factors [H] from a daily profile [24] that repeats every day."""
    profile = np.asarray(weekday_profile, dtype=float)
    require(profile.shape == (24,), "schedule", f"expected 24 values, got {profile.shape}")
    return np.resize(profile, hours)


def work_hours(start: int, end: int, hours: int = 8760) -> NDArray[np.float64]:
    """Hourly factors [H]: 1 in the hours that lie between two clock times, 0 elsewhere.

    An end before the start is that of the next day: 22 to 6 is the night.
    """
    fits = 0 <= start < 24 and 0 <= end <= 24 and start != end
    require(fits, "schedule", f"expected start and end of 0 to 24 that differ: {start}, {end}")
    hour = np.arange(24)
    after, before = hour >= start, hour < end
    return scheduled(after & before if start < end else after | before, hours)


def _set_unit_normal(element: OpaqueSurface | WindowElement, item: str) -> None:
    normal = np.asarray(element.normal, dtype=float)
    require(normal.shape == (3,), item, f"normal: expected [3], got {normal.shape}")
    length = float(np.linalg.norm(normal))
    require(length > 0, item, "normal has no length")
    object.__setattr__(element, "normal", normal / length)


@dataclass(frozen=True, slots=True)
class Dimming:
    """How lamps follow the daylight at their sensor.

    Power falls from all at no daylight to `least_power` where `least_light` of the lamps' light is
    still needed, and stays there, or is 0 with `off`: EnergyPlus' Continuous and ContinuousOff.
    """

    target_lx: float
    least_light: float = 0.0  # share of the lamps' light
    least_power: float = 0.0  # share of their power that gives it
    off: bool = False  # less light than that is none
    sensor_factor: float = 1.0  # what the sensor reads, over the mean daylight of the work plane
    full_lx: float | None = None  # of the work plane by the lamps alone; None: the target

    def __post_init__(self) -> None:
        valid = self.target_lx > 0
        require(valid, "lighting", f"target illuminance must be positive, got {self.target_lx} lx")
        full = self.full_lx is None or self.full_lx > 0
        require(full, "lighting", f"light of the lamps must be positive, got {self.full_lx} lx")
        require_range(self.least_light, 0.0, 0.99, "lighting: least light")
        require_range(self.least_power, 0.0, 1.0, "lighting: least power")

    @property
    def numbers(self) -> tuple[float, float, float, float, float]:
        """The arguments of `lamp_share` after the daylight."""
        off = self.least_light if self.off else -1.0
        full = self.target_lx if self.full_lx is None else self.full_lx
        needed, read = self.target_lx / full, self.sensor_factor / full
        return needed, read, self.least_light, self.least_power, off


def lamp_share(
    daylight: FloatArray, needed: float, read: float, least_light: float, least_power: float, off: float
) -> FloatArray:
    """Share of the lamps' power by daylight [lx], of arrays, or compiled of numbers.

    Args:
        needed: share of the lamps' light that is missing in the dark; read: less by each lux.
        off: share of light up to which the lamps are off; below 0: never.
    """
    missing = np.minimum(np.maximum(needed - read * daylight, 0.0), 1.0)
    above = np.maximum(missing - least_light, 0.0) / (1.0 - least_light)
    return (least_power + (1.0 - least_power) * above) * (missing > off)


def dimmed_light(illuminance: ArrayLike, dimming: Dimming) -> FloatArray:
    """Share [H] of the lamps' light that they give: what is missing, at least their least light."""
    needed, read, least_light, _, off = dimming.numbers
    day = np.asarray(illuminance, dtype=float)
    missing = np.minimum(np.maximum(needed - read * day, 0.0), 1.0)
    return np.maximum(missing, least_light) * (missing > off)


def dimmed_share(illuminance: ArrayLike, dimming: Dimming) -> FloatArray:
    """Share [H] of the lamps' power that daylight leaves to be given.

    illuminance: [H] daylight of the work plane [lx].
    """
    return lamp_share(np.asarray(illuminance, dtype=float), *dimming.numbers)


def split_gains(power: ArrayLike, radiant_share: float, *others: tuple[ArrayLike, float]) -> Gains:
    """Gains of one or several sources of power [H] [W], each with its radiant share."""
    convective: NDArray[np.float64] | float = 0.0
    radiant: NDArray[np.float64] | float = 0.0
    for watts, share in ((power, radiant_share), *others):
        require_range(share, 0.0, 1.0, "radiant share")
        array = np.asarray(watts, dtype=float)
        convective, radiant = convective + (1.0 - share) * array, radiant + share * array
    return Gains(convective, radiant)
