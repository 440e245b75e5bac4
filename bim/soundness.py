"""Whether a finished room is closed, and whether its figures agree with those of its file."""

from __future__ import annotations

from bim.model import Space
from bim.planes import SMALLEST_AREA
from bim.report.issue import Issue
from bim.shell import enclosed_volume, open_edges

AGREES = 0.02  # drawn and stated quantities may differ by this share before it is reported


def agree(drawn: float, stated: float) -> bool:
    """Whether a drawn quantity is the stated one, within `AGREES`."""
    return abs(drawn - stated) <= AGREES * stated


def soundness_issues(space: Space) -> list[Issue]:
    """Issues of the finished shell: open edges, a volume that its faces do not enclose."""
    issues = []
    leaks = open_edges(space.shell)
    if leaks:
        values = {"room": space.label, "count": leaks}
        issues.append(Issue("room-with-open-edges", space.guid, values))
    enclosed = enclosed_volume(space.shell)
    if space.area_to_middles is not None:
        values = {
            "room": space.label,
            "stated": space.stated_area,
            "drawn": space.area_to_middles,
            "used": space.floor_area,
        }
        issues.append(Issue("area-to-wall-middles", space.guid, values))
    for code, stated, drawn in (
        ("floor-area-differs", space.stated_area, space.area_as_stated),
        ("volume-differs", space.stated_volume, space.drawn_volume),
    ):
        if stated is not None and not agree(drawn, stated):
            values = {"room": space.label, "stated": stated, "drawn": drawn}
            issues.append(Issue(code, space.guid, values))
    if abs(enclosed - space.volume) > 1e-3 * space.volume + SMALLEST_AREA:
        values = {"room": space.label, "enclosed": enclosed, "volume": space.volume}
        issues.append(Issue("room-not-sound", space.guid, values))
    return issues
