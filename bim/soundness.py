"""Whether a finished room is closed, and whether its figures agree with those of its file."""

from __future__ import annotations

from bim.model import Problem, Space
from bim.planes import SMALLEST_AREA
from bim.shell import enclosed_volume, open_edges

AGREES = 0.02  # drawn and stated quantities may differ by this share before it is reported


def agree(drawn: float, stated: float) -> bool:
    """Whether a drawn quantity is the stated one, within `AGREES`."""
    return abs(drawn - stated) <= AGREES * stated


def soundness_problems(space: Space) -> list[Problem]:
    """Problems of the finished shell: open edges, a volume that its faces do not enclose."""
    problems = []
    leaks = open_edges(space.shell)
    if leaks:
        what = f"room {space.label}: {leaks} open edges are left"
        problems.append(Problem(space.guid, what, "light may leak there"))
    enclosed = enclosed_volume(space.shell)
    if space.area_to_middles is not None:
        what = (
            f"room {space.label}: states {space.stated_area:.2f} m2 floor area, which is that to"
            f" the middle of its walls ({space.area_to_middles:.2f} m2 drawn)"
        )
        done = f"the {space.floor_area:.2f} m2 between the walls are used"
        problems.append(Problem(space.guid, what, done))
    for what, stated, drawn, unit in (
        ("floor area", space.stated_area, space.area_as_stated, "m2"),
        ("volume", space.stated_volume, space.drawn_volume, "m3"),
    ):
        if stated is not None and not agree(drawn, stated):
            text = (
                f"room {space.label}: states {stated:.2f} {unit} {what}, drawn {drawn:.2f} {unit}"
            )
            problems.append(Problem(space.guid, text, "the drawn one is used"))
    if abs(enclosed - space.volume) > 1e-3 * space.volume + SMALLEST_AREA:
        what = f"room {space.label}: faces enclose {enclosed:.3f} m3 of {space.volume:.3f} m3"
        problems.append(Problem(space.guid, what, "its boundary is not sound"))
    return problems
