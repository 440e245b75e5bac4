"""Results of each room: arrays and tables, before files and figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.report.issue import Issue
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.glare.classes import LIMITS, hour_not_exceeded
from mitsuba_cfs.images.view import View
from mitsuba_cfs.notes import Note
from scenes.fenestration.peaks import lobe_notes
from scenes.head import NO_HEAD, Head

if TYPE_CHECKING:
    from bim.energyplus_twin import EnergyPlusTwin
    from mitsuba_cfs.picture_year.year import PictureYear

# Columns with three phases, see `mitsuba_cfs.methods.sun_by_patches`
SUNNY_HOUR_ERROR = "sunny_hour_error"  # [%] of sensors
DGP_SUNNY_HOUR_ERROR = "dgp_sunny_hour_error"  # of pictures and hours


def day_numbers(times: pd.DatetimeIndex) -> NDArray[np.int64]:
    """Number of the day of each interval [H], from its middle."""
    numbers: NDArray[np.int64] = pd.factorize(times.normalize())[0].astype(np.int64)
    return numbers


@dataclass(frozen=True, slots=True)
class LuminancePicture:
    """A fisheye luminance picture of one hour, and its glare."""

    hour: int  # index into the times of the result
    luminance: NDArray[np.float32]  # [ny, nx] [cd/m2]
    # dgp, dgp_standard_error, ev [lx], dgi, ugr, vcp, cgi, sources (a count)
    glare: dict[str, float]
    # the pixels of all glare sources; [n, ny, nx] masks of each would be large
    source_mask: NDArray[np.bool_] | None = None  # [ny, nx]


MAP_ERROR = 0.03  # of the DGP of a glare map, see docs/evidence_glare.md


@dataclass(frozen=True, slots=True)
class GlareMap:
    """DGP of seated eyes over a room in several directions, with the shading of each hour.

    By `mitsuba_cfs.methods.glare_map`, without pictures.  Hours are those of use; in the dark DGP is 0.
    """

    eyes: NDArray[np.float64]  # [E, 3] [m]
    directions: NDArray[np.float64]  # [N, 3] unit vectors, the same at each eye
    shares: NDArray[np.float64]  # [3, E, N] of the hours of use above each of `LIMITS`, 0 to 1
    not_exceeded: NDArray[np.float64]  # [E, N] DGP that is exceeded in at most 5 % of them
    spacing: float  # of the eyes [m]
    hours_of_use: float  # of a year [h]

    @classmethod
    def of(
        cls,
        eyes: NDArray[np.float64],
        directions: NDArray[np.float64],
        dgp: NDArray[np.float32],
        *,
        spacing: float,
        step_h: float,
    ) -> GlareMap:
        """From the DGP of the hours of use [E, N, U]."""
        shares = np.stack([np.mean(dgp > limit, axis=2) for limit in LIMITS])
        exceeded = np.apply_along_axis(hour_not_exceeded, 2, dgp)
        return cls(eyes, directions, shares, exceeded, spacing, step_h * dgp.shape[2])

    def moved(self, shift: NDArray[np.float64]) -> GlareMap:
        """The map of an equal room elsewhere."""
        return replace(self, eyes=self.eyes + shift)

    def worst(self, count: int = 1) -> list[tuple[int, int]]:
        """Eyes and directions with most glare, the worst first.

        By the DGP exceeded in 5 % of the hours of use; of equal ones, as where DGP is 1, by the share
        of the hours above the highest limit.
        """
        order = np.lexsort([-self.shares[-1].ravel(), -self.not_exceeded.ravel()])
        eye, direction = np.unravel_index(order[:count], self.not_exceeded.shape)
        return list(zip(eye.tolist(), direction.tolist(), strict=True))

    def table(self) -> pd.DataFrame:
        """One row for each eye and direction: hours of use above each limit, and the DGP exceeded in 5 %."""
        eye, direction = (a.ravel() for a in np.indices(self.not_exceeded.shape))
        point, way = self.eyes[eye], self.directions[direction]
        columns: dict[str, NDArray[Any]] = {"eye": eye + 1}
        columns |= dict(zip("xyz", point.T, strict=True))
        columns["direction_deg"] = np.degrees(np.arctan2(way[:, 0], way[:, 1])) % 360  # from north by east
        for limit, share in zip(LIMITS, self.shares, strict=True):
            columns[f"hours_above_{limit:.2f}"] = self.hours_of_use * share.ravel()
        columns["hours_of_use"] = np.full(len(eye), self.hours_of_use)
        columns["dgp_exceeded_in_5_percent"] = self.not_exceeded.ravel()
        return pd.DataFrame(columns)


@dataclass(frozen=True, slots=True)
class ColourPicture:
    """One of the luminance pictures in colour."""

    hour: int  # index into the times of the result
    radiance: NDArray[np.float32]  # [ny, nx, 3] linear sRGB [W/m2/sr]


@dataclass(frozen=True, slots=True)
class GridDaylight:
    """Daylight of a sensor grid of the building's file."""

    name: str
    directions: NDArray[np.float64]  # [S, 3] of its sensors
    sensor_metrics: pd.DataFrame  # columns of `DaylightResult`, and relative_standard_error
    metrics: dict[str, float]  # of the grid, by the names of a room's


