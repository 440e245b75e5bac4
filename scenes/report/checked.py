"""The check of a building model as data, for programs and for the page of `cfs app`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from bim.model import Building, Space
from bim.report.issue import Issue
from bim.report.ranking import ranked
from scenes.report.glare_figures import compass
from scenes.report.model3d import checked_model

# Severities of issues, the gravest first; "info" makes no room doubtful
DOUBTS = ("loss", "warning", "assumption")


def check_record(
    building: Building, head: Sequence[str], uses: Mapping[str, tuple[str, str, bool]], glazing: Mapping[str, str]
) -> dict[str, Any]:
    """What `cfs check --json` writes: site, head, rooms, issues, and the 3D model of the viewer.

    Args:
        head: the first lines of the check.
        uses: of each room by GUID: key, where it is from, and whether it is assumed.
        glazing: of each window by GUID: the results that the file has glazing data for, "all", "light" or "none".
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
        "model": checked_model(building).json(),
    }


def _room(
    space: Space, issues: Iterable[Issue], uses: Mapping[str, tuple[str, str, bool]], glazing: Mapping[str, str]
) -> dict[str, Any]:
    elements = {space.guid, space.label, space.name, *(w.guid for w in space.windows)}
    elements |= {face.element for face in space.faces if face.element is not None}
    doubts = {issue.severity for issue in issues if issue.where in elements}
    use, source, assumed = uses.get(space.guid, ("", "", True))
    return {
        "guid": space.guid,
        "label": space.label,
        "storey": space.storey,
        "use": use,
        "use_source": source,
        "use_assumed": assumed,
        "floor_m2": round(space.floor_area, 2),
        "volume_m3": round(space.drawn_volume, 2),
        "doubt": next((name for name in DOUBTS if name in doubts), ""),
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
