"""Shading states of windows on two facades against EnergyPlus' own shading control.

    python -m tests.validation shading_control
    python -m tests.validation shading_control --weather AUS_NSW.Sydney.947670_IWEC.epw

With a weather, only its windows in the open are compared, by two rules.

A room in Chicago with equal windows to the south and to the north, open and below an overhang with
a fin.  EnergyPlus runs here and now with a `WindowShadingControl` for each window:
`OnIfHighSolarOnWindow`, and the slat angles of `BlockBeamSolar`.  Ours is the study's: `run_study`.

The column "same cause" has the hours that remain when both sides have the same sun (cut-off), or when the
plates hide the ground from the window as a closed form says (irradiance).  The sun of both is compared with
the Astronomical Almanac's.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import sun_directions
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study
from tests.validation.energyplus_program import Model, merged, room_model, run_energyplus
from thermal.control import by_cut_off

WINDOWS = {"S": "WINDOW", "N": "NORTH"}  # EnergyPlus' names of ours
LIMITS = (100.0, 200.0, 400.0)  # [W/m2]
# named scenarios that need no daylighting of EnergyPlus, with their set points
SCENARIOS: dict[str, dict[str, float]] = {
    "OnIfHighHorizontalSolar": {"setpoint": 300.0},
    "OnIfHighOutdoorAirTemperature": {"setpoint": 20.0},
    "OnIfHighOutdoorAirTempAndHighSolarOnWindow": {"setpoint": 20.0, "setpoint_2": 100.0},
    "OnIfHighOutdoorAirTempAndHighHorizontalSolar": {"setpoint": 20.0, "setpoint_2": 300.0},
    "OnNightIfLowOutdoorTempAndOffDay": {"setpoint": 10.0},
}
TILTS = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)  # [deg]
WIDTH, SPACING = 0.08, 0.072  # of the slats [m]
FIN = 1.5  # depth of overhang and fin [m]
GLAZING = Path(VENETIAN_BLIND).with_name("glazing.xml")
STUDY = """
weather = "{weather}"
[box]
width = 4.0
depth = 5.0
height = 3.0
window = [{{ x = 0.5, sill = 1.0, width = 3.0, height = 1.5 }},
          {{ x = 0.5, sill = 1.0, width = 3.0, height = 1.5, side = "back" }}]
{plates}
{systems}
[control]
{control}
[trace]
sky_subdivision = 4
view_factors = false
"""
PLATES = "".join(
    f"[[box.plate]]\nstart = {start}\nend = {end}\ndepth = {FIN}\nside = '{side}'\nreflectance = 0.0\n"
    for side in ("front", "back")
    for start, end in (([0.0, 2.6], [4.0, 2.6]), ([3.6, 0.0], [3.6, 3.0]))
)


def our_states(control: str, states: int, *, shaded: bool, weather: Path = WEATHER) -> pd.DataFrame:
    """Our state of both windows by hour [H], columns S and N."""
    bsdf = (GLAZING, *[VENETIAN_BLIND] * (states - 1))
    systems = "".join(f'[[system]]\nbsdf = "{path}"\n' for path in bsdf)
    plates = PLATES if shaded else ""
    text = STUDY.format(weather=weather, plates=plates, systems=systems, control=control)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        file.write_text(text)
        (year,), _ = run_study(read_study(file), lambda *_: None)
    return pd.DataFrame({name: year.hours[f"shading_state_{name}"].to_numpy() for name in WINDOWS})


def energyplus_model(control: dict[str, Any], *, shaded: bool) -> Model:
    """Table 15's room with a window to the north too, a time step of an hour.

    With one step an hour EnergyPlus takes the sun in the middle of the hour, as we do.
    """
    model = room_model("S", "clear_double", "ext_blind", outputs=OUTPUTS, steps=1)
    model["ShadowCalculation"]["main"]["shading_calculation_update_frequency_method"] = "Timestep"
    back = {
        "outside_boundary_condition": "Outdoors",
        "sun_exposure": "SunExposed",
        "wind_exposure": "WindExposed",
        "construction_name": "FACADE",
    }
    corners = [(3.5, 5.0, 2.5), (3.5, 5.0, 1.0), (0.5, 5.0, 1.0), (0.5, 5.0, 2.5)]
    north = dict(model["FenestrationSurface:Detailed"]["WINDOW"])
    north |= {"building_surface_name": "BACK"}
    for number, corner in enumerate(corners, 1):
        for axis, value in zip("xyz", corner, strict=True):
            north[f"vertex_{number}_{axis}_coordinate"] = value
    model = merged(
        model,
        {
            "BuildingSurface:Detailed": {"BACK": back},
            "FenestrationSurface:Detailed": {"NORTH": north},
            "WindowMaterial:Blind": {"DEVICE": {"slat_width": WIDTH, "slat_separation": SPACING}},
        },
    )
    plain = model["WindowShadingControl"].pop("CONTROL")
    for window in WINDOWS.values():
        surfaces = [{"fenestration_surface_name": window}]
        model["WindowShadingControl"][window] = plain | {"fenestration_surfaces": surfaces} | control
    if shaded:
        model["Shading:Building:Detailed"] = dict(_plates())
    return model


def _plates() -> list[tuple[str, dict[str, Any]]]:
    """The overhang and the fin of each facade, as those of the study."""
    rings = {
        "overhang S": [(0, 0, 2.6), (0, -FIN, 2.6), (4, -FIN, 2.6), (4, 0, 2.6)],
        "overhang N": [(4, 5, 2.6), (4, 5 + FIN, 2.6), (0, 5 + FIN, 2.6), (0, 5, 2.6)],
        "fin S": [(3.6, 0, 3), (3.6, 0, 0), (3.6, -FIN, 0), (3.6, -FIN, 3)],
        "fin N": [(0.4, 5, 3), (0.4, 5, 0), (0.4, 5 + FIN, 0), (0.4, 5 + FIN, 3)],
    }
    names = ("vertex_x_coordinate", "vertex_y_coordinate", "vertex_z_coordinate")
    return [
        (name, {"vertices": [dict(zip(names, map(float, corner), strict=True)) for corner in ring]})
        for name, ring in rings.items()
    ]


OUTPUTS = {
    f"{window}:{variable}": f"{name} {short}"
    for name, window in WINDOWS.items()
    for variable, short in (
        ("Surface Shading Device Is On Time Fraction", "on"),
        ("Surface Window Blind Slat Angle", "angle"),
        ("Surface Outside Face Incident Beam Solar Radiation Rate per Area", "beam"),
        ("Surface Outside Face Incident Solar Radiation Rate per Area", "sun"),
        ("Surface Outside Face Incident Ground Diffuse Solar Radiation Rate per Area", "ground"),
    )
} | {"Environment:Site Solar Altitude Angle": "altitude", "Environment:Site Solar Azimuth Angle": "azimuth"}


def energyplus_cut_off(table: pd.DataFrame, name: str) -> NDArray[np.int64]:
    """The most open of TILTS that is at least as closed as EnergyPlus' slats [H].

    EnergyPlus measures the angle between the normals of slats and glass: 90 degrees are level
    slats, tilted by 90 degrees less that angle.
    """
    needed = 90.0 - table[f"{name} angle"].to_numpy()
    fine = np.array(TILTS)[:, None] >= needed - 1e-3
    state = np.where(fine.any(axis=0), fine.argmax(axis=0), len(TILTS) - 1)
    return np.where(table[f"{name} beam"].to_numpy() > 0, state, 0)


def cut_off_under(table: pd.DataFrame, name: str) -> NDArray[np.int64]:
    """Our rule with the sun and the beam of EnergyPlus [H]."""
    east, north, up = their_sun(table).T
    local = np.stack([east, up, -north if name == "S" else north], axis=1)
    beam = table[f"{name} beam"].to_numpy()
    return by_cut_off(local, beam, np.radians(TILTS), WIDTH, SPACING)


def their_sun(table: pd.DataFrame) -> NDArray[np.float64]:
    """EnergyPlus' direction to the sun [H, 3]."""
    altitude, azimuth = (np.radians(table[key].to_numpy()) for key in ("altitude", "azimuth"))
    level = np.cos(altitude)
    return np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(altitude)], axis=1)


