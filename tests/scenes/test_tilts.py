"""A blind as a function of its slats' tilt: states between systems are means, not traced."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods import phase_light as phases
from mitsuba_cfs.methods.light import illuminance_with_error
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.systems import FenestrationSystem
from scenes.fenestration.tilts import between_tilts, tilt_errors, tilt_note, tilt_states
from scenes.room.inputs import room_inputs
from scenes.room.light import room_light
from scenes.room.operation import check_systems, read_operation
from scenes.room.operation_tables import OperationTables
from scenes.room.shading import shading_states
from scenes.room.solar import SunByStates, seasonal_outdoors
from scenes.room.window_sensors import window_beam
from scenes.room.windows import in_all_windows
from scenes.room.zone import zone_surfaces
from tests.scenes.test_control_function import FEW, TWO


def milk_at(tilt: float, tau: float) -> FenestrationSystem:
    """A pane that scatters evenly, as if its slats had a tilt."""
    even = np.full((KLEMS_FULL.size, KLEMS_FULL.size), tau / np.pi)
    back = np.full_like(even, 0.2 / np.pi)
    klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, even, even, back, back)
    return FenestrationSystem(f"milk {tilt:g}", klems, klems, u_value=2.0, g_value=tau + 0.1, tilt_deg=tilt)


def family() -> list[FenestrationSystem]:
    return [milk_at(0.0, 0.6), milk_at(40.0, 0.4), milk_at(70.0, 0.1)]


def room_with(states, weather, skies, control=None):
    tables = OperationTables.model_validate({"control": control or {}})
    return room_inputs(
        TWO, TWO.spaces[0], in_all_windows(TWO.spaces[0], *states), weather, FEW, operation=tables, skies=skies
    )


def test_states_in_steps_between_the_tilts() -> None:
    raised = replace(milk_at(0.0, 0.8), tilt_deg=None)
    states = tilt_states([raised, *family()], 10.0)
    assert [s.tilt_deg for s in states] == [None, 0, 10, 20, 30, 40, 50, 60, 70]
    tau = [float(s.visible.direct_hemispherical(s.visible.transmission_front)[0]) for s in states]
    assert tau == pytest.approx([0.8, 0.6, 0.55, 0.5, 0.45, 0.4, 0.3, 0.2, 0.1], abs=1e-6)
    assert [s.g_value for s in states[1:3]] == pytest.approx([0.7, 0.65])


def test_the_light_between_two_tilts_is_their_mean_and_is_not_traced(variant, weather, skies, monkeypatch) -> None:
    counted = []
    traced = phases.direct_sun_matrix
    monkeypatch.setattr(phases, "direct_sun_matrix", lambda *a, **k: (counted.append(1), traced(*a, **k))[1])
    states = tilt_states(family(), 10.0)
    room = room_with(states, weather, skies)
    light = room_light(room).light
    assert len(counted) == 3 and len(states) == 8
    lit = [illuminance_with_error(light, np.full(len(skies.lit), j)) for j in range(8)]
    for j, low, high, share in ((1, 0, 4, 0.25), (3, 0, 4, 0.75), (5, 4, 7, 1 / 3)):
        expected = (1 - share) * lit[low][0] + share * lit[high][0]
        assert lit[j][0] == pytest.approx(expected, rel=1e-6)  # a sky in single precision
        assert 0 < lit[j][1].max() < 1.5 * max(lit[low][1].max(), lit[high][1].max())
    # the same states, each traced: a system of its own, of the same BSDF
    alone = [replace(one, between=None) for one in states]
    traced_light = room_light(room_with(alone, weather, skies)).light
    for j in (1, 5):
        own = illuminance_with_error(traced_light, np.full(len(skies.lit), j))[0]
        assert own == pytest.approx(lit[j][0], rel=1e-5)


def test_the_sun_between_two_tilts_is_their_mean(variant, weather, skies) -> None:
    room = room_with(tilt_states(family(), 10.0), weather, skies)
    surfaces, outdoors = zone_surfaces(room), seasonal_outdoors(room)
    sun = SunByStates(room, outdoors, surfaces.room, surfaces.outer, thermals=surfaces.thermals)
    low, high, both = (sun.of(states) for states in ([0, 4], [4, 4], [1, 4]))
    for name in ("transmitted_w", "absorbed_room_w"):
        expected = 0.75 * low[1][name] + 0.25 * high[1][name]
        assert both[1][name] == pytest.approx(expected, rel=1e-9)
        assert both[1][name].max() > 100
    assert both[0].inside == pytest.approx(0.75 * low[0].inside + 0.25 * high[0].inside)


def test_cut_off_takes_the_least_tilt_of_the_family_that_stops_the_beam(variant, weather, skies) -> None:
    """Closed form: tan(profile) >= (spacing/width - sin tilt)/cos tilt; raised stops nothing."""
    raised = replace(milk_at(0.0, 0.8), tilt_deg=None)
    states = tilt_states([raised, *family()], 5.0)
    control = {"rule": "cut-off", "slat_width": 0.08, "slat_spacing": 0.072}
    room = room_with(states, weather, skies, control)
    found, beam = shading_states(room), window_beam(room, shaded=True)
    sun, tilts = sun_directions(weather), np.array([s.tilt_deg for s in states[1:]])
    for g, group in enumerate(room.windows.groups):
        frame = window_frame(group.frame[2])
        local = sun @ frame.T
        tangent = local[:, 1] / np.where(local[:, 2] > 0, local[:, 2], 1.0)
        least = (0.9 - np.sin(np.radians(tilts))) / np.cos(np.radians(tilts))
        for hour in np.flatnonzero(beam[:, g] > 0):
            stops = np.flatnonzero(tangent[hour] >= least)
            expected = 1 + (stops[0] if len(stops) else len(tilts) - 1)
            assert found[hour, g] == expected
        assert not found[(beam[:, g] <= 0), g].any()
    assert is_up(sun).any() and len(np.unique(found)) > 8
    assert np.count_nonzero(found[:, 0] != found[:, 1]) > 1000


def test_the_error_is_that_of_tilts_left_out() -> None:
    """A family that is linear in the tilt has none; (0.6, 0.4, 0.1) is 0.086 off its chord."""
    straight = [milk_at(0.0, 0.6), milk_at(30.0, 0.45), milk_at(60.0, 0.3)]
    (error,) = tilt_errors(straight)
    assert error.transmittance == pytest.approx(0.0, abs=1e-12)
    (error,) = tilt_errors(family())
    chord = 0.6 + (0.1 - 0.6) * 40 / 70
    assert error.transmittance == pytest.approx(0.4 - chord, abs=1e-9)
    assert error.relative == pytest.approx((0.4 - chord) / 0.4, rel=1e-6)
    (note,) = tilt_note(tilt_states(family(), 10.0))
    assert "0.086 of the light" in note and "21 % of the BSDF (40°" in note
    assert tilt_note(family()) == ()


@pytest.mark.parametrize(
    ("systems", "words"),
    [
        ([milk_at(0.0, 0.5)], "two or more"),
        ([milk_at(30.0, 0.5), milk_at(0.0, 0.4)], "rising"),
        ([milk_at(0.0, 0.5), replace(milk_at(5.0, 0.4), tilt_deg=None), milk_at(9.0, 0.3)], "after all others"),
    ],
)
def test_what_is_no_family_is_refused(systems, words) -> None:
    with pytest.raises(DataError, match=words):
        tilt_states(systems, 5.0)
    with pytest.raises(DataError, match="at most 91"):
        tilt_states([milk_at(-80.0, 0.5), milk_at(80.0, 0.1)], 1.0)


def test_a_family_of_an_operation_file(tmp_path) -> None:
    glazing = VENETIAN_BLIND.parent / "glazing.xml"
    text = f"""
