"""Three-phase and five-phase glare and illuminance, step by step: scene, system, time steps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.glare.annual import Pictures, annual_glare
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.simplified import direct_only, enhanced_simplified_dgp, simplified_dgp
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.annual_pictures import FivePhasePictures, ViewMatrices, view_matrices
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
from mitsuba_cfs.trace.direct_sun import direct_sun_matrix, patch_beams, through_beams
from mitsuba_cfs.trace.estimate import Stopping
from mitsuba_cfs.trace.picture_outdoors import Outdoors, outdoors
from mitsuba_cfs.trace.picture_sun import PictureSun
from mitsuba_cfs.trace.view_matrix import view_matrix
from scenes.methods.place import Fenestration, Place, Quality, Skies

BATCHES = 4
DEPTH = 16
SUN_HOURS = 512  # columns of C_ds traced at a time


@dataclass(frozen=True)
class PhaseScene:
    """The matrices of a place for one metric: nothing in them depends on the fenestration."""

    place: Place
    metric: str
    five_phase: bool
    quality: Quality
    daylight: NDArray[np.float64]  # [G, K, P] D
    direct_daylight: NDArray[np.float64] | None  # [G, K, P] D_d
    view: NDArray[np.float64] | None  # [S, G, K] V of the sensors
    direct_view: NDArray[np.float64] | None  # [S, G, K] V_d
    pictures: ViewMatrices | None
    geometry: GlareView | None

    def behind(self, fenestration: Fenestration) -> PhaseSystem:
        """The scene with a fenestration system in its windows."""
        sun, seen, place = None, None, self.place
        if self.five_phase and self.pictures is not None:
            ways = [fenestration.scattering] * len(place.groups)
            arguments = place.interior, place.exterior, place.groups, ways, place.view
            sun = PictureSun(*arguments)
            seen = outdoors(*arguments, subdivision=self.quality.subdivision)
        return PhaseSystem(self, fenestration, sun, seen)


def phase_scene(
    place: Place,
    metric: str,
    *,
    five_phase: bool,
    quality: Quality,
    geometry: GlareView | None = None,
    other: PhaseScene | None = None,
    progress: Progress = silent,
) -> PhaseScene:
    """Trace what a metric needs: D, and V of sensors or of a picture's pixels.

    Args: other: a scene of another view of the same room, for the same metric: its D is taken.
    """
    q, stopping = quality, Stopping(batches=BATCHES)
    points, normals = place.sensors(metric)

    def daylight(depth: int, start: float) -> NDArray[np.float64]:
        return daylight_matrix(
            place.exterior, place.groups, subdivision=q.subdivision,
            samples=max(1, q.patch_samples // BATCHES), max_depth=depth, stopping=stopping,
            seed=q.seed, progress=part(progress, start, start + 0.1, "matrices"),
        ).values  # fmt: skip

    def view(depth: int, start: float) -> NDArray[np.float64]:
        return view_matrix(
            place.interior, place.groups, points, normals,
            samples=max(1, q.sensor_samples // BATCHES), max_depth=depth, stopping=stopping,
            seed=q.seed, progress=part(progress, start, start + 0.05, "matrices"),
        ).values  # fmt: skip

    direct = five_phase or metric == "eDGP"
    pictured = metric in ("DGP", "eDGP")
    return PhaseScene(
        place, metric, five_phase, q,
        other.daylight if other else daylight(DEPTH, 0.0),
        other.direct_daylight if other else daylight(1, 0.1) if direct else None,
        view(32, 0.2) if len(points) else None,
        view(1, 0.25) if len(points) and five_phase else None,
        view_matrices(
            place.interior, place.groups, place.view, samples=q.pixel_samples, seed=q.seed,
            memory=q.memory, max_depth=32 if metric == "DGP" else 1,
            progress=part(progress, 0.3, 1.0, "matrices"),
        ) if pictured else None,
        (geometry or GlareView(place.view)) if pictured else None,
    )  # fmt: skip


@dataclass(frozen=True)
class PhaseSystem:
    """A scene behind one fenestration system."""

    scene: PhaseScene
    fenestration: Fenestration
    sun: PictureSun | None
    outdoors: Outdoors | None

    def values(
        self, skies: Skies, *, keep: Path | None = None, progress: Progress = silent
    ) -> NDArray[np.float64]:
        """The metric in every hour [H]; the metric illuminance [H, S] in lx.

        Args: keep: file of the ratings so far, see `annual_glare`.
        """
        metric, geometry = self.scene.metric, self.scene.geometry
        if metric == "illuminance":
            return self.illuminance(skies).T
        if metric == "sDGP":
            return simplified_dgp(self.illuminance(skies)[0])
        options = {"geometry": geometry, "keep": keep, "progress": progress}
        if metric == "eDGP":
            return enhanced_simplified_dgp(
                self.pictures(skies), self.illuminance(skies)[0], **options
            )
        return annual_glare(self.pictures(skies), **options).dgp

    def illuminance(self, skies: Skies) -> NDArray[np.float64]:
        """Illuminance [S, H] at the metric's sensors [lx]."""
        s, T = self.scene, self._transmission
        whole = phases.three_phase(s.view, T, s.daylight, skies.sky + skies.sun)
        if not s.five_phase:
            return whole
        direct = phases.three_phase(s.direct_view, T, s.direct_daylight, skies.sun)
        ways = [self.fenestration.scattering] * len(s.place.groups)
        whole = whole + phases.beam_at_sun_angle(
            s.view - s.direct_view, T, patch_beams(ways, KLEMS_FULL),
            through_beams(s.place.groups, ways, skies.direction), s.direct_daylight, skies.sun,
        )  # fmt: skip
        points, normals = s.place.sensors(s.metric)
        exact = [
            direct_sun_matrix(
                s.place.interior, s.place.exterior, s.place.groups,
                ways, points, normals,
                skies.direction[start : start + SUN_HOURS], stopping=Stopping(batches=BATCHES),
            ).values
            for start in range(0, skies.hours, SUN_HOURS)
        ]  # fmt: skip
        disc = np.where(skies.direction[:, 2] > 0, skies.illuminance, 0.0) / SUN_SOLID_ANGLE
        return phases.five_phase(whole, direct, np.concatenate(exact, axis=1), disc)

    def pictures(self, skies: Skies) -> Pictures:
        """The pictures of the metric: of all light for DGP, of direct light for eDGP."""
        s, T, whole = self.scene, self._transmission, skies.sky + skies.sun
        matrices, daylight = s.pictures, s.daylight
        if s.metric == "eDGP":
            matrices, daylight = direct_only(matrices), s.direct_daylight
        luminance = phases.room_side_radiance(T, daylight, whole)
        if not s.five_phase:
            return matrices.three_phase(luminance)
        direct = phases.room_side_radiance(T, s.direct_daylight, skies.sun)
        found = FivePhasePictures(
            matrices, self.sun, luminance, direct, skies.direction, skies.illuminance
        )
        found.show_outdoors(self.outdoors, daylight, s.direct_daylight, skies.sky, skies.sun)
        return found

    @property
    def _transmission(self) -> list[NDArray[np.float64]]:
        return [self.fenestration.transmission] * len(self.scene.place.groups)
