"""Hourly boundary conditions of a zone: weather, and solar radiation absorbed by windows and walls.

Time stamps follow EPW: hour h is (h-1, h]; temperatures and wind are values at its end, solar
arrays are means over it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require

SIGMA = 5.6697e-8  # [W/(m2 K4)] as in EnergyPlus
KELVIN = 273.15


@dataclass(frozen=True, slots=True)
class Climate:
    """Outdoor conditions."""

    outdoor_c: NDArray[np.float64]  # [H] dry bulb [degC]
    sky_c: NDArray[np.float64]  # [H] effective sky temperature [degC]
    wind_speed: NDArray[np.float64]  # [H] at 10 m in open country [m/s]
    wind_direction_deg: NDArray[np.float64]  # [H] clockwise from north, where it comes from
    ground_c: NDArray[np.float64]  # [H] below the floor [degC]
    pressure: NDArray[np.float64]  # [H] [Pa]

    def __post_init__(self) -> None:
        hours = len(self.outdoor_c)
        limits = {
            "outdoor_c": (-90.0, 70.0),
            "sky_c": (-150.0, 70.0),
            "wind_speed": (0.0, 100.0),
            "wind_direction_deg": (0.0, 360.0),
            "ground_c": (-60.0, 60.0),
            "pressure": (3e4, 1.2e5),
        }
        for name, (low, high) in limits.items():
            values = np.asarray(getattr(self, name), dtype=float)
            require(values.shape == (hours,), f"weather {name}", f"expected [{hours}] values")
            bad = np.flatnonzero(~((values >= low) & (values <= high)))
            message = f"{len(bad)} hours outside {low:g} to {high:g}"
            require(bad.size == 0, f"weather {name}", message + f", first {bad[:1]}")
            object.__setattr__(self, name, values)

    @property
    def hours(self) -> int:
        """Number of hours H."""
        return len(self.outdoor_c)


def sky_temperature(horizontal_infrared: ArrayLike) -> NDArray[np.float64]:
    """Effective sky temperature [degC] from horizontal infrared irradiance [W/m2] (EPW)."""
    return (np.asarray(horizontal_infrared, dtype=float) / SIGMA) ** 0.25 - KELVIN


def undisturbed_ground(outdoor_c: ArrayLike, *, depth: float = 0.5) -> NDArray[np.float64]:
    """Ground temperature [H] [degC] at a depth [m] from a year of outdoor temperatures.

    The annual mean and the first harmonic of the air, damped and delayed (Kusuda and Achenbach
    1965) with a soil diffusivity of 0.055 m2/day.
    """
    outdoor = np.asarray(outdoor_c, dtype=float)
    phase = 2 * np.pi * np.arange(len(outdoor)) / len(outdoor)
    harmonic = 2 * np.mean(outdoor * np.exp(-1j * phase))
    decay = depth * np.sqrt(np.pi / (365 * 0.055))
    return outdoor.mean() + np.real(harmonic * np.exp(-decay * (1 + 1j)) * np.exp(1j * phase))


@dataclass(frozen=True, slots=True)
class Solar:
    """Sun absorbed by one zone; the first axis T has H hours, or H times the steps of an hour."""

    absorbed_outer: NDArray[np.float64]  # [T, W] by the outer window layer [W/m2 of glazing]
    absorbed_inner: NDArray[np.float64]  # [T, W] by the inner window layer [W/m2 of glazing]
    inside: NDArray[np.float64]  # [T, F] transmitted sun absorbed by the opaque surfaces [W]
    facade: NDArray[np.float64]  # [T, F] irradiance on the outside of the opaque surfaces [W/m2]
    # [T, W] light of the room absorbed at the room side of the windows [W/m2 of glazing]
    window_inside: NDArray[np.float64] | None = None
    window_facade: NDArray[np.float64] | None = None  # [T, W] irradiance on the frames [W/m2]
    # [T, W] by the innermost pane behind an interior shade [W/m2 of glazing]
    absorbed_middle: NDArray[np.float64] | None = None
    state: NDArray[np.int64] | None = None  # [H, W] shading state of every hour

    def __post_init__(self) -> None:
        for name in ("absorbed_outer", "absorbed_inner", "inside", "facade"):
            values = np.asarray(getattr(self, name), dtype=float)
            require(values.ndim == 2, f"solar {name}", f"expected two axes, got {values.shape}")
            fault = not np.all(np.isfinite(values)) or bool(np.any(values < -1e-6))
            require(not fault, f"solar {name}", "negative or missing values")
            object.__setattr__(self, name, values)
        if self.state is not None:
            object.__setattr__(self, "state", np.asarray(self.state, dtype=np.int64))


def no_sun(hours: int, surfaces: int, windows: int) -> Solar:
    """A zone in the dark, for a number of hours, opaque surfaces and windows."""
    glass, walls = np.zeros((hours, windows)), np.zeros((hours, surfaces))
    return Solar(absorbed_outer=glass, absorbed_inner=glass, inside=walls, facade=walls)


def to_steps(hour_end_values: ArrayLike, steps: int) -> NDArray[np.float64]:
    """Values at the end of every step [H * steps]: linear between the hours' ends, year cyclic."""
    values = np.asarray(hour_end_values, dtype=float)
    weight = (np.arange(steps) + 1.0) / steps
    previous = np.roll(values, 1)
    return (previous[:, None] * (1 - weight) + values[:, None] * weight).ravel()
