"""The light that rules look at: grids from one scene, blinds moved by group, the default shade."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import direct_sun_by_group, illuminance
from mitsuba_cfs.metrics import lm83
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply.blinds import diffuse_shade, open_and_closed, with_default_shade
from scenes.comply.comply import lights_of, sensor_grid_of
from scenes.comply.outdoors import outdoors_of
from scenes.comply.rules import GridTable, read_rule
from scenes.comply.view_out import view_out, windows_without_view
from scenes.demo import WEATHER
from scenes.fenestration.sight import sight_through
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.options import RoomOptions, SensorGrid

EVERY = 23  # hour with the sun up: all hours of the day and all seasons come
# Sums over a window's directions in float32, added up in another order with other hours beside:
# n terms of one sign differ by at most n eps (Higham 2002, Accuracy and Stability, eq. 4.4).
ROUNDING = KLEMS_FULL.size * np.finfo(np.float32).eps


def glazing(tau=0.7):
    klems = specular_klems(Glazing("clear", tau, 0.1, 0.1, 2), KLEMS_FULL)
    return FenestrationSystem("clear", klems, klems, source="made")


def test_the_default_shade_passes_five_per_cent():
    """Of what the glazing passes, evenly: tau(incident) x 0.05, the same in every direction."""
    clear = glazing()
    shaded = with_default_shade(clear).visible
    passed = shaded.direct_hemispherical(shaded.transmission_front)
    wanted = 0.05 * clear.visible.direct_hemispherical(clear.visible.transmission_front)
    np.testing.assert_allclose(passed, wanted, rtol=1e-12)
    assert np.ptp(shaded.transmission_front, axis=0).max() < 1e-12
    shade = diffuse_shade(0.05)
    whole = shade.direct_hemispherical(shade.transmission_front)
    np.testing.assert_allclose(whole, 0.05, rtol=1e-12)


def test_closed_is_what_is_given_else_held_else_default():
    clear, blind, given = glazing(), glazing(0.2), glazing(0.1)
    systems = {"a": (clear,), "b": (clear, blind)}
    found = open_and_closed(systems, None)
    assert found["a"][0] is clear and "default shade" in found["a"][1].name
    assert found["b"] == (clear, blind)
    assert all(states[1] is given for states in open_and_closed(systems, given).values())
    same = open_and_closed({"a": (clear,), "b": tuple([clear])}, None)
    assert same["a"] is same["b"]  # windows of one system stay one group


def test_grids_of_rules():
    """LM-83's is 0.6 m wide and high; EN 17037's has whole cells no wider than p."""
    space = shoebox(4.0, 6.0).spaces[0]
    assert sensor_grid_of(space, read_rule("lm83").grid) == SensorGrid(spacing=0.6, height=0.76, margin=0.0)
    grid = sensor_grid_of(space, read_rule("en17037").grid)  # a plane of 3 x 5 m
    p = 0.5 * 5 ** np.log10(5.0)
    assert grid.spacing == pytest.approx(5.0 / 4) and 5.0 / 4 <= p < 5.0 / 3
    assert (grid.height, grid.margin) == (0.85, 0.5)


@pytest.fixture(scope="module")
def room(variant):
    """East and west windows, two grids, a sample of the year's hours."""
    weather = read_epw(WEATHER)
    sides = [WindowRectangle(1.5, 0.9, 2.0, 1.8, side=side) for side in ("left", "right")]
    building = shoebox(windows=sides)
    space = building.spaces[0]
    options = RoomOptions.of(sky_subdivision=1, sensor_samples=1024, patch_samples=256, sun_points=64)
    skies = skies_for(weather, options.sampling)
    skies = skies.part(np.arange(0, len(skies.lit), EVERY))
    systems = open_and_closed({w.guid: (glazing(),) for w in space.windows}, None)
    same = {w.guid: systems[space.windows[0].guid] for w in space.windows}
    grids = [
        sensor_grid_of(space, GridTable(height=0.76, margin=0.3, spacing=1.5)),
        sensor_grid_of(space, GridTable(height=0.85, margin=0.5, spacing=1.0)),
    ]
    return room_inputs(building, space, same, weather, options, skies=skies, grids=grids)


