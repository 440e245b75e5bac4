"""Leaks in the model of a room: light that leaves it through no window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bim.model import Problem, Space
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import furnished_surfaces, window_groups
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.matrices.escape import SIDES, Escape, escaped_view

SPACING, WORK_PLANE = 1.0, 0.8  # of the sensors that are looked from [m]
EYE_PIXELS = 64  # of the eye's view, of which only place and direction count
MOST_LOST = 0.01  # of a sensor's view, before it is a problem
WHERE = {"floor": "through the floor", "ceiling": "through the ceiling"}


def hole_problems(
    space: Space,
    scene: DaylightScene,
    *,
    seed: int = 0,
    cache: MatrixCache | None = None,
    progress: Progress = silent,
) -> tuple[Problem, ...]:
    """A problem where a sensor loses more than 1 % of its view, direct and reflected.

    Args: scene: the room with its sensors and an eye.
    """
    points, directions = scene.sensors()
    found = escaped_view(
        scene.interior, scene.groups, points, directions,
        seed=seed, progress=progress, cache=cache,
    )  # fmt: skip
    if not (found.share - 2 * found.error > MOST_LOST).any():
        return ()
    return (_problem(space, points, found),)


def hole_notes(space: Space, *, seed: int = 0, cache: MatrixCache | None = None) -> list[str]:
    """The problems of a room's holes as sentences, where no scene with sensors is at hand."""
    try:
        points, _ = sensor_grid(space, spacing=SPACING, height=WORK_PLANE, margin=SPACING / 2)
    except RoomError:  # too low for a work plane: the eye alone
        points = np.empty((0, 3))
    scene = DaylightScene(
        furnished_surfaces(space, "visible"),
        Surfaces.none(),
        window_groups(space),
        points,
        np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        fisheye(*view_point(space), EYE_PIXELS),
    )
    found = hole_problems(space, scene, seed=seed, cache=cache)
    return [f"{problem.what}: {problem.consequence}" for problem in found]


def _problem(space: Space, points: np.ndarray, found: Escape) -> Problem:
    """How many sensors lose how much, and where most of it leaves."""
    worst, sensors = int(np.argmax(found.share)), len(points) - 1
    count = int(np.count_nonzero(found.share[:sensors] > MOST_LOST))
    name = f"sensor {worst}" if worst < sensors else "the view point"
    side = int(np.argmax(found.by_side.sum(axis=0)))
    towards = WHERE.get(SIDES[side], f"to the {SIDES[side]}")
    what = (
        f"room {space.label} is open: up to {100 * found.share[worst]:.0f} % of what "
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


def moved_problem(problem: Problem, space: Space, template: str) -> Problem:
    """The problem of a template room as that of one equal to it."""
    what = f"room {space.label} is like room {template}: {problem.what}"
    return replace(problem, where=space.guid, what=what)
