"""The room against EnergyPlus: stored hours of Table 15's room, and the sun on its facade.

Bars (issue 7): air and walls 0.2, 0.15, 0.5, 0.5 K; window 0.3, 0.25, 0.7, 0.8 K over 128 cases.
The fast test takes three orientations of one climate and holds them to the same bars; the slow one
takes all cases; a peer test runs EnergyPlus itself.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER as EPW
from tests.conftest import REPOSITORY
from tests.validation.energyplus_cases import EPW_FILES, FIRST_HOUR, Site, pairs, simulate_case
from tests.validation.energyplus_loads import annual_loads
from tests.validation.energyplus_reference import DEMO_FILE, DEMO_ORIENTATIONS
from tests.validation.energyplus_statistics import case_row, comfort_classification, pooled
from tests.validation.facade_sun import facade_sun, sun_steps
from tests.validation.reference_room import ORIENTATIONS, RoomLight, climate, facade_normal
from tests.validation.reference_systems import clear_double

BARS = {"dgu": (0.2, 0.3), "ext_shade": (0.15, 0.25), "ext_blind": (0.5, 0.7), "int_shade": (0.5, 0.8)}


def compared(real_data, reference_data, closure, climates, orientations) -> pd.DataFrame:
    """Pooled errors by system."""
    rows = [
        case_row(ours[0], theirs)
        for theirs, ours in pairs(
            reference_data / "energyplus",
            real_data / "epw",
            closures=(closure,),
            climates=climates,
            orientations=orientations,
        )
    ]
    return pooled(pd.DataFrame(rows), ["system"])


def hold(table: pd.DataFrame) -> None:
    """The bars of the issue."""
    for system, (air, window) in BARS.items():
        assert table.loc[system, "air rmse"] <= air, system
        assert table.loc[system, "wall rmse"] <= air, system
        assert table.loc[system, "window rmse"] <= window, system


def test_sun_on_the_facade_is_energyplus_own(real_data, reference_data):
    weather = read_epw(real_data / "epw" / EPW_FILES["Houlton"])
    steps = sun_steps(weather, 6)
    columns = ["cfs", "ori", "I_inc", "I_beam", "I_sky"]
    table = pd.read_parquet(reference_data / "energyplus" / "ep_Houlton.parquet", columns=columns)
    for orientation in ("S", "NW"):
        sun = facade_sun(steps, facade_normal(orientation))
        hours = table[(table.cfs == "dgu") & (table.ori == orientation)]
        for name, values in (("I_beam", sun.beam), ("I_sky", sun.sky), ("I_inc", sun.total)):
            error = values.reshape(-1, 6).mean(axis=1) - hours[name].to_numpy()
            # the table has one decimal: 0.03 rms; the sky model's tables have four digits
            assert np.sqrt(np.mean(error**2)) < 0.15, (orientation, name)


def test_clear_glazing_meets_the_bars_in_the_demo_s_climate():
    """Without other data: the demo's weather, and EnergyPlus' hours that the repository holds."""
    weather = read_epw(EPW)
    suns = {o: facade_sun(sun_steps(weather, 6), facade_normal(o)) for o in DEMO_ORIENTATIONS}
    place, light = Site("Chicago", weather, climate(weather), suns), RoomLight()
    stored = pd.read_csv(REPOSITORY / "tests/reference/energyplus_chicago" / DEMO_FILE)
    air, window = BARS["dgu"]
    for orientation, table in stored.groupby("ori"):
        year = simulate_case(place, str(orientation), clear_double(), light)
        wall = year.surface_in_c.mean(axis=1)
        found = {"T_air": year.air_c, "T_wall": wall, "T_win_in": year.window_inner_c[:, 0]}
        for name, bar in (("T_air", air), ("T_wall", air), ("T_win_in", window)):
            error = (found[name] - table[name].to_numpy())[FIRST_HOUR:]
            assert np.sqrt(np.mean(error**2)) <= bar, (orientation, name)


def test_better_closure_meets_the_bars_in_one_climate(real_data, reference_data):
    hold(compared(real_data, reference_data, "films", ("Frankfurt",), ("S", "E", "N")))


def test_gap_closure_meets_the_bars_of_glazing_with_what_anyone_knows(real_data, reference_data):
    table = compared(real_data, reference_data, "gap", ("Frankfurt",), ("S", "N"))
    air, window = BARS["dgu"]
    assert table.loc["dgu", "air rmse"] <= air and table.loc["dgu", "window rmse"] <= window
    assert table.loc["ext_shade", "window rmse"] <= 0.3  # plain Kuhn 0.30


def test_our_own_layers_meet_the_bars_of_glass_blind_and_interior_shade(real_data, reference_data):
    """The default where layers are known; the exterior shade misses its bar by 0.02 K (docs)."""
    table = compared(real_data, reference_data, "layers", ("Frankfurt",), ("S", "N"))
    for system in ("dgu", "ext_blind", "int_shade"):
        air, window = BARS[system]
        assert table.loc[system, "air rmse"] <= air, system
        assert table.loc[system, "wall rmse"] <= air, system
        assert table.loc[system, "window rmse"] <= window, system


def test_plain_kuhn_shows_the_dissertation_s_errors(real_data, reference_data):
    table = compared(real_data, reference_data, "kuhn", ("Frankfurt",), ("S", "N"))
    # dissertation: air and wall 0.6 K, window 0.8 to 1.2 K, behind an interior shade 2.8 K
    assert table["air rmse"].max() <= 0.6
    assert table.loc["int_shade", "window rmse"] > 2.0
    assert table.loc["int_shade", "window rmse"] < 3.0


@pytest.mark.slow
def test_better_closure_meets_the_bars_in_all_cases(real_data, reference_data):
    hold(compared(real_data, reference_data, "films", tuple(EPW_FILES), tuple(ORIENTATIONS)))


@pytest.mark.slow
def test_comfort_agrees(real_data, reference_data):
    outdoor = read_epw(real_data / "epw" / EPW_FILES["Frankfurt"]).dry_bulb_c
    total = None
    for theirs, ours in pairs(
        reference_data / "energyplus",
        real_data / "epw",
        closures=("films",),
        climates=("Frankfurt",),
        systems=("dgu", "ext_blind", "ext_shade"),
    ):
        counts = comfort_classification(ours[0], theirs, outdoor, "ASHRAE 55 80 %")
        total = counts if total is None else total + counts
    assert total.agreement >= 0.985
    assert total.true_positive_rate > 0.94  # dissertation, table 17
    assert total.true_negative_rate > 0.99


@pytest.mark.peer
@pytest.mark.slow
def test_energyplus_run_here_and_now_is_the_reference(real_data, reference_data, tmp_path):
    pytest.importorskip("pyenergyplus")
    from tests.validation.energyplus_program import room_model, run_energyplus

    epw = real_data / "epw" / EPW_FILES["Frankfurt"]
    table = pd.read_parquet(reference_data / "energyplus" / "ep_Frankfurt.parquet")
    live = run_energyplus(room_model("S", "ext_blind"), epw, tmp_path)
    stored = table[(table.cfs == "ext_blind") & (table.ori == "S")]
    for name in ("T_air", "T_facade", "T_win_in"):
        # stored with two decimals; warm-up tolerance 0.01 K
        assert np.abs(live[name].to_numpy() - stored[name].to_numpy()).max() < 0.05, name


def test_heating_and_cooling_agree(real_data, reference_data):
    table = annual_loads(reference_data / "energyplus", real_data / "epw", ("Frankfurt",))
    heating = table["heating"] / table["EnergyPlus heating"] - 1
    cooling = table["cooling"] - table["EnergyPlus cooling"]
    # REFERENCE.md: the prototype with the same closure reached 2 % and 16 kWh rms over these 32
    assert np.sqrt(np.mean(heating**2)) < 0.02
    assert np.sqrt(np.mean(cooling**2)) < 16.0