@pytest.mark.slow
def test_blinds_are_moved_group_by_group(room):
    """East closes in the morning, west in the afternoon; the light is that of these states."""
    light = room_light(room)
    operated, other = lights_of(room, light, {0})
    assert other.operated is None and len(other.points) != len(operated.points)
    np.testing.assert_allclose(operated.points[:, 2], 0.76)
    np.testing.assert_allclose(other.points[:, 2], 0.85)
    lit = room.skies.lit
    closed = operated.closed[lit]
    assert 0.02 < closed.mean() < 0.5 and not closed.all(axis=1).any()
    east = next(g for g, group in enumerate(room.windows.groups) if group.name == "E")
    before_noon = room.weather.midpoints[lit].hour < 12
    assert closed[before_noon, east].any() and not closed[~before_noon, east].any()
    # by hand: state by state through the same matrices
    count = len(operated.points)
    through = [part[:count] for part in direct_sun_by_group(light.light)]
    over = lm83.blinds_operated([part.T for part in through])
    np.testing.assert_array_equal(closed.T, over)
    np.testing.assert_allclose(sum(through).T, operated.direct[lit], rtol=1e-6)
    for states in ((0, 0), (1, 0), (0, 1)):
        hours = np.all(over == np.array(states, dtype=bool)[:, None], axis=0)
        row = np.tile(np.array(states)[:, None], len(lit))
        wanted = illuminance(light.light, row)[:count, hours].T
        np.testing.assert_allclose(operated.operated[lit][hours], wanted, rtol=ROUNDING)
    np.testing.assert_array_equal(operated.free, ~operated.closed)  # the default shade is no view
    # with closed blinds it is darker, with open ones the same
    opened, moved = operated.open[lit], operated.operated[lit]
    assert (moved[over.any(axis=0)] < opened[over.any(axis=0)]).all()
    still = ~over.any(axis=0)
    np.testing.assert_allclose(moved[still], opened[still], rtol=ROUNDING)


def test_glass_is_seen_through_and_a_diffuser_is_not():
    """Clear glass goes straight on; a shade of 5 % diffuse has no peak."""
    clear = sight_through(glazing(0.7))
    assert clear.transmittance == pytest.approx(0.7, abs=0.005) and clear.haze < 0.02
    assert clear.is_view
    shaded = sight_through(with_default_shade(glazing(0.7)))
    assert shaded.straight == 0.0 and shaded.haze == 1.0 and not shaded.is_view


def test_windows_without_view_are_no_view_openings():
    """The clear one of two windows alone has a sight angle; a window without data is clear."""
    two = [WindowRectangle(0.25, 1, 1.5, 1), WindowRectangle(2.25, 1, 1.5, 1)]
    building = shoebox(windows=two)
    space = building.spaces[0]
    first, second = space.windows
    systems = {first.guid: (glazing(),), second.guid: (with_default_shade(glazing()),)}
    hidden, notes = windows_without_view(space.windows, systems)
    assert hidden == {second.guid} and len(notes) == 2
    assert "haze 100 %; does not count" in notes[1]
    found = view_out(space, outdoors_of(building), hidden=hidden)
    x, y = found.points[:, 0], found.points[:, 1]
    wanted = np.degrees(np.arctan2(1.75 - x, y) - np.arctan2(0.25 - x, y))
    np.testing.assert_allclose(found.sight_angle_deg, wanted, atol=0.1)
    assert windows_without_view(space.windows, {}) == (frozenset(), ())


def test_a_closed_state_says_what_it_leaves_of_the_view():
    """Panes that only darken leave it free; LM-83's shade hides it, and hides no window."""
    space = shoebox(4.0, 6.0).spaces[0]
    (window,) = space.windows
    clear, dark = glazing(0.7), replace(glazing(0.2), name="dark")
    for closed, said in ((dark, "the view remains when closed"), (None, "blocks the view")):
        states = open_and_closed({window.guid: (clear,)}, closed)
        hidden, notes = windows_without_view([window], states)
        assert not hidden and len(notes) == 2
        assert notes[0].endswith("counts as a view.") and notes[1].endswith(f"{said}.")
