"""Glare of a blind that moves is read from the ratings with it up and down; of others it is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods import glare
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.glare import rated_hours
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.options import RoomOptions

EVERY = 211  # hour with the sun up
OPTIONS = RoomOptions.of(
    sky_subdivision=1,
    sensor_samples=64,
    patch_samples=128,
    sun_points=16,
    picture_size=48,
    picture_samples=4,
    sensor_spacing=1.5,
)


def pane(transmittance: float) -> FenestrationSystem:
    klems = specular_klems(Glazing("pane", transmittance, 0.1, 0.1, 2), KLEMS_FULL)
    return FenestrationSystem("pane", klems, klems, source="made")


@pytest.fixture(scope="module")
def skies():
    found = skies_for(read_epw(WEATHER), OPTIONS.sampling)
    return found.part(np.arange(0, len(found.lit), EVERY))


def rated(skies, folder: Path, states, state=0, width: float = 2.0) -> AnnualGlare:
    """DGP of every hour of a room whose window has these states, in the state of the hour."""
    building = shoebox(3.0, 4.0, windows=[WindowRectangle(0.5, 0.8, width, 1.8)])
    (space,) = building.spaces
    systems = {window.guid: tuple(states) for window in space.windows}
    room = room_inputs(building, space, systems, read_epw(WEATHER), OPTIONS, skies=skies, cache=MatrixCache(folder))
    of_hours = np.broadcast_to(state, skies.hours)[:, None]
    return rated_hours(room, room_light(room), of_hours, "DGP", skies.lit)


def test_each_hour_is_that_of_its_state(variant, skies, tmp_path, monkeypatch) -> None:
    up, down, other = pane(0.7), pane(0.1), pane(0.3)
    moves = np.zeros(skies.hours, dtype=np.int64)
    moves[skies.lit[::2]] = 1
    anew = rated(skies, tmp_path / "anew", (up, down), moves)
    folder = tmp_path / "kept"
    both = [rated(skies, folder, (one,)).dgp for one in (up, down)]
    assert (both[0] > both[1] + 0.01).any()
    with monkeypatch.context() as patched:

        def none(*_: object, **__: object) -> None:
            raise AssertionError("the pictures were made again")

        for makes in ("pictures_in_state", "pictures_by_state"):
            patched.setattr(glare, makes, none)
        read = rated(skies, folder, (up, down), moves)
        for states, width in (((up, other), 2.0), ((up, down), 1.5)):
            with pytest.raises(AssertionError, match="made again"):
                rated(skies, folder, states, moves, width)
    np.testing.assert_array_equal(read.dgp, np.where(moves[skies.lit], both[1], both[0]))
    np.testing.assert_allclose(read.dgp, anew.dgp, rtol=0, atol=1e-6)  # float32, other batches
