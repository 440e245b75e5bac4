"""What sensors have of each sky patch through the windows, before the hours are looked at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.straight_views import StraightViews
from mitsuba_cfs.methods.window_reflection import WindowReflection

Array = NDArray[np.float64]


class SensorCoefficients:
    """The sums of matrices that the hours' skies are multiplied by, for sensors and the eye last.

    Sensors are few beside hours and directions: all that goes before a sky is multiplied first.
    """

    def __init__(
        self,
        traced: PhaseScene,
        straight: StraightViews,
        mirrored: WindowReflection,
    ) -> None:
        """Of a scene and the views through what fills its windows; nothing is traced."""
        self._traced, self._straight, self._mirrored = traced, straight, mirrored

    def of_group(self, g: int, j: int) -> Array:
        """What a group in a state gives per unit luminance of each sky patch [S, P].

        V T D + B - V_d diag(tau) D
        """
        traced, seen = self._traced, self._straight.matrix(g, j)
        found = np.zeros((len(traced.sensors.values), traced.daylight.values.shape[-1]))
        for q in traced.parts.of(g):
            found += self._straight.rest(g, j, q) @ traced.daylight.values[q]
        return found if seen is None else found + seen.values

    def by_sun_patches(self, g: int, j: int) -> Array:
        """What of it the sun's patches give that is taken at the sun's own angle [S, P].

        V_d T D_d + (V - V_d) T_b D_d + B_d - V_d diag(tau) D_d
        """
        traced, straight = self._traced, self._straight
        lost, held = straight.transmission(g, j), straight.held(g, j)
        seen = straight.matrix(g, j, direct=True)
        if seen is not None:
            lost = lost - np.diag(straight.beam(g, j))
        found = np.zeros((len(traced.direct_sensors), traced.daylight.values.shape[-1]))
        for q in traced.parts.of(g):
            view, direct = traced.sensors.values[:, q], traced.direct_sensors[:, q]
            found += (direct @ lost + (view - direct) @ held) @ traced.direct_daylight[q]
        return found if seen is None else found + seen.values

    def reflected(self, optics: Sequence[SystemOptics]) -> tuple[Array | None, Array | None]:
        """Shares [S, Q * K] of the light before the parts that come by reflection in windows.

        With the parts' systems [Q].  All of them, and those by way of the outdoors; None where
        there are none.
        """
        mirrored = self._mirrored
        shares = outwards = None
        if mirrored.reflects(optics):
            shares = mirrored.through(optics, mirrored.sensors(optics)).astype(float)
        if mirrored.reflects_outdoors(optics):
            outwards = mirrored.outdoors(optics, mirrored.shares(optics))
            shares = outwards if shares is None else shares + outwards
        return shares, outwards

    def of_sky(self, shares: Array) -> Array:
        """Shares [n, Q * K] of the light before the windows as shares of the sky's [n, P]."""
        daylight = self._traced.daylight.values
        found: Array = shares @ daylight.reshape(shares.shape[1], -1)
        return found
