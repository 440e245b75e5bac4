"""Closure of the Blackbox model: layer resistance and film resistances.

The best that the data allow, each named in the result with the error that it had in 128 cases
against EnergyPlus (docs/thermal.md):

    layers     ISO 15099 layer by layer: R(T_m, dT), the films that the faces really have, g
    surface    R(T_m, dT) stated as six coefficients
    gap        R(T_m, dT) of the gas gap of a double glazing
    linear     U linear in the mean temperature
    constant   plain Kuhn
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from thermal.blackbox import (
    SLOPE,
    Fenestration,
    LayerResistance,
    linear_u,
    with_realised_films,
)
from thermal.errors import require, require_range
from thermal.glazing import Gap, gap_resistance
from thermal.glazing_unit import GlazingUnit
from thermal.iso15099 import Iso15099Data, iso15099_data
from thermal.notes import ThermalNote

U_MODELS = ("constant", "linear", "gap", "surface", "layers")
# Films that a shade's face realises at 0 and 20 degC [m2 K/W], R_i inside and R_e outside: of a
# grey shade 50 mm behind and 100 mm before a low-e argon double glazing 6/16/6
TYPICAL_FILMS = {"internal": (0.0715, None), "external": (None, 0.0236)}
# RMSE [K] of air and of the window's inner face in the 128 cases (docs/thermal.md), by place and U
# model, "+" with the films that the shade realises; outside: the larger of a blind's and a shade's;
# "constant" and "gap": the larger of g by direction and of g at normal incidence, that in 64 cases
ERRORS: dict[str, dict[str, tuple[float, float]]] = {
    "none": {
        "constant": (0.38, 0.55), "linear": (0.61, 0.84), "gap": (0.13, 0.17),
        "surface": (0.13, 0.16), "layers": (0.17, 0.21),
    },
    "external": {
        "constant": (0.92, 1.54), "constant+": (0.22, 0.32), "linear": (0.45, 0.82),
        "gap": (0.52, 0.85), "gap+": (0.18, 0.28), "surface+": (0.23, 0.34),
        "layers+": (0.17, 0.29),
    },
    "internal": {
        "constant": (1.28, 3.50), "constant+": (0.75, 0.84), "linear": (0.37, 2.45),
        "gap": (0.49, 2.63), "gap+": (0.31, 0.57), "surface+": (0.47, 0.61),
        "layers+": (0.44, 0.25),
    },
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Closure:
    """Thermal data of a system besides U and g."""

    u_model: str = "constant"  # one of U_MODELS
    gap: Gap | None = None  # for "gap"
    realised_inner_resistance: float | None = None  # [m2 K/W], see `with_realised_films`
    realised_outer_resistance: float | None = None
    slope: float = SLOPE  # of U for "linear" [1/K]
    surface: tuple[float, ...] | None = None  # six coefficients of 1/R, for "surface"
    unit: GlazingUnit | None = None  # for "layers"

    def __post_init__(self) -> None:
        known = ", ".join(U_MODELS)
        require(self.u_model in U_MODELS, "u_model", f"{self.u_model!r} is not of {known}")
        for model, value, what in (
            ("gap", self.gap, "the data of a gap"),
            ("surface", self.surface, "the coefficients of a surface"),
            ("layers", self.unit, "layers"),
        ):
            fits = (self.u_model == model) == (value is not None)
            require(fits, "u_model", f'"{model}" and {what} belong together')
        for film in (self.realised_inner_resistance, self.realised_outer_resistance):
            if film is not None:
                require_range(film, 1e-3, 1.0, "realised resistance", "m2 K/W")
        require_range(self.slope, -0.05, 0.05, "slope of U", "1/K")

    @property
    def states_films(self) -> bool:
        """Whether the films are given that the faces really have."""
        return not (
            self.realised_inner_resistance is None and self.realised_outer_resistance is None
        )

    def for_place(self, place: str) -> Closure:
        """Closure with the typical film resistances of a shade in that position, unless stated."""
        if self.unit is not None or self.states_films or place not in TYPICAL_FILMS:
            return self
        inner, outer = TYPICAL_FILMS[place]
        return replace(self, realised_inner_resistance=inner, realised_outer_resistance=outer)

    def layers(self, u_value: float | None) -> Iso15099Data | None:
        """ISO 15099 data of the layers, shifted to a given U; None without layers."""
        return None if self.unit is None else iso15099_data(self.unit, u_value)

    def close(self, plain: Fenestration) -> Fenestration:
        """The system with this closure; `plain` has the constant resistance of its U."""
        closed, films = plain, (self.realised_inner_resistance, self.realised_outer_resistance)
        data = self.layers(plain.u_value)
        if self.u_model == "linear":
            closed = replace(closed, resistance=linear_u(closed.u_value, slope=self.slope))
        if self.gap is not None:
            resistance = gap_resistance(closed.u_value, self.gap, item=closed.name)
            closed = replace(closed, resistance=resistance)
        if self.surface is not None:
            closed = replace(closed, resistance=LayerResistance("surface", self.surface))
        if data is not None and self.unit is not None:
            place, ends = self.unit.shade_place, (self.unit.layers[0], self.unit.layers[-1])
            closed = replace(
                closed,
                resistance=data.resistance,
                emissivity_out=ends[0].emissivity[0] + ends[0].infrared_transmittance,
                emissivity_in=ends[1].emissivity[1] + ends[1].infrared_transmittance,
            )
            films = (
                data.r_inner if place == "internal" else films[0],
                data.r_outer if place == "external" else films[1],
            )
        if films == (None, None):
            return closed
        return with_realised_films(closed, r_inner_realised=films[0], r_outer_realised=films[1])

    def described(self, place: str) -> ThermalNote:
        """The closure in words, and the error to expect."""
        words = {
            "constant": ThermalNote("Kuhn's Blackbox model with constant resistance"),
            "linear": ThermalNote(
                "U-value linear in temperature, {slope:.3g} %/K", {"slope": 100 * self.slope}
            ),
            "gap": ThermalNote("resistance of the gas gap by temperature, R(T_m, dT)"),
            "surface": ThermalNote("resistance by temperature as stated, R(T_m, dT)"),
            "layers": ThermalNote("ISO 15099, layer by layer"),
        }[self.u_model]
        shaded = self.unit is not None and place in TYPICAL_FILMS
        films = self.states_films or shaded
        if films:
            words = ThermalNote("{model}, with films of the shade", {"model": words})
        known = ERRORS.get(place, {}).get(self.u_model + ("+" if films else ""))
        if known is None:
            return ThermalNote("{model}; error unknown", {"model": words})
        return ThermalNote(
            "{model}; RMS error against EnergyPlus over 128 cases: air {air:.2f} K, glass "
            "{glass:.2f} K",
            {"model": words, "air": known[0], "glass": known[1]},
        )
