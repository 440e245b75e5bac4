"""Light that leaves a room through holes of its model, as problems of the room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bim.model import Problem, Space
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.trace.escape import SIDES, Escape, escaped_view
from scenes.job.options import RoomOptions

MOST_LOST = 0.01  # of a sensor's view, before it is a problem
WHERE = {"floor": "through the floor", "ceiling": "through the ceiling"}


def hole_problems(
    space: Space,
    scene: DaylightScene,
    options: RoomOptions,
    cache: MatrixCache | None,
    progress: Progress,
) -> tuple[Problem, ...]:
    """A problem where a sensor loses more than 1 % of its view, direct and reflected."""
    points, directions = scene.sensors()
    found = escaped_view(
        scene.interior, scene.groups, points, directions,
        seed=options.seed, progress=progress, cache=cache,
    )  # fmt: skip
    if not (found.share - 2 * found.error > MOST_LOST).any():
        return ()
    return (_problem(space, points, found),)


def _problem(space: Space, points: np.ndarray, found: Escape) -> Problem:
    """How many sensors lose how much, and where most of it leaves."""
    worst, sensors = int(np.argmax(found.share)), len(points) - 1
    count = int(np.count_nonzero(found.share[:sensors] > MOST_LOST))
    name = f"sensor {worst}" if worst < sensors else "the view point"
    side = int(np.argmax(found.by_side.sum(axis=0)))
    towards = WHERE.get(SIDES[side], f"to the {SIDES[side]}")
    what = (
        f"room {space.name or space.guid} is open: up to {100 * found.share[worst]:.0f} % of what "
        f"a sensor sees is neither wall nor window ({name} at {_place(points[worst])}; "
        f"{count} of {sensors} sensors above {100 * MOST_LOST:g} %); most of it leaves "
        f"{towards} near {_place(found.place[side])}"
    )
    return Problem(
        space.guid, what,
        "this light is lost and the room too dark: model what closes the hole (a door, a wall)",
    )  # fmt: skip


def _place(point: np.ndarray) -> str:
    return "({:.1f}, {:.1f}, {:.1f}) m".format(*(round(float(x), 1) + 0.0 for x in point))


def moved(problem: Problem, space: Space, like: str) -> Problem:
    """The problem of a room as that of another one alike."""
    what = f"room {space.name or space.guid} is like room {like}: {problem.what}"
    return replace(problem, where=space.guid, what=what)
