"""Rooms lit through glass of other rooms: three phases against paths through all of them at once.

    python -m tests.validation inner_glass [--rooms 2 3] [--seeds N] [--paths N]

Rooms of 4 x 4 x 3 m one behind the other, the first 5 m long with a window of 3.0 x 1.8 m, glass of
3.2 x 2.3 m between two of them; an overcast sky of 20,000 lx.  Illuminance of five sensors of the
last room: Mitsuba's integrator `path` and Radiance's `rtrace` in all rooms at once, and mitsuba-cfs, each
the mean over seeds with its standard error.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.scene import AdjacentRoom, DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from tests.benchmarks.radiance import polygon, run, sensors_text, write_surfaces
from tests.validation.cut_groups import Quads, quad, surfaces

WIDTH, HEIGHT, FIRST, LENGTH = 4.0, 3.0, 5.0, 4.0  # of the rooms, the first one longer [m]
WINDOW = ((0.5, 3.5), (0.8, 2.6))  # in the front wall: across, up [m]
GLASS = ((0.4, 3.6), (0.3, 2.6))  # in each partition
TAU, INNER_TAU = 0.8, 0.7  # at every angle
SKY_LUX, GROUND = 2e4, 0.2
BEHIND = ((2.0, 0.5), (2.0, 1.2), (2.0, 2.0), (2.0, 3.0), (0.8, 1.5))  # across, from the glass [m]
UP = np.tile([0.0, 0.0, 1.0], (len(BEHIND), 1))
SAMPLING = Sampling(sensor_samples=32768, patch_samples=8192, subdivision=1)
# luminance (1 + 2 sin) / 3 of the zenith's, which gives 7 pi / 9 of it
SKY = "void brightfunc pattern\n2 level sky.cal\n0\n0\npattern glow sky\n0\n0\n4 1 1 1 0\n"
TRACE = "rtrace -h -I -faf -ab 12 -aa 0 -ad 16384 -as 0 -lr -20 -lw 1e-8 -u+ -n 2"


def walls_at(rooms: int) -> list[float]:
    """Where the front wall, the partitions and the back wall of so many rooms are [m]."""
    return [0.0, *(FIRST + LENGTH * i for i in range(rooms))]


def upright(y: float, place: tuple, *, north: bool) -> NDArray[np.float64]:
    """A rectangle across y, its normal to the north or to the south."""
    (x0, x1), (z0, z1) = place
    corners = (x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)
    return quad(*(corners[::-1] if north else corners))


def room(number: int, rooms: int) -> Quads:
    """Surfaces of a room, without the glass in its walls."""
    y0, y1 = walls_at(rooms)[number : number + 2]
    w, h = WIDTH, HEIGHT
    found = [
        (quad((0, y0, 0), (w, y0, 0), (w, y1, 0), (0, y1, 0)), 0.3),
        (quad((0, y0, h), (w, y0, h), (w, y1, h), (0, y1, h)), 0.8),
        (quad((0, y0, 0), (0, y1, 0), (0, y1, h), (0, y0, h)), 0.5),
        (quad((w, y0, 0), (w, y1, 0), (w, y1, h), (w, y0, h)), 0.5),
        *_around(y0, GLASS if number else WINDOW),
    ]
    if number < rooms - 1:
        return [*found, *_around(y1, GLASS)]
    return [*found, (upright(y1, ((0, w), (0, h)), north=True), 0.5)]


def _around(y: float, hole: tuple) -> Quads:
    """A wall across y with a hole."""
    (x0, x1), (z0, z1) = hole
    strips = (((0, WIDTH), (0, z0)), ((0, WIDTH), (z1, HEIGHT)), ((0, x0), (z0, z1)), ((x1, WIDTH), (z0, z1)))
    return [(upright(y, strip, north=True), 0.5) for strip in strips]


def sensors(rooms: int) -> NDArray[np.float64]:
    """Sensors [S, 3] of the last room."""
    return np.array([[x, walls_at(rooms)[-2] + y, 0.8] for x, y in BEHIND])


def group(number: int, rooms: int) -> WindowGroup:
    """The glass that lights a room, its normal to the south."""
    name, place = f"glass {number}", GLASS if number else WINDOW
    pane = upright(walls_at(rooms)[number], place, north=False)
    return WindowGroup(name, (WindowSurface(name, pane),))


def overcast() -> AnnualSky:
    """One hour; the ground reflects a fifth."""
    sky = cie_patches("overcast", ReinhartSky(1), SKY_LUX)[:, None]
    sky[0] = GROUND * SKY_LUX / np.pi
    return AnnualSky(sky, np.array([[0, -0.8, 0.6]]), np.zeros(1), np.arange(1), 1, 0 * sky)


def scene(rooms: int) -> DaylightScene:
    """The last room, those before it beyond its glass."""
    found, eye = None, np.eye(KLEMS_FULL.size)
    for number in range(rooms):
        last = number == rooms - 1
        taken = [] if last else [(upright(walls_at(rooms)[number + 1], GLASS, north=True), 0.0)]
        tau = INNER_TAU if number > 1 else TAU
        beyond = ()
        if found is not None:
            straight, glass = tau * np.ones(145), INNER_TAU * np.ones(145)
            beyond = (AdjacentRoom(found, (tau * eye,), (straight,), glass),)
        found = DaylightScene(
            surfaces([*room(number, rooms), *taken]),
            Surfaces.none(),
            [group(number, rooms)],
            *((sensors(rooms), UP) if last else ()),
            adjacent=beyond,
        )
    return found


def by_phases(rooms: int, seed: int = 0, sampling: Sampling = SAMPLING) -> NDArray[np.float64]:
    """Illuminance of the sensors [S] [lx] by this project's three phases."""
    traced = phase_matrices(scene(rooms), replace(sampling, seed=seed), five_phase=False)
    systems = [[MatrixOptics(INNER_TAU * np.eye(KLEMS_FULL.size))]]
    return illuminance(phase_light(traced, systems, overcast()))[:, 0]


