"""Rooms by the light of November 2026 and by today's: pairs of a scene, what fills it, and an hour.

Only what an option, other data or a plain rule that is still in the code can do as it was done.
An office of 4 x 6 x 3 m.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from bim.defaults import CLEAR_GLAZING, GLASS_REFLECTANCE
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.generate import generate_tensor_tree
from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin
from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.methods.optics import MatrixOptics, States
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.trace.kernels.scattering import WINDOW_UP, PluginScattering
from tests.validation.tree_peak import fabric

SIZE = 110  # [px]
SAMPLES = 8  # paths of a pixel
SENSOR_DEPTHS, SENSOR_HEIGHT = np.arange(0.5, 6.0, 0.5), 0.85  # [m]
LEVELS, TREE_SAMPLES = 4, 1024  # of the tree of a fabric
CLEAR = cfs.Glazing("clear", 0.78, 0.14, 0.14)
DARK = cfs.Glazing("dark", 0.10, 0.1, 0.1)


@dataclass(frozen=True)
class Drawn:
    """A room, what fills its windows, and an hour."""

    scene: cfs.DaylightScene
    systems: Sequence[States]
    sky: cfs.AnnualSky
    window_parts: int = 0  # of the window; 0: as many as the error asks for
    beam_of_patches: bool = False  # what the room reflects of the sun's beam


def glass(of: cfs.Glazing = CLEAR) -> States:
    """One state of a glazing."""
    return [cfs.BsdfOptics(cfs.specular_klems(of, cfs.KLEMS_FULL))]


def sky(sun: tuple[float, float, float], direct: float, diffuse: float, **more) -> cfs.AnnualSky:
    """One hour, 21 June.

    Args: sun: towards it; direct, diffuse: irradiances [W/m2].
    """
    towards = np.array([sun]) / np.linalg.norm(sun)
    return cfs.given_sky(towards, [direct], [diffuse], day_of_year=172, **more)


def office(
    facing_deg: float = 180.0, windows: Sequence[WindowRectangle] = (), exterior=None,
    size: int = SIZE,
) -> cfs.DaylightScene:  # fmt: skip
    """The room with its eye 3 m behind the window; a group for each window."""
    chosen = {"windows": windows} if windows else {}
    space = shoebox(4.0, 6.0, 3.0, facing_deg=facing_deg, **chosen).spaces[0]
    window = space.windows[0]
    eye = window.centre - 3.0 * window.normal
    view = cfs.fisheye((eye[0], eye[1], 1.2), tuple(window.normal), size)
    groups = [
        cfs.WindowGroup(surface.name, (surface,))
        for group in window_groups(space)
        for surface in group.windows
    ]
    groups.sort(key=lambda group: group.name)
    outdoors = cfs.Surfaces.none() if exterior is None else exterior
    return cfs.DaylightScene(interior_surfaces(space), outdoors, groups, view=view)


def plate(corners: Sequence[tuple], reflectance: float, gloss: cfs.Gloss | None) -> cfs.Surfaces:
    """A quadrilateral outdoors."""
    a, b, c, d = map(np.array, corners)
    return cfs.Surfaces(
        np.array([[a, b, c], [a, c, d]], dtype=float), np.full(2, reflectance),
        np.zeros(2, dtype=np.int64), (), (gloss,) if gloss is not None else (),
    )  # fmt: skip


def mirrors() -> tuple[Drawn, Drawn]:
    """A north office before a sunlit facade of glass, 12 m away: 15 % scattered, and mirrored."""
    corners = [(-15, 12, 0), (-15, 12, 14), (20, 12, 14), (20, 12, 0)]
    noon = sky((0.2, -1.0, 1.1), 800.0, 100.0)
    pair = ((GLASS_REFLECTANCE, None), (0.0, CLEAR_GLAZING))
    house = office(0.0)
    facades = (plate(_turned(corners), *one) for one in pair)
    scenes = (replace(house, exterior=beside(house.interior, facade)) for facade in facades)
    before, now = (Drawn(scene, [glass()], noon) for scene in scenes)
    return before, now


def beside(house: cfs.Surfaces, facade: cfs.Surfaces) -> cfs.Surfaces:
    """The house as it stands outdoors, and a facade of one surface before it."""
    number = int(house.surface.max()) + 1
    gloss = (*(None,) * number, facade.gloss[0]) if facade.gloss else ()
    return cfs.Surfaces(
        np.concatenate([house.triangles, facade.triangles]),
        np.concatenate([house.reflectance, facade.reflectance]),
        np.concatenate([house.surface, facade.surface + number]),
        (),
        gloss,
    )


def _turned(corners: Sequence[tuple]) -> list[tuple]:
    """Before a window to the north of the room that the shoebox puts at the origin."""
    return [(x - 4, y, z) for x, y, z in corners]


def bands() -> tuple[Drawn, Drawn]:
    """Three bands of panes, clear below, dark before the eye, clear above; before: the mean."""
    windows = [WindowRectangle(0.3, sill, 3.4, 0.7) for sill in (0.2, 1.0, 1.8)]
    scene, noon = office(windows=windows), sky((0.2, -1.0, 1.0), 800.0, 100.0)
    mean = cfs.Glazing("mean", (2 * 0.78 + 0.10) / 3, 0.13, 0.13)
    return (
        Drawn(scene, [glass(mean)] * 3, noon),
        Drawn(scene, [glass(), glass(DARK), glass()], noon),
    )


def overhang() -> Drawn:
    """A slab 2 m deep over the window, overcast; sensors in the middle line of the room."""
    slab = plate([(-1, -2, 2.75), (5, -2, 2.75), (5, 0, 2.75), (-1, 0, 2.75)], 0.3, None)
    scene = office(exterior=slab)
    points = np.array([(2.0, depth, SENSOR_HEIGHT) for depth in SENSOR_DEPTHS])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    scene = replace(scene, points=points, normals=up, view=None)
    return Drawn(scene, [glass()], sky((0.0, -0.1, 1.0), 0.0, 150.0))


def windows() -> tuple[Drawn, Drawn]:
    """The window black to the light of the room, and with its glass."""
    now = Drawn(office(), [glass()], sky((0.2, -1.0, 1.0), 800.0, 100.0))
    (optics,) = glass()
    black = MatrixOptics(optics.transmission, optics.scattering, optics.paths)
    return replace(now, systems=[[black]]), now


def ground() -> tuple[Drawn, Drawn]:
    """The plain to the horizon by gendaylit, and as it reflects a fifth of sun and sky."""
    before, now = (
        Drawn(office(), [glass()], sky((0.9, 0.3, 0.7), 800.0, 100.0, ground=name))
        for name in ("gendaylit", "reflected")
    )
    return before, now


def beam() -> tuple[Drawn, Drawn]:
    """The sun at 66 degrees to the glass: its patch, 65 to 75 degrees, passes less in the mean."""
    now = Drawn(office(), [glass()], sky((0.0, -0.41, 0.91), 800.0, 100.0))
    return replace(now, beam_of_patches=True), now


def tree() -> tuple[Drawn, Drawn]:
    """The sun behind a fabric of which 3 % is open: its beam as wide as a cell of the tree."""
    trees, _ = generate_tensor_tree(fabric(), LEVELS, samples=TREE_SAMPLES, seed=1)
    scene, noon = office(), sky((0.15, -1.0, 0.3), 800.0, 100.0)
    known = cfs.BsdfOptics(cfs.klems_of(trees[0]), trees[0])
    wide = MatrixOptics(known.transmission, spread(trees[0]), reflection=known.reflection)
    return Drawn(scene, [[wide]], noon), Drawn(scene, [[known]], noon)


def spread(bsdf: Bsdf) -> PluginScattering:
    """A tensor tree whose beam is part of what it scatters."""
    import mitsuba as mi

    return PluginScattering(mi.load_dict(tensor_tree_plugin(bsdf, up=WINDOW_UP)), key=bsdf)


PAIRS: dict[str, Callable[[], tuple[Drawn, Drawn]]] = {
    "mirrors": mirrors, "bands": bands, "beam": beam, "tree": tree,
    "windows": windows, "ground": ground,
}  # fmt: skip


def lit(drawn: Drawn) -> cfs.PhaseLight:
    """The light of the hour by five phases."""
    sampling = cfs.Sampling(view_samples=SAMPLES, window_parts=drawn.window_parts)
    matrices = cfs.phase_matrices(drawn.scene, sampling, needs=["DGP"])
    if drawn.beam_of_patches:  # no elements of the room's surfaces take it at the sun's own angle
        matrices = replace(matrices, view=replace(matrices.view, elements=None))
    return cfs.phase_light(matrices, drawn.systems, drawn.sky, needs=["DGP"])


def picture(drawn: Drawn) -> tuple[NDArray[np.float32], cfs.GlareResult]:
    """The picture of the hour and its glare."""
    light, view = lit(drawn), drawn.scene.view
    hour, state = np.array([0]), [0] * len(drawn.systems)
    shown = pictures_in_state(light, hour, state)
    values, discs = shown.without_disc(hour)
    bare, whole = (full_picture(v[0], shown.pixels, view) for v in (values, shown.values(hour)))
    return whole, cfs.evaluate(bare, view, disc=discs[0])
