"""Options of `cfs comply`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from scenes.input_options import InputOptions
from scenes.room.options import RoomOptions

OTHER_ALTITUDE_DEG = 13.0  # where a rule has none for the country: the greatest that it has


@dataclass(frozen=True, slots=True, kw_only=True)
class ComplyOptions(InputOptions):
    """Options of a check against rules; `system` is that of the open state, `operation` moves the blinds."""

    standards: tuple[str, ...]  # names of `rules.rule_names`, or rule files
    room: RoomOptions = field(default_factory=RoomOptions)  # how each room is computed
    closed: Path | None = None  # of every window with its blinds closed
    uses: Path | None = None  # mapping file of room uses
    lamps: Path | None = None  # operation file with the luminaires and colours of rooms
    day: tuple[int, int] = (3, 21)  # of the sunlight: month and day
    least_altitude_deg: float | None = None  # of the sun; None: the rule's for the country
    eye_height: float = 1.2  # above the floor [m], of the view out and of glare
    grid: float | None = None  # [m] spacing of the eyes that glare is rated at; None: one, or `glare_by_map`
    directions: int = 1  # in which each of them looks

    @property
    def glare_by_map(self) -> bool:
        """Whether glare is rated at the worst views of a map, as no seats are stated."""
        return self.grid is None and self.directions == 1
