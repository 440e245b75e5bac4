"""What the sun's rays give of a scene whatever fills its windows, from the cache or traced.

    light of a row  = sum over points m of share[row, m] E_sun[m]                 outdoors to the windows
    light of sensor = sum over paths i of w[i] tau(way[i]) E_sun[m(i)]            outdoors, straight through
                    = sum over specular paths n of tau_n(sun) E_n[s] E_normal     beam reflected by the room
                    = sum over specular paths n of tau_n(sun) O_n[s] E_normal     beam of the sun's disc
                    + sum over points j of w[s, j] l_n[j] f(sun, s) E_normal      light that windows scatter

Points, weights, E_sun, E_n, O_n and the sunlit share l_n are geometry: they are traced with open windows and
stored.  A system adds tau, the transmittance of its straight beam, and its BSDF f, so that another system
traces none of these rays again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache
from mitsuba_cfs.matrices.packed import PackedArray
from mitsuba_cfs.matrices.stored_parts import Arrays, parts_of, stored_or_computed, write_parts
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints
from mitsuba_cfs.trace.sun.reflected import SunShares, ViewShares, light_of_rows, view_shares, window_shares
from mitsuba_cfs.trace.sun.sun_at_points import SunAtPoints, sun_at_points
from mitsuba_cfs.trace.sun.sun_discs import DiscEdges, SunDiscs
from mitsuba_cfs.trace.sun.sunlit_sensors import OpenBeamLight


@dataclass(frozen=True, slots=True)
class Suns:
    """The suns of some hours."""

    direction: NDArray[np.float64]  # [h, 3]
    strength: NDArray[np.float64]  # [h] illuminance normal to it [lx]


@dataclass(frozen=True, slots=True)
class SunScenes:
    """The room and the outdoors that rays of the sun are traced in, and what identifies them in the cache."""

    inside: TracedScene
    outside: TracedScene
    key: tuple[object, ...]  # surfaces and window groups of both
    cache: MatrixCache | None = None

    def entry(self, label: str, *inputs: object) -> CacheEntry | None:
        """The entry of what is traced with these options."""
        return cache_entry(self.cache, label, *self.key, self.inside.centre, *inputs, by=__name__, stopping=None)


def sunlit_windows(
    scenes: SunScenes, suns: Suns, *, samples: int, places: int, seeds: Sequence[int]
) -> list[NDArray[np.float32]]:
    """Luminance outside the window patches by sunlit surfaces, for each seed [Q * K, h]; options of `window_shares`."""
    entry = scenes.entry("sun at windows", suns.direction, samples, places, tuple(seeds))
    stored = None if entry is None else entry.read(lambda data: _windows_of(data, len(seeds)))
    if stored is None:
        shares = window_shares(scenes.outside, samples=samples, places=places, seeds=seeds)
        stored = list(zip(shares, _sun_of(scenes, [one.places for one in shares], suns), strict=True))
        if all(one.rough is None for one in shares):
            write_parts(entry, [_window_arrays(*one) for one in stored])
    return [light_of_rows(*one, scenes.outside, suns.direction, suns.strength) for one in stored]


def seen_through(
    scenes: SunScenes,
    beams: Sequence[tuple[int, Scattering]],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    suns: Suns,
    *,
    samples: int,
    places: int,
    seeds: Sequence[int],
) -> list[list[NDArray[np.float32]]]:
    """Light of sensors from sunlit surfaces outdoors that they see through straight beams, for each seed [S, h].

    Args: beams: groups and their systems, a group once for each of its states; others of `view_shares`.
    """
    groups = list(dict.fromkeys(g for g, _ in beams))
    inputs = *sensors, suns.direction, samples, places, tuple(seeds)
    entries = {g: scenes.entry("sun outdoors in view", g, *inputs) for g in groups}
    views: dict[int, list[tuple[ViewShares, SunAtPoints]]] = {}
    for g, entry in entries.items():
        stored = None if entry is None else entry.read(lambda data: _views_of(data, len(seeds)))
        if stored is not None:
            views[g] = stored
    missing = [g for g in groups if g not in views]
    if missing:
        traced = view_shares(
            scenes.inside, scenes.outside, missing, sensors, samples=samples, places=places, seeds=seeds
        )
        whole = list(zip(traced, _sun_of(scenes, [one.places for one in traced], suns), strict=True))
        for i, g in enumerate(missing):
            views[g] = whole[i * len(seeds) : (i + 1) * len(seeds)]
            if all(one.rough is None for one, _ in views[g]):
                write_parts(entries[g], [_view_arrays(*one) for one in views[g]])
    return [
        [light_of_rows(view.through(way), sun, scenes.outside, suns.direction, suns.strength) for view, sun in views[g]]
        for g, way in beams
    ]


def open_beam_light(
    scenes: SunScenes, inputs: tuple[object, ...], trace: Callable[[], list[OpenBeamLight]]
) -> list[OpenBeamLight]:
    """Light of sensors by the beam through an open group that the room reflects [N], cached or as `trace` has it.

    Args: inputs: that it depends on beside the scenes.
    """
    entry = scenes.entry("beam in room", *inputs)
    return stored_or_computed(
        entry, _beams_of, trace, lambda beams: [{"hours": one.hours, "light": one.light} for one in beams]
    )


@dataclass(frozen=True, slots=True)
class OpenSun:
    """The direct sun of sensors through open windows in some batches B."""

    edges: Sequence[DiscEdges]  # discs that an edge crosses, by specular path [N]
    visible: Mapping[int, PackedArray]  # [S, J] whether sensors see the points on a group
    sunlit: Mapping[tuple[int, int], PackedArray]  # [J, Q] share of the suns there, by path and group; none: 0


def open_discs(scenes: SunScenes, inputs: tuple[object, ...], trace: Callable[[], list[SunDiscs]]) -> list[SunDiscs]:
    """The sun's disc at sensors through open windows by specular path [N], cached or as `trace` has it.

    Args: inputs: that it depends on beside the scenes.
    """
    entry = scenes.entry("sun discs", *inputs)
    return stored_or_computed(entry, _discs_of, trace, lambda found: [_disc_arrays(discs) for discs in found])


def open_sun(scenes: SunScenes, inputs: tuple[object, ...], trace: Callable[[], OpenSun]) -> OpenSun:
    """The direct sun of sensors through open windows in some batches, cached or as `trace` has it.

    Args: inputs: as of `open_discs`, and the batches.
    """
    entry = scenes.entry("sun on windows", *inputs)
    return stored_or_computed(entry, _open_sun_of, trace, lambda sun: [_open_sun_arrays(sun)])


def _sun_of(scenes: SunScenes, places: Sequence[SurfacePoints], suns: Suns) -> list[SunAtPoints]:
    return sun_at_points(scenes.outside, places, suns.direction)


def _point_arrays(places: SurfacePoints, sun: SunAtPoints) -> dict[str, NDArray[Any]]:
    return {"point": places.point, "normal": places.normal, "sun share": sun.share, "sun others": sun.others}


def _window_arrays(shares: SunShares, sun: SunAtPoints) -> Arrays:
    share, rows = shares.share, np.int64(shares.share.shape[0])
    arrays = {"data": share.data, "indices": share.indices, "indptr": share.indptr, "rows": np.asarray(rows)}
    return arrays | _point_arrays(shares.places, sun)


def _view_arrays(view: ViewShares, sun: SunAtPoints) -> Arrays:
    arrays = {"sensor": view.sensor, "place": view.place, "weight": view.weight, "way": view.way}
    return arrays | {"sensors": np.asarray(view.sensors)} | _point_arrays(view.places, sun)


def _sun_in(part: Arrays) -> tuple[SurfacePoints, SunAtPoints]:
    return SurfacePoints(part["point"], part["normal"]), SunAtPoints(part["sun share"], part["sun others"])


def _windows_of(data: Arrays, count: int) -> list[tuple[SunShares, SunAtPoints]] | None:
    found = []
    for part in parts_of(data):
        places, sun = _sun_in(part)
        shape = int(part["rows"]), places.size
        share = sparse.csr_array((part["data"], part["indices"], part["indptr"]), shape=shape)
        found.append((SunShares(places, share), sun))
    return found if len(found) == count else None


def _views_of(data: Arrays, count: int) -> list[tuple[ViewShares, SunAtPoints]] | None:
    found = []
    for part in parts_of(data):
        places, sun = _sun_in(part)
        entries = part["sensor"], part["place"], part["weight"], part["way"]
        found.append((ViewShares(places, int(part["sensors"]), *entries), sun))
    return found if len(found) == count else None


def _beams_of(data: Arrays) -> list[OpenBeamLight] | None:
    return [OpenBeamLight(part["hours"], part["light"]) for part in parts_of(data)] or None


def _disc_arrays(discs: SunDiscs) -> Arrays:
    return {"pair": discs.pair, "group": discs.group, "light": discs.light, "crossed": discs.crossed}


def _discs_of(data: Arrays) -> list[SunDiscs] | None:
    parts = parts_of(data)
    return [SunDiscs(one["pair"], one["group"], one["light"], one["crossed"]) for one in parts] or None


def _open_sun_arrays(sun: OpenSun) -> Arrays:
    """Groups and paths are numbered in the names; paths without sun have none."""
    arrays: dict[str, NDArray[Any]] = {"paths": np.array(len(sun.edges)), "groups": np.array(sorted(sun.visible))}
    for n, edges in enumerate(sun.edges):
        arrays |= PackedArray.of(edges.light).arrays(f"edges {n}")
        arrays |= PackedArray.of(edges.towards).arrays(f"edges towards {n}")
    for g, visible in sun.visible.items():
        arrays |= visible.arrays(f"visible {g}")
    for (n, g), sunlit in sun.sunlit.items():
        arrays |= sunlit.arrays(f"sunlit {n} {g}")
    return arrays


def _open_sun_of(data: Arrays) -> OpenSun | None:
    (part,) = parts_of(data)
    edges = [
        DiscEdges(*(PackedArray.of_arrays(part, f"{name} {n}").whole() for name in ("edges", "edges towards")))
        for n in range(int(part["paths"]))
    ]
    groups = [int(g) for g in part["groups"]]
    sunlit = {
        (n, g): PackedArray.of_arrays(part, f"sunlit {n} {g}")
        for n in range(len(edges))
        for g in groups
        if f"sunlit {n} {g} shape" in part
    }
    return OpenSun(edges, {g: PackedArray.of_arrays(part, f"visible {g}") for g in groups}, sunlit)
