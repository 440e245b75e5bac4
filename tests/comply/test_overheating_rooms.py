"""The overheating proofs on rooms that are balanced: a greenhouse fails each of them, a cave meets it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply import comply
from scenes.comply.files import ComplyFiles
from scenes.comply.options import ComplyOptions
from scenes.comply.rules import NOT_MET, read_rule
from scenes.comply.uses import read_uses
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.resolver import WindowOverrides
from scenes.fenestration.systems import read_system
from scenes.input_files import InputFiles
from tests.scenes.small_box import FEW

GLAZING = Path(VENETIAN_BLIND).with_name("glazing.xml")
PROOFS = ("tm52", "tm59", "en16798-1", "din4108-2", "re2020", "sia180", "passivhaus", "isso74")
# The site has a word of each rule's weather; Chicago's summer reaches 35 degC
SITE = "Mannheim, DSY, RE2020, SIA 2028, NEN 5060"
WEST = 270.0, WindowRectangle(0.1, 0.3, 3.8, 2.35)
NORTH = 0.0, WindowRectangle(1.0, 1.0, 1.5, 1.0)

pytestmark = pytest.mark.slow


def rooms(facing, window):
    """A bedroom and an office of 20 m2, all other sides adiabatic."""
    (space,) = shoebox(4.0, 5.0, 3.0, windows=(window,), facing_deg=facing).spaces
    spaces = []
    for use in ("Bedroom", "Office"):
        windows = tuple(replace(one, guid=f"{use}-{one.guid}") for one in space.windows)
        spaces.append(replace(space, name=use, guid=use, windows=windows))
    return replace(shoebox(), spaces=tuple(spaces))


def levels(side, warmer):
    """The levels reached by rule and criterion, in Chicago's weather that much warmer [K]."""
    weather = read_epw(WEATHER)
    weather = replace(weather, site=SITE, source="DWD TRY", dry_bulb_c=weather.dry_bulb_c + warmer)
    rules = {name: read_rule(name).of_weather(weather) for name in PROOFS}
    options = ComplyOptions(None, WEATHER, standards=PROOFS, room=FEW)
    inputs = InputFiles(weather, WindowOverrides((read_system(GLAZING),)), None)
    files = ComplyFiles(inputs, rules, read_uses(), None, None, 13.0, "assumed")
    result = comply.check_rooms(rooms(*side), options, files)
    return {(v.rule, v.criterion.key): v.reached for room in result.rooms for v in room.verdicts if v.applies}


def test_west_glass_without_blind_in_a_hot_summer_fails_every_proof(variant) -> None:
    """8.9 m2 of glass for 20 m2 of floor."""
    found = levels(WEST, 0.0)
    assert {rule for rule, _ in found} == set(PROOFS)
    assert set(found.values()) == {NOT_MET}


def test_a_small_north_window_in_a_cool_summer_meets_every_proof(variant) -> None:
    """1.5 m2 of glass, 10 K cooler.  EN 16798-1's categories with lower limits ask for heating, which it lacks."""
    found = levels(NORTH, -10.0)
    assert {rule for rule, _ in found} == set(PROOFS)
    assert {key for key, level in found.items() if level == NOT_MET} <= {("en16798-1", "category")}
