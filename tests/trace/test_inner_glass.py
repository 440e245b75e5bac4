"""Light through glass between rooms, against Mitsuba's own path tracer in both rooms at once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

WIDTH, FRONT, BACK, HEIGHT = 4.0, 5.0, 9.0, 3.0  # two rooms one behind the other [m]
WINDOW = ((0.5, 3.5), (0.8, 2.6))  # in the front wall: across, up [m]
GLASS = ((0.4, 3.6), (0.3, 2.6))  # in the partition
TAU, INNER_TAU = 0.8, 0.7
POINTS = np.array([[2.0, y, 0.8] for y in (5.5, 6.2, 7.0, 8.0)] + [[0.8, 6.5, 0.8]])
UP = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
DIM = 50.0  # [lx] sensors below it count no relative error
Quads = list[tuple[NDArray[np.float64], float]]


def upright(y: float, place: tuple, *, north: bool) -> NDArray[np.float64]:
    """A rectangle across y, its normal to the north or to the south."""
    (x0, x1), (z0, z1) = place
    corners = (x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)
    return rooms.quad(*(corners[::-1] if north else corners))


def around(y: float, hole: tuple, rho: float) -> Quads:
    """A wall across y with a hole."""
    (x0, x1), (z0, z1) = hole
    strips = (
        ((0, WIDTH), (0, z0)), ((0, WIDTH), (z1, HEIGHT)), ((0, x0), (z0, z1)),
        ((x1, WIDTH), (z0, z1)),
    )  # fmt: skip
    return [(upright(y, strip, north=True), rho) for strip in strips]


def box(y0: float, y1: float) -> Quads:
    """Floor, ceiling and side walls of a room."""
    w, h = WIDTH, HEIGHT
    return [
        (rooms.quad((0, y0, 0), (w, y0, 0), (w, y1, 0), (0, y1, 0)), 0.3),
        (rooms.quad((0, y0, h), (w, y0, h), (w, y1, h), (0, y1, h)), 0.8),
        (rooms.quad((0, y0, 0), (0, y1, 0), (0, y1, h), (0, y0, h)), 0.5),
        (rooms.quad((w, y0, 0), (w, y1, 0), (w, y1, h), (w, y0, h)), 0.5),
    ]


def lit_room() -> Quads:
    """The room with the window, without its partition's glass."""
    return [*box(0, FRONT), *around(0, WINDOW, 0.5), *around(FRONT, GLASS, 0.5)]


def dark_room() -> Quads:
    """The room behind, the same way."""
    back = upright(BACK, ((0, WIDTH), (0, HEIGHT)), north=True)
    return [*box(FRONT, BACK), *around(FRONT, GLASS, 0.5), (back, 0.5)]


def group(name: str, y: float, place: tuple) -> WindowGroup:
    """A window whose normal points to the south."""
    return WindowGroup(name, (WindowSurface(name, upright(y, place, north=False)),))


def overcast() -> AnnualSky:
    """One hour of 20,000 lx; the ground reflects a fifth."""
    sky = cie_patches("overcast", ReinhartSky(1), 2e4)[:, None]
    sky[0] = 0.2 * 2e4 / np.pi
    return AnnualSky(sky, np.array([[0, -0.8, 0.6]]), np.zeros(1), np.arange(1), 1, 0 * sky)


def by_phases(sky: AnnualSky) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance of the dark room's sensors [S] [lx] and its relative standard error."""
    from mitsuba_cfs.methods.optics import GivenOptics
    from mitsuba_cfs.methods.phase_light import PhaseSystems
    from mitsuba_cfs.methods.phase_scene import PhaseScene
    from mitsuba_cfs.methods.sampling import Sampling
    from mitsuba_cfs.methods.scene import DaylightScene, RoomBeyond

    black = (upright(FRONT, GLASS, north=True), 0.0)
    lit = rooms.surfaces([*lit_room(), black])
    front = DaylightScene(lit, Surfaces.none(), [group("window", 0, WINDOW)])
    eye = np.eye(KLEMS_FULL.size)
    scene = DaylightScene(
        rooms.surfaces(dark_room()), Surfaces.none(), [group("glass", FRONT, GLASS)],
        POINTS, UP, beyond=(RoomBeyond(front, (TAU * eye,), INNER_TAU * np.ones(len(eye))),),
    )  # fmt: skip
    few = Sampling(sensor_samples=32768, patch_samples=8192, subdivision=1)
    traced = PhaseScene(scene, few, five_phase=False)
    light = PhaseSystems(traced, [[GivenOptics(INNER_TAU * eye)]]).light(sky)
    return light.illuminance()[:, 0], light.relative_error()


