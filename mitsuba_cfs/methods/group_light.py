"""The light of one window group in one state, before the windows and at the sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class WindowLight:
    """The luminance of a part of a window group towards the room in one state."""

    whole: NDArray[np.float32]  # [K, L] T D s [cd/m2]
    sun: NDArray[np.float32] | None  # [K, L] T D_d s_d, the sun alone
    beam: NDArray[np.float32] | None  # [K, L] what of this goes straight on
    beam_at_sun: NDArray[np.float32] | None  # [K, L] the same at the sun's own angle


@dataclass(frozen=True, slots=True)
class SensorLight:
    """What a window group in one state gives to the sensors, the eye last [lx]."""

    diffuse: NDArray[np.float64]  # [S, L] V T D s - V_d T D_d s_d + the reflected beam's own angle
    sun: NDArray[np.float64] | None  # [S, L] C_ds s_sun
    sun_error: NDArray[np.float64] | float  # [S] of the hours' sum of it and of the reflected sun
