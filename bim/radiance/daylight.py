"""A Radiance scene as the tracer reads it: opaque triangles, apertures and their glass."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bim.fenestration import PlainGlass
from bim.radiance.materials import RadianceMaterial
from bim.radiance.scene import RadianceObject, RadianceScene
from bim.rays import RayMesh, hemisphere, ray_mesh
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import pane_shares
from mitsuba_cfs.surfaces import Surfaces, WindowSurface

ANGLES = 512  # even steps of the cosine of incidence
RAYS = 256  # from each triangle of an aperture to either side
BEFORE = 1e-3  # distance from an aperture at which its rays start [m]
LAYERS = 0.5  # panes this near are layers of one window [m]
CLEARLY = 1.5  # times the sky of the other side


def opaque_surfaces(scene: RadianceScene, facades: Iterable[str] = ()) -> Surfaces:
    """Everything opaque with its diffuse reflectance and gloss; surface i is the i-th such object.

    Args: facades: materials or modifiers of panes that stand before something dark: they mirror
        what is before them, and nothing passes.
    """
    parts = opaque_objects(scene, scene.of_modifiers(facades))
    if not parts:
        return Surfaces.none()
    counts = [len(part.triangles) for part in parts]
    glosses = tuple(part.material.gloss for part in parts)
    return Surfaces(
        np.concatenate([part.triangles for part in parts]),
        np.repeat([part.material.diffuse for part in parts], counts),
        np.repeat(np.arange(len(parts)), counts),
        tuple(part.name for part in parts),
        glosses if any(glosses) else (),
    )


def opaque_objects(
    scene: RadianceScene, facades: Iterable[RadianceObject] = (), panes: Iterable[RadianceObject] = ()
) -> list[RadianceObject]:
    """The objects of `opaque_surfaces`, in its order, without translucent panes."""
    dark, clear = {id(thing) for thing in facades}, {id(thing) for thing in panes}
    return [o for o in scene.objects if (o.material.is_opaque and id(o) not in clear) or id(o) in dark]


def scene_windows(scene: RadianceScene, modifiers: Iterable[str]) -> list[WindowSurface]:
    """The surfaces of these materials or modifiers as windows, in the scene's order.

    Outdoors is the side from which more of the sky is seen; other panes hide it, but those within
    half a metre, which are layers of the same window.

    Raises: `DataError` for a modifier that no surface has, and for a surface that sees about as
        much sky on either side.
    """
    return list(map(pane_sides(scene), scene.of_modifiers(modifiers)))


def pane_sides(
    scene: RadianceScene, translucent: Iterable[RadianceObject] = ()
) -> Callable[[RadianceObject], WindowSurface]:
    """A function from a pane of the scene to its surface seen from outdoors.

    Args: translucent: opaque to the tracer where they are no windows, and not here.
    """
    walls = opaque_objects(scene, panes=translucent)
    solid = ray_mesh(np.concatenate([np.empty((0, 3, 3)), *(o.triangles for o in walls)]))
    known = {id(o) for o in walls}
    clear = [o.triangles for o in scene.objects if id(o) not in known]
    panes = ray_mesh(np.concatenate([np.empty((0, 3, 3)), *clear]))
    return partial(_window, solid=solid, panes=panes)


def _window(thing: RadianceObject, solid: RayMesh, panes: RayMesh) -> WindowSurface:
    normal = np.cross(*np.diff(thing.triangles[0], axis=0))
    normal /= np.linalg.norm(normal)
    front, back = (_sky_seen(thing.triangles, side * normal, solid, panes) for side in (1, -1))
    if max(front, back) <= CLEARLY * min(front, back):
        raise DataError(
            f"sees the sky on either side ({front:.0%}, {back:.0%}): which one is outdoors?",
            file=f"{thing.primitive.file}:{thing.primitive.line}",
            element=thing.name,
        )
    outwards = thing.triangles if front > back else thing.triangles[:, ::-1]
    return WindowSurface(thing.name, outwards)


def _sky_seen(triangles: NDArray[np.float64], normal: NDArray[np.float64], solid: RayMesh, panes: RayMesh) -> float:
    """Share of a hemisphere's rays before triangles [T, 3, 3] that meet nothing and lead up."""
    rays = np.tile(hemisphere(normal, RAYS), (len(triangles), 1))
    starts = np.repeat(triangles.mean(axis=1) + BEFORE * normal, RAYS, axis=0)
    is_free = solid.first_hits(starts, rays)[1] < 0
    is_free &= panes.first_hits(starts + LAYERS * rays, rays)[1] < 0
    return float(np.mean(is_free & (rays[:, 2] > 0)))


def plain_glass(panes: Sequence[RadianceObject], beside: NDArray[np.float64] | None = None) -> PlainGlass | None:
    """The panes of a window, the outer one first; None where one is no `glass` without pattern.

    Args: beside: share of light that meets the innermost alone, by angle of incidence.
    """
    if any(pane.material.kind != "glass" or len(pane.definitions) > 1 for pane in panes):
        return None
    each = tuple((p.material.transmissivity, p.material.index) for p in panes)
    return PlainGlass(each, () if beside is None else tuple(beside.tolist()))


def glass_shares(material: RadianceMaterial) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance [512] of a `glass` at even steps of the cosine, 0 to 1.

    `mitsuba_cfs.AngularOptics` takes them as `straight` and `mirrored`.

    Raises: `DataError` for another material.

    Source: "The RADIANCE 5.1 Synthetic Imaging System", 3.2: the inner transmittance straight on,
    Fresnel's equations with all reflections between the two faces.
    """
    if material.kind != "glass":
        raise DataError(f"is {material.kind}, not glass: give a system", element=material.name)
    steps = np.linspace(0.0, 1.0, ANGLES)
    return pane_shares(steps, material.index, material.transmissivity)
