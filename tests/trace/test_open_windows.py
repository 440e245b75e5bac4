"""Rays of the reflected sun are traced once for all systems: these add the transmittance of their beams."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.gloss import mirror
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.phase_light import phase_light, with_reflected_sun
from mitsuba_cfs.methods.phase_matrices import phase_matrices, with_sensors
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces

from . import rooms
from .test_reflected_sun import LUX, scene, towards
from .test_subdivision import clear_glass, overhang

pytestmark = pytest.mark.usefixtures("variant")

SUNS = np.array([towards(40, 20), towards(25, 60), towards(50, -30), towards(30, 170)])


def facade() -> Surfaces:
    """An overhang, and a mirror that sends the sun to the ground and into the window."""
    before = overhang(2.0)
    ground = rooms.quad((-20, -20, -1), (20, -20, -1), (20, 0, -1), (-20, 0, -1))
    pane = rooms.quad((0, -10, 0), (4, -11, 0), (4, -11, 3), (0, -10, 3))
    first = int(before.surface.max()) + 1
    return Surfaces(
        np.concatenate([before.triangles, ground, pane]),
        np.append(before.reflectance, [0.3, 0.3, 0.0, 0.0]),
        np.append(before.surface, [first, first, first + 1, first + 1]),
        (),
        (*[None] * (first + 1), mirror(0.8)),
    )


def sunny() -> AnnualSky:
    """Hours of a black sky with the sun."""
    sky = ReinhartSky(1)
    patches = np.zeros((sky.size, len(SUNS)))
    nearest = 1 + np.argmax(sky.directions[1:] @ SUNS.T, axis=0)
    patches[nearest, np.arange(len(SUNS))] = LUX / sky.solid_angles[nearest]
    return AnnualSky(patches, SUNS, np.full(len(SUNS), LUX), np.arange(len(SUNS)), 1, patches)


def systems() -> list:
    """Clear glass, and one whose beam falls with the angle of incidence."""
    from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

    tau = 0.6 * KLEMS_FULL.incident_directions()[:, 2]
    beam = KlemsScattering(KLEMS_FULL, np.zeros((KLEMS_FULL.size, KLEMS_FULL.size)), tau)
    return [BsdfOptics(clear_glass()), MatrixOptics(np.diag(tau), beam)]


def light(outdoors: Surfaces, system, cache: MatrixCache | None, **sampling):
    """Illuminance of the sensors behind a system [S, L]."""
    from mitsuba_cfs.methods.scene import Sampling

    few = {"sensor_samples": 512, "patch_samples": 256, "subdivision": 1, "sun_points": 64} | sampling
    matrices = with_sensors(phase_matrices(scene(outdoors), Sampling(**few), cache=cache))
    return illuminance(phase_light(matrices, [[system]], sunny()))


@pytest.mark.parametrize("parts", [1, 3])
def test_another_system_has_the_light_traced_afresh_from_what_the_first_one_stored(tmp_path, monkeypatch, parts):
    from mitsuba_cfs.methods import reflected_sun as of_method
    from mitsuba_cfs.trace.sun import open_windows

    first, second = systems()
    outdoors, cache = facade(), MatrixCache(tmp_path)
    fresh = [light(outdoors, one, None, window_parts=parts) for one in (first, second)]
    assert not np.allclose(*fresh, rtol=0.1)
    stored = light(outdoors, first, cache, window_parts=parts)
    np.testing.assert_array_equal(stored, fresh[0])
    names = {"-".join(file.stem.split("-")[:-1]) for file in tmp_path.iterdir()}
    assert {"sun-at-windows", "sun-outdoors-in-view", "beam-in-room"} <= names

    for module, name in (
        (open_windows, "window_shares"),
        (open_windows, "view_shares"),
        (open_windows, "sun_at_points"),
        (of_method.OpenBeam, "flux"),
        (of_method, "shares_and_derivatives"),
    ):
        monkeypatch.setattr(module, name, None)
    np.testing.assert_array_equal(light(outdoors, second, cache, window_parts=parts), fresh[1])


def test_what_is_stored_of_the_sun_belongs_to_its_scene_and_hours(tmp_path):
    """Other surroundings, hours or seeds find nothing of it."""
    cache, system = MatrixCache(tmp_path), systems()[0]
    light(facade(), system, cache)

    def files() -> int:
        return sum(file.name.startswith("sun-at-windows") for file in tmp_path.iterdir())

    assert files() == 1
    light(facade(), system, cache)
    assert files() == 1
    light(replace(facade(), reflectance=0.9 * facade().reflectance), system, cache)
    light(facade(), system, cache, seed=1)
    assert files() == 3
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=512, patch_samples=256, subdivision=1, sun_points=64)
    matrices = phase_matrices(scene(facade()), few, cache=cache)
    with_reflected_sun(phase_light(matrices, [[system]], sunny().part(np.arange(2))))
    assert files() == 4


def test_a_byte_for_each_point_and_sun_holds_their_irradiance():
    """The share of the direct sun as a whole number, and others beside it: sums of 4e-6 at most apart."""
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints
    from mitsuba_cfs.trace.sun.sun_at_points import OTHER, SunAtPoints

    rng = np.random.default_rng(0)
    normal, suns = (rng.standard_normal((n, 3)) for n in (50, 400))
    normal, suns = (v / np.linalg.norm(v, axis=1)[:, None] for v in (normal, suns))
    suns[:40] -= (suns[:40] @ normal[0])[:, None] * normal[0] * (1 - 1e-3)  # about level with the first
    suns /= np.linalg.norm(suns, axis=1)[:, None]
    places = SurfacePoints(np.zeros((50, 3), np.float32), normal.astype(np.float32))
    share = rng.choice([0, 1, 8, -7], (50, 400)) + (rng.random((50, 400)) < 0.1) * rng.random((50, 400))
    irradiance = (np.maximum(normal @ suns.T, 0) * share).astype(np.float32)
    irradiance[0, :40] = rng.random(40)
    sun = SunAtPoints.of(irradiance, places, suns)
    assert 0.02 < np.mean(sun.share == OTHER) < 0.12
    whole = sun.light(places, suns)
    np.testing.assert_allclose(whole, irradiance, atol=2e-5)
    parts = [sun.light(places, suns, part) for part in (slice(0, 37), slice(37, 300), slice(300, 400))]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


def test_the_sunlit_surfaces_that_windows_see_come_from_the_cache(tmp_path, monkeypatch):
    """They belong to the room: windows that reflect with another system trace none of them."""
    from mitsuba_cfs.methods import phase_matrices as phases
    from mitsuba_cfs.methods.scene import Sampling

    few = Sampling(sensor_samples=512, patch_samples=4096, subdivision=1)

    def sunlit(cache: MatrixCache | None, **options):
        matrices = phases.phase_matrices(scene(facade()), replace(few, **options), needs=(), cache=cache)
        return phases.with_sunlit(matrices).sunlit

    fresh, cache = sunlit(None), MatrixCache(tmp_path)
    sunlit(cache)
    other = sunlit(cache, seed=1)
    monkeypatch.setattr(phases, "window_sunlit_shares", None)
    stored = sunlit(cache)
    assert fresh.share.nnz > 1000
    assert (stored.share != fresh.share).nnz == 0 and (other.share != fresh.share).nnz > 0
    rng = np.random.default_rng(2)
    cells, near = (rng.random((n, 3), dtype=np.float32) for n in (fresh.cells.size, fresh.places.size))
    np.testing.assert_array_equal(stored.rows(cells, near), fresh.rows(cells, near))
    np.testing.assert_array_equal(stored.cells.keys, fresh.cells.keys)
