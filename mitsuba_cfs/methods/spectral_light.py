"""What detectors receive of a scene's light, from the matrices and the sun of its photopic light.

In a channel c the transmission of a system is that of the visible band times a factor of the angle
of incidence (rank one: spectrum of the panes, times angles of the visible band),

    T_c(out, in) = T(out, in) r_c(in),    r_c = tau_c / tau_v of its panes

(of coloured slats by the share of T(out, in) that they reflect 0, 1, 2, .. times, each with its r_c),

so that nothing is traced again where the surfaces reflect all channels equally: V, D and their kin
are those of the visible band, and what was traced through a group is scaled by its factor at the
angle that it came from.  Rooms with colour are traced in a few bands q of reflectance
(`coloured_room`), and V is the sum of these by b_q(lambda).

All of this is linear in r_c and in the spectrum of the sky.  The factors of all channels are sums
of a few modes m, r_c = sum a_cm r_m, and skies are sums of a few components k.
A detector that weighs the channels by w_c receives

    E = sum_k (sum_cm w_c a_cm S_kc V T_m D) s_k + sum_cm w_c a_cm (E_m of the sun) sun_c

which are a few products with the sky for any number of channels.

    sensors by patches       r_c at the patch of incidence
    straight view            r_c at the patch of the sky; of what the outdoors reflects, the mean
                             of the patches of incidence that the sensor sees it through
    sun and its beam         r_c at the angle of the sun; coloured slats by C_ds of what they reflect n times
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_factor import ANGLES, PatchFactors, SpectralFactor
from mitsuba_cfs.methods.coefficients import (
    GroupCoefficients,
    direct_daylight,
    direct_sensor_matrix,
    sensor_matrix,
    sun_shares,
    without_straight,
)
from mitsuba_cfs.methods.coloured_room import RoomInBand, rooms_in_bands
from mitsuba_cfs.methods.light import SeasonalLight, seasons_of
from mitsuba_cfs.methods.optics import States, SystemOptics, combinations, neighbours
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    SensorLight,
    direct_sun,
    direct_sun_of_all,
    in_place_of_sun,
    sensor_light,
    shining_hours,
    sky_coefficients,
    states_of,
    traced_states,
    with_means,
    with_sensor_light,
)
from mitsuba_cfs.methods.reflected_sun import replaced_through
from mitsuba_cfs.phases import times_sky
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.spectra.channels import Channels
from mitsuba_cfs.spectra.daylight import WATER_CM, SpectralSky, spectral_sky
from mitsuba_cfs.spectra.detectors import NANOMETRES
from mitsuba_cfs.surfaces import WindowGroup
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering, Scattering
from mitsuba_cfs.trace.paths.scene import PathOptics

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ModeOptics:
    """A system's optics in a mode: those of the visible band, transmission times a factor."""

    visible: SystemOptics
    factor: Array  # r_m of the patches of incidence [K], or of pairs of patches [K out, K in]
    mirrored: float = 1.0  # what it reflects of the room's light, over visible light

    @property
    def transmission(self) -> Array:
        """See `SystemOptics`."""
        return self.visible.transmission * self.factor

    @property
    def scattering(self) -> Scattering:
        """See `SystemOptics`; of the visible band."""
        return self.visible.scattering

    @property
    def paths(self) -> PathOptics:
        """See `SystemOptics`; of the visible band."""
        return self.visible.paths

    @property
    def reflection(self) -> Array | None:
        """See `SystemOptics`; that of the visible band times a number."""
        reflection = self.visible.reflection
        return reflection if reflection is None or self.mirrored == 1.0 else reflection * self.mirrored

    @property
    def outdoor_reflection(self) -> Array | None:
        """See `SystemOptics`; of the visible band."""
        return self.visible.outdoor_reflection


Factors = Sequence[Sequence[SpectralFactor]]  # of each window group in each of its states [G][J]
MODE_ERROR = 1e-5  # largest part of a factor that modes leave out; visible light's is 1


