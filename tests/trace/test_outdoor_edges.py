"""The edge of a shadow outdoors in a picture: what is lit of each pixel, not its middle alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs.directions import normalize
from mitsuba_cfs.images.view import pixel_directions
from mitsuba_cfs.trace.pictures.outdoors import outdoors
from scenes.demo import WEATHER
from tests.validation import fireflies

pytestmark = pytest.mark.usefixtures("variant")

SUNS = normalize(np.array([[-0.4, -0.76, 0.51], [0.3, -0.6, 0.7], [0.1, -0.9, 0.4]]))


def sunlit(size: int, samples: int) -> NDArray[np.float64]:
    """Luminance [h, ny, nx] of the ground and the house opposite by the sun alone."""
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), size)
    scene, way = lit.scene, [lit.systems[0][0].scattering]
    around = scene.interior, scene.exterior, scene.groups, way, scene.view
    found = outdoors(*around, samples=samples)
    shown = np.flatnonzero(pixel_directions(scene.view)[1].reshape(-1))
    values = np.zeros((len(SUNS), len(shown)))
    sky = np.zeros((found.reflected.shape[0], len(SUNS)), dtype=np.float32)
    found.sun.add_to(values, SUNS, np.full(len(SUNS), 1e5), sky)
    whole = np.zeros((len(SUNS), size * size))
    whole[:, shown] = values
    return whole.reshape(-1, size, size)


def test_the_edge_of_a_shadow_outdoors_is_as_bright_as_it_is_lit() -> None:
    """Against a picture of five times the pixels across, those of a pixel taken together."""
    found = sunlit(60, 8)
    fine = sunlit(300, 4).reshape(len(SUNS), 60, 5, 60, 5)
    edge = (fine > 100).any(axis=(2, 4)) & (fine < 100).any(axis=(2, 4))
    off = (found - fine.mean(axis=(2, 4)))[edge] / fine.max()
    assert len(off) > 100
    # 0.036; 0.082 by the first place of each pixel alone
    assert np.sqrt(np.mean(off**2)) < 0.055
