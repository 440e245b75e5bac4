"""The three methods by name."""

from __future__ import annotations

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.glare.glare_view import GlareView
from scenes.methods.place import METRICS, Place, Quality

METHODS = ("three-phase", "five-phase", "point-in-time")


class UnknownMethodError(CfsError, ValueError):
    """A method or metric that there is not."""


def method_scene(
    method: str,
    metric: str,
    place: Place,
    quality: Quality | None = None,
    *,
    geometry: GlareView | None = None,
):
    """What a method computes once for a place: a `PhaseScene` or a `PathScene`.

    `.behind(fenestration)` of it is computed once for each system, and `.values(skies)` of that
    for the time steps: the metric in each hour.
    """
    if method not in METHODS:
        raise UnknownMethodError(f"method {method!r}: expected one of {', '.join(METHODS)}")
    if metric not in METRICS:
        raise UnknownMethodError(f"metric {metric!r}: expected one of {', '.join(METRICS)}")
    quality = quality or Quality()
    if method == "point-in-time":
        from scenes.methods.paths import path_scene

        return path_scene(place, metric, quality=quality, geometry=geometry)
    from scenes.methods.phases import phase_scene

    return phase_scene(
        place, metric, five_phase=method == "five-phase", quality=quality, geometry=geometry
    )
