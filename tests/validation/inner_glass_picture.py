"""A room lit through glass of another one: its luminance picture beside Radiance's `rpict`.

    python -m tests.validation inner_glass_picture [BUILDING.ifc --space NAME]
        [--size PIXELS] [--rays N] [--bounces N] [--out FOLDER]

Without a building: a corridor of 4 x 4 x 3 m without a window, behind glass of 3.2 x 2.3 m to a
room with one (`inner_glass`).  Of a building: a room as `cfs run --inner-glass` has it, its own
windows black, with nothing else outdoors (`inner_glass_ifc`).  The same sky of patches for both,
and for Mitsuba's integrator `path`, which follows light to its end.
Mean luminance of the picture and of its parts: the glass, and what faces up, down and aside.  In
the folder: both pictures as .hdr, and beside each other as pictures.png, in one colour scale.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from bim.doorways import opened
from bim.ifc.building import read_ifc
from bim.ifc.corrections import OPEN
from bim.rays import ray_mesh
from bim.sensors import view_point
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import View, fisheye, pixel_directions, pixel_solid_angles
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.methods.point_in_time import path_picture
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.trace.kernels.sampling import spread_rays
from tests.validation import inner_glass, inner_glass_ifc
from tests.validation.cut_groups import Quads
from tests.validation.inner_glass import luminance_by_path, overcast
from tests.validation.rendered_scene import RenderedScene

EYE, SOUTH = (2.6, 8.2, 1.6), (-0.1, -1.0, 0.0)  # in the corridor of `inner_glass`
SAMPLING = Sampling(patch_samples=8192, view_samples=64, outdoor_samples=64, subdivision=1)
CACHED = "-ps 1 -ss 1 -ad 2048 -as 0 -aa 0.2 -ar 16 -lr 12 -lw 1e-5"
POINT = ""  # no sensors are asked for
PARTS = ("glass", "floor", "ceiling", "walls")
Writer = Callable[[Path], None]
Case = tuple[DaylightScene, list[float], Writer, tuple[Quads, Quads]]


def own_corridor(size: int) -> Case:
    """The corridor with its view, what its panes pass, what writes it for Radiance; all rooms."""
    scene = replace(inner_glass.scene(2), view=fisheye(EYE, SOUTH, size))
    whole = inner_glass.whole_rooms(2)
    return scene, [inner_glass.INNER_TAU], lambda folder: inner_glass.write_rooms(2, folder), whole


def room_of(path: Path, name: str, size: int) -> Case:
    """The same of a room of an IFC file."""
    building = opened(read_ifc(path, join=[OPEN]))
    space = building.space(name)
    scene = inner_glass_ifc.borrowing_scene(building, space)
    if scene is None:
        raise SystemExit(f"space {space.label}: no glass to another room that daylight reaches")
    position, _ = view_point(space)
    panes = np.concatenate([w.triangles for g in _inner(scene) for w in g.windows])
    towards = (panes.mean(axis=(0, 1)) - position) * [1.0, 1.0, 0.0]
    scene = replace(scene, view=fisheye(position, towards / np.linalg.norm(towards), size))
    taus = [0.0] * len(scene.outdoor_groups) + inner_glass_ifc.inner_taus(scene)
    whole = inner_glass_ifc.whole_rooms(scene)
    return scene, taus, lambda folder: inner_glass_ifc.write_rooms(scene, folder), whole


def _inner(scene: DaylightScene) -> Sequence:
    return scene.groups[len(scene.outdoor_groups) :]


def ours(scene: DaylightScene, taus: Sequence[float]) -> NDArray[np.float64]:
    """Luminance [ny, nx] [cd/m2] by this project's three phases."""
    traced = phase_matrices(scene, SAMPLING, five_phase=False)
    systems = [[MatrixOptics(tau * np.eye(KLEMS_FULL.size))] for tau in taus]
    made = pictures_in_state(phase_light(traced, systems, overcast()), np.arange(1), [0] * len(taus))
    view = scene.view
    picture = np.zeros(view.width * view.height)
    picture[made.pixels] = made.values(np.arange(1))[0]
    return picture.reshape(view.height, view.width)


def by_rpict(write: Writer, view: View, bounces: int, folder: Path) -> NDArray[np.float64]:
    """The same by `rpict` in all rooms at once, each pixel the mean of sixteen."""
    write(folder)
    files = " ".join(sorted(path.name for path in folder.glob("*.rad")))
    rendered = RenderedScene(folder, files, f"{CACHED} -ab {bounces}", POINT)
    rendered.set_sky(overcast().whole[:, 0], 1, (0.0, 0.0, 1.0), 0.0)
    return path_picture(rendered, view)


