"""A building as one glTF file for viewing: rooms, glass, what stands outdoors."""

from __future__ import annotations

from os import PathLike

import numpy as np
import trimesh
from numpy.typing import NDArray

from bim.model import Building
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
    """Write a binary glTF (.glb): one node for each kind of face of each room, normals inwards."""
    scene = trimesh.Scene()
    for space in building.spaces:
        for kind in COLOURS:
            parts = [face.triangles for face in space.faces if face.kind == kind]
            if kind == "glass":
                parts = [window.triangles for window in space.windows]
            if parts:
                _add(scene, f"{space.label} {kind}", np.concatenate(parts)[:, ::-1], kind)
        if space.furniture:
            pieces = np.concatenate([piece.triangles for piece in space.furniture])
            _add(scene, f"{space.label} furniture", pieces, "furniture")
    if outdoors and building.elements:
        triangles = np.concatenate([element.triangles for element in building.elements])
        _add(scene, "outdoors", triangles, "outdoors")
    scene.apply_transform(TO_GLTF)
    write_bytes(path, scene.export(file_type="glb"))


def _add(scene: trimesh.Scene, name: str, triangles: NDArray[np.float64], kind: str) -> None:
    mesh = trimesh.Trimesh(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False
    )
    opacity = COLOURS[kind][3]
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            name=kind,
            baseColorFactor=COLOURS[kind],
            metallicFactor=0.0,
            roughnessFactor=1.0,
            doubleSided=True,
            alphaMode="OPAQUE" if opacity == 255 else "BLEND",
        )
    )
    scene.add_geometry(mesh, node_name=name, geom_name=name)
