"""What the heat balance needs of a fenestration system: U, g and absorptances by direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.energyplus_windows import WindowOptics
from mitsuba_cfs.bsdf.glazing import Pane
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.pane_stack import absorbed_by_layers
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem
from thermal.blackbox import (
    Fenestration,
    LayerAbsorptances,
    layer_absorptances,
)
from thermal.closure import Closure
from thermal.errors import ThermalInputError, require
from thermal.glazing_unit import GlazingUnit
from thermal.gvalue import ThermalData, inward_share, position_of_share, thermal_data
from thermal.iso15099 import STATED_G, iso15099_g_values, prescribed
from thermal.layered import layered_thermal_data
from thermal.notes import ThermalNote
from thermal.typical_unit import absorbing, bisected, likely_units, typical_unit

FloatArray = NDArray[np.float64]


def sun_in_layers(
    unit: GlazingUnit, transmittance: ArrayLike, reflectance: ArrayLike, incidence: ArrayLike
) -> NDArray[np.float64]:
    """Solar absorptance of every layer [K, N], see `pane_stack.absorbed_by_layers`.

    A pane is coated where its sides differ.

    Args:
        transmittance, reflectance: [K] of the whole system, direction to hemisphere, solar.
        incidence: [K] [rad].

    Raises: `ThermalInputError` where a pane's solar values are missing or two layers are shades.
    """
    shades = sum(layer.openings is not None for layer in unit.layers)
    require(shades <= 1, "layers", "expected at most one shade")
    panes: list[Pane | None] = []
    for number, layer in enumerate(unit.layers, start=1):
        item = f"layers: layer {number}"
        if layer.openings is not None:
            panes.append(None)
            continue
        message = "its solar transmittance and reflectances are missing"
        require(layer.solar is not None, item, message)
        tau, front, back = layer.solar
        panes.append(Pane(item, tau, front, back, coated=front != back))
    return absorbed_by_layers(panes, transmittance, reflectance, incidence)


SHADE_SCATTERS = 0.03  # share of diffuse light beyond which a BSDF is that of a shade: a dense
# screen scatters 0.09 of what it transmits, a blind 0.25, panes none


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
    notes: tuple[str, ...]  # what had to be assumed
    model: str  # the window model by name, and the error to expect

    @property
    def named_model(self) -> str:
        """A sentence for results: the window model of the system."""
        return Note(
            "{system}: window model {model}.", system=self.fenestration.name, model=self.model
        )


def thermal_system(system: FenestrationSystem) -> ThermalSystem:
    """U, g and layer absorptances by direction of a system."""
    solar = system.solar
    tau = np.minimum(solar.direct_hemispherical(solar.transmission_front), 1.0)  # to rounding
    rho = solar.direct_hemispherical(solar.reflection_front)
    rho = np.minimum(rho, 1.0 - tau)
    place = _place(system)
    guess = None if system.shading_position is not None else _guessed_place(system, tau, rho)
    place = guess or place
    window = window_model(
        tau, rho, solar.basis_in.centres()[0], place, system.closure or Closure(),
        u_value=system.u_value, g_normal=system.g_value, item=system.name,
    )  # fmt: skip
    data, closure = window.data, window.closure
    g_value = data.g_value if system.g_by_patch is None else system.g_by_patch
    back_rho, back_tau = (
        _diffuse(solar, block) for block in (solar.reflection_back, solar.transmission_back)
    )
    fenestration = closure.close(Fenestration(system.name, data.u_value))
    films = {"r_outer": fenestration.r_outer, "r_inner": fenestration.r_inner}
    inward = fenestration.inward_shares()
    notes = [
        *map(_note, data.assumptions),
        *_unplaced(system),
        *_guess_note(system, guess),
    ]
    if system.g_by_patch is None and not system.from_values:
        notes += _typical_note(system, window, tau, rho)
    return ThermalSystem(
        fenestration,
        layer_absorptances(
            tau,
            rho,
            g_value,
            data.u_value,
            inward=inward,
            item=system.name,
            **films,
            room_air=window.to_air(),
        ),
        tau,
        rho,
        g_value,
        back_rho,
        max(1.0 - back_rho - back_tau, 0.0),
        tuple(notes),
        _note(closure.described(place, g_by_direction=system.g_by_patch is not None)),
    )


@dataclass(frozen=True, slots=True)
class WindowModel:
    """U and g by direction, and the closure that goes with them."""

    data: ThermalData
    closure: Closure
    typical: GlazingUnit | None  # layers that were assumed
    likely: tuple[GlazingUnit, ...] = ()  # others that are as likely
    absorbed: FloatArray | None = None  # [K, N] by the layers, stated or typical

    def to_air(self) -> FloatArray | float:
        """Absorbed sun [K] that goes to the room's air behind an interior shade."""
        films = self.closure.states_films
        layered = None if films else self.closure.layers(self.data.u_value)
        if layered is None or layered.behind is None or self.absorbed is None:
            return 0.0
        return self.absorbed @ np.array(layered.behind.to_air)


