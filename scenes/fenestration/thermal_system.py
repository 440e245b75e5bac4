"""What the heat balance needs of a fenestration system: U, g and absorptances by direction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import FenestrationSystem
from thermal.blackbox import (
    Fenestration,
    LayerAbsorptances,
    layer_absorptances,
)
from thermal.errors import ThermalInputError
from thermal.gvalue import thermal_data


@dataclass(frozen=True, slots=True)
class ThermalSystem:
    """A fenestration system as the heat balance needs it, and what had to be assumed."""

    fenestration: Fenestration
    absorptances: LayerAbsorptances  # [K]
    transmittance: NDArray[np.float64]  # [K] solar, direction to hemisphere
    reflectance: NDArray[np.float64]  # [K] from outside
    g_value: NDArray[np.float64]  # [K]
    back_reflectance: float  # diffuse, from the room
    back_absorptance: float  # diffuse, from the room
    notes: tuple[str, ...]


def thermal_system(system: FenestrationSystem) -> ThermalSystem:
    """U, g and layer absorptances by direction of a system."""
    solar = system.solar
    tau = np.minimum(solar.direct_hemispherical(solar.transmission_front), 1.0)  # to rounding
    rho = solar.direct_hemispherical(solar.reflection_front)
    rho = np.minimum(rho, 1.0 - tau)
    data = thermal_data(
        tau, rho, u_value=system.u_value, g_normal=system.g_value,
        shading_position=system.shading_position or "none", item=system.name,
    )  # fmt: skip
    g_value = data.g_value if system.g_by_patch is None else system.g_by_patch
    back_rho, back_tau = (
        _diffuse(solar, block) for block in (solar.reflection_back, solar.transmission_back)
    )
    fenestration, films = Fenestration(system.name, data.u_value), {}
    if system.closure is not None:
        fenestration = system.closure.close(fenestration)
        if system.closure.changes_films:
            films = {"r_outer": fenestration.r_outer, "r_inner": fenestration.r_inner}
    return ThermalSystem(
        fenestration,
        layer_absorptances(tau, rho, g_value, data.u_value, item=system.name, **films),
        tau,
        rho,
        g_value,
        back_rho,
        max(1.0 - back_rho - back_tau, 0.0),
        data.assumptions,
    )


def _diffuse(solar: KlemsBsdf, block: NDArray[np.float64]) -> float:
    """Hemispherical value for diffuse light."""
    weight = solar.basis_in.projected_solid_angles()
    return float(weight @ solar.direct_hemispherical(block) / weight.sum())


def checked_system(system: FenestrationSystem, path: Path) -> ThermalSystem:
    """The thermal data of a system.

    Args: path: the file that U and g are wrong in, for the message.

    Raises: `DataError` where U, g and the BSDF do not go together.
    """
    try:
        return thermal_system(system)
    except ThermalInputError as error:
        raise DataError(error.message, file=path, element=error.item) from error
