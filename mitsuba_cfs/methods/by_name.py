"""The methods and metrics by name, in their three steps: scene, systems, hours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods import METHODS, METRICS
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.path_light import PathLight, PathSystems
from mitsuba_cfs.methods.phase_light import PhaseLight, PhaseSystems
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, silent


class UnknownMethodError(CfsError, ValueError):
    """A method or metric that there is not."""


@dataclass(frozen=True)
class PathScene:
    """A scene for paths: nothing of it is traced beforehand."""

    scene: DaylightScene
    sampling: Sampling


def traced_scene(
    method: str,
    scene: DaylightScene,
    sampling: Sampling | None = None,
    *,
    cache: MatrixCache | None = None,
    progress: Progress = silent,
) -> PhaseScene | PathScene:
    """What a method computes once for a scene; `PhaseScene` traces it when it is asked for."""
    if method not in METHODS:
        raise UnknownMethodError(f"method {method!r}: expected one of {', '.join(METHODS)}")
    if method == "point-in-time":
        return PathScene(scene, sampling or Sampling())
    return PhaseScene(
        scene, sampling, five_phase=method == "five-phase", cache=cache, progress=progress
    )


def with_systems(
    traced: PhaseScene | PathScene, systems: Sequence[States]
) -> PhaseSystems | PathSystems:
    """The scene with what fills its windows: of each group its states."""
    if isinstance(traced, PathScene):
        return PathSystems(traced.scene, systems, traced.sampling)
    return PhaseSystems(traced, systems)


def values(light: PhaseLight | PathLight, metric: str) -> NDArray[np.float64]:
    """A metric in every hour of the light's sky [L]; illuminance [S, L] in lx."""
    if metric not in METRICS:
        raise UnknownMethodError(f"metric {metric!r}: expected one of {', '.join(METRICS)}")
    if metric != "illuminance":
        return hourly_glare(light, metric).dgp
    return light.illuminance()
