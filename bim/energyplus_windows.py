"""Windows of an EnergyPlus model by their BSDF: `Construction:ComplexFenestrationState`.

A system is Kuhn's Blackbox there as here: two layers that absorb what ours absorb of every
direction.  Where it is two known panes they and their gas stand between them, and EnergyPlus' own
ISO 15099 says the resistance of the hour.  Else it is that of air that is too thin to flow:
EnergyPlus 25.2 takes no other gas than its own four there and no other pressure than the sea's, so
that resistance, which gives the system's U, is made of several gaps, divided by layers that
neither absorb nor radiate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.energyplus_parts import Model, layer_keys
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from thermal.blackbox import R_INNER, R_OUTER, Fenestration, LayerAbsorptances
from thermal.glazing_unit import GasGap, GlazingUnit

PANE = 0.001  # [m] thickness of a virtual layer
PANE_CONDUCTIVITY = 100.0  # [W/(m K)]: a hundred-thousandth of a window's resistance
NO_EMISSION = 1e-4  # EnergyPlus takes no 0: of the faces to the gap, whose resistance is given
GAPS = 3  # of a resistance, in every state: EnergyPlus switches between equals only
TYPICAL = 10.0, 15.0  # mean of the layers [degC] and difference [K]: EN 673
AIR = 2.873e-3 + 7.76e-5 * (TYPICAL[0] + 273.15)  # conductivity [W/(m K)], ISO 15099 annex B


@dataclass(frozen=True, slots=True)
class WindowOptics:
    """A fenestration system in one state as the heat balance takes it, with its matrices."""

    solar: KlemsBsdf  # Klems full, all blocks
    visible: KlemsBsdf
    fenestration: Fenestration
    absorptances: LayerAbsorptances  # [K]
    back_absorptance: float  # diffuse, from the room
    unit: GlazingUnit | None = None  # the panes whose resistance `fenestration` has

    @property
    def panes(self) -> GlazingUnit | None:
        """Two panes and their gap, where the system is just that."""
        one = self.unit
        shaded = one is None or any(layer.openings is not None for layer in one.layers)
        return None if shaded or one is None or len(one.layers) != 2 else one

    def simplified(self, *, panes: bool) -> tuple[str, ...]:
        """Its properties that the EnergyPlus model does not have; panes: see `complex_state`."""
        reasons = []
        one = self.fenestration
        known = panes and self.panes is not None
        if not known and one.layer_resistance.kind != "constant":
            reasons.append("its layers' resistance, which varies, is that of its U")
        if one.shade is not None or one.extra_inner or one.extra_outer:
            reasons.append("what a shade gives to the air behind it counts in its U alone")
        return tuple(f"{one.name}: {what}" for what in reasons)


def complex_state(model: Model, name: str, optics: WindowOptics, *, panes: bool) -> None:
    """Write the construction `name` of a system in one state.

    Args: panes: by its two panes where they are known; not for a window of several states, as
        EnergyPlus switches between equal numbers of layers only.
    """
    size = KLEMS_FULL.size
    spectral = {}
    for band, data in (("solar", optics.solar), ("visible", optics.visible)):
        filled = data.filled()
        # EnergyPlus' own name for the visible back reflectance says transmittance
        back = "transmittance" if band == "visible" else "reflectance"
        for side, values in (
            ("front_transmittance", filled.transmission_front),
            (f"back_{back}", filled.reflection_back),
        ):
            key = f"{band}_optical_complex_{side}_matrix_name"
            spectral[key] = _matrix(model, f"{name} {band} {side}", values)
    gaps, stack = _layers(model, optics, panes=panes)
    still = [(np.zeros(size), np.zeros(size))] * (len(gaps) - 1)
    sun = optics.absorptances.two_layers(optics.fenestration)
    absorbed = [(sun.outer, np.zeros(size)), *still, (sun.inner, np.full(size, optics.back_absorptance))]
    layers: dict[str, str] = {f"gap_{k}_name": gap for k, gap in enumerate(gaps, 1)}
    keys = layer_keys(len(stack))
    for k, (key, pair, pane) in enumerate(zip(keys, absorbed, stack, strict=True), 1):
        layers[f"{key}_name"] = pane
        for side, values in zip(("front", "back"), pair, strict=True):
            layers[f"{key}_directional_{side}_absorptance_matrix_name"] = _matrix(
                model, f"{name} layer {k} {side}", values[None, :]
            )
    model.setdefault("Construction:ComplexFenestrationState", {})[name] = {
        "basis_type": "LBNLWINDOW",
        "basis_symmetry_type": "None",
        "window_thermal_model": _thermal_model(model),
        "basis_matrix_name": _basis(model),
        **spectral,
        **layers,
    }


def shading_control(model: Model, window: str, schedule: str, constructions: Sequence[str], number: int) -> None:
    """The window's construction of every time step, by the state that a schedule says."""
    sensor, actuator = f"state_{number}", f"window_{number}"
    model.setdefault("EnergyManagementSystem:Sensor", {})[sensor] = {
        "output_variable_or_output_meter_index_key_name": schedule,
        "output_variable_or_output_meter_name": "Schedule Value",
    }
    model.setdefault("EnergyManagementSystem:Actuator", {})[actuator] = {
        "actuated_component_unique_name": window,
        "actuated_component_type": "Surface",
        "actuated_component_control_type": "Construction State",
    }
    known = model.setdefault("EnergyManagementSystem:ConstructionIndexVariable", {})
    lines = []
    for j, construction in enumerate(constructions):
        index = f"construction_{number}_{j}"
        known[index] = {"construction_object_name": construction}
        word = "IF" if j == 0 else "ELSEIF"
        lines += [f"{word} {sensor} == {j}", f"SET {actuator} = {index}"]
    program = f"shade_{number}"
    model.setdefault("EnergyManagementSystem:Program", {})[program] = {
        "lines": [{"program_line": line} for line in (*lines, "ENDIF")]
    }
    model.setdefault("EnergyManagementSystem:ProgramCallingManager", {})[f"call_{number}"] = {
        "energyplus_model_calling_point": "BeginZoneTimestepBeforeInitHeatBalance",
        "programs": [{"program_name": program}],
    }


