"""Five phases of clear glass against paths, and many states of many window groups."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.klems_peak import held_beams
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
OMEGA = KLEMS_FULL.projected_solid_angles()
POINTS = np.array([[1.8, 1.0, 0.8], [1.8, 0.3, 0.8], [1.0, 3.0, 0.8]])
UP = np.tile([0.0, 0.0, 1.0], (3, 1))


def glass_transmittance(cosine):
    """Of clear glass: it falls fast at grazing incidence, as 1 - (1 - cos)^5 does."""
    return 0.6 * (1 - (1 - np.clip(cosine, 0, 1)) ** 5)


def glass():
    """T and the sun's way of glass that a file knows at the middles of its patches."""
    from mitsuba_cfs.methods.optics import GivenOptics
    from mitsuba_cfs.trace.direct_sun import KlemsScattering

    tau = glass_transmittance(KLEMS_FULL.incident_directions()[:, 2])
    return GivenOptics(np.diag(tau), KlemsScattering(KLEMS_FULL, np.zeros((K, K)), tau))


def between_the_rings(cosine):
    """What the glass's file says at an angle of incidence."""
    theta, _ = KLEMS_FULL.centres()
    rings = np.append(theta[KLEMS_FULL.ring_starts], np.pi / 2)
    return np.interp(
        np.arccos(cosine), rings, np.append(glass_transmittance(np.cos(rings[:-1])), 0)
    )


def diffuser(tau: float):
    from mitsuba_cfs.methods.optics import GivenOptics
    from mitsuba_cfs.trace.direct_sun import KlemsScattering

    block = np.full((K, K), tau / np.pi)
    return GivenOptics(block * OMEGA, KlemsScattering(KLEMS_FULL, block, np.zeros(K)))


def traced(interior, exterior, groups, points, **sampling):
    """The matrices of a room, none of them traced yet."""
    from mitsuba_cfs.methods.phase_scene import PhaseScene
    from mitsuba_cfs.methods.sampling import Sampling
    from mitsuba_cfs.methods.scene import DaylightScene

    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    scene = DaylightScene(interior, exterior, groups, points, up)
    return PhaseScene(scene, Sampling(patch_samples=4096, **sampling))


def lit(matrices, systems, sky, state=None):
    """Illuminance [S, L] of a room with systems by group and state."""
    from mitsuba_cfs.methods.phase_light import PhaseSystems

    return PhaseSystems(matrices, systems).light(sky).illuminance(state)


def sun_series(sky: ReinhartSky, patches, diffuse: float = 0.0) -> AnnualSky:
    """Suns at the middles of patches, 1e5 lx each, and a uniform sky and ground [cd/m2]."""
    spread = np.zeros((sky.size, len(patches)))
    spread[patches, np.arange(len(patches))] = 1e5 / sky.solid_angles[patches]
    hours = np.arange(len(patches))
    towards, strength = sky.directions[patches], np.full(len(patches), 1e5)
    return AnnualSky(spread + diffuse, towards, strength, hours, len(patches), spread)


def suns_at(places, diffuse: float = 0.0):
    """The sky of MF:4, and suns of 1e5 lx at an incidence [deg] on the window and a height (z)."""
    sky = ReinhartSky(4)
    cosine = sky.directions @ [0, -1, 0]
    patches = [
        int(np.argmin(np.hypot(cosine - np.cos(np.radians(angle)), sky.directions[:, 2] - z)))
        for angle, z in places
    ]
    return sky, sun_series(sky, patches, diffuse)


