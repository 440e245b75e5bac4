"""Leaks in the model of a room: light that leaves it through no window."""

from __future__ import annotations

import numpy as np

from bim.model import Space
from bim.report.issue import Issue, Phrase, issue_note
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import furnished_surfaces, window_groups
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.matrices.straight_view import SIDES, Escape, escaped_view

SPACING, WORK_PLANE = 1.0, 0.8  # of the sensors [m]
EYE_PIXELS = 64  # of the eye's view; only its position and direction count
MOST_LOST = 0.01  # greatest share of a sensor's view that is no issue


def leak_issues(
    space: Space, scene: DaylightScene, *, seed: int = 0, cache: MatrixCache | None = None, progress: Progress = silent
) -> tuple[Issue, ...]:
    """An issue if a sensor loses more than 1 % of its view, direct and reflected.

    Args: scene: of the room, with its sensors and the eye.
    """
    points, directions = scene.sensors()
    escape = escaped_view(scene.interior, scene.groups, points, directions, seed=seed, progress=progress, cache=cache)
    if not (escape.share - 2 * escape.error > MOST_LOST).any():
        return ()
    return (_issue(space, points, escape),)


def leak_notes(space: Space, *, seed: int = 0, cache: MatrixCache | None = None) -> list[str]:
    """Sentences on the leaks of a room, seen from sensors of their own."""
    try:
        points, _ = sensor_grid(space, spacing=SPACING, height=WORK_PLANE, margin=SPACING / 2)
    except RoomError:  # too low for a work plane: from the eye alone
        points = np.empty((0, 3))
    eye = view_point(space)
    scene = DaylightScene(
        furnished_surfaces(space, "visible"),
        Surfaces.none(),
        window_groups(space),
        points,
        np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        fisheye(*eye, EYE_PIXELS),
    )
    issues = leak_issues(space, scene, seed=seed, cache=cache)
    return [issue_note(issue, "python") for issue in issues]


def _issue(space: Space, points: np.ndarray, escape: Escape) -> Issue:
    """The number of sensors that lose light, the largest loss, and where most of it leaves."""
    worst, sensors = int(np.argmax(escape.share)), len(points) - 1
    count = int(np.count_nonzero(escape.share[:sensors] > MOST_LOST))
    at_sensor = worst < sensors
    side = int(np.argmax(escape.by_side.sum(axis=0)))
    values = {
        "room": space.label,
        "percent": 100 * float(escape.share[worst]),
        "sensor": Phrase("sensor", {"number": worst}) if at_sensor else Phrase("view-point"),
        "position": _position(points[worst]),
        "count": count,
        "sensors": sensors,
        "limit_percent": 100 * MOST_LOST,
        "side": Phrase(f"side-{SIDES[side]}"),
        "exit": _position(escape.place[side]),
    }
    return Issue("room-leaks-light", space.guid, values)


def _position(point: np.ndarray) -> str:
    return "({:.1f}, {:.1f}, {:.1f}) m".format(*(round(float(x), 1) + 0.0 for x in point))


def moved_issue(issue: Issue, space: Space, template: str) -> Issue:
    """The issue of a template room as the issue of an equal room."""
    values = {**issue.values, "room": space.label, "template": template}
    return Issue("equal-room-leaks-light", space.guid, values)