def by_paths(sky: AnnualSky, samples: int, seed: int = 0) -> NDArray[np.float64]:
    """The same [S] by Mitsuba's integrator `path` in both rooms, panes as masks."""
    import drjit as dr
    import mitsuba as mi

    def shape(triangles: NDArray[np.float64], bsdf: dict) -> dict:
        mesh = mi.Mesh("quad", 6, 2)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(triangles.reshape(-1).astype(np.float32))
        parameters["faces"] = mi.UInt32(np.arange(6, dtype=np.uint32))
        parameters.update()
        mesh.set_bsdf(mi.load_dict(bsdf))
        return mesh

    def grey(rho: float) -> dict:
        colour = {"type": "rgb", "value": [rho] * 3}
        return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": colour}}

    def pane(tau: float) -> dict:
        return {"type": "mask", "opacity": 1 - tau, "nested": grey(0.0)}

    found = {f"wall {i}": shape(q, grey(r)) for i, (q, r) in enumerate(lit_room() + dark_room())}
    found["window"] = shape(upright(0, WINDOW, north=False), pane(TAU))
    found["glass"] = shape(upright(FRONT, GLASS, north=False), pane(INNER_TAU))
    v, u = (np.arange(512) + 0.5) / 512, (np.arange(1024) + 0.5) / 1024
    theta, phi = np.meshgrid(np.pi * v, 2 * np.pi * u, indexing="ij")
    # Mitsuba's map: up is y; turned so that up is z
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
    direction = np.stack([x, -z, y], axis=-1)
    image = sky.whole[ReinhartSky(1).index(direction), 0]
    found["sky"] = {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.repeat(image[..., None], 3, axis=-1).astype(np.float32)),
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
    }
    scene = mi.load_dict({"type": "scene", **found})
    integrator = mi.load_dict({"type": "path", "max_depth": 64, "rr_depth": 16})
    result = []
    for number, point in enumerate(POINTS):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * len(POINTS) + number, samples)
        local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*map(float, point)), local))
        seen, _, _ = integrator.sample(scene, sampler, ray)
        result.append(float(np.pi * dr.mean(seen.x).array[0]))
    return np.array(result)


def test_straight_on_the_glass_has_what_the_window_before_it_has() -> None:
    """Both normal patches: nothing between, so the glass has T D of the window, and no more."""
    from mitsuba_cfs.trace.borrowed_daylight import borrowed_daylight
    from mitsuba_cfs.trace.estimate import Stopping

    wide = group("window", FRONT - 0.5, ((-3, 7), (-3, 6)))
    patches = np.arange(1.0, KLEMS_FULL.size + 1)[None, :, None]
    black = rooms.surfaces([(upright(FRONT, GLASS, north=True), 0.0)])
    found = borrowed_daylight(
        black, [wide], patches, [group("glass", FRONT, GLASS)], samples=64, stopping=Stopping(2)
    ).values[0, :, 0]
    # up to 60 degrees every ray meets the window, which has the same patches there
    near = KLEMS_FULL.centres()[0] < np.radians(60)
    np.testing.assert_allclose(found[near], patches[0, near, 0], rtol=1e-6)


@pytest.mark.slow
def test_a_dark_room_gets_the_light_of_the_room_before_it() -> None:
    """Paths see both rooms at once, and so the light that comes back; 3 % is the bar."""
    sky = overcast()
    found, error = by_phases(sky)
    paths = by_paths(sky, 1 << 21)
    print(found, error, paths, found / paths)
    bright = paths > DIM
    assert bright.sum() >= 3
    assert found[bright] == pytest.approx(paths[bright], rel=0.03)
