"""The rooms of study files, and the same model computed by EnergyPlus.

    python -m tests.validation energyplus_twin STUDY.toml [...] --out FOLDER

Each study runs by `cfs thermal STUDY.toml --energyplus`; EnergyPlus then runs the model that this
has written, with the study's own weather file.  With `--their-sun` our balance is solved again with
EnergyPlus' sun in every hour: on the outer walls, in the window layers and in the room's surfaces
(of windows by two panes).  What still differs then is not the sun's.  With `--open-sky` it is
solved again as if nothing hid the sky from the outer faces' longwave, and the share of the sky
that each face sees stands beside EnergyPlus' own.  `--clock` adds the processor seconds of our
balance, from arrays to arrays, and of EnergyPlus' run, without starting Python.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.progress import silent
from scenes.heat.energyplus import energyplus_twin
from scenes.heat.study import BalancedRooms, run_study
from scenes.heat.study_file import read_study
from scenes.room.zone import RoomZone, balances
from tests.validation.energyplus_program import TIME_FILE, run_written

Hours = NDArray[np.float64]  # [H] or [H, N]
SETTLED = 7 * 24  # hours left out of the temperatures at the start
AIR = "Zone Mean Air Temperature"
HEATING = "Zone Ideal Loads Zone Sensible Heating Rate"
COOLING = "Zone Ideal Loads Zone Sensible Cooling Rate"
INCIDENT = "Surface Outside Face Incident Solar Radiation Rate per Area"
SUN = "Surface Window Transmitted Solar Radiation Rate"
ABSORBED = "Surface Inside Face Solar Radiation Heat Gain Rate"
LAYER = "Surface Window Total Absorbed Shortwave Radiation Rate Layer {}"
INSIDE_FACE, OUTSIDE_FACE = (f"Surface {side} Face Temperature" for side in ("Inside", "Outside"))
CONVECTED = "Surface Inside Face Convection Heat Gain Rate"
RADIATED = "Surface Inside Face Net Surface Thermal Radiation Heat Gain Rate"
WINDOWS = (LAYER.format(1), LAYER.format(2), INSIDE_FACE, OUTSIDE_FACE, CONVECTED, RADIATED)
# our sums of the sun, and what the table calls them
SUMS = {"incident_w": "sun on", "transmitted_w": "sun in", "absorbed_room_w": "sun kept"}
BEYOND = "at_and_beyond_inner_glass_w"  # sun that doorways and glass pass to other rooms, which EnergyPlus' model keeps


def compared(
    path: Path, folder: Path, *, their_sun: bool = False, open_sky: bool = False, clock: bool = False
) -> dict[str, pd.DataFrame]:
    """Air [K] and loads [kWh] of every room of a study, ours and EnergyPlus', by what ours has.

    Args: their_sun: a table of ours with EnergyPlus' sun; open_sky: one of ours with a free sky;
        clock: one of processor seconds.
    """
    study = read_study(path)
    kept: list[BalancedRooms] = []
    run_study(study, silent, balanced=kept.append)
    found = kept[0]
    twin = energyplus_twin(study, found)
    folder.mkdir(parents=True, exist_ok=True)
    twin.model["Output:Surfaces:List"] = {"seen": {"report_type": "Details"}}
    if their_sun:
        twin.model["Output:Variable"] |= window_outputs(twin.zones, found.rooms)
    model, *_ = twin.write(folder)
    theirs = run_written(model, study.weather)

    def again(rooms: list[RoomZone]) -> pd.DataFrame:
        results = balances(
            rooms,
            found.weather,
            study.options.heat_step_s,
            air_links=found.air_links,
            transfers=found.transfers,
            terrain=study.terrain,
        )
        return _rows(twin.zones, replace(found, rooms=rooms, results=results), theirs)

    tables = {"mitsuba-cfs": _rows(twin.zones, found, theirs)}
    if clock:
        start = time.process_time()
        again(list(found.rooms))
        seconds = {"mitsuba-cfs": time.process_time() - start}
        seconds["E+"] = float((folder / TIME_FILE).read_text().split()[1])
        faces = sum(len(r.zone.surfaces) + len(r.zone.windows) for r in found.rooms)
        tables["processor seconds"] = pd.DataFrame([{"faces": faces} | seconds])
    if open_sky:
        named = zip(twin.zones, found.rooms, strict=True)
        listed = (folder / "eplusout.eio").read_text()
        tables["sky seen"] = pd.concat([sky_seen(zone, room, listed) for zone, room in named])
        tables["mitsuba-cfs under an open sky"] = again([under_open_sky(room) for room in found.rooms])
    if their_sun:
        pairs = zip(twin.zones, found.rooms, strict=True)
        tables["mitsuba-cfs with EnergyPlus' sun"] = again([with_their_sun(zone, room, theirs) for zone, room in pairs])
    return tables


def window_outputs(zones: Sequence[str], rooms: Sequence[RoomZone]) -> dict[str, dict[str, str]]:
    """The request for what `with_their_sun` reads of every window."""
    windows = [f"{zone} W{k}" for zone, room in zip(zones, rooms, strict=True) for k in range(len(room.zone.windows))]
    return {
        f"{window} {k}": {"key_value": window, "variable_name": name, "reporting_frequency": "Hourly"}
        for window in windows
        for k, name in enumerate(WINDOWS)
    }


def under_open_sky(room: RoomZone) -> RoomZone:
    """A room from whose outer faces nothing hides the sky."""
    zone = room.zone
    surfaces = tuple(replace(one, sky_seen=1.0) for one in zone.surfaces)
    windows = tuple(replace(one, sky_seen=1.0) for one in zone.windows)
    free = replace(zone, surfaces=surfaces, windows=windows)
    return replace(room, room=replace(room.room, zone=free))


def sky_seen(zone: str, room: RoomZone, listed: str) -> pd.DataFrame:
    """Shares of the sky that a room's outer faces see, ours and EnergyPlus'.

    Args: listed: EnergyPlus' list of surfaces (`eplusout.eio`).
    """
    lines = [line.split(",") for line in listed.splitlines() if "<HeatTransfer Surface>" in line]
    (head,) = ([name.strip() for name in line] for line in lines)
    number = {name.split(" {")[0]: k for k, name in enumerate(head)}
    parts = [line.split(",") for line in listed.splitlines() if line.startswith("HeatTransfer S")]
    walls = {f"S{k}": one for k, one in enumerate(room.zone.surfaces) if one.outside == "outdoor"}
    glass = {f"W{k}": one for k, one in enumerate(room.zone.windows)}
    rows = []
    for key, one in (walls | glass).items():
        name, half = shouted(f"{zone} {key}"), 0.5 * (1.0 + one.normal[2])
        mine = [part for part in parts if part[1].split(".")[0] == name]
        area = [float(part[number["Area (Net)"]]) for part in mine]
        seen = [float(part[number["ViewFactorToSky-IR"]]) / half for part in mine]
        if mine:
            theirs = float(np.average(seen, weights=area))
            rows.append(
                {"room": zone, "face": one.name, "area": one.area, "sky seen": one.sky_seen, "sky seen E+": theirs}
            )
    return pd.DataFrame(rows).set_index("room")


def their_sums(zone: str, room: RoomZone, theirs: pd.DataFrame) -> dict[str, Hours]:
    """EnergyPlus' sun [H] [W] on the windows of a room, through them, and in its surfaces."""
    found = {name: np.zeros(len(theirs)) for name in SUMS}
    for k, window in enumerate(room.zone.windows):
        name = shouted(f"{zone} W{k}")
        found["incident_w"] += window.area * theirs[f"{name}:{INCIDENT}"].to_numpy()
        found["transmitted_w"] += theirs[f"{name}:{SUN}"].to_numpy()
    own = [c for c in theirs if c.startswith(shouted(f"{zone} ")) and c.endswith(f":{ABSORBED}")]
    found["absorbed_room_w"] += theirs[own].to_numpy().sum(axis=1)
    return found


