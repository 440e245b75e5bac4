"""Speed of the BSDF plugins: eval, pdf and sample of random directions, in millions a second.

    python -m scenes.benchmarks.bsdf_plugin FILE.xml [...]

One unit is one `sample` and one `eval_pdf` of independent random directions, both hemispheres on
both sides, as a path tracer with light sampling asks for at every hit.  Compilation is not counted.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml

LANES, REPETITIONS = 1 << 21, 7


def rate(path: Path) -> tuple[float, float]:
    """Millions of units a second: the fastest and the median repetition."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf import plugin, tensor_plugin

    band = read_bsdf_xml(path).band("Visible")
    kind = plugin.PLUGIN if isinstance(band, KlemsBsdf) else tensor_plugin.PLUGIN
    bsdf, ctx = mi.load_dict({"type": kind, "filename": str(path)}), mi.BSDFContext()
    seconds = []
    for repetition in range(REPETITIONS + 1):
        random = mi.PCG32(LANES, repetition)
        u = [random.next_float32() for _ in range(7)]
        si = dr.zeros(mi.SurfaceInteraction3f, LANES)
        si.sh_frame = mi.Frame3f(mi.Vector3f(0, -1, 0))
        si.wi = mi.warp.square_to_uniform_sphere(mi.Point2f(u[0], u[1]))
        wo = mi.warp.square_to_uniform_sphere(mi.Point2f(u[2], u[3]))
        dr.eval(si, wo, u)
        dr.sync_thread()
        start = time.perf_counter()
        result = bsdf.sample(ctx, si, u[4], mi.Point2f(u[5], u[6])), bsdf.eval_pdf(ctx, si, wo)
        dr.eval(result)
        dr.sync_thread()
        seconds.append(time.perf_counter() - start)
    rates = LANES / np.array(seconds[1:]) / 1e6
    return float(rates.max()), float(np.median(rates))


def main() -> None:
    """Print the rates of the files of the command line."""
    print(f"variant {variants.activate()}")
    for name in sys.argv[1:]:
        best, median = rate(Path(name))
        print(f"{Path(name).name:40s} {best:6.2f} M/s best, {median:6.2f} M/s median")


if __name__ == "__main__":
    main()
