"""The windows of a room and the systems in them: groups of one orientation and one system."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.drawn_shades import without_drawn_shades
from bim.model import Building, Space
from bim.to_tracer import window_groups
from mitsuba_cfs.surfaces import WindowGroup
from scenes.fenestration.systems import FenestrationSystem, States

if TYPE_CHECKING:
    from mitsuba_cfs.methods.optics import BsdfOptics

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class RoomWindows:
    """The window groups of a room (axis G), each with its systems by state."""

    groups: list[WindowGroup]
    systems: tuple[States, ...]  # [G]
    group: NDArray[np.int64]  # [W] group of each window of the space

    @property
    def states(self) -> int:
        """J, how many states there are: of the group that has most; 1 of a room without windows."""
        return max((len(states) for states in self.systems), default=1)

    def optics(self) -> list[list[BsdfOptics]]:
        """Each group's systems by state [G][J], as the methods take them."""
        from mitsuba_cfs.methods.optics import BsdfOptics  # a tracer, which no export needs

        known: dict[int, BsdfOptics] = {}
        for states in self.systems:
            for system in states:
                if id(system) not in known:
                    known[id(system)] = BsdfOptics(system.visible, system.fine, system.angular)
        return [[known[id(system)] for system in states] for states in self.systems]

    def of_state(self, state: int, what: Callable[[FenestrationSystem], T]) -> list[T]:
        """What `what` makes of each group's system in a state; fewer states end with their last."""
        return [what(states[min(state, len(states) - 1)]) for states in self.systems]


def room_windows(space: Space, systems: Mapping[str, States]) -> RoomWindows:
    """The windows of a room in groups.

    Args: systems: of each window, by its GUID.
    """
    missing = [w.name or w.guid for w in space.windows if w.guid not in systems]
    if missing:
        raise ValueError(f"no fenestration system for window {', '.join(missing)}")
    members: dict[tuple[int, ...], list] = {}
    for window in space.windows:
        key = tuple(id(system) for system in systems[window.guid])
        members.setdefault(key, []).append(window)
    found: list[tuple[WindowGroup, States]] = []
    for windows in members.values():
        states = systems[windows[0].guid]
        for group in window_groups(replace(space, windows=tuple(windows))):
            name = group.name if len(members) == 1 else f"{group.name}, {states[0].name}"
            found.append((replace(group, name=name), states))
    groups = [group for group, _ in found]
    return RoomWindows(groups, tuple(states for _, states in found), _groups(space, groups))


def in_all_windows(space: Space, *states: FenestrationSystem) -> dict[str, States]:
    """The same states in every window of a room."""
    return {window.guid: states for window in space.windows}


def _groups(space: Space, groups: list[WindowGroup]) -> NDArray[np.int64]:
    """Group of each window of the space [W]."""
    return np.array(
        [
            next(
                g
                for g, group in enumerate(groups)
                if any(np.array_equal(w.triangles, window.triangles) for w in group.windows)
            )
            for window in space.windows
        ],
        dtype=np.int64,
    )


SCATTERED = (
    0.05  # share of the transmitted light beside the straight ray, above it there is a shade
)

_log = logging.getLogger(__name__)


def traced_building(building: Building, systems: Mapping[str, States]) -> Building:
    """The building without the devices that a window's BSDF holds; the log names each.

    Args: systems: of each window, by its GUID.
    """
    held = {id(system): holds_shade(system) for states in systems.values() for system in states}
    shaded = {
        guid for guid, states in systems.items() if any(held[id(system)] for system in states)
    }
    building, problems = without_drawn_shades(building, shaded)
    for problem in problems:
        _log.warning("%s: %s", problem.what, problem.consequence)
    return building


def holds_shade(system: FenestrationSystem) -> bool:
    """Whether a system holds a shade: by the stated place of its shade, else by its light.

    Clear panes pass light straight on, into one patch for each direction; slats and fabrics
    scatter.  Light of all directions counts as from a uniform sky.
    """
    if system.shading_position is not None:
        return system.shading_position != "none"
    bsdf = system.visible
    omega = bsdf.basis_in.projected_solid_angles()
    flux = bsdf.transmission_front * bsdf.basis_out.projected_solid_angles()[:, None]
    passed = flux.sum(axis=0) @ omega
    straight = np.maximum(flux.max(axis=0), 0.0) @ omega
    return bool(passed > 0 and 1.0 - straight / passed > SCATTERED)
