"""Glare and illuminance by paths under one sky at a time: all is done again in every time step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.evaluation import GlareOptions, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.simplified import DIRECT_DEPTH, simplified_dgp
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.estimate import Stopping
from mitsuba_cfs.trace.lit_room import Room, Sky
from mitsuba_cfs.trace.picture_paths import point_in_time_picture
from mitsuba_cfs.trace.point_in_time import point_in_time
from scenes.methods.place import Fenestration, Place, Quality, Skies

BATCHES = 4


@dataclass(frozen=True)
class PathScene:
    """A place for one metric."""

    place: Place
    metric: str
    quality: Quality
    geometry: GlareView | None

    def behind(self, fenestration: Fenestration) -> PathSystem:
        """The scene with a fenestration system in its windows."""
        p = self.place
        room = Room(p.interior, p.exterior, p.groups, [fenestration.system] * len(p.groups))
        return PathSystem(self, room)


def path_scene(
    place: Place, metric: str, *, quality: Quality, geometry: GlareView | None = None
) -> PathScene:
    """Nothing but the geometry of the view."""
    pictured = metric in ("DGP", "eDGP")
    return PathScene(
        place, metric, quality, (geometry or GlareView(place.view)) if pictured else None
    )


@dataclass(frozen=True)
class PathSystem:
    """A room ready to be traced."""

    scene: PathScene
    room: Room

    def values(self, skies: Skies, *, progress: Progress = silent) -> NDArray[np.float64]:
        """The metric in every hour [H]; the metric illuminance [H, S] in lx."""
        found = []
        for h in range(skies.hours):
            found.append(self._one(self._sky(skies, h)))
            progress("paths", (h + 1) / skies.hours)
        return np.array(found)

    def picture(self, skies: Skies, hour: int, **options) -> NDArray[np.float32]:
        """Luminance picture [ny, nx] of one hour [cd/m2]; options of `point_in_time_picture`."""
        s = self.scene
        options = {"samples": s.quality.path_samples, "seed": s.quality.seed} | options
        return point_in_time_picture(self.room, self._sky(skies, hour), s.place.view, **options)

    def illuminance(self, skies: Skies, hour: int) -> NDArray[np.float64]:
        """Illuminance [S] of one hour at the metric's sensors [lx]."""
        return self._illuminance(self._sky(skies, hour))

    def _one(self, sky: Sky) -> float | NDArray[np.float64]:
        s = self.scene
        if s.metric == "illuminance":
            return self._illuminance(sky)
        if s.metric == "sDGP":
            return simplified_dgp(self._illuminance(sky))[0]
        options, depth = GlareOptions(), {}
        if s.metric == "eDGP":
            options = GlareOptions(illuminance=float(self._illuminance(sky)[0]))
            depth = {"max_depth": DIRECT_DEPTH}
        picture = point_in_time_picture(
            self.room, sky, s.place.view, samples=s.quality.path_samples, seed=s.quality.seed,
            **depth,
        )  # fmt: skip
        return evaluate(picture, s.geometry, options=options).dgp

    def _illuminance(self, sky: Sky) -> NDArray[np.float64]:
        points, normals = self.scene.place.sensors(self.scene.metric)
        q = self.scene.quality
        return point_in_time(
            self.room, sky, points, normals, samples=max(1, q.sensor_samples // BATCHES),
            stopping=Stopping(batches=BATCHES), seed=q.seed,
        ).values  # fmt: skip

    @staticmethod
    def _sky(skies: Skies, hour: int) -> Sky:
        return Sky(
            skies.sky[:, hour], skies.direction[hour], skies.illuminance[hour] / SUN_SOLID_ANGLE
        )
