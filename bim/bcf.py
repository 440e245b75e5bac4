"""Issues of a building model as BCF 2.1 topics, for the author of the model.

A .bcfzip holds a folder for each topic with markup.bcf (title, text, priority) and viewpoint.bcfv
(the elements that are selected, a camera).  Schema: buildingSMART, BCF-XML 2.1.
"""

from __future__ import annotations

import datetime
import io
import re
import uuid
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import NDArray

from bim.model import Building
from bim.report.issue import Issue, Severity, issue_text
from bim.report.ranking import Ranked, ranked
from mitsuba_cfs.files import write_bytes

AUTHOR = "mitsuba-cfs"
PRIORITIES: Mapping[Severity, str] = {"loss": "High", "warning": "Normal", "assumption": "Low"}
GUID = re.compile(r"[0-9A-Za-z_$]{22}")
FIELD_OF_VIEW = 60.0  # of the camera, 45 to 60 in BCF 2.1 [deg]
NEAREST = 3.0  # of the camera to the middle of what it shows [m]
VIEW = np.array([0.5, 0.7, -0.5]) / np.linalg.norm([0.5, 0.7, -0.5])  # direction, in model axes


def write_bcf(building: Building, path: str | PathLike[str]) -> int:
    """Write a topic for each kind of issue that concerns the author; their number.

    Args: building: read from IFC.
    """
    topics = [one for one in ranked(building.issues) if one.first.severity in PRIORITIES]
    boxes: dict[str, NDArray[np.float64]] = {}
    for guid, box in _boxes(building):
        boxes.setdefault(guid, box)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        version = Element("Version", VersionId="2.1")
        SubElement(version, "DetailedVersion").text = "2.1"
        archive.writestr("bcf.version", _xml(version))
        for index, topic in enumerate(topics):
            guid = _guid(building, "topic", topic)
            viewpoint = _guid(building, "viewpoint", topic)
            markup = _markup(building, topic, index, (guid, viewpoint))
            archive.writestr(f"{guid}/markup.bcf", _xml(markup))
            view = _viewpoint(building, topic.issues, boxes, viewpoint)
            archive.writestr(f"{guid}/viewpoint.bcfv", _xml(view))
    write_bytes(path, buffer.getvalue())
    return len(topics)


def _guid(building: Building, part: str, topic: Ranked) -> str:
    """The same for the same doubt of the same model, so that a second import updates the topic."""
    places = sorted({issue.where for issue in topic.issues})
    name = "\n".join((building.name, part, topic.first.code, *places))
    return str(uuid.uuid5(uuid.NAMESPACE_URL, name))


def _markup(building: Building, topic: Ranked, index: int, guids: tuple[str, str]) -> Element:
    markup = Element("Markup")
    if building.file is not None:
        file = SubElement(SubElement(markup, "Header"), "File", isExternal="true")
        SubElement(file, "Filename").text = building.file.name
    text = topic.text("command")
    entry = SubElement(markup, "Topic", Guid=guids[0], TopicType="Issue", TopicStatus="Open")
    for key, value in (
        ("Title", text.what),
        ("Priority", PRIORITIES[topic.first.severity]),
        ("Index", str(index)),
        ("Labels", topic.first.code),
        ("CreationDate", datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")),
        ("CreationAuthor", AUTHOR),
        ("Description", "\n".join(_lines(topic.issues))),
    ):
        SubElement(entry, key).text = value
    view = SubElement(markup, "Viewpoints", Guid=guids[1])
    SubElement(view, "Viewpoint").text = "viewpoint.bcfv"
    return markup


def _lines(issues: Iterable[Issue]) -> list[str]:
    """Each issue in words with its place, without repetition."""
    lines = (f"{issue_text(one, 'command').line} ({one.where})" for one in issues)
    return list(dict.fromkeys(lines))


def _viewpoint(
    building: Building,
    issues: Sequence[Issue],
    boxes: Mapping[str, NDArray[np.float64]],
    guid: str,
) -> Element:
    view = Element("VisualizationInfo", Guid=guid)
    components = SubElement(view, "Components")
    SubElement(components, "ViewSetupHints", SpacesVisible="true", OpeningsVisible="true")
    elements = list(dict.fromkeys(one for i in issues for one in _elements(building, i.where)))
    if elements:
        selection = SubElement(components, "Selection")
        for one in elements:
            SubElement(selection, "Component", IfcGuid=one)
    SubElement(components, "Visibility", DefaultVisibility="true")
    shown = [boxes[one] for one in elements if one in boxes]
    shown += [np.tile(point, (2, 1)) for issue in issues if (point := _point(issue)) is not None]
    if shown:
        _camera(view, building, np.array(shown))
    return view


def _elements(building: Building, where: str) -> Iterator[str]:
    """GUIDs of the element that an issue names, or of those with the construction or material."""
    if GUID.fullmatch(where):
        yield where
        return
    for face in (face for space in building.spaces for face in space.faces):
        names = {face.construction.name, *(layer.name for layer in face.construction.layers)}
        if face.element is not None and where in names:
            yield face.element


def _point(issue: Issue) -> NDArray[np.float64] | None:
    """The place [3] that an issue states, in the building's axes [m]."""
    values = [issue.values.get(axis) for axis in "xyz"]
    return None if None in values else np.array(values, dtype=float)


def _camera(view: Element, building: Building, boxes: NDArray[np.float64]) -> None:
    """A camera, in model axes [m], that shows boxes [N, 2, 3] of the building's axes."""
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    from_model = np.eye(4) if building.from_model is None else building.from_model
    middle = np.linalg.solve(from_model, [*(low + high) / 2, 1.0])[:3]
    radius = float(np.linalg.norm(high - low)) / 2 / np.cbrt(np.linalg.det(from_model[:3, :3]))
    distance = max(NEAREST, radius / np.sin(np.radians(FIELD_OF_VIEW / 2)))
    side = np.cross(VIEW, [0.0, 0.0, 1.0])
    up = np.cross(side, VIEW)
    camera = SubElement(view, "PerspectiveCamera")
    for name, vector in (
        ("CameraViewPoint", middle - distance * VIEW),
        ("CameraDirection", VIEW),
        ("CameraUpVector", up / np.linalg.norm(up)),
    ):
        part = SubElement(camera, name)
        for axis, value in zip("XYZ", vector, strict=True):
            SubElement(part, axis).text = f"{value:.6f}"
    SubElement(camera, "FieldOfView").text = f"{FIELD_OF_VIEW:g}"


def _boxes(building: Building) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """GUID and box [2, 3] of elements outdoors, rooms and windows, of faces by element [m]."""
    for element in building.elements:
        if len(element.triangles):
            yield element.guid, _box(element.triangles)
    for space in building.spaces:
        yield space.guid, _box(space.shell)
        for window in space.windows:
            yield window.guid, _box(window.triangles)
        for face in space.faces:
            if face.element is not None:
                yield face.element, _box(face.triangles)


def _box(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    corners = triangles.reshape(-1, 3)
    return np.array([corners.min(axis=0), corners.max(axis=0)])


def _xml(root: Element) -> bytes:
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True)
