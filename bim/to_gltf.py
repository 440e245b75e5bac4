"""A building as one glTF file for viewing: rooms, glass, surroundings."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike

import numpy as np
import trimesh
from numpy.typing import NDArray

from bim.gloss_materials import gltf_factors
from bim.model import Building, Element, Face
from mitsuba_cfs.files import write_bytes

COLOURS = {  # red, green, blue, opacity, 0 to 255
    "floor": (181, 137, 0, 255),
    "ceiling": (230, 230, 230, 120),
    "roof": (203, 75, 22, 120),
    "wall": (238, 232, 213, 160),
    "door": (108, 113, 196, 255),
    "window frame": (42, 161, 152, 255),
    "reveal": (133, 153, 0, 255),
    "glass": (38, 139, 210, 130),
    "furniture": (147, 161, 161, 255),
    "outdoors": (150, 150, 150, 90),
}
# glTF has y up, and its front along +z: east, up, south
TO_GLTF = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def write_gltf(building: Building, path: str | PathLike[str], *, outdoors: bool = True) -> None:
    """Write a binary glTF (.glb): a node for each kind of face and gloss of each room.

    Normals point into the rooms.  Colours tell the kinds apart and are not those of the surfaces.
    """
    scene = trimesh.Scene()
    for space in building.spaces:
        for kind in COLOURS:
            parts = [face for face in space.faces if face.kind == kind]
            _add_parts(scene, f"{space.label} {kind}", parts, kind, -1)
        if space.windows:
            triangles = np.concatenate([window.triangles for window in space.windows])
            _add(scene, f"{space.label} glass", triangles[:, ::-1], "glass")
        _add_parts(scene, f"{space.label} furniture", space.furniture, "furniture")
    if outdoors:
        _add_parts(scene, "outdoors", building.elements, "outdoors")
    scene.apply_transform(TO_GLTF)
    write_bytes(path, scene.export(file_type="glb"))


def _add_parts(scene: trimesh.Scene, name: str, parts: Sequence[Face | Element], kind: str, turn: int = 1) -> None:
    """A node of all parts without gloss, and one for each kind of gloss; `turn` -1: seen inside."""
    kinds: dict[tuple[float, float], list[NDArray[np.float64]]] = {}
    for part in parts:
        factors = gltf_factors(part.reflectance_visible, part.gloss)
        kinds.setdefault(factors, []).append(part.triangles[:, ::turn])
    for number, (factors, triangles) in enumerate(sorted(kinds.items())):
        glossy = factors != gltf_factors(0.0, None)
        label = f"{name} gloss {number}" if glossy else name
        _add(scene, label, np.concatenate(triangles), kind, factors)


def _add(
    scene: trimesh.Scene,
    name: str,
    triangles: NDArray[np.float64],
    kind: str,
    factors: tuple[float, float] = (0.0, 1.0),  # metallic, roughness
) -> None:
    mesh = trimesh.Trimesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False)
    opacity = COLOURS[kind][3]
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            name=kind,
            baseColorFactor=COLOURS[kind],
            metallicFactor=factors[0],
            roughnessFactor=factors[1],
            doubleSided=True,
            alphaMode="OPAQUE" if opacity == 255 else "BLEND",
        )
    )
    scene.add_geometry(mesh, node_name=name, geom_name=name)
