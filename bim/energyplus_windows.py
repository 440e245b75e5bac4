"""Windows of an EnergyPlus model by their BSDF: `Construction:ComplexFenestrationState`.

A system is Kuhn's Blackbox there as here: two layers that absorb what ours absorb of every
direction, with the resistance between them of air that is too thin to flow.  EnergyPlus 25.2 takes
no other gas than its own four there and no other pressure than the sea's, so that resistance is
made of several gaps, divided by layers that neither absorb nor radiate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.energyplus_parts import Model
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from thermal.blackbox import Fenestration, LayerAbsorptances

PANE = 0.001  # [m] thickness of a virtual layer
PANE_CONDUCTIVITY = 100.0  # [W/(m K)]: a hundred-thousandth of a window's resistance
NO_EMISSION = 1e-4  # EnergyPlus takes no 0: of the faces to the gap, whose resistance is given
GAPS = 3  # in every state: EnergyPlus switches between equals only
TYPICAL = 10.0, 15.0  # mean of the layers [degC] and difference [K] where R is read: EN 673
AIR = 2.873e-3 + 7.76e-5 * (TYPICAL[0] + 273.15)  # conductivity [W/(m K)], ISO 15099 annex B
WARMER_AIR = 7.76e-5 / AIR  # by which it rises [1/K]


@dataclass(frozen=True, slots=True)
class WindowOptics:
    """A fenestration system in one state as the heat balance takes it, with its matrices."""

    solar: KlemsBsdf  # Klems full, all blocks
    visible: KlemsBsdf
    fenestration: Fenestration
    absorptances: LayerAbsorptances  # [K]
    back_absorptance: float  # diffuse, from the room

    @property
    def simplified(self) -> tuple[str, ...]:
        """What of it EnergyPlus is not told."""
        found = []
        one = self.fenestration
        if one.layer_resistance.kind != "constant":
            found.append(f"its layers' resistance, which varies, is that at {TYPICAL[0]:g} C")
        if one.extra_inner or one.extra_outer:
            found.append("what a shade gives to the air behind it is left out")
        return tuple(f"{one.name}: {what}" for what in found)


def complex_state(model: Model, name: str, optics: WindowOptics) -> None:
    """Write the construction `name` of a system in one state."""
    one, size = optics.fenestration, KLEMS_FULL.size
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
    gaps = _gaps(model, float(one.layer_resistance.at(*TYPICAL)))
    still = [(np.zeros(size), np.zeros(size))] * (len(gaps) - 1)
    absorbed = [
        (optics.absorptances.outer, np.zeros(size)),
        *still,
        (optics.absorptances.inner, np.full(size, optics.back_absorptance)),
    ]
    faces = [(one.emissivity_out, NO_EMISSION), *[(NO_EMISSION,) * 2] * len(still),
             (NO_EMISSION, one.emissivity_in)]  # fmt: skip
    layers: dict[str, str] = {f"gap_{k}_name": gap for k, gap in enumerate(gaps, 1)}
    for k, (pair, emissivities) in enumerate(zip(absorbed, faces, strict=True), 1):
        key = "outside_layer" if k == 1 else f"layer_{k}"
        layers[f"{key}_name"] = _pane(model, *emissivities)
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


def shading_control(
    model: Model, window: str, schedule: str, constructions: Sequence[str], number: int
) -> None:
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
        "standard": "ISO15099", "thermal_model": "ISO15099", "sdscalar": 1.0,
        "deflection_model": "NoDeflection",
    }  # fmt: skip
    return name


def _pane(model: Model, front: float, back: float) -> str:
    """A virtual layer that conducts well, with the emissivities of its faces."""
    name = f"Layer {front:g} {back:g}"
    model.setdefault("WindowMaterial:Glazing", {})[name] = {
        "optical_data_type": "BSDF",
        "thickness": PANE,
        "conductivity": PANE_CONDUCTIVITY,
        "infrared_transmittance_at_normal_incidence": 0.0,
        "front_side_infrared_hemispherical_emissivity": front,
        "back_side_infrared_hemispherical_emissivity": back,
    }
    return name


def _gaps(model: Model, resistance: float) -> list[str]:
    """Gaps of still air that have a resistance [m2 K/W] together; it falls by 0.3 % per kelvin."""
    thickness = resistance * AIR
    gas, gap = "still air", f"Gap {1e3 * thickness / GAPS:.4g} mm"
    model.setdefault("WindowMaterial:Gas", {})[gas] = {"gas_type": "Air", "thickness": 0.01}
    model.setdefault("WindowMaterial:Gap", {})[gap] = {
        "thickness": thickness / GAPS, "gas_or_gas_mixture_": gas, "pressure": 101325.0,
    }  # fmt: skip
    return [gap] * GAPS
