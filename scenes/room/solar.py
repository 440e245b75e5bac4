"""The sun on a room: what its windows let in, and where window layers and surfaces absorb it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bim.outer_faces import OuterFaces
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.gloss import Gloss
from mitsuba_cfs.methods.light import hours_by_season, in_order_of_hours
from mitsuba_cfs.methods.phase_matrices import BATCHES, PhaseMatrices
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.matrices.absorption import absorption_matrix
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from scenes.fenestration.thermal_system import ThermalSystem
from scenes.room.windows import RoomWindows
from thermal.climate import Solar
from thermal.control import switched

FloatArray = NDArray[np.float64]
Gains = dict[str, FloatArray]  # [H] [W] by name: incident_w, transmitted_w, absorbed_..._w


def _of_zone(interior: Surfaces, numbers: NDArray[np.int64]) -> tuple[Gloss | None, ...]:
    """The gloss of the zone's surfaces; none where one is made of faces that differ in it."""
    found: dict[int, set[Gloss | None]] = {}
    for number, face in zip(numbers, interior.surface, strict=True):
        found.setdefault(int(number), set()).add(interior.gloss[face] if interior.gloss else None)
    if not interior.glossy:
        return ()
    alike = {number: kinds.pop() for number, kinds in found.items() if len(kinds) == 1}
    return tuple(alike.get(number) for number in range(int(numbers.max()) + 1))


@dataclass(frozen=True, slots=True)
class SeasonalOutdoors:
    """What stands before a room's windows in each season, in the solar band."""

    scenes: list[PhaseMatrices]  # the same window groups, in the same parts
    season: NDArray[np.int64]  # [L] of each lit hour

    def parts(self) -> list[tuple[PhaseMatrices, NDArray[np.int64]]]:
        """The scene of each season that has some of the lit hours, with these."""
        return hours_by_season(self.scenes, self.season)


