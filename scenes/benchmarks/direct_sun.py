"""Direct sun through the blind at the room's sensors (C_ds) against rcontrib."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces
from scenes.benchmarks import radiance, room
from scenes.benchmarks.annual_product import SYSTEM
from scenes.benchmarks.harness import THREADS, Comparison, Run, rms_error, timed

SUBDIVISION = 4  # the suns stand at the middles of its patches
SPACING = 1.0  # [m] 4 x 5 sensors: rcontrib takes minutes for more
DIVISIONS = 2048
# rcontrib leaves out a source whose solid angle times the BSDF is below 1e-6 (FTINY), as behind a
# blind that scatters; it aims at a source's middle only, so a wider one scaled down is its best
WIDTH_DEG = 5.33
BATCHES, POINTS = 8, 64  # ours: batches, and points on the window in each
REFERENCE_BATCHES, REFERENCE_POINTS = 64, 512
COMMAND = (
    f"rcontrib -I+ -ab 1 -ad {DIVISIONS} -lw 1e-6 -dc 1 -dt 0 -dj 0 -n {THREADS} -V- -faf "
    f"-e MF:{SUBDIVISION} -f reinhart.cal -b rbin -bn Nrbins -m solar scene.oct"
)


def suns() -> NDArray[np.float64]:
    """Directions [Q, 3] to the middles of the sky's patches."""
    return ReinhartSky(SUBDIVISION).directions[1:]


def black_room() -> Surfaces:
    """The room's faces without reflection: C_ds has none."""
    faces = room.room()
    return Surfaces(faces.triangles, np.zeros_like(faces.reflectance), faces.surface)


def ours(points: int, batches: int = BATCHES, seed: int = 1) -> NDArray[np.float64]:
    """Our C_ds [S, Q] in lux per unit of a disc's luminance."""
    from mitsuba_cfs.trace.direct_sun import KlemsScattering, direct_sun_matrix
    from mitsuba_cfs.trace.estimate import Stopping

    block = read_bsdf_xml(SYSTEM).band("Visible").filled().transmission_front
    whole = KlemsScattering(KLEMS_FULL, block, np.zeros(KLEMS_FULL.size))  # as rcontrib: no peak
    return direct_sun_matrix(
        black_room(),
        room.NOTHING,
        room.window_groups(),
        [whole],
        *room.sensors(SPACING),
        suns(),
        window_points=points,
        stopping=Stopping(batches=batches),
        seed=seed,
    ).values


@cache
def reference() -> NDArray[np.float64]:
    """The converged matrix: ours with another seed and sixty-four times the points."""
    return ours(REFERENCE_POINTS, REFERENCE_BATCHES, seed=1_000)


def write_scene(folder: Path) -> None:
    """The room, the window with its BSDF, and the suns, as an octree."""
    radiance.write_surfaces(black_room(), folder / "room.rad")
    (folder / SYSTEM.name).write_bytes(SYSTEM.read_bytes())
    lines = [f"void BSDF blind\n6 0 {SYSTEM.name} 0 0 1 .\n0\n0\n"]
    window = room.window_groups()[0].windows[0]
    for i, triangle in enumerate(window.triangles):
        lines.append(radiance.polygon("blind", f"window{i}", triangle[::-1]))
    (folder / "window.rad").write_text("\n".join(lines))
    lines = ["void light solar\n0\n0\n3 1e6 1e6 1e6\n"]
    for i, (x, y, z) in enumerate(suns()):
        lines.append(f"solar source sun{i}\n0\n0\n4 {x:.9g} {y:.9g} {z:.9g} {WIDTH_DEG}\n")
    (folder / "suns.rad").write_text("\n".join(lines))
    radiance.run("oconv room.rad window.rad suns.rad > scene.oct", folder)


def theirs(folder: Path) -> NDArray[np.float64]:
    """Radiance's C_ds [S, Q], of wider discs and scaled to the sun's solid angle."""
    from mitsuba_cfs.trace.direct_sun import SUN_SOLID_ANGLE

    points, directions = room.sensors(SPACING)
    command = COMMAND.replace(" scene.oct", f" -y {len(points)} scene.oct")
    out = radiance.run(command, folder, radiance.sensors_text(points, directions))
    wide = 2 * np.pi * (1 - np.cos(np.radians(WIDTH_DEG / 2)))
    return radiance.read_float_matrix(out)[:, 1:] * (SUN_SOLID_ANGLE / wide)


def compare(name: str, progress: Progress) -> Comparison:
    """Both programs' time and error of C_ds."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    found, seconds, processor = timed(lambda: ours(POINTS), repeat=3)
    progress(name, 0.2)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_scene(folder)
        peer, peer_seconds, peer_processor = timed(lambda: theirs(folder), repeat=1, warm=False)
    progress(name, 0.6)
    truth = reference()
    progress(name, 1.0)
    call = f"direct_sun_matrix(window_points={POINTS}, stopping=Stopping(batches={BATCHES}))"
    total = peer.sum() / truth.sum()
    return Comparison(
        name,
        f"C_ds of {found.shape[0]} sensors, {found.shape[1]} suns, Klems blind [sr]",
        Run("mitsuba-cfs", call, seconds, processor, rms_error(found, truth)),
        Run("Radiance", COMMAND, peer_seconds, peer_processor, rms_error(peer, truth)),
        note=f"Radiance's total over the reference's {total:.4f}",
    )


BENCHMARKS = {"direct-sun": lambda progress: compare("direct-sun", progress)}
