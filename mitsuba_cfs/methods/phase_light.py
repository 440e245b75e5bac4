"""The three-phase and five-phase sums: matrices, systems and skies to illuminance and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.glare.annual import Pictures
from mitsuba_cfs.methods.exact_sun import exact_sun, shining_hours
from mitsuba_cfs.methods.group_light import SensorLight, WindowLight, window_light
from mitsuba_cfs.methods.optics import States, SystemOptics, combinations, hourly_states, in_state
from mitsuba_cfs.methods.phase_error import exchange_variance, matrix_variance
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.reflected_sun import ReflectedSun, ReflectedSunLight
from mitsuba_cfs.methods.sensor_coefficients import SensorCoefficients
from mitsuba_cfs.methods.straight_views import StraightViews
from mitsuba_cfs.methods.window_reflection import WindowReflection
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.estimate import Estimate
from mitsuba_cfs.trace.pictures.annual import FivePhasePictures
from mitsuba_cfs.trace.pictures.outdoors import OutdoorCoefficients, outdoors
from mitsuba_cfs.trace.sun.picture_beam import BeamLight, beam_light
from mitsuba_cfs.trace.sun.picture_sun import PictureSun

State = NDArray[np.int64]  # [G, L] state of each window group in each hour, or [L] of all groups


class PhaseSystems:
    """A scene's matrices with what fills its windows, in each of its states."""

    def __init__(self, traced: PhaseScene, systems: Sequence[States]) -> None:
        """From the states of each window group [G]."""
        if len(systems) != len(traced.scene.groups):
            raise ValueError(f"systems of {len(systems)} groups for {len(traced.scene.groups)}")
        self.traced, self.systems = traced, systems
        self._seen: dict[tuple[int, ...], tuple[PictureSun, OutdoorCoefficients]] = {}
        self._beams: dict[tuple[int, ...], BeamLight | None] = {}
        self.straight = StraightViews(traced, systems)
        self.reflected_sun = ReflectedSun(traced, systems, self.straight)
        self.mirrored = WindowReflection(traced)
        self.sensors = SensorCoefficients(traced, self.straight, self.mirrored)

    @property
    def states(self) -> int:
        """J, how many states the group has that has most."""
        return max(map(len, self.systems))

    def light(self, sky: AnnualSky, *, progress: Progress = silent) -> PhaseLight:
        """The light of the sky's hours."""
        return PhaseLight(self, sky, progress)

    def optics(self, state: Sequence[int]) -> list[SystemOptics]:
        """The optics of each part [Q] of the window groups, with each group in a state [G]."""
        found = in_state(self.systems, state)
        return [found[g] for g in self.traced.parts.group]

    def coefficients(self, state: int = 0) -> NDArray[np.float64]:
        """Illuminance of each sensor per unit luminance of each sky patch [S, P].

        V T D, with what windows reflect, and the straight view of groups that are cut.
        """
        kind = [min(state, len(states) - 1) for states in self.systems]
        found = sum(self.sensors.of_group(g, j) for g, j in enumerate(kind))
        shares, _ = self.sensors.reflected(self.optics(kind))
        if shares is not None:
            found = found + self.sensors.of_sky(shares)
        return found[: len(self.traced.scene.points)]

    def seen_sun(self, state: tuple[int, ...]) -> tuple[PictureSun, OutdoorCoefficients]:
        """The sun and the outdoors in the view's pixels, with each group in a state."""
        if state not in self._seen:
            scene, chosen = self.traced.scene, self.traced.sampling
            scattering = [o.scattering for o in self.optics(state)]
            parts = self.traced.parts.groups
            around = scene.interior, scene.exterior, parts, scattering, scene.view
            self._seen[state] = PictureSun(*around, scenes=self.traced.scenes), outdoors(
                *around, subdivision=chosen.subdivision, samples=chosen.outdoor_samples,
                seed=chosen.seed, scenes=self.traced.scenes,
            )  # fmt: skip
        return self._seen[state]

    def beam_light(self, state: tuple[int, ...]) -> BeamLight | None:
        """The beam on what the view's pixels show of the room, with each group in a state.

        None where there is none; behind glossy outdoors, which one ray does not know, by patches.
        """
        if state not in self._beams:
            self._beams[state] = None
            scene, chosen, parts = self.traced.scene, self.traced.sampling, self.traced.parts
            last = [min(j, len(s) - 1) for j, s in zip(state, self.systems, strict=True)]
            beams = [self.straight.beam(g, last[g]) for g in parts.group]
            ways = [
                o.scattering if beam.any() else None
                for o, beam in zip(self.optics(state), beams, strict=True)
            ]
            if any(way is not None for way in ways) and not scene.exterior.glossy:
                self._beams[state] = beam_light(
                    scene.interior, scene.exterior, parts.groups, ways, np.stack(beams),
                    scene.view, subdivision=chosen.subdivision, seed=chosen.seed,
                    scenes=self.traced.scenes,
                )  # fmt: skip
        return self._beams[state]


