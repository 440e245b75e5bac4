"""BCF topics of rooms that miss a criterion: a viewer selects the room in the model.

Source: buildingSMART, BIM Collaboration Format 2.1 (markup.xsd, visinfo.xsd, version.xsd).
"""

from __future__ import annotations

import datetime
import uuid
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.linalg import inv
from numpy.typing import NDArray

from bim.building_file import is_ifc
from bim.sensors import view_point
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import replacing
from scenes.comply.results import CheckedRoom, Compliance
from scenes.comply.tables import missed

VERSION = "2.1"
AUTHOR = "mitsuba-cfs"
FIELD_OF_VIEW_DEG = "60"  # the widest that the format allows


def write_bcf(result: Compliance, path: Path) -> int:
    """Write a topic for each room that misses a criterion; how many there are.

    A topic selects the room by its GUID; its camera stands in the room and looks to the biggest
    window, in the axes of the building's file.
    """
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    rooms = [room for room in result.rooms if any(missed(room))]
    with replacing(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bcf.version", _text(_version()))
        for room in rooms:
            topic = str(uuid.uuid5(uuid.NAMESPACE_URL, f"{AUTHOR}/comply/{room.space.guid}"))
            view = str(uuid.uuid5(uuid.NAMESPACE_URL, f"{AUTHOR}/comply/view/{room.space.guid}"))
            archive.writestr(f"{topic}/markup.bcf", _text(_markup(room, topic, view, now)))
            archive.writestr(f"{topic}/viewpoint.bcfv", _text(_viewpoint(room, view, result)))
    return len(rooms)


def _version() -> ElementTree.Element:
    root = ElementTree.Element("Version", VersionId=VERSION)
    ElementTree.SubElement(root, "DetailedVersion").text = VERSION
    return root


def _markup(room: CheckedRoom, topic: str, view: str, now: str) -> ElementTree.Element:
    root = ElementTree.Element("Markup")
    about = ElementTree.SubElement(root, "Topic", Guid=topic, TopicType="Issue", TopicStatus="Open")
    sentences = list(missed(room))
    what = "criterion" if len(sentences) == 1 else "criteria"
    title = f"{room.space.label}: {len(sentences)} {what} not met"
    ElementTree.SubElement(about, "Title").text = title
    ElementTree.SubElement(about, "CreationDate").text = now
    ElementTree.SubElement(about, "CreationAuthor").text = AUTHOR
    ElementTree.SubElement(about, "Description").text = "\n".join(sentences)
    views = ElementTree.SubElement(root, "Viewpoints", Guid=view)
    ElementTree.SubElement(views, "Viewpoint").text = "viewpoint.bcfv"
    return root


def _viewpoint(room: CheckedRoom, view: str, result: Compliance) -> ElementTree.Element:
    root = ElementTree.Element("VisualizationInfo", Guid=view)
    components = ElementTree.SubElement(root, "Components")
    ElementTree.SubElement(components, "ViewSetupHints", SpacesVisible="true")
    file = result.building.file
    if file is None or is_ifc(file):  # the rooms of other formats have no IFC GUID
        selection = ElementTree.SubElement(components, "Selection")
        ElementTree.SubElement(selection, "Component", IfcGuid=room.space.guid)
    ElementTree.SubElement(components, "Visibility", DefaultVisibility="true")
    try:
        eye, direction = view_point(room.space)
    except RoomError:  # a room that is lower than the eye
        return root
    to_model = np.eye(4) if result.building.from_model is None else inv(result.building.from_model)
    direction = to_model[:3, :3] @ direction
    camera = ElementTree.SubElement(root, "PerspectiveCamera")
    _vector(camera, "CameraViewPoint", to_model[:3, :3] @ eye + to_model[:3, 3])
    _vector(camera, "CameraDirection", direction / np.linalg.norm(direction))
    _vector(camera, "CameraUpVector", np.array([0.0, 0.0, 1.0]))
    ElementTree.SubElement(camera, "FieldOfView").text = FIELD_OF_VIEW_DEG
    return root


def _vector(parent: ElementTree.Element, name: str, values: NDArray[np.float64]) -> None:
    element = ElementTree.SubElement(parent, name)
    for axis, value in zip("XYZ", values, strict=True):
        ElementTree.SubElement(element, axis).text = f"{value:.6f}"


def _text(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
