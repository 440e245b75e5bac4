"""Inputs and choices of a check against rules."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from scenes.room.options import RoomOptions

OTHER_ALTITUDE_DEG = 13.0  # where a rule has none for the country: the greatest that it has


@dataclass(frozen=True, slots=True)
class ComplyOptions:
    """Inputs and choices of a check against rules."""

    building: Path | None
    weather: Path | None
    standards: tuple[str, ...]  # names of `rules.rule_names`, or rule files
    system: Path | None = None  # of every window in its open state; None: what the file holds
    closed: Path | None = None  # of every window with its blinds closed
    spaces: tuple[str, ...] = ()  # names or GUIDs; none: all
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    uses: Path | None = None  # mapping file of room uses
    day: tuple[int, int] = (3, 21)  # of the sunlight: month and day
    least_altitude_deg: float | None = None  # of the sun; None: the rule's for the country
    eye_height: float = 1.2  # above the floor [m]
    annual_glare: bool = False  # rate every lit hour of each room
    cache: bool = True
    quick: bool = False
    room: RoomOptions = field(default_factory=RoomOptions)  # sampling, hours of use