def by_path(rooms: tuple[Quads, Quads], view: View, rays: int) -> NDArray[np.float64]:
    """The same by Mitsuba's `path` in all rooms at once, by so many rays spread over each pixel."""
    pixels = np.flatnonzero(pixel_directions(view)[1].reshape(-1))
    ways, exists = spread_rays(view, pixels, rays)
    found = np.zeros(len(ways))
    found[exists] = luminance_by_path(*rooms, view.position, ways[exists], 1)
    picture = np.zeros(view.width * view.height)
    picture[pixels] = found.reshape(len(pixels), rays).mean(axis=1)
    return picture.reshape(view.height, view.width)


def parts(scene: DaylightScene) -> dict[str, NDArray[np.bool_]]:
    """Which pixels [ny, nx] see what first; those beside the glass' edge see both and are none."""
    panes = np.concatenate([w.triangles for g in _inner(scene) for w in g.windows])
    own = np.concatenate([scene.interior.triangles, panes])
    directions, inside = pixel_directions(scene.view)
    shape = inside.shape
    flat = directions.reshape(-1, 3)
    _, hit = ray_mesh(own).first_hits(np.tile(scene.view.position, (len(flat), 1)), flat)
    normal = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    level = np.abs(normal[:, 2]) > 0.9 * np.linalg.norm(normal, axis=1)
    seen = inside.ravel() & (hit >= 0)
    glass = seen & (hit >= len(scene.interior.triangles))
    flats = seen & ~glass & level[hit]
    found = (glass, flats & (flat[:, 2] < 0), flats & (flat[:, 2] > 0), seen & ~glass & ~flats)
    beside = binary_dilation(glass.reshape(shape), np.ones((3, 3)))
    masks = {name: mask.reshape(shape) for name, mask in zip(PARTS, found, strict=True)}
    return {name: mask if name == "glass" else mask & ~beside for name, mask in masks.items()}


def show(pictures: dict[str, NDArray[np.float64]], path: Path) -> None:
    """Both pictures beside each other in one logarithmic scale of colours."""
    top = max(float(np.quantile(picture, 0.999)) for picture in pictures.values())
    figure, axes = plt.subplots(1, len(pictures), figsize=(9, 4.4), layout="constrained")
    for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
        image = axis.imshow(np.maximum(picture, top / 1e3), norm="log", vmin=top / 1e3, vmax=top)
        axis.set_title(name)
        axis.set_axis_off()
    figure.colorbar(image, ax=axes, label="luminance [cd/m²]", shrink=0.8)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main(
    building: Path | None = None,
    *,
    space: str = "",
    size: Annotated[int, "pixels of a side"] = 200,
    rays: Annotated[int, "of a pixel for `path`"] = 512,
    bounces: Annotated[int, "-ab of rpict"] = 6,
    out: Annotated[Path | None, "folder of the pictures"] = None,
) -> None:
    """Print the table and write the pictures."""
    variants.activate()
    if building is None:
        case = own_corridor(size)
    else:
        case = room_of(building, space, size)
    scene, taus, write, rooms = case
    view, pictures = scene.view, {"this project": ours(scene, taus)}
    with tempfile.TemporaryDirectory() as folder:
        pictures["rpict"] = by_rpict(write, view, bounces, Path(folder))
    pictures["path"] = by_path(rooms, view, rays)
    print_table(scene, pictures)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for name, picture in pictures.items():
            write_hdr(out / f"{name.replace(' ', '_')}.hdr", picture, view=view)
        show(pictures, out / "pictures.png")


def print_table(scene: DaylightScene, pictures: dict[str, NDArray[np.float64]]) -> None:
    """Mean luminance of the parts of each picture."""
    weight, regions = pixel_solid_angles(scene.view), parts(scene)
    regions = {"whole": np.logical_or.reduce(list(regions.values())), **regions}
    print("| part | of the view | ours [cd/m2] | `rpict` | `path` | ours by `rpict` | by `path` |")
    print("|---|---|---|---|---|---|---|")
    for name, mask in regions.items():
        share = weight[mask].sum() / weight[regions["whole"]].sum()
        if share == 0:
            continue
        mine, rpict, path = (np.average(p[mask], weights=weight[mask]) for p in pictures.values())
        print(
            f"| {name} | {100 * share:.0f} % | {mine:.2f} | {rpict:.2f} | {path:.2f} "
            f"| {mine / rpict:.3f} | {mine / path:.3f} |",
            flush=True,
        )