def by_paths(rooms: int, samples: int, seed: int = 0) -> NDArray[np.float64]:
    """The same [S] by Mitsuba's integrator `path` in all rooms, panes as masks."""
    return illuminance_by_path(*whole_rooms(rooms), sensors(rooms), samples, seed=seed)


def whole_rooms(rooms: int) -> tuple[Quads, Quads]:
    """All rooms' surfaces with their reflectance, all panes with their transmittance."""
    opaque = [(triangles, rho) for i in range(rooms) for triangles, rho in room(i, rooms)]
    panes = [(group(i, rooms).windows[0].triangles, INNER_TAU if i else TAU) for i in range(rooms)]
    return opaque, panes


def illuminance_by_path(
    opaque: Quads, panes: Quads, points: NDArray[np.float64], samples: int, *, seed: int
) -> NDArray[np.float64]:
    """Illuminance [S] of sensors that look up under the overcast sky of patches.

    Args: opaque, panes: triangles with their reflectance, and with their transmittance.
    """
    whole, result = _mitsuba_scene(opaque, panes), []
    for number, point in enumerate(points):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * len(points) + number, samples)
        local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        seen = _radiance(whole, sampler, mi.Point3f(*map(float, point)), local)
        result.append(float(np.pi * dr.mean(seen).array[0]))
    return np.array(result)


def luminance_by_path(
    opaque: Quads, panes: Quads, eye: Sequence[float], ways: NDArray[np.float64], samples: int, *, seed: int = 0
) -> NDArray[np.float64]:
    """Luminance [n] [cd/m2] that an eye in the rooms sees along directions [n, 3], the same way."""
    whole, sampler = _mitsuba_scene(opaque, panes), mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(ways) * samples)
    directions = mi.Vector3f(np.repeat(ways, samples, axis=0).T.astype(np.float32))
    seen = _radiance(whole, sampler, mi.Point3f(*map(float, eye)), directions)
    return seen.numpy().reshape(len(ways), samples).mean(axis=1)


def _radiance(whole: mi.Scene, sampler: mi.Sampler, start: mi.Point3f, direction: mi.Vector3f) -> mi.Float:
    """What a path finds from a point along each direction."""
    integrator = mi.load_dict({"type": "path", "max_depth": 64, "rr_depth": 16})
    ray = mi.RayDifferential3f(mi.Ray3f(start, direction))
    return integrator.sample(whole, sampler, ray)[0].x


