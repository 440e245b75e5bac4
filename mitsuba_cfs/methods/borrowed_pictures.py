"""Pictures that look through glass between rooms instead of showing its patches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.glare.annual import PictureMatrix, Pictures, add_seen
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.trace.matrices.adjacent import RoomBehind
from mitsuba_cfs.trace.pictures.adjacent import RoomShown


class BorrowedPictures:
    """Pictures of hours with the rooms behind panes in place of what panes have of them by patches.

        L = V T D s - V_seen diag(tau) D s + what the rooms show of s (`RoomShown`)

    What a pane scatters stays in its patches, as what it lights does; the sun's disc is not seen
    through panes.  The noise is that of the pictures: that of the rooms beyond is not known.
    """

    def __init__(
        self,
        pictures: Pictures,
        rooms: Sequence[RoomShown],
        seen: sparse.csr_array,
        behind: Sequence[RoomBehind],
        daylight: ArrayLike,
        sky: NDArray[np.floating],
    ) -> None:
        """From pictures of hours [h] whose panes show their patches.

        Args:
            rooms: what the panes show instead.
            seen: [n, Q * K] share of each patch of the windows in each pixel.
            behind: which of the windows are panes.
            daylight: D [Q, K, P].
            sky: [P, h] of the hours.
        """
        self.view, self.pixels, self.hours = pictures.view, pictures.pixels, pictures.hours
        self._pictures, self._rooms, self._seen = pictures, rooms, seen
        self._behind, self._sky = behind, np.asarray(sky, dtype=np.float32)
        self._daylight = np.asarray(daylight, dtype=np.float32)

    @property
    def shared(self) -> PictureMatrix:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._pictures.shared

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._with_rooms(self._pictures.values(batch), batch)

    def without_disc(
        self, batch: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], list[SunDisc | None]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        values, discs = self._pictures.without_disc(batch)
        return self._with_rooms(values, batch), discs

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        self._pictures.add_disc(values, batch)

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        rows, values = self._pictures.by_rows(batch)
        return rows, self._with_rooms(values, batch)

    def discs(self, batch: NDArray[np.int64]) -> list[SunDisc | None]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._pictures.discs(batch)

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._pictures.noise(batch)

    def _with_rooms(
        self, values: NDArray[np.float32], batch: NDArray[np.int64]
    ) -> NDArray[np.float32]:
        """The values [h, n] with the rooms in place of the panes' patches."""
        sky = self._sky[:, batch]
        by_patches = np.zeros((*self._daylight.shape[:2], len(batch)), dtype=np.float32)
        for one in self._behind:
            its = slice(one.first, one.first + one.count)
            beam = np.asarray(one.beam, dtype=np.float32)[:, None]
            by_patches[its] = -beam * (self._daylight[its] @ sky)
        add_seen(values, self._seen, by_patches.reshape(-1, len(batch)))
        np.maximum(values, 0, out=values)  # below it by rounding alone
        for room in self._rooms:
            room.add_to(values, sky)
        return values
