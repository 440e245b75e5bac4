"""A room with an undecided transmission peak states what it gives as a lobe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.fenestration.systems import with_see_through
from scenes.results import method_figures, method_notes
from scenes.room.room import lit_room
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import BOX, ROOM, SMALL

FEW = SMALL.changed(
    sensor_samples=256, patch_samples=64, sun_points=16, picture_size=32, picture_samples=2, picture_count=2
)


@pytest.mark.parametrize("rated", [False, True])
def test_the_lobe_of_a_room_is_the_room_with_a_lobe(variant, blind, weather, skies, rated) -> None:
    blind = replace(blind, visible=replace(blind.visible, see_through=None))  # by the data alone
    rate = ("DGP", skies.lit) if rated else None
    beam, lobe = (
        lit_room(BOX, ROOM, in_all_windows(ROOM, one), weather, FEW, skies=skies, rate=rate)
        for one in (blind, with_see_through(blind, 0.0))
    )
    effect = beam.as_lobe
    assert not lobe.as_lobe  # its peak is stated
    values = [
        room.dgp.dgp if rated else np.array([p.glare["dgp"] for p in room.glare.pictures]) for room in (beam, lobe)
    ]
    most = np.argmax(np.abs(values[1] - values[0]))
    assert effect["dgp_as_beam"] == pytest.approx(values[0][most], rel=1e-6)
    assert effect["dgp_as_lobe"] == pytest.approx(values[1][most], rel=1e-6)
    sunny = skies.lit[skies.illuminance > 0]
    lit = [room.daylight.illuminance[sunny].mean(axis=0) for room in (beam, lobe)]
    change = 100 * (lit[1] / lit[0] - 1)
    assert effect["sensor_change_least"] == pytest.approx(change.min(), rel=1e-4)
    assert effect["sensor_change_most"] == pytest.approx(change.max(), rel=1e-4)
    assert abs(change).max() > 0.1
    notes = method_notes([effect])
    assert len(notes) == 2 and f"{effect['sensor_change_most']:+.1f} %" in notes[1]


def test_three_phase_figures_of_a_room_hold_the_blurred_sun(variant, glass, weather, skies) -> None:
    options = FEW.changed(method="three-phase")
    room = lit_room(
        BOX, ROOM, in_all_windows(ROOM, glass), weather, options, skies=skies, pictures=False, rate=("DGP", skies.lit)
    )
    figures = method_figures(room)
    assert figures["sunny_hour_error_max"] >= figures["sunny_hour_error_mean"] > 5
    assert figures["dgp_sunny_hour_error"] > 0.001
    first, second = method_notes([figures])
    assert f"{figures['sunny_hour_error_max']:.0f} % at most" in first
    assert f"by {figures['dgp_sunny_hour_error']:.3f} from" in second
