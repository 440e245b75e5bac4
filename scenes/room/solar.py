"""Solar radiation of a room: incident, transmitted, absorbed in window layers and in surfaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.defaults import ROOM_REFLECTANCE
from bim.doorways import THINNEST, panes_between, reveals_between, rooms_through_panes, wall_depth
from bim.fenestration import pane_transmissivity
from bim.model import Face
from bim.outer_faces import OuterFaces
from bim.to_thermal import ThermalRoom
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.gloss import STEPS, Gloss, pane, pane_shares
from mitsuba_cfs.methods.light import hours_by_season, in_order_of_hours
from mitsuba_cfs.methods.phase_matrices import BATCHES, PhaseMatrices, phase_matrices, with_outdoors
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.matrix import series_matrix, sky_series
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from scenes.fenestration.thermal_system import ThermalSystem, thermal_system
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.windows import RoomWindows, room_windows
from thermal.climate import Solar
from thermal.control import switched

FloatArray = NDArray[np.float64]
Gains = dict[str, FloatArray]  # [H] [W] by name: incident_w, transmitted_w, absorbed_..._w
Place = tuple[str, int]  # GUID of a room, number of its face
SunBeyond = dict[Place, FloatArray]  # [H] absorbed [W] at panes of the room and in those beyond
SunOfYear = tuple[Solar, Gains, SunBeyond]


@dataclass(frozen=True, slots=True)
class SeasonalOutdoors:
    """Solar daylight matrices D outside a room's windows, by season."""

    scenes: list[PhaseMatrices]  # one a season: equal window groups and subgroups
    season: NDArray[np.int64]  # [L] of each lit hour

    @property
    def first(self) -> PhaseMatrices:
        """The scene of the first season."""
        return self.scenes[0]

    def by_season(self, of_season: Callable[[PhaseMatrices, FloatArray], FloatArray], sky: FloatArray) -> FloatArray:
        """Values [.., L] of all lit hours, from the scene and the sky [P, l] of each season."""
        parts = hours_by_season(self.scenes, self.season)
        if len(parts) == 1:
            return of_season(parts[0][0], sky)
        return in_order_of_hours([(of_season(scene, sky[:, hours]), hours) for scene, hours in parts])


SOLAR_CLEAR = 0.80  # solar transmittance of inner glass without a value: 6 mm float, EN 410
GLASS_INDEX = 1.52
APART = 0.002  # rooms without a wall's thickness between them are separated by this much [m]


@dataclass(frozen=True, slots=True)
class SunlitRooms:
    """The triangles that the sun of a room's windows meets: its own, then those beyond its glass.

    Surfaces are numbered by those of the zone, F, then come panes and doorways of the room, the
    faces of the rooms beyond, and the windows of these.
    """

    interior: Surfaces
    beyond: tuple[Place | None, ...] = ()  # of the surfaces from F on; None: a window to outdoors


@dataclass(frozen=True, slots=True)
class ZoneInSun:
    """A zone's surfaces F and windows in the solar band."""

    sunlit: SunlitRooms
    windows: RoomWindows
    thermals: Sequence[Sequence[ThermalSystem]]  # [G][J]
    facade: FloatArray  # [H, F] irradiance on the outside [W/m2]
    # [P, L] the sun alone [W/m2/sr], where all other light meets hemispherical values; else None
    sun: NDArray[np.floating] | None = None


def seasonal_outdoors(
    room: RoomInputs, light: RoomLight | None = None, *, progress: Progress = silent
) -> SeasonalOutdoors:
    """The outdoors of a room in the solar band.

    Args: light: whose matrices are used again where both bands have equal reflectances outdoors.
    """
    first, *others = (exterior_surfaces(season.building, room.space, "solar") for season in room.seasons)
    if (
        light is not None
        and light.inner is None
        and np.array_equal(first.reflectance, light.scene.exterior.reflectance)
    ):
        matrices = light.matrices
    else:
        traced = None if light is None else light.matrices.scenes
        matrices = _traced_outdoors(room, first, traced, progress)
    of_daylight = replace(matrices, five_phase=False)  # no D_d
    scenes = [replace(matrices.scene, exterior=exterior) for exterior in others]
    later = (with_outdoors(of_daylight, scene) for scene in scenes)
    return SeasonalOutdoors([matrices, *later], room.season)


def _traced_outdoors(
    room: RoomInputs, exterior: Surfaces, scenes: SceneCache | None, progress: Progress
) -> PhaseMatrices:
    scene = DaylightScene(Surfaces.none(), exterior, room.windows.groups)
    steps = part(progress, 0.0, 1.0, "sun")
    matrices = phase_matrices(
        scene, room.options.sampling, five_phase=False, needs=(), cache=room.cache, scenes=scenes, progress=steps
    )
    steps("sun", 1.0)
    return matrices


