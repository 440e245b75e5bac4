"""Issues of a building model, and other topics for its author, as BCF 2.1.

A .bcfzip holds a folder for each topic with markup.bcf (title, text, priority) and viewpoint.bcfv
(the elements that are selected, a camera).

Source: buildingSMART, BIM Collaboration Format 2.1 (markup.xsd, visinfo.xsd, version.xsd).
"""

from __future__ import annotations

import datetime
import io
import re
import uuid
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Topic:
    """What a topic says and shows."""

    name: str  # of which its GUID is made: a second import updates the topic
    title: str
    description: str
    elements: tuple[str, ...] = ()  # IFC GUIDs that are selected
    priority: str = ""
    label: str = ""
    # position and direction [3] of the camera, in the axes of the model [m]
    camera: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None


def write_topics(topics: Sequence[Topic], path: str | PathLike[str], file: str = "") -> None:
    """Write topics as one file.

    Args: file: name of the model's file, in the topics' heads.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        version = Element("Version", VersionId="2.1")
        SubElement(version, "DetailedVersion").text = "2.1"
        archive.writestr("bcf.version", _xml(version))
        for index, topic in enumerate(topics):
            guid, view = (
                str(uuid.uuid5(uuid.NAMESPACE_URL, f"{topic.name}\n{part}")) for part in ("topic", "viewpoint")
            )
            archive.writestr(f"{guid}/markup.bcf", _xml(_markup(topic, index, file, (guid, view))))
            archive.writestr(f"{guid}/viewpoint.bcfv", _xml(_viewpoint(topic, view)))
    write_bytes(path, buffer.getvalue())


def write_bcf(building: Building, path: str | PathLike[str]) -> int:
    """Write a topic for each kind of issue that concerns the author; their number.

    Args: building: read from IFC.
    """
    boxes: dict[str, NDArray[np.float64]] = {}
    for guid, box in _boxes(building):
        boxes.setdefault(guid, box)
    topics = [_of_issues(building, one, boxes) for one in ranked(building.issues) if one.first.severity in PRIORITIES]
    write_topics(topics, path, "" if building.file is None else building.file.name)
    return len(topics)


def in_model(
    building: Building, point: NDArray[np.float64], direction: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A point and a unit direction [3] of the building in the axes of its file [m]."""
    to_model = np.linalg.inv(np.eye(4) if building.from_model is None else building.from_model)
    turned = to_model[:3, :3] @ direction
    return to_model[:3, :3] @ point + to_model[:3, 3], turned / np.linalg.norm(turned)


def _of_issues(building: Building, one: Ranked, boxes: Mapping[str, NDArray[np.float64]]) -> Topic:
    issues = one.issues
    elements = list(dict.fromkeys(e for i in issues for e in _elements(building, i.where)))
    shown = [boxes[guid] for guid in elements if guid in boxes]
    shown += [np.tile(point, (2, 1)) for issue in issues if (point := _point(issue)) is not None]
    places = sorted({issue.where for issue in issues})
    return Topic(
        "\n".join((building.name, one.first.code, *places)),
        one.text("command").what,
        "\n".join(_lines(issues)),
        tuple(elements),
        PRIORITIES[one.first.severity],
        one.first.code,
        _camera(building, np.array(shown)) if shown else None,
    )


def _markup(topic: Topic, index: int, file: str, guids: tuple[str, str]) -> Element:
    markup = Element("Markup")
    if file:
        head = SubElement(SubElement(markup, "Header"), "File", isExternal="true")
        SubElement(head, "Filename").text = file
    entry = SubElement(markup, "Topic", Guid=guids[0], TopicType="Issue", TopicStatus="Open")
    for key, value in (
        ("Title", topic.title),
        ("Priority", topic.priority),
        ("Index", str(index)),
        ("Labels", topic.label),
        ("CreationDate", datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")),
        ("CreationAuthor", AUTHOR),
        ("Description", topic.description),
    ):
        if value:
            SubElement(entry, key).text = value
    view = SubElement(markup, "Viewpoints", Guid=guids[1])
    SubElement(view, "Viewpoint").text = "viewpoint.bcfv"
    return markup


def _lines(issues: Iterable[Issue]) -> list[str]:
    """Each issue in words with its place, without repetition."""
    lines = (f"{issue_text(one, 'command').line} ({one.where})" for one in issues)
    return list(dict.fromkeys(lines))


def _viewpoint(topic: Topic, guid: str) -> Element:
    view = Element("VisualizationInfo", Guid=guid)
    components = SubElement(view, "Components")
    SubElement(components, "ViewSetupHints", SpacesVisible="true", OpeningsVisible="true")
    if topic.elements:
        selection = SubElement(components, "Selection")
        for one in topic.elements:
            SubElement(selection, "Component", IfcGuid=one)
    SubElement(components, "Visibility", DefaultVisibility="true")
    if topic.camera is not None:
        position, direction = topic.camera
        up = np.cross(np.cross(direction, [0.0, 0.0, 1.0]), direction)
        camera = SubElement(view, "PerspectiveCamera")
        for name, vector in (
            ("CameraViewPoint", position),
            ("CameraDirection", direction),
            ("CameraUpVector", up / np.linalg.norm(up)),
        ):
            part = SubElement(camera, name)
            for axis, value in zip("XYZ", vector, strict=True):
                SubElement(part, axis).text = f"{value:.6f}"
        SubElement(camera, "FieldOfView").text = f"{FIELD_OF_VIEW:g}"
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


def _camera(building: Building, boxes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A camera, in model axes [m], that shows boxes [N, 2, 3] of the building's axes."""
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    middle, _ = in_model(building, (low + high) / 2, VIEW)
    from_model = np.eye(4) if building.from_model is None else building.from_model
    radius = float(np.linalg.norm(high - low)) / 2 / np.cbrt(np.linalg.det(from_model[:3, :3]))
    distance = max(NEAREST, radius / np.sin(np.radians(FIELD_OF_VIEW / 2)))
    return middle - distance * VIEW, VIEW


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