def test_the_beam_between_patches_is_linear_in_angle_and_that_of_the_patch_at_its_middle():
    import mitsuba as mi

    from mitsuba_cfs.trace.bins import DirectionBins

    bins, values = DirectionBins(KLEMS_FULL), np.random.default_rng(0).random(K)

    def at(theta, phi):
        sine = np.sin(theta)
        local = [sine * np.cos(phi), -sine * np.sin(phi), np.cos(theta)]  # incident azimuth
        return bins.between(mi.Float(values.astype(np.float32)), mi.Vector3f(*map(mi.Float, local)))

    theta, phi = KLEMS_FULL.centres()
    assert at(theta, phi).numpy() == pytest.approx(values, abs=2e-5)
    # between rings and azimuths by hand: 45 degrees lies midway between 40 and 50, each ring
    # (20 and 24 patches) at 3 / 4 of a step after its second patch
    starts, counts = KLEMS_FULL.ring_starts[4:6], (24, 24)
    place = 1.75
    turn = 2 * np.pi * place / 24
    rings = [0.25 * values[s + 1] + 0.75 * values[s + 2] for s in starts]
    assert KLEMS_FULL.phi_counts[4:6] == counts
    assert at(np.radians([45.0]), np.array([turn])).numpy() == pytest.approx(
        [np.mean(rings)], abs=2e-5
    )
    last = values[KLEMS_FULL.ring_starts[8]]
    assert at(np.radians([86.25]), np.zeros(1)).numpy() == pytest.approx([last / 2], abs=2e-5)
    # just before the first patch of a ring its neighbour is the last
    first, before = KLEMS_FULL.ring_starts[3], KLEMS_FULL.ring_starts[4] - 1
    found = at(np.radians([30.0]), np.array([-np.pi / 20])).numpy()
    assert found == pytest.approx([(values[first] + values[before]) / 2], abs=2e-5)


def test_glass_keeps_its_hemispherical_transmittance():
    import mitsuba as mi

    way = glass().scattering
    u = (np.arange(20000) + 0.5) / 20000  # cos^2, even in projected solid angle
    cosine = np.sqrt(u)
    local = mi.Vector3f(*(np.float32(v) for v in (np.sqrt(1 - u), 0 * u, cosine)))
    hemispherical = way.through(local).numpy().mean()
    of_file = (glass_transmittance(KLEMS_FULL.incident_directions()[:, 2]) * OMEGA).sum() / np.pi
    assert hemispherical == pytest.approx(of_file, rel=5e-3)
    assert hemispherical == pytest.approx(glass_transmittance(cosine).mean(), rel=1e-2)


def test_five_phases_of_clear_glass_have_the_suns_own_transmittance_all_through():
    """A glass that had the sun's transmittance in every patch gives the same, hour by hour."""
    from mitsuba_cfs.methods.optics import GivenOptics
    from mitsuba_cfs.trace.direct_sun import KlemsScattering

    wanted = [(62, 0.3), (66, 0.9), (74, 0.3), (77, 0.6), (84, 0.6)]
    _, sun = suns_at(wanted)
    room, groups = rooms.test_room()
    matrices = traced(room, rooms.NOTHING, groups, POINTS)
    found = lit(matrices, [[glass()]], sun)
    at_sun = between_the_rings(sun.direction @ [0, -1, 0])
    for h, tau in enumerate(at_sun):
        even = GivenOptics(
            tau * np.eye(K), KlemsScattering(KLEMS_FULL, np.zeros((K, K)), np.full(K, tau))
        )
        # between 82.5 and 90 degrees the even glass falls to 0, and so differs
        if wanted[h][0] < 82:
            alone = lit(matrices, [[even]], sun)[:, h]
            assert found[:, h] == pytest.approx(alone, rel=2e-3)
        assert np.all(found[:, h] > 0)


@pytest.mark.slow
def test_five_phases_of_clear_glass_are_never_five_per_cent_above_its_paths():
    """Suns in the middle of a ring and at its grazing end, on sensors in and beside their beam.

    Between the middles of rings the glass is taken for the chord of a convex curve: up to 12 % low,
    never high.  With one transmittance in a ring 86 degrees would be 60 % high.  Windows are black
    from the room on both sides.
    """
    from mitsuba_cfs.trace.estimate import Stopping
    from mitsuba_cfs.trace.lit_room import AngularBeam, LitRoom, PathOptics, Sky
    from mitsuba_cfs.trace.point_in_time import point_in_time

    diffuse = 300.0  # cd/m2 of a uniform sky and ground
    sky, sun = suns_at([(62, 0.3), (74, 0.9), (86, 0.3)], diffuse)
    room, groups = rooms.test_room()
    # one sun lights few patches, whose entries of V are known to some per cent only
    matrices = traced(room, rooms.NOTHING, groups, POINTS, sensor_samples=262_144)
    found = lit(matrices, [[glass()]], sun)
    beam = AngularBeam(glass_transmittance(np.linspace(0, 1, 128)))
    behind, luminance = (
        LitRoom(room, rooms.NOTHING, groups, [PathOptics(None, beam)]),
        1e5 / SUN_SOLID_ANGLE,
    )
    for h, direction in enumerate(sun.direction):
        paths = point_in_time(
            behind, Sky(np.full(sky.size, diffuse), direction, luminance), POINTS, UP,
            samples=8192, stopping=Stopping(batches=8),
        )  # fmt: skip
        ratio = found[:, h].sum() / paths.values.sum()
        noise = 5 * float(np.hypot.reduce(paths.standard_error)) / paths.values.sum()
        assert 0.85 < ratio < 1.05, (h, ratio, noise)
        assert np.all(found[:, h] > 0)


