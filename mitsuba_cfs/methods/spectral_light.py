"""The light of a scene by channel, from the matrices and the traced sun of its photopic light.

In a channel c the transmission of a system is that of the visible band times a factor of the angle
of incidence (rank one: spectrum of the panes, times angles of the visible band),

    T_c(out, in) = T(out, in) r_c(in),    r_c = tau_c / tau_v of its panes

so that nothing is traced again where the surfaces reflect all channels equally: V, D and their kin
are those of the visible band, and what was traced through a group is scaled by its factor at the
angle that it came from.

    sensors by patches       r_c at the patch of incidence
    straight view            r_c at the patch of the sky; of what the outdoors reflects, the mean
                             of the patches of incidence that the sensor sees it through
    sun and its beam         r_c at the angle of the sun
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.methods.coefficients import (
    GroupCoefficients,
    direct_daylight,
    direct_sensor_matrix,
    sun_shares,
    without_straight,
)
from mitsuba_cfs.methods.light import SeasonalLight, seasons_of
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    SensorLight,
    illuminance_of_all,
    sensor_light,
    traced_states,
    with_means,
    with_sensor_light,
)
from mitsuba_cfs.methods.reflected_sun import replaced_through
from mitsuba_cfs.methods.window_reflection import reflects_outdoors
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.spectra.channels import Channels
from mitsuba_cfs.spectra.daylight import WATER_CM, SpectralSky, spectral_sky
from mitsuba_cfs.surfaces import WindowGroup
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.paths.scene import PathOptics

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ChannelOptics:
    """A system's optics in a channel: those of the visible band, transmission times a factor."""

    visible: SystemOptics
    factor: Array  # [K] r_c of the patches of incidence

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
        """See `SystemOptics`; of the visible band."""
        return self.visible.reflection

    @property
    def outdoor_reflection(self) -> Array | None:
        """See `SystemOptics`; of the visible band."""
        return self.visible.outdoor_reflection


Factors = Sequence[Sequence[SpectralFactor]]  # of each window group in each of its states [G][J]


def channel_irradiance(
    light: PhaseLight | SeasonalLight,
    factors: Factors,
    channels: Channels,
    state: NDArray[np.int64] | None = None,
    *,
    water_cm: ArrayLike = WATER_CM,
) -> Iterator[NDArray[np.float32]]:
    """Irradiance of the sensors, the eye last, in each band in turn [S + 1, L] [W/m2].

    Args:
        factors: of the systems of the light [G][J].
        state: of each window group in each hour [G, L]; the first by default.
        water_cm: precipitable water of the atmosphere [L] or of all hours.

    Raises: `ValueError` for path tracing, which has no matrices.
    """
    parts = []
    for one, hours in seasons_of(light):
        if not isinstance(one, PhaseLight):
            raise ValueError("path tracing has no matrices: expected the light of a phase method")
        water = np.broadcast_to(np.asarray(water_cm, dtype=float), (len(light.sky.lit),))[hours]
        rows = None if state is None else state[:, hours]
        parts.append((hours, rows, _Season(with_sensor_light(one), factors, channels, water)))
    for c in range(channels.count):
        whole: NDArray[np.float32] | None = None
        for hours, rows, season in parts:
            values = illuminance_of_all(season.in_channel(c), rows).astype(np.float32)
            if whole is None:
                whole = np.zeros((len(values), len(light.sky.lit)), dtype=np.float32)
            whole[:, hours] = values
        assert whole is not None  # a year has a season
        yield whole


def sky_spectra(sky: AnnualSky, water_cm: ArrayLike = WATER_CM) -> SpectralSky:
    """The spectra of the skies, grounds and suns of hours."""
    luminance = sky.without_sun()
    return spectral_sky(
        luminance, ReinhartSky.of_size(len(luminance)).horizontal_weights,
        np.asarray(sky.illuminance, dtype=float), sky.direction[:, 2], water_cm,
    )  # fmt: skip


class _Season:
    """What the channels of a light share."""

    def __init__(
        self, light: PhaseLight, factors: Factors, channels: Channels, water_cm: Array
    ) -> None:
        self._light, self._channels = light, channels
        self._sky = sky_spectra(light.sky, water_cm)
        self._sun = self._sky.of_sun(channels)  # [L, C]
        lit = sensor_light(light)
        known: dict[int, _Angles] = {}
        self._angles = [
            [known.setdefault(id(f), _Angles(f, channels)) for f in of] for of in factors
        ]
        self._groups = [
            [_GroupInState(light, lit[g][j], g, self._angles[g][j]) for j in traced_states(states)]
            for g, states in enumerate(light.systems)
        ]

    def in_channel(self, c: int) -> PhaseLight:
        """The light in a band, whose illuminance is irradiance in it [W/m2]."""
        light, sun = self._light, self._sun[:, c]
        sky = light.sky.in_channel(self._sky.diffuse(self._channels, c), sun)
        # a state between two others is the mean of them in each channel too
        sensors = tuple(
            with_means(states, [one.in_channel(c, sun) for one in traced])
            for states, traced in zip(light.systems, self._groups, strict=True)
        )
        systems = [
            [ChannelOptics(one, of.patches[c]) for one, of in zip(states, angles, strict=True)]
            for states, angles in zip(light.systems, self._angles, strict=True)
        ]
        reflected = light.reflected
        of_all = [optics for states in light.systems for optics in states]
        if reflected is not None and reflects_outdoors(light.matrices, of_all):
            factor = sun[reflected.shining].astype(np.float32)
            before = tuple(values * factor for values in reflected.before)
            reflected = replace(reflected, sky=sky, before=before)
        return replace(light, sky=sky, systems=systems, sensors=sensors, reflected=reflected)


