"""Options of a room: method, sampling, sensors, occupancy, outputs.

Files, flags and Python name an option by one word ("sensor_spacing"): `RoomOptions.of` takes these
names, `RoomOptions.named` returns them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, get_type_hints

from mitsuba_cfs.errors import check_number
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.sky.options import GROUNDS, SUN_MODELS
from mitsuba_cfs.spectra.channels import CHANNEL_SETS
from mitsuba_cfs.spectra.daylight import SKY_SPECTRA

GLARE_SOURCES = ("evalglare", "pixels")  # see `mitsuba_cfs.glare.evaluation.GROUPINGS`
GLARE_SUN = ("source", "pixels")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorGrid:
    """Positions of the sensors on the work plane."""

    spacing: float = 0.5  # [m]
    height: float = 0.8  # above the floor [m]
    margin: float = 0.5  # from the walls [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Occupancy:
    """Hours with people in the room; heat of people and equipment."""

    hours: tuple[int, int] = (8, 18)  # clock hours from and to, every day
    equipment_w_m2: float = 8.0  # while occupied, half of it radiant
    person_w: float = 75.0  # sensible heat of a person
    floor_per_person: float = 15.0  # [m2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Pictures and glare ratings besides the sensors' year."""

    picture_hours: tuple[str, ...] = ()  # "MM-DD HH"; none: `scenes.room.glare.default_hours`
    picture_count: int = 10  # at most, without `picture_hours`
    picture_size: int = 600  # pixels of a side of the fisheye picture
    annual_glare: bool = False  # rate every lit hour, not only the pictures
    spectral: bool = False  # alpha-opic quantities and colour of the light
    sensitivities: bool = False  # derivatives of the results by their inputs
    bands: bool = False  # medians with 5 and 95 % by the uncertainty of the inputs; derivatives too
    channels: int = 81  # bands of wavelength for that, a key of CHANNEL_SETS
    glare_sources: str = "evalglare"  # one of GLARE_SOURCES
    glare_sun: str = "source"  # its disc: a source of its own, or part of its pixels

    @property
    def derives(self) -> bool:
        """Whether derivatives are computed."""
        return self.sensitivities or self.bands


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomOptions:
    """Options of a room's computation."""

    method: str = "five-phase"  # one of METHODS
    sampling: Sampling = field(default_factory=Sampling)
    grid: SensorGrid = field(default_factory=SensorGrid)
    occupancy: Occupancy = field(default_factory=Occupancy)
    outputs: Outputs = field(default_factory=Outputs)
    heat_step_s: float = 600.0  # of the heat balance; a whole fraction of an hour
    infiltration_ach: float = 0.5  # [1/h]
    sun_model: str = "spa"  # of the sun's position, see `mitsuba_cfs.sky.sun`
    sky_ground: str = "reflected"  # luminance of the ground, see `mitsuba_cfs.sky.matrix`
    # what windows do with light of sky and ground in the heat balance: by its directions, or by one
    # hemispherical value, as EnergyPlus, to show what that changes; the sun keeps its direction
    sky_light: str = "by direction"
    sky_spectrum: str = "cie"  # of a clear sky, see `mitsuba_cfs.spectra.daylight`

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method: expected one of {METHODS}, got {self.method!r}")
        for name, choices in CHOICES.items():
            part, key = NAMES[name]
            value = getattr(getattr(self, part) if part else self, key)
            if value not in choices:
                raise ValueError(f"{name}: expected one of {choices}, got {value!r}")
        for name, low, high, whole in LIMITS:
            part, key = NAMES[name]
            check_number(name, getattr(getattr(self, part), key), low, high, whole=whole)
        check_number("heat_step_s", self.heat_step_s, 1.0, 3600.0)
        check_number("infiltration_ach", self.infiltration_ach, 0.0)
        if self.outputs.annual_glare and self.method == "point-in-time":
            raise ValueError("annual glare needs the three-phase or the five-phase method")
        if self.outputs.spectral and self.method == "point-in-time":
            raise ValueError("spectral needs the three-phase or the five-phase method")
        if self.outputs.derives and self.method == "point-in-time":
            raise ValueError("sensitivities and bands need the three-phase or the five-phase method")

    @property
    def sky(self) -> dict[str, str]:
        """The options of sun and sky, by their names in `annual_sky`."""
        return {"sun_model": self.sun_model, "ground": self.sky_ground}

    @classmethod
    def of(cls, **choices: Any) -> RoomOptions:
        """Options by name, such as `method="three-phase", sensor_spacing=0.5`; all others have their defaults.

        `RoomOptions().named()` is all names with their defaults; `cfs run --help` has their meaning and units.
        """
        return cls().changed(**choices)

    def changed(self, **choices: Any) -> RoomOptions:
        """These options with changes by the names of `NAMES`.

        Raises: `TypeError` for an unknown name.
        """
        own: dict[str, Any] = {}
        parts: dict[str, dict[str, Any]] = {}
        for name, value in choices.items():
            if name not in NAMES:
                raise TypeError(f"no option {name!r}; there are {', '.join(NAMES)}")
            part, key = NAMES[name]
            if part:
                parts.setdefault(part, {})[key] = value
            else:
                own[key] = value
        if "view_samples" in parts.get("sampling", {}):  # of a single hour: not averaged over hours
            parts["sampling"]["picture_samples"] = 2 * parts["sampling"]["view_samples"]
        for part, values in parts.items():
            own[part] = replace(getattr(self, part), **values)
        return replace(self, **own)

    def named(self) -> dict[str, Any]:
        """Every option by its name in `NAMES`, in that order."""
        return {name: getattr(getattr(self, part) if part else self, key) for name, (part, key) in NAMES.items()}


