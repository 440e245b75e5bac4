"""The files of a check against rules: dossier, values, BCF topics, the model's problems."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pandas as pd

from bim.bcf import Topic, in_model, write_topics
from bim.building_file import is_ifc
from bim.model import Building
from bim.report.issue import COLUMNS, Issue, issue_rows
from bim.sensors import view_point
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.files import write_table, write_text
from scenes.comply.page import dossier_html
from scenes.comply.results import CheckedRoom, Compliance
from scenes.comply.tables import missed, values_frame
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.result_folder import ResultFolder


def write_room_topics(result: Compliance, path: Path) -> None:
    """Write a BCF topic for each room that misses a criterion.

    A topic selects the room by its GUID; its camera stands in the room and looks to the biggest
    window, in the axes of the building's file.
    """
    file = result.building.file
    has_guids = file is None or is_ifc(file)  # the rooms of other formats have no IFC GUID
    rooms = [room for room in result.rooms if any(missed(room))]
    topics = [_topic(room, result.building, has_guids=has_guids) for room in rooms]
    write_topics(topics, path, "" if file is None else file.name)


def _topic(room: CheckedRoom, building: Building, *, has_guids: bool) -> Topic:
    sentences = list(missed(room))
    what = "criterion" if len(sentences) == 1 else "criteria"
    try:
        camera = in_model(building, *view_point(room.space))
    except RoomError:  # a room that is lower than the eye
        camera = None
    return Topic(
        f"comply/{room.space.guid}",
        f"{room.space.label}: {len(sentences)} {what} not met",
        "\n".join(sentences),
        (room.space.guid,) if has_guids else (),
        camera=camera,
    )


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
        write_room_topics(result, place / "issues.bcf")
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
