"""A facade in three bands of different panes: a system for each window, by phases and by paths."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight

pytestmark = pytest.mark.usefixtures("variant")


def pane(transmittance: float, scattered: float):
    """A system of a clear and a scattering share."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
    from scenes.fenestration.systems import FenestrationSystem

    omega = KLEMS_FULL.projected_solid_angles()
    block = np.diag(transmittance / omega) + np.full((len(omega),) * 2, scattered / np.pi)
    back = np.full_like(block, 0.1 / np.pi)
    bsdf = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block, back, back)
    return FenestrationSystem(f"pane {transmittance} {scattered}", bsdf, bsdf)


@pytest.fixture(scope="module")
def bands(variant):
    """Scene, systems of each group, and one sunny hour."""
    from bim.sensors import view_point
    from bim.shoebox import WindowRectangle, shoebox
    from bim.to_tracer import interior_surfaces
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.methods.scene import DaylightScene
    from mitsuba_cfs.sky.annual import AnnualSky
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
    from mitsuba_cfs.surfaces import Surfaces
    from scenes.room.windows import room_windows

    heights = ((0.3, 0.6), (1.0, 0.9), (2.0, 0.7))
    rectangles = [WindowRectangle(0.5, low, 3.0, high) for low, high in heights]
    space = shoebox(windows=rectangles).spaces[0]
    chosen = (pane(0.1, 0.3), pane(0.6, 0.0), pane(0.0, 0.5))  # sill, view, clerestory
    given = zip(space.windows, chosen, strict=True)
    windows = room_windows(space, {window.guid: (system,) for window, system in given})
    points = np.array([[2.0, y, 0.8] for y in (0.8, 2.0, 4.0)])
    position, direction = view_point(space)
    scene = DaylightScene(
        interior_surfaces(space, "visible"),
        Surfaces.none(),
        windows.groups,
        points,
        np.tile([0.0, 0.0, 1.0], (3, 1)),
        fisheye(position, direction, 100),
    )
    sky, sun = ReinhartSky(4), np.array([0.55, -0.65, 0.52])
    sun /= np.linalg.norm(sun)
    diffuse = np.full((sky.size, 1), 3000.0)
    diffuse[0] = 1000.0
    patch = int(sky.index(sun))
    spread = np.zeros_like(diffuse)
    spread[patch] = 2e4 / sky.solid_angles[patch]
    assert SUN_SOLID_ANGLE < sky.solid_angles[patch]
    hour = AnnualSky(diffuse + spread, sun[None], np.array([2e4]), np.arange(1), 1, spread)
    return scene, windows, hour


def test_each_band_has_its_own_system_in_light_and_in_glare(bands):
    from mitsuba_cfs.methods.glare import hourly_glare
    from mitsuba_cfs.methods.scene import Sampling

    scene, windows, hour = bands
    assert len(windows.groups) == 3 and [len(states) for states in windows.systems] == [1, 1, 1]
    few = Sampling(sensor_samples=32_768, patch_samples=4_096, hour_samples=131_072, picture_samples=48)
    optics = windows.optics()
    found = phase_light(phase_matrices(scene, few), optics, hour)
    paths = PathLight(scene, optics, hour, few)
    lit, expected = illuminance(found)[:, 0], illuminance(paths)[:, 0]
    print("illuminance over that by paths", lit / expected)
    # noise of 1 %, and the sun that the room reflects comes from a whole patch of 10 degrees
    np.testing.assert_allclose(lit, expected, rtol=0.05)
    glare, by_paths = hourly_glare(found, "DGP"), hourly_glare(paths, "DGP")
    print("DGP", glare.dgp, by_paths.dgp)
    assert glare.dgp[0] == pytest.approx(by_paths.dgp[0], abs=0.02)
    # the panes in another order are another room: the agreement is not that of any mixture
    turned = phase_light(found.matrices, [optics[2], optics[0], optics[1]], hour)
    assert np.abs(illuminance(turned)[:, 0] / expected - 1).max() > 0.1