def window_model(
    tau: NDArray[np.float64],
    rho: NDArray[np.float64],
    incidence: NDArray[np.float64],
    position: str,
    closure: Closure,
    *,
    u_value: float | None,
    g_normal: float | None,
    item: str,
) -> WindowModel:
    """U, g by direction and closure from the data that are known, the first direction normal.

    Without stated layers they are `typical_unit`'s: shares of the absorbed radiation by direction,
    films, and the resistance unless the closure states it.

    Args: tau, rho: [K] solar, direction to hemisphere; incidence: [K] [rad].
    """
    known = {"u_value": u_value, "g_normal": g_normal, "item": item}
    if closure.unit is not None:
        absorbed = sun_in_layers(closure.unit, tau, rho, incidence)
        data = layered_thermal_data(closure.unit, tau, rho, absorbed, **known)
        return WindowModel(data, closure, None, absorbed=absorbed)
    data = thermal_data(tau, rho, shading_position=position, **known)
    unit = typical_unit(position, data.u_value, closure.gap)
    closed = closure.with_typical(unit, data.u_value)
    if unit is None:
        return WindowModel(data, closed, None)
    g, absorbed = _g_of(unit, data, tau, rho, incidence, item)
    likely = likely_units(position, data.u_value, closure.gap)
    return WindowModel(replace(data, g_value=g), closed, unit, tuple(likely), absorbed)


PANE_ABSORPTION = (0.2, 2.5)  # bounds of the panes' absorptance over that of typical ones


