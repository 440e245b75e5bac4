r"""Rooms with surfaces that reflect like a mirror, by Radiance and by this project: Ev and DGP.

    python -m tests.validation gloss [--cases mirror glass metal floor] [--json FILE]

The room of the dissertation's Table 1 with its window to the north, seen from 2 m behind the
opening under a clear sky, the sun behind the house.  "mirror": a facade of reflectance 0.8 stands
10 m before it and sends the sun back; "glass": the same of panes before something dark, as a facade
of glass is; "metal": of rough metal, alpha 0.15; "floor": a floor of smooth lacquer, Radiance's
`plastic` of specularity 0.05, the sky alone.  Ev by `rtrace` of a point, DGP of `rpict`'s picture
with this Ev (`evalglare -i`); ours by paths and, of the pictures, by the five-phase method.
Radiance sends the sun on from `mirror` alone: its facade of glass is one whose reflectance is that
of the pane at the sun's angle, seen as `glass`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

import mitsuba_cfs as cfs
from mitsuba_cfs import variants
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.gloss import Gloss, lacquer, mirror, pane
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.kernels.scattering import AngularBeam
from mitsuba_cfs.trace.paths.point_in_time import point_in_time
from mitsuba_cfs.trace.paths.scene import PathOptics, PathTracingScene, Sky
from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture
from scenes.cost import room
from tests.benchmarks import radiance
from tests.validation.rendered_scene import RenderedScene, show_rows

EYE, DIRECTION = (-1.8, -2.0, 1.2), (0.0, 1.0, 0.0)
TURN = np.array([-1.0, -1.0, 1.0])  # of the room, its window to the north
FACADE = 10.0  # before the window [m]
BACKING = np.array([0.0, 0.05, 0.0])  # of dark behind panes [m]
SIZE = 200  # [px]
SEEDS = (0, 1, 2)  # of our pictures and phases
SUN = np.array([0.25, -1.0, 0.8]) / np.linalg.norm([0.25, -1.0, 0.8])
SUN_ILLUMINANCE = {"mirror": 80_000.0, "glass": 80_000.0, "metal": 15_000.0, "floor": 0.0}  # normal to it [lx]
SKY_ILLUMINANCE = 12_000.0  # on the ground [lx]
CACHED = "-ps 1 -pa 0 -ss 16 -ab 5 -ad 512 -as 0 -aa 0.2 -ar 32 -lr 8 -lw 1e-3"  # of the pictures
POINT = "-u+ -ss 1e5 -ab 8 -ad 16384 -aa 0 -lr 20 -lw 1e-9"  # of Ev; several rays to each lobe
MATERIALS: dict[str, Gloss] = {
    "mirror": mirror(0.8),
    "glass": pane(1.52, 0.985),
    "metal": mirror(0.6, 0.15),
    "floor": lacquer(0.05),
}


@dataclass(frozen=True)
class Case:
    """A room, what stands before it, and the light of an hour."""

    name: str
    interior: Surfaces
    exterior: Surfaces
    groups: list[WindowGroup]
    patches: np.ndarray  # [P] [cd/m2]
    sun_luminance: float  # [cd/m2]

    @property
    def sky(self) -> Sky:
        """The sky and the sun."""
        return Sky(self.patches, SUN, self.sun_luminance)

    @property
    def lit(self) -> PathTracingScene:
        """The room behind a clear opening."""
        clear = [PathOptics(None, AngularBeam(np.ones(16)))]
        return PathTracingScene(self.interior, self.exterior, self.groups, clear)


@dataclass(frozen=True)
class Outcome:
    """Both programs' figures of a case."""

    case: str
    ev_rtrace: float
    ev_rtrace_error: float
    ev: float  # ours, of the point
    ev_error: float
    ev_picture: float
    ev_five_phase: float  # of its picture
    ev_five_phase_error: float  # these and what follows from several seeds
    ev_five_phase_point: float
    ev_five_phase_point_error: float
    dgp_rpict: float
    dgp_rpict_error: float  # from halves of its pixels
    dgp: float
    dgp_error: float
    dgp_five_phase: float
    dgp_five_phase_error: float
    without: float  # our Ev with the specular part of no surface
    diffuse: float  # our Ev with as much reflected, at normal incidence, but diffusely


