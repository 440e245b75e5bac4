"""Rooms whose windows do not see the same outdoors all over: phases, paths and Radiance.

    python -m tests.validation cut_groups

A room of 4 x 6 x 3 m, one window of 3 x 1.7 m to the south, its facade and what stands before it,
the CIE overcast sky.  In each case: illuminance of twelve sensors on the work plane by the
three-phase and the five-phase method over that by paths, with each group in one part and in as many
as it is cut into, and the processor time of both.  Below the overhangs of 1 and 3 m the same for
an open hole, over Radiance's `rtrace`.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.methods.light import illuminance, illuminance_with_error
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from tests.benchmarks.radiance import run, sensors_text, write_surfaces

W, D, H = 4.0, 6.0, 3.0  # of the room [m]
X0, X1, Z0, Z1 = 0.5, 3.5, 0.9, 2.6  # its window, in the wall y = 0
BRIGHT = 50.0  # [lx] sensors below this are not counted
POINTS = np.array([[x, y, 0.8] for y in (0.5, 1.0, 1.5, 2.5, 3.5, 5.0) for x in (0.6, 2.0)])
UP = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
PATHS = 262_144  # of a sensor
RADIANCE_RUNS = 4
Quads = list[tuple[NDArray[np.float64], float]]


def quad(*corners: tuple[float, float, float]) -> NDArray[np.float64]:
    """Two triangles [2, 3, 3] of a quadrilateral."""
    a, b, c, d = corners
    return np.array([[a, b, c], [a, c, d]], dtype=float)


def front(a: float, b: float, c: float, d: float, reflectance: float) -> Quads:
    """The wall y = 0 from a to b and from c to d high, round the window."""
    strips = ((a, b, c, Z0), (a, b, Z1, d), (a, X0, Z0, Z1), (X1, b, Z0, Z1))
    return [(quad((p, 0, r), (q, 0, r), (q, 0, s), (p, 0, s)), reflectance) for p, q, r, s in strips]


def surfaces(quads: Quads) -> Surfaces:
    """Quadrilaterals with their reflectances."""
    triangles = np.concatenate([q for q, _ in quads])
    reflectance = np.repeat([r for _, r in quads], 2)
    return Surfaces(triangles, reflectance, np.repeat(np.arange(len(quads)), 2))


def room() -> tuple[Surfaces, WindowGroup]:
    """The room and its window."""
    quads = [
        (quad((0, 0, 0), (W, 0, 0), (W, D, 0), (0, D, 0)), 0.2),
        (quad((0, 0, H), (0, D, H), (W, D, H), (W, 0, H)), 0.7),
        (quad((0, D, 0), (W, D, 0), (W, D, H), (0, D, H)), 0.5),
        (quad((0, 0, 0), (0, D, 0), (0, D, H), (0, 0, H)), 0.5),
        (quad((W, 0, 0), (W, 0, H), (W, D, H), (W, D, 0)), 0.5),
        *front(0, W, 0, H, 0.5),
    ]
    glass = quad((X0, 0, Z0), (X1, 0, Z0), (X1, 0, Z1), (X0, 0, Z1))
    return surfaces(quads), WindowGroup("south", (WindowSurface("window", glass),))


def slab(depth: float) -> Quads:
    """An overhang of a depth, 0.2 m above the window."""
    return [(quad((-1, -depth, 2.8), (-1, 0, 2.8), (5, 0, 2.8), (5, -depth, 2.8)), 0.5)]


def wall(distance: float, height: float) -> Quads:
    """A neighbour."""
    x0, x1, y, low = -15, 19, -distance, -4
    return [(quad((x0, y, low), (x1, y, low), (x1, y, height), (x0, y, height)), 0.3)]


def courtyard() -> Quads:
    """Walls on three sides and the ground between them."""
    return [
        *wall(6, 6),
        (quad((-4, -6, -4), (-4, 0, -4), (-4, 0, 6), (-4, -6, 6)), 0.4),
        (quad((8, -6, -4), (8, 0, -4), (8, 0, 6), (8, -6, 6)), 0.4),
        (quad((-4, -6, -0.5), (8, -6, -0.5), (8, 0, -0.5), (-4, 0, -0.5)), 0.2),
    ]


def fins() -> Quads:
    """Four fins of 0.8 m, two of them across the window."""
    places = (0.2, 1.35, 2.65, 3.8)
    return [(quad((x, 0, 0), (x, -0.8, 0), (x, -0.8, 3), (x, 0, 3)), 0.5) for x in places]


CASES = {
    "overhang 0 m": [],
    "overhang 0.5 m": slab(0.5),
    "overhang 1 m": slab(1.0),
    "overhang 2 m": slab(2.0),
    "overhang 3 m": slab(3.0),
    "overhang 4 m": slab(4.0),
    "fins": fins(),
    "courtyard": courtyard(),
    "neighbour at 5 m": wall(5, 9),
}


def overcast() -> AnnualSky:
    """One hour without sun, 10,000 lx."""
    sky = cie_patches("overcast", ReinhartSky(4), 1e4)[:, None]
    return AnnualSky(sky, np.array([[0, -0.8, 0.6]]), np.zeros(1), np.arange(1), 1, np.zeros_like(sky))


def by_phases(
    scene: DaylightScene, bsdf: KlemsBsdf, parts: int, five_phase: bool
) -> tuple[NDArray[np.float64], float, int, float]:
    """Illuminance [S], largest stated error, parts, and processor time [s]."""
    start = time.process_time()
    traced = phase_matrices(scene, Sampling(window_parts=parts), five_phase=five_phase)
    light = phase_light(traced, [[BsdfOptics(bsdf)]], overcast())
    values = illuminance(light)[:, 0]
    seconds = time.process_time() - start
    return values, float(illuminance_with_error(light)[1].max()), len(traced.parts.groups), seconds


def by_radiance(scene: DaylightScene) -> NDArray[np.float64]:
    """Illuminance [runs, S] of an open hole by `rtrace`, on the same horizontal 10,000 lx."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_surfaces(scene.interior, folder / "room.rad")
        write_surfaces(scene.exterior, folder / "outdoors.rad")
        # luminance (1 + 2 sin) / 3 of the zenith's, which gives 7 pi / 9; the ground 0.2 of it / pi
        (folder / "sky.cal").write_text("level = if(Dz, (1 + 2*Dz)/3, 0.2*7/9);\n")
        (folder / "sky.rad").write_text(
            "void brightfunc pattern\n2 level sky.cal\n0\n0\npattern glow sky\n0\n0\n4 1 1 1 0\n"
            "sky source all\n0\n0\n4 0 0 1 360\n"
        )
        run("oconv room.rad outdoors.rad sky.rad > scene.oct", folder)
        sensors = (np.tile(a, (RADIANCE_RUNS, 1)) for a in (POINTS, UP))
        options = "-h -faf -I -ab 8 -ad 4096 -lw 1e-5 -aa 0 -as 0 -u+"
        out = run(f"rtrace {options} scene.oct", folder, sensors_text(*sensors))
    values = np.frombuffer(out, dtype=np.float32).reshape(-1, 3)[:, 0].astype(float)
    return values.reshape(RADIANCE_RUNS, -1) * 1e4 / (7 * np.pi / 9)


