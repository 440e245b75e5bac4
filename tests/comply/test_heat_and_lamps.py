"""Needs of summer comfort and of lamps, by hand; the shares of hours with a free view."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest

from mitsuba_cfs.sky.epw import read_epw
from scenes.comply.comply import free_shares
from scenes.comply.findings import Findings, GridLight, RoomHeat, calendar_of
from scenes.comply.needs import ComfortShare, DegreeHours, LightingEnergy, ViewFree
from scenes.comply.rules import read_rule
from scenes.demo import WEATHER


@pytest.fixture(scope="module")
def calendar():
    return calendar_of(read_epw(WEATHER))


def heat(operative, outdoor=20.0):
    occupied = np.tile(np.arange(24) // 10 == 1, 365)  # 10 to 19 o'clock
    return RoomHeat(np.full(8760, operative), np.full(8760, outdoor), occupied)


def test_degree_hours_of_use_and_of_all_hours(calendar):
    """2.5 K above in every hour: 2.5 x 3,650 of use, 2.5 x 8,760 in all; none below."""
    need = DegreeHours(what="degree_hours", above_c=26, at_most=500)
    found = Findings(calendar, heat=heat(28.5))
    assert need.value(found) == pytest.approx(2.5 * 3650)
    whole = DegreeHours(what="degree_hours", above_c=26, all_hours=True, at_most=1200)
    assert whole.value(found) == pytest.approx(2.5 * 8760)
    assert need.value(Findings(calendar, heat=heat(25.9))) == 0.0
    assert need.value(Findings(calendar)) is None


@pytest.mark.parametrize(("operative", "inside"), [(27.3, "I"), (27.5, "II"), (28.5, "III"), (29.5, ""), (22.5, "I")])
def test_bands_of_the_categories(calendar, operative, inside):
    """20 °C outdoors: 0.33 x 20 + 18.8 = 25.4 °C; +2 -3, +3 -4, +4 -5 K."""
    needs = {
        name: ComfortShare(what="comfort", band=f"EN 16798-1 {name}", at_least=0.95) for name in ("I", "II", "III")
    }
    found = Findings(calendar, heat=heat(operative))
    met = [name for name, need in needs.items() if need.value(found) == 1.0]
    assert (met[0] if met else "") == inside
    assert needs["I"].value(Findings(calendar, heat=heat(20.0, outdoor=5.0))) is None


def test_a_cold_room_counts_where_nothing_heats(calendar):
    """13 °C outdoors: a heating is on, 18 °C counts as kept; at 16 °C it is too cold (24.08 - 4).

    Too warm (13 °C: 23.09 + 3) counts in both.
    """
    need = ComfortShare(what="comfort", band="EN 16798-1 II", cold_from_c=15, at_least=0.95)
    plain = ComfortShare(what="comfort", band="EN 16798-1 II", at_least=0.95)

    def share(one, operative, outdoor):
        return one.value(Findings(calendar, heat=heat(operative, outdoor)))

    assert share(need, 18.0, 13.0) == 1.0 and share(plain, 18.0, 13.0) == 0.0
    assert share(need, 18.0, 16.0) == 0.0 and share(need, 20.1, 16.0) == 1.0
    assert share(need, 26.2, 13.0) == 0.0
    rule = read_rule("en16798-1")
    both, upper = rule.criterion
    assert {one.cold_from_c for one in both.needs} == {15}
    assert all("upper limit only" in one.words for one in upper.needs)
    (third, second, first) = upper.needs
    assert share(third, 10.0, 29.0) == 1.0 and share(third, 32.5, 29.0) == 0.0
    assert share(second, 31.3, 29.0) == 1.0 and share(first, 31.3, 29.0) == 0.0  # 28.37 + 3, + 2


def test_comfort_of_half_hours_is_that_of_hours(calendar):
    """The limits follow the means of whole days: hot days and cool nights, colder by the season."""
    hours = np.arange(8760)
    outdoor = 22 - 16 * np.cos(2 * np.pi * hours / 8760) + np.where(hours % 24 < 12, -8.0, 8.0)
    year = replace(heat(27.0), outdoor_c=outdoor)
    halves = RoomHeat(*(np.repeat(values, 2) for values in astuple(year)))
    need = ComfortShare(what="comfort", band="EN 16798-1 II", at_least=0.95)
    share = need.value(Findings(calendar, heat=year))
    assert 0.1 < share < 0.9
    assert need.value(Findings(replace(calendar, step_h=0.5), heat=halves)) == share


def test_lamps_make_up_for_what_daylight_lacks(calendar):
    """Half the plane dark, half at 250 of 500 lx: 0.75 of 8 W/m2 in 3,650 h, and the standby."""
    lux = np.zeros((8760, 4), dtype=np.float32)
    lux[:, 2:] = 250.0
    light = GridLight(np.zeros((4, 3)), lux, np.zeros_like(lux), np.zeros(4))
    need = LightingEnergy(what="leni", lux=500, power_w_m2=8, standby_kwh_m2=2.5, at_most=30)
    found = need.value(Findings(calendar, light))
    assert found == pytest.approx(8 * 0.75 * 3.65 + 2.5)
    blinds = GridLight(*(np.zeros((4, 3)), lux, lux, np.zeros(4), np.zeros_like(lux)))
    assert need.value(Findings(calendar, blinds)) == pytest.approx(8 * 3.65 + 2.5)


def test_hours_with_a_free_view(calendar):
    """One of two groups is closed in the morning, both at noon."""
    free = np.ones((8760, 2), dtype=bool)
    hour = np.arange(8760) % 24
    free[hour < 12, 0] = False
    free[hour == 12] = False
    lux = np.zeros((8760, 1), dtype=np.float32)
    light = GridLight(np.zeros((1, 3)), lux, lux, np.zeros(1), lux, ~free, free)
    need = ViewFree(what="view_free", at_least=0.5)
    assert need.value(Findings(calendar, light)) == pytest.approx(0.9)
    assert free_shares(free[calendar.ten]) == pytest.approx((0.9, 0.5))


def test_rules_of_heat_are_read():
    assert read_rule("din4108-2").parts == {"heat"} == read_rule("en16798-1").parts