def _matrix(model: Model, name: str, values: NDArray[np.float64]) -> str:
    """A matrix, row by row; of BSDF values a row for each outgoing direction."""
    rows, columns = values.shape
    model.setdefault("Matrix:TwoDimension", {})[name] = {
        "number_of_rows": rows,
        "number_of_columns": columns,
        "values": [{"value": float(f"{v:.7g}")} for v in values.ravel()],
    }
    return name


def _basis(model: Model) -> str:
    """The full Klems basis: polar angle [deg] and number of azimuths of each ring."""
    name = "Klems full"
    if name not in model.get("Matrix:TwoDimension", {}):
        bounds = np.degrees(KLEMS_FULL.theta_bounds)
        middle = 0.5 * (bounds[:-1] + bounds[1:])
        middle[0] = 0.0
        _matrix(model, name, np.stack([middle, KLEMS_FULL.phi_counts], axis=1))
    return name


def _thermal_model(model: Model) -> str:
    name = "ISO 15099"
    model.setdefault("WindowThermalModel:Params", {})[name] = {
        "standard": "ISO15099",
        "thermal_model": "ISO15099",
        "sdscalar": 1.0,
        "deflection_model": "NoDeflection",
    }
    return name


def _layers(model: Model, optics: WindowOptics, *, panes: bool) -> tuple[list[str], list[str]]:
    """Names of the gaps and of the layers of a system, outermost first."""
    if panes and optics.panes is not None:
        real = [_pane(model, *one.emissivity, one.thickness, one.conductivity) for one in optics.panes.layers]
        (gap,) = optics.panes.gaps
        return [_gas_gap(model, gap)], real
    one = optics.fenestration
    gaps = _gaps(model, _resistance(one))
    faces = [
        (one.emissivity_out, NO_EMISSION),
        *[(NO_EMISSION,) * 2] * (len(gaps) - 1),
        (NO_EMISSION, one.emissivity_in),
    ]
    return gaps, [_pane(model, *pair, PANE, PANE_CONDUCTIVITY) for pair in faces]


def _pane(model: Model, front: float, back: float, thickness: float, conductivity: float) -> str:
    """A layer with the emissivities of its faces; its sun is in the matrices."""
    name = f"Layer {front:g} {back:g} {1e3 * thickness:g} mm {conductivity:g}"
    model.setdefault("WindowMaterial:Glazing", {})[name] = {
        "optical_data_type": "BSDF",
        "thickness": thickness,
        "conductivity": conductivity,
        "infrared_transmittance_at_normal_incidence": 0.0,
        "front_side_infrared_hemispherical_emissivity": front,
        "back_side_infrared_hemispherical_emissivity": back,
    }
    return name


def _gas_gap(model: Model, gap: GasGap) -> str:
    """The gap between two panes."""
    known = [(gas, share) for gas, share in gap.gas if share > 0.0]
    gas = " ".join(f"{gas} {share:g}" for gas, share in known)
    name = f"{gas} {1e3 * gap.width:g} mm"
    mixture: dict[str, object] = {"thickness": gap.width, "number_of_gases_in_mixture": len(known)}
    for k, (one, share) in enumerate(known, 1):
        mixture |= {f"gas_{k}_type": one.title(), f"gas_{k}_fraction": share}
    model.setdefault("WindowMaterial:GasMixture", {})[gas] = mixture
    model.setdefault("WindowMaterial:Gap", {})[name] = {
        "thickness": gap.width,
        "gas_or_gas_mixture_": gas,
        "pressure": 101325.0,
    }
    return name


def _resistance(system: Fenestration) -> float:
    """Resistance between the layers that gives the system's U between the films of EN 673 [m2 K/W].

    So what a shade gives to the air behind it, which has no object of its own, counts in U.
    """
    of_u = 1.0 / system.u_value - R_OUTER - R_INNER
    return of_u if of_u > 0 else float(system.in_series().layer_resistance.at(*TYPICAL))


def _gaps(model: Model, resistance: float) -> list[str]:
    """Gaps of still air that have a resistance [m2 K/W] together; it falls by 0.3 % per kelvin."""
    thickness = resistance * AIR
    gas, gap = "still air", f"Gap {1e3 * thickness / GAPS:.4g} mm"
    model.setdefault("WindowMaterial:Gas", {})[gas] = {"gas_type": "Air", "thickness": 0.01}
    model.setdefault("WindowMaterial:Gap", {})[gap] = {
        "thickness": thickness / GAPS,
        "gas_or_gas_mixture_": gas,
        "pressure": 101325.0,
    }
    return [gap] * GAPS