def _g_of(
    unit: GlazingUnit, data: ThermalData, tau: FloatArray, rho: FloatArray,
    incidence: FloatArray, item: str,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """g [K] by the shares of a unit's layers, from that of `data` at normal incidence.

    With a shade, the panes absorb what makes the unit's g that of `data`; within
    `PANE_ABSORPTION`, else the gain is scaled.  Also what each layer absorbs [K, N].
    """
    first, normal = float(data.g_value[0]), (tau[:1], rho[:1], incidence[:1])

    def excess(factor: float) -> float:
        changed = absorbing(unit, factor)
        absorbed = sun_in_layers(changed, *normal)
        return (
            float(iso15099_g_values(changed, prescribed(*STATED_G), tau[:1], absorbed)[0]) - first
        )

    if unit.shade_place != "none":
        low, high = PANE_ABSORPTION
        falls = -1.0 if excess(low) > excess(high) else 1.0
        unit = absorbing(unit, bisected(lambda factor: falls * excess(factor), low, high))
    absorbed = sun_in_layers(unit, tau, rho, incidence)
    g = layered_thermal_data(
        unit, tau, rho, absorbed, u_value=data.u_value, g_normal=first, item=item
    ).g_value
    return g, absorbed


def _typical_note(
    system: FenestrationSystem, window: WindowModel, tau: FloatArray, rho: FloatArray
) -> list[Note]:
    """The layers that are assumed, and the range of g for diffuse light over likely ones."""
    unit, basis = window.typical, system.solar.basis_in
    if unit is None:
        return []
    weight = basis.projected_solid_angles()
    weight = weight / weight.sum()
    # the range needs few directions: one of each ring of the basis
    angles, rings = np.unique(basis.centres()[0].round(6), return_inverse=True)
    share = np.bincount(rings, weight)
    mean = [np.bincount(rings, weight * v) / share for v in (tau, rho)]
    mean[0][0], mean[1][0] = tau[0], rho[0]
    g = [
        float(share @ _g_of(one, replace(window.data, g_value=window.data.g_value[:1]), *mean,
                            angles, system.name)[0])
        for one in window.likely
    ]  # fmt: skip
    used = float(weight @ window.data.g_value)
    panes = sum(layer.openings is None for layer in unit.layers)
    coating = min(min(layer.emissivity) for layer in unit.layers)
    return [
        Note(
            "{system}: layers assumed from U: {panes} panes, emissivity {coating:.2f} of the "
            "gap's faces, shade {position}; g for diffuse light {used:.3f}, with other likely "
            "layers {low:.3f} to {high:.3f}. State layers or gap.",
            system=system.name, panes=panes, coating=coating, position=unit.shade_place,
            used=used, low=min([used, *g]), high=max([used, *g]),
        )
    ]  # fmt: skip


def _note(of_model: ThermalNote) -> Note:
    """A note of the thermal model as one that a page can translate."""
    values = {
        key: _note(value) if isinstance(value, ThermalNote) else value
        for key, value in of_model.values.items()
    }
    return Note(of_model.template, **values)


def _place(system: FenestrationSystem) -> str:
    """Where the shade is: as stated, else as in the layers, else there is none."""
    unit = None if system.closure is None else system.closure.unit
    of_layers = None if unit is None else unit.shade_place
    stated = system.shading_position
    fits = None in (of_layers, stated) or of_layers == stated
    message = f"{stated!r}, but the layers have their shade {of_layers!r}"
    require(fits, f"{system.name}: shading_position", message)
    return stated or of_layers or "none"


def _guessed_place(
    system: FenestrationSystem, tau: NDArray[np.float64], rho: NDArray[np.float64]
) -> str | None:
    """Position of a shade whose U and g are known, from its inward share; None: not guessed."""
    layered = system.closure is not None and system.closure.unit is not None
    unknown = system.u_value is None or system.g_value is None
    if layered or unknown or scattered_share(system.solar) < SHADE_SCATTERS:
        return None
    share = inward_share(float(tau[0]), float(rho[0]), system.g_value, item=system.name)
    return position_of_share(share)


def _guess_note(system: FenestrationSystem, guess: str | None) -> list[Note]:
    if guess is None:
        return []
    return [
        Note(
            "{system}: scatters light like a shade, but its position is not stated; from g at "
            "normal incidence it is taken as {position}. State shading_position.",
            system=system.name, position=guess,
        )
    ]  # fmt: skip


def _unplaced(system: FenestrationSystem) -> list[Note]:
    """A sentence where what may be a shade is taken for panes, for want of its place and data."""
    layered = system.closure is not None and system.closure.unit is not None
    placed = system.shading_position is not None or layered
    by_patch = system.g_by_patch is not None
    known = system.u_value is not None and (by_patch or system.g_value is not None)
    if placed or known or scattered_share(system.solar) < SHADE_SCATTERS:
        return []
    return [
        Note(
            "{system}: scatters light like a shade, but its position is not stated; its U-value "
            "and g-value are those of glazing without a shade. State shading_position (external, "
            "internal, integrated or none).",
            system=system.name,
        )
    ]


def scattered_share(solar: KlemsBsdf) -> float:
    """Share of transmitted diffuse light from the front that does not leave straight on.

    Straight on is the patch with the number of the incident one; a normal beam alone would miss
    the slats that it passes between.
    """
    weight, block = solar.basis_in.projected_solid_angles(), solar.transmission_front
    total = float(weight @ solar.direct_hemispherical(block))
    if total < 1e-6 * weight.sum() or solar.basis_in.size != solar.basis_out.size:
        return 0.0
    straight = float(weight @ (np.diag(block) * solar.basis_out.projected_solid_angles()))
    return 1.0 - straight / total


def _diffuse(solar: KlemsBsdf, block: NDArray[np.float64]) -> float:
    """Hemispherical value for diffuse light."""
    weight = solar.basis_in.projected_solid_angles()
    return float(weight @ solar.direct_hemispherical(block) / weight.sum())


def window_optics(system: FenestrationSystem, heat: ThermalSystem) -> WindowOptics:
    """Matrices and layers of a system for EnergyPlus.

    Args: heat: of `thermal_system`.
    """
    closure, stated = system.closure, system.u_value is not None  # a stated U is not its panes'
    return WindowOptics(
        system.solar, system.visible, heat.fenestration, heat.absorptances, heat.back_absorptance,
        None if closure is None or stated else closure.unit,
    )  # fmt: skip


def checked_system(system: FenestrationSystem, path: Path | None) -> ThermalSystem:
    """The thermal data of a system.

    Args: path: the file that U and g are wrong in, for the message.

    Raises: `DataError` where U, g and the BSDF do not go together.
    """
    try:
        return thermal_system(system)
    except ThermalInputError as error:
        raise DataError(error.message, file=path, element=error.item) from error
