"""What rooms of an IFC file borrow from each other: three phases against paths in all of them.

    python -m tests.validation inner_glass_ifc BUILDING.ifc [--space NAME ...] [--seeds N]
        [--paths N]

Every room as `cfs run --inner-glass` has it, its own windows black, with the rooms behind its
glass, the reveals between and their windows, under an overcast sky of 20,000 lx and nothing else
outdoors; all windows pass 0.8, all glass between rooms 0.7, at every angle, open doorways all.  Up
to five sensors of its grid by Mitsuba's `path`, Radiance's `rtrace` and ours: means over seeds and
their standard errors, and ours by each, of the sensors' means.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from bim.doorways import opened, source_rooms
from bim.ifc.building import read_ifc
from bim.ifc.corrections import OPEN
from bim.model import Building, Space
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.systems import read_system
from scenes.room.inner_glass import PANE, inner_glass
from scenes.room.light import room_scene
from scenes.room.options import SensorGrid
from scenes.room.windows import in_all_windows, room_windows
from tests.benchmarks.radiance import polygon, write_surfaces
from tests.validation.cut_groups import Quads
from tests.validation.inner_glass import INNER_TAU, TAU, illuminance_by_path, illuminance_by_rtrace, overcast, pooled

MOST_SENSORS = 5
EYE = np.eye(KLEMS_FULL.size)
SAMPLING = Sampling(sensor_samples=32768, patch_samples=8192, subdivision=1)


def borrowing_scene(building: Building, space: Space) -> DaylightScene | None:
    """A room and all that it borrows from, with few sensors; None where it borrows nothing."""
    blind = read_system(VENETIAN_BLIND)  # what fills the windows is replaced
    systems = {}
    for room in (space, *source_rooms(building, space)):
        systems |= in_all_windows(room, blind)
    inner = inner_glass(building, space, systems)
    if inner is None:
        return None
    windows = room_windows(space, systems)
    scene = room_scene(building, space, windows, (SensorGrid(spacing=1.0),), 32, inner=inner)
    few = np.linspace(0, len(scene.points) - 1, MOST_SENSORS).round().astype(int)
    few = np.unique(few)
    chosen = replace(scene, points=scene.points[few], normals=scene.normals[few], view=None)
    return _plain(chosen)


def _plain(scene: DaylightScene) -> DaylightScene:
    """The scene with nothing outdoors, and the same glass everywhere."""
    beyond = []
    for one, tau in zip(scene.adjacent, inner_taus(scene), strict=True):
        behind = _plain(one.scene)
        taus = [TAU] * len(behind.outdoor_groups) + inner_taus(one.scene)
        passed = tuple(t * EYE for t in taus)
        beyond.append(replace(one, scene=behind, transmission=passed, beam=tau * EYE.diagonal()))
    return replace(scene, exterior=Surfaces.none(), adjacent=tuple(beyond))


def inner_taus(scene: DaylightScene) -> list[float]:
    """What each pane between rooms passes: a doorway all."""
    return [1.0 if np.all(one.beam == 1) else INNER_TAU for one in scene.adjacent]


def by_phases(scene: DaylightScene, seed: int) -> NDArray[np.float64]:
    """Illuminance of the sensors [S] [lx] by this project's three phases."""
    traced = phase_matrices(scene, replace(SAMPLING, seed=seed), five_phase=False)
    tau = [0.0] * len(scene.outdoor_groups) + inner_taus(scene)
    light = phase_light(traced, [[MatrixOptics(t * EYE)] for t in tau], overcast())
    return illuminance(light)[:, 0]


def by_paths(scene: DaylightScene, samples: int, seed: int) -> NDArray[np.float64]:
    """The same [S] by Mitsuba's integrator `path` in all rooms."""
    return illuminance_by_path(*whole_rooms(scene), scene.points, samples, seed=seed)


