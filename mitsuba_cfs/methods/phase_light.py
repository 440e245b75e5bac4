"""Illuminance of sensors by the phase methods: matrices, systems and skies.

    E = V T D s                                         three-phase
    E = V T D s - V_d T D_d s_d + C_ds s_sun            five-phase

V T D s has the beam that the room reflects at the sun's own angle, as C_ds has it
(`mitsuba_cfs.phases.sun_beams`).  V_d and D_d are traced with the seed and the samples of V and D:
they are a part of them, entry by entry, and nothing gets negative.

Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase); McNeil and Lee
2013, "Annual daylighting performance of a passive optical light shelf" and McNeil 2013, "The
five-phase method for simulating complex fenestration with Radiance".
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.evaluate import held_beams
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.coefficients import (
    GroupCoefficients,
    beam_matrix,
    direct_daylight,
    direct_sensor_matrix,
    group_coefficients,
    reflected_shares,
    sensor_matrix,
)
from mitsuba_cfs.methods.optics import (
    States,
    SystemOptics,
    check_systems,
    combinations,
    hourly_states,
    in_state,
    neighbours,
)
from mitsuba_cfs.methods.phase_matrices import DEFAULT_NEEDS, PhaseMatrices, with_needs, with_sensors
from mitsuba_cfs.methods.reflected_sun import ReflectedSun, reflected_sun, reflected_to_sensors, replaced_before
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.window_reflection import reflects_outdoors, with_exchange_of
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.scattering import Scattering, patch_beams, through_beams
from mitsuba_cfs.trace.sun.direct import direct_sun_matrix
from mitsuba_cfs.trace.sun.specular_paths import shining

SUN_BATCHES = 4  # of C_ds
ALL_SENSORS, EYE = slice(None), slice(-1, None)
State = NDArray[np.int64]  # [G, L] state of each window group in each hour, or [L] of all groups
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WindowLight:
    """The luminance of a window part towards the room in one state [cd/m2]."""

    whole: NDArray[np.float32]  # [K, L] T D s
    sun: NDArray[np.float32] | None  # [K, L] T D_d s_d, the sun alone; None with the three-phase method
    beam: NDArray[np.float32] | None  # [K, L] its straight beam; None where none passes


@dataclass(frozen=True, slots=True)
class SunNoise:
    """What was traced of the sun in some hours h, times a factor of each."""

    traced: Estimate  # [S, h]
    factor: Array  # [h]
    hours: NDArray[np.int64]  # [h] their numbers among L

    def variance_of(self, weights: Array) -> tuple[Array, Array]:
        """As of `Estimate` of the sensors' sums over the hours [S], by weights [1 or S, L]."""
        return self.traced.variance_of(weights[:, self.hours] * self.factor)


@dataclass(frozen=True, slots=True)
class SensorLight:
    """The light of the sensors, the eye last, through one window group in one state.

    Factors of the sky are stored by its patches: the groups are added up before the product.
    """

    coefficients: GroupCoefficients
    added: Array | None = None  # [S, L] the reflected sun in place of `coefficients.by_sun` [lx]
    sun: Array | None = None  # [S, L] C_ds s_sun [lx]; None with the three-phase method
    sun_noise: tuple[SunNoise, ...] = ()  # of these two
    beam_in_room: Array | None = None  # [S, L] of `added` that the sun's own beam lights [lx]


@dataclass(frozen=True)
class PhaseLight:
    """The light of a scene in the hours L of a sky, by a phase method.

    `mitsuba_cfs.methods.light` has the functions that give its illuminance, `.glare` its glare.
    """

    matrices: PhaseMatrices
    systems: Sequence[States]  # [G][J] optics of each window group in each of its states
    sky: AnnualSky
    sensors: tuple[tuple[SensorLight, ...], ...] | None = None  # [G][J]; None: not computed
    reflected: ReflectedSun | None = None  # None where the sun's patches are taken
    # what pictures in one combination of states share, for calls with few hours each; None: not stored
    views: dict[tuple[Any, ...], tuple[Any, ...]] | None = None

    @property
    def scene(self) -> DaylightScene:
        """The scene of the matrices."""
        return self.matrices.scene

    @property
    def sampling(self) -> Sampling:
        """How finely the matrices are computed."""
        return self.matrices.sampling

    @property
    def states(self) -> int:
        """J, how many states the group has that has most."""
        return max(map(len, self.systems))

    def optics(self, state: Sequence[int]) -> list[SystemOptics]:
        """The optics of each window part [Q], with each group in a state [G]."""
        groups = in_state(self.systems, state)
        return [groups[g] for g in self.matrices.parts.group]


