"""Radiance's programs and its scene files, for the benchmarks."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.gloss import radiance_material
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from tests.benchmarks.harness import PeerFailed, PeerMissing

LUX = (47.435, 119.93, 11.635)  # lm/W of Radiance's channels
RTRACE = "-I+ -h -aa 0 -ad 20000 -as 0 -lw 1e-8 -lr 16 -dj 0.5 -dc 1 -dt 0"
SKY_AND_GROUND = (
    "skyfunc glow sky_glow 0 0 4 1 1 1 0 sky_glow source sky 0 0 4 0 0 1 180 "
    "skyfunc glow ground_glow 0 0 4 1 1 1 0 ground_glow source ground 0 0 4 0 0 -1 180"
)


def environment() -> dict[str, str]:
    """The environment that finds Radiance: pyradiance's own programs, else those on the path."""
    found = find_spec("pyradiance")
    if found is None or found.origin is None:
        raise PeerMissing("Radiance is not installed: pip install 'mitsuba-cfs[peers]'")
    root = Path(found.origin).parent
    return {
        **os.environ,
        "PATH": f"{root / 'bin'}{os.pathsep}{os.environ.get('PATH', '')}",
        "RAYPATH": f".{os.pathsep}{root / 'lib'}",
    }


def run(command: str, folder: Path, stdin: bytes = b"") -> bytes:
    """Standard output of a Radiance command line run in `folder`."""
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"],
        cwd=folder,
        input=stdin,
        capture_output=True,
        env=environment(),
        check=False,
    )
    if done.returncode:
        raise PeerFailed(f"{command}: {done.stderr.decode()[-800:]}")
    return done.stdout


def eye_illuminance(folder: Path, scenes: Sequence[str], sky: str, eye: str, bounces: int = 12) -> float:
    """Illuminance [lx] at an eye by `rtrace`.

    Args: scenes: names of files; sky: arguments of `gendaylit`; eye: its place and direction;
    bounces: `-ab`, of which the hemisphere of the eye is the first.
    """
    (folder / "sky.rad").write_bytes(run(f"gendaylit {sky}", folder) + SKY_AND_GROUND.encode())
    run(f"oconv sky.rad {' '.join(scenes)} > scene.oct", folder)
    rgb = run(f"echo {eye} | rtrace {RTRACE} -ab {bounces} scene.oct", folder).split()
    return float(np.dot(LUX, [float(v) for v in rgb[:3]]))


def write_surfaces(surfaces: Surfaces, path: Path) -> None:
    """Opaque triangles as grey `plastic`, or what their gloss is in Radiance."""
    gloss = [surfaces.gloss[i] if surfaces.gloss else None for i in surfaces.surface]
    kinds = list(dict.fromkeys(zip(surfaces.reflectance.tolist(), gloss, strict=True)))
    lines = [radiance_material(f"{path.stem}_{i}", *kind) for i, kind in enumerate(kinds)]
    for i, triangle in enumerate(surfaces.triangles):
        number = kinds.index((float(surfaces.reflectance[i]), gloss[i]))
        lines.append(polygon(f"{path.stem}_{number}", f"{path.stem}{i}", triangle))
    path.write_text("\n".join(lines))


def write_group(group: WindowGroup, path: Path) -> None:
    """A window group for rfluxmtx in the Klems full basis, its normals into the room."""
    up = ",".join(f"{x:.9g}" for x in group.frame[1])
    lines = [f"#@rfluxmtx h=kf u={up}", "void glow window_glow\n0\n0\n4 1 1 1 0\n"]
    for window in group.windows:
        for i, triangle in enumerate(window.triangles):
            lines.append(polygon("window_glow", f"{window.name}_{i}", triangle[::-1]))
    path.write_text("\n".join(lines))


def write_sky(path: Path, subdivision: int) -> None:
    """The ground and a sky of Reinhart patches, as rfluxmtx receivers."""
    path.write_text(
        f"#@rfluxmtx h=u u=Y\nvoid glow ground_glow\n0\n0\n4 1 1 1 0\n"
        f"ground_glow source ground\n0\n0\n4 0 0 -1 180\n"
        f"#@rfluxmtx h=r{subdivision} u=Y\nvoid glow sky_glow\n0\n0\n4 1 1 1 0\n"
        f"sky_glow source sky\n0\n0\n4 0 0 1 180\n"
    )


def sensors_text(points: ArrayLike, directions: ArrayLike) -> bytes:
    """Sensor lines `x y z dx dy dz`."""
    rows = np.concatenate([points, directions], axis=1)
    return "".join(" ".join(f"{v:.9g}" for v in row) + "\n" for row in rows).encode()


def read_float_matrix(data: bytes, weights: Sequence[float] = (1, 0, 0)) -> NDArray[np.float64]:
    """A matrix in Radiance's float format, its components weighted [rows, columns]."""
    header, _, body = data.partition(b"\n\n")
    fields = dict(line.split(b"=", 1) for line in header.split(b"\n") if b"=" in line)
    shape = [int(fields[key]) for key in (b"NROWS", b"NCOLS")] + [int(fields.get(b"NCOMP", b"3"))]
    values = np.frombuffer(body, dtype="<f4", count=int(np.prod(shape))).reshape(shape)
    return values.astype(float) @ np.asarray(weights, dtype=float)


def polygon(material: str, name: str, vertices: NDArray[np.float64]) -> str:
    """A polygon [V, 3] of the material."""
    rows = "\n".join(f"  {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices)
    return f"{material} polygon {name}\n0\n0\n{3 * len(vertices)}\n{rows}\n"