@dataclass(frozen=True, slots=True)
class Detection:
    """What is wanted of the light of some sensors."""

    weights: Array  # [D, C] what detectors receive of a unit of power in each band
    sensors: slice = field(default_factory=lambda: slice(None))  # of the scene's, the eye last
    total: bool = False  # the sum over the hours alone


@dataclass(frozen=True, slots=True)
class SpectralLight:
    """What detectors receive."""

    received: tuple[NDArray[np.float32], ...]  # of each `Detection` [D, s, L], or [D, s] of totals
    outdoors: Array  # [N] the hours' sum of the irradiance of a horizontal plane [W/(m2 nm)]


def spectral_light(
    light: PhaseLight | SeasonalLight,
    factors: Factors,
    channels: Channels,
    wanted: Sequence[Detection],
    state: NDArray[np.int64] | None = None,
    *,
    reflectance: Array | None = None,
    water_cm: ArrayLike = WATER_CM,
    clear: str = "cie",
    ground: Array | None = None,
    progress: Progress = silent,
) -> SpectralLight:
    """What detectors receive of the light of the sensors.

    Args:
        factors: of the systems of the light [G][J].
        reflectance: diffuse reflectance of the room's surfaces [F, N]; neutral by default.
        state: of each window group in each hour [G, L]; the first by default.
        water_cm: precipitable water of the atmosphere [L] or of all hours.
        clear: spectrum of a clear sky, one of `SKY_SPECTRA`.
        ground: reflectance of the ground [N], of any scale; neutral by default.

    Raises: `ValueError` for path tracing, which has no matrices.
    """
    hours_of_all, sensors = len(light.sky.lit), len(light.scene.sensors()[0])
    received = []
    for one in wanted:
        shape = (len(one.weights), len(range(sensors)[one.sensors]), hours_of_all)
        received.append(np.zeros(shape[:2] if one.total else shape, dtype=np.float32))
    outdoors = np.zeros(len(NANOMETRES))
    parts = seasons_of(light)
    for i, (phase, hours) in enumerate(parts):
        if not isinstance(phase, PhaseLight):
            raise ValueError("path tracing has no matrices: expected the light of a phase method")
        water = np.broadcast_to(np.asarray(water_cm, dtype=float), (hours_of_all,))[hours]
        skies = sky_spectra(phase.sky, water, clear, ground=ground)
        rows = states_of(phase, None if state is None else state[:, hours])
        season = _Season(
            with_sensor_light(phase), _occurring(factors, phase.systems, rows), channels, skies, reflectance
        )
        outdoors += season.sky.horizontal.sum(axis=0)
        for kind, some in combinations(rows):
            modes = season.modes_in(kind, some)
            for one, whole in zip(wanted, received, strict=True):
                values = modes.received(one)
                if one.total:
                    whole += values.sum(axis=-1)
                else:
                    whole[..., hours[some]] = values
        progress("spectral", (i + 1) / len(parts))
    return SpectralLight(tuple(received), outdoors)


def _occurring(factors: Factors, systems: Sequence[States], rows: NDArray[np.int64]) -> Factors:
    """The factors of the states that occur in hours [G, L]; a state that does not has that of one that does.

    Each factor more is modes more, in each of which all light is computed.
    """
    found = []
    for of, states, row in zip(factors, systems, rows, strict=True):
        used = set(np.unique(row).tolist())
        for j in tuple(used):
            used |= set((neighbours(states, j) or ())[:2])
        other = replace(of[min(used, default=0)], slats=None)
        found.append([one if j in used else other for j, one in enumerate(of)])
    return found


def sky_spectra(
    sky: AnnualSky, water_cm: ArrayLike = WATER_CM, clear: str = "cie", *, ground: Array | None = None
) -> SpectralSky:
    """The spectra of the skies, grounds and suns of hours, as of `spectral_sky`."""
    luminance = sky.without_sun()
    return spectral_sky(
        luminance,
        ReinhartSky.of_size(len(luminance)).horizontal_weights,
        np.asarray(sky.illuminance, dtype=float),
        sky.direction[:, 2],
        water_cm,
        clear,
        ground=ground,
    )