def hole() -> KlemsBsdf:
    """Nothing in the window."""
    block = np.diag(1 / KLEMS_FULL.projected_solid_angles())
    nothing = np.zeros_like(block)
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block, nothing, nothing)


def spread(found: NDArray[np.float64], expected: NDArray[np.float64]) -> str:
    """Lowest and highest quotient of the bright sensors."""
    quotient = (found / expected)[expected > BRIGHT]
    return f"{quotient.min():.3f} to {quotient.max():.3f}"


def compare(name: str, scene: DaylightScene, bsdf: KlemsBsdf, expected: NDArray) -> None:
    """One row: both methods in one part and in as many as it is cut into."""
    cells, times = [], []
    for parts in (1, 0):
        three, said, count, seconds = by_phases(scene, bsdf, parts, False)
        five, *_ = by_phases(scene, bsdf, parts, True)
        times.append(seconds)
        cells += [spread(three, expected), spread(five, expected), f"{100 * said:.1f} %"]
    print(f"| {name} | {' | '.join(cells)} | {count} | {times[1] / times[0]:.1f} |", flush=True)


def main() -> None:
    """Print the tables."""
    interior, group = room()
    glass = specular_klems(Glazing("double", 0.78, 0.14, 0.14), KLEMS_FULL)
    head = "| before the window | 3-phase, one part | 5-phase, one part | said | 3-phase | 5-phase"
    print(head + " | said | parts | time, times |\n|---|---|---|---|---|---|---|---|---|")
    compiled = False
    for name, quads in CASES.items():
        outside = surfaces(quads + front(-15, 19, -4, 6, 0.4)) if quads else Surfaces.none()
        scene = DaylightScene(interior, outside, [group], POINTS, UP)
        if not compiled:  # kernels are compiled once
            for parts in (1, 0):
                by_phases(DaylightScene(interior, surfaces(fins()), [group], POINTS, UP), glass, parts, True)
            compiled = True
        sampling = Sampling(hour_samples=PATHS)
        paths = PathLight(scene, [[BsdfOptics(glass)]], overcast(), sampling)
        compare(name, scene, glass, illuminance(paths)[:, 0])
    for depth in (1.0, 3.0):
        outside = surfaces(slab(depth) + front(-15, 19, -4, 6, 0.4))
        scene = DaylightScene(interior, outside, [group], POINTS, UP)
        values = by_radiance(scene)
        error = (values.std(axis=0, ddof=1) / np.sqrt(RADIANCE_RUNS) / values.mean(axis=0)).max()
        print(f"rtrace, its own error at most {100 * error:.1f} %")
        compare(f"overhang {depth:g} m, a hole, over rtrace", scene, hole(), values.mean(axis=0))


if __name__ == "__main__":
    main()