@dataclass(frozen=True, slots=True)
class DaylightResult:
    """Work-plane illuminance of a year and its metrics."""

    points: NDArray[np.float64]  # [S, 3] sensors [m]
    illuminance: NDArray[np.float32]  # [H, S] [lx]
    relative_error: NDArray[np.float64]  # [S] standard error of the annual mean, from the tracing
    sensor_metrics: pd.DataFrame  # by sensor: x, y, z, da300, cda300, udi..., daylight_factor
    room_metrics: dict[str, float]  # sda, ase, en17037..., by name; percentages as 0..100
    grids: tuple[GridDaylight, ...] = ()  # of the building's file, besides the work plane

    @property
    def sda(self) -> float:
        """Spatial daylight autonomy sDA300/50% (LM-83) [%]."""
        return float(self.room_metrics["sda300_50"])

    @property
    def da(self) -> float:
        """Daylight autonomy at 300 lx, the mean of the sensors [%]."""
        return float(self.room_metrics["da300"])

    @property
    def ase(self) -> float | None:
        """Annual sunlight exposure ASE1000/250h (LM-83) [%]; None with the three-phase method."""
        share = self.room_metrics.get("ase1000_250")
        return None if share is None else float(share)


@dataclass(frozen=True, slots=True)
class GlareResults:
    """Pictures of the chosen hours from one view point."""

    view: View
    pictures: tuple[LuminancePicture, ...]
    rule: str = ""  # for recognising glare sources
    colour: ColourPicture | None = None  # of the hour with the most light at the eye

    @property
    def worst(self) -> float:
        """The highest DGP of the pictures.

        Raises: `ValueError` without pictures.
        """
        if not self.pictures:
            raise ValueError("no picture was made, so none is the worst")
        return max(picture.glare["dgp"] for picture in self.pictures)


MELANOPIC_BY_DAY = 250.0  # [lx] melanopic EDI at the eye: Brown et al. 2022, CIE PS 001:2024


@dataclass(frozen=True, slots=True)
class SpectralYear:
    """Daylight of a year by wavelength: alpha-opic quantities of CIE S 026 and colour.

    The eye is that of the glare view; its other directions are turned anticlockwise by the degrees
    in their names.
    """

    edges_nm: tuple[float, ...]  # [C + 1] of the bands
    # [H] index time: melanopic_edi_lx, melanopic_der, photopic_lx, *_irradiance_mw_m2, cct_k, duv,
    # melanopic_edi_90_lx, ...; NaN in the dark where a ratio is not defined
    eye: pd.DataFrame
    melanopic: NDArray[np.float32]  # [H, S] melanopic EDI of the work plane's sensors [lx]
    sensor_metrics: pd.DataFrame  # by sensor: melanopic_edi_mean_lx, melanopic_der, ...
    spectrum: NDArray[np.float32]  # [H, C] irradiance of the eye in each band [W/m2]
    summary: dict[str, float]  # of the year, by name
    notes: tuple[str, ...] = ()  # assumptions


