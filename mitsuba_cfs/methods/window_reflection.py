"""Light that windows reflect, back into the room and onto what stands outdoors before them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.trace.kernels.estimate import Estimate

# of reflection in the windows: a fifth is below 0.001 in a bright room with a front of glass
ORDERS = 4
MOST_KEPT = 8  # combinations of states whose reflection to the sensors is held
OUTDOOR_ORDERS = 2  # fins send back a tenth of what panes reflect, which is a seventh


class WindowReflection:
    """What V T D s lacks, its windows being black from the room and from outdoors.

        L' = L + R W L + (R W)^2 L + ...
        I' = I + X R_f I + (X R_f)^2 I + ...

    L is the luminance of the windows T I, I = D s that before them; W and X are what the windows
    see of the room and of the outdoors that they light, R and R_f their reflection to either side
    on the same patches.  A mirror image keeps its direction to a patch.  Light that leaves the room
    and comes back is not among it: 0.1 to 0.4 % beside fins, by paths.
    """

    def __init__(self, traced: PhaseScene) -> None:
        """Of a scene; nothing is traced before a system reflects."""
        self._traced = traced
        self._sensors: dict[tuple[int, ...], tuple[list[SystemOptics], NDArray[np.float32]]] = {}

    def reflects(self, optics: Sequence[SystemOptics]) -> bool:
        """Whether anything comes back from the parts' systems [Q]."""
        return any(o.reflection is not None and o.reflection.any() for o in optics)

    def windows(
        self,
        optics: Sequence[SystemOptics],
        luminance: NDArray[np.floating],
        in_sun: Sequence[NDArray[np.floating]] | None = None,
    ) -> NDArray[np.float64]:
        """Luminance [Q, K, H] that is added to that of the parts' windows [Q, K, H].

        Args: in_sun: the part of them that is the sun's beam [Q, K, H], and what meets them of it
            from the room [Q * K, H], by shadow rays: of their paths few would meet the sun's patch.
        """
        exchange, added = self._traced.exchange.values, np.zeros(luminance.shape)
        source, met = luminance, np.zeros(luminance.shape)
        if in_sun is not None:  # below 0 by rounding alone
            source, met = np.maximum(luminance - in_sun[0], 0), in_sun[1].reshape(luminance.shape)
        for _ in range(ORDERS):
            flat = source.reshape(-1, luminance.shape[-1])
            before, back = exchange @ flat + met, np.zeros_like(added)
            for q, one in enumerate(optics):
                if one.reflection is not None:
                    back[q] = one.reflection @ before[q]
            added, source, met = added + back, back, np.zeros(1)
        return added

    def sensors(self, optics: Sequence[SystemOptics]) -> NDArray[np.float32]:
        """V (R W + (R W)^2 + ...) [S, Q * K]: light of the sensors by reflection in windows.

        In single precision: the noise of W is a hundred thousand times its rounding.
        """
        key = tuple(map(id, optics))
        if key not in self._sensors:
            if len(self._sensors) >= MOST_KEPT:
                self._sensors.clear()
            self._sensors[key] = list(optics), self._by_reflection(optics)
        return self._sensors[key][1]

    def _by_reflection(self, optics: Sequence[SystemOptics]) -> NDArray[np.float32]:
        exchange = self._traced.exchange.values
        width = exchange.shape[-1]
        exchange = exchange.reshape(width, width).astype(np.float32)
        found = self._traced.sensors.values.reshape(-1, width).astype(np.float32)
        total = np.zeros_like(found)
        for _ in range(ORDERS):
            found = self._by_part(optics, "reflection", found) @ exchange
            total += found
        return total

    def variance_by_room(
        self, optics: Sequence[SystemOptics], luminance: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Variance of the sensors' light [S] by the noise of W, that of its first order.

        Args: luminance: L [Q, K].
        """
        view, exchange = self._traced.sensors.values, self._traced.exchange
        noise = _row_variance(exchange, luminance)
        found = np.zeros(len(view))
        for q, one in enumerate(optics):
            if one.reflection is not None:
                found += (view[:, q] @ one.reflection) ** 2 @ noise[q]
        return found

    def variance_by_outdoors(
        self, optics: Sequence[SystemOptics], before: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Variance of the sensors' light [S] by the noise of X, that of its first order.

        Args: before: I [Q, K].
        """
        exchange = self._traced.outdoor_exchange
        sent = np.zeros((len(exchange.values), KLEMS_FULL.size))
        for q, one in enumerate(optics[: len(sent)]):
            if one.outdoor_reflection is not None:
                sent[q] = one.outdoor_reflection @ before[q]
        noise = _row_variance(exchange, sent)
        return self.shares(optics)[:, : noise.size] ** 2 @ noise.ravel()

    def reflects_outdoors(self, optics: Sequence[SystemOptics]) -> bool:
        """Whether anything outdoors is lit by the parts' systems [Q]."""
        given = (o.outdoor_reflection for o in optics)
        something = len(self._traced.scene.exterior.triangles) > 0
        return something and any(one is not None and one.any() for one in given)

    def outdoors(
        self, optics: Sequence[SystemOptics], shares: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Shares [n, Q * K] of what is before the windows, by way of their reflection outdoors.

        F (X R_f + (X R_f)^2 + ...)

        Args: shares: F [n, Q * K] of what comes to the windows otherwise.
        """
        exchange, K = self._traced.outdoor_exchange.values, KLEMS_FULL.size
        found, mine = shares.reshape(len(shares), -1), len(exchange) * K
        flat, total = exchange.reshape(mine, -1), np.zeros(found.shape)
        for _ in range(OUTDOOR_ORDERS):
            sent = found[:, :mine] @ flat
            found = self._by_part(optics[: len(exchange)], "outdoor_reflection", sent)
            total[:, :mine] += found
        return total

    def returned(
        self, optics: Sequence[SystemOptics], light: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """What comes back to the windows of their light [Q * K, h] by their reflection outdoors.

        (X R_f + (X R_f)^2 + ...) I, for few hours less work than `outdoors`
        """
        exchange, K = self._traced.outdoor_exchange.values, KLEMS_FULL.size
        parts, total = len(exchange), np.zeros(light.shape)
        flat, found = exchange.reshape(parts * K, -1), light
        for _ in range(OUTDOOR_ORDERS):
            sent = np.zeros((flat.shape[1], light.shape[1]))
            for q, one in enumerate(optics[:parts]):
                if one.outdoor_reflection is not None:
                    mine = slice(q * K, (q + 1) * K)
                    sent[mine] = one.outdoor_reflection @ found[mine]
            found = flat @ sent
            total[: parts * K] += found
        return total

    def shares(self, optics: Sequence[SystemOptics]) -> NDArray[np.float64]:
        """What the sensors have of the light before the parts' windows, by patches [S, Q * K]."""
        view = self._traced.sensors.values
        view = view.reshape(len(view), -1)
        if self.reflects(optics):
            view = view + self.sensors(optics)
        return self.through(optics, view)

    @classmethod
    def through(
        cls, optics: Sequence[SystemOptics], shares: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Shares [n, Q * K] of the windows' luminance as of what is before them."""
        return cls._by_part(optics, "transmission", shares)

    @staticmethod
    def _by_part(
        optics: Sequence[SystemOptics], name: str, shares: NDArray[np.floating]
    ) -> NDArray[np.floating]:
        """Shares [n, Q * K] by a matrix [K, K] of each part's system; nothing where it has none."""
        K, found = KLEMS_FULL.size, np.zeros_like(shares)
        for q, one in enumerate(optics):
            matrix, mine = getattr(one, name), slice(q * K, (q + 1) * K)
            if matrix is not None:
                found[:, mine] = shares[:, mine] @ matrix.astype(shares.dtype)
        return found


def _row_variance(exchange: Estimate, luminance: NDArray[np.floating]) -> NDArray[np.float64]:
    """Variance [Q, K] of the sums of W or X times luminances [Q, K].

    A path ends on one patch of one window, so the entries of a row are taken as independent.
    """
    return exchange.standard_error**2 @ luminance.ravel() ** 2
