"""The reference room by study files of `cfs thermal`, as users write them, against EnergyPlus.

    python -m tests.validation energyplus_by_study FOLDER --reference DIR \
        --climates FRA_Strasbourg.071900_IWEC.epw [...]

Writes into FOLDER a BSDF file of each system and a study file for each case: the window by its
`layers`, or by BSDF, U and g at normal incidence ("plain"), with the position of its shade
("position"), with position and gas gap ("gap"); the layers with EnergyPlus' one hemispherical value
for all light but the sun's.  Each room floats, and is kept at 20 to 26 degC.
EnergyPlus 25.2 computes the same rooms with its own layers and sun.

Systems: those of the reference set, and the clear double glazing of ASHRAE 140 alone and with the
interior shade, whose layers the program does not assume.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.glazing import HEMISPHERE, Pane, hemispherical_mean, pane_optics, stack
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.progress import silent
from scenes.fenestration.thermal_system import sun_in_layers
from scenes.heat.study import BalancedRooms, run_study
from scenes.heat.study_file import read_study
from scenes.room.zone import RoomZone, balances
from tests.validation.ashrae140_sun import ANGLES, PANE
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_program import OUTPUTS, room_model, run_energyplus, with_held_sun
from tests.validation.energyplus_reference import load_hours
from tests.validation.energyplus_study import COLUMNS, FIRST_HOUR, GLAZING, STUDY
from tests.validation.energyplus_traced import traced_system
from tests.validation.reference_room import ORIENTATIONS
from tests.validation.reference_systems import PLACES, SYSTEMS, Optics, layers, read_optics
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit
from thermal.iso15099 import STATED_G, iso15099_data, iso15099_g_values, prescribed

PANES = """[[system.layers]]
thickness = 0.006
conductivity = 0.9
solar = [0.775, 0.071, 0.071]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.006
conductivity = 0.9
emissivity = [0.05, 0.84]
solar = [0.60, 0.22, 0.17]
"""
CLEAR_PANES = GLAZING[GLAZING.index("[[system.layers]]") :].rstrip() + "\n"
BLIND = """[[system.layers]]
slats = { width = 0.08, spacing = 0.072, tilt_deg = 45.0, thickness = 0.00045 }
edges = [0.1, 0.1, 0.1, 0.1]
gap = { width = 0.1 }
"""
SHEET = """[[system.layers]]
openness = 0.0
thickness = 0.0005
conductivity = 0.15
"""
OUTSIDE = f"{SHEET}edges = [0.1, 0.1, 0.1, 0.1]\ngap = {{ width = 0.1 }}\n"
INSIDE = f"gap = {{ width = 0.05 }}\n{SHEET}edges = [0.05, 0.05, 0.05, 0.05]\n"
ONE_DIFFUSE = "layers, one diffuse value"  # of the window, for all light but the sun's
LAYERS = {
    "dgu": PANES,
    "ext_blind": BLIND + PANES,
    "ext_shade": OUTSIDE + PANES,
    "int_shade": PANES + INSIDE,
    "clear": CLEAR_PANES,
    "clear int_shade": CLEAR_PANES + INSIDE,
}
PATCHES = {"clear": ("clear_double",), "clear int_shade": ("clear_double", "int_shade")}
POSITIONS = PLACES | {"clear": "none", "clear int_shade": "internal"}
LOW_E_GAP = "gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 }, emissivity = [0.84, 0.05] }\n"
AIR_GAP = "gap = { width = 0.012, gas = { air = 1.0 }, emissivity = [0.84, 0.84] }\n"
INPUTS = ("layers", "plain", "position", "gap", ONE_DIFFUSE)
KEPT = "[loads]\nheating_c = 20\ncooling_c = 26\n"
SHADE = (0.10, 0.55)  # solar transmittance and reflectance of the sheet


@dataclass(frozen=True, slots=True)
class KnownWindow:
    """What a user knows of a system: its BSDF file, U and g at normal incidence."""

    bsdf: str
    u_value: float
    g_normal: float


def known_window(folder: Path, reference: Path, name: str) -> KnownWindow:
    """The data of a system, its BSDF written into the folder."""
    if name in SYSTEMS:
        optics = read_optics(reference, name)
        data = json.loads((reference / f"blackbox_{name}.json").read_text())
        u, g = data["U"][0]["U"], float(optics.g[np.argmin(optics.theta)])
        system = traced_system(name, optics)
    else:
        optics, unit = clear_system(shaded=name != "clear")
        absorbed = sun_in_layers(unit, optics.tau[:1], optics.rho[:1], optics.theta[:1])
        u = iso15099_data(unit).u_value
        g = float(iso15099_g_values(unit, prescribed(*STATED_G), optics.tau[:1], absorbed)[0])
        like = "int_shade" if name != "clear" else "dgu"
        system = replace(traced_system(like, optics), closure=None)
    write_bsdf_xml(BsdfFile({"Visible": system.visible, "Solar": system.solar}, name=name), folder / f"{name}.xml")
    return KnownWindow(f"{name}.xml", float(u), float(g))


def clear_system(*, shaded: bool) -> tuple[Optics, GlazingUnit]:
    """Clear double glazing, with a grey sheet inside: reflections between both counted."""
    thickness, tau, rho = PANE
    pane = Pane("clear", tau, rho, rho)
    glass, even = (stack([pane_optics(pane, angles)] * 2) for angles in (ANGLES, HEMISPHERE))
    through, behind = (float(hemispherical_mean(v, HEMISPHERE)) for v in (even.tau, even.rho_back))
    layer = GlazingLayer(thickness, 1.0, solar=(tau, rho, rho))
    panes, gap = (layer, layer), GasGap(0.012)
    if not shaded:
        back = {"tau_back": through, "rho_back": behind}
        return _optics(glass.tau, glass.rho_front, back), GlazingUnit(panes, (gap,))
    passed, thrown = SHADE
    bounce = 1.0 / (1.0 - thrown * behind)
    back = {"tau_back": passed * bounce * through, "rho_back": thrown + passed**2 * behind * bounce}
    optics = _optics(glass.tau * passed * bounce, glass.rho_front + glass.tau * thrown * bounce * through, back)
    shade = layers("int_shade").layers[-1]
    return optics, GlazingUnit((*panes, shade), (gap, GasGap(0.05)))


def _optics(tau: np.ndarray, rho: np.ndarray, back: dict[str, float]) -> Optics:
    none = np.zeros_like(ANGLES)
    return Optics(ANGLES, None, tau, rho, none, np.zeros((2, 3)), None, back)


def window_text(window: KnownWindow, name: str, inputs: str) -> str:
    """The tables of the window in a study file."""
    head = f'[[system]]\nbsdf = "{window.bsdf}"\n'
    if inputs.startswith("layers"):
        return f"{head}glazing_height = 1.5\nglazing_width = 3.0\n{LAYERS[name]}\n"
    text = f"{head}u_value = {window.u_value:.4g}\ng_value = {window.g_normal:.4g}\n"
    if inputs == "plain":
        return text
    text += f'shading_position = "{POSITIONS[name]}"\n'
    return text if inputs == "position" else text + (AIR_GAP if "clear" in name else LOW_E_GAP)


def study_text(epw: Path, orientation: str, window: str, more: str) -> str:
    """The whole study file: the room of docs/tutorials/energyplus_room.toml."""
    room = STUDY.read_text(encoding="utf-8")
    box = room[room.index("terrain") : room.index("[[system]]")]
    use = room[room.index("[envelope]") :]
    facing = f"facing_deg = {ORIENTATIONS[orientation]:.1f}"
    box = box.replace("facing_deg = 180.0", facing)
    return f'weather = "{epw.resolve().as_posix()}"\n{box}{window}{use}{more}'


def our_year(study: Path) -> pd.DataFrame:
    """The hours of a study's room, as `cfs thermal` writes them."""
    (year,), _ = run_study(read_study(study), silent)
    return year.hours


