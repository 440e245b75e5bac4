"""The check of a building model as data, for programs and for the page of `cfs app`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from bim.model import Building, Space
from bim.names import JOINT, UnknownName, item_named
from bim.report.issue import Issue
from bim.report.ranking import Ranked, ranked
from scenes.report.glare_figures import compass
from scenes.report.model3d import checked_model

DOUBTS = ("loss", "warning", "assumption")  # severities of issues that make a room doubtful
SERIOUS, MINOR = "serious", "minor"
MUCH = 0.05  # share of a room's glass or air from which a loss is serious
RESIZED = ("room-cut", "room-raised")  # the room's air is not as drawn
OPEN_ROOMS = "rooms-open-to-each-other"
ROOMS = ("room", "rooms", "other")  # values of issues that are labels of rooms


def check_record(
    building: Building, head: Sequence[str], uses: Mapping[str, tuple[str, str, bool]], glazing: Mapping[str, str]
) -> dict[str, Any]:
    """What `cfs check --json` writes: site, head, rooms, issues, and the 3D model of the viewer.

    Args:
        head: the first lines of the check.
        uses: of each room by GUID: key, where it is from, and whether it is assumed.
        glazing: of each window by GUID: the results that the file has glazing data for, "all", "light" or "none".

    Returns: of a room `doubt` is "serious", "minor" or "", and `doubts` are the reasons, the gravest first; of
        `open_rooms` each is a pair with the GUIDs, the area of the opening and what `--join` takes.
    """
    return {
        "name": building.name,
        "file": "" if building.file is None else building.file.name,
        "site": {"latitude_deg": building.latitude_deg, "longitude_deg": building.longitude_deg},
        "head": list(map(str, head)),
        "rooms": [_room(space, building.issues, uses, glazing) for space in building.spaces],
        "issues": [
            {
                "code": kind.first.code,
                "severity": kind.first.severity,
                "count": kind.count,
                "glass_m2": round(kind.glass, 2),
                "where": kind.first.where,
                **kind.text("command")._asdict(),
            }
            for kind in ranked(building.issues)
        ],
        "open_rooms": list(_open_rooms(building)),
        "model": checked_model(building).json(),
    }


def _open_rooms(building: Building) -> Iterator[dict[str, Any]]:
    """Pairs of rooms with an opening between them that a wall face closes, the largest first."""
    found = (issue for issue in building.issues if issue.code == OPEN_ROOMS)
    for issue in sorted(found, key=lambda one: -_number(one, "area")):
        names = str(issue.values["names"])
        try:
            pair = [item_named(building.spaces, name, "room") for name in names.split(JOINT)]
        except UnknownName:  # one of them is left out
            continue
        labels, guids = [room.label for room in pair], [room.guid for room in pair]
        yield {"rooms": labels, "guids": guids, "area_m2": round(_number(issue, "area"), 2), "join": names}


def _number(issue: Issue, key: str) -> float:
    value = issue.values[key]
    return float(value) if isinstance(value, int | float) else 0.0


def _room(
    space: Space, issues: Iterable[Issue], uses: Mapping[str, tuple[str, str, bool]], glazing: Mapping[str, str]
) -> dict[str, Any]:
    concerned = [issue for issue in issues if issue.severity in DOUBTS and _concerns(issue, space)]
    doubts = [_doubt(space, kind) for kind in ranked(concerned)]
    doubts.sort(key=lambda one: (one["level"] != SERIOUS, DOUBTS.index(one["severity"]), -one["glass_m2"]))
    use, source, assumed = uses.get(space.guid, ("", "", True))
    return {
        "guid": space.guid,
        "label": space.label,
        "storey": space.storey,
        "use": use,
        "use_source": source,
        "use_assumed": assumed,
        "floor_m2": round(space.floor_area, 2),
        "volume_m3": round(space.volume, 2),
        "drawn_volume_m3": round(space.drawn_volume, 2),
        "doubt": doubts[0]["level"] if doubts else "",
        "doubts": doubts,
        "windows": [
            {
                "guid": window.guid,
                "name": window.name,
                "glass_m2": round(window.area, 2),
                "facing": "up" if window.normal[2] > 0.7 else compass(window.normal),
                "glazing": glazing.get(window.guid, "none"),
            }
            for window in space.windows
        ],
    }


def _concerns(issue: Issue, space: Space) -> bool:
    """Whether an issue is of a room, its windows or its faces, or names the room."""
    if issue.where in {space.guid, space.label, space.name, *(w.guid for w in space.windows)}:
        return True
    if any(face.element == issue.where for face in space.faces if face.element is not None):
        return True
    stated = [issue.values.get(key, ()) for key in ROOMS]
    return any(space.label == one or (isinstance(one, tuple) and space.label in one) for one in stated)


def _doubt(space: Space, kind: Ranked) -> dict[str, Any]:
    """What issues of one kind mean for a room, by their consequence."""
    text, first = kind.text("command"), kind.first
    level = SERIOUS if _is_serious(space, kind) else MINOR
    facts = {"code": first.code, "severity": first.severity, "glass_m2": round(kind.glass, 2)}
    return {"level": level, **facts, "what": text.what, "effect": text.effect}


def _is_serious(space: Space, kind: Ranked) -> bool:
    """Whether results may be far off: by the share of glass or air, the size of an opening, else the severity."""
    first = kind.first
    if first.code in RESIZED:
        return space.raised + space.cut > MUCH * space.drawn_volume
    if first.severity == "assumption":
        return False
    if first.code == OPEN_ROOMS:
        return any(_number(one, "area") > _number(one, "limit") for one in kind.issues)
    if kind.glass > 0:
        return kind.glass > MUCH * (kind.glass + sum(window.area for window in space.windows))
    return True
