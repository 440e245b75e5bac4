"""The matrices of the rooms of a run, traced for many rooms at a time ahead of their stages."""

from __future__ import annotations

import copy
import shutil
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bim.model import Space, seasons
from bim.to_tracer import element_surfaces, orientation_groups, outdoors_of_rooms
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, matrices_together
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import SharedOutdoors
from scenes.inputs import Inputs
from scenes.room.inputs import RoomInputs
from scenes.room.light import visible_scene
from scenes.room.room import inputs_of_room
from scenes.run.options import JobOptions

ENTRIES = 1 << 21  # of D of the rooms that are traced together: 16 MB in each of some ten arrays
TRACED = "traced"  # file that tells that a set has been


class RoomsTogether:
    """Traces the matrices of a room with those of its neighbours in the order of the rooms.

    The stages of each room find them in the cache; without one, in a folder that holds those of
    the sets of rooms at work.  Sets are the same in every process, and so are results to the last
    digit; processes that share the folder trace each set once.
    Of rooms of equal shape only the first is in a set: the others may take over its results.
    """

    def __init__(
        self, inputs: Inputs, equal: Sequence[tuple[Space, ...]], skies: AnnualSky, options: JobOptions, folder: Path
    ) -> None:
        """Of the rooms of a run.

        Args: equal: `template_rooms`; folder: for matrices while there is no cache.
        """
        self._inputs, self._skies, self._options = inputs, skies, options
        self._folder, self._set, self._shared = folder, -1, False
        self._spaces = [rooms[0] for rooms in equal if rooms[0].windows]
        patches = ReinhartSky(options.room.sampling.subdivision).size
        groups = np.cumsum([0, *(len(orientation_groups(space)) for space in self._spaces)])
        number = groups[:-1] * KLEMS_FULL.size * patches // ENTRIES
        self._set_of = {one.guid: int(i) for one, i in zip(self._spaces, number, strict=True)}

    def for_processes(self) -> RoomsTogether:
        """The same for processes that share the folder; the first room of a set goes before the others."""
        other = copy.copy(self)
        other._shared = True
        return other

    def set_of(self, guid: str) -> str:
        """The rooms that a room is traced with; its GUID if it is traced alone."""
        return str(self._set_of.get(guid, guid))

    def remove(self, number: str) -> None:
        """Remove what the folder holds of a set."""
        shutil.rmtree(self._folder / number, ignore_errors=True)

    def cache_for(self, space: Space, progress: Progress) -> MatrixCache | None:
        """The cache with the matrices of a room, which are traced now unless they have been."""
        number = self._set_of.get(space.guid)
        if number is None:
            return MatrixCache.of_user() if self._options.cache else None
        folder = self._folder / str(number)
        cache = MatrixCache.of_user() if self._options.cache else MatrixCache(folder)
        if number != self._set:
            if not self._shared:
                self.remove(str(self._set))
            self._set = number
            if not (folder / TRACED).exists():
                rooms = [one for one in self._spaces if self._set_of[one.guid] == number]
                trace_ahead(self._inputs, rooms, self._skies, self._options, cache, progress=progress)
                folder.mkdir(exist_ok=True)
                (folder / TRACED).touch()
        return cache if self._options.cache else replace(cache, stores=False)


@dataclass(frozen=True, slots=True)
class _RecordedCache(MatrixCache):
    """A cache that records the files it was asked for."""

    paths: list[Path] = field(default_factory=list, compare=False, repr=False)

    def entry(self, label: str, *inputs: object, by: str) -> CacheEntry:
        """As of `MatrixCache`."""
        entry = MatrixCache.entry(self, label, *inputs, by=by)
        self.paths.append(entry.path)
        return entry


def trace_ahead(
    inputs: Inputs,
    spaces: Sequence[Space],
    skies: AnnualSky,
    options: JobOptions,
    cache: MatrixCache,
    *,
    progress: Progress = silent,
) -> None:
    """Trace the matrices of rooms into a cache, unless all those of an earlier call are still there.

    Of these only a list is read: to read them all takes as long as a quarter of a room's stages.
    """
    rooms = _scenes(inputs, spaces, skies, options)
    some, outdoors = _traceable(inputs, spaces, rooms)
    if len(some) < 2:
        return
    scenes = [rooms[i][1] for i in some]
    sampling, five_phase = options.room.sampling, options.room.method != "three-phase"
    listed = cache.entry("rooms together", sampling, five_phase, scenes, outdoors, by=PhaseMatrices.__module__)
    if listed.read(lambda data: all((cache.folder / name).exists() for name in data["files"].tolist())):
        return
    recorded = _RecordedCache(cache.folder, cache.limit, cache.stores, cache.hashes)
    matrices_together(scenes, outdoors, sampling, five_phase=five_phase, cache=recorded, progress=progress)
    listed.write({"files": np.array(sorted({path.name for path in recorded.paths if path.exists()}))})


def traced_together(
    inputs: Inputs,
    spaces: Sequence[Space],
    skies: AnnualSky,
    options: JobOptions,
    cache: MatrixCache | None = None,
    *,
    cut: bool = True,
    progress: Progress = silent,
) -> list[tuple[RoomInputs, DaylightScene, PhaseMatrices | None]]:
    """The matrices of rooms that can be traced together; None for the others.

    Rooms without a place for sensors are left out.

    Args: cut: windows where the view outdoors differs.
    """
    rooms = _scenes(inputs, spaces, skies, options)
    some, outdoors = _traceable(inputs, spaces, rooms)
    found: dict[int, PhaseMatrices] = {}
    if len(some) > 1:
        matrices = matrices_together(
            [rooms[i][1] for i in some],
            outdoors,
            options.room.sampling,
            five_phase=options.room.method != "three-phase",
            cut=cut,
            cache=cache,
            progress=progress,
        )
        found = dict(zip(some, matrices, strict=True))
    return [(room, scene, found.get(i)) for i, (room, scene) in enumerate(rooms)]


def _scenes(
    inputs: Inputs, spaces: Sequence[Space], skies: AnnualSky, options: JobOptions
) -> list[tuple[RoomInputs, DaylightScene]]:
    """The inputs and the scene of each room that has a place for sensors."""
    rooms: list[tuple[RoomInputs, DaylightScene]] = []
    for space in spaces:
        try:
            room = inputs_of_room(
                inputs.building,
                space,
                inputs.systems,
                inputs.weather,
                options.room,
                operation=inputs.operation,
                skies=skies,
                inner=options.inner_glass,
            )
            rooms.append((room, visible_scene(room)))
        except RoomError:  # the room's stages say so
            continue
    return rooms


def _traceable(
    inputs: Inputs, spaces: Sequence[Space], rooms: Sequence[tuple[RoomInputs, DaylightScene]]
) -> tuple[list[int], SharedOutdoors]:
    """Numbers of the rooms that can be traced together, and the outdoors of these."""
    windows = Counter(window.guid for space in spaces for window in space.windows)
    first = seasons(inputs.building)[0].building
    glossy = bool(element_surfaces(element for element in first.elements if element.gloss).glossy)
    some = [
        i
        for i, (room, scene) in enumerate(rooms)
        if scene.groups
        and all(windows[window.guid] == 1 for window in room.space.windows)
        and not scene.adjacent
        and len(scene.exterior.triangles)
        and bool(scene.exterior.glossy) == glossy
    ]
    return some, outdoors_of_rooms(first, [rooms[i][0].space for i in some])