def almanac_sun() -> NDArray[np.float64]:
    """Direction to the sun [H, 3] by the Astronomical Almanac's formula of low precision (0.01 degrees).

    In the middle of the weather's hours; without refraction.  Source: Michalsky 1988, Solar Energy 40(3).
    """
    weather = read_epw(WEATHER)
    utc = weather.midpoints - pd.Timedelta(hours=weather.timezone_h)
    days = utc.to_julian_date().to_numpy() - 2451545.0
    anomaly = np.radians((357.528 + 0.9856003 * days) % 360.0)
    mean = 280.460 + 0.9856474 * days
    ecliptic = np.radians((mean + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2 * anomaly)) % 360.0)
    tilt = np.radians(23.439 - 4e-7 * days)
    ascension = np.arctan2(np.cos(tilt) * np.sin(ecliptic), np.cos(ecliptic))
    declination = np.arcsin(np.sin(tilt) * np.sin(ecliptic))
    clock = (utc - utc.normalize()).total_seconds().to_numpy() / 3600.0
    sidereal = np.radians((15.0 * ((6.697375 + 0.0657098242 * days + clock) % 24.0) + weather.longitude_deg) % 360.0)
    hour, north = sidereal - ascension, np.radians(weather.latitude_deg)
    return np.stack(
        [
            -np.cos(declination) * np.sin(hour),
            np.sin(declination) * np.cos(north) - np.cos(declination) * np.cos(hour) * np.sin(north),
            np.sin(declination) * np.sin(north) + np.cos(declination) * np.cos(hour) * np.cos(north),
        ],
        axis=1,
    )


