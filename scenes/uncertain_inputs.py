"""Inputs of a room that nobody knows exactly, and how far they usually are from their true values.

The standard deviations are those of careful assumptions at the design stage, before anything has been
measured; their sources are in docs/sensitivities.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from scenes.language.catalogue import N_


@dataclass(frozen=True, slots=True)
class UncertainInput:
    """An input, its unit and its usual standard deviation in that unit."""

    key: str
    label: str  # in English, to be translated
    unit: str
    deviation: float


INPUTS = {
    one.key: one
    for one in (
        UncertainInput("reflectance_floor", N_("reflectance of the floor"), "", 0.06),
        UncertainInput("reflectance_walls", N_("reflectance of the walls"), "", 0.09),
        UncertainInput("reflectance_ceiling", N_("reflectance of the ceiling"), "", 0.06),
        UncertainInput("reflectance_furniture", N_("reflectance of the furniture"), "", 0.14),
        UncertainInput("reflectance_ground", N_("reflectance of the ground"), "", 0.05),
        UncertainInput("transmittance_percent", N_("light through the windows"), "%", 5.0),
        UncertainInput("sky_percent", N_("light of the sky and the sun"), "%", 5.0),
        UncertainInput("tracing", N_("noise of tracing"), "", 1.0),
        UncertainInput("tilt_deg", N_("tilt of the slats"), "deg", 3.0),
        UncertainInput("g_value", N_("g-value of the windows"), "", 0.018),
        UncertainInput("u_value", N_("U-value of the windows"), "W/(m2 K)", 0.18),
        UncertainInput("gains_percent", N_("heat of people and devices"), "%", 20.0),
        UncertainInput("infiltration_percent", N_("air through leaks"), "%", 30.0),
        UncertainInput("heating_set_c", N_("set point of heating"), "K", 0.5),
        UncertainInput("cooling_set_c", N_("set point of cooling"), "K", 0.5),
        UncertainInput("slat_width_mm", N_("width of the slats"), "mm", 2.0),
        UncertainInput("slat_reflectance", N_("reflectance of the slats"), "", 0.05),
    )
}
