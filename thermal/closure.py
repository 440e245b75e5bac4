"""Closure of the Blackbox model: layer resistance and film resistances.

Each is named in the result with the error that it had against EnergyPlus (docs/thermal.md):

    layers     ISO 15099 layer by layer: R(T_m, dT), the films that the faces really have, g
    gap        the same for typical layers with the stated gas gap
    typical    the same for typical layers alone: the default
    surface    R(T_m, dT) stated as six coefficients
    linear     U linear in the mean temperature
    constant   plain Kuhn
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from thermal.blackbox import SLOPE, Fenestration, LayerResistance, linear_u, with_realised_films
from thermal.errors import require, require_range
from thermal.glazing import Gap
from thermal.glazing_unit import GlazingUnit
from thermal.iso15099 import Iso15099Data, iso15099_data
from thermal.notes import ThermalNote

U_MODELS = ("typical", "constant", "linear", "gap", "surface", "layers")
BY_LAYERS = ("typical", "gap", "layers")  # R, films and emissivities are those of `Closure.unit`
CASES = 128
BY_DIRECTION = ", g by direction"  # of a key of `ERRORS`
# RMSE [K] of air and of the window's inner face in CASES, by position of the shade and model; U, g
# at normal incidence and BSDF of low-e double glazing, position stated (docs/thermal.md).  Outside:
# the larger of a blind's and a shade's
ERRORS: dict[str, dict[str, tuple[float, float]]] = {
    "none": {
        "typical": (0.09, 0.11),
        "typical" + BY_DIRECTION: (0.09, 0.11),
        "gap": (0.09, 0.11),
        "constant": (0.29, 0.41),
        "linear": (0.61, 0.85),
        "layers": (0.11, 0.13),
    },
    "external": {
        "typical": (0.17, 0.25),
        "typical" + BY_DIRECTION: (0.27, 0.39),
        "gap": (0.16, 0.23),
        "constant": (0.18, 0.28),
        "linear": (0.35, 0.52),
        "layers": (0.14, 0.21),
    },
    "internal": {
        "typical": (0.23, 0.21),
        "typical" + BY_DIRECTION: (0.45, 0.46),
        "gap": (0.23, 0.20),
        "constant": (0.37, 0.35),
        "linear": (0.55, 1.03),
        "layers": (0.24, 0.29),
    },
}


# The inputs with which `ERRORS` were measured
PLAIN = ThermalNote("from U, g at normal incidence, BSDF and the shade's position")
INPUTS = {
    "typical" + BY_DIRECTION: ThermalNote("from U, g by direction, BSDF and the shade's position"),
    "layers": ThermalNote("from the layers and the BSDF"),
    "gap": ThermalNote("from U, g at normal incidence, BSDF, the shade's position and the gas gap"),
}
# Realised film that a shade has: field of `Closure`, and of `Iso15099Data`
FACES = {"internal": "realised_inner_resistance", "external": "realised_outer_resistance"}
OF_DATA = {"internal": "r_inner", "external": "r_outer"}


@dataclass(frozen=True, slots=True)
class Closure:
    """Thermal data of a system besides U and g."""

    u_model: str = "typical"  # one of U_MODELS
    gap: Gap | None = None  # for "gap"
    realised_inner_resistance: float | None = None  # [m2 K/W], see `with_realised_films`
    realised_outer_resistance: float | None = None
    slope: float = SLOPE  # of U for "linear" [1/K]
    surface: LayerResistance | None = None  # for "surface"
    unit: GlazingUnit | None = None  # for "layers"; for "typical" and "gap" by `with_typical`

    def __post_init__(self) -> None:
        known = ", ".join(U_MODELS)
        require(self.u_model in U_MODELS, "u_model", f"{self.u_model!r} is not of {known}")
        for model, value, what in (
            ("gap", self.gap, "the data of a gap"),
            ("surface", self.surface, "the resistance by temperature"),
        ):
            fits = (self.u_model == model) == (value is not None)
            require(fits, "u_model", f'"{model}" and {what} belong together')
        fits = self.unit is not None if self.u_model == "layers" else True
        fits &= self.unit is None or self.u_model in BY_LAYERS
        require(fits, "u_model", '"layers" and layers belong together')
        for film in (self.realised_inner_resistance, self.realised_outer_resistance):
            if film is not None:
                require_range(film, 1e-3, 1.0, "realised resistance", "m2 K/W")
        require_range(self.slope, -0.05, 0.05, "slope of U", "1/K")

    @property
    def states_films(self) -> bool:
        """Whether the films are given that the faces really have."""
        return not (self.realised_inner_resistance is None and self.realised_outer_resistance is None)

    def with_typical(self, unit: GlazingUnit | None, u_value: float) -> Closure:
        """Closure with what typical layers add: all of it, or the films of their shade.

        Args: unit: of `typical_unit`; None: there is none with this U, and R is constant.
        """
        if unit is None:
            return self if self.u_model not in BY_LAYERS else replace(self, u_model="constant", gap=None)
        if self.u_model in BY_LAYERS:
            return replace(self, unit=unit)
        if self.states_films or unit.shade_place not in FACES:
            return self
        data = iso15099_data(unit, u_value)
        return replace(self, **{FACES[unit.shade_place]: getattr(data, OF_DATA[unit.shade_place])})

    def layers(self, u_value: float | None) -> Iso15099Data | None:
        """ISO 15099 data of the layers, shifted to a given U; None without layers."""
        return None if self.unit is None else iso15099_data(self.unit, u_value)

    def close(self, plain: Fenestration) -> Fenestration:
        """The system with this closure; `plain` has the constant resistance of its U."""
        closed, films = plain, (self.realised_inner_resistance, self.realised_outer_resistance)
        data = self.layers(plain.u_value)
        if self.u_model == "linear":
            closed = replace(closed, resistance=linear_u(closed.u_value, slope=self.slope))
        if self.surface is not None:
            closed = replace(closed, resistance=self.surface)
        if data is not None and self.unit is not None:
            place, ends = self.unit.shade_place, (self.unit.layers[0], self.unit.layers[-1])
            closed = replace(
                closed,
                resistance=data.resistance,
                emissivity_out=ends[0].emissivity[0] + ends[0].infrared_transmittance,
                emissivity_in=ends[1].emissivity[1] + ends[1].infrared_transmittance,
            )
            # outside, typical layers do not know slats from a sheet: two layers err less for both
            known = self.u_model == "layers" or place != "external"
            if data.shade is not None and films == (None, None) and known:
                closed = replace(closed, resistance=data.shade.panes, shade=data.shade)
                if data.shade.exterior:
                    return replace(closed, emissivity_out=data.shade.emissivity)
                return replace(closed, emissivity_in=data.shade.emissivity)
            films = (
                data.r_inner if place == "internal" and films[0] is None else films[0],
                data.r_outer if place == "external" and films[1] is None else films[1],
            )
        if films == (None, None):
            return closed
        return with_realised_films(closed, r_inner_realised=films[0], r_outer_realised=films[1])

    def described(self, place: str, *, g_by_direction: bool = False, stated: bool = True) -> ThermalNote:
        """The closure in words, and the error to expect.

        Args:
            g_by_direction: g is stated by direction, not at normal incidence alone.
            stated: U, g and the shade's position are, as in the cases with the known error.
        """
        words = {
            "typical": ThermalNote("ISO 15099 with typical layers"),
            "constant": ThermalNote("Kuhn's Blackbox model with constant resistance"),
            "linear": ThermalNote("U-value linear in temperature, {slope:.3g} %/K", {"slope": 100 * self.slope}),
            "gap": ThermalNote("ISO 15099 with typical panes and the stated gas gap"),
            "surface": ThermalNote("resistance by temperature as stated, R(T_m, dT)"),
            "layers": ThermalNote("ISO 15099, layer by layer"),
        }[self.u_model]
        if self.states_films or (self.unit is not None and place in FACES):
            words = ThermalNote("{model}, with films of the shade", {"model": words})
        key = self.u_model
        if g_by_direction and key != "layers":
            key += BY_DIRECTION
        known = ERRORS.get(place, {}).get(key)
        if known is None:
            return ThermalNote("{model}; error unknown", {"model": words})
        if not stated and key != "layers":
            return ThermalNote(
                "{model}; error unknown: it was compared with EnergyPlus from stated U, g and position of the shade",
                {"model": words},
            )
        return ThermalNote(
            "{model}; RMS error against EnergyPlus in {cases} cases of low-e double glazing, "
            "{inputs}: air {air:.2f} K, glass {glass:.2f} K",
            {"model": words, "cases": CASES, "inputs": INPUTS.get(key, PLAIN), "air": known[0], "glass": known[1]},
        )
