"""Luminance pictures of a scene's view by the phase methods, in some hours of a sky.

three-phase    L = V T D s
five-phase     L = V T D s - V_d T D_d s_d + the sun at its own angle, its disc in each pixel
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs import phases
from mitsuba_cfs.glare.annual import PictureMatrix, Pictures, add_seen
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.methods.coefficients import direct_daylight, direct_transmittance
from mitsuba_cfs.methods.optics import SystemOptics, combinations, in_state
from mitsuba_cfs.methods.phase_light import PhaseLight, WindowLight, sky_in, window_light, with_reflected_sun
from mitsuba_cfs.methods.phase_matrices import (
    PhaseMatrices,
    few_pictures,
    view_of_light,
    with_sunlit,
    with_view_matrices,
)
from mitsuba_cfs.methods.reflected_sun import replaced_before
from mitsuba_cfs.methods.window_reflection import (
    reflected_luminance,
    reflects,
    reflects_outdoors,
    returned_from_outdoors,
    with_exchange_of,
)
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.matrices.adjacent import GlassToRoom
from mitsuba_cfs.trace.pictures.adjacent import RoomShown
from mitsuba_cfs.trace.pictures.annual import FivePhasePictures, ViewMatrices
from mitsuba_cfs.trace.pictures.outdoors import OutdoorCoefficients, outdoors
from mitsuba_cfs.trace.sun.picture_beam import BeamLight, beam_light
from mitsuba_cfs.trace.sun.picture_sun import PictureSun

BEAM_SAMPLES = 16  # rays of a tile to the windows, for each path of a pixel of the view
T = TypeVar("T")


def with_phase_pictures(light: PhaseLight, *, direct: bool = False, progress: Progress = silent) -> PhaseLight:
    """The light with the matrices of the view's pixels; `direct`: with those of eDGP."""
    matrices = with_view_matrices(light.matrices, direct=direct, progress=progress)
    return replace(light, matrices=matrices)


def pictures_by_state(
    light: PhaseLight, hours: NDArray[np.int64], rows: NDArray[np.int64]
) -> list[tuple[NDArray[np.int64], Pictures]]:
    """Pictures of some hours [n], each window group in a state of its own in each [G, n].

    Matrices of the view have a column for each patch of the window parts.  Where the pictures are
    far fewer, and these matrices have not been traced, the view's paths carry the luminance of the
    windows in these hours instead: a column for each picture.

    Returns: of each combination of states the numbers [k] of its hours, and their pictures.
    """
    kinds = list(combinations(rows))
    if not few_pictures(light.matrices, len(hours)):
        light = with_phase_pictures(light)
        return [(at, pictures_in_state(light, hours[at], state)) for state, at in kinds]
    made = [(at, _five_phase_pictures(light, hours[at], state, None)) for state, at in kinds]
    whole = PatchLight.joined([five.light(np.arange(five.hours)) for _, five in made])
    matrices, first = view_of_light(light.matrices, whole), 0
    for _, five in made:
        five.see_by(matrices.of_columns(slice(first, first + five.hours)))
        first += five.hours
    return list(made)


def pictures_in_state(
    light: PhaseLight, hours: NDArray[np.int64], state: Sequence[int], *, direct: bool = False
) -> Pictures:
    """Pictures of some hours [n] with each window group in a state [G].

    Args: direct: without a second reflection, for eDGP.
    """
    matrices = with_view_matrices(light.matrices, direct=direct)
    light = replace(light, matrices=matrices)
    view = matrices.direct_view if direct else matrices.view
    pictures: Pictures
    if matrices.five_phase:
        pictures = _five_phase_pictures(light, hours, state, view, direct=direct)
    elif direct:
        pictures = _traced(view).three_phase(_direct_luminance(light, hours, state))
    else:
        windows = _windows(light, hours, state)
        luminance = _window_luminance(light, hours, state, windows, light.optics(state))
        pictures = _traced(view).three_phase(luminance)
    if direct or matrices.adjacent_shown is None:
        return pictures
    sky, daylight = light.sky.whole[:, hours], matrices.daylight.values
    return AdjacentRoomPictures(
        pictures,
        matrices.adjacent_shown,
        _traced(view).seen,
        matrices.behind(),
        daylight.astype(np.float32),
        sky.astype(np.float32),
    )