def ground_seen(rays: int = 1_000_000) -> float:
    """Share of the ground's view factor from the window that the fin leaves, by directions of the cosine.

    The overhang is above the glass and hides none of the ground.
    """
    u = np.random.default_rng(1).random((4, rays))
    x, z = 0.5 + 3.0 * u[0], 1.0 + 1.5 * u[1]
    along, around = np.sqrt(u[2]), 2 * np.pi * u[3]
    dx, dz, out = along * np.cos(around), along * np.sin(around), np.sqrt(1 - u[2])
    far = (3.6 - x) / np.where(dx > 0, dx, np.inf)
    hidden = (dx > 0) & (out * far < FIN) & (z + dz * far > 0.0) & (z + dz * far < 3.0)
    return 1.0 - float(hidden[dz < 0].mean())


BLOCKING = {
    "shading_control_type": "OnIfHighSolarOnWindow",
    "setpoint": 0.1,
    "type_of_slat_angle_control_for_blinds": "BlockBeamSolar",
}
CUT_OFF = f'rule = "cut-off"\nslat_tilts_deg = {list(TILTS)}\nslat_width = {WIDTH}\nslat_spacing = {SPACING}'


def elsewhere(weather: Path) -> pd.DataFrame:
    """Hours of the year in which the states in the open differ under another weather."""
    rows = []
    control = {"shading_control_type": "OnIfHighSolarOnWindow", "setpoint": 200.0}
    theirs = run_energyplus(energyplus_model(control, shaded=False), weather, outputs=OUTPUTS)
    ours = our_states('rule = "irradiance"\nclose_above = 200', 2, shaded=False, weather=weather)
    for name in WINDOWS:
        on = theirs[f"{name} on"].to_numpy().round().astype(int)
        rows.append(_row("irradiance above 200 W/m2", False, name, ours[name].to_numpy(), on))
    theirs = run_energyplus(energyplus_model(BLOCKING, shaded=False), weather, outputs=OUTPUTS)
    ours = our_states(CUT_OFF, len(TILTS), shaded=False, weather=weather)
    for name in WINDOWS:
        slats = energyplus_cut_off(theirs, name)
        row = _row("cut-off", False, name, ours[name].to_numpy(), slats)
        rows.append(row | {"same cause h": int((cut_off_under(theirs, name) != slats).sum())})
    return pd.DataFrame(rows)