class RoomSun:
    """The sun outside a room and what its surfaces do with it, whatever fills the windows.

    Each matrix is traced when it is first asked for.
    """

    def __init__(
        self,
        outdoors: SeasonalOutdoors,
        interior: Surfaces,
        room: ThermalRoom,
        outer: OuterFaces,
        skies: AnnualSky,
        progress: Progress,
    ) -> None:
        """From the windows' groups and what stands before them, and the room, in the solar band."""
        self.seasons, self.outdoors = outdoors, outdoors.scenes[0]
        self.outer, self.skies, self.progress = outer, skies, progress
        self.surfaces = len(room.zone.surfaces)
        # the room's triangles, numbered by the surfaces of the zone
        numbers = room.surface_of_face[interior.surface]
        self.interior = Surfaces(
            interior.triangles, interior.reflectance, numbers, gloss=_of_zone(interior, numbers)
        )
        self._absorbed: dict[bytes, FloatArray] = {}
        self._tracing = {
            "samples": max(self.outdoors.sampling.patch_samples // BATCHES, 1),
            "stopping": Stopping(batches=BATCHES),
            "seed": self.outdoors.sampling.seed,
            "cache": self.outdoors.cache,
        }

    def before_windows(self, shares: FloatArray) -> FloatArray:
        """Sums over the window groups' irradiance by direction [n, L] [W/m2], in lit hours.

        The few sums of D are taken before the many hours, which are multiplied in the skies' single
        precision.

        Args: shares: [n, G, K] of the irradiance of each group from each patch.
        """
        if not self.outdoors.scene.groups:
            return np.zeros((len(shares), len(self.skies.lit)))
        weights = (shares * KLEMS_FULL.projected_solid_angles()).reshape(len(shares), -1)

        def of_season(scene: PhaseMatrices, sky: FloatArray) -> FloatArray:
            daylight = scene.parts.of_groups(scene.daylight.values)
            rows = weights @ daylight.reshape(weights.shape[1], -1)
            return (rows.astype(sky.dtype) @ sky).astype(float)

        return self._by_season(of_season)

    def _by_season(
        self, of_season: Callable[[PhaseMatrices, FloatArray], FloatArray]
    ) -> FloatArray:
        """Values [.., L] of all lit hours, from the scene and the sky [P, l] of each season."""
        parts, sky = self.seasons.parts(), self.skies.solar
        if len(parts) == 1:
            return of_season(parts[0][0], sky)
        return in_order_of_hours(
            [(of_season(scene, sky[:, hours]), hours) for scene, hours in parts]
        )

    @property
    def irradiance(self) -> FloatArray:
        """Irradiance of the window groups [H, G] [W/m2]."""
        groups = len(self.outdoors.scene.groups)
        of_each = np.repeat(np.eye(groups)[..., None], KLEMS_FULL.size, axis=2)
        return self.skies.whole_year(self.before_windows(of_each)).T

    @cached_property
    def facade(self) -> FloatArray:
        """Irradiance on the outside of the zone's surfaces [H, F] [W/m2]."""
        outer, facade = self.outer, np.zeros((self.skies.hours, self.surfaces))
        if len(outer.surfaces):
            lit = self._by_season(lambda scene, sky: self._seen_by_faces(scene) @ sky)
            facade[:, outer.surfaces] = self.skies.whole_year(lit).T
        return facade

    def _seen_by_faces(self, outdoors: PhaseMatrices) -> FloatArray:
        """Irradiance of the outer faces per unit radiance of each sky patch [n, P] [sr]."""
        return sky_irradiance_matrix(
            outdoors.scene.exterior,
            self.outer.points,
            self.outer.normals,
            subdivision=outdoors.sampling.subdivision,
            progress=part(self.progress, 0.4, 0.6),
            **self._tracing,
        ).values

    def absorbed(self, reflectance: FloatArray) -> FloatArray:
        """Where a unit of flux of each window patch is absorbed [G, K, F + G].

        Args: reflectance: [G] of the windows for diffuse light from the room.
        """
        key = reflectance.tobytes()
        if key not in self._absorbed:
            self._absorbed[key] = absorption_matrix(
                self.interior,
                self.outdoors.scene.groups,
                window_reflectance=reflectance,
                progress=part(self.progress, 0.6, 1.0),
                **self._tracing,
            ).values
        return self._absorbed[key]

    def switched(
        self,
        windows: RoomWindows,
        thermals: Sequence[Sequence[ThermalSystem]],
        state: NDArray[np.int64],
    ) -> tuple[Solar, Gains]:
        """The sun absorbed in the state [H] of every hour, and its sums.

        Args: thermals: thermal data of the windows' systems by group and state [G][J].
        """
        suns = [self._of_state(windows, thermals, j) for j in range(windows.states)]
        gains = {
            name: np.stack([sums[name] for _, sums in suns])[state, np.arange(len(state))]
            for name in suns[0][1]
        }
        return switched([solar for solar, _ in suns], state), gains

    def _of_state(
        self, windows: RoomWindows, thermals: Sequence[Sequence[ThermalSystem]], state: int
    ) -> tuple[Solar, Gains]:
        """Sun absorbed by window layers, room surfaces and facades in one state, and its sums."""
        group, F = windows.group, self.facade.shape[1]
        if not len(group):
            dark = np.zeros((self.skies.hours, 0))
            return Solar(dark, dark, np.zeros_like(self.facade), self.facade), {}
        heats = [states[min(state, len(states) - 1)] for states in thermals]
        area = np.array([g.area for g in windows.groups])
        T = np.stack(windows.of_state(state, lambda system: system.solar.transmission_matrix()))
        shares = self._shares(heats, T, area)
        found = np.split(
            self.before_windows(np.concatenate(shares)), np.cumsum([len(s) for s in shares[:-1]])
        )
        taken, outer, inner, whole = (rows.T for rows in found)
        kept = np.array([h.back_absorptance / max(1.0 - h.back_reflectance, 1e-9) for h in heats])

        def year(values: NDArray) -> NDArray:
            return self.skies.whole_year(np.ascontiguousarray(values.T)).T

        solar = Solar(
            absorbed_outer=year(outer[:, group]),
            absorbed_inner=year(inner[:, group]),
            inside=year(taken[:, :F]),
            facade=self.facade,
            window_inside=year((kept * taken[:, F:] / area)[:, group]),
        )
        gains = {
            "incident_w": whole[:, 0],
            "transmitted_w": whole[:, 1],
            "absorbed_outer_w": outer @ area,
            "absorbed_inner_w": inner @ area,
            "absorbed_room_w": taken[:, :F].sum(axis=1),
        }
        return solar, {name: self.skies.whole_year(values) for name, values in gains.items()}

    def _shares(
        self, heats: Sequence[ThermalSystem], transmission: FloatArray, area: FloatArray
    ) -> list[FloatArray]:
        """Of the groups' irradiance by direction [n, G, K], what `before_windows` is asked for.

        What the room's surfaces and windows take [W]; outer and inner layers of each group [W/m2];
        what comes before all windows and what enters [W].
        """
        omega = KLEMS_FULL.projected_solid_angles()
        entering = omega[:, None] * area[:, None, None] * (transmission / omega)  # [G, K, K] [W]
        back = np.array([heat.back_reflectance for heat in heats])
        absorbed = self.absorbed(back).transpose(2, 0, 1)[:, :, None]  # [F + G, G, 1, K]
        each = np.eye(len(area))[..., None]
        outer = each * np.stack([heat.absorptances.outer for heat in heats])
        inner = each * np.stack([heat.absorptances.inner for heat in heats])
        whole = np.stack([np.tile(area[:, None], len(omega)), entering.sum(axis=1)])
        return [(absorbed @ entering)[:, :, 0], outer, inner, whole]
