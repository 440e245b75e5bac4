"""Heating and cooling of a zone: ideal plant with radiant shares, and slabs with pipes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range


@dataclass(frozen=True, slots=True)
class IdealLoads:
    """Ideal heating and cooling; scalars hold for every hour, infinity switches off.

    Arrays have a value for every hour H, or for every time step T.  What is not radiant goes to
    the air; the radiant share is spread over the surfaces by area and emissivity, or acts at the
    inside of one of them: a heated floor, a cooled ceiling.
    """

    heating_c: NDArray[np.float64] | float = -np.inf  # [H] or [T] [degC] air set point
    cooling_c: NDArray[np.float64] | float = np.inf  # [H] or [T] [degC]
    heating_limit: float = np.inf  # [W]
    cooling_limit: float = np.inf  # [W], positive
    heating_radiant: float = 0.0  # share of the heat
    cooling_radiant: float = 0.0
    heating_surface: str = ""  # of the zone, at which its radiant share acts; "": all surfaces
    cooling_surface: str = ""

    def __post_init__(self) -> None:
        crossed = np.max(self.heating_c) > np.min(self.cooling_c) and np.any(
            _same_length(self.heating_c, self.cooling_c) > _same_length(self.cooling_c, self.heating_c)
        )
        require(not crossed, "set points", "the heating set point lies above the cooling one")
        for name in ("heating_c", "cooling_c", "heating_limit", "cooling_limit"):
            require(not np.any(np.isnan(getattr(self, name))), name, "is not a number")
        limits = min(self.heating_limit, self.cooling_limit)
        require(limits >= 0, "set points", f"a heating or cooling limit is negative: {limits} W")
        for share in (self.heating_radiant, self.cooling_radiant):
            require_range(share, 0.0, 1.0, "radiant share of heating or cooling")


@dataclass(frozen=True, slots=True)
class HeatedSlab:
    """Pipes or wires in a construction; power proportional to the deviation of the air temperature.

    Full power at half a band below the heating set point, none at half a band above it; cooling
    likewise.  Source: EnergyPlus Engineering Reference, "Low Temperature Radiant System".
    """

    surface: str  # of the zone
    depth: float  # of the pipes below the inside face [m]
    heating_c: NDArray[np.float64] | float = -np.inf  # [H] or [T] [degC]
    cooling_c: NDArray[np.float64] | float = np.inf  # [H] or [T] [degC]
    heating_limit: float = 0.0  # [W]
    cooling_limit: float = 0.0  # [W], positive
    band: float = 2.0  # [K]

    def __post_init__(self) -> None:
        item = f"heated slab {self.surface}"
        require(self.depth > 0, item, f"the depth must be positive, got {self.depth} m")
        require(self.band > 0, item, f"the band must be positive, got {self.band} K")
        limits = min(self.heating_limit, self.cooling_limit)
        require(0 <= limits < np.inf, item, f"expected a capacity in W, got {limits}")


def _same_length(values: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
    """Values repeated to the length of the finer of two arrays of set points."""
    array, length = np.atleast_1d(np.asarray(values, dtype=float)), np.size(other)
    return np.repeat(array, max(length // array.size, 1))