class _Season:
    """The light of the hours of one season, in the modes of its systems' factors."""

    def __init__(
        self, light: PhaseLight, factors: Factors, channels: Channels, sky: SpectralSky, reflectance: Array | None
    ) -> None:
        self._light, self.sky = light, sky
        # power of sun and ground in each band per lumen and of the sky's components
        self._sun, self._ground = channels.power(self.sky.sun), channels.power(self.sky.ground)
        self._components = channels.power(self.sky.components)  # [k, C]
        lit = sensor_light(light)
        distinct = {id(factor): factor for of in factors for factor in of}
        of_factors, angles = _modes(list(distinct.values()), channels)  # [C, M]
        known = dict(zip(distinct, angles, strict=True))
        self._angles = [[known[id(factor)] for factor in of] for of in factors]
        rooms, of_rooms = rooms_in_bands(light, reflectance, factors, channels)
        self._shares = np.einsum("cq,cm->cqm", of_rooms, of_factors).reshape(channels.count, -1)
        self._modes = []
        of_slats = _sun_on_slats(light, self._angles)
        for room in rooms:
            groups = [
                [
                    _GroupInState(light, lit[g][j], g, self._angles[g][j], room, beam, of_slats=of_slats.get((g, j)))
                    for j, beam in zip(traced_states(states), room.beams[g], strict=True)
                ]
                for g, states in enumerate(light.systems)
            ]
            self._modes += [self._in_mode(groups, m, room) for m in range(of_factors.shape[1])]

    def _in_mode(self, groups: Sequence[Sequence[_GroupInState]], m: int, room: RoomInBand) -> PhaseLight:
        """The light in a mode of a room, under the photopic sun."""
        light = self._light
        # a state between two others is the mean of them in each mode too
        sensors = tuple(
            with_means(states, [one.in_mode(m) for one in traced])
            for states, traced in zip(light.systems, groups, strict=True)
        )
        systems = [
            [ModeOptics(one, of.of_pairs(m), k) for one, of, k in zip(states, angles, mirrored, strict=True)]
            for states, angles, mirrored in zip(light.systems, self._angles, room.mirrored, strict=True)
        ]
        return replace(light, matrices=room.matrices, systems=systems, sensors=sensors)

    def modes_in(self, kind: Sequence[int], hours: NDArray[np.int64]) -> _Modes:
        """The light in all modes in some hours, with each group in a state [G]."""
        sky, coefficients, by_sun, direct = self.sky, [], [], []
        for light in self._modes:
            whole = sky_coefficients(light, kind)
            coefficients.append(whole.astype(np.float32))
            by_sun.append(times_sky(whole, light.sky.lit_sun_in(hours)) + in_place_of_sun(light, kind, hours))
            if light.matrices.five_phase:
                direct.append(direct_sun_of_all(light, kind, hours))
        amount = sky.amount
        return _Modes(
            np.array(coefficients),
            np.array(by_sun),
            np.array(direct) if direct else None,
            amount if self._light.sky.are_all(hours) else amount[..., hours],
            sky.ground_luminance[hours],
            self._shares,
            self._components,
            self._sun[hours],
            self._ground[hours],
        )


