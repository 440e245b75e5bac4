"""The ends of a design's front in some hours: by a method, by path tracing, and with the slats as geometry.

    python -m tests.validation design_ends design.toml --out FOLDER --hours 16

FOLDER has the results of `cfs design design.toml`.  The ends are the candidates of the front that
are best in one objective each.  All three have the shading states that the design's rule chooses:

    method   the method (default: the design's), the panes and the blind one BSDF
    paths    path tracing through the same BSDF
    slats    path tracing of the room with its slats as triangles beside the panes, the mean of
             some heights of the slats within their spacing: a BSDF knows no slat's height
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.point_in_time import PathLight, path_illuminance
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.rooms import joined_surfaces
from scenes.design.assessment import Assessment
from scenes.design.design import DesignResult, run_design
from scenes.design.design_file import BlindTable, read_design
from scenes.room.glare import rated_hours, rating_of
from scenes.room.inputs import skies_for
from scenes.room.light import room_light
from scenes.room.room import decided_states, inputs_of_room, light_needs
from scenes.study.one_case import _rated_hours, case_inputs
from scenes.study.plan import Case
from scenes.study.store import Store

PATHS = {"path_samples": 1024, "picture_samples": 8, "seed": 77}
REACH = 0.3  # [m] of the slats beyond the glass: into the wall on all sides


def ends(result: DesignResult) -> dict[str, Assessment]:
    """The candidates of the front that are best in one objective each, by the objectives."""
    found: dict[str, tuple[Assessment, list[str]]] = {}
    for number, objective in enumerate(result.design.objective):
        best = min(result.front, key=lambda one: objective.sign * one.objectives[number])
        found.setdefault(best.candidate.label, (best, []))[1].append(objective.name or objective.column or "")
    return {", ".join(names): best for best, names in found.values()}


def slats(group: WindowGroup, blind: BlindTable, tilt_deg: float, phase: float) -> Surfaces:
    """The slats over the windows of a group, raised by a share of their spacing."""
    corners = np.concatenate([window.triangles.reshape(-1, 3) for window in group.windows]) @ group.frame.T
    low, high = corners.min(axis=0) - REACH, corners.max(axis=0) + REACH
    plane = corners[:, 2].mean() + blind.distance * (1 if blind.position == "outdoors" else -1)
    layer = venetian_blind(
        plastic("slats", blind.visible),
        depth=blind.slat_width,
        spacing=blind.slat_spacing,
        tilt=np.radians(tilt_deg),
        radius=blind.slat_radius or np.inf,
        width=high[0] - low[0],
    )
    count = int(np.ceil((high[1] - low[1]) / blind.slat_spacing))
    heights = low[1] + (np.arange(count) + phase) * blind.slat_spacing
    steps = np.stack([np.full(count, low[0]), heights, np.full(count, plane)], axis=1)
    triangles = (layer.triangles[None] + steps[:, None, None]).reshape(-1, 3, 3) @ group.frame
    return Surfaces(triangles, np.full(len(triangles), blind.visible), np.zeros(len(triangles), np.int64), ("slats",))


def with_slats(scene: DaylightScene, blind: BlindTable, states: Sequence[int], phase: float) -> DaylightScene:
    """The scene with the slats of each window group in its state [G]; state 0: raised."""
    if blind.specular:
        raise ValueError("the slats as geometry are diffuse: expected a blind without `specular`")
    lowered = [(group, blind.tilts[j - 1]) for group, j in zip(scene.groups, states, strict=True) if j]
    parts = [slats(group, blind, tilt, phase) for group, tilt in lowered]
    if blind.position == "outdoors":
        return replace(scene, exterior=joined_surfaces([scene.exterior, *parts]))
    return replace(scene, interior=joined_surfaces([scene.interior, *parts]))


Values = NDArray[np.float64]


def by_paths(light: PathLight, states: NDArray[np.int64], rating: GlareOptions) -> tuple[Values, Values]:
    """Mean illuminance of the sensors [lx] and DGP in the light's hours, states [G, L]."""
    lux, _ = path_illuminance(light, states)
    return lux.mean(axis=0), hourly_glare(light, "DGP", states, options=rating).dgp


