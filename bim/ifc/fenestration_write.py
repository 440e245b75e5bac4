"""Fenestration data into an IFC model: the property set of the dissertation's figures 21 and 22.

A window or window type gets one IfcPropertySet for each shading state: "BlackBox Model", or
"BlackBox Model: <state>".  It holds an IfcComplexProperty for each band of the BSDF, one for the
angular g-values, and U as IfcThermalTransmittanceMeasure.  Two departures from figure 21: BSDF
values are IfcReal, since values per steradian exceed the 1 that IfcNormalisedRatioMeasure allows;
angles are radians with their unit beside them, so that no number is rounded on the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from functools import cached_property
from itertools import pairwise

import ifcopenshell
import numpy as np

from bim.fenestration import AngularGValue, ShadingState
from bim.ifc.property_sets import Entity, give_set, list_of_numbers
from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from thermal.closure import Closure
from thermal.glazing import Gap
from thermal.glazing_unit import GasGap, GlazingUnit

SET_NAME = "BlackBox Model"
BLOCKS = {
    "transmission_front": "Transmittance front values",
    "transmission_back": "Transmittance back values",
    "reflection_front": "Reflectance front values",
    "reflection_back": "Reflectance back values",
}
WAVELENGTHS = {"Visible": (380.0, 780.0), "Solar": (300.0, 2500.0)}  # of the bands [nm]
G_NORMAL, G_BY_PATCH = "G-value at normal incidence", "G-value by Klems patch"
CLOSURE, POSITION = "Closure", "Shading position"
U_MODEL, GAP, LAYERS = "U-value with temperature", "Gap", "Layers"
SLOPE, SURFACE = "Slope of the U-value", "Coefficients of the layer resistance"
REALISED = {
    "realised_inner_resistance": "Realised inner resistance",
    "realised_outer_resistance": "Realised outer resistance",
}
HEAT_OF_LAYER = "Thickness, conductivity, infrared transmittance"
SOLAR_OF_LAYER = "Solar transmittance, reflectance front and back"
OPENINGS = "Openings top, bottom, left, right and share of the area"
BLOWN = "Speed and temperature of the air blown in"
RATIO = "IfcNormalisedRatioMeasure"
KLEMS, TREE = "BSDF matrix", "BSDF tensor tree"


def attach_state(model: ifcopenshell.file, targets: Sequence[Entity], state: ShadingState) -> None:
    """Give windows or window types a shading state; one of that name is replaced."""
    writer = _Writer(model)
    properties = [writer.bsdf(band, bsdf) for band, bsdf in state.bands.items()]
    if state.g_value is not None:
        properties.append(writer.g_values(state.g_value))
    if state.u_value is not None:
        properties.append(writer.single("U-value", "IfcThermalTransmittanceMeasure", state.u_value))
    if state.g_normal is not None:
        properties.append(writer.single(G_NORMAL, "IfcNormalisedRatioMeasure", state.g_normal))
    if state.g_by_patch is not None:
        ratio = "IfcNormalisedRatioMeasure"
        properties.append(writer.numbers(G_BY_PATCH, state.g_by_patch, ratio))
    if state.closure is not None:
        properties.append(writer.closure(state.closure))
    if state.shading_position is not None:
        properties.append(writer.text(POSITION, state.shading_position))
    if not properties:
        raise ValueError("a shading state without a BSDF, g, U, closure or position of its shade")
    what = "Optical and thermal properties of a fenestration system by direction"
    give_set(model, targets, set_name(state.name), what, properties)


def set_name(state: str) -> str:
    """Name of the property set of a shading state."""
    return f"{SET_NAME}: {state}" if state else SET_NAME


class _Writer:
    """Makes property entities of one model."""

    def __init__(self, model: ifcopenshell.file) -> None:
        self._model = model

    @cached_property
    def _radian(self) -> Entity:
        return self._unit("PLANEANGLEUNIT", None, "RADIAN")

    @cached_property
    def _metre(self) -> Entity:
        return self._unit("LENGTHUNIT", None, "METRE")

    @cached_property
    def _nanometre(self) -> Entity:
        return self._unit("LENGTHUNIT", "NANO", "METRE")

    def _unit(self, kind: str, prefix: str | None, name: str) -> Entity:
        return self._model.create_entity("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)

    def single(self, name: str, measure: str, value: float, unit: Entity | None = None) -> Entity:
        number = self._model.create_entity(measure, float(value))
        return self._model.create_entity("IfcPropertySingleValue", Name=name, NominalValue=number, Unit=unit)

    def text(self, name: str, value: str) -> Entity:
        label = self._model.create_entity("IfcLabel", value)
        return self._model.create_entity("IfcPropertySingleValue", Name=name, NominalValue=label)

    def complex(self, name: str, usage: str, properties: Sequence[Entity]) -> Entity:
        return self._model.create_entity(
            "IfcComplexProperty", Name=name, UsageName=usage, HasProperties=list(properties)
        )

    def bounded(self, name: str, low: float, high: float, measure: str, unit: Entity) -> Entity:
        create = self._model.create_entity
        return create(
            "IfcPropertyBoundedValue",
            Name=name,
            UpperBoundValue=create(measure, float(high)),
            LowerBoundValue=create(measure, float(low)),
            Unit=unit,
        )

    def numbers(self, name: str, values: np.ndarray, measure: str = "IfcReal", unit=None) -> Entity:
        kind = int if measure == "IfcInteger" else float
        plain = np.asarray(values, dtype=kind).ravel().tolist()
        made = list_of_numbers(self._model, name, measure, plain)
        made.Unit = unit
        return made

    def bsdf(self, band: str, bsdf: KlemsBsdf | TensorTreeBsdf) -> Entity:
        """The BSDF of one band, figure 21."""
        parts = []
        if band in WAVELENGTHS:
            low, high = WAVELENGTHS[band]
            measure = "IfcPositiveLengthMeasure"
            one = self.bounded("Wavelength range", low, high, measure, self._nanometre)
            parts.append(self.complex("Wavelength ranges", band, [one]))
        if isinstance(bsdf, KlemsBsdf):
            parts += self._angles("Incident", bsdf.basis_in) + self._angles("Outgoing", bsdf.basis_out)
            values = [self.numbers(BLOCKS[k], block) for k, block in bsdf.blocks().items()]
            usage = KLEMS
        else:
            values = []
            for key, name in BLOCKS.items():
                tree = getattr(bsdf, key)
                if tree is not None:
                    parts.append(self.numbers(f"{name}: depths", tree.depths, "IfcInteger"))
                    values.append(self.numbers(name, tree.values))
                    rank = tree.rank
            usage = f"{TREE} rank {rank}"
        parts.append(self.complex("Transmittance and reflectance values", "1/sr", values))
        return self.complex(f"BSDF {band}", usage, parts)

    def _angles(self, side: str, basis: KlemsBasis) -> list[Entity]:
        """Polar ranges of the rings, azimuth ranges of the patches in each."""
        bounds, measure = basis.theta_bounds, "IfcPlaneAngleMeasure"
        polar = [
            self.bounded(f"Angle range {i + 1}", low, high, measure, self._radian)
            for i, (low, high) in enumerate(pairwise(bounds))
        ]
        azimuth = []
        for ring, count in enumerate(basis.phi_counts):
            step = 2 * np.pi / count
            edges = (np.arange(count + 1) - 0.5) * step
            ranges = [
                self.bounded(f"Angle range {k + 1}", *edges[k : k + 2], measure, self._radian) for k in range(count)
            ]
            azimuth.append(self.complex(f"Polar range {ring + 1}", "azimuths", ranges))
        return [
            self.complex(f"{side} polar angle ranges", basis.name or "Klems", polar),
            self.complex(f"{side} azimuthal angle ranges", basis.name or "Klems", azimuth),
        ]

    def closure(self, closure: Closure) -> Entity:
        """What the resistance between the two virtual layers follows, and the realised films."""
        parts = [self.text(U_MODEL, closure.u_model)]
        for field, name in REALISED.items():
            value = getattr(closure, field)
            if value is not None:
                parts.append(self.single(name, "IfcThermalResistanceMeasure", value))
        if closure.u_model == "linear":
            parts.append(self.single(SLOPE, "IfcReal", closure.slope))  # [1/K]
        if closure.surface is not None:
            parts.append(self.numbers(SURFACE, np.array(closure.surface)))
        if closure.gap is not None:
            faces = self.numbers("Emissivities", closure.gap.emissivity, RATIO)
            gap = [*self._gas_gap(closure.gap), faces]
            parts.append(self.complex(GAP, "gas gap of a double glazing", gap))
        if closure.unit is not None:
            parts.append(self._layers(closure.unit))
        return self.complex(CLOSURE, "thermal model of two layers", parts)

    def _gas_gap(self, gap: Gap | GasGap) -> list[Entity]:
        """Width and gas of a gap."""
        gas = [self.single(name, RATIO, share) for name, share in gap.gas]
        width = self.single("Width", "IfcPositiveLengthMeasure", gap.width, self._metre)
        return [width, self.complex("Gas", "volume fractions", gas)]

    def _layers(self, unit: GlazingUnit) -> Entity:
        """Layers and gaps of a glazing from outside to inside, for ISO 15099."""
        parts = [self.numbers("Height, width, tilt", (unit.height, unit.width, unit.tilt_deg))]
        for number, layer in enumerate(unit.layers, start=1):
            heat = (layer.thickness, layer.conductivity, layer.infrared_transmittance)
            held = [self.numbers(HEAT_OF_LAYER, heat), self.numbers("Emissivities", layer.emissivity, RATIO)]
            if layer.solar is not None:
                held.append(self.numbers(SOLAR_OF_LAYER, layer.solar, RATIO))
            if layer.openings is not None:
                held.append(self.numbers(OPENINGS, astuple(layer.openings)))
            parts.append(self.complex(f"Layer {number}", "pane or shade", held))
        for number, gap in enumerate(unit.gaps, start=1):
            held = self._gas_gap(gap)
            if gap.blown is not None:
                held.append(self.numbers(BLOWN, gap.blown))
            parts.append(self.complex(f"Gap {number}", "behind the layer of that number", held))
        return self.complex(LAYERS, "outermost first", parts)

    def g_values(self, table: AngularGValue) -> Entity:
        """Angular g-values, polar angle by polar angle."""
        measure = "IfcPlaneAngleMeasure"
        return self.complex(
            "G-value",
            "total solar energy transmittance",
            [
                self.numbers("Polar angles", table.polar, measure, self._radian),
                self.numbers("Azimuthal angles", table.azimuth, measure, self._radian),
                self.numbers("G-values", table.values, "IfcNormalisedRatioMeasure"),
            ],
        )