def with_their_sun(zone: str, room: RoomZone, theirs: pd.DataFrame) -> RoomZone:
    """A room with EnergyPlus' sun of every hour: outside, in both window layers, in its surfaces.

    What a window's inner layer takes from the room is in none of EnergyPlus' outputs; it is what
    its face gives to air and room more than it has from the other layer and from outside.
    """
    sun = room.solar
    outer, inner = sun.absorbed_outer.copy(), sun.absorbed_inner.copy()
    for k, window in enumerate(room.zone.windows):
        of = _outputs(theirs, f"{zone} W{k}")
        outer[:, k] = of(LAYER.format(1)) / window.area
        warm, cold = of(INSIDE_FACE), of(OUTSIDE_FACE)
        between = window.states[0].layer_resistance.at(0.5 * (warm + cold), warm - cold)
        given = -of(CONVECTED) - of(RADIATED)
        taken = given / window.area - (cold - warm) / between
        inner[:, k] = np.where(of(LAYER.format(2)) > 0.0, np.maximum(taken, 0.0), 0.0)
    facade, inside = sun.facade.copy(), sun.inside.copy()
    for index, surface in enumerate(room.zone.surfaces):
        name = shouted(f"{zone} S{index}")
        parts = [c for c in theirs if c.split(":")[0].split(".")[0] == name]
        absorbed = [c for c in parts if c.endswith(f":{ABSORBED}")]
        if absorbed:  # a frame's is that of the wall it is in, which stays ours
            inside[:, index] = theirs[absorbed].to_numpy().sum(axis=1)
        if surface.outside == "outdoor" and parts:
            falls = [c for c in parts if c.endswith(f":{INCIDENT}")]
            facade[:, index] = theirs[falls].to_numpy().mean(axis=1)
    solar = replace(
        sun,
        absorbed_outer=outer,
        absorbed_inner=inner,
        absorbed_middle=None,
        inside=inside,
        facade=facade,
        window_inside=None if sun.window_inside is None else np.zeros_like(sun.window_inside),
    )
    return replace(room, solar=solar, gains=room.gains | their_sums(zone, room, theirs))