class PhaseLight:
    """The light of some hours, each window group in a state of its own in each of them.

        E = V T D s                                         three-phase
        E = V T D s - V_d T D_d s_d + C_ds s_sun            five-phase

    with V T D s having the beam that the room reflects at the sun's own angle, as C_ds has it
    (`mitsuba_cfs.phases.sun_beams`).  V_d and D_d are traced with the seed and the samples
    of V and D: they are a part of them, entry by entry, and nothing gets negative.

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase); McNeil and
    Lee 2013, "Annual daylighting performance of a passive optical light shelf" and McNeil 2013,
    "The five-phase method for simulating complex fenestration with Radiance".
    """

    def __init__(self, filled: PhaseSystems, sky: AnnualSky, progress: Progress = silent) -> None:
        """From `PhaseSystems.light`."""
        if filled.traced.five_phase and sky.sun is None:
            raise ValueError("the five-phase method needs the sky's sun")
        self.filled, self.sky, self.progress = filled, sky, progress
        self._traced = filled.traced
        self._last: tuple[bytes, NDArray[np.float64]] | None = None  # of `_of_all`
        self._few: tuple[bytes, dict[tuple[int, int], WindowLight]] = b"", {}  # of the last hours

    @cached_property
    def windows(self) -> list[list[WindowLight]]:
        """Luminance of each part [Q] of the window groups in each of its states, in all hours."""
        return [
            [window_light(self._traced, q, optics, self.sky) for optics in self.filled.systems[g]]
            for q, g in enumerate(self._traced.parts.group)
        ]

    @cached_property
    def sensors(self) -> list[list[SensorLight]]:
        """What each window group gives to the sensors in each of its states."""
        exact = exact_sun(
            self._traced, self.filled.systems, self.sky.direction[self._shining], self.progress
        )
        return [
            [self._sensor_light(g, j, exact) for j in range(len(states))]
            for g, states in enumerate(self.filled.systems)
        ]

    def illuminance(self, state: State | None = None) -> NDArray[np.float64]:
        """Illuminance of the scene's sensors [S, L] [lx]."""
        return self._of_all(state)[: len(self._traced.scene.points)]

    def eye(self, state: State | None = None) -> NDArray[np.float64]:
        """Illuminance at the view's eye [L] [lx]."""
        return self._of_all(state)[-1]

    def direct_sun(self, state: State | None = None) -> NDArray[np.float64] | None:
        """Illuminance of the sensors straight from the sun [S, L] [lx]; None by three phases."""
        groups = self.direct_sun_by_group(state)
        return None if groups is None else sum(groups)

    def direct_sun_by_group(self, state: State | None = None) -> list[NDArray[np.float64]] | None:
        """The same through each window group alone [G][S, L] [lx]."""
        parts = [self._chosen(g, "sun", row) for g, row in enumerate(self._state(state))]
        if parts[0] is None:
            return None
        return [part[: len(self._traced.scene.points)] for part in parts]

    def relative_error(self, state: State | None = None) -> NDArray[np.float64]:
        """Standard error of each sensor's mean over the hours [S], from the tracing.

        That of V, D, B, C_ds, the reflected sun, and W and X of what windows reflect; those of
        different groups and states are taken as independent.  What D as a mean over a part leaves
        is among them (`mitsuba_cfs.methods.subdivision`).
        """
        state = self._state(state)
        variance = matrix_variance(
            self._traced, self.filled.straight, self.sky, state, self._reflected_sun
        )
        for g, row in enumerate(state):
            share = np.bincount(row, minlength=len(self.sensors[g])) / len(row)
            sun = sum(w * s.sun_error for w, s in zip(share, self.sensors[g], strict=True))
            variance = variance + (sun / len(row)) ** 2
        for kind, hours in combinations(state):
            variance = variance + exchange_variance(
                self._traced, self.filled.mirrored, self.filled.optics(kind), self.sky, hours,
                self._reflected_sun,
            )  # fmt: skip
        mean = self._of_all(state).mean(axis=1)
        error = np.divide(np.sqrt(variance), mean, out=np.zeros_like(mean), where=mean > 0)
        return error[: len(self._traced.scene.points)]

    def pictures(
        self, hours: NDArray[np.int64], state: Sequence[int], *, direct: bool = False,
        few: bool = False,
    ) -> Pictures:  # fmt: skip
        """Pictures of some hours [n] with each window group in a state [G].

        Args: direct: no second reflection, for eDGP; few: see `pictures_by_state`.
        """
        traced, sky = self._traced, self.sky
        rows = np.tile(np.asarray(state)[:, None], len(hours))
        matrices, daylight = None if few else traced.view, traced.daylight.values
        if direct:
            matrices, daylight = traced.direct_view, traced.direct_daylight
            T = [o.transmission for o in self.filled.optics(state)]
            luminance = phases.room_side_radiance(T, daylight, sky.whole[:, hours])
        else:
            luminance = self._window_luminance("whole", rows, hours)
            optics, mirrored = self.filled.optics(state), self.filled.mirrored
            if mirrored.reflects_outdoors(optics):
                back = mirrored.returned(optics, self._before(hours)).reshape(luminance.shape)
                luminance = luminance + [
                    o.transmission @ light for o, light in zip(optics, back, strict=True)
                ]
            if mirrored.reflects(optics):
                in_sun = self._in_sun(rows, hours) if traced.five_phase else None
                luminance = luminance + mirrored.windows(optics, luminance, in_sun)
        if matrices is not None and not traced.five_phase:
            found = matrices.three_phase(luminance)
            return found if direct else traced.looked_through(found, sky.whole[:, hours])
        sun, seen = self.filled.seen_sun(tuple(int(j) for j in state))
        five = FivePhasePictures(
            matrices, sun, luminance, self._window_luminance("sun", rows, hours),
            sky.direction[hours], sky.illuminance[hours],
            beam=self._window_luminance("beam", rows, hours),
        )  # fmt: skip
        outdoors = daylight, traced.direct_daylight, sky.without_sun(hours), sky.sun[:, hours]
        five.show_outdoors(seen, *outdoors, light=self.filled.beam_light(tuple(map(int, state))))
        return five if direct or few else traced.looked_through(five, sky.whole[:, hours])

    def _in_sun(self, rows: NDArray[np.int64], hours: NDArray[np.int64]) -> list[NDArray]:
        """The windows' beams [Q, K, h], and what meets them of these from the room [Q * K, h]."""
        sun, suns = self.filled.seen_sun(tuple(map(int, rows[:, 0])))[0], self.sky.direction[hours]
        met = sun.on_elements(self._traced.sun_exchange, suns, self.sky.illuminance[hours])
        return [self._window_luminance("beam", rows, hours), met]

    @cached_property
    def _reflected_sun(self) -> ReflectedSunLight | None:
        """The sun that surfaces reflect; None where the room's mirror it: then by patches."""
        if not self._traced.five_phase or self._traced.scene.interior.glossy:
            return None
        return self.filled.reflected_sun.light(self.sky)

    @cached_property
    def _shining(self) -> NDArray[np.int64]:
        """The hours L in which the sun stands before a window."""
        return shining_hours(self._traced, self.sky)

    def _sensor_light(self, g: int, j: int, exact: list[Estimate | None]) -> SensorLight:
        filled, outdoors = self.filled, g < len(self._traced.scene.outdoor_groups)
        whole = filled.sensors.of_group(g, j)
        if not self._traced.five_phase:
            return SensorLight(whole)
        by_sun, added, error = filled.sensors.by_sun_patches(g, j), None, 0.0
        if self._reflected_sun is None:
            added = self._at_sun(g, j)
        elif outdoors:
            beam = bool(filled.straight.held(g, j).any())
            more = self._reflected_sun.sensors(g, j, beam=beam)
            added, error = more.values, more.sum_error
        sun, shining = np.zeros((len(whole), len(self.sky.lit))), self._shining
        if exact[j] is None:
            return SensorLight(whole, by_sun, added, sun, error)
        luminance = self.sky.illuminance[shining] / SUN_SOLID_ANGLE
        found = exact[j].part(np.s_[g])
        sun[:, shining] = found.values * luminance
        return SensorLight(whole, by_sun, added, sun, np.hypot(error, found.error_of(luminance)))

    def _at_sun(self, g: int, j: int) -> NDArray[np.float64] | None:
        """The beam that the room reflects, at the sun's own angle [S, L]; None without a beam."""
        if not self.filled.straight.held(g, j).any():
            return None
        indirect = self._traced.sensors.values - self._traced.direct_sensors
        parts = self._traced.parts.of(g)
        return sum(indirect[:, q] @ self.windows[q][j].beam_at_sun for q in parts)

    def _of_all(self, state: State | None) -> NDArray[np.float64]:
        """Illuminance of sensors and eye [S + 1, L] by all groups; that of the last state is kept.

        A room's sensors and its eye ask for it one after the other.
        """
        key = self._state(state).tobytes()
        if self._last is None or self._last[0] != key:
            found = self._sum_of_all(state)
            found.flags.writeable = False
            self._last = key, found
        return self._last[1]

    def _sum_of_all(self, state: State | None) -> NDArray[np.float64]:
        rows, eyes = self._state(state), len(self._traced.scene.sensors()[0])
        diffuse = np.zeros((eyes, rows.shape[1]))
        for kind, hours in combinations(rows):
            diffuse[:, hours] = self._diffuse(kind, hours)
        if not self._traced.five_phase:
            return diffuse
        sun = (self._chosen(g, "sun", row) for g, row in enumerate(rows))
        return np.maximum(diffuse, 0.0, out=diffuse) + sum(sun)

    def _diffuse(self, kind: Sequence[int], hours: NDArray[np.int64]) -> NDArray[np.float64]:
        """All but the sun straight [S, h] in hours with each group in a state [G].

        Few sensors before many hours, and the groups as one.
        """
        filled, sky = self.filled.sensors, self._lit(hours)
        chosen = [self.sensors[g][j] for g, j in enumerate(kind)]
        shares, outwards = filled.reflected(self.filled.optics(kind))
        whole = sum(light.whole for light in chosen)
        if shares is not None:
            whole = whole + filled.of_sky(shares)
        # in the sky's single precision: the noise of the sums is ten thousand times its rounding
        found = (whole.astype(sky.dtype) @ sky).astype(float)
        if not self._traced.five_phase:
            return found
        found -= phases.times_sky(sum(light.by_sun for light in chosen), self._lit_sun(hours))
        for light in chosen:
            if light.added is not None:
                found += light.added if self._all(hours) else light.added[:, hours]
        if outwards is not None and self._reflected_sun is not None:
            found += self._reflected_sun.before(outwards, hours)
        return found

    def _before(self, hours: NDArray[np.int64]) -> NDArray[np.float64]:
        """Luminance before the windows [Q * K, h], but for what they send there themselves."""
        daylight = self._traced.daylight.values
        found = daylight.reshape(-1, daylight.shape[2]) @ self._lit(hours)
        if self._reflected_sun is not None:
            found += self._reflected_sun.before(None, hours)
        return found

    def _lit(self, hours: NDArray[np.int64]) -> NDArray[np.floating]:
        """The sky of some of its hours [P, h]; a year's is not copied."""
        return self.sky.whole if self._all(hours) else self.sky.whole[:, hours]

    def _lit_sun(self, hours: NDArray[np.int64]) -> phases.Sky:
        """The sun alone in some of the sky's hours, as products take it."""
        sun = self.sky.lit_sun
        if self._all(hours):
            return sun
        return sun[:, hours] if isinstance(sun, np.ndarray) else sun[hours]

    def _all(self, hours: NDArray[np.int64]) -> bool:
        """Whether they are the sky's hours, each in its place."""
        return np.array_equal(hours, np.arange(len(self.sky.lit)))

    def _chosen(self, g: int, name: str, row: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """What a group gives [S, L] in the state of each hour [L]."""
        states = [getattr(light, name) for light in self.sensors[g]]
        if len(states) == 1 or states[0] is None:
            return states[0]
        found = np.empty_like(states[0])
        for j, values in enumerate(states):
            found[:, row == j] = values[:, row == j]
        return found

    def _window_luminance(
        self, name: str, rows: NDArray[np.int64], hours: NDArray[np.int64] | None = None
    ) -> NDArray[np.float32]:
        """Luminance [Q, K, n] of the windows in some hours [n], in the state [G, n] of each."""
        hours = np.arange(len(self.sky.lit)) if hours is None else hours
        found = []
        for q, g in enumerate(self._traced.parts.group):
            states = np.minimum(rows[g], len(self.filled.systems[g]) - 1)
            values = np.zeros((KLEMS_FULL.size, len(hours)), dtype=np.float32)
            for j in np.unique(states).tolist():
                light = getattr(self._in_hours(q, j, hours), name)
                if light is not None:
                    values[:, states == j] = light[:, states == j]
            found.append(values)
        return np.stack(found)

    def _in_hours(self, q: int, j: int, hours: NDArray[np.int64]) -> WindowLight:
        """Luminance of a part of a window group in a state, in some hours; found again."""
        if "windows" in self.__dict__ or self._all(hours):
            return self.windows[q][j].some(hours)
        if self._few[0] != hours.tobytes():
            self._few = hours.tobytes(), {}
        found, systems = self._few[1], self.filled.systems[self._traced.parts.group[q]]
        if (q, j) not in found:
            found[q, j] = window_light(self._traced, q, systems[j], self.sky.part(hours))
        return found[q, j]

    def _state(self, state: State | None) -> NDArray[np.int64]:
        """The state of each group in each hour [G, L], as far as it has states."""
        systems = self.filled.systems
        rows = hourly_states(state, len(systems), len(self.sky.lit))
        return np.minimum(rows, np.array([[len(states) - 1] for states in systems]))
