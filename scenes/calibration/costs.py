"""Costs of the methods as measured on one machine, kept in a file, and what they predict."""

from __future__ import annotations

import json
import os
import platform
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import default_folder

FILE = "calibration.json"


@dataclass(frozen=True, slots=True)
class Cost:
    """Seconds of one method for one metric."""

    scene: float  # once for each room [s]
    system: float  # once for each fenestration system in a room [s]
    step: float  # for each time step of a system in a room [s]

    def __post_init__(self) -> None:
        if min(self.scene, self.system, self.step) < 0:
            raise ValueError(f"a cost must not be negative: {self}")


@dataclass(frozen=True, slots=True)
class Work:
    """How much there is to compute."""

    scenes: int  # rooms
    systems: int  # in each of them
    steps: int  # time steps for each system in a room, orientations and climates among them

    def seconds(self, cost: Cost) -> float:
        """Predicted time: scene + systems + steps, each as often as it comes [s]."""
        pairs = self.scenes * self.systems
        return self.scenes * cost.scene + pairs * cost.system + pairs * self.steps * cost.step


@dataclass(frozen=True, slots=True)
class Calibration:
    """The costs of one machine."""

    machine: str
    made: str  # date and time
    picture_size: int  # pixels of a side of the pictures that were rated
    costs: Mapping[tuple[str, str], Cost]  # by method and metric

    def scaled(self, pixels: int) -> Calibration:
        """The costs for another picture size: those of pictures grow with the pixels."""
        factor = (pixels / self.picture_size) ** 2
        costs = {
            (method, metric): Cost(factor * c.scene, factor * c.system, factor * c.step)
            if metric in ("DGP", "eDGP")
            else c
            for (method, metric), c in self.costs.items()
        }
        return Calibration(self.machine, self.made, pixels, costs)

    def write(self, path: Path) -> None:
        """Keep it; the file is the old one or the new one at any time."""
        table = {
            "machine": self.machine,
            "made": self.made,
            "picture_size": self.picture_size,
            "costs": [
                {"method": method, "metric": metric, **asdict(cost)}
                for (method, metric), cost in self.costs.items()
            ],
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".json")
        with open(handle, "w", encoding="utf-8") as file:
            json.dump(table, file, indent=2)
            file.write("\n")
        os.replace(part, path)

    @classmethod
    def read(cls, path: Path) -> Calibration:
        """The calibration of a file.

        Raises: `DataError` where there is none, or none that can be read.
        """
        try:
            table = json.loads(path.read_text(encoding="utf-8"))
            costs = {
                (c["method"], c["metric"]): Cost(c["scene"], c["system"], c["step"])
                for c in table["costs"]
            }
            return cls(table["machine"], table["made"], int(table["picture_size"]), costs)
        except FileNotFoundError:
            raise DataError("is not there: run `cfs calibrate` first", file=path) from None
        except (ValueError, KeyError, TypeError) as error:
            raise DataError(
                f"is no calibration ({error}): run `cfs calibrate`", file=path
            ) from error


def calibration_file() -> Path:
    """Where `cfs calibrate` keeps this machine's costs: in the user's cache folder."""
    return default_folder() / FILE


def machine_name() -> str:
    """This machine: processor and number of cores."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(s.partition(":")[2].strip() for s in lines if s.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return f"{name}, {os.cpu_count()} cores"
