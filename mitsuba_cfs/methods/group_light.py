"""The light of one window group in one state, before the windows and at the sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.klems_peak import held_beams
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.kernels.scattering import patch_beams, through_beams


@dataclass(frozen=True, slots=True)
class WindowLight:
    """The luminance of a part of a window group towards the room in one state."""

    whole: NDArray[np.float32]  # [K, L] T D s [cd/m2]
    sun: NDArray[np.float32] | None  # [K, L] T D_d s_d, the sun alone
    beam: NDArray[np.float32] | None  # [K, L] what of this goes straight on
    beam_at_sun: NDArray[np.float32] | None  # [K, L] the same at the sun's own angle

    def some(self, hours: NDArray[np.int64]) -> WindowLight:
        """That of some of the hours."""
        rest = (self.sun, self.beam, self.beam_at_sun)
        return WindowLight(
            self.whole[:, hours], *(None if part is None else part[:, hours] for part in rest)
        )


@dataclass(frozen=True, slots=True)
class SensorLight:
    """What a window group in one state gives to the sensors, the eye last.

    Whatever the hours' skies multiply is kept by their patches: the groups are added up before.
    """

    whole: NDArray[np.float64]  # [S, P] per unit luminance of the sky, `SensorCoefficients`
    by_sun: NDArray[np.float64] | None = None  # [S, P] of the sun alone, to take away
    added: NDArray[np.float64] | None = None  # [S, L] the reflected sun in its place [lx]
    sun: NDArray[np.float64] | None = None  # [S, L] C_ds s_sun [lx]
    sun_error: NDArray[np.float64] | float = 0.0  # [S] of the hours' sums of these two

    def over_hours(self, sky: AnnualSky) -> NDArray[np.float64]:
        """The sum of all hours of the sky that it is of [S] [lx], but for what windows reflect."""
        whole, sun, _ = sky.totals(np.ones(len(sky.lit), dtype=bool))
        found = self.whole @ whole
        if self.by_sun is not None:
            found -= self.by_sun @ sun
        for part in (self.added, self.sun):
            if part is not None:
                found += part.sum(axis=1)
        return found


def window_light(traced: PhaseScene, q: int, optics: SystemOptics, sky: AnnualSky) -> WindowLight:
    """The luminance of a part of a window group towards the room under a sky."""
    # single precision: the noise of D is a hundred thousand times its rounding
    T, daylight = [optics.transmission.astype(np.float32)], traced.daylight.values
    whole_sky = sky.whole.astype(np.float32)
    whole = phases.room_side_radiance(T, daylight[q : q + 1].astype(np.float32), whole_sky)
    if not traced.five_phase:
        return WindowLight(whole[0], None, None, None)
    direct = traced.direct_daylight[q : q + 1].astype(np.float32)
    sun = phases.room_side_radiance(T, direct, sky.lit_sun.astype(np.float32))
    return WindowLight(whole[0], sun[0], *sun_beam(traced, q, optics, sky))


def sun_beam(
    traced: PhaseScene, q: int, optics: SystemOptics, sky: AnnualSky
) -> tuple[NDArray[np.float32] | None, ...]:
    """The sun's beam of a part [K, L] by its patches and at its own angle; None without a beam."""
    ways, sun = [optics.scattering], sky.lit_sun
    patches = patch_beams(ways, KLEMS_FULL)
    if not patches.any():
        return None, None
    at_sun = through_beams(traced.parts.groups[q : q + 1], ways, sky.direction)
    T = [held_beams(optics.transmission, patches[0], KLEMS_FULL)]
    daylight = traced.straight_daylight[q : q + 1]
    by_patch, by_angle = phases.sun_beams(T, at_sun, daylight, sun)
    if traced.straight_daylight is not traced.direct_daylight:  # out of a mirror, by patches
        daylight = traced.direct_daylight[q : q + 1]
        straight = by_patch
        by_patch, _ = phases.sun_beams(T, at_sun, daylight, sun)
        by_angle = by_angle + (by_patch - straight)
    return by_patch[0].astype(np.float32), by_angle[0].astype(np.float32)
