"""The windows of a room and the systems in them: groups of one orientation and one system."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bim.drawn_shades import without_drawn_shades
from bim.model import Building, Space
from bim.report.issue import issue_text
from bim.to_tracer import orientation_groups, window_groups
from mitsuba_cfs.surfaces import WindowGroup
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.room.control_groups import ControlGroups, control_groups

if TYPE_CHECKING:
    from mitsuba_cfs.methods.optics import BsdfOptics, SystemOptics


COLOUR_BANDS = 3  # red, green, blue


@dataclass(frozen=True, slots=True)
class RoomWindows:
    """The window groups of a room (axis G) with the systems of each shading state."""

    groups: list[WindowGroup]
    systems: tuple[States, ...]  # [G]
    group: NDArray[np.int64]  # [W] group of each window of the space
    control: NDArray[np.int64]  # [G] control group of each, whose windows move together

    @property
    def states(self) -> int:
        """Number of shading states J: of the group with the most; 1 for a room without windows."""
        return max((len(states) for states in self.systems), default=1)

    def states_of(self, c: int) -> int:
        """Number of states of a control group: of its window group with the most."""
        return max(len(self.systems[g]) for g in np.flatnonzero(self.control == c))

    def optics(self) -> list[list[BsdfOptics]]:
        """Optics of each group's systems by state [G][J]."""
        from mitsuba_cfs.methods.optics import (  # a tracer, which no export needs
            BetweenOptics,
            BsdfOptics,
        )

        known: dict[int, BsdfOptics] = {}

        def of(system: FenestrationSystem) -> BsdfOptics:
            if id(system) not in known:
                tilts = system.between
                between = tilts and BetweenOptics(of(tilts.low), of(tilts.high), tilts.share)
                known[id(system)] = BsdfOptics(system.visible, system.fine, system.angular, between)
            return known[id(system)]

        return [[of(system) for system in states] for states in self.systems]

    def optics_by_colour(self, optics: Sequence[Sequence[SystemOptics]]) -> list[list[list[SystemOptics]]]:
        """Optics of each group's systems by red, green and blue [3][G][J].

        Light of D65 through a system has the colour of its spectrum; neutral where this is not
        known.

        Args: optics: of the visible band [G][J].
        """
        from mitsuba_cfs.bsdf.spectral_factor import ANGLES
        from mitsuba_cfs.methods.optics import BsdfOptics

        known: dict[int, list[SystemOptics]] = {}
        for states, of in zip(self.systems, optics, strict=True):
            for system, one in zip(states, of, strict=True):
                if id(one) in known:
                    continue
                known[id(one)] = [one] * COLOUR_BANDS
                if system.spectrum is not None and isinstance(one, BsdfOptics):
                    tints = system.spectrum.rgb().T
                    known[id(one)] = [one.tinted(ANGLES, tint) for tint in tints]
        return [[[known[id(one)][c] for one in of] for of in optics] for c in range(COLOUR_BANDS)]

    def neighbours(self, g: int, state: int) -> tuple[int, int, float] | None:
        """Numbers of two states of a group that a state is the mean of, and the second's share."""
        states = self.systems[g]
        tilts = states[min(state, len(states) - 1)].between
        if tilts is None:
            return None
        low, high = (next((n for n, one in enumerate(states) if one is tilt), None) for tilt in (tilts.low, tilts.high))
        return None if low is None or high is None else (low, high, tilts.share)

    def in_state(self, state: int) -> list[FenestrationSystem]:
        """The system of each group [G] in a state; a group with fewer states is in its last."""
        return self.in_states([state] * len(self.groups))

    def in_states(self, state: Sequence[int]) -> list[FenestrationSystem]:
        """The same with each group in its own state [G]."""
        return [of[min(j, len(of) - 1)] for of, j in zip(self.systems, state, strict=True)]


def room_windows(space: Space, systems: Mapping[str, States], control: ControlGroups | None = None) -> RoomWindows:
    """The windows of a room in groups of one orientation, one system and one control group.

    Args: systems: of each window, by its GUID; control: by default a group for each orientation.

    Raises: `ValueError` for a window without a system.
    """
    missing = [w.name or w.guid for w in space.windows if w.guid not in systems]
    if missing:
        raise ValueError(f"no fenestration system for window {', '.join(missing)}")
    control = control or control_groups(space)
    members: dict[tuple[int, ...], list[int]] = {}
    for number, window in enumerate(space.windows):
        key = tuple(id(system) for system in systems[window.guid])
        members.setdefault(key, []).append(number)
    grouped: list[tuple[WindowGroup, States, int]] = []
    for numbers in members.values():
        windows = tuple(space.windows[w] for w in numbers)
        states = systems[windows[0].guid]
        part_of_space = replace(space, windows=windows)
        for group, order in zip(window_groups(part_of_space), orientation_groups(part_of_space), strict=True):
            name = group.name if len(members) == 1 else f"{group.name}, {states[0].name}"
            parts = _by_control(group, control.number[np.array(numbers)[order]].tolist())
            for part, c in parts:
                label = name if len(parts) == 1 else f"{name}, {control.names[c]}"
                grouped.append((replace(part, name=label), states, c))
    groups = [group for group, _, _ in grouped]
    return RoomWindows(
        groups,
        tuple(states for _, states, _ in grouped),
        _groups(space, groups),
        np.array([c for _, _, c in grouped], dtype=np.int64),
    )


def _by_control(group: WindowGroup, numbers: list[int]) -> list[tuple[WindowGroup, int]]:
    """The parts of a window group by control group, with its number.

    Args: numbers: of the control group of each window of the group.
    """
    return [
        (replace(group, windows=tuple(w for w, n in zip(group.windows, numbers, strict=True) if n == c)), c)
        for c in sorted(set(numbers))
    ]


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


SCATTERED = 0.05  # share of the transmitted light outside the straight ray; a system with more has a shade

_log = logging.getLogger(__name__)


def traced_building(building: Building, systems: Mapping[str, States]) -> Building:
    """The building without drawn shades that the BSDF of their window includes; each is logged.

    Args: systems: of each window, by its GUID.
    """
    shades = {id(system): has_shade(system) for states in systems.values() for system in states}
    shaded = {guid for guid, states in systems.items() if any(shades[id(system)] for system in states)}
    building, issues = without_drawn_shades(building, shaded)
    for issue in issues:
        _log.warning("%s", issue_text(issue).line)
    return building


def has_shade(system: FenestrationSystem) -> bool:
    """Whether a system includes a shade: by the stated position of its shade, else by scattering.

    Clear panes transmit light straight on, into one patch for each direction; slats and fabrics
    scatter. All directions count as under a uniform sky.
    """
    if system.shading_position is not None:
        return system.shading_position != "none"
    bsdf = system.visible
    omega = bsdf.basis_in.projected_solid_angles()
    flux = bsdf.transmission_front * bsdf.basis_out.projected_solid_angles()[:, None]
    passed = flux.sum(axis=0) @ omega
    straight = np.maximum(flux.max(axis=0), 0.0) @ omega
    return bool(passed > 0 and 1.0 - straight / passed > SCATTERED)
