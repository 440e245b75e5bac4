"""The files of a check against rules: the dossier, its values, BCF topics and the model's problems.

Source: buildingSMART, BIM Collaboration Format 2.1 (markup.xsd, visinfo.xsd, version.xsd).
"""

from __future__ import annotations

import datetime
import uuid
import zipfile
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
from numpy.linalg import inv
from numpy.typing import NDArray

from bim.building_file import is_ifc
from bim.report.issue import COLUMNS, Issue, issue_rows
from bim.sensors import view_point
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import replacing, write_table, write_text
from scenes.comply.page import dossier_html
from scenes.comply.results import CheckedRoom, Compliance
from scenes.comply.tables import missed, values_frame
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.result_folder import ResultFolder

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


SET_NAME = "CFS compliance"
MODEL_CHECK = Path(str(files(__package__) / "model.ids"))  # what a check needs of a model


def write_compliance(
    result: Compliance,
    folder: ResultFolder,
    *,
    quick: bool = False,
    page: PageOptions = OWN_PAGE,
) -> None:
    """Write all files; earlier results are replaced at the end."""
    with folder.replaced() as place:
        write_table(values_frame(result), place / "values.csv", index=False, float_format="%.6g")
        rows = issue_rows(result.issues, "command")
        issues = pd.DataFrame(rows, columns=list(COLUMNS))
        write_table(issues, place / "problems.csv", index=False)
        write_text(place / MODEL_CHECK.name, MODEL_CHECK.read_text("utf-8"))
        write_bcf(result, place / "issues.bcf")
        write_text(place / "dossier.html", dossier_html(result, quick=quick, page=page))


def write_into_ifc(result: Compliance, out: Path) -> tuple[Issue, ...]:
    """Write the building's file with a property set of its levels on each room; what had no place.

    The properties are "RULE CRITERION" with the level that is reached, and "use".
    """
    from bim.ifc.results_write import write_results  # reads IFC

    values = {
        room.space.guid: {"use": room.use.key}
        | {f"{v.rule} {v.criterion.key}": v.reached for v in room.verdicts if v.applies}
        for room in result.rooms
    }
    if result.building.file is None:
        raise ValueError("a building that is not from a file has none to write into")
    return write_results(result.building.file, values, out, set_name=SET_NAME)
