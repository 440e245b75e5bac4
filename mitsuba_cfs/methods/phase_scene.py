"""What the phase methods trace of a scene, once for all that may fill its windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.klems_peak import matrix_beam
from mitsuba_cfs.glare.annual import Pictures
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.borrowed_pictures import BorrowedPictures
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.methods.subdivision import CellLight, Parts, allowed, subdivided
from mitsuba_cfs.methods.view_cache import holds_view, kept_view
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, joined
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.adjacent import (
    LendingRoom,
    RoomBehind,
    borrowed_daylight,
    borrowed_view,
)
from mitsuba_cfs.trace.matrices.cell_daylight import BATCHES as CELL_BATCHES
from mitsuba_cfs.trace.matrices.cell_daylight import cell_daylight
from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
from mitsuba_cfs.trace.matrices.exchange import outdoor_exchange, window_exchange
from mitsuba_cfs.trace.matrices.view import view_matrix
from mitsuba_cfs.trace.pictures.adjacent import RoomShown, borrowed_picture
from mitsuba_cfs.trace.pictures.annual import ViewMatrices, view_matrices
from mitsuba_cfs.trace.sun.room_sun import SunElements, window_elements
from mitsuba_cfs.window_parts import cut_group, even_regions, window_cells

BATCHES = 8  # independent repetitions that the standard errors come from
INDOOR_DEPTH, OUTDOOR_DEPTH = 32, 16  # segments of a path
CELL_SHARE = 0.06  # paths of the cells that a group's parts follow from, of those of its D
EXCHANGE_SHARE = 64  # paths of a patch for D, for each that looks into the room, in each batch
OUTDOOR_SHARE = 4  # ... that looks outdoors: few meet a mirrored sun, and they are short
PART_BATCHES = 2  # of D where groups are cut
INNER_PART = 0.75  # of glass between rooms, about: in the room beyond D changes along it [m]
FEW = 4  # times as many patches as pictures, from which on the view is traced for these alone
INNER_SHARE = 8  # paths of a patch for D, for each of a part of glass between rooms


class PhaseScene:
    """The matrices of a scene, each traced when it is first asked for, or found in the cache.

    They are those of the parts Q of the window groups; an open site has one part for each group.
    """

    def __init__(
        self,
        scene: DaylightScene,
        sampling: Sampling | None = None,
        *,
        five_phase: bool = True,
        cache: MatrixCache | None = None,
        scenes: SceneCache | None = None,
        progress: Progress = silent,
    ) -> None:
        """Of a scene; nothing is traced yet.

        Args: cache: where matrices are kept and found again, `MatrixCache.of_user()`.
        """
        self.scene, self.sampling = scene, sampling or Sampling()
        self.five_phase, self.cache, self.progress = five_phase, cache, progress
        self.scenes = SceneCache() if scenes is None else scenes

    def seen_from(self, view: View, progress: Progress | None = None) -> PhaseScene:
        """The same room seen from another eye: what is outdoors is not traced again."""
        other = PhaseScene(
            replace(self.scene, view=view),
            self.sampling,
            five_phase=self.five_phase,
            cache=self.cache,
            scenes=self.scenes,
            progress=self.progress if progress is None else progress,
        )
        outdoors = (
            "daylight", "direct_daylight", "straight_daylight", "outdoor_exchange", "beyond",
        )  # fmt: skip
        for name in ("parts", *outdoors):
            if name in self.__dict__:
                other.__dict__[name] = self.__dict__[name]
        return other

    def before(self, scene: DaylightScene) -> PhaseScene:
        """The same room before other outdoors, its windows cut in the same parts.

        So that what is indoors is found in the cache.
        """
        other = PhaseScene(
            scene, self.sampling, five_phase=self.five_phase, cache=self.cache, scenes=self.scenes,
            progress=self.progress,
        )  # fmt: skip
        other.__dict__["parts"] = self.parts
        return other

    def trace(self, metric: str) -> None:
        """Trace now what a metric needs (`mitsuba_cfs.methods.METRICS`)."""
        wanted = ["daylight"]
        if self.five_phase or metric == "eDGP":
            wanted.append("direct_daylight")
        if metric != "DGP":
            wanted += ["sensors", "direct_sensors"] if self.five_phase else ["sensors"]
        wanted += {"DGP": ["view", "geometry"], "eDGP": ["direct_view", "geometry"]}.get(metric, [])
        for name in wanted:
            getattr(self, name)

    @cached_property
    def parts(self) -> Parts:
        """The window groups, cut where what stands outdoors is not the same before all of them."""
        found = self._outdoor_parts(self.scene.outdoor_groups)
        if not self.scene.beyond:
            return found
        inner = self.scene.groups[-len(self.scene.beyond) :]
        return found.and_inner(cut_group(g, even_regions(g, INNER_PART)) for g in inner)

    def _outdoor_parts(self, groups: Sequence[WindowGroup]) -> Parts:
        """Those of the groups that look outdoors."""
        scene, chosen = self.scene, self.sampling
        if not len(scene.exterior.triangles) or not groups:
            return Parts.whole(groups)
        cells = [window_cells(group) for group in groups]
        paths = CELL_SHARE * chosen.patch_samples * len(cells) / sum(len(c.area) for c in cells)
        found = cell_daylight(
            scene.exterior,
            groups,
            cells,
            samples=max(round(paths / CELL_BATCHES), 1),
            max_depth=OUTDOOR_DEPTH,
            seed=chosen.seed,
            cache=self.cache,
            scenes=self.scenes,
        )
        lights = map(CellLight, groups, cells, found)
        most, limit = chosen.window_parts or None, allowed(chosen.patch_samples)
        return Parts.of_cells(subdivided(light, most, limit=limit) for light in lights)

    @cached_property
    def daylight(self) -> Estimate:
        """D [Q, K, P]."""
        found = [self._daylight(OUTDOOR_DEPTH, 0.0, 0.2)] if self.scene.outdoor_groups else []
        return joined([*found, *self._borrowed()])

    @cached_property
    def direct_daylight(self) -> NDArray[np.float64]:
        """D_d [Q, K, P]: what comes straight from the sky, or by a smooth mirror; a part of D.

        Nothing of groups that look into another room: the sun comes through these by patches.
        """
        return self._with_no_inner(self.scene.exterior)

    @cached_property
    def straight_daylight(self) -> NDArray[np.float64]:
        """D_d without what mirrors show."""
        if not self.scene.exterior.glossy:
            return self.direct_daylight
        return self._with_no_inner(replace(self.scene.exterior, gloss=()))

    @cached_property
    def sensors(self) -> Estimate:
        """V [S, Q, K] of the scene's sensors."""
        return self._sensors(INDOOR_DEPTH, 0.3, 0.9)

    @cached_property
    def direct_sensors(self) -> NDArray[np.float64]:
        """V_d [S, Q, K]: what comes straight from the windows; a part of V."""
        return self._sensors(1, 0.9, 1.0).values

    @cached_property
    def exchange(self) -> Estimate:
        """W [Q, K, Q * K]: what the windows see of the room that they light."""
        parts = self.parts.groups
        return window_exchange(
            self.scene.interior,
            parts,
            samples=self._exchange_samples(parts, EXCHANGE_SHARE),
            max_depth=INDOOR_DEPTH,
            stopping=Stopping(batches=2),
            seed=self.sampling.seed,
            cache=self.cache,
            scenes=self.scenes,
        )

    @cached_property
    def sun_exchange(self) -> SunElements:
        """What the windows [Q * K] see of the sun's beam on surfaces of the room."""
        interior, parts = self.scene.interior, self.parts.groups
        return window_elements(
            self.scenes.scene(interior, parts),
            interior,
            samples=self._exchange_samples(parts, EXCHANGE_SHARE),
            seed=self.sampling.seed,
        )

    @cached_property
    def outdoor_exchange(self) -> Estimate:
        """X [Q, K, Q * K]: what the windows that look outdoors see of what they light there."""
        parts = self.parts.groups[: self.parts.outdoors(self.scene)]
        return outdoor_exchange(
            self.scene.exterior,
            parts,
            samples=self._exchange_samples(parts, OUTDOOR_SHARE),
            max_depth=OUTDOOR_DEPTH,
            stopping=Stopping(batches=2),
            seed=self.sampling.seed,
            cache=self.cache,
            scenes=self.scenes,
        )

    def _exchange_samples(self, parts: Sequence[WindowGroup], share: int) -> int:
        """Paths of each patch between windows: fewer the more windows there are."""
        return max(self.sampling.patch_samples // share // len(parts), 8)

    @cached_property
    def view(self) -> ViewMatrices:
        """V of the view's pixels."""
        return self._view(INDOOR_DEPTH)

    @cached_property
    def direct_view(self) -> ViewMatrices:
        """V of the view's pixels without what the room reflects more than once."""
        return self._view(1)

    def few(self, pictures: int) -> bool:
        """Whether to trace the view for so many pictures alone: V of all patches is not at hand.

        Not behind glass to other rooms or with gloss indoors, which are held patch by patch.
        """
        scene, patches = self.scene, len(self.parts.groups) * KLEMS_FULL.size
        apart = self.five_phase and not scene.beyond and not scene.interior.glossy
        if not apart or pictures * FEW > patches or "view" in self.__dict__ or scene.view is None:
            return False
        return not holds_view(self.cache, scene.view, self._view_inputs(INDOOR_DEPTH))

    def view_of(self, light: PatchLight) -> ViewMatrices:
        """V of the view's pixels times the windows' luminance in some hours, their columns."""
        return self._view(INDOOR_DEPTH, light)

    @cached_property
    def geometry(self) -> GlareView:
        """What glare needs of the view."""
        return GlareView(self.scene.view)

    @cached_property
    def beyond(self) -> list[LendingRoom]:
        """The room beyond each group that looks into one, with T D of its windows' parts."""
        rooms: dict[int, LendingRoom] = {}
        for beyond in self.scene.beyond:
            if id(beyond.scene) not in rooms:
                room = PhaseScene(
                    beyond.scene,
                    self.sampling,
                    five_phase=False,
                    cache=self.cache,
                    scenes=self.scenes,
                )
                rooms[id(beyond.scene)] = room.lit(beyond.transmission)
        return [rooms[id(beyond.scene)] for beyond in self.scene.beyond]

    def lit(self, transmission: Sequence[NDArray[np.float64]]) -> LendingRoom:
        """The room with T of its groups [G][K, K], as a room beside it sees it."""
        daylight, of_group = self.daylight.values, self.parts.group
        pairs = zip(of_group, daylight, strict=True)
        through = np.stack([transmission[n] @ d for n, d in pairs])
        outdoors = self.parts.outdoors(self.scene)
        beam = np.zeros((len(of_group), KLEMS_FULL.size))
        for q, n in enumerate(of_group[:outdoors]):
            beam[q] = matrix_beam(transmission[n], KLEMS_FULL)
        return LendingRoom(
            self.scene.interior, self.parts.groups, through, self.scene.exterior, beam, daylight,
            self._behind(),
        )  # fmt: skip

    def _behind(self) -> tuple[RoomBehind, ...]:
        """The rooms behind the parts of the groups that look into them."""
        scene, parts = self.scene, self.parts
        return tuple(
            RoomBehind(int(parts.of(g)[0]), len(parts.of(g)), one.beam, room)
            for g, one, room in zip(
                range(len(scene.outdoor_groups), len(scene.groups)), scene.beyond, self.beyond,
                strict=True,
            )
        )  # fmt: skip

    @cached_property
    def borrowed_picture(self) -> list[RoomShown]:
        """The other rooms that the view's pixels show straight through glass."""
        scene, chosen = self.scene, self.sampling
        return borrowed_picture(
            scene.interior, self.parts.groups, self._behind(), scene.view,
            subdivision=chosen.subdivision, samples=chosen.outdoor_samples,
            max_depth=INDOOR_DEPTH, seed=chosen.seed, scenes=self.scenes,
        )  # fmt: skip

    def looked_through(self, pictures: Pictures, sky: NDArray[np.floating]) -> Pictures:
        """Pictures under skies [P, h] with other rooms seen through glass, not by its patches."""
        if not self.scene.beyond:
            return pictures
        behind, seen = self._behind(), self.view.seen
        return BorrowedPictures(
            pictures, self.borrowed_picture, seen, behind, self.daylight.values, sky
        )

    def borrowed_view(self, g: int, samples: int, stopping: Stopping) -> Estimate:
        """B [S, P] of a group that looks into another room."""
        i = g - len(self.scene.outdoor_groups)
        return borrowed_view(
            (self.scene.interior, self.scene.groups), g, self.scene.beyond[i].beam,
            self.beyond[i], self.scene.sensors(),
            samples=samples, max_depth=INDOOR_DEPTH, stopping=stopping,
            seed=self.sampling.seed, cache=self.cache, scenes=self.scenes,
        )  # fmt: skip

    def _with_no_inner(self, exterior: Surfaces) -> NDArray[np.float64]:
        """What comes straight [Q, K, P] past what stands outdoors."""
        scene = self.scene
        if not scene.beyond and not len(exterior.triangles):  # nothing outdoors reflects
            return self.daylight.values
        found, outdoors = np.zeros_like(self.daylight.values), self.parts.outdoors(scene)
        if not len(exterior.triangles):
            found[:outdoors] = self.daylight.values[:outdoors]
        elif outdoors:
            found[:outdoors] = self._daylight(1, 0.2, 0.3, exterior).values
        return found

    def _borrowed(self) -> list[Estimate]:
        """D [Q, K, P] of each group that looks into another room."""
        first, chosen = len(self.scene.outdoor_groups), self.sampling
        found = []
        for g, room in enumerate(self.beyond, first):
            inner = [self.parts.groups[q] for q in self.parts.of(g)]
            found.append(
                borrowed_daylight(
                    room.surfaces, room.groups, room.luminance, inner,
                    samples=max(chosen.patch_samples // INNER_SHARE // BATCHES, 1),
                    max_depth=INDOOR_DEPTH, stopping=Stopping(batches=BATCHES), seed=chosen.seed,
                    cache=self.cache, scenes=self.scenes,
                )
            )  # fmt: skip
        return found

    def _daylight(
        self, depth: int, start: float, end: float, exterior: Surfaces | None = None
    ) -> Estimate:
        chosen, groups = self.sampling, self.scene.outdoor_groups
        parts = self.parts.groups[: self.parts.outdoors(self.scene)]
        samples, batches = chosen.patch_samples, BATCHES
        if len(parts) > len(groups):  # at about the cost of the whole groups
            samples = samples * len(groups) // len(parts)
            batches = PART_BATCHES
        return daylight_matrix(
            self.scene.exterior if exterior is None else exterior,
            parts,
            subdivision=chosen.subdivision,
            samples=max(samples // batches, 1),
            max_depth=depth,
            stopping=Stopping(batches=batches),
            seed=chosen.seed,
            progress=part(self.progress, start, end, "daylight"),
            cache=self.cache,
            scenes=self.scenes,
        )

    def _sensors(self, depth: int, start: float, end: float) -> Estimate:
        chosen = self.sampling
        return view_matrix(
            self.scene.interior,
            self.parts.groups,
            *self.scene.sensors(),
            samples=max(chosen.sensor_samples // BATCHES, 1),
            max_depth=depth,
            stopping=Stopping(batches=BATCHES),
            seed=chosen.seed,
            progress=part(self.progress, start, end, "daylight"),
            cache=self.cache,
            scenes=self.scenes,
        )

    def _view_inputs(self, depth: int) -> tuple:
        """What the matrices of the view's pixels follow from."""
        chosen = self.sampling
        inputs = self.scene.interior, self.parts.groups, chosen.view_samples, chosen.seed, depth
        return variants.activate(), *inputs

    def _view(self, depth: int, light: PatchLight | None = None) -> ViewMatrices:
        scene, chosen = self.scene, self.sampling
        if scene.view is None:
            raise ValueError("the scene has no view to make pictures of")
        trace = partial(
            view_matrices,
            scene.interior,
            self.parts.groups,
            scene.view,
            samples=chosen.view_samples,
            seed=chosen.seed,
            memory=chosen.memory,
            scenes=self.scenes,
            max_depth=depth,
            progress=part(self.progress, 0.0, 1.0, "view matrices"),
        )
        return kept_view(self.cache, scene.view, self._view_inputs(depth), trace, light=light)