def _outputs(theirs: pd.DataFrame, name: str) -> Callable[[str], Hours]:
    return lambda output: theirs[f"{shouted(name)}:{output}"].to_numpy()


def _rows(zones: Sequence[str], found: BalancedRooms, theirs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for zone, room, result in zip(zones, found.rooms, found.results, strict=True):
        air = theirs[f"{shouted(zone)}:{AIR}"].to_numpy()
        plant = shouted(f"{zone} plant")
        sums = their_sums(zone, room, theirs)
        gap = (result.air_c - air)[SETTLED:]
        row = {"room": result.name, "air RMSE": np.sqrt(np.mean(gap**2)), "bias": gap.mean()}
        for name, ours, key in (("heating", result.heating, HEATING), ("cooling", result.cooling, COOLING)):
            row[name] = ours.sum() / 1e3
            other = theirs.get(f"{plant}:{key}")
            row[f"{name} E+"] = np.nan if other is None else other.sum() / 1e3
        for key, name in SUMS.items():
            row[name] = room.gains.get(key, np.zeros(1)).sum() / 1e3
            row[f"{name} E+"] = sums[key].sum() / 1e3
        row["sun to rooms"] = room.gains.get(BEYOND, np.zeros(1)).sum() / 1e3
        rows.append(row)
    table = pd.DataFrame(rows).set_index("room")
    total = table.drop(columns=["air RMSE", "bias"]).sum()
    total["air RMSE"], total["bias"] = (np.sqrt((table["air RMSE"] ** 2).mean()), table["bias"].mean())
    return pd.concat([table, total.to_frame("all").T])


def shouted(name: str) -> str:
    """A name as EnergyPlus writes it: ASCII letters alone become capitals."""
    return "".join(c.upper() if c.isascii() else c for c in name)


def main(
    studies: Sequence[Path], *, out: Path, their_sun: bool = False, open_sky: bool = False, clock: bool = False
) -> dict[str, pd.DataFrame]:
    """A table for each study; their_sun, open_sky, clock: see `compared`."""
    return {
        f"{path.name}, {title}": table.round(2)
        for path in studies
        for title, table in compared(path, out / path.stem, their_sun=their_sun, open_sky=open_sky, clock=clock).items()
    }
