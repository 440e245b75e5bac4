"""Luminance pictures of a room's hours, by the method of the run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.glare.annual import Pictures, full_picture
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.trace.annual_pictures import FivePhasePictures, ViewMatrices, view_matrices
from mitsuba_cfs.trace.picture_outdoors import outdoors
from mitsuba_cfs.trace.picture_sun import PictureSun
from mitsuba_cfs.trace.systems import sun_scattering
from scenes.job.daylight import RoomMatrices, RoomScene, StateLight
from scenes.job.kept_views import kept_view
from scenes.job.options import RoomOptions
from scenes.job.paths import path_picture
from scenes.job.skies import Skies

OUTDOOR_PATHS = 8  # for each pixel, straight through the windows


@dataclass(frozen=True, slots=True)
class PictureMaker:
    """Everything that the pictures of a room's view are made from."""

    scene: RoomScene
    matrices: RoomMatrices
    lights: list[StateLight]  # [J]
    state: NDArray[np.int64]  # [L] that holds in each lit hour
    skies: Skies
    options: RoomOptions
    view: ViewMatrices | None  # None for paths

    def of_state(self, state: int, columns: NDArray[np.int64]) -> Pictures:
        """Pictures of some lit hours [n] in a state, by the three-phase or five-phase method."""
        light, sun = self.lights[state], self.skies.sun
        window = light.window[:, :, columns]
        if self.options.method != "five-phase":
            return self.view.three_phase(window)
        scene, seed = self.scene, self.options.seed
        scattering = scene.windows.of_state(state, lambda system: sun_scattering(system.fine))
        around = (scene.interior, scene.exterior, scene.groups, scattering, scene.view)
        pictures = FivePhasePictures(
            self.view,
            PictureSun(*around),
            window,
            light.window_direct[:, :, columns],
            sun.direction[columns],
            sun.illuminance[columns],
        )
        alone = sun.patches[:, columns]
        pictures.show_outdoors(
            outdoors(
                *around,
                subdivision=self.options.sky_subdivision,
                samples=OUTDOOR_PATHS,
                seed=seed,
            ),
            self.matrices.daylight.values,
            self.matrices.daylight_direct,
            np.maximum(self.skies.visible[:, columns] - alone, 0.0),
            alone,
        )
        return pictures

    def of_hours(self, columns: NDArray[np.int64], progress: Progress) -> list[NDArray[np.float32]]:
        """Pictures [ny, nx] [cd/m2] of some lit hours [n]."""
        if self.view is None:
            return [
                path_picture(
                    self.scene, int(self.state[c]), int(c), self.skies, self.options,
                    part(progress, i / len(columns), (i + 1) / len(columns), "pictures"),
                )
                for i, c in enumerate(columns)
            ]  # fmt: skip
        found: dict[int, NDArray[np.float32]] = {}
        for j in np.unique(self.state[columns]).tolist():
            chosen = columns[self.state[columns] == j]
            pictures = self.of_state(j, chosen)
            values = pictures.values(np.arange(len(chosen)))
            for c, row in zip(chosen.tolist(), values, strict=True):
                found[c] = full_picture(row, pictures.pixels, pictures.view)
        progress("pictures", 1.0)
        return [found[c] for c in columns.tolist()]


def picture_maker(
    scene: RoomScene,
    matrices: RoomMatrices,
    lights: list[StateLight],
    state: NDArray[np.int64],
    skies: Skies,
    options: RoomOptions,
    cache: MatrixCache | None,
    progress: Progress,
) -> PictureMaker:
    """The maker of a room's pictures, its view matrices traced."""
    view = None
    if options.method != "point-in-time":
        sampling = {"samples": options.picture_samples, "seed": options.seed}
        view = kept_view(
            cache,
            scene.view,
            (variants.activate(), scene.interior, scene.groups, *sampling.values()),
            lambda: view_matrices(
                scene.interior,
                scene.groups,
                scene.view,
                progress=progress,
                **sampling,
            ),
        )
    return PictureMaker(scene, matrices, lights, state, skies, options, view)