@pytest.fixture(scope="module")
def corner():
    """Two window groups below a shade, three sensors, three suns before one or both of them."""
    room, groups, shade = rooms.l_shaped_room()
    points = np.array([[2.0, 1.0, 0.8], [1.0, 4.5, 0.8], [5.0, 4.5, 0.8]])
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    sky = ReinhartSky(1)
    facing = np.stack([sky.directions @ group.frame[2] for group in groups])
    facing[:, np.abs(sky.directions[:, 2] - 0.4) > 0.2] = -1
    suns = [facing[0].argmax(), facing[1].argmax(), facing.min(axis=0).argmax()]
    return matrices, sun_series(sky, suns, 3000.0)


def test_each_group_has_a_state_of_its_own_in_each_hour(corner):
    """Every hour of a schedule is the room with these systems and no others."""
    matrices, sky = corner
    systems = [[glass(), diffuser(0.4)], [diffuser(0.2), glass()]]
    schedule = np.array([[0, 1, 1], [1, 1, 0]])
    found = lit(matrices, systems, sky, schedule)
    for h in range(3):
        now = [[systems[g][schedule[g, h]]] for g in range(2)]
        # C_ds' streams are keyed by the number of the sun: all three are traced in both
        assert found[:, h] == pytest.approx(lit(matrices, now, sky)[:, h], rel=1e-9)
    together = lit(matrices, systems, sky, np.array([1, 1, 1]))
    assert np.array_equal(together, lit(matrices, systems, sky, np.ones((2, 3), dtype=int)))
    with pytest.raises(ValueError, match=r"expected \[2, 3\]"):
        lit(matrices, systems, sky, np.zeros((3, 3), dtype=int))


def test_a_group_with_fewer_states_ends_with_its_last(corner):
    matrices, sky = corner
    systems = [[glass(), diffuser(0.4)], [diffuser(0.2)]]
    one, other = (lit(matrices, systems, sky, np.full(3, j)) for j in (0, 1))
    alone = lit(matrices, [[glass()], [diffuser(0.2)]], sky)
    assert one == pytest.approx(alone, rel=1e-9)
    assert not np.allclose(one, other, rtol=0.01)


def test_the_sum_of_the_groups_is_the_five_phase_sum(corner):
    """V T D s - V_d T D_d s_d - the reflected beam by patches + itself, straight views, C_ds s."""
    from mitsuba_cfs.methods.phase_light import PhaseSystems
    from mitsuba_cfs.trace.direct_sun import direct_sun_matrix, patch_beams, through_beams
    from mitsuba_cfs.trace.estimate import Stopping

    matrices, sky = corner
    scene, chosen = matrices.scene, [glass(), diffuser(0.4)]
    found = lit(matrices, [[one] for one in chosen], sky)
    t, ways = [c.transmission for c in chosen], [c.scattering for c in chosen]
    exact = direct_sun_matrix(
        scene.interior, scene.exterior, scene.groups, ways, scene.points, scene.normals,
        suns=sky.direction, window_points=256, stopping=Stopping(batches=4),
    )  # fmt: skip
    view, direct_view = matrices.sensors.values, matrices.direct_sensors
    expected = phases.three_phase(view, t, matrices.daylight.values, sky.whole)
    expected -= phases.three_phase(direct_view, t, matrices.direct_daylight, sky.sun)
    beams = patch_beams(ways, KLEMS_FULL)
    held = [held_beams(one, beam, KLEMS_FULL) for one, beam in zip(t, beams, strict=True)]
    assert np.array_equal(held[0], t[0])  # glass is a beam and nothing else
    at_sun = through_beams(scene.groups, ways, sky.direction)
    by_patch, _ = phases.sun_beams(held, at_sun, matrices.direct_daylight, sky.sun)
    filled = PhaseSystems(matrices, [[one] for one in chosen])
    straight, more = filled.straight, filled.reflected_sun.light(sky)
    expected -= np.einsum("sgk,gkh->sh", view - direct_view, by_patch)
    expected += more.sensors(0, 0, beam=True).values + more.sensors(1, 0, beam=False).values
    expected += straight.light(0, 0, sky)
    assert straight.matrix(1, 0) is None  # the diffuser has no beam
    expected += exact.values * sky.illuminance / SUN_SOLID_ANGLE
    assert found == pytest.approx(expected, rel=1e-5)  # window luminances in single precision