def whole_rooms(scene: DaylightScene) -> tuple[Quads, Quads]:
    """All rooms' surfaces with their reflectance, all panes with their transmittance."""
    rooms = list(_all_behind([scene]))
    walls = [_without_panes(room, scene) for room in rooms]
    opaque = [
        (part.triangles[part.reflectance == rho], float(rho)) for part in walls for rho in np.unique(part.reflectance)
    ]
    panes = [(_triangles(scene.outdoor_groups), 0.0)] if scene.outdoor_groups else []
    for room in rooms:
        panes += [
            (_triangles([group]), tau)
            for group, tau in zip(_inner_groups(room), inner_taus(room), strict=True)
            if tau < 1
        ]
        if room is not scene and room.outdoor_groups:
            panes.append((_triangles(room.outdoor_groups), TAU))
    return opaque, panes


def by_radiance(scene: DaylightScene, folder: Path) -> NDArray[np.float64]:
    """The same [S] by `rtrace` in all rooms."""
    write_rooms(scene, folder)
    return illuminance_by_rtrace(folder, scene.points, scene.normals)


def write_rooms(scene: DaylightScene, folder: Path) -> None:
    """All rooms and panes for Radiance: room0.rad, room1.rad ... and panes.rad."""
    lines = [*_glass("black", 0.0, scene.outdoor_groups)]
    for number, room in enumerate(_all_behind([scene])):
        write_surfaces(_without_panes(room, scene), folder / f"room{number}.rad")
        for i, (group, tau) in enumerate(zip(_inner_groups(room), inner_taus(room), strict=True)):
            lines += _glass(f"inner{number}_{i}", tau, [group]) if tau < 1 else []
        if number:
            lines += _glass(f"window{number}", TAU, room.outdoor_groups)
    (folder / "panes.rad").write_text("\n".join(lines))


def _all_behind(rooms) -> Iterator[DaylightScene]:
    for room in rooms:
        yield room
        yield from _all_behind({id(one.scene): one.scene for one in room.adjacent}.values())


def _without_panes(room: DaylightScene, before: DaylightScene) -> Surfaces:
    """The room's surfaces but the glass that the rooms before it look through."""
    kept = room.interior
    stands = np.array([name == PANE for name in kept.names])[kept.surface]
    return Surfaces(kept.triangles[~stands], kept.reflectance[~stands], kept.surface[~stands])


def _inner_groups(scene: DaylightScene) -> Sequence[WindowGroup]:
    return scene.groups[len(scene.outdoor_groups) :]


def _glass(name: str, tau: float, groups: Sequence[WindowGroup]) -> list[str]:
    """Glass that passes the same at every angle and reflects nothing."""
    material = f"void trans {name}\n0\n0\n7 {tau} {tau} {tau} 0 0 1 1\n"
    if tau == 0:
        material = f"void plastic {name}\n0\n0\n5 0 0 0 0 0\n"
    return [material, *(polygon(name, f"{name}_{i}", t) for i, t in enumerate(_triangles(groups)))]


def _triangles(groups: Sequence[WindowGroup]) -> NDArray[np.float64]:
    found = [window.triangles for group in groups for window in group.windows]
    return np.concatenate(found) if found else np.empty((0, 3, 3))


def main(
    building: Path,
    *,
    space: Sequence[str] = (),
    seeds: int = 4,
    paths: Annotated[int, "of a sensor for each seed"] = 1 << 19,
) -> None:
    """Print three lines for each room that borrows light."""
    building = opened(read_ifc(building, join=[OPEN]))
    variants.activate()
    rooms = [building.space(name) for name in space] or building.spaces
    print("| room | from | | sensors [lx] | three-phase by it |\n|---|---|---|---|---|")
    for room in rooms:
        scene = borrowing_scene(building, room)
        if scene is None:
            continue
        lent = ", ".join(other.label for other in source_rooms(building, room))
        with tempfile.TemporaryDirectory() as name:
            runs = {
                "three-phase": [by_phases(scene, seed) for seed in range(seeds)],
                "paths": [by_paths(scene, paths, seed) for seed in range(seeds)],
                "`rtrace`": [by_radiance(scene, Path(name)) for _ in range(seeds)],
            }
        ours = pooled(runs["three-phase"])[0].mean()
        for who, values in runs.items():
            mean, error = pooled(values)
            cells = (f"{m:.1f} ({100 * e:.1f} %)" for m, e in zip(mean, error, strict=True))
            ratio = f"{ours / mean.mean():.3f}"
            print(f"| {room.label} | {lent} | {who} | {', '.join(cells)} | {ratio} |", flush=True)
