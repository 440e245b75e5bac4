"""How much of what stands outdoors is seen through what fills a room's windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bim.model import Window
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.klems_peak import through_peak
from scenes.fenestration.systems import FenestrationSystem, States


def straight_view(
    windows: Sequence[Window], systems: Mapping[str, States], state: NDArray[np.int64]
) -> float:
    """Visible transmittance straight on at normal incidence [%], mean of windows and hours.

    The normal-normal transmittance by which EN 14501 classes the view out; what a system scatters,
    or sends on in another direction, shows nothing of the outdoors.

    Args:
        systems: by state of each window, by its GUID; the last state stands for those beyond.
        state: [h] the room's shading state in the hours that count.
    """
    beams: dict[int, float] = {}
    hours = np.bincount(state)
    seen = area = 0.0
    for window in windows:
        states = systems[window.guid]
        for number, count in enumerate(hours):
            system = states[min(number, len(states) - 1)]
            if id(system) not in beams:
                beams[id(system)] = _normal_beam(system)
            seen += window.area * count * beams[id(system)]
        area += window.area
    return 100.0 * seen / (area * len(state)) if len(state) else 0.0


def _normal_beam(system: FenestrationSystem) -> float:
    """The beam through the patch at normal incidence."""
    block = system.visible.transmission_front
    if block is None:
        raise ValueError(f"{system.name} has no transmission")
    return float(through_peak(block, KLEMS_FULL).transmittance[0])
