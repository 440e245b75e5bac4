"""Pictures of few hours: the view's paths are traced for these hours, not for all patches."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.annual import Pictures
from mitsuba_cfs.methods.optics import combinations
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.pictures.annual import FivePhasePictures


def pictures_by_state(
    light: PhaseLight, hours: NDArray[np.int64], rows: NDArray[np.int64]
) -> list[tuple[NDArray[np.int64], Pictures]]:
    """Pictures of some hours [n], each window group in a state of its own in each [G, n].

    Matrices of the view have a column for each patch of the windows' parts.  Where the pictures are
    far fewer, and these matrices are not at hand, the windows' luminance goes into the paths of the
    view instead, that of all pictures at once: a column for each picture.

    Returns: of each combination of states the numbers [k] of its hours, and their pictures.
    """
    kinds, traced = list(combinations(rows)), light.filled.traced
    few = traced.few(len(hours))
    made = [(at, light.pictures(hours[at], state, few=few)) for state, at in kinds]
    if few:
        fives = [cast(FivePhasePictures, pictures) for _, pictures in made]
        whole = PatchLight.joined([five.light(np.arange(five.hours)) for five in fives])
        matrices, first = traced.view_of(whole), 0
        for five in fives:
            five.see_by(matrices.of_columns(slice(first, first + five.hours)))
            first += five.hours
    return made