def phase_light(
    matrices: PhaseMatrices,
    systems: Sequence[States],
    sky: AnnualSky,
    *,
    needs: Collection[str] = DEFAULT_NEEDS,
    reflected: ReflectedSun | None = None,
    progress: Progress = silent,
) -> PhaseLight:
    """The light of a scene with systems in its windows, in the hours of a sky.

    Args:
        systems: the states of each window group [G].
        needs: metrics that several calls ask for, as of `phase_matrices`.
        reflected: of these matrices and hours, where it has been traced for other systems.
    """
    check_systems(systems, matrices.scene.groups)
    if matrices.five_phase and sky.sun is None:
        raise ValueError("the five-phase method needs the sky's sun: annual_sky(..., sun=True)")
    patches, expected = len(sky.whole), matrices.daylight.values.shape[-1]
    if patches != expected:
        raise ValueError(
            f"sky: has {patches} patches, the matrices {expected}: annual_sky and Sampling need the same subdivision"
        )
    of_all = [optics for states in systems for optics in states]
    matrices = with_exchange_of(with_needs(matrices, needs, progress=progress), of_all)
    light = PhaseLight(matrices, systems, sky, reflected=reflected)
    if set(needs) - {"DGP"}:
        return with_sensor_light(light, progress=progress)
    return with_reflected_sun(light) if reflects_outdoors(matrices, of_all) else light


def with_reflected_sun(light: PhaseLight) -> PhaseLight:
    """The light with the sun that outdoor surfaces reflect to the windows.

    The three-phase method, and rooms with mirroring surfaces, use the sun's patches instead.
    """
    matrices = light.matrices
    by_patches = not matrices.five_phase or matrices.scene.interior.glossy
    if by_patches or light.reflected is not None:
        return light
    return replace(light, reflected=reflected_sun(matrices, light.sky))


def with_sensor_light(light: PhaseLight, *, progress: Progress = silent) -> PhaseLight:
    """The light with that of the sensors, from V and, with the five-phase method, C_ds."""
    if light.sensors is not None:
        return light
    light = replace(light, matrices=with_sensors(light.matrices, progress=progress))
    light = with_reflected_sun(light)
    # states that are the mean of two others are added up after these
    traced = tuple(map(traced_states, light.systems))
    chosen = [[states[j] for j in numbers] for states, numbers in zip(light.systems, traced, strict=True)]
    coefficients = group_coefficients(light.matrices, chosen)
    if not light.matrices.five_phase:
        sensors = [list(map(SensorLight, group)) for group in coefficients]
    else:
        hours = shining_hours(light)
        ways = [[o.scattering for o in in_state(chosen, [j] * len(chosen))] for j in range(max(map(len, chosen)))]
        suns = direct_sun(light, ways, hours, progress=progress)
        reflected = _reflected_to_sensors(light, coefficients)
        sensors = [
            [_sensor_light(light, one, g, reflected.get((g, j)), (suns[j], hours)) for j, one in enumerate(group)]
            for g, group in enumerate(coefficients)
        ]
    whole = zip(light.systems, sensors, strict=True)
    return replace(light, sensors=tuple(with_means(*of_group) for of_group in whole))


def traced_states(states: States) -> tuple[int, ...]:
    """Numbers of the states of a window group that are not the mean of two others."""
    return tuple(j for j in range(len(states)) if neighbours(states, j) is None)


def with_means(states: States, sensors: Sequence[SensorLight]) -> tuple[SensorLight, ...]:
    """The light of the sensors in all states of a group, from that of its `traced_states`."""
    known = dict(zip(traced_states(states), sensors, strict=True))
    result = []
    for j, optics in enumerate(states):
        pair = neighbours(states, j)
        if pair is None:
            result.append(known[j])
        else:
            low, high, share = pair
            result.append(_mean_light(optics, known[low], known[high], share))
    return tuple(result)


def _mean_light(optics: SystemOptics, low: SensorLight, high: SensorLight, share: float) -> SensorLight:
    """The mean of the sensors' light in two states, `share` of `high`."""

    def mean(one: Array | None, other: Array | None) -> Array | None:
        if one is None or other is None:
            alone, weight = (other, share) if one is None else (one, 1 - share)
            return None if alone is None else weight * alone
        return (1 - share) * one + share * other

    first, second = low.coefficients, high.coefficients
    coefficients = GroupCoefficients(
        optics,
        (1 - share) * first.beam + share * second.beam,
        (second if share > 0.5 else first).straight,  # read for the noise alone
        (1 - share) * first.whole + share * second.whole,
        mean(first.by_sun, second.by_sun),
    )
    noise = tuple(
        replace(one, factor=weight * one.factor)
        for of_state, weight in ((low, 1 - share), (high, share))
        for one in of_state.sun_noise
    )
    return SensorLight(coefficients, mean(low.added, high.added), mean(low.sun, high.sun), noise)


