"""Traces the reference blind with Radiance: python make.py TILT_DEG SAMPLES (minutes)."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from pyradiance import genbsdf

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from tests.bsdf.radiance_cells import write_radiance

SPACING, ROWS = 0.072, 101
MATERIAL = plastic("grey", 0.55, specular=0.01, roughness=0.06)


def main(tilt_deg: float, samples: int) -> None:
    """Trace one cell in the middle of 101 slats 8 m wide."""
    layer = venetian_blind(MATERIAL, depth=0.08, radius=0.104, spacing=SPACING, tilt=np.radians(tilt_deg), width=8.0)
    write_radiance(layer, "blind.rad", 1, ROWS)
    bottom = (ROWS // 2) * SPACING
    cell = genbsdf.SamplingBox(-4.04, -3.96, bottom, bottom + SPACING, -layer.thickness, 0)
    # -st 0: the 1 % gloss is traced as gloss and not taken for diffuse
    options = ["-ab", "10", "-ad", "2", "-lw", "1e-5", "-st", "0"]
    result = genbsdf.generate_bsdf("blind.rad", nsamp=samples, dim=cell, params=options)
    path = Path(f"tilt{tilt_deg:.0f}.xml")
    path.write_bytes(genbsdf.generate_xml(vis_results=result, basis="kf", unit="meter"))
    name = f"blind of 55 % grey slats at {tilt_deg:.0f} degrees"
    write_bsdf_xml(replace(read_bsdf_xml(path), name=name, manufacturer=""), path, digits=4)


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]))
