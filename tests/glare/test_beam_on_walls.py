"""What a window's straight beam brings to the wall beside it: five-phase pictures against paths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.images.view import pixel_directions
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from scenes.cost import room as box
from scenes.demo import WEATHER
from tests.validation import fireflies

pytestmark = pytest.mark.usefixtures("variant")

EYE = np.array([0.6, 0.3, 1.5])  # before the side wall x = 0, the window's plane at y = 0
DISTANCES = (0.05, 0.15, 0.3)  # from the window's plane [m]


def beside_the_window(outdoors: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Luminance of the side wall at some distances, of pixels by five phases, of points by paths.

    Pictures by paths share light between pixels and are up to a third too bright at 5 cm.
    """
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), 120)
    view = cfs.fisheye(EYE, (-1.0, 0.0, 0.0), 120)
    points = np.array([[1e-3, y, z] for y in DISTANCES for z in (1.3, 1.4, 1.5, 1.6, 1.7)])
    normals = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    exterior = lit.scene.exterior if outdoors else box.NOTHING
    around = box.room(), exterior, box.window_groups()
    lit = replace(lit, scene=cfs.DaylightScene(*around, points, normals, view=view))
    sky = lit.drawn(1, 0)
    light = cfs.phase_light(cfs.phase_matrices(lit.scene), lit.systems, sky)
    pictures = pictures_in_state(light, np.arange(1), [0])
    found = full_picture(pictures.without_disc(np.array([0]))[0][0], pictures.pixels, view)
    lux = cfs.illuminance(cfs.PathLight(lit.scene, lit.systems, sky))[:, 0]
    expected = box.WALLS / np.pi * lux.reshape(len(DISTANCES), -1).mean(axis=1)
    directions, _ = pixel_directions(view)
    before = directions[..., 0] < -0.1
    towards = np.where(before, directions[..., 0], -1.0)
    places = EYE - EYE[0] / towards[..., None] * directions
    before &= np.abs(places[..., 2] - EYE[2]) < 0.25
    near = [before & (np.abs(places[..., 1] - y) < 0.012) for y in DISTANCES]
    return np.array([found[at].mean() for at in near]), expected


@pytest.mark.parametrize("outdoors", [False, True])
def test_a_wall_beside_a_clear_window_is_as_bright_as_by_paths(outdoors: bool) -> None:
    """By patches it shines: it sees the glass at angles at which this passes hardly anything."""
    found, expected = beside_the_window(outdoors)
    # 5 cm from the window: 1.11 and 1.26 times the paths' by patches
    np.testing.assert_allclose(found, expected, rtol=0.1)