def case(name: str) -> Case:
    """One of the cases."""
    gloss = MATERIALS[name]
    interior = room.room()
    interior = replace(interior, triangles=interior.triangles * TURN)
    glass = room.window_groups()[0].windows[0].triangles * TURN
    groups = [WindowGroup("north", (WindowSurface("north", glass),))]
    exterior = interior  # the room as it stands outdoors
    if name == "floor":
        interior = replace(interior, gloss=(gloss, *(None,) * 8))
    else:
        exterior = _with_facade(exterior, gloss)
    patches = cie_patches("clear", ReinhartSky(4), SKY_ILLUMINANCE, sun=SUN)
    return Case(name, interior, exterior, groups, patches, SUN_ILLUMINANCE[name] / SUN_SOLID_ANGLE)


def _with_facade(body: Surfaces, gloss: Gloss) -> Surfaces:
    """The facade as one surface more."""
    x, y, z = 30.0, FACADE, 20.0
    corners = np.array([(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)])
    number = int(body.surface.max()) + 1
    return Surfaces(
        np.concatenate([body.triangles, corners[[[0, 1, 2], [0, 2, 3]]]]),
        np.append(body.reflectance, [0.0, 0.0]),
        np.append(body.surface, [number, number]),
        (),
        (*(None,) * number, gloss),
    )


def rendered(given: Case, folder: Path) -> RenderedScene:
    """A case in a folder, for Radiance."""
    body = len(given.interior.triangles)
    radiance.write_surfaces(given.interior, folder / "room.rad")
    after = np.arange(len(given.exterior.triangles)) >= body
    if given.name == "glass":
        _write_panes(given.exterior.some(after), folder / "outdoors.rad")
    else:
        radiance.write_surfaces(given.exterior.some(after), folder / "outdoors.rad")
    scene = RenderedScene(folder, "room.rad outdoors.rad", CACHED, POINT)
    scene.set_sky(given.patches, 4, SUN, given.sun_luminance)
    return scene


def _write_panes(facade: Surfaces, path: Path) -> None:
    """A facade of `glass` that sends the sun on as `mirror`, and black behind it."""
    (gloss,) = {facade.gloss[i] for i in facade.surface}
    rho = float(gloss.reflectance(abs(SUN[1])))  # the facade looks south
    lines = [
        "void glass panes\n0\n0\n3 .985 .985 .985\n",
        f"void mirror facade\n1 panes\n0\n3 {rho:.9g} {rho:.9g} {rho:.9g}\n",
        "void plastic dark\n0\n0\n5 0 0 0 0 0\n",
    ]
    for i, triangle in enumerate(facade.triangles):
        lines.append(radiance.polygon("facade", f"facade{i}", triangle))
        lines.append(radiance.polygon("dark", f"dark{i}", triangle + BACKING))
    path.write_text("\n".join(lines))