def compare() -> pd.DataFrame:
    """Hours of the year in which the states differ, by rule, surroundings and window."""
    rows = []
    for shaded in (False, True):
        for limit in LIMITS:
            control = {"shading_control_type": "OnIfHighSolarOnWindow", "setpoint": limit}
            model = energyplus_model(control, shaded=shaded)
            theirs = run_energyplus(model, WEATHER, outputs=OUTPUTS)
            reflected = run_energyplus(with_reflections(model), WEATHER, outputs=OUTPUTS)
            ours = our_states(f'rule = "irradiance"\nclose_above = {limit}', 2, shaded=shaded)
            for name in WINDOWS:
                on = theirs[f"{name} on"].to_numpy().round().astype(int)
                row = _row(f"irradiance above {limit:.0f} W/m2", shaded, name, ours[name].to_numpy(), on)
                # its control does not read the reflections that its heat balance then has
                other = (reflected[f"{name} sun"].to_numpy() > limit).astype(int)
                hidden = (1.0 - ground_seen()) * theirs[f"{name} ground"] if shaded else 0.0
                same = ((theirs[f"{name} sun"] - hidden).to_numpy() > limit).astype(int)
                row["same cause h"] = int((ours[name].to_numpy() != same).sum())
                rows.append(row | {"its two models differ h": int((other != on).sum())})
        theirs = run_energyplus(energyplus_model(BLOCKING, shaded=shaded), WEATHER, outputs=OUTPUTS)
        ours = our_states(CUT_OFF, len(TILTS), shaded=shaded)
        for name in WINDOWS:
            slats = energyplus_cut_off(theirs, name)
            row = _row("cut-off", shaded, name, ours[name].to_numpy(), slats)
            rows.append(row | {"same cause h": int((cut_off_under(theirs, name) != slats).sum())})
    return pd.DataFrame([*rows, *_scenarios()])


def _scenarios() -> Iterator[dict[str, Any]]:
    """The states by named scenarios in the open."""
    for kind, points in SCENARIOS.items():
        model = energyplus_model({"shading_control_type": kind, **points}, shaded=False)
        theirs = run_energyplus(model, WEATHER, outputs=OUTPUTS)
        keys = "\n".join(f"{key} = {value}" for key, value in points.items())
        ours = our_states(f'scenario = "EnergyPlus {kind}"\n{keys}', 2, shaded=False)
        for name in WINDOWS:
            on = theirs[f"{name} on"].to_numpy().round().astype(int)
            yield _row(kind, False, name, ours[name].to_numpy(), on)


def with_reflections(model: Model) -> Model:
    """The model with EnergyPlus' other account of the ground: shaded and hidden by the plates."""
    black = {
        name: {
            "shading_surface_name": name,
            "diffuse_solar_reflectance_of_unglazed_part_of_shading_surface": 0.0,
            "diffuse_visible_reflectance_of_unglazed_part_of_shading_surface": 0.0,
        }
        for name in model.get("Shading:Building:Detailed", {})
    }
    how = "FullInteriorAndExteriorWithReflections"
    changes: Model = {"Building": {"main": {"solar_distribution": how}}}
    return merged(model, changes | ({"ShadingProperty:Reflectance": black} if black else {}))


def _row(rule: str, shaded: bool, window: str, ours: NDArray[np.int64], theirs: NDArray[np.int64]) -> dict[str, Any]:
    apart = ours != theirs
    return {
        "rule": rule,
        "surroundings": "overhang and fin" if shaded else "open",
        "window": window,
        "closed h": int((ours > 0).sum()),
        "EnergyPlus h": int((theirs > 0).sum()),
        "differ h": int(apart.sum()),
        "of the year %": round(100 * float(apart.mean()), 2),
    }


def sun_errors() -> pd.DataFrame:
    """Angle between the sun of both programs and the Almanac's while it is up [deg]."""
    theirs = run_energyplus(
        energyplus_model({"shading_control_type": "AlwaysOn"}, shaded=False), WEATHER, outputs=OUTPUTS
    )
    right = almanac_sun()
    up = right[:, 2] > np.sin(np.radians(5.0))  # above what refraction lifts
    rows = []
    for name, sun in (("mitsuba-cfs", sun_directions(read_epw(WEATHER))), ("EnergyPlus", their_sun(theirs))):
        apart = np.degrees(np.arccos(np.clip(np.sum(sun * right, axis=1)[up], -1.0, 1.0)))
        rows.append({"sun": name, "rms deg": np.sqrt(np.mean(apart**2)), "most deg": apart.max()})
    return pd.DataFrame(rows)


def main(*, weather: Path | None = None) -> pd.DataFrame:
    """All rules, surroundings and windows, after the errors of the sun; or those of `elsewhere`."""
    if weather is not None:
        return elsewhere(weather)
    print(sun_errors().round(3).to_string(index=False), f"\n\nground seen beside the fin: {ground_seen():.3f}\n")
    return compare()
