"""Predictive control of two facades beside perfect foresight, AFC's glare term and fixed rules.

    python -m tests.validation predictive_control CITY.epw [--other OTHER.epw]

An office with equal windows to the south and to the west, each with an exterior blind raised or at
seven tilts, of which three are interpolated.  Energy is that of the detailed heat balance; glare is
DGP of all occupied hours by the phases, and by path tracing in a sample of those above the limit.
"""

from __future__ import annotations

import logging
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import scenes as cfs
from bim.model import Room
from bim.shoebox import WindowRectangle, shoebox
from scenes.demo import WEATHER
from tests.validation.tilted_blinds import SPACING, WIDTH, family_tables, write_blind

FAMILY = (0.0, 20.0, 40.0, 60.0)  # [deg]; with the step of 10 degrees and the raised blind: 8 states
LIMIT = 0.40
HOME = """
tilt_step_deg = 10
{family}
[gains]
equipment_w_m2 = 8
persons = 2
lighting_w_m2 = 8
lighting_target_lx = 500
[loads]
heating_c = 20
cooling_c = 26
[control]
{control}
"""
PLANS = {
    "24 h, as yesterday": 'forecast = "yesterday"',
    "24 h, forecast with error": 'forecast = "error"',
    "24 h, perfect forecast": 'forecast = "perfect"',
    "the year, perfect foresight": 'forecast = "perfect"\nhorizon_h = 8760',
    "24 h, with error, AFC's term of Ev": 'forecast = "error"\nglare = "Ev"',
}
LIMITS_W_M2 = (100.0, 150.0, 200.0, 300.0, 400.0)  # of the fixed rules
OPTIONS = {
    "sensor_spacing": 1.0,
    "sensor_samples": 2048,
    "patch_samples": 1024,
    "sky_subdivision": 1,
    "picture_size": 80,
    "picture_samples": 4,
    "picture_count": 1,
    "annual_glare": True,
    "heat_step_s": 3600.0,
}
WITHOUT_GLARE = f'rule = "glare"\nlimit_dgp = {LIMIT}\n'
CUT_OFF = f'rule = "cut-off"\nslat_width = {WIDTH}\nslat_spacing = {SPACING}\n'


@dataclass(frozen=True, slots=True)
class Controlled:
    """A year of the office by one control."""

    name: str
    year: cfs.SimulatedYear
    seconds: float  # of the processor

    @property
    def used(self) -> NDArray[np.bool_]:
        """Occupied hours [H]."""
        return self.year.heat.comfort["occupied"].to_numpy(bool)

    @property
    def energy(self) -> tuple[float, float, float]:
        """Heating, cooling and lamps [kWh]."""
        summary = self.year.operation.summary
        return tuple(summary[f"{name}_kwh"] for name in ("heating", "cooling", "lighting"))

    @property
    def glaring(self) -> NDArray[np.int64]:
        """Occupied hours with DGP above the limit [n]."""
        dgp = self.year.annual_glare["dgp"].to_numpy()
        return np.flatnonzero(self.used & (np.nan_to_num(dgp) > LIMIT))

    @property
    def row(self) -> str:
        """A row of the table."""
        parts, states = self.energy, self.year.operation.shading.states
        moves = np.count_nonzero(np.diff(states, axis=0), axis=0).sum() / 365
        raised = 100 * np.mean(states[self.used] == 0)
        return (
            f"| {self.name} | {sum(parts):.0f} | {parts[0]:.0f} | {parts[1]:.0f} | {parts[2]:.0f} "
            f"| {len(self.glaring)} h, {100 * len(self.glaring) / self.used.sum():.1f} % "
            f"| {moves:.1f} | {raised:.0f} % | {self.seconds:.0f} s |"
        )


def office() -> Room:
    """The room: windows of 5 m2 to the south and to the west, seen from its middle."""
    windows = (WindowRectangle(0.5, 0.9, 3.0, 1.7), WindowRectangle(1.0, 0.9, 3.0, 1.7, side="left"))
    building = shoebox(4.0, 5.0, 3.0, windows=windows, reflectance={"wall": 0.5, "floor": 0.2, "ceiling": 0.8})
    return building.room(building.spaces[0].name)


def controlled(name: str, control: str, weather: Path, method: str, folder: Path, family: str) -> Controlled:
    """The year by a control."""
    file = folder / "office.toml"
    file.write_text(HOME.format(family=family, control=control))
    start = time.process_time()
    year = cfs.simulate(office(), None, weather, operation=file, method=method, **OPTIONS)
    return Controlled(name, year, time.process_time() - start)


