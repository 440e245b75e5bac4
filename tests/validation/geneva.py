r"""An office that others published: DGP and Ev of the Geneva office of raytraverse.

    python -m tests.validation geneva [FOLDER] [--by functions] [--every 20] [--size 300]
    python -m tests.validation geneva [FOLDER] --by command --cases 01_glz --views 1
    python -m tests.validation geneva [FOLDER] --by rtrace --every 150 [--bounces 7]

FOLDER holds `validations/base1compdv` of stephanwaz/raytraverse: scene, views, skies, weather and
the brute-force reference of 2,022 hours.  By functions: the five-phase method of `import
mitsuba_cfs` under the reference's own skies, rated as raytools sums (pixel by pixel) and as
evalglare groups; fabric and panes are described in `geneva_scene`.  By command: `cfs dgp FILE.rad
--weather EPW`, every hour of the year, the scene's files as they are.  The irradiances of the EPW
are those of the reference's sky; its dew point is not, which `gendaylit -ang` takes as 11 degC for
the luminous efficacies; `--weather wea` is the reference's own file, which has none.  By rtrace:
Ev by Radiance's own program under the reference's skies, which shows the reference's own error.
Errors as raytraverse publishes them: over the hours whose reference DGP is 0.25 to 0.75, the mean
absolute difference of DGP, and of Ev as a share of it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

import bim
import mitsuba_cfs as cfs
from mitsuba_cfs.images.view import format_view
from mitsuba_cfs.methods.phase_matrices import with_eye, with_needs
from tests.benchmarks.radiance import eye_illuminance
from tests.validation import geneva_scene as geneva
from tests.validation.differences import mean_absolute

FOLDER = Path(__file__).parents[3] / "shared" / "reference" / "geneva_office"
RANGE = (0.25, 0.75)  # of the reference's DGP
EPW_HEAD, EPW_DEW_POINT = 8, 7  # lines of an EPW before its hours; column


def by_functions(folder: Path, case: str, views: Sequence[int], every: int, size: int) -> Iterator[pd.DataFrame]:
    """DGP and Ev [lx] by hour of the year, of each view; `core_s` took the view."""
    groups, systems = geneva.window_groups(folder, case)
    solid = bim.opaque_surfaces(geneva.scene(folder, case))
    hours = geneva.reference(folder, case, views[0]).hour[::every]
    sky, matrices = geneva.sky(folder, hours), None
    for number in views:
        view, start = geneva.view(folder, number, size), os.times()
        if matrices is None:
            scene = cfs.DaylightScene(solid, solid, groups, view=view)
            matrices = cfs.phase_matrices(scene, cfs.Sampling(), needs=["DGP"])
        else:
            matrices = with_needs(with_eye(matrices, view), ["DGP"])
        light = cfs.phase_light(matrices, systems, sky, needs=["DGP"])
        pixels = cfs.hourly_glare(light, options=cfs.GlareOptions(grouping="pixels"))
        now = os.times()
        glare = cfs.hourly_glare(light)
        seconds = now.user + now.system - start.user - start.system
        columns = {"pixels": pixels.dgp, "dgp": glare.dgp, "Ev": glare.Ev}
        yield pd.DataFrame(columns, index=hours).assign(core_s=seconds)


def by_command(folder: Path, case: str, views: Sequence[int], size: int, weather: str) -> Iterator[pd.DataFrame]:
    """The same by `cfs dgp`, with the sun and the ground of the reference's sky."""
    for number in views:
        with tempfile.TemporaryDirectory() as temporary:
            scene, out = Path(temporary) / "scene.rad", Path(temporary) / "out"
            for part in ("options", "RAD"):
                shutil.copytree(folder / part, scene.with_name(part))
            shutil.copy(folder / "roos_fabric.cal", scene.parent)
            files = f"options/{geneva.CASES[case]}.rad", "RAD/office.rad"
            scene.write_text("".join(f"!xform {file}\n" for file in files))
            words = [
                "dgp",
                scene,
                "--weather",
                folder / f"refs/geneva.{weather}",
                "--out",
                out,
                "--view",
                format_view(geneva.view(folder, number, size)),
                "--size",
                size,
                "--sun-model",
                "radiance",
                "--sky-ground",
                "gendaylit",
                "--worst",
                0,
            ]
            command, tables = [sys.executable, "-m", "scenes.cli", *map(str, words)], {}
            for sources in ("pixels", "evalglare"):
                done = subprocess.run(
                    [*command, "--glare-sources", sources], check=True, capture_output=True, text=True
                )
                print(done.stdout, file=sys.stderr)
                (file,) = out.glob("*.parquet")
                tables[sources] = pd.read_parquet(file)
        table = tables["evalglare"][["dgp", "Ev"]].assign(pixels=tables["pixels"].dgp)
        time = pd.DatetimeIndex(table.index)
        table.index = (time.dayofyear - 1) * 24 + time.hour
        yield table


