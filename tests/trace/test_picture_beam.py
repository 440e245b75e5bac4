"""The windows' straight beam on what pixels show, against the same point by point."""

from __future__ import annotations

from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_cfs as cfs
from mitsuba_cfs.images.view import pixel_directions
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.pixel_rows import PictureRows, tile_size
from mitsuba_cfs.trace.kernels.sampling import vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix
from mitsuba_cfs.trace.sun.picture_beam import beam_light
from scenes.cost import room as box
from scenes.demo import WEATHER
from tests.validation import fireflies

pytestmark = pytest.mark.usefixtures("variant")


def test_a_slit_of_sky_lights_a_wall_evenly() -> None:
    """High on the wall beside the window one ray in thirty meets the sky; its rows have more."""
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), 160)
    scene, way = lit.scene, lit.systems[0][0].scattering
    around = scene.interior, scene.exterior, scene.groups, [way]
    light = beam_light(*around, np.ones((1, 145)), scene.view)
    inside = TracedScene(scene.interior, scene.groups)
    rows = PictureRows.of_view(inside, scene.view, tile_size(scene.view))
    directions = pixel_directions(scene.view)[0].reshape(-1, 3)[rows.pixels]
    eye, towards = inside.place(scene.view.position), vectors(directions)
    hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(eye, towards), coherent=True)
    distance = dr.select(hit.is_valid(), hit.t, 0.0).numpy()
    place = np.asarray(scene.view.position) + distance[:, None] * directions
    high = (place[:, 0] < 1e-3) & (place[:, 1] > 0.4) & (place[:, 1] < 0.6)
    high &= (place[:, 2] > 2.45) & (place[:, 2] < 2.58)
    chosen = np.flatnonzero(np.isin(rows.row, rows.row[high]))
    points = place[chosen] + [1e-3, 0, 0]
    normals = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    exact = straight_view_matrix(*around, points, normals, paths=PathOptions(8192, 1)).values[0]
    sky = np.ones(exact.shape[1])
    sky[0] = 0  # the ground
    lit = np.bincount(rows.row[chosen], box.WALLS / np.pi * (exact @ sky))
    expected = (lit / np.maximum(np.bincount(rows.row[chosen]), 1))[np.unique(rows.row[chosen])]
    assert len(expected) > 5
    ratio = (light.sky @ sky)[np.unique(rows.row[chosen])] / expected
    # 0.17; 0.53, and rows without any, with as few rays as other rows have
    assert np.sqrt(np.mean((ratio - 1) ** 2)) < 0.3


def test_fewer_rays_give_the_same_light_with_more_noise() -> None:
    """A picture of fewer paths has fewer rays to the windows, and no row loses its light."""
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), 80)
    scene, way = lit.scene, lit.systems[0][0].scattering
    around = scene.interior, scene.exterior, scene.groups, [way]
    sky = np.ones(beam_light(*around, np.ones((1, 145)), scene.view, samples=8).sky.shape[1])
    many, few, other = (
        beam_light(*around, np.ones((1, 145)), scene.view, samples=samples, seed=seed).sky @ sky
        for samples, seed in ((128, 0), (32, 0), (32, 1))
    )
    scale = np.sqrt(np.mean(many**2))
    noise = [np.sqrt(np.mean((one - many) ** 2)) / scale for one in (few, other)]
    # 0.7 %; a row that is traced again by its own rays keeps its light where it met too much: 1.7 %
    assert (few + other).sum() / 2 == pytest.approx(many.sum(), rel=0.012)
    assert max(noise) < 0.35, noise  # 0.27
