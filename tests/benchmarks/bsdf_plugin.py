"""The BSDF plugins at work: sample, eval and pdf of random directions, against Radiance's library.

One unit of ours is one `sample` and one `eval_pdf` of independent random directions, both
hemispheres on both sides, as a path tracer with light sampling asks for at every hit.  One unit of
Radiance's is one drawn sample with its value, of 256 for each incident direction, which its
library prepares once: less work than ours.  It runs in as many processes as ours has threads.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.bsdf_file import Bsdf, BsdfFile
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.progress import Progress
from tests.benchmarks import bsdf_generate, bsdf_tree, radiance
from tests.benchmarks.harness import THREADS, Comparison, PeerFailed, Run, timed

UNITS = 1 << 21
DRAWN, DIRECTIONS = 256, 256  # Radiance's: samples of each of so many incident directions
TREE_LEVELS, TREE_PATHS = 6, 256
PEER = """
import os, sys, time
import numpy as np
from pyradiance import bsdf
data = bsdf.load_file(sys.argv[1])
count, drawn = map(int, sys.argv[2:4])
angles = np.random.default_rng(int(sys.argv[4])).uniform([0, 0], [180, 360], (count, 2)).tolist()
start = time.perf_counter(), time.process_time()
for theta, phi in angles:
    bsdf.sample(data, theta, phi, drawn, 15)
print(time.perf_counter() - start[0], time.process_time() - start[1], flush=True)
os._exit(0)  # the library's own clean-up may crash
"""


def work(bsdf: Bsdf):
    """A function that does `UNITS` units with the plugin of `bsdf`, compiled once."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin
    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    make = klems_plugin if isinstance(bsdf, KlemsBsdf) else tensor_tree_plugin
    plugin, ctx = mi.load_dict(make(bsdf)), mi.BSDFContext()
    random = mi.PCG32(UNITS)
    u = [random.next_float32() for _ in range(7)]
    si = dr.zeros(mi.SurfaceInteraction3f, UNITS)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, -1, 0))
    si.wi = mi.warp.square_to_uniform_sphere(mi.Point2f(u[0], u[1]))
    wo = mi.warp.square_to_uniform_sphere(mi.Point2f(u[2], u[3]))
    dr.eval(si, wo, u)
    dr.sync_thread()

    def once():
        drawn = plugin.sample(ctx, si, u[4], mi.Point2f(u[5], u[6]))
        dr.eval(drawn, plugin.eval_pdf(ctx, si, wo))
        dr.sync_thread()

    return once


def theirs(path: Path) -> tuple[float, float]:
    """Radiance's elapsed and processor seconds for `UNITS` units, from fewer of them."""
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", PEER, str(path), str(DIRECTIONS), str(DRAWN), str(seed)],
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in range(THREADS)
    ]
    answers = [process.communicate()[0] for process in processes]
    if any(process.returncode for process in processes):
        raise PeerFailed("pyradiance.bsdf ended with an error")
    # the processor time is the process': elapsed seconds have the other work on the machine too
    elapsed, processor = zip(*(map(float, answer.split()) for answer in answers), strict=True)
    share = UNITS / (THREADS * DIRECTIONS * DRAWN)
    return max(elapsed) * share, sum(processor) * share


def compare(name: str, progress: Progress, bsdf: Bsdf, of: str) -> Comparison:
    """Both programs' time for `UNITS` units; both draw exactly, so no error tells them apart."""
    radiance.environment()
    variants.activate()
    progress(name, 0.4)
    _, seconds, processor = timed(work(bsdf), repeat=9)
    progress(name, 0.5)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bsdf.xml"
        write_bsdf_xml(BsdfFile({"Visible": bsdf}), path)
        peer_seconds, peer_processor = theirs(path)
    progress(name, 1.0)
    return Comparison(
        name,
        f"{UNITS} times sample, eval and pdf of {of}",
        Run("mitsuba-cfs", "plugin.sample, plugin.eval_pdf", seconds, processor),
        Run("Radiance", f"{THREADS} x pyradiance.bsdf.sample", peer_seconds, peer_processor),
        note=f"mitsuba-cfs {UNITS / seconds / 1e6:.1f} million a second",
    )


def klems(progress: Progress) -> Comparison:
    """The blind on the Klems full basis."""
    return compare("bsdf-plugin-klems", progress, bsdf_generate.ours(2048), "Klems full matrices")


def tree(progress: Progress) -> Comparison:
    """The blind as a tree of 4096 x 4096 cells a block, 90 % and more of them merged away."""
    progress("bsdf-plugin-tree", 0.0)
    bsdf = bsdf_tree.ours(TREE_PATHS, levels=TREE_LEVELS)
    leaves = sum(len(block.values) for block in bsdf.blocks().values())
    of = f"a tensor tree of 4^{TREE_LEVELS} cells a hemisphere, {leaves} leaves"
    return compare("bsdf-plugin-tree", progress, bsdf, of)


BENCHMARKS = {"bsdf-plugin-klems": klems, "bsdf-plugin-tree": tree}