@dataclass(frozen=True, slots=True)
class _Modes:
    """The light of the sensors in modes M in some hours h, under the sky's components k."""

    coefficients: NDArray[np.float32]  # [M, S, P] of the sky
    by_sun: Array  # [M, S, h] of the sun, but for what comes straight from it
    direct: Array | None  # [M, S, h] straight from the sun; None with the three-phase method
    amount: NDArray[np.float32]  # [k, P, h]
    ground_luminance: Array  # [h]
    shares: Array  # [C, M]
    components: Array  # [k, C]
    sun: Array  # [h, C]
    ground: Array  # [h, C]

    def received(self, one: Detection) -> Array:
        """What detectors receive [D, s, h]."""
        weights = one.weights[:, :, None] * self.shares  # [D, C, M]
        of_sun = np.tensordot(weights, self.sun, (1, 1))  # [D, M, h]
        values = self._of_sky(weights, one.sensors)
        ground = np.tensordot(weights, self.ground, (1, 1)) * self.ground_luminance
        values += np.einsum("ms,dmh->dsh", self.coefficients[:, one.sensors, 0], ground)
        values += np.einsum("msh,dmh->dsh", self.by_sun[:, one.sensors], of_sun, optimize=True)
        if self.direct is None:
            return values
        np.maximum(values, 0.0, out=values)
        values += np.einsum("msh,dmh->dsh", self.direct[:, one.sensors], of_sun, optimize=True)
        return values

    def _of_sky(self, weights: Array, sensors: slice) -> Array:
        """Of the sky without its sun [D, s, h]: products of modes, or of detectors if fewer."""
        coefficients = self.coefficients[:, sensors]
        D, M, s = len(weights), len(coefficients), coefficients.shape[1]
        values = np.zeros((D, s * self.amount.shape[-1]))
        for k in range(len(self.components)):
            mixed = np.tensordot(weights, self.components[k], (1, 0)).astype(np.float32)  # [D, M]
            if D < M:
                rows = np.tensordot(mixed, coefficients, 1).reshape(D * s, -1)
                values += (rows @ self.amount[k]).reshape(values.shape)
            else:
                lit = coefficients.reshape(M * s, -1) @ self.amount[k]
                values += mixed @ lit.reshape(M, -1)
        return values.reshape(D, s, -1)


def _modes(factors: Sequence[SpectralFactor], channels: Channels) -> tuple[Array, list[_Angles]]:
    """Modes of the factors of systems: their shares in the channels [C, M], and the systems'."""
    parts = [(factor.of_patches(channels), factor.of_angles(channels)) for factor in factors]
    each = [one for patches, angles in parts for one in (patches.straight, *patches.reflected, *angles)]
    whole = np.concatenate(each, axis=1)
    left, size, right = np.linalg.svd(whole, full_matrices=False)
    count = 1
    while count < len(size):
        rest = whole - (left[:, :count] * size[:count]) @ right[:count]
        if np.abs(rest).max() <= MODE_ERROR:
            break
        count += 1
    split = iter(np.split(right[:count], np.cumsum([one.shape[1] for one in each])[:-1], axis=1))
    found = []
    for factor, (patches, _) in zip(factors, parts, strict=True):
        straight = next(split)
        reflected = np.array([next(split) for _ in patches.reflected]).reshape(-1, *straight.shape)
        shares = None if factor.slats is None else factor.slats.shares
        angles = np.array([next(split) for _ in range(1 + len(reflected))])
        found.append(_Angles(PatchFactors(straight, reflected), angles, shares))
    return left[:, :count] * size[:count], found


@dataclass(frozen=True, slots=True)
class _Angles:
    """Factors of a system in all modes."""

    patches: PatchFactors  # [M, K] of the patches of incidence
    angles: Array  # [1 + n, M, A] at `ANGLES`: straight on, and what slats reflect 1, 2, .. times
    shares: Array | None = None  # of visible light that slats reflect, as of `SlatLight`; None: none

    def of_pairs(self, m: int) -> Array:
        """Factors of a mode: of patches of incidence [K], with coloured slats of pairs of patches [K, K]."""
        straight, reflected = self.patches.straight[m], self.patches.reflected[:, m]
        if self.shares is None:
            return straight
        pairs: Array = straight + np.einsum("nok,nk->ok", self.shares, reflected - straight)
        return pairs

    def reflected(self, optics: SystemOptics) -> Array | None:
        """The parts of T that slats reflect 1, 2, .. times [n, K, K], of the visible band; None: none."""
        return None if self.shares is None else optics.transmission * self.shares

    def towards(self, group: WindowGroup, directions: Array, times: int = 0) -> NDArray[np.float32]:
        """Factors of light from directions [n, 3] on a window group [M, n] that slats reflect so many times."""
        theta = np.arccos(np.clip(directions @ group.frame[2], 0.0, 1.0))
        rows = [np.interp(theta, ANGLES, row) for row in self.angles[times]]
        return np.array(rows, dtype=np.float32)


