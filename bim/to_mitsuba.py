"""A room as a Mitsuba scene: one XML file and PLY meshes, rendered by `mi.load_file` as it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import trimesh
from numpy.typing import NDArray

from bim.gloss_materials import mitsuba_bsdf
from bim.model import Building, Space, Window
from bim.sensors import view_point
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.files import replacing, write_bytes
from mitsuba_cfs.gloss import Gloss

FIELD_OF_VIEW_DEG = 90.0
PIXELS, SAMPLES, DEPTH = 512, 256, 8
GLASS_INDEX = 1.52  # refractive index of the plain panes that the glass is drawn as


def write_mitsuba(
    space: Space,
    building: Building,
    folder: str | PathLike[str],
    *,
    band: str = "visible",
    bsdfs: Mapping[str, BsdfFile] | None = None,
) -> Path:
    """Write `scene.xml` and its meshes into a folder; the path of the XML.

    The room's faces by kind, reflectance and gloss, its windows (shape `glass_*`) with their BSDF
    or, where none is known, as plain panes, the surroundings, a sky of radiance 1 all round,
    and a camera in the middle of the room that looks at its biggest window.

    Args:
        band: reflectances of "visible" or "solar".
        bsdfs: of windows, by GUID; then the scene is loaded after `mitsuba_cfs.bsdf.plugin` and
            `mitsuba_cfs.bsdf.tensor_plugin` are imported, which define these plugins.
    """
    folder = Path(folder)
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    own = {window.guid for window in space.windows}
    outdoors = [element for element in building.elements if element.guid not in own]
    kinds: dict[tuple[str, float, Gloss | None], list[NDArray[np.float64]]] = {}
    pieces = [
        *((f"room_{f.kind.replace(' ', '_')}", f, f.triangles[:, ::-1]) for f in space.faces),
        *(("furniture", piece, piece.triangles) for piece in space.furniture),
        *(("outdoors", element, element.triangles) for element in outdoors),
    ]  # the room's normals point into it
    for name, part, triangles in pieces:
        kind = name, round(part.reflectance(band), 4), part.gloss
        kinds.setdefault(kind, []).append(triangles)
    scene = ElementTree.Element("scene", version="3.0.0")
    _camera(scene, space)
    ElementTree.SubElement(scene, "emitter", type="constant", id="sky").append(
        ElementTree.Element("spectrum", name="radiance", value="1")
    )
    for number, ((name, reflectance, gloss), triangles) in enumerate(kinds.items()):
        label = f"{name}_{reflectance:.4f}" + ("" if gloss is None else f"_gloss_{number}")
        shape = _mesh(scene, folder, label, triangles)
        both = ElementTree.SubElement(shape, "bsdf", type="twosided")
        both.append(mitsuba_bsdf(reflectance, gloss))
    for number, window in enumerate(space.windows):
        shape = _mesh(scene, folder, f"glass_{number}", [window.triangles])
        known = (bsdfs or {}).get(window.guid)
        if known is None:
            pane = ElementTree.SubElement(shape, "bsdf", type="thindielectric")
            ElementTree.SubElement(pane, "float", name="int_ior", value=str(GLASS_INDEX))
        else:
            write_bsdf_xml(known, folder / f"glass_{number}.xml")
            _known(shape, known, f"glass_{number}.xml", window)
    ElementTree.indent(scene)
    path = folder / "scene.xml"
    with replacing(path) as part:
        ElementTree.ElementTree(scene).write(part, encoding="utf-8", xml_declaration=True)
    return path


def _known(shape: ElementTree.Element, bsdf: BsdfFile, file: str, window: Window) -> None:
    """The BSDF plugin of a window, whose up is the world's, or north in a level window."""
    is_tree = isinstance(bsdf.band("Visible"), TensorTreeBsdf)
    kind = "tensor_tree_bsdf" if is_tree else "klems_bsdf"
    plugin = ElementTree.SubElement(shape, "bsdf", type=kind)
    ElementTree.SubElement(plugin, "string", name="filename", value=file)
    up = window_frame(window.normal, window.up)[1]
    ElementTree.SubElement(plugin, "vector", name="up", value=_numbers(up))
    ElementTree.SubElement(plugin, "boolean", name="peak", value="true")


def _camera(scene: ElementTree.Element, space: Space) -> None:
    """Integrator, and a perspective camera at the room's view point."""
    integrator = ElementTree.SubElement(scene, "integrator", type="path")
    ElementTree.SubElement(integrator, "integer", name="max_depth", value=str(DEPTH))
    position, direction = view_point(space)
    sensor = ElementTree.SubElement(scene, "sensor", type="perspective")
    ElementTree.SubElement(sensor, "float", name="fov", value=str(FIELD_OF_VIEW_DEG))
    ElementTree.SubElement(sensor, "float", name="near_clip", value="0.001")
    place = ElementTree.SubElement(sensor, "transform", name="to_world")
    ElementTree.SubElement(
        place, "lookat", origin=_numbers(position), target=_numbers(position + direction), up="0, 0, 1"
    )
    sampler = ElementTree.SubElement(sensor, "sampler", type="independent")
    ElementTree.SubElement(sampler, "integer", name="sample_count", value=str(SAMPLES))
    film = ElementTree.SubElement(sensor, "film", type="hdrfilm")
    for name in ("width", "height"):
        ElementTree.SubElement(film, "integer", name=name, value=str(PIXELS))


def _mesh(
    scene: ElementTree.Element, folder: Path, label: str, triangles: Sequence[NDArray[np.float64]]
) -> ElementTree.Element:
    """A flat-shaded PLY shape of all the triangles, written and added to the scene."""
    corners = np.concatenate(triangles).reshape(-1, 3)
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    relative = f"meshes/{label}.ply"
    write_bytes(folder / relative, mesh.export(file_type="ply", vertex_normal=False))
    shape = ElementTree.SubElement(scene, "shape", type="ply", id=label)
    ElementTree.SubElement(shape, "string", name="filename", value=relative)
    ElementTree.SubElement(shape, "boolean", name="face_normals", value="true")
    return shape


def _numbers(values: NDArray[np.float64]) -> str:
    return ", ".join(f"{value:.6f}" for value in values)
