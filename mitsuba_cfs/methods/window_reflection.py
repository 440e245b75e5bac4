"""Light that windows reflect back into the room, by the back reflection of what fills them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene

# of reflection in the windows: a fifth is below 0.001 in a bright room with a front of glass
ORDERS = 4


class WindowReflection:
    """What V T D s lacks, its windows being black from the room.

        L' = L + R W L + (R W)^2 L + ...

    L is the luminance of the windows T D s, W what they see of the room that it lights, R their
    reflection to the room on the same patches.  A mirror image keeps its direction to a patch.
    """

    def __init__(self, traced: PhaseScene) -> None:
        """Of a scene; nothing is traced before a system reflects."""
        self._traced = traced

    def reflects(self, optics: Sequence[SystemOptics]) -> bool:
        """Whether anything comes back from the parts' systems [Q]."""
        return any(o.reflection is not None and o.reflection.any() for o in optics)

    def windows(
        self, optics: Sequence[SystemOptics], luminance: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Luminance [Q, K, H] that is added to that of the parts' windows [Q, K, H]."""
        exchange, added = self._traced.exchange, np.zeros(luminance.shape)
        source = luminance
        for _ in range(ORDERS):
            flat = source.reshape(-1, luminance.shape[-1])
            back = np.zeros_like(added)
            for q, one in enumerate(optics):
                if one.reflection is not None:
                    back[q] = one.reflection @ (exchange[q] @ flat)
            added, source = added + back, back
        return added

    def sensors(self, optics: Sequence[SystemOptics]) -> NDArray[np.float64]:
        """V (R W + (R W)^2 + ...) [S, Q * K]: light of the sensors by reflection in windows."""
        traced = self._traced
        view, found, total = traced.sensors.values, traced.sensors.values, 0.0
        for _ in range(ORDERS):
            back = np.zeros((len(view), view[0].size))
            for q, one in enumerate(optics):
                if one.reflection is not None:
                    back += (found[:, q] @ one.reflection) @ traced.exchange[q]
            found = back.reshape(view.shape)
            total = total + back
        return total
