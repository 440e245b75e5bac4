"""The daylight of a run as a results folder of Ladybug Tools: one grid of sensors for each room.

Source: the folder that `AnnualDaylight` of honeybee-radiance-postprocess 0.5 reads.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bim.names import folder_names
from mitsuba_cfs.files import json_text, write_text
from scenes.results import RunResult

NAME = "ladybug"
TOTAL = Path("__static_apertures__") / "default" / "total"  # of sky and sun, in the states of the year


def write_ladybug(result: RunResult, folder: Path) -> None:
    """Write illuminances [sensors, hours with light], hours of the year, and the list of grids."""
    # room by room: those of a large building are on disk
    lit = np.flatnonzero(np.any([(room.daylight.illuminance > 0).any(axis=1) for room in result.spaces], axis=0))
    hours = lit * (8760 if len(result.times) % 8784 else 8784) / len(result.times)
    (folder / TOTAL).mkdir(parents=True)
    grids = []
    for room, name in zip(result.spaces, folder_names([one.space for one in result.spaces]), strict=True):
        light = room.daylight.illuminance  # [H, S]
        np.save(folder / TOTAL / f"{name}.npy", light[lit].T.astype(np.float32))
        count = light.shape[1]
        grids.append({"name": room.space.label, "identifier": name, "full_id": name, "count": count})
    write_text(folder / "grids_info.json", json_text(grids, indent=2, ensure_ascii=False) + "\n")
    write_text(folder / "sun-up-hours.txt", "\n".join(f"{hour:g}" for hour in hours) + "\n")
