"""The dissertation's Figures 46 to 48 and Table 12 remade: a peak varied in strength and width.

    python -m tests.validation glare_theory --json FILE [--figure FILE.png]
    python -m tests.validation glare_theory --table FILE
    python -m tests.validation glare_theory --scales

Bars with slits between them, so small that the eye sees them as one (4 mm apart), are cut parallel
to the sun's beam, so that it comes at the peak angle.  The slits' height sets the direct-direct
transmittance at the peak, the bars' depth the peak angle amplitude.  CIE clear
sky.  Besides the methods against one another (the dissertation takes its rtrace_ttree as the
reference) the slats are path-traced as geometry.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.blinds import extrude
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from tests.validation import blind_room
from tests.validation.glare_methods import GLARE, GlareCase, rated
from tests.validation.glare_room import glare_scene, known_system

SPACING = 0.004  # [m]
PROFILE_DEG = 25.0  # of the sun, and of the slats
REFLECTANCE = 0.55
DIFFUSE, DIRECT = 10_000.0, 20_000.0  # [lx] of the sky on the horizontal, of the sun normal to it
TRANSMITTANCES = (0.01, 0.03, 0.1, 0.3, 0.6)  # at the peak, amplitude AMPLITUDE_DEG
AMPLITUDES_DEG = (1.25, 2.5, 5.0, 10.0, 20.0, 40.0)  # at the peak transmittance TRANSMITTANCE
AMPLITUDE_DEG, TRANSMITTANCE = 10.0, 0.03
SCALES = (1.0, 0.1, 10.0)  # of the bars, Table 12's third series
EYES = 4  # at different heights behind the slits: an eye sees the sun through a few of them
ASIDE_DEG = 20.0  # azimuth of the sun from the facade's normal
TABLE_12 = {  # largest relative error [%] against rtrace_ttree's DGP
    "transmittance": {"three-phase": (40, 60, 50), "five-phase": (50, 50, 50), "point-in-time": (0, 10, None)},
    "amplitude": {"three-phase": (40, 40, 48), "five-phase": (13, 14, 15), "point-in-time": (0, 10, 12)},
}


def peaked_slats(transmittance: float, amplitude_deg: float, width: float = SPACING) -> PeriodicLayer:
    """Bars with slits at the profile angle: their transmittance and their amplitude.

    A slit `gap` high through bars `depth` thick lets light pass at profile angles up to
    gap cos(profile)^2 / depth = tan(amplitude) from its own.
    """
    profile = np.radians(PROFILE_DEG)
    gap = SPACING * transmittance
    depth = gap * np.cos(profile) ** 2 / np.tan(np.radians(amplitude_deg))
    fall = depth * np.tan(profile)
    outline = [(0, 0), (SPACING - gap, 0), (SPACING - gap - fall, -depth), (-fall, -depth)]
    edges = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    triangles = extrude(edges, width)
    return PeriodicLayer(
        triangles, np.zeros(len(triangles), dtype=np.int64), (plastic("slat", REFLECTANCE),), (width, SPACING)
    )


def scale_series(samples: int = 4096) -> list[dict]:
    """The third series of the dissertation's Table 12: the same bars, larger and smaller.

    Hemispherical transmittance [K] at each scale against the first, and the largest difference
    between two runs of that one, which is noise.
    """
    layer, runs = peaked_slats(TRANSMITTANCE, AMPLITUDE_DEG), []
    for number, scale in enumerate((*SCALES, SCALES[0])):
        larger = replace(layer, triangles=scale * layer.triangles, period=tuple(scale * side for side in layer.period))
        klems = generate_klems(larger, samples=samples, seed=number).bsdf[0]
        runs.append((scale, klems.direct_hemispherical(klems.transmission_front)))
    first = runs[0][1]
    return [
        {
            "scale": scale,
            "noise": number == len(SCALES),
            "mean": round(float(tau.mean()), 5),
            "largest difference": round(float(np.abs(tau - first).max()), 5),
        }
        for number, (scale, tau) in enumerate(runs)
    ]


def peaked_geometry(group: WindowGroup, transmittance: float, amplitude_deg: float) -> Surfaces:
    """These slats before a window, a little larger than it, and the wall round the window."""
    local = group.windows[0].triangles.reshape(-1, 3) @ group.frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    margin = 0.2  # [m] the slats stand 2 cm before the glass
    layer = peaked_slats(transmittance, amplitude_deg, width=high[0] - low[0] + 2 * margin)
    count = int(np.ceil((high[1] - low[1] + 2 * margin) / SPACING))
    corner = np.add(low, [-margin, -margin, 0.02])
    steps = corner + np.arange(count)[:, None] * [0, SPACING, 0]
    triangles = (layer.triangles[None] + steps[:, None, None]).reshape(-1, 3, 3)
    wall = blind_room.wall_round(low, high)
    reflectance = np.repeat([REFLECTANCE, blind_room.GLASS_FRONT], [len(triangles), len(wall)])
    return Surfaces(
        np.concatenate([triangles, wall]) @ group.frame, reflectance, np.zeros(len(reflectance), dtype=np.int64)
    )


def clear_sky(scene: DaylightScene) -> AnnualSky:
    """CIE's clear sky, its sun before the window at the slats' profile angle."""
    profile = np.radians(PROFILE_DEG)
    aside = np.radians(ASIDE_DEG)
    along, _, outward = scene.groups[0].frame
    sun = np.cos(aside) * outward + np.sin(aside) * along + np.tan(profile) * np.cos(aside) * np.array([0, 0, 1.0])
    sun /= np.linalg.norm(sun)
    reinhart = ReinhartSky(4)
    sky = cie_patches("clear", reinhart, DIFFUSE, sun=sun, direct_horizontal=DIRECT * sun[2])
    patches = np.zeros(reinhart.size)
    # spread over the four nearest patches, as `sky_matrix` does
    cosine = reinhart.directions[1:] @ sun
    near = np.argsort(-cosine)[:4]
    weight = 1 / (1.002 - cosine[near])
    patches[1 + near] = DIRECT * weight / weight.sum() / reinhart.solid_angles[1 + near]
    whole, alone = (sky + patches)[:, None], patches[:, None]
    return AnnualSky(whole, sun[None], np.array([DIRECT]), np.array([0]), 1, alone)


def cases(scene: DaylightScene, levels: int) -> list[GlareCase]:
    """Both series."""
    sky, found = clear_sky(scene), []
    series = {
        "transmittance": [(t, AMPLITUDE_DEG) for t in TRANSMITTANCES],
        "amplitude": [(TRANSMITTANCE, a) for a in AMPLITUDES_DEG],
    }
    for name, members in series.items():
        for transmittance, amplitude in members:
            value = transmittance if name == "transmittance" else amplitude
            found.append(
                GlareCase(
                    f"{name} {value:g}",
                    peaked_geometry(scene.groups[0], transmittance, amplitude),
                    known_system(peaked_slats(transmittance, amplitude), levels=levels, samples=1024),
                    sky,
                    (name,),
                    tuple(SPACING * np.arange(EYES) / EYES),
                    "pixels",  # the slits are finer than the disc: an eye does not tell them apart
                )
            )
    return found


def table(runs: list[dict]) -> str:
    """DGP of every member, and the largest differences as in Table 12, as Markdown."""
    keys = [f"{method} {metric}" for method in METHODS for metric in GLARE]
    lines = ["| | slats | " + " | ".join(keys) + " |", "|" + "---|" * (len(keys) + 2)]
    for run in runs:
        values = [run["measured"][0], *(run["methods"][key][0] for key in keys)]
        lines.append(f"| {run['system']} | " + " | ".join(f"{v:.3f}" for v in values) + " |")
    lines += ["", "| largest error [%] | against | " + " | ".join(keys) + " |", "|" + "---|" * (len(keys) + 2)]
    for name, theirs in TABLE_12.items():
        mine = [run for run in runs if run["system"].startswith(name)]
        for label, reference in (
            ("point-in-time DGP", [run["methods"]["point-in-time DGP"][0] for run in mine]),
            ("slats", [run["measured"][0] for run in mine]),
        ):
            worst = [100 * np.abs(np.array([r["methods"][k][0] for r in mine]) / reference - 1).max() for k in keys]
            lines.append(f"| {name} | {label} | " + " | ".join(f"{w:.0f}" for w in worst) + " |")
        known = [theirs[key.rsplit(" ", 1)[0]][GLARE.index(key.rsplit(" ", 1)[1])] for key in keys]
        cells = ["" if v is None else str(v) for v in known]
        lines.append(f"| {name} | dissertation, its rtrace_ttree | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def write_figure(runs: list[dict], path: Path) -> None:
    """DGP of methods and slats over both varied quantities (PNG)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.8), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    labels = {
        "transmittance": f"direct-direct transmittance at the peak (amplitude {AMPLITUDE_DEG:g}°)",
        "amplitude": f"peak angle amplitude [°] (transmittance {TRANSMITTANCE:g})",
    }
    colours = dict(zip(METHODS, ("#2b6ca3", "#c8641e", "#3a8f4d"), strict=True))
    styles = dict(zip(GLARE, ("-", "--", ":"), strict=True))
    for axes, (name, label) in zip(figure.subplots(1, 2, sharey=True), labels.items(), strict=True):
        mine = [run for run in runs if run["system"].startswith(name)]
        x = [float(run["system"].split()[1]) for run in mine]
        axes.plot(x, [r["measured"][0] for r in mine], "ko", label="slats as geometry, DGP")
        for key in mine[0]["methods"]:
            method, metric = key.rsplit(" ", 1)
            y = [r["methods"][key][0] for r in mine]
            axes.plot(x, y, styles[metric], color=colours[method], label=key, linewidth=1.3)
        axes.set_xscale("log")
        axes.set_xticks(x, [f"{value:g}" for value in x])
        axes.minorticks_off()
        axes.set_xlabel(label, fontsize=8)
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("DGP")
    figure.axes[1].legend(fontsize=6.5)
    figure.savefig(path)


def main(
    *,
    table_: Annotated[Path | None, "file of a run, to print its tables again"] = None,
    size: Annotated[int, "pixels of a side"] = 180,
    samples: Annotated[int, "paths of a pixel"] = 8,
    levels: Annotated[int, "4^levels cells of the tree"] = 5,
    pictures: Annotated[Path | None, "folder for the slats' pictures"] = None,
    figure: Path | None = None,
    scales: Annotated[bool, "the series of scales, alone"] = False,
    json_: Path | None = None,
) -> None:
    """Run both series and print the tables."""
    if scales:
        variants.activate()
        for row in scale_series():
            print(row)
        return
    if table_:
        runs = json.loads(table_.read_text())
    else:
        variants.activate()
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
        scene = glare_scene(size)
        sampling = Sampling(picture_samples=samples, view_samples=2 * samples)
        runs = rated(scene, cases(scene, levels), sampling, pictures)
    if json_:
        json_.write_text(json.dumps(runs, indent=1))
    if figure:
        write_figure(runs, figure)
    print(table(runs))