def _mitsuba_scene(opaque: Quads, panes: Quads):
    """Walls and panes under the sky of patches."""

    def shape(triangles: NDArray[np.float64], bsdf: dict):
        count = len(triangles)
        mesh = mi.Mesh("part", 3 * count, count)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(triangles.reshape(-1).astype(np.float32))
        parameters["faces"] = mi.UInt32(np.arange(3 * count, dtype=np.uint32))
        parameters.update()
        mesh.set_bsdf(mi.load_dict(bsdf))
        return mesh

    def grey(rho: float) -> dict:
        colour = {"type": "rgb", "value": [rho] * 3}
        return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": colour}}

    found = {}
    for i, (triangles, tau) in enumerate(panes):
        pane = {"type": "mask", "opacity": 1 - tau, "nested": grey(0.0)}
        found[f"glass {i}"] = shape(triangles, pane)
    for i, (triangles, rho) in enumerate(opaque):
        found[f"wall {i}"] = shape(triangles, grey(rho))
    v, u = (np.arange(512) + 0.5) / 512, (np.arange(1024) + 0.5) / 1024
    theta, phi = np.meshgrid(np.pi * v, 2 * np.pi * u, indexing="ij")
    # Mitsuba's map: up is y; turned so that up is z
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
    image = overcast().whole[ReinhartSky(1).index(np.stack([x, -z, y], axis=-1)), 0]
    found["sky"] = {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.repeat(image[..., None], 3, axis=-1).astype(np.float32)),
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
    }
    return mi.load_dict({"type": "scene", **found})


def by_radiance(rooms: int, folder: Path) -> NDArray[np.float64]:
    """The same [S] by `rtrace` in all rooms, panes as `trans`."""
    write_rooms(rooms, folder)
    return illuminance_by_rtrace(folder, sensors(rooms), UP)


def write_rooms(rooms: int, folder: Path) -> None:
    """All rooms and panes for Radiance: room.rad and panes.rad."""
    write_surfaces(surfaces([q for i in range(rooms) for q in room(i, rooms)]), folder / "room.rad")
    lines = []
    for number in range(rooms):
        tau = INNER_TAU if number else TAU
        # trans with all of it specular passes the same at every angle and reflects nothing
        lines.append(f"void trans pane{number}\n0\n0\n7 {tau} {tau} {tau} 0 0 1 1\n")
        for i, triangle in enumerate(group(number, rooms).windows[0].triangles):
            lines.append(polygon(f"pane{number}", f"pane{number}_{i}", triangle))
    (folder / "panes.rad").write_text("\n".join(lines))


def illuminance_by_rtrace(
    folder: Path, points: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Illuminance [S] of sensors under the overcast sky; other random numbers each time.

    Args: folder: its files room*.rad and panes.rad are the scene.
    """
    zenith, ground = 9 * SKY_LUX / (7 * np.pi), GROUND * SKY_LUX / np.pi
    level = f"level = if(Dz, {zenith:.9g} * (1 + 2*Dz)/3, {ground:.9g});\n"
    (folder / "sky.cal").write_text(level)
    (folder / "sky.rad").write_text(f"{SKY}sky source all\n0\n0\n4 0 0 1 360\n")
    run("oconv room*.rad panes.rad sky.rad > all.oct", folder)
    found = run(f"{TRACE} all.oct", folder, sensors_text(points, normals))
    return np.frombuffer(found, dtype="<f4").reshape(-1, 3)[:, 0].astype(float)


def pooled(runs: list[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean [S] of the runs and its relative standard error."""
    values = np.stack(runs)
    mean = values.mean(axis=0)
    return mean, values.std(axis=0, ddof=1) / np.sqrt(len(values)) / mean


def main(
    *, rooms: Sequence[int] = (2, 3), seeds: int = 4, paths: Annotated[int, "of a sensor for each seed"] = 1 << 19
) -> None:
    """Print the table."""
    variants.activate()
    print("| rooms | | 0.5 m | 1.2 m | 2.0 m | 3.0 m | aside |\n|---|---|---|---|---|---|---|")
    for count in rooms:
        _print(count, "paths", *pooled([by_paths(count, paths, s) for s in range(seeds)]))
        with tempfile.TemporaryDirectory() as folder:
            theirs = pooled([by_radiance(count, Path(folder)) for _ in range(seeds)])
        _print(count, "`rtrace`", *theirs)
        _print(count, "three-phase", *pooled([by_phases(count, s) for s in range(seeds)]))


def _print(rooms: int, who: str, mean: NDArray[np.float64], error: NDArray[np.float64]) -> None:
    cells = (f"{m:.1f} ({100 * e:.1f} %)" for m, e in zip(mean, error, strict=True))
    print(f"| {rooms} | {who} [lx] | {' | '.join(cells)} |", flush=True)