@dataclass(frozen=True, slots=True)
class _Shares:
    """Light of the sensors per unit luminance outside a window part, of visible light [S, K]."""

    whole: Array
    reflected: Array | None  # [n, S, K] what slats reflect of it 1, 2, .. times; None: none

    @staticmethod
    def of(whole: Array, view: Array, reflected: Array | None) -> _Shares:
        """Those by V or V_d [S, K] and the parts of T that slats reflect [n, K, K]."""
        return _Shares(whole, None if reflected is None else view @ reflected)

    def scaled(self, of: PatchFactors, m: int) -> Array:
        """The same in a mode."""
        scaled = self.whole * of.straight[m]
        return scaled if self.reflected is None else scaled + self.coloured(of, m)

    def coloured(self, of: PatchFactors, m: int) -> Array:
        """What the slats' light in a mode has more than if it had passed between them."""
        if self.reflected is None:
            return 0.0 * self.whole
        coloured: Array = np.einsum("nsk,nk->sk", self.reflected, of.reflected[:, m] - of.straight[m])
        return coloured


class _GroupInState:
    """The light of the sensors through a group in a state, in a band of the room, as modes scale it."""

    def __init__(
        self,
        light: PhaseLight,
        one: SensorLight,
        g: int,
        angles: _Angles,
        room: RoomInBand,
        beam: Array | None,
        *,
        of_slats: Array | None,
    ) -> None:
        matrices, coefficients = room.matrices, one.coefficients
        self._of_slats = of_slats  # [n, S, L] of the direct sun; None: none
        self._one, self._angles, self._beam = one, angles, beam
        parts = matrices.parts.of(g)
        self._daylight = [matrices.daylight.values[q] for q in parts]
        reflected = angles.reflected(coefficients.optics)
        view = sensor_matrix(matrices).values
        self._rest = [_Shares.of(without_straight(matrices, coefficients, q), view[:, q], reflected) for q in parts]
        self._by_sun: list[tuple[_Shares, Array]] = []
        if coefficients.by_sun is not None:
            direct, direct_view = direct_daylight(matrices), direct_sensor_matrix(matrices)
            for q in parts:
                shares = _Shares.of(sun_shares(matrices, coefficients, q), direct_view[:, q], reflected)
                self._by_sun.append((shares, direct[q]))
        self._seen = _outdoors_seen(light, coefficients, parts)
        self._parts, self._reflected = parts, light.reflected
        self._straight_outdoors = one.added  # [S, L] of `added`: what is seen straight through
        if one.added is not None and one.beam_in_room is not None:
            self._straight_outdoors = one.added - one.beam_in_room
            if light.reflected is not None:
                visible = [without_straight(light.matrices, coefficients, q) for q in parts]
                self._straight_outdoors -= replaced_through(light.reflected, parts, visible)
        group = matrices.scene.groups[g]
        sky = ReinhartSky(matrices.sampling.subdivision).directions
        self._to_sky = angles.towards(group, sky)  # [M, P]; of the ground, the first, see `_ground_seen`
        self._ground = _ground_seen(light, coefficients, parts)
        each = range(len(angles.angles))
        self._to_sun = np.array([angles.towards(group, light.sky.direction, n) for n in each])  # [1 + n, M, L]

    def in_mode(self, m: int) -> SensorLight:
        """The light in a mode."""
        one, of = self._one, self._angles.patches
        coefficients = one.coefficients
        straight, seen = coefficients.straight, self._seen @ of.straight[m]
        rest = [shares.scaled(of, m) for shares in self._rest]
        whole = sum(shares @ daylight for shares, daylight in zip(rest, self._daylight, strict=True))
        by_sun: Array | None = None
        if coefficients.by_sun is not None:
            by_sun = np.sum([shares.scaled(of, m) @ daylight for shares, daylight in self._by_sun], axis=0)
        if straight is not None:
            # what comes off the outdoors meets the window from anywhere
            direct = straight.values.values if straight.direct is None else straight.direct
            scaled = direct * self._to_sky[m]
            scaled[:, :1] = direct[:, :1] * (self._ground @ of.straight[m])
            whole = whole + scaled + (straight.values.values - direct) * seen
            if by_sun is not None and straight.direct is not None:
                by_sun = by_sun + scaled
        beam, added = self._to_sun[0, m], one.added
        if added is not None and self._beam is not None:
            added = self._beam * beam
            added += self._straight_outdoors * seen
            if self._reflected is not None:
                added += replaced_through(self._reflected, self._parts, rest)
        optics, sun = ModeOptics(coefficients.optics, self._angles.of_pairs(m)), None
        if one.sun is not None:
            sun = one.sun * beam
            if self._of_slats is not None:
                sun += np.einsum("nsl,nl->sl", self._of_slats, self._to_sun[1:, m] - beam)
        return SensorLight(replace(coefficients, optics=optics, whole=whole, by_sun=by_sun), added, sun)