@dataclass(frozen=True, slots=True)
class ThermalResult:
    """Temperatures of a year and adaptive comfort."""

    temperatures: pd.DataFrame  # [H] index time: outdoor_c, air_c, mrt_c, operative_c, surfaces...
    gains: pd.DataFrame  # [H] index time: incident_w, transmitted_w, absorbed_outer_w, ...
    comfort: pd.DataFrame  # [H] index time: occupied, comfort_c, within_80, within_90, ... (bool)
    comfort_summary: dict[str, float]  # by name; percentages as 0..100
    # by system: name; u_value, g_value, transmittances, ... at normal incidence
    fenestration: tuple[dict[str, float | str], ...]
    issues: tuple[Issue, ...] = ()  # of the heat balance

    @property
    def air_c(self) -> pd.Series:
        """Temperature of the air of every hour [H] [degC]."""
        return self.temperatures["air_c"]

    @property
    def operative_c(self) -> pd.Series:
        """Operative temperature of every hour [H] [degC]."""
        return self.temperatures["operative_c"]

    @property
    def comfortable(self) -> float:
        """Share of the occupied hours within the 80 % limits of ASHRAE 55 [%]."""
        return float(self.comfort_summary["within_80"])


@dataclass(frozen=True, slots=True)
class ShadingYear:
    """Shading states of a year of the groups of windows that move together (axis N)."""

    groups: tuple[str, ...]  # [N] names
    rules: tuple[str, ...]  # [N] of the control
    states: NDArray[np.int64]  # [H, N]
    number: NDArray[np.int64]  # [W] group of each window of the room
    # [H, N] number of the reason of each move, -1 without; None: of a function or a plan
    moved_by: NDArray[np.int64] | None = None
    reasons: tuple[str, ...] = ()
    views: tuple[NDArray[np.bool_], ...] = ()  # [N][J] whether one sees through in each state

    @property
    def columns(self) -> dict[str, NDArray[np.int64]]:
        """Columns [H] of tables: shading_state, with several groups one for each."""
        if len(self.groups) < 2:
            dark = np.zeros(len(self.states), dtype=np.int64)  # a room without windows
            return {"shading_state": self.states[:, 0] if self.groups else dark}
        names = [f"shading_state_{name.replace(' ', '_')}" for name in self.groups]
        return dict(zip(names, self.states.T, strict=True))

    @property
    def of_windows(self) -> NDArray[np.int64]:
        """The state of each window [H, W]."""
        return self.states[:, self.number]

    def figures(self, occupied: NDArray[np.bool_], times: pd.DatetimeIndex) -> pd.DataFrame:
        """By group: its rule, moves a day, hours with a view out, and hours by state.

        Shares of the hours in which the room is occupied [%]; a view: at least half of the light
        of normal incidence that passes goes straight on.

        Args: occupied: [H]; times: [H] middle of each interval.
        """
        per_day = pd.Timedelta(days=1) / (times[1] - times[0])
        moved = np.diff(self.states, axis=0) != 0
        used = self.states[occupied]
        table = {
            "group": self.groups,
            "rule": self.rules,
            "moves_per_day": moved.sum(axis=0) * per_day / max(len(self.states), 1),
            "most_moves_of_a_day": self.moves_of_days(times).max(axis=0, initial=0),
        }
        if self.views:
            table["view_h"] = [
                np.count_nonzero(view[np.minimum(used[:, c], len(view) - 1)]) * 24.0 / per_day
                for c, view in enumerate(self.views)
            ]
        for state in range(int(self.states.max(initial=0)) + 1):
            share = (used == state).sum(axis=0) / max(len(used), 1)
            table[f"state_{state}_percent"] = 100.0 * share
        return pd.DataFrame(table)

    def moves_of_days(self, times: pd.DatetimeIndex) -> NDArray[np.int64]:
        """Moves of each group in each day [D, N].

        Args: times: [H] middle of each interval.
        """
        moved = np.concatenate([np.zeros_like(self.states[:1]), np.diff(self.states, axis=0)]) != 0
        starts = np.unique(day_numbers(times), return_index=True)[1]
        counts: NDArray[np.int64] = np.add.reduceat(moved.astype(np.int64), starts, axis=0)
        return counts

    def moves(self, times: pd.DatetimeIndex) -> pd.DataFrame:
        """One row for each move: time, group, rule, state before and after."""
        rows, columns = np.nonzero(np.diff(self.states, axis=0))
        return pd.DataFrame(
            {
                "time": times[rows + 1],
                "group": [self.groups[c] for c in columns],
                "rule": [self.rules[c] for c in columns],
                "moved_by": [self._reason(h + 1, c) for h, c in zip(rows.tolist(), columns.tolist(), strict=True)],
                "from_state": self.states[rows, columns],
                "to_state": self.states[rows + 1, columns],
            }
        )

    def _reason(self, hour: int, group: int) -> str:
        """The condition that moved a group in an hour."""
        number = -1 if self.moved_by is None else int(self.moved_by[hour, group])
        return self.rules[group] if number < 0 else self.reasons[number]

    def moves_by_reason(self) -> dict[str, NDArray[np.int64]]:
        """Moves of a year by each condition [N], the most frequent first."""
        counts: dict[str, NDArray[np.int64]] = {}
        for hour, group in np.argwhere(np.diff(self.states, axis=0)).tolist():
            none = np.zeros(len(self.groups), dtype=np.int64)
            counts.setdefault(self._reason(hour + 1, group), none)[group] += 1
        return dict(sorted(counts.items(), key=lambda item: -int(item[1].sum())))