def sensor_light(light: PhaseLight) -> tuple[tuple[SensorLight, ...], ...]:
    """The light of the sensors [G][J]; `ValueError` where it has not been computed."""
    if light.sensors is None:
        raise ValueError("the light has none of the sensors: with_sensor_light(light)")
    return light.sensors


def illuminance_of_all(light: PhaseLight, state: State | None, some: slice = ALL_SENSORS) -> Array:
    """Illuminance of the sensors, the eye last [S + 1, L] [lx], or of some of them."""
    sensors, rows = sensor_light(light), states_of(light, state)
    illuminance = np.zeros((len(light.scene.sensors()[0][some]), rows.shape[1]))
    for kind, hours in combinations(rows):
        illuminance[:, hours] = _without_direct_sun(light, kind, hours, some)
    if not light.matrices.five_phase:
        return illuminance
    suns = (_in_states([one.sun for one in sensors[g]], row)[some] for g, row in enumerate(rows))
    return np.maximum(illuminance, 0.0, out=illuminance) + sum(suns)


def direct_sun_by_group(light: PhaseLight, state: State | None) -> list[Array] | None:
    """Illuminance of the sensors directly from the sun through each window group [G][S, L] [lx].

    None with the three-phase method.
    """
    if not light.matrices.five_phase:
        return None
    sensors = sensor_light(light)
    return [
        _in_states([one.sun for one in sensors[g]], row)[: len(light.scene.points)]
        for g, row in enumerate(states_of(light, state))
    ]


def group_shares(light: PhaseLight) -> Array:
    """Sum over the hours of the sensors' illuminance by each group in its first state [G] [lx].

    Without what windows reflect.
    """
    firsts, count = [states[0] for states in sensor_light(light)], len(light.scene.points)
    return np.array([over_hours(one, light.sky)[:count].sum() for one in firsts])


def over_hours(one: SensorLight, sky: AnnualSky) -> Array:
    """Sum over the hours of the illuminance of the sensors, the eye last [S] [lx]."""
    whole, sun, _ = sky.totals(np.ones(len(sky.lit), dtype=bool))
    total: Array = one.coefficients.whole @ whole
    if one.coefficients.by_sun is not None:
        total -= one.coefficients.by_sun @ sun
    for values in (one.added, one.sun):
        if values is not None:
            total += values.sum(axis=1)
    return total


def coefficients_in_state(light: PhaseLight, state: int) -> Array:
    """Daylight coefficients of the sensors [S, P], with every group in a state, or its last."""
    kind = [min(state, len(states) - 1) for states in light.systems]
    sensors = sensor_light(light)
    coefficients = _total([sensors[g][j].coefficients.whole for g, j in enumerate(kind)])
    reflected = reflected_shares(light.matrices, light.optics(kind))
    if reflected.coefficients is not None:
        coefficients = coefficients + reflected.coefficients
    return coefficients[: len(light.scene.points)]


def window_light(matrices: PhaseMatrices, q: int, optics: SystemOptics, sky: AnnualSky) -> WindowLight:
    """The luminance of a window part towards the room under a sky."""
    # single precision: the noise of D is a hundred thousand times its rounding
    T, daylight = [optics.transmission.astype(np.float32)], matrices.daylight.values
    whole_sky = sky.whole.astype(np.float32)
    whole = phases.room_side_radiance(T, daylight[q : q + 1].astype(np.float32), whole_sky)
    if not matrices.five_phase:
        return WindowLight(whole[0], None, None)
    direct = direct_daylight(matrices)[q : q + 1].astype(np.float32)
    sun = phases.room_side_radiance(T, direct, sky.lit_sun.astype(np.float32))
    beams = sun_beams(matrices, q, optics, sky)
    return WindowLight(whole[0], sun[0], None if beams is None else beams[0])


def luminance_without_beam(
    matrices: PhaseMatrices, q: int, optics: SystemOptics, sky: AnnualSky
) -> NDArray[np.float32]:
    """The luminance of a window part towards the room without the sun's straight beam [K, L] [cd/m2]."""
    T = [optics.transmission.astype(np.float32)]
    daylight = matrices.daylight.values[q : q + 1].astype(np.float32)
    whole = phases.room_side_radiance(T, daylight, sky.whole.astype(np.float32))[0]
    beams = sun_beams(matrices, q, optics, sky)
    return np.asarray(whole if beams is None else np.maximum(whole - beams[0], 0), dtype=np.float32)