def main(
    folder: Path,
    *,
    reference: Path,
    climates: Sequence[Path],
    orientations: Annotated[Sequence[str], ("S", "W", "N", "E")] = ("S", "W"),
    systems: Annotated[Sequence[str], tuple(LAYERS)] = tuple(LAYERS),
    inputs: Annotated[Sequence[str], INPUTS] = INPUTS,
    energyplus_steps: int = 6,
    held_sun: bool = False,
    terms: bool = False,
) -> dict[str, pd.DataFrame]:
    """Every case, and the root mean squares by system and inputs.

    Args:
        energyplus_steps: of EnergyPlus' floating rooms in an hour.
        held_sun: EnergyPlus has each hour's sun in all steps of that hour, as the file states it.
        terms: instead, our floating rooms by layers with one term of the sun after the other as
            EnergyPlus has it: for glazing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    known = {name: known_window(folder, reference, name) for name in systems}
    if terms:
        cases = [(epw, facing, name) for epw in climates for facing in orientations for name in systems]
        return {"Terms": pd.concat([_term_rows(folder, known[case[2]], *case) for case in cases])}
    rows = []
    for epw in climates:
        told = with_held_sun(epw, folder / f"held {epw.name}") if held_sun else epw
        for orientation in orientations:
            for name in systems:
                patches = PATCHES.get(name, (name,))
                model = room_model(orientation, *patches, steps=energyplus_steps)
                theirs = run_energyplus(model, told)
                needs = load_hours(patches, orientation, told)
                for kind in inputs:
                    row: dict[str, object] = {
                        "climate": epw.stem,
                        "facing": orientation,
                        "system": name,
                        "inputs": kind,
                    }
                    window = window_text(known[name], name, kind)
                    for held, more in (("floating", ""), ("kept", KEPT)):
                        study = folder / f"{epw.stem} {orientation} {name} {kind} {held}.toml"
                        text = study_text(epw, orientation, window, more)
                        if kind == ONE_DIFFUSE:
                            text = text.replace("[trace]\n", '[trace]\nsky_light = "hemispherical"\n')
                        study.write_text(text, "utf-8")
                        hours = our_year(study)
                        if held == "floating":
                            row |= _apart(hours, theirs)
                        else:
                            row |= _loads(hours, needs)
                    rows.append(row)
    table = pd.DataFrame(rows)
    return {"Cases": table, "By system": _by_system(table)}


def _apart(hours: pd.DataFrame, theirs: pd.DataFrame) -> dict[str, float]:
    row: dict[str, float] = {}
    for name, (our_column, column) in COLUMNS.items():
        values = hours[our_column].to_numpy()[FIRST_HOUR:], theirs[column].to_numpy()[FIRST_HOUR:]
        row[name], row[f"{name} bias"] = rmse_and_bias(*values)
    return row


def _loads(hours: pd.DataFrame, theirs: pd.DataFrame) -> dict[str, float]:
    """Heating and cooling of the year [kWh], and the highest hour of cooling [W]."""
    row: dict[str, float] = {}
    for what, other in zip(("heating", "cooling"), theirs, strict=True):
        row[what] = float(hours[f"{what}_w"].sum()) / 1e3
        row[f"{what} E+"] = float(theirs[other].sum())
    row["peak"], row["peak E+"] = float(hours["cooling_w"].max()), 1e3 * float(theirs[other].max())
    return row


SUNLIT = {  # EnergyPlus' name of a face: its outward direction; x to the left of who looks out, y outdoors
    "FACADE": (0, 1, 0),
    "BACK": (0, -1, 0),
    "X4": (1, 0, 0),
    "X0": (-1, 0, 0),
    "FLOOR": (0, 0, -1),
    "CEILING": (0, 0, 1),
}
IN_FACES = "Surface Inside Face Solar Radiation Heat Gain Rate"
ON_FACADE = "FACADE:Surface Outside Face Incident Solar Radiation Rate per Area"
IN_PANES = "WINDOW:Surface Window Total Glazing Layers Absorbed Shortwave Radiation Rate"
THEIR_SUN = {f"{name}:{IN_FACES}": name for name in SUNLIT} | {ON_FACADE: "on facade", IN_PANES: "in panes"}
TERMS = (  # each in addition to those before
    "mitsuba-cfs",
    "EnergyPlus' day of the sun",
    "the sun of the hour held in EnergyPlus' steps",
    "one diffuse value of the window",
    "EnergyPlus' shares of the faces in the light indoors",
    "EnergyPlus' light indoors",
    "EnergyPlus' sun in the panes and on the facade",
)


def _term_rows(folder: Path, window: KnownWindow, epw: Path, facing: str, name: str) -> pd.DataFrame:
    """Air and window of a floating room beside EnergyPlus [K], and the sun in the room [kWh], by `TERMS`."""
    outputs = OUTPUTS | THEIR_SUN
    model = room_model(facing, *PATCHES.get(name, (name,)), outputs=outputs)
    held = with_held_sun(epw, folder / f"held {epw.name}")
    blended, steady = (run_energyplus(model, weather, outputs=outputs) for weather in (epw, held))
    text = study_text(epw, facing, window_text(window, name, "layers"), "")
    rooms = {}
    for sun, light in (("spa", "by direction"), ("energyplus", "by direction"), ("energyplus", "hemispherical")):
        study = folder / f"{epw.stem} {facing} {name} {sun} {light}.toml"
        options = f'[trace]\nsun_model = "{sun}"\nsky_light = "{light}"\n'
        study.write_text(text.replace("[trace]\n", options), "utf-8")
        found: list[BalancedRooms] = []
        run_study(read_study(study), silent, balanced=found.append)
        rooms[sun, light] = found[0]
    plain, theirs, last = rooms.values()
    (room,) = last.rooms
    inside = np.stack([steady[name].to_numpy() for name in _faces(room)], axis=1)
    through = steady["Q_trans"].to_numpy()[:, None]
    shares = np.where(through > 1.0, inside / np.maximum(through, 1.0), 0.0)
    shared, lit = (_with_light(room, one) for one in (shares * room.gains["transmitted_w"][:, None], inside))
    years = [one.results[0] for one in (plain, theirs, theirs, last)]
    everywhere = _with_panes(lit, steady)
    years += [balances([one], last.weather, 600.0, terrain="suburbs")[0] for one in (shared, lit, everywhere)]
    suns = [one.rooms[0] for one in (plain, theirs, theirs, last)] + [shared, lit, everywhere]
    judges = [blended, blended, *[steady] * 5]
    rows = []
    for term, year, sunlit, judge in zip(TERMS, years, suns, judges, strict=True):
        row = {"climate": epw.stem, "facing": facing, "system": name, "term": term}
        apart = {"air": (year.air_c, "T_air"), "window": (year.window_inner_c[:, 0], "T_win_in")}
        for what, (values, column) in apart.items():
            row[what], row[f"{what} bias"] = rmse_and_bias(values[FIRST_HOUR:], judge[column].to_numpy()[FIRST_HOUR:])
        row["light"] = float(sunlit.solar.inside.sum()) / 1e3
        row["light E+"] = float(judge[list(SUNLIT)].to_numpy().sum()) / 1e3
        rows.append(row)
    return pd.DataFrame(rows)


def _faces(room: RoomZone) -> list[str]:
    """EnergyPlus' names of a room's faces, by their places around its window."""
    (window,) = room.zone.windows
    out = window.normal
    axes = np.stack([np.cross([0.0, 0.0, 1.0], out), out, [0.0, 0.0, 1.0]])
    turned = [tuple(np.round(axes @ face.normal).astype(int).tolist()) for face in room.zone.surfaces]
    return [next(name for name, normal in SUNLIT.items() if normal == one) for one in turned]


def _with_light(room: RoomZone, inside: np.ndarray) -> RoomZone:
    """The room with other light in its faces [H, F] [W]."""
    return replace(room, solar=replace(room.solar, inside=inside))


def _with_panes(room: RoomZone, theirs: pd.DataFrame) -> RoomZone:
    """The room with EnergyPlus' sun in the panes, in our shares of the two, and on the facade."""
    (window,), sun = room.zone.windows, room.solar
    facade = sun.facade.copy()
    facade[:, _faces(room).index("FACADE")] = theirs["on facade"].to_numpy()
    own = np.zeros_like(sun.absorbed_inner) if sun.window_inside is None else np.asarray(sun.window_inside)
    outer, inner = sun.absorbed_outer, sun.absorbed_inner + own
    both = theirs["in panes"].to_numpy()[:, None] / window.area
    share = np.where(outer + inner > 1.0, outer / np.maximum(outer + inner, 1.0), 0.5)
    panes = {"absorbed_outer": share * both, "absorbed_inner": (1.0 - share) * both, "window_inside": None}
    return replace(room, solar=replace(sun, facade=facade, **panes))


def _by_system(table: pd.DataFrame) -> pd.DataFrame:
    """RMS of air and window [K], and the sums of heating and cooling over EnergyPlus'."""
    rows = []
    for (system, kind), cases in table.groupby(["system", "inputs"], sort=False):
        row: dict[str, object] = {"system": system, "inputs": kind}
        row |= {name: float(np.sqrt((cases[name] ** 2).mean())) for name in COLUMNS}
        row |= {what: cases[what].sum() for what in ("heating", "heating E+")}
        row |= {what: cases[what].sum() for what in ("cooling", "cooling E+")}
        rows.append(row)
    return pd.DataFrame(rows)
