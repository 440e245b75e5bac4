"""A study as a function of its parameters: what the instruments would read.

Temperatures come from the heat balance of `cfs thermal`, light from the phase matrices of the room.
Derivatives of light by reflectances of a box and by the albedo are those of the tracing
(`scenes.room.sensitivities`); all others are central differences, `STEP` prior deviations to either side.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.held_sensors import ModelGrid
from bim.model import Space
from bim.to_tracer import REFLECTANCE_GROUPS
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from scenes.fit.estimate import Prior, Readings
from scenes.fit.fit_file import LIGHT, Fit, MeasurementTable, by_step
from scenes.heat.files import read_files
from scenes.heat.study import balanced_rooms, felt_in, study_inputs
from scenes.heat.study_file import StudyFile
from scenes.inputs import Inputs
from scenes.room.inputs import FileSensors, RoomInputs, room_inputs, skies_for
from scenes.room.light import RoomLight, room_light
from scenes.room.options import SensorGrid
from scenes.room.room import controlled_zone
from scenes.room.sensitivities import light_changes
from scenes.room.solar import seasonal_outdoors
from scenes.room.zone import zone_surfaces

Array = NDArray[np.float64]
STEP = 0.1  # of a prior's deviation: central differences
MOST_KNOWN = 64  # evaluations that are kept
LEAST_OFFSET = 1e-5  # of a light meter whose tracing states no noise
OFF_SURFACE = 0.002  # [m] of a sensor that stands for a surface
LONE = SensorGrid(spacing=1e3)  # the least grid: one sensor of the work plane
# Paths of a light meter and of a window's patches, where the study states none: its noise is the same in all hours
METER_PATHS = {"sensor_samples": 131_072, "patch_samples": 16_384}
ALBEDO = ("albedo", "measured.albedo")
# keys of a box, and the groups of surfaces by which light is derived
OF_GROUPS = {"box.reflectance.floor": "floor", "box.reflectance.wall": "walls", "box.reflectance.ceiling": "ceiling"}
KELVIN_NOISE, LIGHT_NOISE = "temperature", "light"  # groups of instruments with one noise
CORRELATION_H = 12.0  # usual correlation time of errors of temperatures, which last from hours to days


@dataclass(frozen=True, slots=True)
class MeasuredColumn:
    """The readings of an instrument, means of blocks of time steps."""

    table: MeasurementTable
    steps: NDArray[np.int64]  # [n] of the weather, that have a reading
    block: NDArray[np.int64]  # [n] the mean that each belongs to, 0 to B - 1
    values: Array  # [B]
    hours: Array  # [B] middle [h]
    ends: pd.DatetimeIndex  # [B]

    @property
    def light(self) -> bool:
        """Whether it is light."""
        return self.table.quantity in LIGHT

    def means(self, of_steps: Array) -> Array:
        """Means [B] of values of the steps [n]."""
        found: Array = np.bincount(self.block, of_steps) / np.bincount(self.block)
        return found


class FittedModel:
    """What instruments read by parameters of a study; one evaluation is a computation of the study."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        variants.activate()
        self._cache = MatrixCache.of_user()
        study = fit.study_at(fit.mean)
        files = read_files(study, fit.study_file)
        moved = {key for one in fit.tables.parameter for key in one.all_keys}
        self._weather: Weather | None = None
        if not any(key.partition(".")[0] in ("weather", "measured", "heat_island") for key in moved):
            self._weather = files.weather
        self._one_sky = not moved & set(ALBEDO) and not any(key.startswith("trace") for key in moved)
        self._skies: AnnualSky | None = None
        self._known: dict[tuple[float, ...], tuple[Array, Array | None]] = {}
        self.weather = files.weather
        inputs, skies = self._inputs(study)
        self.head = inputs.head
        self._lit = np.zeros(len(files.weather.times), dtype=bool)
        self._lit[skies.lit] = True
        self._read(fit)
        self._derives = len(self._lit_steps) > 0 and study.trace.method != "point-in-time"
        self._engine = _traced_derivatives(fit, study) if self._derives else {}
        self.tracing_error: dict[int, float] = {}  # of each light meter's column: standard error over value

    def of(self, fit: Fit) -> FittedModel:
        """The same model with what it has computed, for other readings at the same times."""
        model = copy(self)
        model._read(fit)
        if any(not np.array_equal(a.steps, b.steps) for a, b in zip(self.columns, model.columns, strict=True)):
            raise ValueError("expected readings at the same times")
        return model

    def _read(self, fit: Fit) -> None:
        """Take the steps and the readings of each column."""
        self.fit = fit
        of_steps = by_step(fit.readings, self.weather)
        self.columns: list[MeasuredColumn] = []
        step_h, times = self.weather.step_h, self.weather.times
        for one in fit.tables.measurement:
            values = of_steps[one.column].to_numpy(dtype=float)
            there = np.isfinite(values) & (self._lit if one.quantity in LIGHT else True)
            steps = np.flatnonzero(there)
            number = np.floor(steps * step_h / max(fit.tables.average_h or 0.0, step_h) + 1e-9)
            block = np.unique(number, return_inverse=True)[1].reshape(-1)
            last = np.flatnonzero(np.diff(block, append=len(block)))
            column = MeasuredColumn(one, steps, block, np.empty(0), np.empty(0), times[steps[last]])
            if len(steps):
                column = replace(
                    column, values=column.means(values[steps]), hours=column.means(step_h * steps.astype(np.float64))
                )
            self.columns.append(column)
        light = [column.steps for column in self.columns if column.light]
        self._lit_steps = np.unique(np.concatenate(light)) if light else np.empty(0, dtype=np.int64)

    def fitted(self) -> list[NDArray[np.bool_]]:
        """Which means of each column are fitted; the others are predicted."""
        tables, times = self.fit.tables, self.weather.times
        begin = times[0] - pd.Timedelta(days=1) if tables.begin is None else pd.Timestamp(tables.begin)
        end = times[-1] if tables.end is None else pd.Timestamp(tables.end)
        return [np.asarray((one.ends > begin) & (one.ends <= end)) for one in self.columns]

    def readings(self) -> list[Readings]:
        """The readings that are fitted."""
        found = []
        for one, fitted in zip(self.columns, self.fitted(), strict=True):
            group, usual = (LIGHT_NOISE, None) if one.light else (KELVIN_NOISE, CORRELATION_H)
            found.append(Readings(one.table.column, one.hours[fitted], one.values[fitted], group, one.light, usual))
        return found

    def prior(self) -> Prior:
        """That of the parameters, then an offset of each light meter: the noise of tracing, the same in all hours."""
        fit, count = self.fit, len(self._meters())
        self.whole_derivatives(fit.mean)
        noise = np.array([max(self.tracing_error.get(at, 0.0), LEAST_OFFSET) for at in self._meters()])
        return Prior(
            np.append(fit.mean, np.zeros(count)),
            np.append(fit.deviation, noise),
            np.append(fit.low, np.full(count, -np.inf)),
            np.append(fit.high, np.full(count, np.inf)),
            np.append(np.zeros(len(fit.mean), dtype=bool), np.ones(count, dtype=bool)),
        )

    def values(self, theta: Array) -> Array:
        """Readings of the fitted means [N] by parameters and offsets."""
        return (self._offset(theta) * self.whole(theta))[self._fitted_rows()]

    def derivatives(self, theta: Array) -> Array:
        """Derivatives of `values` [N, p + meters]."""
        count = len(self.fit.mean)
        slopes = self._offset(theta)[:, None] * self.whole_derivatives(theta)
        of_offsets = self._of_meters() * self.whole(theta)[:, None]
        found: Array = np.hstack([slopes[:, :count], of_offsets])[self._fitted_rows()]
        return found

    def _meters(self) -> list[int]:
        """The columns that are light."""
        return [at for at, one in enumerate(self.columns) if one.light]

    def _of_meters(self) -> Array:
        """Which rows are of which light meter [M, meters], 1 or 0."""
        of_column = np.concatenate([np.full(len(one.values), at) for at, one in enumerate(self.columns)])
        found = np.zeros((len(of_column), len(self._meters())))
        for number, at in enumerate(self._meters()):
            found[:, number] = of_column == at
        return found

    def _offset(self, theta: Array) -> Array:
        offsets: Array = 1.0 + self._of_meters() @ theta[len(self.fit.mean) :]
        return offsets

    def _fitted_rows(self) -> NDArray[np.bool_]:
        return np.concatenate(self.fitted())

    def whole(self, theta: Array) -> Array:
        """Readings of all means that were measured [M], one column after the other, without offsets."""
        return self._at(theta[: len(self.fit.mean)])[0]

    def whole_derivatives(self, theta: Array) -> Array:
        """Derivatives of `whole` [M, p]."""
        fit, theta = self.fit, theta[: len(self.fit.mean)]
        base = self._at(theta, derive=self._derives)[1]
        slopes = np.zeros((len(self.whole(theta)), len(theta)))
        temperature = np.concatenate([np.full(len(one.values), not one.light) for one in self.columns])
        for number, deviation in enumerate(fit.deviation):
            traced = number in self._engine and base is not None
            if traced and base is not None:
                slopes[:, number] = base[:, number]
                if not temperature.any():
                    continue
            ends = np.clip(theta[number] + STEP * deviation * np.array([-1.0, 1.0]), fit.low[number], fit.high[number])
            low, high = (self.whole(_with(theta, number, end)) for end in ends)
            moved = (high - low) / (ends[1] - ends[0])
            slopes[:, number] = np.where(temperature, moved, slopes[:, number]) if traced else moved
        return slopes

    def _inputs(self, study: StudyFile) -> tuple[Inputs, AnnualSky]:
        files = read_files(study, self.fit.study_file, weather=self._weather)
        inputs = study_inputs(study, files)
        if self._skies is not None and self._one_sky:
            return inputs, self._skies
        self._skies = skies_for(inputs.weather, study.options.sampling, self._cache, **study.options.sky)
        return inputs, self._skies

    def _at(self, theta: Array, *, derive: bool = False) -> tuple[Array, Array | None]:
        """Readings [M], and their traced derivatives [M, p] if asked for."""
        key = tuple(float(value) for value in theta)
        known = self._known.get(key)
        if known is not None and (known[1] is not None or not derive):
            return known
        try:
            values, slopes = self._computed(theta, derive)
        except DataError as error:
            pairs = zip(self.fit.tables.parameter, theta, strict=True)
            stated = ", ".join(f"{one.label} {value:.4g}" for one, value in pairs)
            message = f"the study cannot be computed with {stated} (state `low` and `high`): {error}"
            raise DataError(message, file=self.fit.file, field="parameter") from error
        found = np.concatenate(values), np.vstack(slopes) if derive else None
        if len(self._known) > MOST_KNOWN:  # the first are about the priors' means, where every fit begins
            for old in list(self._known)[MOST_KNOWN // 2 :]:
                del self._known[old]
        self._known[key] = found
        return found

    def _computed(self, theta: Array, derive: bool) -> tuple[list[Array], list[Array]]:
        """Readings of each column, and their traced derivatives or zeros."""
        study = self.fit.study_at(theta)
        inputs, skies = self._inputs(study)
        values: list[Array] = [np.empty(0)] * len(self.columns)
        slopes = [np.zeros((len(one.values), len(theta))) for one in self.columns]
        if any(not one.light for one in self.columns):
            self._temperatures(study, inputs, skies, values)
        if len(self._lit_steps):
            part = skies.part(np.flatnonzero(np.isin(skies.lit, self._lit_steps)))
            for space in inputs.spaces:
                self._light(study, inputs, part, space, values, slopes if derive else None)
        return values, slopes

    def _temperatures(self, study: StudyFile, inputs: Inputs, skies: AnnualSky, values: list[Array]) -> None:
        balanced, traced = balanced_rooms(study, inputs, skies, self._cache)
        for space in inputs.spaces:
            number = next(i for i, room in enumerate(balanced.rooms) if room.space.guid == space.guid)
            result = balanced.results[number]
            for at, one in enumerate(self.columns):
                if one.light or self._space_of(inputs, one.table).guid != space.guid:
                    continue
                if one.table.quantity == "operative temperature":
                    zone = balanced.rooms[number].zone
                    result = felt_in(study, zone, result, traced.radiants.get(space.guid))
                    values[at] = one.means(result.operative_c[one.steps])
                else:
                    values[at] = one.means(result.air_c[one.steps])

    def _light(
        self,
        study: StudyFile,
        inputs: Inputs,
        skies: AnnualSky,
        space: Space,
        values: list[Array],
        slopes: list[Array] | None,
    ) -> None:
        own = [
            (at, one)
            for at, one in enumerate(self.columns)
            if one.light and self._space_of(inputs, one.table).guid == space.guid
        ]
        if not own:
            return
        directions = np.array([one.table.direction for _, one in own], dtype=float)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points = np.array([one.table.point for _, one in own], dtype=float)
        faces = [
            _surface(space, point, d) if one.table.quantity == "luminance" else None
            for (_, one), point, d in zip(own, points, directions, strict=True)
        ]
        points = points + OFF_SURFACE * directions * np.array([[face is not None] for face in faces])
        stated = study.trace.model_fields_set
        paths = {name: count for name, count in METER_PATHS.items() if name not in stated}
        options = study.options.changed(sensitivities=slopes is not None, **paths)
        room = room_inputs(
            inputs.building,
            space,
            inputs.systems,
            inputs.weather,
            options,
            operation=study,
            skies=skies,
            cache=self._cache,
            grids=(LONE,),
            file_sensors=FileSensors((ModelGrid("measured", points, directions),)),
        )
        light = room_light(room)
        state = _states(room, light)
        rows = light.states(state)
        lit = illuminance(light.light, rows)
        first = len(lit) - len(own)
        of_step = {int(step): at for at, step in enumerate(skies.lit)}
        changes = {one.key: one for one in light_changes(room, light, state)} if slopes is not None else {}
        for sensor, ((at, one), face) in enumerate(zip(own, faces, strict=True)):
            hours = [of_step[int(step)] for step in one.steps]
            factor = 1.0 if face is None else face[1] / np.pi
            values[at] = one.means(factor * lit[first + sensor, hours])
            if slopes is None:
                continue
            noise = np.abs(changes["tracing"].illuminance[first + sensor]) / np.maximum(lit[first + sensor], 1e-9)
            self.tracing_error.setdefault(at, float(np.median(noise)))
            for number, key in self._engine.items():
                change = changes.get(key)
                if change is None:
                    continue
                slopes[at][:, number] = one.means(factor * change.illuminance[first + sensor, hours])
                if face is not None and key == f"reflectance_{face[0]}":
                    slopes[at][:, number] += one.means(lit[first + sensor, hours] / np.pi)

    def _space_of(self, inputs: Inputs, one: MeasurementTable) -> Space:
        """The room of a measurement.

        Raises: `DataError` where several rooms could be meant, or none.
        """
        if one.room:
            space = inputs.building.room(one.room).space
            if space.guid in {other.guid for other in inputs.spaces}:
                return space
            raise DataError(f"{one.room!r} is not among the study's rooms", file=self.fit.file, field=one.column)
        if len(inputs.spaces) > 1:
            message = f"room: is missing; the study has {', '.join(space.label for space in inputs.spaces)}"
            raise DataError(message, file=self.fit.file, field=f"measurement {one.column}")
        return inputs.spaces[0]


def _states(room: RoomInputs, light: RoomLight) -> NDArray[np.int64]:
    """Shading states of the window groups in all hours [H, G]."""
    if max(len(states) for states in room.windows.systems) == 1:
        return np.zeros((len(room.weather.times), len(room.windows.systems)), dtype=np.int64)
    zone = controlled_zone(room, zone_surfaces(room), seasonal_outdoors(room, light), light)
    states: NDArray[np.int64] = zone.shading.states[:, room.windows.control]
    return states


def _traced_derivatives(fit: Fit, study: StudyFile) -> dict[int, str]:
    """The parameters whose derivatives of light are traced, with their names in the sensitivities."""
    found: dict[int, str] = {}
    box = study.box
    plain = box is not None and not box.recess and not any(window.frame for window in box.window)
    for number, one in enumerate(fit.tables.parameter):
        if one.factor or len(one.all_keys) != 1:
            continue
        (key,) = one.all_keys
        if key in ALBEDO:
            found[number] = "reflectance_ground"
        elif plain and key in OF_GROUPS:
            found[number] = f"reflectance_{OF_GROUPS[key]}"
    return found


def _surface(space: Space, point: Array, direction: Array) -> tuple[str, float]:
    """Group and reflectance of the surface at a point, whose normal into the room is `direction`.

    Raises: `DataError` where no surface is near.
    """
    best, least = None, 0.05  # [m]
    for face in space.faces:
        for triangle in np.asarray(face.triangles, dtype=float):
            a, b, c = triangle
            normal = np.cross(b - a, c - a)
            size = np.linalg.norm(normal)
            if not size or abs(normal @ direction) < 0.9 * size:
                continue
            off = abs((point - a) @ normal) / size
            flat = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), point - a, rcond=None)[0]
            inside = flat.min() > -1e-3 and flat.sum() < 1 + 1e-3
            if inside and off < least:
                best, least = face, off
    if best is None:
        raise DataError(f"no surface of the room is at {np.round(point, 3).tolist()} with this normal", field="point")
    group = next((name for name, kinds in REFLECTANCE_GROUPS.items() if best.kind in kinds), "")
    return group, float(best.reflectance_visible)


def _with(theta: Array, number: int, value: float) -> Array:
    moved = np.array(theta, dtype=float)
    moved[number] = value
    return moved