def test_a_beam_that_lies_beside_the_diagonal_too_is_not_counted_twice(corner):
    """As a tensor tree's, whose cells lie across patches: eyes behind one had 14 % too much."""
    from mitsuba_cfs.methods.optics import GivenOptics
    from mitsuba_cfs.methods.phase_light import PhaseSystems

    matrices, clear = corner[0], glass()
    spread = 0.8 * clear.transmission + 0.2 * np.roll(clear.transmission, 1, axis=0)
    beside = GivenOptics(spread, clear.scattering)
    found = [PhaseSystems(matrices, [[one], [diffuser(0.2)]]).straight for one in (clear, beside)]
    assert found[0].beam(0, 0).any() and not found[1].beam(0, 0).any()


def test_what_t_has_of_a_beam_beside_the_diagonal_is_taken_with_it():
    clear = glass_transmittance(KLEMS_FULL.incident_directions()[:, 2])
    scattered = np.full((K, K), 0.05 / np.pi) * OMEGA
    near = KLEMS_FULL.outgoing_directions() @ KLEMS_FULL.outgoing_directions().T
    beside = np.argsort(-near, axis=0)[1]  # the patch next to each
    T, beam = scattered.copy(), 0.9 * clear
    T[np.arange(K), np.arange(K)] += 0.7 * beam
    T[beside, np.arange(K)] += 0.3 * beam * OMEGA / OMEGA[beside]
    held = held_beams(T, beam, KLEMS_FULL)
    assert OMEGA @ held / OMEGA == pytest.approx(beam, rel=1e-9)  # all of its light
    assert np.all(held <= T + 1e-12) and np.all(held >= 0)
    assert held[near < np.cos(np.radians(40))].max() == 0
    diagonal = held_beams(scattered + np.diag(beam), beam, KLEMS_FULL)
    assert diagonal == pytest.approx(np.diag(beam), abs=1e-12)


def test_the_room_has_a_beam_once_wherever_t_has_it(corner):
    """T of a tensor tree has a part of its beam beside the diagonal: the room reflects it once."""
    from mitsuba_cfs.methods.optics import GivenOptics

    clear, sky = glass(), replace(corner[1], whole=corner[1].sun)
    room, groups = rooms.test_room()
    scene = traced(room, rooms.NOTHING, groups, POINTS, subdivision=1)
    ways = KLEMS_FULL.outgoing_directions()
    beside = np.argsort(-(ways @ ways.T), axis=0)[1]
    spread = 0.6 * clear.transmission
    spread[beside, np.arange(K)] += 0.4 * np.diag(clear.transmission) * OMEGA / OMEGA[beside]
    tree = GivenOptics(spread, clear.scattering)
    found, expected = (lit(scene, [[one]], sky) for one in (tree, clear))
    assert expected[:, [0, 2]].min() > 500  # the second sun is behind the facade
    assert found == pytest.approx(expected, rel=1e-3)


def test_the_suns_light_by_group_adds_up_to_that_of_the_room(corner):
    from mitsuba_cfs.trace.direct_sun import direct_sun_matrix
    from mitsuba_cfs.trace.estimate import Stopping

    matrices, sky = corner
    scene, ways = matrices.scene, [diffuser(0.2).scattering, diffuser(0.4).scattering]
    around = scene.interior, scene.exterior, scene.groups, ways, scene.points, scene.normals
    both, each = (
        direct_sun_matrix(*around, suns=sky.direction, stopping=Stopping(batches=4), by_group=by)
        for by in (False, True)
    )
    assert each.values.shape == (2, 3, 3) and np.all(each.values.max(axis=(1, 2)) > 0)
    assert each.values.sum(axis=0) == pytest.approx(both.values, rel=1e-5)
    alone = direct_sun_matrix(
        scene.interior, scene.exterior, scene.groups, [ways[0], None], scene.points,
        scene.normals, suns=sky.direction, stopping=Stopping(batches=4),
    )  # fmt: skip
    assert each.values[0] == pytest.approx(alone.values, rel=1e-6)