tilt_step_deg = 10
[[system]]
bsdf = "{glazing}"
[[system]]
bsdf = "{VENETIAN_BLIND}"
tilt_deg = 0
[[system]]
bsdf = "{VENETIAN_BLIND}"
tilt_deg = 30
[control]
rule = "cut-off"
"""
    path = tmp_path / "own.toml"
    path.write_text(text)
    operation = read_operation(path)
    assert [s.tilt_deg for s in operation.systems] == [None, 0, 10, 20, 30]
    check_systems(operation)
    assert operation.tables.control_fault(5) is None
    path.write_text(text.replace("tilt_deg = 30", "tilt_deg = -30"))
    with pytest.raises(DataError, match=r"own.toml: tilt_step_deg: tilts between"):
        read_operation(path)
    bare = OperationTables.model_validate({"control": {"rule": "cut-off"}})
    assert bare.control_fault(3)[0] == "control.slat_tilts_deg"
    assert between_tilts(*operation.systems[1:3], 0.5).tilt_deg == 5
    assert isinstance(operation.file, Path)


def test_the_sun_of_a_pane_stays_between_a_tilt_with_a_shade_node_and_one_without(variant, weather, skies) -> None:
    """The state between them has no node for the sun that the first one's pane absorbs."""
    room = room_with(tilt_states(family(), 10.0), weather, skies)
    surfaces, outdoors = zone_surfaces(room), seasonal_outdoors(room)
    layered = []
    for first, *others in surfaces.thermals:
        half = 0.5 * first.absorptances.inner
        nodes = replace(first.absorptances, inner=half, middle=half)
        shade = replace(first.fenestration, shade=SimpleNamespace(exterior=False))
        two = [
            replace(
                one,
                absorptances=replace(one.absorptances, middle=0.0),
                fenestration=replace(one.fenestration, shade=None),
            )
            for one in others
        ]
        layered.append([replace(first, absorptances=nodes, fenestration=shade), *two])
    sun = SunByStates(room, outdoors, surfaces.room, surfaces.outer, thermals=layered)
    assert sun.of([0, 4])[0].absorbed_middle[:, 0].max() > 1
    assert not sun.of([1, 4])[0].absorbed_middle.any()
    assert sun.of([1, 4])[0].absorbed_inner[:, 0].max() > 1
