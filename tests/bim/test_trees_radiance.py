"""Crowns of leaves beside Radiance's participating medium of the same attenuation (`mist`)."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.rays import ray_mesh
from bim.surroundings.city_models import tree_of
from bim.surroundings.placement import _attenuations, crown_elements
from bim.to_tracer import element_surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from tests.radiance import environment

PLACES = np.array([[x, 0.0, z] for x in (-1.0, 0.0, 1.0) for z in (1.0, 2.0)])
SCENE = """void mist leafy
0
0
7 {k} {k} {k} 0 0 0 0
leafy sphere crown
0
0
4 0 -7 6 5
void glow g
0
0
4 1 1 1 0
g source sky
0
0
4 0 0 1 180
"""


@pytest.mark.slow
@pytest.mark.parametrize("stated", [0.46, 0.1, 0.033])
def test_the_sky_behind_a_crown_is_that_behind_mist(variant, tmp_path, stated):
    """Six places on a facade, 2 m from a crown of 10 m, under a sky of one luminance.

    Black leaves of four trees.  They stick out of the hull by their size, and the more so the
    bigger they are: a crown of 3.3 % darkens 2.2 % more.
    """
    fields = {"height": 11.0, "crown_radius": 5.0, "crown_base": 1.0, "transmittance": stated}
    crown = tree_of(fields, [0.0, -7.0], "tree", Path("trees.toml"))
    (k,) = _attenuations(ray_mesh(crown.triangles), "tree", (stated,))
    towards, found = np.tile([0.0, -1.0, 0.0], (6, 1)), []
    for number in range(4):
        leaves = crown_elements(crown, (stated,) * 12, f"tree-{number}", 2.0)
        black = element_surfaces(replace(one, reflectance_visible=0.0) for one in leaves)
        matrix = sky_irradiance_matrix(
            black, PLACES, towards, subdivision=1, samples=20_000, max_depth=4, stopping=Stopping(batches=2), seed=1
        )
        found.append(matrix.values[:, 1:].sum(axis=1))  # the first patch is the ground
    scene, octree = tmp_path / "scene.rad", tmp_path / "scene.oct"
    scene.write_text(SCENE.format(k=k))
    env = environment()
    octree.write_bytes(subprocess.run(["oconv", str(scene)], env=env, capture_output=True, check=True).stdout)
    rows = np.column_stack([PLACES, towards])
    words = "rtrace -h -I -ab 1 -ad 65536 -lw 1e-7 -as 0 -aa 0".split()
    said = subprocess.run(
        [*words, str(octree)],
        input="\n".join(" ".join(map(str, row)) for row in rows),
        env=env,
        capture_output=True,
        check=True,
        text=True,
    ).stdout
    theirs = np.array([line.split() for line in said.splitlines() if line.strip()], dtype=float)
    free = np.pi / 2
    print(stated, np.mean(found, axis=0) / theirs[:, 0])
    np.testing.assert_allclose(np.mean(found, axis=0), theirs[:, 0], rtol=0.03)
    assert theirs[:, 0].max() < 0.75 * free
