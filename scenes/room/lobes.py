"""What an undecided transmission peak does to a room's results: as a beam and as a lobe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.methods.glare import bright_hours, glare_with
from mitsuba_cfs.methods.light import illuminance, illuminance_with_systems
from scenes.fenestration.peaks import as_lobes, lobe_effect, lobe_effect_on_sensors
from scenes.results import GlareResults
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight, picture_light

RATED = 16  # hours whose glare is computed both ways
LIT = 64  # hours with sun whose illuminance is


def lobe_figures(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    *,
    rated: tuple[str, NDArray[np.int64], AnnualGlare] | None,
    year: pd.DataFrame | None,
    glare: GlareResults,
) -> dict[str, float]:
    """Figures of `lobe_effect` and `lobe_effect_on_sensors`; none where all peaks are known.

    Illuminance is computed by the phases' matrices, also where the room's own is path-traced.

    Args:
        state: [H, G] of the window groups.
        rated: a metric, hours of the year [n] and their ratings.
        year: `annual_glare`; glare: pictures.  Of the three the first that there is is compared.
    """
    changed = as_lobes(room.windows.systems)
    if changed is None:
        return {}
    outdoors, sky, rows = len(room.windows.groups), room.skies, light.states(state)
    lobes = [*replace(room.windows, systems=changed).optics(), *light.light.systems[outdoors:]]
    metric, source = "DGP", picture_light(room, light)
    if rated is not None:
        metric, hours = rated[0], np.searchsorted(sky.lit, rated[1])
        dgp, eye = rated[2].dgp, rated[2].Ev
    elif year is not None:
        source, hours = light.light, np.arange(len(sky.lit))
        dgp, eye = (year[name].to_numpy()[sky.lit] for name in ("dgp", "ev"))
    else:
        hours = np.searchsorted(sky.lit, [picture.hour for picture in glare.pictures])
        dgp, eye = (np.array([p.glare[n] for p in glare.pictures]) for n in ("dgp", "ev"))
    figures: dict[str, float] = {}
    if len(hours):
        some = bright_hours(dgp, RATED)
        rating = rating_of(room.options.outputs)
        by_lobe = glare_with(source, lobes, hours[some], metric, rows, options=rating)
        figures |= lobe_effect((dgp[some], eye[some]), by_lobe)
    sunny = np.flatnonzero(sky.illuminance > 0)
    if len(sunny):
        some = sunny[np.unique(np.linspace(0, len(sunny) - 1, LIT).astype(np.int64))]
        figures |= lobe_effect_on_sensors(
            illuminance(light.light, rows)[:, some], illuminance_with_systems(light.light, lobes, some, rows)
        )
    return figures