def by_rtrace(folder: Path, case: str, views: Sequence[int], every: int, bounces: int) -> Iterator[pd.DataFrame]:
    """Ev [lx] by hour of the year as `rtrace` computes it from 20,000 rays."""
    rows = np.loadtxt(folder / "refs/skydata.txt")
    files = [f"scene/options/{geneva.CASES[case]}.rad", "scene/RAD/office.rad"]
    for number in views:
        eye = (folder / "POINTS/sensors.txt").read_text().splitlines()[number - 1]
        truth = geneva.reference(folder, case, number)
        hours = truth.hour[(truth.dgp > RANGE[0]) & (truth.dgp < RANGE[1])][::every]
        with tempfile.TemporaryDirectory() as temporary:
            shutil.copytree(folder, Path(temporary) / "scene")  # as a function's file is named
            values = []
            for x, y, z, beam, diffuse in rows[hours]:
                altitude, azimuth = np.degrees([np.arcsin(z), np.arctan2(-x, -y)])  # from south
                sky = f"-ang {altitude:.4f} {azimuth:.4f} -W {beam:g} {diffuse:g}"
                values.append(eye_illuminance(Path(temporary), files, sky, eye, bounces))
        yield pd.DataFrame({"Ev": values}, index=hours)


def with_dew_point(epw: Path, folder: Path, dew_point_c: float) -> Path:
    """A copy of an EPW whose dew point is the same all year."""
    lines = epw.read_text().splitlines()
    for i, line in enumerate(lines[EPW_HEAD:], EPW_HEAD):
        cells = line.split(",")
        cells[EPW_DEW_POINT] = f"{dew_point_c:g}"
        lines[i] = ",".join(cells)
    copy = folder / epw.name
    copy.write_text("\n".join(lines) + "\n")
    return copy


def error_row(table: pd.DataFrame, folder: Path, case: str, number: int) -> dict[str, object]:
    """Mean absolute errors and mean differences (bias) of a view's hours."""
    truth = geneva.reference(folder, case, number)
    known = pd.DataFrame({"dgp": truth.dgp, "Ev": truth.Ev}, index=truth.hour)
    known = known[known["dgp"].between(*RANGE) & known.index.isin(table.index)]
    ours = table.loc[known.index]
    row: dict[str, object] = {"case": case, "view": number, "hours": len(known)}
    for name, of in (("pixels", "dgp"), ("dgp", "dgp"), ("Ev", "Ev")):
        if name in ours:
            whole = known["Ev"].to_numpy() if name == "Ev" else 1.0
            a, b = ours[name].to_numpy() / whole, known[of].to_numpy() / whole
            row |= {f"{name} MAE": mean_absolute(a, b), f"{name} bias": float(np.mean(a - b))}
    return row | ({"core-s": table["core_s"].iloc[0]} if "core_s" in table else {})


def main(
    folder: Path = FOLDER,
    *,
    by: Annotated[str, ("functions", "command", "rtrace")] = "functions",
    cases: Annotated[Sequence[str], geneva.CASES] = tuple(geneva.CASES),
    views: Annotated[Sequence[int], geneva.VIEWS] = geneva.VIEWS,
    every: Annotated[int, "of the 2,022 hours, by rtrace of those that count"] = 20,
    size: Annotated[int, "[px]"] = 300,
    weather: Annotated[str, ("epw", "wea")] = "epw",
    bounces: Annotated[int, "of rtrace, the eye's hemisphere included"] = 12,
) -> pd.DataFrame:
    """A row for each case and view."""
    rows = []
    for case in cases:
        if by == "command":
            tables = by_command(folder, case, views, size, weather)
        elif by == "rtrace":
            tables = by_rtrace(folder, case, views, every, bounces)
        else:
            tables = by_functions(folder, case, views, every, size)
        rows += [error_row(t, folder, case, v) for v, t in zip(views, tables, strict=True)]
    return pd.DataFrame(rows).round(4)