def window_irradiance(outdoors: SeasonalOutdoors, skies: AnnualSky) -> FloatArray:
    """Irradiance of the window groups [H, G] [W/m2]."""
    groups = len(outdoors.first.scene.groups)
    of_each = np.repeat(np.eye(groups)[..., None], KLEMS_FULL.size, axis=2)
    return skies.whole_year(directional_sums(outdoors, skies, of_each)).T


def directional_sums(
    outdoors: SeasonalOutdoors, skies: AnnualSky, shares: FloatArray, sun: NDArray[np.floating] | None = None
) -> FloatArray:
    """Weighted sums [n, L] [W/m2] over the directions of the groups' irradiance, in lit hours.

    The n sums of D come before the many hours, which are multiplied in the skies' single precision.

    Args:
        shares: [n, G, K] weights of the irradiance of each group from each patch.
        sun: [P, L] part of the sky beyond which all light has each group's mean weight.
    """
    if not outdoors.first.scene.groups:
        return np.zeros((len(shares), len(skies.lit)))
    omega = KLEMS_FULL.projected_solid_angles()

    def sums(weights: FloatArray, light: FloatArray) -> FloatArray:
        flat = (weights * omega).reshape(len(weights), -1)

        def of_season(scene: PhaseMatrices, sky: FloatArray) -> FloatArray:
            daylight = scene.parts.of_groups(scene.daylight.values)
            rows = flat @ daylight.reshape(flat.shape[1], -1)
            return (rows.astype(sky.dtype) @ sky).astype(float)

        return outdoors.by_season(of_season, light)

    if sun is None:
        return sums(shares, skies.solar)
    mean = (shares @ (omega / omega.sum()))[..., None] * np.ones(len(omega))
    return sums(shares, sun) + sums(mean, np.maximum(skies.solar - sun, 0.0))


def solar_gains(
    room: RoomInputs,
    outdoors: SeasonalOutdoors,
    zone: ThermalRoom,
    outer: OuterFaces,
    state: NDArray[np.int64],
    *,
    thermals: Sequence[Sequence[ThermalSystem]],
    progress: Progress = silent,
) -> tuple[Solar, Gains, SunBeyond]:
    """Solar radiation absorbed in the shading states of every hour [H, G], and its sums.

    Also what the faces of rooms beyond the glass absorb.

    Each combination of states that occurs is balanced by itself: what a window's blind reflects
    indoors reaches the other windows.

    Args:
        outer: points in front of the outer faces of the zone's surfaces.
        thermals: thermal data of the window groups in each state [G][J].
    """
    by_states = SunByStates(room, outdoors, zone, outer, thermals=thermals, progress=progress)
    kinds, kind = combinations_of(state)
    suns = [by_states.of(combination) for combination in kinds]
    hours = np.arange(len(kind))
    gains = {name: np.stack([sums[name] for _, sums, _ in suns])[kind, hours] for name in suns[0][1]}
    beyond = {place: np.stack([passed[place] for *_, passed in suns])[kind, hours] for place in suns[0][2]}
    of_windows = state[:, room.windows.group]
    return switched([solar for solar, *_ in suns], kind, of_windows), gains, beyond


