"""The matrices of a scene for the phase methods: V, D, V_d, D_d and their kin, traced once.

They hold for all systems that may fill the windows.  `phase_matrices` traces what some metrics
need; `with_*` gives the matrices of another eye, other outdoors or another metric, and takes over
what does not change.

The matrices of a view's pixels are in the cache beside the others.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.glare.annual import PictureMatrix
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache, RecentResults
from mitsuba_cfs.methods import METRICS, UnknownMethodError
from mitsuba_cfs.methods.scene import AdjacentRoom, DaylightScene, Sampling
from mitsuba_cfs.methods.subdivision import CellLight, Parts, allowed, subdivided
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import SharedOutdoors, SurfaceGroups, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, cache_entry, joined
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.rooms import TracedRoom
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.adjacent import (
    AdjacentRoomLight,
    GlassToRoom,
    adjacent_daylight,
    outdoor_exchange,
    window_exchange,
)
from mitsuba_cfs.trace.matrices.daylight import BATCHES as CELL_BATCHES
from mitsuba_cfs.trace.matrices.daylight import cells_of_rooms, daylight_of_rooms
from mitsuba_cfs.trace.matrices.view import RoomViews, views_of_rooms
from mitsuba_cfs.trace.pictures.adjacent import RoomShown, adjacent_picture
from mitsuba_cfs.trace.pictures.annual import ViewMatrices, ViewNoise, view_matrices
from mitsuba_cfs.trace.sun.sunlit_rows import (
    SunlitRows,
    SunlitShares,
    sparse_arrays,
    sparse_matrix,
    window_sunlit_shares,
)
from mitsuba_cfs.window_parts import Cells, cut_group, even_regions, window_cells

LARGEST = 256 << 20  # [bytes] of a file; larger ones would push out all the others


def cached_view(
    cache: MatrixCache | None,
    view: View,
    inputs: tuple[object, ...],
    trace: Callable[..., ViewMatrices],
    *,
    light: PatchLight | None = None,
) -> ViewMatrices:
    """The matrices of a view from the cache; traced and stored where they are not in it.

    Their shares of the sunlit surfaces have a file of their own, which serves every light.

    Args:
        inputs: all that they depend on besides the view and the light.
        trace: called with `light` and the cached `sunlit`, None where there are none.
    """
    if cache is None:
        return trace(light=light, sunlit=None)
    entry, beside = _view_entries(cache, view, inputs, light)
    sunlit = beside.read(SunlitRows.of_arrays)
    matrices = entry.read(lambda data: _stored_view(data, view, sunlit))
    if matrices is None:
        matrices = trace(light=light, sunlit=sunlit)
        traced = matrices.sunlit
        # the file of the view is of no use without that of its sunlit surfaces
        if traced is sunlit or (traced is not None and _write(beside, traced.arrays())):
            _write(entry, _of_view(matrices))
    return matrices


def view_is_cached(cache: MatrixCache | None, view: View, inputs: tuple[object, ...]) -> bool:
    """Whether the cache has the matrices of a view; arguments as of `cached_view`."""
    if cache is None:
        return False
    return all(entry.path.is_file() for entry in _view_entries(cache, view, inputs))


def _view_entries(
    cache: MatrixCache, view: View, inputs: tuple[object, ...], light: PatchLight | None = None
) -> tuple[CacheEntry, CacheEntry]:
    """The entries of a view by its pixels, and of its sunlit surfaces."""
    of_hours = () if light is None else (light.lit, light.later)
    by = ViewMatrices.__module__
    pictures = cache.entry("view pictures", view, *inputs, *of_hours, by=by)
    return pictures, cache.entry("view sunlit", view, *inputs, by=by)


def _stored_view(data: Mapping[str, NDArray[Any]], view: View, sunlit: SunlitRows | None) -> ViewMatrices | None:
    """None where their shares of the sunlit surfaces are missing from the cache."""
    if data["sunlit"] and sunlit is None:
        return None
    row, share = data["row"], data["share"]
    indirect, lit = (PictureMatrix(data[name], row, share) for name in ("indirect", "lit"))
    noise = ViewNoise(data["indirect_noise"], data["lit_noise"])
    seen = sparse_matrix(data, "seen")
    return ViewMatrices(view, data["pixels"], indirect, lit, seen, noise, sunlit)


def _write(entry: CacheEntry, arrays: dict[str, NDArray[Any]]) -> bool:
    """Store arrays that are not too large."""
    return sum(array.nbytes for array in arrays.values()) <= LARGEST and entry.write(arrays)


def _of_view(matrices: ViewMatrices) -> dict[str, NDArray[Any]]:
    """The matrices without their shares of the sunlit surfaces."""
    return {
        "pixels": matrices.pixels,
        "indirect": matrices.indirect.rows,
        "lit": matrices.lit.rows,
        "indirect_noise": matrices.noise.indirect,
        "lit_noise": matrices.noise.lit,
        "row": matrices.lit.row,
        "share": matrices.lit.share,
        "sunlit": np.array(matrices.sunlit is not None),
        **sparse_arrays("seen", matrices.seen),
    }


BATCHES = 8  # independent repetitions that the standard errors come from
INDOOR_DEPTH, OUTDOOR_DEPTH = 32, 16  # segments of a path
CELL_SHARE = 0.06  # paths of the cells that a group's parts follow from, of those of its D
EXCHANGE_SHARE = 64  # paths of a patch for D, for each that looks into the room, in each batch
OUTDOOR_SHARE = 4  # ... that looks outdoors: few meet a mirrored sun, and they are short
PART_BATCHES = 2  # of D where groups are cut
INNER_PART = 0.75  # of glass between rooms, about: in the adjacent room D changes along it [m]
FEW = 4  # times as many patches as pictures, from which on the view is traced for these alone
INNER_SHARE = 8  # paths of a patch for D, for each of a part of glass between rooms
DEFAULT_NEEDS = ("illuminance",)


@dataclass(frozen=True)
class PhaseMatrices:
    """Matrices of a scene's window parts Q; `None` where they have not been traced.

    `sensors` is V [S, Q, K], `daylight` D [Q, K, P], `direct_sensors` V_d and `direct_daylight` D_d; `view` is V of
    the pixels of a view.  K are the patches of the full Klems basis, P those of the sky, S the scene's sensors and,
    last, the view's eye.  An open site has one part for each window group.
    """

    scene: DaylightScene
    sampling: Sampling
    five_phase: bool
    cache: MatrixCache | None  # of traced matrices
    parts: Parts  # window groups, cut where the view outdoors differs within a group
    adjacent: tuple[AdjacentRoomLight, ...]  # rooms behind the last window groups, with their T D
    daylight: Estimate  # D [Q, K, P]
    direct_daylight: NDArray[np.float64] | None = None  # D_d [Q, K, P], mirrored sky included
    straight_daylight: NDArray[np.float64] | None = None  # D_d without what mirrors show
    sensors: Estimate | None = None  # V [S, Q, K]
    direct_sensors: NDArray[np.float64] | None = None  # V_d [S, Q, K]
    # [N][S, Q, K] derivative of V by ln(rho) of each of the scene's groups of surfaces
    sensors_by_reflectance: tuple[Estimate, ...] = ()
    exchange: Estimate | None = None  # W [Q, K, Q * K] from window to window by the room
    outdoor_exchange: Estimate | None = None  # X [q, K, q * K] by the outdoors
    view: ViewMatrices | None = None  # V of the view's pixels
    direct_view: ViewMatrices | None = None  # V_d of the view's pixels
    sunlit: SunlitShares | None = None  # sunlit surfaces of the room that the windows see [Q * K]
    adjacent_shown: tuple[RoomShown, ...] | None = None  # adjacent rooms in the view's pixels
    scenes: SceneCache = field(default_factory=SceneCache, compare=False, repr=False)
    recent: RecentResults = field(default_factory=RecentResults, compare=False, repr=False)

    @property
    def outdoor_parts(self) -> int:
        """How many of the parts, the first ones, look outdoors."""
        return self.parts.outdoors(self.scene)

    def behind(self) -> tuple[GlassToRoom, ...]:
        """Which parts look into which adjacent room."""
        return _rooms_behind(self.scene, self.parts, self.adjacent)


def phase_matrices(
    scene: DaylightScene,
    sampling: Sampling | None = None,
    *,
    five_phase: bool = True,
    needs: Collection[str] = DEFAULT_NEEDS,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
    progress: Progress = silent,
) -> PhaseMatrices:
    """Trace the matrices of a scene that some metrics need.

    Args:
        five_phase: False for the three-phase method, which needs no D_d and V_d.
        needs: metrics (`METRICS`); none for D alone.  What is missing later is traced for each
            call: name here, or in `with_needs`, what several calls share.
        cache: of traced matrices, `MatrixCache.of_user()`.
        scenes: of traced scenes, to share with the matrices of other rooms.
    """
    unknown = set(needs) - set(METRICS)
    if unknown:
        raise UnknownMethodError(f"needs {sorted(unknown)}: expected some of {', '.join(METRICS)}")
    sampling = sampling or Sampling()
    scenes = SceneCache() if scenes is None else scenes
    parts = _parts(scene, sampling, cache, scenes)
    matrices = _outdoors(scene, sampling, parts, five_phase=five_phase, cache=cache, scenes=scenes, progress=progress)
    return with_needs(matrices, needs, progress=progress)


def matrices_together(
    scenes: Sequence[DaylightScene],
    outdoors: SharedOutdoors,
    sampling: Sampling,
    *,
    five_phase: bool = True,
    cut: bool = True,
    cache: MatrixCache | None = None,
    progress: Progress = silent,
) -> list[PhaseMatrices]:
    """`phase_matrices` of rooms of one building, for their sensors, traced together.

    With a cache those of a room alone are found there later.

    Args:
        scenes: of rooms with windows outdoors alone, and something in front of them.
        outdoors: of all; the windows of a room are those of the scene of that number.
        cut: windows where the view outdoors differs; False: D's means have no stated error.
    """
    shared = SceneCache()
    shared.know_fronts(outdoors, [scene.exterior for scene in scenes])
    parts = [Parts.whole(scene.groups) for scene in scenes]
    if cut:
        parts = _parts_together(scenes, outdoors, sampling, cache, shared)
    progress("daylight of several rooms", 0.2)
    passes = [(OUTDOOR_DEPTH, False), *([(1, False)] if five_phase else [])]
    if five_phase and outdoors.surfaces.glossy:
        passes.append((1, True))
    fronts = [
        TracedRoom(one.exterior, of.groups, number=i) for i, (one, of) in enumerate(zip(scenes, parts, strict=True))
    ]
    paths = [
        _daylight_paths(sampling, len(one.groups), len(of.groups), OUTDOOR_DEPTH, cache, shared)
        for one, of in zip(scenes, parts, strict=True)
    ]
    whole, *direct = (
        _daylight_together(
            fronts,
            outdoors,
            [replace(of, max_depth=depth) for of in paths],
            plain=plain,
            subdivision=sampling.subdivision,
        )
        for depth, plain in passes
    )
    progress("daylight of several rooms", 0.5)
    matrices = []
    for i, (one, of) in enumerate(zip(scenes, parts, strict=True)):
        beams = [part[i].values for part in direct]
        matrices.append(
            PhaseMatrices(
                one,
                sampling,
                five_phase,
                cache,
                of,
                (),
                whole[i],
                direct_daylight=beams[0] if beams else None,
                straight_daylight=beams[-1] if beams else None,
                scenes=shared,
            )
        )
    rooms = [_sensor_room(one) for one in matrices]
    sharp = [any(has_sharp_beam(one, g) for g in range(len(one.scene.groups))) for one in matrices]
    by_groups = [one.scene.by_groups for one in matrices if one.scene.by_groups is not None]
    paths_indoors = _view_paths(sampling, INDOOR_DEPTH, cache, shared)
    views = views_of_rooms(rooms, paths_indoors, with_direct=any(sharp), by_groups=by_groups)
    progress("daylight of several rooms", 1.0)
    return [_with_views(one, of_room) for one, of_room in zip(matrices, views, strict=True)]


def _parts_together(
    scenes: Sequence[DaylightScene],
    outdoors: SharedOutdoors | None,
    sampling: Sampling,
    cache: MatrixCache | None,
    traced: SceneCache,
) -> list[Parts]:
    """The window groups of each room, cut where the view outdoors differs within a group."""
    cells = [[window_cells(group) for group in one.outdoor_groups] for one in scenes]
    daylight = cells_of_rooms(
        [TracedRoom(one.exterior, one.outdoor_groups, number=i) for i, one in enumerate(scenes)],
        outdoors,
        cells,
        [
            PathOptions(_cell_samples(sampling, of), OUTDOOR_DEPTH, None, sampling.seed, silent, cache, traced)
            for of in cells
        ],
    )
    return [
        _parts_of_cells(one.outdoor_groups, of, light, sampling)
        for one, of, light in zip(scenes, cells, daylight, strict=True)
    ]


def _daylight_together(
    rooms: Sequence[TracedRoom],
    outdoors: SharedOutdoors,
    paths: Sequence[PathOptions],
    *,
    plain: bool,
    subdivision: int,
) -> list[Estimate]:
    """D of each room; those with as many paths are traced together.

    Args: plain: without the gloss of what is outdoors.
    """
    if plain:
        rooms = [replace(one, surfaces=replace(one.surfaces, gloss=())) for one in rooms]
        outdoors = replace(outdoors, surfaces=replace(outdoors.surfaces, gloss=()))
    alike: dict[object, list[int]] = {}
    for i, of in enumerate(paths):
        alike.setdefault((of.samples, of.stopping), []).append(i)
    estimates: dict[int, Estimate] = {}
    for some in alike.values():
        traced = daylight_of_rooms([rooms[i] for i in some], outdoors, paths[some[0]], subdivision=subdivision)
        estimates |= dict(zip(some, traced, strict=True))
    return [estimates[i] for i in range(len(rooms))]


def with_needs(matrices: PhaseMatrices, needs: Iterable[str], *, progress: Progress = silent) -> PhaseMatrices:
    """The matrices with those that some metrics need besides."""
    for metric in needs:
        if metric != "DGP":
            matrices = with_sensors(matrices, progress=progress)
        if metric in ("DGP", "eDGP"):
            matrices = with_view_matrices(matrices, direct=metric == "eDGP", progress=progress)
    return matrices


def with_eye(matrices: PhaseMatrices, view: View) -> PhaseMatrices:
    """The matrices of the same room for another eye; nothing is traced."""
    return replace(
        matrices,
        scene=replace(matrices.scene, view=view),
        sensors=None,
        direct_sensors=None,
        view=None,
        direct_view=None,
        adjacent_shown=None,
    )


def with_outdoors(matrices: PhaseMatrices, scene: DaylightScene, *, progress: Progress = silent) -> PhaseMatrices:
    """The matrices of the same room with other outdoors, its windows cut into the same parts.

    Args: scene: equal to that of the matrices but for the exterior and the adjacent rooms.
    """
    outdoors = _outdoors(
        scene,
        matrices.sampling,
        matrices.parts,
        five_phase=matrices.five_phase,
        cache=matrices.cache,
        scenes=matrices.scenes,
        progress=progress,
    )
    indoors = {
        name: getattr(matrices, name)
        for name in ("sensors", "direct_sensors", "exchange", "view", "direct_view", "sunlit")
    }
    return replace(outdoors, **indoors)


def with_direct_daylight(matrices: PhaseMatrices, *, progress: Progress = silent) -> PhaseMatrices:
    """The matrices with D_d, which the three-phase method needs for eDGP alone."""
    if matrices.direct_daylight is not None:
        return matrices
    exterior = matrices.scene.exterior
    direct = _direct_daylight(matrices, exterior, progress)
    straight = direct
    if exterior.glossy:
        straight = _direct_daylight(matrices, replace(exterior, gloss=()), progress)
    return replace(matrices, direct_daylight=direct, straight_daylight=straight)


def as_five_phase(matrices: PhaseMatrices) -> PhaseMatrices:
    """Those of the three-phase method with D_d and V_d, as the five-phase method takes them."""
    matrices = with_direct_daylight(replace(matrices, five_phase=True))
    if matrices.sensors is None or matrices.direct_sensors is not None:
        return matrices
    (direct,) = views_of_rooms([_sensor_room(matrices)], _paths_indoors(matrices, depth=1))
    return replace(matrices, direct_sensors=direct.whole.values)


def _sensor_room(matrices: PhaseMatrices) -> TracedRoom:
    """The scene's room with its sensors."""
    return TracedRoom(matrices.scene.interior, matrices.parts.groups, *sensors_of(*matrices.scene.sensors()))


