"""What kappa, an error of g and an error of U do to the temperatures (Figures 62 to 66)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tests.validation import reference_room
from tests.validation.energyplus_cases import (
    EPW_FILES,
    FIRST_HOUR,
    QUANTITIES,
    EnergyPlusCase,
    Site,
    our_case,
    reference_case,
    site,
    with_g,
)
from tests.validation.energyplus_statistics import case_row, pooled
from tests.validation.reference_systems import Optics, ReferenceSystem, read_optics, system
from thermal.gvalue import InternalShade

FloatArray = NDArray[np.float64]
SHADE = (0.10, 0.55)  # transmittance and reflectance of the reference set's diffuser
KAPPAS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
G_ERRORS = (-0.03, 0.03, 0.05, 0.10)
U_ERRORS = (-0.3, -0.1, 0.1, 0.3)


def kappa_system(folder: Path, kappa: float) -> ReferenceSystem:
    """The interior shade in plain Kuhn, its g from the glazing and the shade by kappa."""
    glazing, whole = read_optics(folder, "dgu"), read_optics(folder, "int_shade")
    at = np.interp
    diffuse = glazing.diffuse[0]
    u_glazing = system(folder, "dgu", "kuhn").fenestration.u_value
    shade = InternalShade(
        tau_glazing=at(whole.theta, glazing.theta, glazing.tau),
        rho_glazing=at(whole.theta, glazing.theta, glazing.rho),
        g_glazing=at(whole.theta, glazing.theta, glazing.g),
        tau_glazing_diffuse=diffuse[0],
        rho_glazing_diffuse_back=glazing.back["rho_back"],
        u_glazing=u_glazing,
        tau_shade=SHADE[0],
        rho_shade=SHADE[1],
        tau_shade_diffuse=SHADE[0],
        rho_shade_diffuse=SHADE[1],
    )
    hemispherical = replace(shade, tau_glazing=diffuse[0], rho_glazing=diffuse[1], g_glazing=diffuse[2])
    g = _physical(shade.kuhn(kappa=kappa)[2], whole.tau, whole.rho)
    g_diffuse = hemispherical.kuhn(kappa=kappa)[2]
    optics = with_g(whole, g, np.array([g_diffuse, g_diffuse]))
    return system(folder, "int_shade", "kuhn", optics)


def _physical(g: FloatArray, tau: FloatArray, rho: FloatArray) -> FloatArray:
    """g no less than tau and no more than all that is not reflected."""
    return np.clip(g, tau, np.maximum(1.0 - rho, tau))


def kappa_study(reference: Path, epw: Path, climates: Sequence[str], orientations: Sequence[str]) -> pd.DataFrame:
    """RMSE and bias of the interior shade's case against EnergyPlus for every kappa."""
    light, rows = reference_room.RoomLight(), []
    systems = {kappa: kappa_system(reference, kappa) for kappa in KAPPAS}
    for name in climates:
        place = site(name, epw / EPW_FILES[name], orientations)
        table = pd.read_parquet(reference / f"ep_{name}.parquet")
        table = table[table.cfs == "int_shade"]
        for orientation in orientations:
            hours = table[table.ori == orientation]
            theirs = reference_case(name, "int_shade", orientation, hours)
            for kappa, shaded in systems.items():
                model = f"kappa {kappa:g}"
                ours = our_case(place, orientation, "int_shade", shaded, light, model)
                rows.append(case_row(ours, theirs))
    return pooled(pd.DataFrame(rows), ["model"])


def wrong_g(optics: Optics, error: float) -> Optics:
    """Optics whose measured g is off by `error` in every direction, the transmittance right."""
    diffuse = _physical(optics.diffuse[:, 2] + error, optics.diffuse[:, 0], optics.diffuse[:, 1])
    return with_g(optics, _physical(optics.g + error, optics.tau, optics.rho), diffuse)


def wrong_u(folder: Path, name: str, error: float) -> ReferenceSystem:
    """A system in plain Kuhn whose measured U is off by `error`."""
    right = system(folder, name, "kuhn")
    return system(folder, name, "kuhn", u_value=right.fenestration.u_value + error)


def measurement_study(reference: Path, epw: Path, climates: Sequence[str], orientations: Sequence[str]) -> pd.DataFrame:
    """RMS change [K] of the temperatures in plain Kuhn for errors of g and of U, by position."""
    light, rows = reference_room.RoomLight(), []
    for name in climates:
        place = site(name, epw / EPW_FILES[name], orientations)
        for system_name in ("dgu", "ext_blind", "ext_shade", "int_shade"):
            optics = read_optics(reference, system_name)
            right = system(reference, system_name, "kuhn", optics)
            wrong = {
                ("g", e): system(reference, system_name, "kuhn", wrong_g(optics, e))
                for e in G_ERRORS
                if not (e < 0 and system_name.startswith("ext"))  # g itself is that small
            } | {("U", e): wrong_u(reference, system_name, e) for e in U_ERRORS}
            for orientation in orientations:
                base = our_case(place, orientation, system_name, right, light, "right")
                rows += _changes(place, orientation, system_name, wrong, base, light)
    table = pd.DataFrame(rows)
    means = table.groupby(["quantity", "error", "position"], sort=False)
    return np.sqrt(means[list(QUANTITIES)].mean())


def _changes(
    place: Site,
    orientation: str,
    name: str,
    wrong: dict[tuple[str, float], ReferenceSystem],
    base: EnergyPlusCase,
    light: reference_room.RoomLight,
) -> list[dict[str, object]]:
    rows = []
    for (quantity, error), candidate in wrong.items():
        case = our_case(place, orientation, name, candidate, light, "wrong")
        row: dict[str, object] = {
            "quantity": quantity,
            "error": error,
            "position": "internal" if name == "int_shade" else "external or none",
        }
        for q in QUANTITIES:
            change = (getattr(case, q) - getattr(base, q))[FIRST_HOUR:]
            row[q] = float(np.mean(change**2))
        rows.append(row)
    return rows