@dataclass(frozen=True, slots=True)
class OperationResult:
    """Shading states, heating, cooling and lamps of an operated room."""

    states: tuple[str, ...]  # names of the shading states, from open to closed
    # [H] index time: columns of `ShadingYear`, heating_w, cooling_w, lighting_w
    hours: pd.DataFrame
    summary: dict[str, float]  # heating_kwh, cooling_kwh, lighting_kwh, peaks
    shading: ShadingYear


@dataclass(frozen=True, slots=True)
class ExploredColour:
    """Colours of a room's pictures, part by part, and its melanopic light.

    A tint is linear sRGB over luminance, then the melanopic DER [4]; colours are balanced: grey
    under the hour's daylight on a horizontal plane outdoors is (1, 1, 1). DER is not.
    """

    pixels: tuple[NDArray[np.float32], ...]  # [J][n, 4] tint of what each pixel shows, under white light
    indoors: NDArray[np.float32]  # [J, L, 4] of the light at the eye, for what the room reflects
    sky: NDArray[np.float32]  # [L, 4] of the sky, for what is seen through windows
    sun: NDArray[np.float32]  # [J, L, 4] of the sun's beam indoors
    melanopic: tuple[NDArray[np.float32], ...]  # [J] melanopic EDI of the sensors [S, L] [lx]
    eye: NDArray[np.float32]  # [J, L] melanopic EDI of the eye [lx]