def has_sharp_beam(matrices: PhaseMatrices, g: int) -> bool:
    """Whether what passes a window group straight on is traced apart from V T D."""
    scene = matrices.scene
    if matrices.five_phase or g >= len(scene.outdoor_groups) or scene.exterior.glossy:
        return True
    return len(matrices.parts.of(g)) > 1


def with_sensors(matrices: PhaseMatrices, *, progress: Progress = silent) -> PhaseMatrices:
    """The matrices with V of the scene's sensors, and V_d where the straight beam is apart.

    V_d of other reflectances is that of these: where it is known, it is not traced again.
    """
    if matrices.sensors is not None:
        return matrices
    known = matrices.direct_sensors
    (views,) = views_of_rooms(
        [_sensor_room(matrices)],
        _paths_indoors(matrices, progress=part(progress, 0.3, 1.0, "daylight")),
        by_groups=() if matrices.scene.by_groups is None else (matrices.scene.by_groups,),
        with_direct=known is None and any(has_sharp_beam(matrices, g) for g in range(len(matrices.scene.groups))),
        direct=known,
    )
    whole = _with_views(matrices, views)
    return whole if known is None else replace(whole, direct_sensors=known)


def _with_views(matrices: PhaseMatrices, views: RoomViews) -> PhaseMatrices:
    return replace(
        matrices,
        sensors=views.whole,
        direct_sensors=None if views.direct is None else views.direct.values,
        sensors_by_reflectance=views.by_reflectance,
    )