class _Angles:
    """Factors of a system in all channels."""

    def __init__(self, factor: SpectralFactor, channels: Channels) -> None:
        self._factor, self._channels = factor, channels
        self.patches = factor.of_patches(channels)  # [C, K]

    def towards(self, group: WindowGroup, directions: Array) -> NDArray[np.float32]:
        """Factors of light from directions [n, 3] on a window group [C, n]."""
        theta = np.arccos(np.clip(directions @ group.frame[2], 0.0, 1.0))
        return self._factor.at(self._channels, theta).astype(np.float32)


class _GroupInState:
    """The light of the sensors through a group in a state, as channels scale it."""

    def __init__(self, light: PhaseLight, one: SensorLight, g: int, angles: _Angles) -> None:
        matrices, coefficients = light.matrices, one.coefficients
        self._one, self._angles = one, angles
        parts = matrices.parts.of(g)
        self._daylight = [matrices.daylight.values[q] for q in parts]
        self._rest = [without_straight(matrices, coefficients, q) for q in parts]
        self._by_sun: list[tuple[Array, Array]] = []
        if coefficients.by_sun is not None:
            direct = direct_daylight(matrices)
            shares = ((sun_shares(matrices, coefficients, q), direct[q]) for q in parts)
            self._by_sun = list(shares)
        self._seen = _outdoors_seen(light, coefficients, parts)
        self._parts, self._reflected = parts, light.reflected
        self._straight_outdoors = one.added  # [S, L] of `added`: what is seen straight through
        if one.added is not None and one.beam_in_room is not None:
            self._straight_outdoors = one.added - one.beam_in_room
            if light.reflected is not None:
                self._straight_outdoors -= replaced_through(light.reflected, parts, self._rest)
        group = matrices.scene.groups[g]
        sky = ReinhartSky(matrices.sampling.subdivision).directions
        self._to_sky = angles.towards(group, sky)  # [C, P]
        self._to_sun = angles.towards(group, light.sky.direction)  # [C, L]

    def in_channel(self, c: int, sun: Array) -> SensorLight:
        """The light in a band; sun: power of the beam in it per lumen [L]."""
        one, patches = self._one, self._angles.patches[c]
        coefficients = one.coefficients
        whole = sum(
            (rest * patches) @ daylight
            for rest, daylight in zip(self._rest, self._daylight, strict=True)
        )
        by_sun = None
        if coefficients.by_sun is not None:
            by_sun = sum((shares * patches) @ daylight for shares, daylight in self._by_sun)
        straight = coefficients.straight
        if straight is not None:
            # what comes off the outdoors meets the window from anywhere
            direct = straight.values.values if straight.direct is None else straight.direct
            scaled = direct * self._to_sky[c]
            whole = whole + scaled + (straight.values.values - direct) * (self._seen @ patches)
            if by_sun is not None and straight.direct is not None:
                by_sun = by_sun + scaled
        beam = self._to_sun[c] * sun
        added = one.added
        if added is not None and one.beam_in_room is not None:
            added = one.beam_in_room * beam
            added += self._straight_outdoors * (self._seen @ patches) * sun
            if self._reflected is not None:
                shares = [rest * patches for rest in self._rest]
                added += sun * replaced_through(self._reflected, self._parts, shares)
        optics = ChannelOptics(coefficients.optics, patches)
        return SensorLight(
            replace(coefficients, optics=optics, whole=whole, by_sun=by_sun),
            added,
            None if one.sun is None else one.sun * beam,
        )


def _outdoors_seen(
    light: PhaseLight, group: GroupCoefficients, parts: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Shares [S, 1, K] of the patches of incidence in what sensors see of reflecting outdoors."""
    matrices = light.matrices
    seen = np.zeros((len(group.whole), len(group.beam)))
    if group.straight is not None and matrices.direct_daylight is not None:
        direct_view, direct = direct_sensor_matrix(matrices), direct_daylight(matrices)
        for q in parts:
            reflected = np.maximum(matrices.daylight.values[q] - direct[q], 0.0).sum(axis=1)
            seen += direct_view[:, q] * group.beam * reflected
    total = seen.sum(axis=1, keepdims=True)
    return np.divide(seen, total, out=np.zeros_like(seen), where=total > 0)[:, None]