def _five_phase_pictures(
    light: PhaseLight,
    hours: NDArray[np.int64],
    state: Sequence[int],
    view: ViewMatrices | None,
    *,
    direct: bool = False,
) -> FivePhasePictures:
    """Five-phase pictures; without `view` the caller sets the matrices (`see_by`)."""
    matrices, sky, optics = light.matrices, light.sky, light.optics(state)
    windows, interior = _windows(light, hours, state), matrices.scene.interior
    exterior, parts = matrices.scene.exterior, matrices.parts.groups
    scattering, eye = [o.scattering for o in optics], matrices.scene.eye
    sun = PictureSun(interior, exterior, parts, scattering, eye, scenes=matrices.scenes)
    if direct:
        luminance = _direct_luminance(light, hours, state)
    else:
        luminance = _window_luminance(light, hours, state, windows, optics, sun)
    pictures = FivePhasePictures(
        view,
        sun,
        luminance,
        _stacked([one.sun for one in windows], luminance.shape),
        sky.direction[hours],
        sky.illuminance[hours],
        beam=_beams(windows, luminance.shape),
    )
    key = tuple(map(id, (matrices, *optics)))
    if light.views is None or key not in light.views:
        shared = _shared_by_hours(matrices, optics, in_state(light.systems, state))
        if light.views is not None:
            light.views[key] = (*shared, matrices, *optics)  # these, so that no other object gets their ids
    else:
        shared = light.views[key][:2]
    seen, beam = shared
    daylight = direct_daylight(matrices) if direct else matrices.daylight.values
    pictures.show_outdoors(
        seen, daylight, direct_daylight(matrices), sky.without_sun(hours), sky.sun_alone(hours), light=beam
    )
    return pictures


def _shared_by_hours(
    matrices: PhaseMatrices, of_parts: Sequence[SystemOptics], of_groups: Sequence[SystemOptics]
) -> tuple[OutdoorCoefficients, BeamLight | None]:
    """What pictures of all hours show outdoors, and the windows' beams, with systems [Q], [G]."""
    scene, sampling = matrices.scene, matrices.sampling
    seen = outdoors(
        scene.interior,
        scene.exterior,
        matrices.parts.groups,
        [one.scattering for one in of_parts],
        scene.eye,
        subdivision=sampling.subdivision,
        samples=sampling.outdoor_samples,
        seed=sampling.seed,
        scenes=matrices.scenes,
    )
    return seen, _beam_light(matrices, of_groups)


def _windows(light: PhaseLight, hours: NDArray[np.int64], state: Sequence[int]) -> list[WindowLight]:
    """The luminance of each window part [Q] in some hours."""
    sky = light.sky if light.sky.are_all(hours) else light.sky.part(hours)
    optics = light.optics(state)
    return [window_light(light.matrices, q, one, sky) for q, one in enumerate(optics)]


def _direct_luminance(light: PhaseLight, hours: NDArray[np.int64], state: Sequence[int]) -> NDArray[np.floating]:
    """Luminance of the windows by the light straight from sky and sun, T D_d s [Q, K, n]."""
    transmission = [one.transmission for one in light.optics(state)]
    sky = light.sky.whole[:, hours]
    return phases.room_side_radiance(transmission, direct_daylight(light.matrices), sky)


def _window_luminance(
    light: PhaseLight,
    hours: NDArray[np.int64],
    state: Sequence[int],
    windows: Sequence[WindowLight],
    optics: Sequence[SystemOptics],
    sun: PictureSun | None = None,
) -> NDArray[np.floating]:
    """Luminance of the windows [Q, K, n] towards the room, with what they reflect.

    Args: sun: in the view, with the five-phase method.
    """
    luminance: NDArray[np.floating] = np.stack([one.whole for one in windows])
    matrices = with_exchange_of(light.matrices, optics)
    if matrices.outdoor_exchange is not None and reflects_outdoors(matrices, optics):
        before = _before_windows(light, hours)
        back = returned_from_outdoors(matrices.outdoor_exchange.values, optics, before)
        pairs = zip(optics, back.reshape(luminance.shape), strict=True)
        luminance = luminance + [one.transmission @ values for one, values in pairs]
    if matrices.exchange is not None and reflects(optics):
        in_sun = None
        if sun is not None:
            sunlit = with_sunlit(matrices).sunlit
            suns, strength = light.sky.direction[hours], light.sky.illuminance[hours]
            met = sun.sunlit_luminance(_traced(sunlit), suns, strength)
            in_sun = _beams(windows, luminance.shape), met
        exchange = matrices.exchange.values
        luminance = luminance + reflected_luminance(exchange, optics, luminance, in_sun)
    return luminance