def sun_beams(
    matrices: PhaseMatrices, q: int, optics: SystemOptics, sky: AnnualSky
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """The sun's beam of a part [K, L] by its patches and at its own angle; None without a beam."""
    scattering, sun = [optics.scattering], sky.lit_sun
    patches = patch_beams(scattering, KLEMS_FULL)
    if not patches.any():
        return None
    at_sun = through_beams(matrices.parts.groups[q : q + 1], scattering, sky.direction)
    T = [held_beams(optics.transmission, patches[0], KLEMS_FULL)]
    mirrored, straight = direct_daylight(matrices), matrices.straight_daylight
    daylight = mirrored if straight is None else straight
    by_patch, by_angle = phases.sun_beams(T, at_sun, daylight[q : q + 1], sun)
    if daylight is not mirrored:  # out of a mirror, by patches
        without_mirrors = by_patch
        by_patch, _ = phases.sun_beams(T, at_sun, mirrored[q : q + 1], sun)
        by_angle = by_angle + (by_patch - without_mirrors)
    return by_patch[0].astype(np.float32), by_angle[0].astype(np.float32)


def states_of(light: PhaseLight, state: State | None) -> State:
    """The state of each group in each hour [G, L], as far as it has states."""
    rows = hourly_states(state, light.systems, light.sky)
    return np.minimum(rows, np.array([[len(states) - 1] for states in light.systems]))


def sky_in(light: PhaseLight, hours: NDArray[np.int64]) -> NDArray[np.floating]:
    """The sky of some of its hours [P, h]; a year's is not copied."""
    return light.sky.whole if light.sky.are_all(hours) else light.sky.whole[:, hours]


def _without_direct_sun(light: PhaseLight, kind: Sequence[int], hours: NDArray[np.int64], some: slice) -> Array:
    """Illuminance [s, h] but for the direct sun, in hours with each group in a state [G].

    Few sensors before many hours, and the groups as one.
    """
    sky = sky_in(light, hours)
    # in the sky's single precision: the noise of the sums is ten thousand times its rounding
    values = (sky_coefficients(light, kind, some).astype(sky.dtype) @ sky).astype(float)
    return np.asarray(values + in_place_of_sun(light, kind, hours, some))


def sky_coefficients(light: PhaseLight, kind: Sequence[int], some: slice = ALL_SENSORS) -> Array:
    """Daylight coefficients [s, P] of the sensors, the eye last, with each group in a state [G]."""
    sensors = sensor_light(light)
    whole = _total([sensors[g][j].coefficients.whole for g, j in enumerate(kind)])
    reflected = reflected_shares(light.matrices, light.optics(kind)).coefficients
    return whole[some] if reflected is None else whole[some] + reflected[some]


def in_place_of_sun(
    light: PhaseLight, kind: Sequence[int], hours: NDArray[np.int64], some: slice = ALL_SENSORS
) -> Array | float:
    """What the five-phase method takes in place of the sun's patches, but for the direct sun.

    Illuminance less that of the patches [s, h]; 0 with the three-phase method.
    """
    if not light.matrices.five_phase:
        return 0.0
    sensors = sensor_light(light)
    chosen = [sensors[g][j] for g, j in enumerate(kind)]
    by_sun = _total([one.coefficients.by_sun for one in chosen])[some]
    values = -phases.times_sky(by_sun, light.sky.lit_sun_in(hours))
    for one in chosen:
        if one.added is not None:
            values += one.added[some] if light.sky.are_all(hours) else one.added[some][:, hours]
    outwards = reflected_shares(light.matrices, light.optics(kind)).outwards
    if outwards is not None and light.reflected is not None:
        values += replaced_before(light.reflected, outwards[some], hours)
    return values


def direct_sun_of_all(light: PhaseLight, kind: Sequence[int], hours: NDArray[np.int64]) -> Array:
    """Illuminance [S, h] directly from the sun, with each group in a state [G]; five phases."""
    sensors = sensor_light(light)
    return _total([sensors[g][j].sun for g, j in enumerate(kind)])[:, hours]


def direct_sun(
    light: PhaseLight,
    scattering: Sequence[Sequence[Scattering | None]],
    hours: NDArray[np.int64],
    *,
    progress: Progress = silent,
) -> list[Estimate | None]:
    """C_ds [J][G, S, h] of the hours in which the sun shines on a window; None without any.

    Args: scattering: of the groups in each state that is traced [J][G]; None leaves a group out.
    """
    states = len(scattering)
    if not len(hours):
        return [None] * states
    scene, chosen = light.scene, light.matrices.sampling
    matrices: list[Estimate | None] = []
    for j, ways in enumerate(scattering):
        matrices.append(
            direct_sun_matrix(
                scene.interior,
                scene.exterior,
                scene.groups,
                ways,
                *scene.sensors(),
                suns=light.sky.direction[hours],
                window_points=max(chosen.sun_points // SUN_BATCHES, 1),
                stopping=Stopping(batches=SUN_BATCHES),
                seed=chosen.seed,
                by_group=True,
                progress=part(progress, j / states, (j + 1) / states, "daylight"),
                cache=light.matrices.cache,
                scenes=light.matrices.scenes,
            )
        )
    return matrices


def shining_hours(light: PhaseLight) -> NDArray[np.int64]:
    """The hours L in which the sun is in front of a window."""
    scene, sky = light.scene, light.sky
    facing, lit = np.stack([g.frame[2] for g in scene.groups]), sky.illuminance > 0
    if scene.exterior.glossy:
        outside = light.matrices.scenes.scene(scene.exterior, scene.groups)
        return np.flatnonzero(shining(outside, facing, sky.direction) & lit)
    return np.flatnonzero(np.any(sky.direction @ facing.T > 0, axis=1) & lit)


def _reflected_to_sensors(
    light: PhaseLight, coefficients: Sequence[Sequence[GroupCoefficients]]
) -> dict[tuple[int, int], tuple[Array, Array, Estimate]]:
    """The reflected sun at the sensors through each group that looks outdoors, in each state."""
    if light.reflected is None:
        return {}
    outdoors = coefficients[: len(light.scene.outdoor_groups)]
    each = {(g, j): one for g, group in enumerate(outdoors) for j, one in enumerate(group)}
    groups = [(g, one) for (g, _), one in each.items()]
    return dict(zip(each, reflected_to_sensors(light.matrices, light.reflected, groups), strict=True))


def _passes_beam(one: GroupCoefficients) -> bool:
    return bool(beam_matrix(one.optics).any())


def _sensor_light(
    light: PhaseLight,
    one: GroupCoefficients,
    g: int,
    reflected: tuple[Array, Array, Estimate] | None,
    direct: tuple[Estimate | None, NDArray[np.int64]],
) -> SensorLight:
    """The light of the sensors through a group in a state, with the five-phase method.

    Args:
        reflected: of `_reflected_to_sensors`.
        direct: C_ds [G, S, h], and the hours h that it is of.
    """
    added = in_room = None
    noise: list[SunNoise] = []
    if light.reflected is None:
        added = in_room = beam_by_patches(light, one, g) if _passes_beam(one) else None
    elif reflected is not None:
        (added, in_room, traced), shining = reflected, light.reflected.shining
        noise.append(SunNoise(traced, np.ones(len(shining)), shining))
    sun, (matrix, hours) = np.zeros((len(one.whole), len(light.sky.lit))), direct
    if matrix is not None:
        luminance, of_group = light.sky.illuminance[hours] / SUN_SOLID_ANGLE, matrix.part(np.s_[g])
        sun[:, hours] = of_group.values * luminance
        noise.append(SunNoise(of_group, luminance, hours))
    return SensorLight(one, added, sun, tuple(noise), in_room)


def beam_by_patches(light: PhaseLight, one: GroupCoefficients, g: int) -> Array:
    """The sun's beam that a room with mirrors reflects, at the sun's own angle [S, L] [lx]."""
    view, direct_view = sensor_matrix(light.matrices), direct_sensor_matrix(light.matrices)
    indirect, total = view.values - direct_view, np.zeros((len(direct_view), len(light.sky.lit)))
    for q in light.matrices.parts.of(g):
        beams = sun_beams(light.matrices, q, one.optics, light.sky)
        if beams is not None:
            total = total + indirect[:, q] @ beams[1]
    return total


def _total(groups: Sequence[Array | None]) -> Array:
    """The sum of coefficients of the groups, which all have them."""
    first, *others = (one for one in groups if one is not None)
    return sum(others, start=first)


def _in_states(values: Sequence[Array | None], row: NDArray[np.int64]) -> Array:
    """Values [S, L] of a group, each hour's of the state [L] in it."""
    states = [one for one in values if one is not None]
    if len(states) == 1:
        return states[0]
    chosen = np.empty_like(states[0])
    for j, one in enumerate(states):
        chosen[:, row == j] = one[:, row == j]
    return chosen
