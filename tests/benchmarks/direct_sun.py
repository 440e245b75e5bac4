"""Direct sun through the blind at the room's sensors (C_ds) against rcontrib."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_tensor_tree
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces
from scenes.cost import room
from tests.benchmarks import radiance
from tests.benchmarks.annual_product import SYSTEM
from tests.benchmarks.harness import THREADS, Comparison, Run, rms_error, timed

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


TREE_LEVELS = 4  # 256 cells a hemisphere
TREE_FILE = "tree.xml"


@dataclass(frozen=True)
class Blind:
    """A blind by its BSDF file, which both programs read."""

    name: str
    write: Callable[[Path], None]  # into a folder
    scattering: Callable[[], object]  # ours, as rcontrib takes it: no peak kept apart


def klems_blind() -> Blind:
    """The demo's blind and glazing, by Klems matrices."""

    def scattering():
        from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

        block = read_bsdf_xml(SYSTEM).band("Visible").filled().transmission_front
        return KlemsScattering(KLEMS_FULL, block, np.zeros(KLEMS_FULL.size))

    return Blind(SYSTEM.name, lambda f: (f / SYSTEM.name).write_bytes(SYSTEM.read_bytes()), scattering)


def tree_blind() -> Blind:
    """The slats of the demo's blind without glazing, traced to a tensor tree."""
    variants.activate()
    layer = venetian_blind(plastic("slat", 0.55), depth=0.080, radius=0.104, spacing=0.072, tilt=np.radians(45.0))
    (tree,), _ = generate_tensor_tree(layer, TREE_LEVELS, samples=4096, seed=1)

    def scattering():
        import mitsuba as mi

        from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
        from mitsuba_cfs.trace.kernels.scattering import PluginScattering

        return PluginScattering(mi.load_dict(tensor_tree_plugin(tree, up=(0, 1, 0))))

    file = BsdfFile(name="slats", bands={"Visible": tree})
    return Blind(TREE_FILE, lambda f: write_bsdf_xml(file, f / TREE_FILE), scattering)


def suns() -> NDArray[np.float64]:
    """Directions [Q, 3] to the middles of the sky's patches."""
    return ReinhartSky(SUBDIVISION).directions[1:]


def black_room() -> Surfaces:
    """The room's faces without reflection: C_ds has none."""
    faces = room.room()
    return Surfaces(faces.triangles, np.zeros_like(faces.reflectance), faces.surface)


def ours(blind: Blind, points: int, batches: int = BATCHES, seed: int = 1) -> NDArray[np.float64]:
    """Our C_ds [S, Q] in lux per unit of a disc's luminance."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    return direct_sun_matrix(
        black_room(),
        room.NOTHING,
        room.window_groups(),
        [blind.scattering()],
        *room.sensors(SPACING),
        suns=suns(),
        window_points=points,
        stopping=Stopping(batches=batches),
        seed=seed,
    ).values


def write_scene(blind: Blind, folder: Path) -> None:
    """The room, the window with its BSDF, and the suns, as an octree."""
    radiance.write_surfaces(black_room(), folder / "room.rad")
    blind.write(folder)
    lines = [f"void BSDF blind\n6 0 {blind.name} 0 0 1 .\n0\n0\n"]
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
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    points, directions = room.sensors(SPACING)
    command = COMMAND.replace(" scene.oct", f" -y {len(points)} scene.oct")
    out = radiance.run(command, folder, radiance.sensors_text(points, directions))
    wide = 2 * np.pi * (1 - np.cos(np.radians(WIDTH_DEG / 2)))
    return radiance.read_float_matrix(out)[:, 1:] * (SUN_SOLID_ANGLE / wide)


def compare(name: str, kind: Callable[[], Blind], progress: Progress) -> Comparison:
    """Both programs' time and error of C_ds; the truth is ours by 64 times the points."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    blind = kind()
    found, seconds, processor = timed(lambda: ours(blind, POINTS), repeat=3)
    progress(name, 0.2)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_scene(blind, folder)
        peer, peer_seconds, peer_processor = timed(lambda: theirs(folder), repeat=1, warm=False)
    progress(name, 0.6)
    truth = ours(blind, REFERENCE_POINTS, REFERENCE_BATCHES, seed=1_000)
    progress(name, 1.0)
    call = f"direct_sun_matrix(window_points={POINTS}, stopping=Stopping(batches={BATCHES}))"
    total = peer.sum() / truth.sum()
    return Comparison(
        name,
        f"C_ds of {found.shape[0]} sensors, {found.shape[1]} suns, {blind.name} [sr]",
        Run("mitsuba-cfs", call, seconds, processor, rms_error(found, truth)),
        Run("Radiance", COMMAND, peer_seconds, peer_processor, rms_error(peer, truth)),
        note=f"Radiance's total over the reference's {total:.4f}",
    )


BENCHMARKS = {
    "direct-sun": lambda progress: compare("direct-sun", klems_blind, progress),
    "direct-sun-tree": lambda progress: compare("direct-sun-tree", tree_blind, progress),
}
