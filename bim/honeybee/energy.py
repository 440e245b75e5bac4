"""Constructions of a honeybee model as layers and as what windows state.

A surface's construction is its own, else its room's construction set's, else the model's global
set's.  Sources: honeybee-schema, "ConstructionSet"; EnergyPlus Input Output Reference, whose
materials these are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bim.defaults import air_layer, resistance_layer
from bim.honeybee.library import NamedObjects
from bim.model import Construction, MaterialLayer
from bim.polygon_rooms import GlazingValues
from bim.report.issue import Issue
from mitsuba_cfs.bsdf.glazing import PaneOptics, stack
from mitsuba_cfs.errors import DataError
from thermal.errors import ThermalInputError
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit
from thermal.iso15099 import NFRC, iso15099_g_values, iso15099_u_value

GASES = {"Air": "air", "Argon": "argon", "Krypton": "krypton", "Xenon": "xenon"}
GAPS = ("EnergyWindowMaterialGas", "EnergyWindowMaterialGasMixture")
PASSED = {"visible": 0.9, "solar": 0.85}  # transmittances that honeybee-schema takes by default
VEGETATION = "EnergyMaterialVegetation"  # a green roof's soil and plants
BLINDS = ("Shade", "Blind")  # ends of the types of shading materials
SHADED = ("WindowConstructionShade", "WindowConstructionDynamic")


@dataclass(frozen=True, slots=True)
class OpaqueValues:
    """Layers of an opaque construction and what its two sides absorb."""

    construction: Construction
    inner_visible: float | None  # reflectances of the side towards the room
    inner_solar: float | None
    outer_visible: float | None
    emissivity: float


class EnergyLibrary:
    """Materials, constructions and sets of a file, read when something refers to them."""

    def __init__(self, energy: Mapping[str, Any], file: Path) -> None:
        self.file = file
        self.objects = NamedObjects(energy, ("materials", "constructions"), "construction", file)
        self._opaque: dict[str, OpaqueValues] = {}
        self._windows: dict[str, GlazingValues] = {}

    def _construction(self, name: str) -> dict[str, Any]:
        return self.objects.find("constructions", name) or {}

    def _inner(self, one: Any) -> dict[str, Any]:
        """A construction that another one holds, or names."""
        return one if isinstance(one, dict) else self._construction(str(one))

    def opaque(self, name: str) -> OpaqueValues | None:
        """The layers of a construction; None for what is no opaque one (air boundary, unknown)."""
        if name not in self._opaque:
            one = self._construction(name)
            layers = self._layers(one)
            if not layers or not str(one.get("type", "")).startswith("Opaque"):
                self._not_of_kind(name, one, "an opaque construction")
                return None
            self._opaque[name] = self._opaque_values(name, layers)
        return self._opaque[name]

    def _not_of_kind(self, name: str, construction: Mapping[str, Any], expected: str) -> None:
        """Report a construction that is not of the kind that a surface needs."""
        reason = f"{name!r:.60} is of type {construction.get('type')!r:.60}, expected {expected}"
        issue = Issue("value-not-read", self.file.name, {"field": "construction", "reason": reason})
        if issue not in self.objects.issues:
            self.objects.issues.append(issue)

    def _opaque_values(self, name: str, layers: Sequence[dict]) -> OpaqueValues:
        inner, outer = layers[-1], layers[0]
        return OpaqueValues(
            Construction(name, tuple(self._layer(one) for one in layers), self.file.name),
            self._reflectance(inner, "visible"),
            self._reflectance(inner, "solar"),
            self._reflectance(outer, "visible"),
            self.objects.number(inner, "thermal_absorptance", 0.9, most=1.0),
        )

    def _layers(self, construction: Mapping[str, Any]) -> list[dict]:
        """A construction's materials, outermost first; [] where one of them is not there."""
        own = construction.get("materials") or construction.get("layers") or []
        if not isinstance(own, list):
            raise self.objects.fault("expected a list of materials", construction, "materials")
        layers = []
        for one in own:
            material = one if isinstance(one, dict) else self.objects.find("materials", str(one))
            if material is None:
                raise self.objects.fault(f"no material {one!r:.60}", construction, "materials")
            if not isinstance(material.get("identifier"), str):
                raise self.objects.fault("expected materials with an identifier", construction, "materials")
            layers.append(material)
        return layers

    def _layer(self, material: Mapping[str, Any]) -> MaterialLayer:
        name, kind = str(material["identifier"]), material.get("type")
        if kind == "EnergyMaterialNoMass":
            return resistance_layer(name, self.objects.number(material, "r_value", least=1e-5))
        if kind == "EnergyWindowMaterialGas":  # an air layer of a wall, such as honeybee's default
            thickness = self.objects.number(material, "thickness", 0.0125, least=1e-4)
            return air_layer(thickness, name)
        if kind == VEGETATION:
            issue = Issue("vegetation-not-computed", self.file.name, {"material": name})
            if issue not in self.objects.issues:
                self.objects.issues.append(issue)
        fields = ("thickness", "conductivity", "density", "specific_heat")
        return MaterialLayer(name, *(self.objects.number(material, f, least=1e-9) for f in fields))

    def _reflectance(self, material: Mapping[str, Any], band: str) -> float | None:
        """1 - absorptance; the visible one is the solar one where it is not stated."""
        of = "soil_" if material.get("type") == VEGETATION else ""
        solar = self.objects.number(material, f"{of}solar_absorptance", 0.7, most=1.0)
        field = f"{of}{band}_absorptance"
        return 1.0 - self.objects.number(material, field, solar, most=1.0)

    def window(self, name: str, height: float) -> GlazingValues | None:
        """What a window construction states; None for an unknown or opaque one.

        Panes and gaps are calculated: transmittances by all reflections at normal incidence, U
        and g by ISO 15099 in the conditions of NFRC.  Args: height: of the glass [m].
        """
        if name not in self._windows:
            construction = self._construction(name)
            kind = str(construction.get("type", ""))
            if kind.startswith(SHADED[1]):
                states = construction.get("constructions")
                construction = self._inner(states[0] if states and isinstance(states, list) else "")
            elif kind.startswith(SHADED[0]):
                construction = self._inner(construction.get("window_construction"))
            values = self._glazing(name, self._layers(construction), height)
            if values is None:
                self._not_of_kind(name, construction, "a window construction")
                return None
            self._windows[name] = values
        return self._windows[name]

    def has_shade(self, name: str) -> bool:
        """Whether a window's construction has a shade, or states that are not read."""
        one = self._construction(name)
        layered = str(one.get("type", "")).startswith(SHADED)
        return layered or any(str(m.get("type", "")).endswith(BLINDS) for m in self._layers(one))

    def unread_parts(self, name: str) -> list[str]:
        """Parts of a window's construction that are not computed: its frame, panes that scatter."""
        one = self._construction(name)
        inner = one.get("window_construction")
        constructions = [c for c in (one, inner) if isinstance(c, dict)]
        parts = ["EnergyWindowFrame"] if any(c.get("frame") for c in constructions) else []
        layers = [m for c in constructions for m in self._layers(c)]
        return [*parts, *(["solar_diffusing"] if any(map(_scatters, layers)) else [])]

    def _glazing(self, name: str, layers: Sequence[dict], height: float) -> GlazingValues | None:
        kinds = [str(one.get("type", "")) for one in layers]
        simple = [m for m, k in zip(layers, kinds, strict=True) if k.startswith("EnergyWindowMaterialSim")]
        if simple:
            one = simple[0]
            return GlazingValues(
                self.objects.number(one, "u_factor", least=1e-6),
                self.objects.number(one, "shgc", least=1e-6, most=1.0),
                self.objects.number(one, "vt", 0.54, least=1e-6, most=1.0),
                name=name,
            )
        if "EnergyWindowMaterialGasCustom" in kinds:
            message = f"a gas of its own is not computed: give one of {', '.join(GASES)}"
            raise DataError(message, file=self.file, element=name, field="materials")
        layers = self._without_shade(layers)
        kinds = ["gap" if str(one.get("type", "")) in GAPS else one.get("type") for one in layers]
        panes, gaps = layers[::2], layers[1::2]
        if "EnergyWindowMaterialGlazing" not in kinds:
            return None
        if {*kinds[::2]} != {"EnergyWindowMaterialGlazing"} or {*kinds[1::2]} - {"gap"}:
            message = "expected panes with one gap between each two"
            raise DataError(message, file=self.file, element=name, field="materials")
        try:
            return self._layered(name, panes, gaps, height)
        except ThermalInputError as error:
            raise DataError(str(error), file=self.file, element=name) from None

    def _without_shade(self, layers: Sequence[dict]) -> list[dict]:
        """The layers of a glazing without shades; the gaps on both sides of one are one gap."""
        unshaded: list[dict] = []
        behind_shade = False
        for one in layers:
            kind = str(one.get("type", ""))
            after_gap = bool(unshaded) and str(unshaded[-1].get("type", "")) in GAPS
            if kind.endswith(BLINDS):
                behind_shade = True
                continue
            if behind_shade and kind in GAPS and after_gap:
                widths = [self._width(gap) for gap in (unshaded[-1], one)]
                unshaded[-1] = unshaded[-1] | {"thickness": sum(widths)}
            elif not (behind_shade and kind in GAPS and not unshaded):
                unshaded.append(one)
            behind_shade = False
        ends_in_gap = bool(unshaded) and str(unshaded[-1].get("type", "")) in GAPS
        return unshaded[:-1] if behind_shade and ends_in_gap else unshaded

    def _layered(self, name: str, panes: Sequence[dict], gaps: Sequence[dict], height: float) -> GlazingValues:
        bands = {}
        for band in ("visible", "solar"):
            bands[band] = [self._pane(pane, band) for pane in panes]
        visible, solar = (stack(bands[band]) for band in ("visible", "solar"))
        layers = [
            GlazingLayer(
                self.objects.number(pane, "thickness", 0.003, least=1e-6),
                self.objects.number(pane, "conductivity", 0.9, least=1e-4),
                (
                    self.objects.number(pane, "emissivity", 0.84, least=1e-4, most=1.0),
                    self.objects.number(pane, "emissivity_back", 0.84, least=1e-4, most=1.0),
                ),
                self.objects.number(pane, "infrared_transmittance", 0.0, most=1.0),
            )
            for pane in panes
        ]
        unit = GlazingUnit(tuple(layers), tuple(self._gap(gap) for gap in gaps), float(np.clip(height, 0.05, 50.0)))
        g_value = iso15099_g_values(unit, NFRC[1], solar.tau, solar.absorptance)
        u_value = iso15099_u_value(unit, NFRC[0])
        return GlazingValues(u_value, float(g_value), float(visible.tau), float(solar.tau), len(panes), name)

    def _pane(self, pane: Mapping[str, Any], band: str) -> PaneOptics:
        tau, rho = (
            self.objects.number(pane, f"{band}_{what}", default, most=1.0)
            for what, default in (("transmittance", PASSED[band]), ("reflectance", 0.075))
        )
        tau *= self.objects.number(pane, "dirt_correction", 1.0, most=1.0)
        back = pane.get(f"{band}_reflectance_back")
        back = rho if not isinstance(back, int | float) else float(back)
        if tau + max(rho, back) > 1 + 1e-9 or back < 0:
            raise self.objects.fault("passes and reflects more than it gets", pane, f"{band}_reflectance")
        return PaneOptics(np.array(tau), np.array(rho), np.array(back))

    def _width(self, gap: Mapping[str, Any]) -> float:
        """Of a gap [m]."""
        return self.objects.number(gap, "thickness", 0.0125, least=5e-4, most=1.0)

    def _gap(self, gap: Mapping[str, Any]) -> GasGap:
        names = gap.get("gas_types") or [gap.get("gas_type", "Air")]
        shares = gap.get("gas_fractions") or [1.0]
        known = isinstance(names, list) and isinstance(shares, list) and len(names) == len(shares)
        if not known or not all(one in GASES for one in names):
            raise self.objects.fault(f"expected of {', '.join(GASES)}", gap, "gas_type")
        return GasGap(self._width(gap), tuple((GASES[n], float(s)) for n, s in zip(names, shares, strict=True)))


def _scatters(material: Mapping[str, Any]) -> bool:
    return material.get("solar_diffusing") is True