def _before_windows(light: PhaseLight, hours: NDArray[np.int64]) -> NDArray[np.float64]:
    """Luminance outside the windows [Q * K, h], without what they reflect there themselves."""
    daylight, reflected = light.matrices.daylight.values, with_reflected_sun(light).reflected
    before: NDArray[np.float64] = daylight.reshape(-1, daylight.shape[2]) @ sky_in(light, hours)
    if reflected is not None:
        before += replaced_before(reflected, None, hours)
    return before


def _beam_light(matrices: PhaseMatrices, optics: Sequence[SystemOptics]) -> BeamLight | None:
    """The windows' beams on the surfaces that the view's pixels show.

    None without a beam; with glossy outdoors, of which one ray knows nothing, patches are taken.

    Args: optics: of each window group [G].
    """
    scene, parts = matrices.scene, matrices.parts
    beams = [direct_transmittance(matrices, optics[g], g) for g in parts.group]
    pairs = zip(parts.group, beams, strict=True)
    scattering = [optics[g].scattering if beam.any() else None for g, beam in pairs]
    if scene.exterior.glossy or all(one is None for one in scattering):
        return None
    return beam_light(
        scene.interior,
        scene.exterior,
        parts.groups,
        scattering,
        np.stack(beams),
        scene.eye,
        subdivision=matrices.sampling.subdivision,
        samples=BEAM_SAMPLES * matrices.sampling.view_samples,
        seed=matrices.sampling.seed,
        scenes=matrices.scenes,
    )


def _beams(windows: Sequence[WindowLight], shape: tuple[int, ...]) -> NDArray[np.float32]:
    return _stacked([one.beam for one in windows], shape)


def _stacked(values: Sequence[NDArray[np.float32] | None], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Luminances of the parts [Q, K, n], 0 where there are none."""
    stacked = np.zeros(shape, dtype=np.float32)
    for q, one in enumerate(values):
        if one is not None:
            stacked[q] = one
    return stacked


def _traced(matrices: T | None) -> T:
    """Matrices that have been traced before."""
    if matrices is None:
        raise ValueError("the matrices have none of the view: with_view_matrices(matrices)")
    return matrices


@dataclass(frozen=True)
class AdjacentRoomPictures:
    """Pictures with the rooms behind glass in place of the luminance of its patches.

        L = V T D s - V_seen diag(tau) D s + what the rooms show of s (`RoomShown`)

    What the glass scatters stays in its patches, as what it lights does; the sun's disc is not seen
    through it.  The noise is that of the pictures: that of the adjacent rooms is not known.
    """

    pictures: Pictures  # of hours [h], in which the glass shows its patches
    rooms: Sequence[RoomShown]
    seen: sparse.csr_array  # [n, Q * K] share of each patch of the windows in each pixel
    behind: Sequence[GlassToRoom]  # which of the windows look into the rooms
    daylight: NDArray[np.float32]  # D [Q, K, P]
    sky: NDArray[np.float32]  # [P, h] of the hours

    @property
    def view(self) -> View:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.view

    @property
    def pixels(self) -> NDArray[np.int64]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.pixels

    @property
    def hours(self) -> int:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.hours

    @property
    def shared(self) -> PictureMatrix:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.shared

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._with_rooms(self.pictures.values(batch), batch)

    def without_disc(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[tuple[SunDisc, ...]]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        values, discs = self.pictures.without_disc(batch)
        return self._with_rooms(values, batch), discs

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        self.pictures.add_disc(values, batch)

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        rows, values = self.pictures.by_rows(batch)
        return rows, self._with_rooms(values, batch)

    def discs(self, batch: NDArray[np.int64]) -> list[tuple[SunDisc, ...]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.discs(batch)

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self.pictures.noise(batch)

    def _with_rooms(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """The values [h, n] with the rooms in place of the patches of the glass."""
        sky = self.sky[:, batch]
        by_patches = np.zeros((*self.daylight.shape[:2], len(batch)), dtype=np.float32)
        for one in self.behind:
            parts = slice(one.first, one.first + one.count)
            beam = np.asarray(one.beam, dtype=np.float32)[:, None]
            by_patches[parts] = -beam * (self.daylight[parts] @ sky)
        add_seen(values, self.seen, by_patches.reshape(-1, len(batch)))
        np.maximum(values, 0, out=values)  # below it by rounding alone
        for room in self.rooms:
            room.add_to(values, sky)
        return values