def outcome(name: str, folder: Path, *, size: int = SIZE, points: int = 8) -> Outcome:
    """A case in both programs."""
    given, view = case(name), fisheye(EYE, DIRECTION, size)
    folder.mkdir(parents=True, exist_ok=True)
    theirs = rendered(given, folder)
    ev, ev_error = theirs.eye_illuminance(view, points)
    found, plain, even = (_eye(one, view) for one in (given, _without_gloss(given), _diffuse(given)))
    pictures = [point_in_time_picture(given.lit, given.sky, view, samples=64, seed=seed) for seed in SEEDS]
    halves = theirs.halves(view)
    phases, at_point = zip(*(_five_phase(given, view, seed) for seed in SEEDS), strict=True)
    np.savez(folder / "pictures.npz", ours=pictures[0], theirs=np.mean(halves, axis=0), five_phase=phases[0])
    rated = evaluate(np.mean(halves, axis=0), view, illuminance=ev).dgp
    first, second = (evaluate(half, view, illuminance=ev).dgp for half in halves)
    ours, third = ([evaluate(one, view) for one in of] for of in (pictures, phases))
    return Outcome(
        name,
        ev,
        ev_error,
        float(found.values[0]),
        float(found.standard_error[0]),
        _mean(one.Ev for one in ours)[0],
        *_mean(one.Ev for one in third),
        *_mean(at_point),
        rated,
        abs(first - second) / 2,
        *_mean(one.dgp for one in ours),
        *_mean(one.dgp for one in third),
        float(plain.values[0]),
        float(even.values[0]),
    )


def _mean(values: Iterable[float]) -> tuple[float, float]:
    """Mean of several seeds' values, and its standard error."""
    found = np.array(list(values))
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(len(found)))


def _five_phase(given: Case, view: View, seed: int) -> tuple[np.ndarray, float]:
    """Picture and Ev by five phases; the sun lies on the sky patch that it stands in."""
    reinhart = ReinhartSky(4)
    strength, sun = given.sun_luminance * SUN_SOLID_ANGLE, np.zeros((reinhart.size, 1))
    patch = int(reinhart.index(SUN[None])[0])
    sun[patch] = strength / reinhart.solid_angles[patch]
    hour = np.array([12])
    sky = cfs.AnnualSky(given.patches[:, None] + sun, SUN[None], np.array([strength]), hour, 8760, sun=sun)
    points, normals = np.array([view.position]), np.array([view.direction])
    around = given.interior, given.exterior, given.groups
    scene = cfs.DaylightScene(*around, points, normals, view=view)
    sampling = cfs.Sampling(outdoor_samples=16, view_samples=16, seed=seed)
    traced = cfs.phase_matrices(scene, sampling)
    clear = cfs.AngularOptics(np.ones(64))
    light = cfs.phase_light(traced, [[clear]], sky)
    shown = pictures_in_state(light, np.array([0]), [0])
    picture = np.zeros(view.width * view.height, dtype=np.float32)
    picture[shown.pixels] = shown.values(np.array([0]))[0]
    return picture.reshape(view.height, view.width), float(cfs.illuminance(light)[0, 0])


def _eye(given: Case, view: View):
    return point_in_time(
        given.lit, given.sky, [view.position], [view.direction], samples=2**19, stopping=Stopping(batches=8)
    )


def _without_gloss(given: Case) -> Case:
    bare = (replace(s, gloss=()) for s in (given.interior, given.exterior))
    return replace(given, **dict(zip(("interior", "exterior"), bare, strict=True)))


def _diffuse(given: Case) -> Case:
    """As gloss was taken before: a reflectance that scatters evenly."""
    even = []
    for surfaces in (given.interior, given.exterior):
        glosses = surfaces.gloss or (None,) * (int(surfaces.surface.max()) + 1)
        more = np.array([0.0 if gloss is None else gloss.at_normal for gloss in glosses])
        rho = surfaces.reflectance + more[surfaces.surface]
        even.append(replace(surfaces, reflectance=rho, gloss=()))
    return replace(given, interior=even[0], exterior=even[1])


def main(
    *,
    cases: Annotated[Sequence[str], MATERIALS] = tuple(MATERIALS),
    size: int = SIZE,
    points: Annotated[int, "times that rtrace finds Ev"] = 8,
    json_: Path | None = None,
) -> None:
    """Print the table."""
    variants.activate()

    def rows(folder: Path) -> Iterator[Outcome]:
        for name in cases:
            yield outcome(name, folder / name, size=size, points=points)

    show_rows(json_, rows, lambda row: json.dumps(asdict(row), indent=1))