@dataclass(frozen=True, slots=True)
class ExploredRoom:
    """A room in every lit hour and every combination of shading states, for the explorer.

    The combinations J are all windows in each state, then those of the operated year in which
    groups of windows are in different states.
    """

    states: tuple[str, ...]  # [J] names, from open to closed
    operated: NDArray[np.int64]  # [H] combination of each hour of the year
    lit: NDArray[np.int64]  # [L] hours of the year with the sun up
    pictures: tuple[PictureYear, ...]  # [J]
    illuminance: tuple[NDArray[np.float32], ...]  # [J] of the sensors [S, L] [lx]
    eye: NDArray[np.float32]  # [J, L] vertical illuminance [lx]
    through: NDArray[np.float32]  # [J, G, L] transmittance of each window group's straight beam
    sun_illuminance: NDArray[np.float32]  # [L] normal to the beam [lx]
    windows: tuple[NDArray[np.float64], ...]  # [G] triangles [T, 3, 3] of each group [m]
    colour: ExploredColour | None = None  # of runs by wavelength


@dataclass(frozen=True, slots=True)
class Bands:
    """Bands of a room's figures, and how likely it meets rules."""

    figures: pd.DataFrame  # figure, unit, value, p5, median, p95, decided_by, decided_percent
    verdicts: pd.DataFrame  # rule, met, met_percent, decided_by, decided_percent


@dataclass(frozen=True, slots=True, repr=False)
class RoomYear:
    """The year of one room: its daylight, glare, heat and operation."""

    space: Space
    daylight: DaylightResult
    glare: GlareResults
    heat: ThermalResult
    seconds: dict[str, float]  # by stage
    operation: OperationResult | None = None  # None: first shading state all year, floating freely
    annual_glare: pd.DataFrame | None = None  # [H] index time: dgp, ev, ...; NaN in the dark
    spectral: SpectralYear | None = None  # of `spectral`
    # of `sensitivities`, a row for each input and figure, see `scenes.room.sensitivities`
    sensitivities: pd.DataFrame | None = None
    bands: Bands | None = None  # of `bands`
    dgp: AnnualGlare | None = None  # [n] by the metric and in the hours of `rate`
    dgp_sunny_hour_error: float = 0.0  # of three-phase `dgp`
    as_lobe: dict[str, float] = field(default_factory=dict)  # of `scenes.room.lobes`
    issues: tuple[Issue, ...] = ()  # of the traced model
    explored: ExploredRoom | None = None  # for the explorer
    glare_map: GlareMap | None = None  # of a year of glare
    template: str = ""  # name of the equal room that was computed; "": this room
    borrowed: str = ""  # note on the daylight through inner glass; "": none

    @property
    def hours(self) -> pd.DataFrame:
        """Every hour [H]: mean illuminance [lx], temperatures [degC], gains [W], comfort.

        With an operation also shading state and loads, with annual glare also the ratings.
        """
        heat = self.heat
        mean = self.daylight.illuminance.mean(axis=1, dtype=float)
        light = pd.DataFrame({"illuminance_lx": mean}, index=heat.temperatures.index)
        tables = [light, heat.temperatures, heat.gains, heat.comfort]
        if self.operation is not None:
            tables.append(self.operation.hours)
        if self.annual_glare is not None:
            tables.append(self.annual_glare)
        if self.spectral is not None:
            tables.append(self.spectral.eye)
        return pd.concat(tables, axis=1).rename_axis("time")

    @property
    def melanopic(self) -> pd.DataFrame:
        """Melanopic EDI [lx], DER and colour of the light at the eye in every hour [H].

        Raises: `ValueError` for a year that was not computed by wavelength.
        """
        if self.spectral is None:
            raise ValueError("the year was not computed by wavelength: simulate(..., spectral=True)")
        return self.spectral.eye

    def __repr__(self) -> str:
        operative = self.heat.operative_c
        figures = [f"DA {self.daylight.da:.0f} %", f"operative {operative.min():.1f} to {operative.max():.1f} degC"]
        if self.glare.pictures:
            figures.insert(1, f"worst DGP {self.glare.worst:.2f}")
        return f"<{type(self).__name__} {self.space.label!r}: {', '.join(figures)}>"


