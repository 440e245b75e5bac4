"""What rooms of an IFC file borrow from each other: three phases against `rtrace` in all of them.

    python -m scenes.evidence.validation.inner_glass_ifc BUILDING.ifc [--space NAME ...] [--seeds N]

Every room as `cfs run --inner-glass` has it, its own windows black, with the rooms behind its
glass, the reveals between and their windows, under an overcast sky of 20,000 lx and nothing else
outdoors; all windows pass 0.8, all glass between rooms 0.7, at every angle.  Up to five sensors of
its grid: means over seeds and their standard errors, and the quotient of the sensors' means.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.ifc.building import read_ifc
from bim.model import Building, Space
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.optics import GivenOptics
from mitsuba_cfs.methods.phase_light import PhaseSystems
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from scenes.demo import VENETIAN_BLIND
from scenes.evidence.benchmarks.radiance import polygon, write_surfaces
from scenes.evidence.validation.inner_glass import (
    INNER_TAU,
    TAU,
    illuminance_by_rtrace,
    overcast,
    pooled,
)
from scenes.fenestration.systems import read_system
from scenes.room.daylight import room_scene
from scenes.room.inner_glass import PANE, inner_glass, lending_rooms
from scenes.room.options import SensorGrid
from scenes.room.windows import in_all_windows, room_windows

MOST_SENSORS = 5
EYE = np.eye(KLEMS_FULL.size)
SAMPLING = Sampling(sensor_samples=32768, patch_samples=8192, subdivision=1)


def borrowing_scene(building: Building, space: Space) -> DaylightScene | None:
    """A room and all that it borrows from, with few sensors; None where it borrows nothing."""
    blind = read_system(VENETIAN_BLIND)  # what fills the windows is replaced
    systems = {}
    for room in (space, *lending_rooms(building, space)):
        systems |= in_all_windows(room, blind)
    inner = inner_glass(building, space, systems)
    if inner is None:
        return None
    windows = room_windows(space, systems)
    scene = room_scene(building, space, windows, (SensorGrid(spacing=1.0),), 32, inner)
    few = np.linspace(0, len(scene.points) - 1, MOST_SENSORS).round().astype(int)
    few = np.unique(few)
    chosen = replace(scene, points=scene.points[few], normals=scene.normals[few], view=None)
    return _plain(chosen)


def _plain(scene: DaylightScene) -> DaylightScene:
    """The scene with nothing outdoors, and the same glass everywhere."""
    beyond = []
    for one in scene.beyond:
        behind = _plain(one.scene)
        tau = [TAU] * len(behind.outdoor_groups) + [INNER_TAU] * len(behind.beyond)
        passed = tuple(t * EYE for t in tau)
        beyond.append(
            replace(one, scene=behind, transmission=passed, beam=INNER_TAU * EYE.diagonal())
        )
    return replace(scene, exterior=Surfaces.none(), beyond=tuple(beyond))


def by_phases(scene: DaylightScene, seed: int) -> NDArray[np.float64]:
    """Illuminance of the sensors [S] [lx] by this project's three phases."""
    traced = PhaseScene(scene, replace(SAMPLING, seed=seed), five_phase=False)
    tau = [0.0] * len(scene.outdoor_groups) + [INNER_TAU] * len(scene.beyond)
    light = PhaseSystems(traced, [[GivenOptics(t * EYE)] for t in tau])
    return light.light(overcast()).illuminance()[:, 0]


def by_radiance(scene: DaylightScene, folder: Path) -> NDArray[np.float64]:
    """The same [S] by `rtrace` in all rooms."""
    write_surfaces(scene.interior, folder / "room.rad")
    lines = [*_black(scene.outdoor_groups), *_panes("inner", INNER_TAU, scene)]
    rooms = {id(one.scene): one.scene for one in scene.beyond}
    for number, room in enumerate(_all_behind(rooms.values())):
        write_surfaces(_without_panes(room, scene), folder / f"room{number}.rad")
        lines += _panes(f"inner{number}", INNER_TAU, room)
        lines += _glass(f"window{number}", TAU, room.outdoor_groups)
    (folder / "panes.rad").write_text("\n".join(lines))
    return illuminance_by_rtrace(folder, scene.points, scene.normals)


def _all_behind(rooms) -> Iterator[DaylightScene]:
    for room in rooms:
        yield room
        yield from _all_behind({id(one.scene): one.scene for one in room.beyond}.values())


def _without_panes(room: DaylightScene, before: DaylightScene) -> Surfaces:
    """The room's surfaces but the glass that the rooms before it look through."""
    kept = room.interior
    stands = np.array([name == PANE for name in kept.names])[kept.surface]
    return Surfaces(kept.triangles[~stands], kept.reflectance[~stands], kept.surface[~stands])


def _panes(name: str, tau: float, scene: DaylightScene) -> list[str]:
    return _glass(name, tau, scene.groups[len(scene.outdoor_groups) :])


def _glass(name: str, tau: float, groups) -> list[str]:
    """Glass that passes the same at every angle and reflects nothing."""
    lines = [f"void trans {name}\n0\n0\n7 {tau} {tau} {tau} 0 0 1 1\n"]
    return lines + _polygons(name, groups)


def _black(groups) -> list[str]:
    return ["void plastic black\n0\n0\n5 0 0 0 0 0\n", *_polygons("black", groups)]


def _polygons(material: str, groups: list[WindowGroup]) -> list[str]:
    triangles = [t for group in groups for window in group.windows for t in window.triangles]
    return [polygon(material, f"{material}_{i}", one) for i, one in enumerate(triangles)]


def main(arguments: list[str] | None = None) -> None:
    """Print a line for each room that borrows light."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("building", type=Path)
    parser.add_argument("--space", action="append", default=[])
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_args(arguments)
    building = read_ifc(options.building)
    variants.activate()
    spaces = [building.space(name) for name in options.space] or building.spaces
    print("| room | from | `rtrace` [lx] | three-phase [lx] | quotient of the means |")
    print("|---|---|---|---|---|")
    for space in spaces:
        scene = borrowing_scene(building, space)
        if scene is None:
            continue
        with tempfile.TemporaryDirectory() as name:
            theirs = pooled([by_radiance(scene, Path(name)) for _ in range(options.seeds)])
        ours = pooled([by_phases(scene, seed) for seed in range(options.seeds)])
        lent = ", ".join(room.label for room in lending_rooms(building, space))
        cells = [
            ", ".join(f"{v:.1f} ({100 * e:.1f} %)" for v, e in zip(*one, strict=True))
            for one in (theirs, ours)
        ]
        quotient = ours[0].mean() / theirs[0].mean()
        print(f"| {space.label} | {lent} | {cells[0]} | {cells[1]} | {quotient:.3f} |", flush=True)


if __name__ == "__main__":
    main()
