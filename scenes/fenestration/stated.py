"""Windows without a BSDF whose file states U, g and transmittance: a clear glazing of these."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bim.fenestration import PlainGlass
from bim.model import Window
from mitsuba_cfs.bsdf.angular import roos_table, specular_matrices
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.simple_glazing import (
    HIGH_U,
    solar_reflectance,
    solar_transmittance,
    visible_reflectances,
)
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.attached import Held, held_thermal, usual_first
from scenes.fenestration.systems import FenestrationSystem, States, WindowOverrides
from scenes.language.catalogue import N_
from thermal.gvalue import TYPICAL_SYSTEMS

PANES = (1, 2, 3)  # that Roos' factor knows
NO_SHADE = (None, "none")


@dataclass(frozen=True, slots=True)
class StatedValues:
    """What is known of a glazing at normal incidence."""

    visible: float | None
    solar: float | None
    g_value: float | None
    u_value: float | None  # [W/(m2 K)]
    panes: int | None
    shade: bool = False  # there is one, of which no BSDF is known
    glass: PlainGlass | None = None  # a single pane, whose law of the angle is known

    def missing(self, light_only: bool) -> str:
        """What is needed and not stated, in words; empty where nothing is missing."""
        needed = {"no visible transmittance": self.visible is None}
        known = light_only or self.g_value is not None or self.glass is not None
        needed["no g"] = not known
        needed = [name for name, is_missing in needed.items() if is_missing]
        if self.shade:
            return "for its shade"
        return f"and its property sets state {' and '.join(needed)}" if needed else ""


def stated_systems(
    held: Held, windows: Iterable[Window], path: Path, overrides: WindowOverrides
) -> dict[str, States]:
    """The glazing of each window of which enough is attached or stated, the same ones shared."""
    found: dict[str, States] = {}
    known: dict[StatedValues, States] = {}
    for window in windows:
        values = stated_values(held, window, path, overrides)
        if values.missing(overrides.light_only):
            continue
        if values not in known:
            known[values] = (glazing_system(values, path.name),)
        found[window.guid] = known[values]
    return found


def stated_values(
    held: Held, window: Window, path: Path, overrides: WindowOverrides
) -> StatedValues:
    """What the user gives goes before what is attached, and that before what is stated."""
    states = usual_first(held.get(window.guid, ()))
    thermal = held_thermal(states[0]) if states else {}
    by_patch = thermal.get("g_by_patch")
    attached_g = thermal.get("g_value") if by_patch is None else float(by_patch[0])
    values = StatedValues(
        window.visible_transmittance,
        window.solar_transmittance,
        _first(overrides.g_value, attached_g, window.g_value),
        _first(overrides.u_value, thermal.get("u_value"), window.u_value),
        window.panes if window.panes in PANES else None,
        any(state.shading_position not in NO_SHADE for state in states),
        window.glass,
    )
    for name in ("visible", "solar", "g_value"):
        value = getattr(values, name)
        is_black = name == "visible" and value == 0 and values.glass is not None
        if value is not None and not (0 < value <= 1 or is_black):
            what = name if name == "g_value" else f"{name} transmittance"
            message = f"states {value:g} as its {what}: expected more than 0, at most 1"
            raise DataError(message, file=path, element=f"window {window.name or window.guid}")
    return values


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)


def glazing_system(values: StatedValues, file: str) -> FenestrationSystem:
    """A glazing of known values at normal incidence.

    Light: a single pane whose transmissivity and index are known follows Fresnel's equations, any
    other glazing falls with the angle after Roos et al. 2001. Sun: what is not stated follows from
    U and g by the simple window model (`mitsuba_cfs.bsdf.simple_glazing`).
    """
    u = TYPICAL_SYSTEMS["none"][0] if values.u_value is None else values.u_value
    panes = values.panes or (1 if u > HIGH_U else 2)
    name = "glazing, " + _in_words(values)
    if values.glass is None:
        front, back = visible_reflectances(values.visible)
        clear = Glazing(name, values.visible, front, back, panes)
        visible, table = specular_klems(clear, KLEMS_FULL), roos_table(clear)
        template = (
            N_("{system}: no BSDF; modelled as clear single glazing (Roos et al. 2001).")
            if panes == 1
            else N_(
                "{system}: no BSDF; modelled as clear glazing with {panes} panes (Roos et al. "
                "2001)."
            )
        )
        notes = [Note(template, system=name, panes=panes)]
    else:
        table = values.glass.table
        visible = specular_matrices(table)
        count = len(values.glass.panes)
        notes = [
            Note(
                "{system}: uncoated glass by Fresnel's equations, panes: {count}.",
                system=name,
                count=count,
            )
        ]
    solar, tau, g = visible, values.solar, values.g_value
    if g is not None:
        tau = solar_transmittance(u, g) if tau is None else tau
        rho = solar_reflectance(u, g, tau)
        solar = specular_klems(Glazing(name, tau, rho, rho, panes), KLEMS_FULL)
        if values.solar is None:
            notes.append(
                Note(
                    "{system}: solar transmittance {tau:.2f} from U and g (Arasteh et al. 2009).",
                    system=name,
                    tau=tau,
                )
            )
    elif values.glass is not None:
        notes.append(
            Note(
                "{system} has no {band} band; its {other} band is used instead.",
                system=name,
                band="Solar",
                other="Visible",
            )
        )
    return FenestrationSystem(
        name, visible, solar, u_value=values.u_value, g_value=g, shading_position="none",
        notes=tuple(notes), source=Note("the values stated in {file}", file=file),
        angular=table, from_values=True,
    )  # fmt: skip


def _in_words(values: StatedValues) -> str:
    parts = {"U": values.u_value, "g": values.g_value, "visible transmittance": values.visible}
    if values.solar is not None:
        parts["solar transmittance"] = values.solar
    return ", ".join(f"{name} {value:g}" for name, value in parts.items() if value is not None)