class SunByStates:
    """Sun of a room's zone in combinations of the states of its window groups.

    Absorption indoors is traced once for each set of back reflectances.
    """

    def __init__(
        self,
        room: RoomInputs,
        outdoors: SeasonalOutdoors,
        zone: ThermalRoom,
        outer: OuterFaces,
        *,
        thermals: Sequence[Sequence[ThermalSystem]],
        progress: Progress = silent,
    ) -> None:
        """Args as of `solar_gains`."""
        steps = part(progress, 0.0, 0.8, "heat")
        self._room, self._outdoors, self._progress = room, outdoors, part(steps, 0.6, 1.0)
        facade = facade_irradiance(outdoors, outer, len(zone.zone.surfaces), room.skies, progress=part(steps, 0.4, 0.6))
        sun = _sun_alone(room) if room.options.sky_light == "hemispherical" else None
        self._zone = ZoneInSun(sunlit_rooms(room, zone), room.windows, thermals, facade, sun)
        self._absorption: dict[bytes, FloatArray] = {}
        self._known: dict[tuple[int, ...], SunOfYear] = {}

    def of(self, state: Sequence[int]) -> SunOfYear:
        """Sun of the year with each window group in a state [G], its sums, and the sun beyond."""
        windows = self._room.windows
        for g, j in enumerate(state):
            pair = windows.neighbours(g, j)
            if pair is not None and self._alike(g, j, *pair[:2]):  # a tilt between two: the mean of the sun in these
                low, high, share = pair
                first, second = (self.of([*state[:g], k, *state[g + 1 :]]) for k in (low, high))
                return _mean_sun(first, second, share)
        key = tuple(state)
        if key not in self._known:
            self._known[key] = self._balanced(state)
        return self._known[key]

    def _alike(self, g: int, *states: int) -> bool:
        """Whether some states of a window group have nodes for the same layers."""
        of = self._zone.thermals[g]
        shades = [of[min(j, len(of) - 1)].fenestration.shade for j in states]
        return len({None if shade is None else shade.exterior for shade in shades}) == 1

    def _balanced(self, state: Sequence[int]) -> SunOfYear:
        heats = _in_states(self._zone.thermals, state)
        back = np.array([heat.back_reflectance for heat in heats])
        if heats and back.tobytes() not in self._absorption:
            self._absorption[back.tobytes()] = absorption_matrix(
                self._zone.sunlit.interior,
                self._outdoors.first.scene.groups,
                window_reflectance=back,
                progress=self._progress,
                **_sampled(self._outdoors.first),
            ).values
        absorbed = self._absorption.get(back.tobytes())
        return _gains_in_states(self._zone, state, self._outdoors, self._room.skies, absorbed)


def _mean_sun(first: SunOfYear, second: SunOfYear, share: float) -> SunOfYear:
    """The mean of the sun in two combinations of states, `share` of the second."""

    def mean(one: FloatArray | None, other: FloatArray | None) -> FloatArray | None:
        return None if one is None or other is None else (1 - share) * one + share * other

    suns: dict[str, Any] = {
        field.name: mean(getattr(first[0], field.name), getattr(second[0], field.name))
        for field in fields(Solar)
        if field.name != "state"
    }
    gains = {key: (1 - share) * value + share * second[1][key] for key, value in first[1].items()}
    beyond = {key: (1 - share) * value + share * second[2][key] for key, value in first[2].items()}
    return Solar(**suns), gains, beyond


def sun_by_hour(suns: Sequence[Solar], number: NDArray[np.int64]) -> Solar:
    """The sun and the states of that one of several years which each hour [H] takes."""
    states = np.stack([np.asarray(sun.state) for sun in suns])
    return switched(suns, number, states[number, np.arange(len(number))])


def combinations_of(state: NDArray[np.int64]) -> tuple[list[tuple[int, ...]], NDArray[np.int64]]:
    """The combinations of states [G] that occur in some hours [H, G], and that of each hour [H]."""
    if not state.shape[1]:
        return [()], np.zeros(len(state), dtype=np.int64)
    kinds, kind = np.unique(state, axis=0, return_inverse=True)
    return [tuple(row) for row in kinds.tolist()], kind.ravel()


def facade_irradiance(
    outdoors: SeasonalOutdoors, outer: OuterFaces, surfaces: int, skies: AnnualSky, *, progress: Progress = silent
) -> FloatArray:
    """Irradiance on the outside of a zone's surfaces [H, F] [W/m2]; 0 of those indoors."""
    facade = np.zeros((skies.hours, surfaces))

    def of_season(scene: PhaseMatrices, sky: FloatArray) -> FloatArray:
        coefficients = sky_irradiance_matrix(
            scene.scene.exterior,
            outer.points,
            outer.normals,
            subdivision=scene.sampling.subdivision,
            progress=progress,
            scenes=outdoors.first.scenes,
            **_sampled(outdoors.first),
        ).values  # [n, P] irradiance per unit radiance of each sky patch [sr]
        return coefficients.astype(sky.dtype) @ sky

    if len(outer.surfaces):
        lit = outdoors.by_season(of_season, skies.solar)
        facade[:, outer.surfaces] = skies.whole_year(lit).T
    return facade