# Options by their name in files, flags and Python: part of `RoomOptions` ("": none), name there
NAMES = {
    "method": ("", "method"),
    "picture_hours": ("outputs", "picture_hours"),
    "picture_count": ("outputs", "picture_count"),
    "picture_size": ("outputs", "picture_size"),
    "picture_samples": ("sampling", "view_samples"),  # of a pixel; 4 x 4 share what is reflected
    "sky_subdivision": ("sampling", "subdivision"),
    "sensor_spacing": ("grid", "spacing"),
    "sensor_height": ("grid", "height"),
    "sensor_margin": ("grid", "margin"),
    "sensor_samples": ("sampling", "sensor_samples"),
    "patch_samples": ("sampling", "patch_samples"),
    "sun_points": ("sampling", "sun_points"),
    "window_parts": ("sampling", "window_parts"),
    "annual_glare": ("outputs", "annual_glare"),
    "spectral": ("outputs", "spectral"),
    "sensitivities": ("outputs", "sensitivities"),
    "bands": ("outputs", "bands"),
    "channels": ("outputs", "channels"),
    "glare_sources": ("outputs", "glare_sources"),
    "glare_sun": ("outputs", "glare_sun"),
    "sun_model": ("", "sun_model"),
    "sky_ground": ("", "sky_ground"),
    "sky_light": ("", "sky_light"),
    "sky_spectrum": ("", "sky_spectrum"),
    "path_samples": ("sampling", "hour_samples"),
    "heat_step_s": ("", "heat_step_s"),
    "infiltration_ach": ("", "infiltration_ach"),
    "equipment_w_m2": ("occupancy", "equipment_w_m2"),
    "person_w": ("occupancy", "person_w"),
    "floor_per_person": ("occupancy", "floor_per_person"),
    "occupied": ("occupancy", "hours"),
    "seed": ("sampling", "seed"),
}

# Least and greatest of options that are numbers, and whether they are whole
LIMITS = (
    ("sensor_spacing", 1e-3, math.inf, False),
    ("sensor_height", 0.0, math.inf, False),
    ("sensor_margin", 0.0, math.inf, False),
    ("picture_count", 0, math.inf, True),
    ("picture_size", 1, math.inf, True),
    ("equipment_w_m2", 0.0, math.inf, False),
    ("person_w", 0.0, math.inf, False),
    ("floor_per_person", 1e-3, math.inf, False),
)
SKY_LIGHTS = ("by direction", "hemispherical")
# Allowed values of the options that are words
CHOICES = {
    "glare_sources": GLARE_SOURCES,
    "glare_sun": GLARE_SUN,
    "sun_model": SUN_MODELS,
    "sky_ground": GROUNDS,
    "sky_light": SKY_LIGHTS,
    "sky_spectrum": SKY_SPECTRA,
    "channels": tuple(CHANNEL_SETS),
}


def named_types() -> dict[str, Any]:
    """The type of each option by its name in `NAMES`."""
    type_hints = get_type_hints(RoomOptions)
    return {
        name: (get_type_hints(type_hints[part]) if part else type_hints)[key] for name, (part, key) in NAMES.items()
    }