def _paths_indoors(matrices: PhaseMatrices, depth: int = INDOOR_DEPTH, progress: Progress = silent) -> PathOptions:
    return replace(_view_paths(matrices.sampling, depth, matrices.cache, matrices.scenes), progress=progress)


def _exchange_paths(matrices: PhaseMatrices, parts: Sequence[WindowGroup], share: int, depth: int) -> PathOptions:
    """Paths of each patch between windows: fewer the more windows there are."""
    samples = max(matrices.sampling.patch_samples // share // len(parts), 8)
    seed = matrices.sampling.seed
    return PathOptions(samples, depth, Stopping(batches=2), seed, silent, matrices.cache, matrices.scenes)


def _window_exchange(matrices: PhaseMatrices, by_groups: SurfaceGroups | None = None) -> Estimate:
    parts = matrices.parts.groups
    paths = _exchange_paths(matrices, parts, EXCHANGE_SHARE, INDOOR_DEPTH)
    return window_exchange(matrices.scene.interior, parts, paths, by_groups=by_groups)


def exchange_by_reflectance(matrices: PhaseMatrices) -> NDArray[np.float64]:
    """Derivative of W by ln(rho) of each of the scene's groups of surfaces [N, Q, K, Q * K]."""
    groups = matrices.scene.by_groups
    if groups is None:
        raise ValueError("the scene names no groups of surfaces: DaylightScene(..., by_groups=...)")
    both = _window_exchange(matrices, groups).values
    layers = both.reshape(*both.shape[:2], 1 + len(groups.names), -1)
    return np.moveaxis(layers, 2, 0)[1:]


def with_exchange(matrices: PhaseMatrices, *, indoors: bool = False, outdoors: bool = False) -> PhaseMatrices:
    """The matrices with W (indoors) and X (outdoors), for windows that reflect."""
    if indoors and matrices.exchange is None:
        matrices = replace(matrices, exchange=_window_exchange(matrices))
    if outdoors and matrices.outdoor_exchange is None:
        parts = matrices.parts.groups[: matrices.outdoor_parts]
        paths = _exchange_paths(matrices, parts, OUTDOOR_SHARE, OUTDOOR_DEPTH)
        matrices = replace(matrices, outdoor_exchange=outdoor_exchange(matrices.scene.exterior, parts, paths))
    return matrices


def with_view_matrices(matrices: PhaseMatrices, *, direct: bool = False, progress: Progress = silent) -> PhaseMatrices:
    """The matrices with V of the view's pixels, or V_d if `direct`, as eDGP takes it."""
    if direct:
        matrices = with_direct_daylight(matrices, progress=progress)
        if matrices.direct_view is None:
            matrices = replace(matrices, direct_view=_view(matrices, 1, progress=progress))
        return matrices
    if matrices.view is None:
        matrices = replace(matrices, view=_view(matrices, INDOOR_DEPTH, progress=progress))
    return with_adjacent_shown(matrices)


def with_adjacent_shown(matrices: PhaseMatrices) -> PhaseMatrices:
    """The matrices with the adjacent rooms that the view's pixels show through glass."""
    if not matrices.scene.adjacent or matrices.adjacent_shown is not None:
        return matrices
    scene, chosen = matrices.scene, matrices.sampling
    shown = adjacent_picture(
        scene.interior,
        matrices.parts.groups,
        matrices.behind(),
        scene.eye,
        subdivision=chosen.subdivision,
        samples=chosen.outdoor_samples,
        max_depth=INDOOR_DEPTH,
        seed=chosen.seed,
        scenes=matrices.scenes,
    )
    return replace(matrices, adjacent_shown=tuple(shown))


def with_sunlit(matrices: PhaseMatrices) -> PhaseMatrices:
    """The matrices with the sunlit surfaces of the room that reflecting windows see."""
    if matrices.sunlit is not None:
        return matrices
    interior, parts, seed = matrices.scene.interior, matrices.parts.groups, matrices.sampling.seed
    samples = _exchange_paths(matrices, parts, EXCHANGE_SHARE, INDOOR_DEPTH).samples
    entry = cache_entry(
        matrices.cache, "windows sunlit", interior, parts, samples, seed, by=SunlitShares.__module__, stopping=None
    )
    sunlit = None if entry is None else entry.read(SunlitShares.of_arrays)
    if sunlit is None:
        sunlit = [window_sunlit_shares(matrices.scenes.scene(interior, parts), samples=samples, seed=seed)]
        if entry is not None:
            _write(entry, sunlit[0].arrays())
    return replace(matrices, sunlit=sunlit[0])


def few_pictures(matrices: PhaseMatrices, pictures: int) -> bool:
    """Whether to trace the view for so many pictures alone, not for all patches of the windows.

    Not where V of all patches has been traced, nor with glass to other rooms or with gloss
    indoors, which need V of each patch.
    """
    scene, patches = matrices.scene, len(matrices.parts.groups) * KLEMS_FULL.size
    possible = matrices.five_phase and not scene.adjacent and not scene.interior.glossy
    if not possible or pictures * FEW > patches or matrices.view is not None or scene.view is None:
        return False
    return not view_is_cached(matrices.cache, scene.view, _view_inputs(matrices, INDOOR_DEPTH))


def view_of_light(matrices: PhaseMatrices, light: PatchLight) -> ViewMatrices:
    """V of the view's pixels times the windows' luminance in some hours, which are its columns."""
    return _view(matrices, INDOOR_DEPTH, light)


def adjacent_room(matrices: PhaseMatrices, room: AdjacentRoom) -> AdjacentRoomLight:
    """The room of the matrices as an adjacent room sees it."""
    daylight, of_group = matrices.daylight.values, matrices.parts.group
    pairs = zip(of_group, daylight, strict=True)
    through = np.stack([room.transmission[n] @ d for n, d in pairs])
    beam = np.zeros((len(of_group), KLEMS_FULL.size))
    for q, n in enumerate(of_group[: matrices.outdoor_parts]):
        beam[q] = room.straight[n]
    scene = matrices.scene
    return AdjacentRoomLight(
        scene.interior, matrices.parts.groups, through, scene.exterior, beam, daylight, matrices.behind()
    )


def _parts(scene: DaylightScene, sampling: Sampling, cache: MatrixCache | None, scenes: SceneCache) -> Parts:
    """The window groups, cut where the view outdoors differs within a group."""
    outdoors = _parts_of_outdoor_groups(scene, sampling, cache, scenes)
    if not scene.adjacent:
        return outdoors
    inner = scene.groups[-len(scene.adjacent) :]
    return outdoors.and_inner(cut_group(g, even_regions(g, INNER_PART)) for g in inner)


def _parts_of_outdoor_groups(
    scene: DaylightScene, sampling: Sampling, cache: MatrixCache | None, scenes: SceneCache
) -> Parts:
    if not len(scene.exterior.triangles) or not scene.outdoor_groups:
        return Parts.whole(scene.outdoor_groups)
    return _parts_together([scene], None, sampling, cache, scenes)[0]


def _cell_samples(sampling: Sampling, cells: Sequence[Cells]) -> int:
    """Paths of each patch of a cell in each batch, for the cells of each group."""
    paths = CELL_SHARE * sampling.patch_samples * len(cells) / sum(len(c.area) for c in cells)
    return max(round(paths / CELL_BATCHES), 1)


def _parts_of_cells(
    groups: Sequence[WindowGroup], cells: Sequence[Cells], daylight: Sequence[NDArray[np.float32]], sampling: Sampling
) -> Parts:
    """The parts of groups by the light of their cells."""
    lights = map(CellLight, groups, cells, daylight)
    most, limit = sampling.window_parts or None, allowed(sampling.patch_samples)
    return Parts.of_cells(subdivided(light, most, limit=limit) for light in lights)


def _outdoors(
    scene: DaylightScene,
    sampling: Sampling,
    parts: Parts,
    *,
    five_phase: bool,
    cache: MatrixCache | None,
    scenes: SceneCache,
    progress: Progress,
) -> PhaseMatrices:
    """The matrices of what is on the outer side of the windows: D, and D_d for five phases."""
    adjacent = _adjacent_rooms(scene, sampling, cache, scenes)
    estimates = []
    if scene.outdoor_groups:
        estimates.append(
            _daylight(
                scene, sampling, parts, OUTDOOR_DEPTH, part(progress, 0.0, 0.2, "daylight"), cache=cache, scenes=scenes
            )
        )
    estimates += _inner_daylight(scene, sampling, parts, adjacent, cache, scenes)
    daylight = joined(estimates) if estimates else _no_daylight(sampling)
    matrices = PhaseMatrices(scene, sampling, five_phase, cache, parts, adjacent, daylight, scenes=scenes)
    return with_direct_daylight(matrices, progress=progress) if five_phase else matrices


def _no_daylight(sampling: Sampling) -> Estimate:
    """D of a room without windows."""
    size = ReinhartSky(sampling.subdivision).size
    values = np.zeros((0, KLEMS_FULL.size, size))
    return Estimate(values, values, values[..., :1, None], BATCHES, 0.0)


def _daylight(
    scene: DaylightScene,
    sampling: Sampling,
    parts: Parts,
    depth: int,
    progress: Progress,
    *,
    cache: MatrixCache | None,
    scenes: SceneCache,
) -> Estimate:
    """D [q, K, P] of the parts that look outdoors."""
    outer = parts.groups[: parts.outdoors(scene)]
    paths = _daylight_paths(sampling, len(scene.outdoor_groups), len(outer), depth, cache, scenes)
    paths, room = replace(paths, progress=progress), TracedRoom(scene.exterior, outer)
    return daylight_of_rooms([room], None, paths, subdivision=sampling.subdivision)[0]


def _daylight_paths(
    sampling: Sampling, groups: int, parts: int, depth: int, cache: MatrixCache | None, scenes: SceneCache
) -> PathOptions:
    """Those of D for so many window groups in parts."""
    samples, batches = sampling.patch_samples, BATCHES
    if parts > groups:  # at about the cost of the whole groups
        samples, batches = samples * groups // parts, PART_BATCHES
    stopping = Stopping(batches=batches)
    return PathOptions(max(samples // batches, 1), depth, stopping, sampling.seed, silent, cache, scenes)


def _direct_daylight(matrices: PhaseMatrices, exterior: Surfaces, progress: Progress) -> NDArray[np.float64]:
    """D_d [Q, K, P] past an exterior; 0 of parts that look into another room.

    The sun comes through these by patches.
    """
    scene, daylight = matrices.scene, matrices.daylight.values
    if not scene.adjacent and not len(exterior.triangles):  # nothing outdoors reflects
        return daylight
    direct, outer = np.zeros_like(daylight), matrices.outdoor_parts
    if not len(exterior.triangles):
        direct[:outer] = daylight[:outer]
    elif outer:
        direct[:outer] = _daylight(
            replace(scene, exterior=exterior),
            matrices.sampling,
            matrices.parts,
            1,
            part(progress, 0.2, 0.3, "daylight"),
            cache=matrices.cache,
            scenes=matrices.scenes,
        ).values
    return direct


def _adjacent_rooms(
    scene: DaylightScene, sampling: Sampling, cache: MatrixCache | None, scenes: SceneCache
) -> tuple[AdjacentRoomLight, ...]:
    """The room behind each group that looks into one, with T D of its windows' parts."""
    rooms: dict[int, AdjacentRoomLight] = {}
    for room in scene.adjacent:
        if id(room.scene) not in rooms:
            matrices = phase_matrices(room.scene, sampling, five_phase=False, needs=(), cache=cache, scenes=scenes)
            rooms[id(room.scene)] = adjacent_room(matrices, room)
    return tuple(rooms[id(room.scene)] for room in scene.adjacent)


def _rooms_behind(scene: DaylightScene, parts: Parts, adjacent: Sequence[AdjacentRoomLight]) -> tuple[GlassToRoom, ...]:
    inner = range(len(scene.outdoor_groups), len(scene.groups))
    return tuple(
        GlassToRoom(int(parts.of(g)[0]), len(parts.of(g)), room.beam, lit)
        for g, room, lit in zip(inner, scene.adjacent, adjacent, strict=True)
    )


def _inner_daylight(
    scene: DaylightScene,
    sampling: Sampling,
    parts: Parts,
    adjacent: Sequence[AdjacentRoomLight],
    cache: MatrixCache | None,
    scenes: SceneCache,
) -> list[Estimate]:
    """D [q, K, P] of the parts of each group that looks into another room."""
    samples = max(sampling.patch_samples // INNER_SHARE // BATCHES, 1)
    paths = PathOptions(samples, INDOOR_DEPTH, Stopping(batches=BATCHES), sampling.seed, silent, cache, scenes)
    return [
        adjacent_daylight(room.surfaces, room.groups, room.luminance, [parts.groups[q] for q in parts.of(g)], paths)
        for g, room in enumerate(adjacent, len(scene.outdoor_groups))
    ]


def _view_paths(sampling: Sampling, depth: int, cache: MatrixCache | None, scenes: SceneCache) -> PathOptions:
    """Those of V of sensors."""
    samples, stopping = max(sampling.sensor_samples // BATCHES, 1), Stopping(batches=BATCHES)
    return PathOptions(samples, depth, stopping, sampling.seed, silent, cache, scenes)


def _view_inputs(matrices: PhaseMatrices, depth: int) -> tuple[object, ...]:
    """All that the matrices of the view's pixels depend on."""
    chosen = matrices.sampling
    inputs = matrices.scene.interior, matrices.parts.groups, chosen.view_samples, chosen.seed, depth
    return variants.activate(), *inputs


def _view(
    matrices: PhaseMatrices, depth: int, light: PatchLight | None = None, *, progress: Progress = silent
) -> ViewMatrices:
    scene, chosen = matrices.scene, matrices.sampling
    trace = partial(
        view_matrices,
        scene.interior,
        matrices.parts.groups,
        scene.eye,
        samples=chosen.view_samples,
        seed=chosen.seed,
        memory=chosen.memory,
        scenes=matrices.scenes,
        max_depth=depth,
        progress=part(progress, 0.0, 1.0, "view matrices"),
    )
    inputs = _view_inputs(matrices, depth)
    return cached_view(matrices.cache, scene.eye, inputs, trace, light=light)