def _sampled(scene: PhaseMatrices) -> dict[str, Any]:
    """Sampling of the matrices that are traced for the heat balance alone."""
    return {
        "samples": max(scene.sampling.patch_samples // BATCHES, 1),
        "stopping": Stopping(batches=BATCHES),
        "seed": scene.sampling.seed,
        "cache": scene.cache,
    }


def _in_states(thermals: Sequence[Sequence[ThermalSystem]], state: Sequence[int]) -> list[ThermalSystem]:
    """The thermal data of each group in its state; a group with fewer states is in its last."""
    return [of[min(j, len(of) - 1)] for of, j in zip(thermals, state, strict=True)]


def sunlit_rooms(room: RoomInputs, zone: ThermalRoom) -> SunlitRooms:
    """What the sun of a room's windows meets, through the glass of rooms balanced with it.

    A pane transmits and reflects as a single one of its solar transmittance (Fresnel, n 1.52), a
    doorway transmits everything; the wall's thickness between is a tube of reveals.  What goes out
    through the windows of the rooms beyond is lost.
    """
    interior = interior_surfaces(room.space, "solar")
    numbers = zone.surface_of_face[interior.surface]
    zone_gloss = _zone_gloss(interior, numbers)
    others = rooms_through_panes(room.building, room.space, room.together)
    if not others:
        triangles, reflectance = interior.triangles, interior.reflectance
        return SunlitRooms(Surfaces(triangles, reflectance, numbers, gloss=zone_gloss))
    F = len(zone.zone.surfaces)
    gloss: list[Gloss | None] = [*zone_gloss, *[None] * (F - len(zone_gloss))]
    transmittance: list[tuple[float, ...] | None] = [None] * F
    beyond: list[Place | None] = []
    pieces: list[tuple[FloatArray, float, int]] = []  # triangles, reflectance, surface

    def add(
        triangles: FloatArray,
        reflectance: float,
        place: Place | None,
        of: Gloss | None = None,
        tau: tuple[float, ...] | None = None,
    ) -> None:
        pieces.append((triangles, reflectance, F + len(beyond)))
        gloss.append(of)
        transmittance.append(tau)
        beyond.append(place)

    reached = {room.space.guid, *(other.guid for other in others)}
    moved = {room.space.guid: np.zeros(3)}
    for one in (room.space, *others):
        through = {
            face.name: (guid, face, back)
            for guid, pairs in panes_between(room.building.spaces, one).items()
            if guid in reached
            for face, back in pairs
        }
        step = moved[one.guid]
        for guid, face, back in through.values():
            apart = max(APART - wall_depth(face, back), 0.0)
            moved.setdefault(guid, step + apart * face.normal)
        for number, face in enumerate(one.faces):
            place = one.guid, number
            triangles = face.triangles + step
            if face.name in through:
                guid, _, back = through[face.name]
                add(triangles, 0.0, place, *_pane_optics(face))
                if one.guid < guid and (depth := wall_depth(face, back)) > THINNEST:
                    reveals = reveals_between(face, depth).reshape(-1, 3, 3)
                    add(reveals + step, ROOM_REFLECTANCE["reveal"], place)
            elif one.guid != room.space.guid:
                add(triangles, face.reflectance("solar"), place, face.gloss)
            else:
                pieces.append((triangles, face.reflectance("solar"), int(zone.surface_of_face[number])))
        if one.guid != room.space.guid:
            windows = room_windows(one, room.systems)
            for group, states in zip(windows.groups, windows.systems, strict=True):
                back_reflectance = thermal_system(states[0]).back_reflectance
                for window in group.windows:
                    add(window.triangles + step, back_reflectance, None)
    counts = [len(triangles) for triangles, *_ in pieces]
    joined = Surfaces(
        np.concatenate([triangles for triangles, *_ in pieces]),
        np.repeat([reflectance for _, reflectance, _ in pieces], counts),
        np.repeat([number for *_, number in pieces], counts),
        gloss=tuple(gloss) if any(gloss) else (),
        transmittance=tuple(transmittance),
    )
    return SunlitRooms(joined, tuple(beyond))


def _pane_optics(face: Face) -> tuple[Gloss | None, tuple[float, ...]]:
    """Specular reflectance and transmittance by angle of a pane or doorway between rooms."""
    if face.pane is None or face.pane.is_open:
        return None, (1.0, 1.0)
    tau = face.pane.solar_transmittance
    inner = pane_transmissivity(SOLAR_CLEAR if tau is None else tau, GLASS_INDEX)
    shares = pane_shares(np.linspace(0.0, 1.0, STEPS), GLASS_INDEX, inner)[0]
    return pane(GLASS_INDEX, inner), tuple(np.clip(shares, 0.0, 1.0).tolist())


def _zone_gloss(interior: Surfaces, numbers: NDArray[np.int64]) -> tuple[Gloss | None, ...]:
    """The gloss of the zone's surfaces; none for a surface of faces that differ in gloss."""
    kinds: dict[int, set[Gloss | None]] = {}
    for number, face in zip(numbers, interior.surface, strict=True):
        kinds.setdefault(int(number), set()).add(interior.gloss[face] if interior.gloss else None)
    if not interior.glossy:
        return ()
    uniform = {number: gloss.pop() for number, gloss in kinds.items() if len(gloss) == 1}
    return tuple(uniform.get(number) for number in range(int(numbers.max()) + 1))


def _gains_in_states(
    zone: ZoneInSun, state: Sequence[int], outdoors: SeasonalOutdoors, skies: AnnualSky, absorption: FloatArray | None
) -> tuple[Solar, Gains, SunBeyond]:
    """Solar radiation absorbed by window layers, surfaces and facades, sums, and what goes beyond.

    Args:
        state: [G] of the window groups.
        absorption: [G, K, F + B + G] share of the flux of each window patch that each surface, what
            lies beyond inner glass, and each window absorbs; None for a room without windows.
    """
    group, facade = zone.windows.group, zone.facade
    F = facade.shape[1]
    if absorption is None:
        dark = np.zeros((skies.hours, 0))
        return Solar(dark, dark, np.zeros_like(facade), facade), {}, {}
    heats = _in_states(zone.thermals, state)
    area = np.array([g.area for g in zone.windows.groups])
    T = np.stack([s.solar.transmission_matrix() for s in zone.windows.in_states(state)])
    shares = absorbed_shares(heats, T, area, absorption)
    sums = np.split(
        directional_sums(outdoors, skies, np.concatenate(shares), zone.sun), np.cumsum([len(s) for s in shares[:-1]])
    )
    taken, outer, inner, middle, whole = (rows.T for rows in sums)
    B = len(zone.sunlit.beyond)
    retained = np.array([h.back_absorptance / max(1.0 - h.back_reflectance, 1e-9) for h in heats])

    def year(values: NDArray[Any]) -> NDArray[Any]:
        return skies.whole_year(np.ascontiguousarray(values.T)).T

    solar = Solar(
        absorbed_outer=year(outer[:, group]),
        absorbed_inner=year(inner[:, group]),
        inside=year(taken[:, :F]),
        facade=facade,
        window_inside=year((retained * taken[:, F + B :] / area)[:, group]),
        absorbed_middle=year(middle[:, group]),
    )
    gains = {
        "incident_w": whole[:, 0],
        "transmitted_w": whole[:, 1],
        "absorbed_outer_w": outer @ area,
        "absorbed_inner_w": (inner + middle) @ area,
        "absorbed_room_w": taken[:, :F].sum(axis=1),
    }
    if B:
        gains["at_and_beyond_inner_glass_w"] = taken[:, F : F + B].sum(axis=1)
    beyond: SunBeyond = {}
    for number, place in enumerate(zone.sunlit.beyond, F):
        if place is not None:
            beyond[place] = beyond.get(place, 0.0) + skies.whole_year(taken[:, number])
    return solar, {name: skies.whole_year(values) for name, values in gains.items()}, beyond


def _sun_alone(room: RoomInputs) -> NDArray[np.floating]:
    """Radiance of the sun on the patches of the sky in the lit hours [P, L] [W/m2/sr]."""
    series = sky_series(room.weather, "solar", sun_model=room.options.sun_model)
    subdivision, dtype = room.options.sampling.subdivision, room.skies.solar.dtype.type
    return series_matrix(series, room.skies.lit, subdivision, "sun", dtype=dtype)


def absorbed_shares(
    heats: Sequence[ThermalSystem], transmission: FloatArray, area: FloatArray, absorption: FloatArray
) -> list[FloatArray]:
    """Weights of the groups' irradiance by direction [n, G, K] for `directional_sums`.

    What the room's surfaces and windows absorb [W]; outer and inner layers of each group, and the
    pane behind an interior shade [W/m2]; what is incident on all windows and what they transmit
    [W].

    Args: transmission: [G, K, K]; area: [G] [m2]; absorption: [G, K, F + G].
    """
    omega = KLEMS_FULL.projected_solid_angles()
    entering = omega[:, None] * area[:, None, None] * (transmission / omega)  # [G, K, K] [W]
    absorbed = absorption.transpose(2, 0, 1)[:, :, None]  # [F + G, G, 1, K]
    each = np.eye(len(area))[..., None]
    outer = each * np.stack([heat.absorptances.outer for heat in heats])
    inner = each * np.stack([heat.absorptances.inner for heat in heats])
    middle = each * np.stack([np.broadcast_to(h.absorptances.middle, omega.shape) for h in heats])
    whole = np.stack([np.tile(area[:, None], len(omega)), entering.sum(axis=1)])
    return [(absorbed @ entering)[:, :, 0], outer, inner, middle, whole]
