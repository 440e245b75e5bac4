"""Blackbox data of a layered system from WINDOW's ISO 15099 engine, where `pywincalc` is installed.

The user builds the layers with pywincalc (glass, shades, blinds, gaps); out come U, the realised
films, R(T_m, dT), and transmittance, reflectance and g per angle.  Convection at the faces is
prescribed, so that the films belong to the measuring condition and not to a climate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.blackbox import Fenestration, LayerResistance, fit_conductance_surface
from thermal.errors import require

FloatArray = NDArray[np.float64]
CONVECTION_OUTSIDE, CONVECTION_INSIDE = 20.0, 2.7  # [W/(m2 K)]; with radiation about 25 and 7.7
U_STATE_C = (0.0, 20.0)  # outdoors and indoors
G_STATE = (25.0, 24.0, 500.0)  # outdoors and indoors [degC], sun [W/m2]
OUTDOOR_C = (-25.0, -15.0, -5.0, 5.0, 15.0, 25.0, 35.0, 45.0)  # grid of R(T_m, dT)
INDOOR_C = (5.0, 15.0, 25.0, 35.0, 45.0)
ANGLES_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0)


@dataclass(frozen=True, slots=True)
class Iso15099Data:
    """What the Blackbox needs of a system."""

    u_value: float  # [W/(m2 K)] at U_STATE_C
    r_outer: float  # [m2 K/W] realised in that state: face to environment
    r_inner: float
    resistance: LayerResistance  # between the two faces
    incidence: FloatArray  # [A] [rad]
    transmittance: FloatArray  # [A] solar
    reflectance: FloatArray  # [A]
    g_value: FloatArray  # [A]

    def fenestration(self, name: str) -> Fenestration:
        """The system in the closure "R(T_m, dT)"."""
        return Fenestration(name, self.u_value, resistance=self.resistance)


def iso15099_data(
    solid_layers: Sequence[Any],
    gap_layers: Sequence[Any],
    *,
    height: float = 1.5,
    angles_deg: Sequence[float] = ANGLES_DEG,
    method: str = "SOLAR",
) -> Iso15099Data:
    """U, films, R(T_m, dT), optics and g of pywincalc layers, outside to inside.

    Args: height: of the glazing [m]; angles_deg: of incidence (in the plane phi = 0).

    Source: ISO 15099:2003, as WINDOW's engine computes it.
    """
    require(len(gap_layers) == len(solid_layers) - 1, "layers", "one gap between two layers")

    def system(outdoor: float, indoor: float, sun: float = 0.0) -> Any:
        return _system(solid_layers, gap_layers, height, outdoor, indoor, sun)

    u_value, r_outer, _, r_inner, _ = _dark_state(system(*U_STATE_C), *U_STATE_C)
    states = [
        _dark_state(system(e, i), e, i) for e in OUTDOOR_C for i in INDOOR_C if abs(i - e) > 5.0
    ]
    mean, difference, resistance = (
        np.array(column) for column in zip(*(_middle(state) for state in states), strict=True)
    )
    bright = system(*G_STATE)
    optics = [bright.optical_method_results(method, a, 0.0).system_results for a in angles_deg]
    front = [o.front for o in optics]
    return Iso15099Data(
        u_value,
        r_outer,
        r_inner,
        fit_conductance_surface(mean, difference, resistance),
        np.radians(angles_deg),
        np.array([_total(f.transmittance) for f in front]),
        np.array([_total(f.reflectance) for f in front]),
        np.array([bright.shgc(a, 0.0) for a in angles_deg]),
    )


def _total(property_: Any) -> float:
    return float(property_.direct_direct + property_.direct_diffuse)


def _system(
    solid: Sequence[Any],
    gaps: Sequence[Any],
    height: float,
    outdoor: float,
    indoor: float,
    sun: float,
) -> Any:
    import pywincalc

    prescribed = pywincalc.BoundaryConditionsCoefficientModelType.HC_PRESCRIBED

    def environment(celsius: float, film: float, light: float) -> Any:
        kelvin = celsius + 273.15
        return pywincalc.Environment(
            air_temperature=kelvin, pressure=101325.0, convection_coefficient=film,
            coefficient_model=prescribed, radiation_temperature=kelvin, emissivity=1.0,
            direct_solar_radiation=light,
        )  # fmt: skip

    return pywincalc.GlazingSystem(
        solid_layers=list(solid),
        gap_layers=list(gaps),
        width_meters=1.0,
        height_meters=height,
        environment=pywincalc.Environments(
            environment(outdoor, CONVECTION_OUTSIDE, sun),
            environment(indoor, CONVECTION_INSIDE, 0.0),
        ),
    )


def _dark_state(
    system: Any, outdoor: float, indoor: float
) -> tuple[float, float, float, float, tuple[float, float]]:
    """U, R_e, R, R_i and the temperatures of the outermost and innermost face [degC]."""
    import pywincalc

    u_value = float(system.u())
    faces = np.array(system.layer_temperatures(pywincalc.TarcogSystemType.U)) - 273.15
    heat = u_value * (indoor - outdoor)
    outer, inner = float(faces[0]), float(faces[-1])
    resistances = ((outer - outdoor) / heat, (inner - outer) / heat, (indoor - inner) / heat)
    return u_value, *resistances, (outer, inner)


def _middle(
    state: tuple[float, float, float, float, tuple[float, float]],
) -> tuple[float, float, float]:
    """Mean temperature, difference and resistance of a state."""
    *_, resistance, _, (outer, inner) = state
    return 0.5 * (outer + inner), inner - outer, resistance