def _sun_on_slats(light: PhaseLight, angles: Sequence[Sequence[_Angles]]) -> dict[tuple[int, int], Array]:
    """Illuminance [n, S, L] of the sensors directly from the sun that coloured slats reflect n times.

    Args: angles: of the systems [G][J]; returned are those of the groups and states with such slats.
    """
    hours = shining_hours(light)
    if not light.matrices.five_phase or not len(hours):
        return {}
    luminance, omega = light.sky.illuminance[hours] / SUN_SOLID_ANGLE, KLEMS_FULL.projected_solid_angles()
    ways: list[list[Scattering | None]] = []
    of: list[tuple[int, int]] = []
    for g, states in enumerate(light.systems):
        for j in traced_states(states):
            parts = angles[g][j].reflected(states[j])
            for values in () if parts is None else parts:
                ways.append([None] * len(light.systems))
                ways[-1][g] = KlemsScattering(KLEMS_FULL, values / omega, np.zeros(KLEMS_FULL.size))
                of.append((g, j))
    found: dict[tuple[int, int], list[Array]] = {}
    for (g, j), one in zip(of, direct_sun(light, ways, hours) if ways else [], strict=True):
        values = np.zeros((len(light.scene.sensors()[0]), len(light.sky.lit)))
        if one is not None:
            values[:, hours] = one.values[g] * luminance
        found.setdefault((g, j), []).append(values)
    return {key: np.array(values) for key, values in found.items()}


def _outdoors_seen(light: PhaseLight, group: GroupCoefficients, parts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Shares [S, 1, K] of the patches of incidence in what sensors see of reflecting outdoors."""
    matrices = light.matrices
    seen = np.zeros((len(group.whole), len(group.beam)))
    if group.straight is not None and matrices.direct_daylight is not None:
        direct_view, direct = direct_sensor_matrix(matrices), direct_daylight(matrices)
        for q in parts:
            reflected = np.maximum(matrices.daylight.values[q] - direct[q], 0.0).sum(axis=1)
            seen += direct_view[:, q] * group.beam * reflected
    return _of_total(seen)[:, None]


def _ground_seen(light: PhaseLight, group: GroupCoefficients, parts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Shares [S, 1, K] of the patches of incidence in the direct light of the ground, one patch with no direction."""
    matrices = light.matrices
    view = sensor_matrix(matrices).values if matrices.direct_sensors is None else matrices.direct_sensors
    daylight = matrices.daylight.values if matrices.direct_daylight is None else matrices.direct_daylight
    return _of_total(np.sum([view[:, q] * group.beam * daylight[q, :, 0] for q in parts], axis=0))[:, None]


def _of_total(seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each row's values over its sum [S, K]; 0 where there is nothing."""
    total = seen.sum(axis=1, keepdims=True)
    return np.divide(seen, total, out=np.zeros_like(seen), where=total > 0)
