"""Costs of the methods as measured on one machine, kept in a file, and what they predict."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, write_text
from mitsuba_cfs.matrices.cache import default_folder
from scenes.cost.measure import Cost

FILE = "calibration.json"
GLARE, PICTURED = ("DGP", "eDGP", "sDGP"), ("DGP", "eDGP")
HEAT = ("any method", "heat")  # gains, temperatures and comfort of a room


@dataclass(frozen=True, slots=True)
class Workload:
    """How much there is to compute."""

    scenes: int  # rooms
    systems: int  # in each of them
    steps: int  # whose glare is rated, for each system in a room; orientations, climates among them
    lit: int = 0  # whose illuminance is computed: all with the sun up


@dataclass(frozen=True, slots=True)
class Calibration:
    """The costs of one machine."""

    machine: str
    made: str  # date and time
    picture_size: int  # pixels of a side of the pictures that were rated
    costs: tuple[Cost, ...]  # of methods and metrics; of a room's heat as `HEAT`
    origin: str = "costs measured on this machine by `cfs calibrate`"

    def pairs(self) -> list[tuple[str, str]]:
        """Methods and glare metrics that were measured."""
        return [(c.method, c.metric) for c in self.costs if c.metric in GLARE]

    def seconds(self, method: str, metric: str, work: Workload) -> float:
        """Predicted time of a study: glare, illuminance by the same method, and heat [s]."""
        total = 0.0
        parts = ((method, metric, work.steps), (method, "illuminance", work.lit), (*HEAT, work.lit))
        for name, what, steps in parts:
            cost = self._cost(name, what)
            if cost is not None:
                total += cost.seconds(steps, systems=work.systems, scenes=work.scenes)
        return total

    def _cost(self, method: str, metric: str) -> Cost | None:
        return next((c for c in self.costs if (c.method, c.metric) == (method, metric)), None)

    def scaled(self, pixels: int) -> Calibration:
        """The costs for another picture size: those of pictures grow with the pixels."""
        factor = (pixels / self.picture_size) ** 2
        costs = tuple(
            replace(c, per_scene=factor * c.per_scene, per_system=factor * c.per_system, per_step=factor * c.per_step)
            if c.metric in PICTURED
            else c
            for c in self.costs
        )
        return replace(self, picture_size=pixels, costs=costs)

    def write(self, path: Path) -> None:
        """Keep it; the file is the old one or the new one at any time."""
        table = asdict(self)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json_text(table, indent=2) + "\n")

    @classmethod
    def of(cls, table: dict[str, Any]) -> Calibration:
        """The calibration that `dataclasses.asdict` made a table of."""
        costs = tuple(Cost(**record) for record in table["costs"])
        return cls(**table | {"costs": costs})

    @classmethod
    def read(cls, path: Path) -> Calibration:
        """The calibration of a file.

        Raises: `DataError` where there is none, or none that can be read.
        """
        try:
            return cls.of(json.loads(path.read_text(encoding="utf-8")))
        except FileNotFoundError:
            raise DataError("is not there: run `cfs calibrate` first", file=path) from None
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            message = f"is no calibration ({error}): delete it, or run `cfs calibrate`"
            raise DataError(message, file=path) from error


def calibration_file() -> Path:
    """Where `cfs calibrate` keeps this machine's costs: in the user's cache folder."""
    return default_folder() / FILE


def machine_name() -> str:
    """Processor and number of cores of this machine."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(s.partition(":")[2].strip() for s in lines if s.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return f"{name}, {os.cpu_count()} cores"
