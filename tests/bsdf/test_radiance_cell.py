"""Cells of a Radiance scene traced to BSDFs, beside `rtrace` through the same cell repeated."""

from __future__ import annotations

import numpy as np
import pytest

from bim.radiance.cell import read_radiance_layer
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER
from tests.radiance import run

CAP = np.radians(9.0)  # of the first patch
SLAT = " polygon slat\n0\n0\n12 0 0 -.02  .05 0 -.02  .05 .012 -.002  0 .012 -.002\n"
SHEET = " polygon sheet\n0\n0\n12 0 0 0  .05 0 0  .05 .02 0  0 .02 0\n"
PERIOD = (0.05, 0.02)
PLASTIC = "void plastic a\n0\n0\n5 .6 .5 .4 0 0\n"
# two translucent pleats and the sheet between them: the shape of a cellular shade
CELLULAR = (
    "void trans a\n0\n0\n7 .7 .7 .7 0 0 .4 0\n"
    "a polygon p0\n0\n0\n12 0 0 -.004 .05 0 -.004 .05 .01 -.0001 0 .01 -.0001\n"
    "a polygon p1\n0\n0\n12 0 .01 -.0001 .05 .01 -.0001 .05 .02 -.004 0 .02 -.004\n"
    "a polygon p2\n0\n0\n12 0 0 -.016 .05 0 -.016 .05 .01 -.02 0 .01 -.02\n"
    "a polygon p3\n0\n0\n12 0 .01 -.02 .05 .01 -.02 .05 .02 -.016 0 .02 -.016\n"
    "a polygon p4\n0\n0\n12 0 1e-5 -.004 .05 1e-5 -.004 .05 1e-5 -.016 0 1e-5 -.016\n"
)
CELLS = {
    "cellular shade": CELLULAR,
    "trans with a straight part": "void trans a\n0\n0\n7 .8 .8 .8 0 0 .6 .5\na" + SHEET,
    "slats before glass": PLASTIC + "a" + SLAT + "void glass g\n0\n0\n3 .6 .6 .6\ng" + SHEET,
    "glass askew": "void glass g\n0\n0\n4 .8 .8 .8 1.6\ng" + SLAT,
    "metal": "void metal a\n0\n0\n5 .7 .7 .7 .6 .1\na" + SLAT,
    "mirror, alias and tube": "void mirror m\n0\n0\n3 .8 .8 .8\nvoid alias n m\nn"
    + SLAT
    + PLASTIC
    + "a tube t\n0\n0\n7 0 .016 -.01 .05 .016 -.01 .003\n",
    "xform and genbox": PLASTIC + "!genbox a b .05 .008 .002 | xform -rx 20 -t 0 .01 -.01\n",
    "pattern": "void brightfunc f\n2 .5 .\n0\n0\nf plastic a\n0\n0\n5 .8 .8 .8 0 0\na" + SLAT,
}


def traced_by_radiance(folder, seed: int = 1, rays: int = 60_000) -> tuple[float, float]:
    """Light passed inwards to the first patch from an even sky of 1, and its standard error."""
    (folder / "tile.rad").write_text(
        "!xform -a 21 -t .05 0 0 -a 41 -t 0 .02 0 cell.rad | xform -t -.5 -.4 0\n"
        "void glow sky\n0\n0\n4 1 1 1 0\nsky source outdoors\n0\n0\n4 0 0 -1 180\n"
    )
    u = np.random.default_rng(seed).uniform(size=(4, rays))
    sine = np.sin(CAP) * np.sqrt(u[0])
    towards = [sine * np.cos(2 * np.pi * u[1]), sine * np.sin(2 * np.pi * u[1]), -np.sqrt(1 - sine**2)]
    starts = [PERIOD[0] * u[2], PERIOD[1] * u[3], np.full(rays, 1e-3)]
    text = "\n".join(" ".join(f"{x:.8g}" for x in row) for row in np.stack([*starts, *towards], 1))
    command = (
        "oconv tile.rad > tile.oct && rtrace -h -ab 12 -ad 1 -as 0 -aa 0 -lw 1e-6 -lr -24 -ss 1 -st 0 -n 1 tile.oct"
    )
    out = np.array(run(command, folder, text.encode()).split(), dtype=float).reshape(-1, 3)
    values = out @ [0.265, 0.670, 0.065]
    return float(values.mean()), float(values.std() / np.sqrt(rays))


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_passes_what_rtrace_finds(variant, tmp_path, name):
    pytest.importorskip("pyradiance")
    (tmp_path / "cell.rad").write_text(CELLS[name])
    layer, notes = read_radiance_layer(tmp_path / "cell.rad", PERIOD)
    assert not notes  # the pattern is uniform
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=32_768).bsdf[0]
    share = float(bsdf.direct_hemispherical(bsdf.transmission_back)[0])
    expected, error = traced_by_radiance(tmp_path)
    print(f"{name}: {share:.4f}, rtrace {expected:.4f} +- {error:.4f}")
    # 4 sigma of rtrace and 0.002 of ours (32,768 paths)
    assert share == pytest.approx(expected, abs=4 * error + 0.004)