def mirror_glass(back: float):
    """Glass of 0.7 whose room side is a mirror, by phases and by paths."""
    from mitsuba_cfs.bsdf.klems import KlemsBsdf
    from mitsuba_cfs.methods.optics import BsdfOptics

    through, mirror = np.diag(0.7 / OMEGA), np.diag(back / OMEGA)
    return BsdfOptics(KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, np.zeros((K, K)), mirror))


def angular_glass(back: float):
    """A transmittance of 0.55 by AngularOptics; half of its reflection is a mirror's."""
    from mitsuba_cfs.methods.optics import AngularOptics

    half = np.full(64, back / 2)
    return AngularOptics(np.full(64, 0.55), mirrored=half, reflected=half)


@pytest.mark.parametrize("kind", [mirror_glass, angular_glass])
def test_windows_reflect_the_light_of_the_room_as_paths_have_it(kind):
    """A bright room with a front of glass that reflects 0.4 to it: a tenth of the back's light."""
    from mitsuba_cfs.methods.path_light import PathSystems
    from mitsuba_cfs.methods.phase_light import PhaseSystems
    from mitsuba_cfs.methods.phase_scene import PhaseScene
    from mitsuba_cfs.methods.sampling import Sampling
    from mitsuba_cfs.methods.scene import DaylightScene
    from mitsuba_cfs.surfaces import WindowGroup, WindowSurface

    w, d, h = 4.0, 5.0, 3.0
    quads = [
        rooms.quad((0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0)),
        rooms.quad((0, 0, h), (0, d, h), (w, d, h), (w, 0, h)),
        rooms.quad((0, d, 0), (w, d, 0), (w, d, h), (0, d, h)),
        rooms.quad((0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h)),
        rooms.quad((w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0)),
    ]
    front = rooms.quad((0, 0, 0), (w, 0, 0), (w, 0, h), (0, 0, h))
    groups = [WindowGroup("south", (WindowSurface("front", front),))]
    points = np.array([[2.0, 1.0, 0.8], [2.0, 4.5, 0.8], [2.0, 4.9, 1.5]])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    interior = rooms.surfaces([(q, 0.7) for q in quads])
    scene = DaylightScene(interior, rooms.NOTHING, groups, points, normals)
    sky = ReinhartSky(1)
    whole = np.full((sky.size, 1), 3000.0)
    whole[0] = 600.0
    hours = AnnualSky(
        whole, np.array([[0, -0.8, 0.6]]), np.zeros(1), np.arange(1), 1, np.zeros_like(whole)
    )
    few = Sampling(sensor_samples=65_536, patch_samples=8_192, hour_samples=262_144, subdivision=1)
    found = {}
    for back in (0.0, 0.4):
        system = [[kind(back)]]
        paths = PathSystems(scene, system, few).light(hours).illuminance()
        for five in (False, True):
            light = PhaseSystems(PhaseScene(scene, few, five_phase=five), system).light(hours)
            lit_by_phases = light.illuminance()
            print(back, five, (lit_by_phases / paths).ravel(), light.relative_error())
            # three errors of both, and a tenth of the gain: W is a mean over the whole front
            np.testing.assert_allclose(lit_by_phases, paths, rtol=0.022 if back else 0.015)
            factor = light.filled.coefficients() @ whole
            np.testing.assert_allclose(factor, lit_by_phases, rtol=1e-5)
        found[back] = lit_by_phases
    gain = found[0.4] / found[0.0] - 1
    print("gain by reflection", gain.ravel())
    assert gain[1] > 0.1  # far above the tolerance: black windows would not pass


@pytest.mark.parametrize("lit", [1.0, 0.02])
def test_product_with_the_sun_alone_is_that_with_any_sky(lit):
    random = np.random.default_rng(1)
    matrix = random.random((2, 7, 40)).astype(np.float32)
    sky = (random.random((40, 50)) * (random.random((40, 50)) < lit)).astype(np.float32)
    sky[3, 10] = 1.0
    found = phases.times_sky(matrix, sky)
    assert found.dtype == np.float32 and found.flags.c_contiguous
    np.testing.assert_allclose(found, np.matmul(matrix, sky), rtol=1e-5, atol=1e-6)
