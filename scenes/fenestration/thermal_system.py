"""What the heat balance needs of a fenestration system: U, g and absorptances by direction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import itemgetter
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.energyplus_windows import WindowOptics
from mitsuba_cfs.bsdf.glazing import Pane, absorbed_by_layers
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, NeighbourTilts
from thermal.blackbox import Fenestration, LayerAbsorptances
from thermal.closure import Closure
from thermal.errors import ThermalInputError, require
from thermal.glazing_unit import GlazingUnit
from thermal.gvalue import ThermalData
from thermal.notes import ThermalNote
from thermal.window_model import WindowModel, g_of_unit, likely_diffuse_g, window_model


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
    # layers as likely as those assumed, with the least and the most g for diffuse light
    likely: tuple[GlazingUnit, ...] = ()

    @property
    def named_model(self) -> str:
        """A sentence for results: the window model of the system."""
        return Note("{system}: window model {model}.", system=self.fenestration.name, model=self.model)


@lru_cache(maxsize=128)  # each room of a building asks for it again, of every tilt
def thermal_system(system: FenestrationSystem) -> ThermalSystem:
    """U, g and layer absorptances by direction of a system."""
    between = None if system.between is None else _between_tilts(system, system.between)
    return _of_layers(system) if between is None else between


def _between_tilts(system: FenestrationSystem, tilts: NeighbourTilts) -> ThermalSystem | None:
    """The mean of the data at two tilts, the layers of the nearer; None where U or the nodes of the layers differ."""
    low, high = thermal_system(tilts.low), thermal_system(tilts.high)
    ends = low.fenestration, high.fenestration
    shades = {None if one.shade is None else one.shade.exterior for one in ends}
    if len(shades) > 1 or ends[0].u_value != ends[1].u_value:
        return None
    near, share = (low if tilts.share <= 0.5 else high), tilts.share

    def mean(one: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
        return (1 - share) * np.asarray(one) + share * np.asarray(other)

    a, b = low.absorptances, high.absorptances
    absorbed = LayerAbsorptances(
        mean(a.outer, b.outer), mean(a.inner, b.inner), max(a.clipped, b.clipped), mean(a.middle, b.middle)
    )
    return replace(
        near,
        fenestration=replace(near.fenestration, name=system.name),
        absorptances=absorbed,
        transmittance=mean(low.transmittance, high.transmittance),
        reflectance=mean(low.reflectance, high.reflectance),
        g_value=mean(low.g_value, high.g_value),
        back_reflectance=float(mean(low.back_reflectance, high.back_reflectance)),
        back_absorptance=float(mean(low.back_absorptance, high.back_absorptance)),
        notes=(),
    )


def _of_layers(system: FenestrationSystem) -> ThermalSystem:
    """The data of a system by its layers, stated or typical."""
    solar = system.solar
    tau = np.minimum(solar.direct_hemispherical(solar.transmission_front), 1.0)  # to rounding
    rho = solar.direct_hemispherical(solar.reflection_front)
    rho = np.minimum(rho, 1.0 - tau)
    incidence = solar.basis_in.centres()[0]
    weight = solar.basis_in.projected_solid_angles()
    weight = weight / weight.sum()
    back_rho, back_tau = (
        float(weight @ solar.direct_hemispherical(block)) for block in (solar.reflection_back, solar.transmission_back)
    )
    scatters = scattered_share(solar) >= SHADE_SCATTERS
    window = window_model(
        tau,
        rho,
        incidence,
        system.shading_position,
        system.closure or Closure(),
        absorbed=sun_in_layers,
        u_value=system.u_value,
        g_normal=system.g_value,
        item=system.name,
        scatters=scatters,
    )
    data, closure = window.data, window.closure
    by_patch = system.g_by_patch is not None
    g_value = system.g_by_patch if by_patch else data.g_value
    fenestration = closure.close(Fenestration(system.name, data.u_value))
    absorptances = window.absorptances(tau, rho, g_value, fenestration, item=system.name)
    position_notes = tuple(_position_note(system, window, scatters))
    stated = not (data.assumptions or position_notes)
    model = closure.described(window.position, g_by_direction=by_patch, stated=stated)
    layers = None if by_patch or system.from_values else window.typical
    optics = (tau, rho, incidence)
    likely = layers and likely_diffuse_g(window, optics, weight, sun_in_layers, system.name)
    extremes: tuple[GlazingUnit, ...] = ()
    notes = [*map(_note, data.assumptions), *position_notes]
    if layers is not None and likely is not None:
        used = float(weight @ data.g_value)
        notes.append(_typical_note(system.name, layers, used, likely))
        by_g = sorted(zip([used, *likely], [layers, *window.likely], strict=True), key=itemgetter(0))
        extremes = (by_g[0][1], by_g[-1][1])
    return ThermalSystem(
        fenestration,
        absorptances,
        tau,
        rho,
        g_value,
        back_rho,
        max(1.0 - back_rho - back_tau, 0.0),
        tuple(notes),
        _note(model),
        extremes,
    )


def with_likely_layers(system: FenestrationSystem, number: int) -> FenestrationSystem:
    """The system with one of its `likely` layers, of equal U and g; else as it is.

    Args: number: 0 for the least g for diffuse light, 1 for the most.
    """
    heat = thermal_system(system)
    if not heat.likely:
        return system
    unit, u_value = heat.likely[number], heat.fenestration.u_value
    optics = heat.transmittance, heat.reflectance, system.solar.basis_in.centres()[0]
    data = ThermalData(u_value, heat.g_value, ())
    g_by_patch, _ = g_of_unit(unit, data, optics, sun_in_layers, system.name)
    closure = Closure("layers", unit=unit)
    return replace(system, u_value=u_value, g_by_patch=g_by_patch, closure=closure, shading_position=None)


def _typical_note(name: str, unit: GlazingUnit, used: float, likely: Sequence[float]) -> Note:
    """The layers that are assumed, and the range of g for diffuse light over likely ones."""
    return Note(
        "{system}: layers assumed from U: {panes} panes, emissivity {coating:.2f} of the "
        "gap's faces, shade {position}; g for diffuse light {used:.3f}, with other likely "
        "layers {low:.3f} to {high:.3f}. State layers or gap.",
        system=name,
        panes=sum(layer.openings is None for layer in unit.layers),
        coating=min(min(layer.emissivity) for layer in unit.layers),
        position=unit.shade_place,
        used=used,
        low=min([used, *likely]),
        high=max([used, *likely]),
    )


def _note(of_model: ThermalNote) -> Note:
    """A note of the thermal model as one that a page can translate."""
    values = {key: _note(value) if isinstance(value, ThermalNote) else value for key, value in of_model.values.items()}
    return Note(of_model.template, **values)


def _position_note(system: FenestrationSystem, window: WindowModel, scatters: bool) -> Iterator[Note]:
    """A sentence where the position of what scatters like a shade is not stated."""
    if window.guessed:
        yield Note(
            "{system}: scatters light like a shade, but its position is not stated; from g at "
            "normal incidence it is taken as {position}. State shading_position.",
            system=system.name,
            position=window.position,
        )
    layered = system.closure is not None and system.closure.unit is not None
    placed = system.shading_position is not None or layered
    by_patch = system.g_by_patch is not None
    known = system.u_value is not None and (by_patch or system.g_value is not None)
    if scatters and not placed and not known:
        yield Note(
            "{system}: scatters light like a shade, but its position is not stated; its U-value "
            "and g-value are those of glazing without a shade. State shading_position (external, "
            "internal, integrated or none).",
            system=system.name,
        )


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


def window_optics(system: FenestrationSystem, heat: ThermalSystem) -> WindowOptics:
    """Matrices and layers of a system for EnergyPlus.

    Args: heat: of `thermal_system`.
    """
    closure, stated = system.closure, system.u_value is not None  # a stated U is not its panes'
    return WindowOptics(
        system.solar,
        system.visible,
        heat.fenestration,
        heat.absorptances,
        heat.back_absorptance,
        None if closure is None or stated else closure.unit,
    )


def checked_system(system: FenestrationSystem, path: Path | None) -> ThermalSystem:
    """The thermal data of a system.

    Args: path: the file that U and g are wrong in, for the message.

    Raises: `DataError` where U, g and the BSDF do not go together.
    """
    try:
        return thermal_system(system)
    except ThermalInputError as error:
        raise DataError(error.message, file=path, element=error.item) from error