def fixed_rules() -> Iterator[tuple[str, str]]:
    """Names and tables of the fixed rules.

    Cut-off, closed to a tilt above an irradiance, the most open without glare, and the more closed
    of these two.
    """
    yield "cut-off", CUT_OFF
    yield "most open without glare", WITHOUT_GLARE
    for limit in LIMITS_W_M2:
        for state in (4, 7):
            name = f"closed to state {state} above {limit:g} W/m2"
            closed = f'rule = "irradiance"\nclose_above = {limit}\nstate = {state}\n'
            yield name, closed
            if state == 7:
                parts = f"[[control.parts]]\n{WITHOUT_GLARE}[[control.parts]]\n{closed}"
                yield f"without glare, and {name}", f'rule = "any"\n{parts}'


def best_rule(weather: Path, method: str, folder: Path, family: str) -> tuple[str, str]:
    """The fixed rule of the least energy, of those with glare in 1 % of the hours at most."""
    found = []
    for name, control in fixed_rules():
        one = controlled(name, control, weather, method, folder, family)
        glaring = len(one.glaring) / one.used.sum()
        found.append((max(glaring - 0.01, 0.0), sum(one.energy), name, control))
        logging.info("%s %s", weather.stem, one.row)
    return min(found)[2:]


def by_paths(one: Controlled, weather: Path, folder: Path, family: str, most: int) -> str:
    """DGP by path tracing of the hours nearest to the limit, in their states."""
    dgp = np.nan_to_num(one.year.annual_glare["dgp"].to_numpy())
    used = np.flatnonzero(one.used & (dgp > 0.30))
    hours = used[np.argsort(-dgp[used], kind="stable")][:most]
    states = one.year.operation.shading.states
    file = folder / "office.toml"
    file.write_text(HOME.format(family=family, control='rule = "always"'))
    times = one.year.hours.index[hours]
    chosen = {
        **OPTIONS,
        "annual_glare": False,
        "method": "point-in-time",
        "picture_count": len(hours),
        "picture_hours": tuple(f"{t:%m-%d %H}" for t in times),
        "path_samples": 64,
    }
    year = cfs.simulate(
        office(), None, weather, operation=file, control=lambda hour: states[hour.index].tolist(), **chosen
    )
    traced = {p.hour: p.glare["dgp"] for p in year.glare.pictures}
    pairs = np.array([(dgp[h], traced[h]) for h in hours.tolist() if h in traced])
    above = np.count_nonzero(pairs[:, 1] > LIMIT)
    rms = np.sqrt(np.mean((pairs[:, 0] - pairs[:, 1]) ** 2))
    return (
        f"{one.name}: of the {len(pairs)} occupied hours of the highest DGP {above} are above "
        f"{LIMIT:.2f} by path tracing; the phases' DGP differs by {rms:.3f} (rms)"
    )


def main(
    weather: Path = WEATHER,
    *,
    other: Path | None = None,
    method: str = "three-phase",
    paths: int = 0,
    samples: int = 65536,
    only: str = "",
) -> None:
    """Print the tables.

    Args:
        other: weather of another year, that fixed rules are tuned on.
        paths: hours to trace, of the plan with an error of the forecast.
        only: one plan, by its name, and no fixed rules.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [write_blind(folder, tilt, samples) for tilt in FAMILY]
        family = family_tables(files, FAMILY)
        print("| control | kWh | heating | cooling | lamps | DGP > .40 | moves a day | raised | CPU |")
        print("|---|---|---|---|---|---|---|---|---|")
        years = []
        for plan, table in {key: PLANS[key] for key in ([only] if only else PLANS)}.items():
            control = f'rule = "predictive"\nlimit_dgp = {LIMIT}\n[control.predictive]\n{table}'
            years.append(controlled(plan, control, weather, method, folder, family))
            print(years[-1].row, flush=True)
        rules = [] if only else [("cut-off", CUT_OFF), ("most open without glare", WITHOUT_GLARE)]
        if other is not None:
            best, control = best_rule(other, method, folder, family)
            rules.append((f"{best}, tuned on {other.stem}", control))
        for rule, control in rules:
            print(controlled(rule, control, weather, method, folder, family).row, flush=True)
        if paths:
            print(f"\n{by_paths(years[0 if only else 1], weather, folder, family, paths)}")
