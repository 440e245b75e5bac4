"""Ratings of BSDF files by the standards: a row for each state and method; the `.toml` beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_cfs.bsdf.spectral_pane import SpectralRating, spectral_rating
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.thermal_system import ThermalSystem, checked_system, sun_in_layers
from thermal.blackbox import TABLE_HEAD, LayerResistance
from thermal.errors import ThermalInputError
from thermal.ratings import CLASSES, EUROPEAN, REFERENCE_GLAZINGS, ThermalRating, layered_ratings, shade_ratings

TITLES = {"g": "class of g_tot", "secondary": "class of q_i", "tau": "class of tau_e"}
LIGHT = ("tau_UV", "R_a")  # EN 410: UV transmittance, colour rendering index


@dataclass(frozen=True, slots=True)
class RatedState:
    """One state: what the heat balance takes, and the ratings by method."""

    path: Path
    system: FenestrationSystem
    heat: ThermalSystem
    ratings: tuple[ThermalRating, ...]
    spectral: SpectralRating | None = None  # of panes that are known by wavelength
    notes: tuple[str, ...] = ()

    def rows(self) -> list[dict[str, object]]:
        """A row for each method; UV and colours in EN 410's, where the panes' spectra are known."""
        none = (None, None)
        light = none
        if self.spectral is not None:
            light = (self.spectral.ultraviolet, self.spectral.colour_rendering)
        return [
            {
                "state": self.path.stem,
                "method": rating.method,
                "U [W/(m2 K)]": rating.u_value,
                "tau_e": rating.transmittance,
                "q_i": rating.secondary,
                "g_tot": rating.g_value,
                **{TITLES[of]: rating.solar_class(of) for of in CLASSES},
                **dict(zip(LIGHT, light if rating.method == EUROPEAN else none, strict=True)),
            }
            for rating in self.ratings
        ]


def rated_state(path: Path, *, place: str | None, glazing: str | None, kappa: float) -> RatedState:
    """A BSDF file with its `.toml` rated.

    Args: place, glazing: the file is of a shade alone, rated there with a glazing of EN 14501.

    Raises: `DataError` for data that do not go together.
    """
    system = read_system(path)
    heat = checked_system(system, path)
    if place is not None and glazing is not None:
        known = REFERENCE_GLAZINGS[glazing]
        tau, rho = (float(np.clip(v[0], 0.0, 1.0)) for v in (heat.transmittance, heat.reflectance))
        return RatedState(
            path,
            system,
            heat,
            tuple(shade_ratings(tau, rho, place, known, kappa=kappa)),
            notes=tuple(map(str, system.notes)),
        )
    try:
        ratings = tuple(system_ratings(system, heat))
    except ThermalInputError as error:
        raise DataError(error.message, file=path.with_suffix(".toml")) from error
    notes = (*map(str, system.notes), *map(str, heat.notes), heat.named_model)
    if not system.panes:
        return RatedState(path, system, heat, ratings, notes=notes)
    try:
        return RatedState(path, system, heat, ratings, spectral_rating(system.panes), notes)
    except ValueError as error:
        left_out = f"{system.name}: neither tau_UV nor R_a: {error}."
        return RatedState(path, system, heat, ratings, notes=(*notes, left_out))


def system_ratings(system: FenestrationSystem, heat: ThermalSystem) -> list[ThermalRating]:
    """What the heat balance takes of a system, and the standards' ratings of known layers.

    Raises: `ThermalInputError` for layers that do not go together.
    """
    tau, rho = (float(np.clip(v[0], 0.0, 1.0)) for v in (heat.transmittance, heat.reflectance))
    result = [ThermalRating("heat balance", heat.fenestration.u_value, tau, float(heat.g_value[0]))]
    unit = None if system.closure is None else system.closure.unit
    if unit is not None:
        result += layered_ratings(unit, tau, sun_in_layers(unit, [tau], [rho], [0.0])[0])
    return result


def thermal_toml(state: RatedState) -> str:
    """The `.toml` beside the state's file: U and g by patch as the heat balance takes them."""
    values = ", ".join(f"{g:.4f}" for g in state.heat.g_value)
    lines = [
        f"# {state.heat.named_model} Written by cfs bsdf thermal",
        f"u_value = {state.heat.fenestration.u_value:.4f}  # [W/(m2 K)]",
        f"g_value = {state.heat.g_value[0]:.4f}  # at normal incidence",
        f"g_value_by_patch = [{values}]",
    ]
    if state.system.shading_position is not None:
        lines.append(f'shading_position = "{state.system.shading_position}"')
    films = state.heat.fenestration.in_series()
    resistance = films.layer_resistance
    if resistance.kind in ("surface", "table"):
        lines.append(_resistance_toml(resistance))
        closed = state.heat.model
        if "films" in closed and films.extra_inner > 0:
            lines.append(f"realised_inner_resistance = {films.r_inner:.4f}  # [m2 K/W]")
        if "films" in closed and films.extra_outer > 0:
            lines.append(f"realised_outer_resistance = {films.r_outer:.4f}  # [m2 K/W]")
    return "\n".join(lines) + "\n"


def _resistance_toml(resistance: LayerResistance) -> str:
    """R(T_m, dT) as `[[system]]` reads it; as one line, which may stand before other keys."""
    values = resistance.coefficients
    if resistance.kind == "surface":
        return f"surface = [{_numbers(values)}]"
    axes = []
    for first, step, count in (values[0:3], values[3:6]):
        axes.append([first + k * step for k in range(int(count))])
    mean, apart = axes
    rows = [values[TABLE_HEAD + k * len(apart) :][: len(apart)] for k in range(len(mean))]
    grid = f"mean_c = [{_numbers(mean)}], difference_k = [{_numbers(apart)}]"
    return f"conductance = {{ {grid}, values = [{', '.join(f'[{_numbers(row)}]' for row in rows)}] }}  # [W/(m2 K)]"


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)


def printed(rows: Sequence[dict[str, object]]) -> list[str]:
    """The rows as lines of a table."""
    cells = [list(rows[0])] if rows else []
    for row in rows:
        cells.append([_cell(value) for value in row.values()])
    widths = [max(len(line[i]) for line in cells) for i in range(len(cells[0]))] if cells else []
    return ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells]


def _cell(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else str(value)
