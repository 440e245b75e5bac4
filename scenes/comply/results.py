"""What a check against rules yields, before any page or file is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.report.issue import Issue
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.assess import BuildingVerdict, RoomVerdict
from scenes.comply.findings import Calendar, SeatGlare
from scenes.comply.needs import Need
from scenes.comply.rules import RuleTable
from scenes.comply.sunlight import SunDay, SunExposure
from scenes.comply.uses import RoomUse
from scenes.comply.view_out import ViewOut
from scenes.head import Head

FloatArray = NDArray[np.float64]
ONE_STATE = Note("windows in their only state")  # where no blind moves


@dataclass(frozen=True, slots=True)
class GridSummary:
    """What drawings show of the light on a rule's grid; the year itself is not kept."""

    points: FloatArray  # [S, 3] [m]
    factor: FloatArray  # [S] daylight factor, 0 to 1
    autonomy: FloatArray  # [S] share of LM-83's hours with 300 lx, as operated where that is known
    sunlit_hours: FloatArray  # [S] [h] of LM-83's with 1000 lx of direct sun, blinds open
    half_time: FloatArray  # [S] [lx] reached in half of EN 17037's daylight hours, blinds open
    closed: FloatArray | None = None  # [G] share of LM-83's hours with closed blinds, by group
    view_free: tuple[float, float] | None = None  # shares of them: some windows free, all free


@dataclass(frozen=True, slots=True)
class RoomLights:
    """The light of a room on the grid of each rule: values of the needs, and drawings."""

    space: Space
    grids: Mapping[str, GridSummary]  # by rule
    values: Mapping[str, Mapping[Need, float | None]]  # by rule
    groups: tuple[str, ...] = ()  # names of the window groups
    glare: SeatGlare | None = None
    template: str = ""  # name of the equal room that was computed; "": this one


@dataclass(frozen=True, slots=True)
class CheckedRoom:
    """A room against all rules, with what the drawings show."""

    space: Space
    use: RoomUse
    verdicts: tuple[RoomVerdict, ...]
    view: ViewOut | None  # None: no window
    sun: SunExposure | None
    light: RoomLights | None


@dataclass(frozen=True, slots=True)
class Compliance:
    """A building against rules."""

    building: Building
    rules: Mapping[str, RuleTable]
    rooms: tuple[CheckedRoom, ...]
    verdicts: tuple[BuildingVerdict, ...]
    calendar: Calendar
    weather: Weather
    day: SunDay
    assumptions: tuple[str, ...]  # sentences
    head: Head  # what was left out of the model, what was assumed of it
    notes: tuple[str, ...]
    issues: tuple[Issue, ...]
    seconds: dict[str, float]  # by part
    blinds: str = ""  # how they move where glare, temperatures and light at the eye are judged, in words
    settings: tuple[str, ...] = ()  # sentences: numerical settings, and classes of systems that no verdict rests on