def by_slats(
    light: PathLight, blind: BlindTable | None, states: NDArray[np.int64], rating: GlareOptions, heights: int
) -> tuple[Values, Values]:
    """The same with the slats as geometry beside the panes, which are the first state."""
    lux, dgp = np.zeros((2, states.shape[1]))
    panes = replace(light, systems=[systems[:1] for systems in light.systems])
    for row in np.unique(states, axis=1).T:
        hours = np.flatnonzero((states == row[:, None]).all(axis=0))
        phases = (np.arange(heights) / heights).tolist() if blind is not None and row.any() else [0.0]
        for phase in phases:
            scene = light.scene if blind is None else with_slats(light.scene, blind, row, phase)
            one = replace(panes, scene=scene, sky=light.sky.part(hours))
            values = by_paths(one, np.zeros((len(row), len(hours)), dtype=np.int64), rating)
            lux[hours] += values[0] / len(phases)
            dgp[hours] += values[1] / len(phases)
    return lux, dgp


def computed(end: Assessment, case: Case, count: int, method: str, heights: int) -> pd.DataFrame:
    """Illuminance and DGP of a case in some hours of use with the sun up, spread over its year, by each way."""
    options, inputs, (space,) = case.options.changed(method=method), case_inputs(case), case_inputs(case).spaces
    every = _rated_hours(inputs.weather, options)
    hours = every[np.linspace(0, len(every) - 1, count + 2)[1:-1].astype(int)]
    skies = skies_for(inputs.weather, options.sampling, **options.sky)
    skies = skies.part(np.flatnonzero(np.isin(skies.lit, hours)))
    room = inputs_of_room(
        inputs.building,
        space,
        inputs.systems,
        inputs.weather,
        options,
        operation=inputs.operation,
        skies=skies,
        cache=MatrixCache.of_user(),
    )
    light = room_light(room, needs=light_needs(room))
    state = decided_states(room, light).state
    rows, rating = light.states(state), rating_of(options.outputs)
    system = end.candidate.system
    blind = None if system is None else system.blind
    if len(room.seasons) > 1 or light.inner is not None:
        raise ValueError("expected a room without seasons and without glass to other rooms")
    paths = PathLight(light.scene, light.light.systems, skies, options.changed(**PATHS).sampling)
    ways = {
        "method": (illuminance(light.light, rows).mean(axis=0), rated_hours(room, light, state, "DGP", hours).dgp),
        "paths": by_paths(paths, rows, rating),
        "slats": by_slats(paths, blind, rows, rating, heights),
    }
    table = pd.DataFrame({"time": inputs.weather.midpoints[hours], "state": rows.max(axis=0)})
    for name, (lux, dgp) in ways.items():
        table[f"lux {name}"], table[f"dgp {name}"] = lux, dgp
    return table


def differences(table: pd.DataFrame, one: str, other: str) -> dict[str, float]:
    """A way less another: illuminance of all hours and of an hour [%], DGP."""
    ratio = table[f"lux {one}"] / table[f"lux {other}"] - 1
    both = table[f"lux {one}"].sum() / table[f"lux {other}"].sum() - 1
    dgp = table[f"dgp {one}"] - table[f"dgp {other}"]
    return {
        "illuminance [%]": float(100 * both),
        "rms of an hour [%]": 100 * float(np.sqrt(np.mean(ratio**2))),
        "worst hour [%]": 100 * float(ratio.iloc[np.abs(ratio).argmax()]),
        "DGP, mean": float(dgp.mean()),
        "DGP, rms": float(np.sqrt(np.mean(dgp**2))),
        "DGP, worst": float(dgp.iloc[np.abs(dgp).argmax()]),
    }


def main(
    design: Annotated[Path, "file of `cfs design`"],
    *,
    out: Annotated[Path, "folder of its results"],
    hours: int = 16,
    heights: Annotated[int, "of the slats within their spacing"] = 4,
    method: Annotated[str, "in place of the design's"] = "",
    table: Annotated[Path | None, "file for the values of every hour (CSV)"] = None,
) -> pd.DataFrame:
    """Light and glare at the ends of the front by each way less another."""
    variants.activate()
    parsed = read_design(design)
    result = run_design(parsed, Store(out, inputs=parsed.files, command="design"))
    rows, each = [], []
    for objective, end in ends(result).items():
        case = next(one for one in result.study.plan.cases if one.key == end.keys[0])
        values = computed(end, case, hours, method or case.options.method, heights)
        each.append(values.assign(candidate=end.candidate.label))
        head = {"best in": objective, "candidate": end.candidate.label, "hours": len(values)}
        for pair in (("method", "paths"), ("paths", "slats"), ("method", "slats")):
            rows.append(
                head
                | {"difference": " less ".join(pair)}
                | {k: round(v, 4) for k, v in differences(values, *pair).items()}
            )
            print(rows[-1], flush=True)
    if table is not None:
        pd.concat(each).to_csv(table, index=False, float_format="%.5g")
    return pd.DataFrame(rows)