@dataclass(frozen=True, slots=True, repr=False)
class RunResult:
    """A run: the building, the years of its rooms, notes and manifest."""

    building: Building
    times: pd.DatetimeIndex  # [H] middle of each interval, local standard time
    sun: NDArray[np.float64]  # [H, 3] direction to the sun
    spaces: Sequence[RoomYear]
    issues: tuple[Issue, ...]
    manifest: dict[str, Any]  # of run.json: inputs with hashes, options, versions, seed, timings
    notes: tuple[str, ...] = field(default=())  # sentences for the head of the results
    method: str = "three-phase"  # one of mitsuba_cfs.methods.METHODS
    head: Head = NO_HEAD  # what was left out, what was assumed
    twin: EnergyPlusTwin | None = None  # the rooms as an EnergyPlus model, where it was asked for

    def __repr__(self) -> str:
        return f"<RunResult {self.building.name!r}: {len(self.spaces)} rooms, {self.method}>"


def method_figures(room: RoomYear) -> dict[str, float]:
    """What the method and undecided transmission peaks do to a room's results."""
    figures, table = dict(room.as_lobe), room.daylight.sensor_metrics
    if SUNNY_HOUR_ERROR in table:
        figures[f"{SUNNY_HOUR_ERROR}_mean"] = float(table[SUNNY_HOUR_ERROR].mean())
        figures[f"{SUNNY_HOUR_ERROR}_max"] = float(table[SUNNY_HOUR_ERROR].max())
    glare = [picture.glare.get(DGP_SUNNY_HOUR_ERROR, 0.0) for picture in room.glare.pictures]
    if room.annual_glare is not None and DGP_SUNNY_HOUR_ERROR in room.annual_glare:
        glare.append(float(room.annual_glare[DGP_SUNNY_HOUR_ERROR].max()))
    glare.append(room.dgp_sunny_hour_error)
    if max(glare):
        figures[DGP_SUNNY_HOUR_ERROR] = max(glare)
    return figures


def method_notes(figures: Iterable[Mapping[str, Any]]) -> tuple[str, ...]:
    """Sentences on `method_figures` of several rooms, cases or views; none without any."""
    figures, notes = list(figures), []
    lit = [one for one in figures if f"{SUNNY_HOUR_ERROR}_max" in one]
    if lit:
        notes.append(
            Note(
                "The three-phase method blurs the sun: in hours with sun on the windows the "
                "illuminance of a sensor deviates by {mean:.0f} % on average, {worst:.0f} % at "
                "most, from that with the sun at its true position (root mean square of a sample "
                "of these hours, relative to their mean illuminance).",
                mean=float(np.mean([one[f"{SUNNY_HOUR_ERROR}_mean"] for one in lit])),
                worst=max(one[f"{SUNNY_HOUR_ERROR}_max"] for one in lit),
            )
        )
    error = max((one.get(DGP_SUNNY_HOUR_ERROR, 0.0) for one in figures), default=0.0)
    if error:
        notes.append(
            Note(
                "The three-phase method blurs the sun: in hours with sun on the windows DGP "
                "deviates by {error:.3f} from that with the sun at its true position (root mean "
                "square of a sample of these hours).",
                error=error,
            )
        )
    return (*notes, *lobe_notes(figures))


def sensor_table(values: NDArray[np.float32], times: pd.DatetimeIndex) -> pd.DataFrame:
    """Values of sensors [H, S] with the sensors' numbers as columns."""
    columns = [f"sensor_{i}" for i in range(values.shape[1])]
    return pd.DataFrame(values, index=times, columns=columns).rename_axis("time")


def glare_table(result: GlareResults, times: pd.DatetimeIndex) -> pd.DataFrame:
    """One row for each picture: its time and glare."""
    rows = [{"time": times[p.hour], **p.glare} for p in result.pictures]
    return pd.DataFrame(rows).set_index("time")
