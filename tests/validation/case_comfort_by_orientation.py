"""Chapter 5.2: comfortable hours by the orientation of a room, external blinds at 55 degrees.

    python -m tests.validation case_comfort_by_orientation --weather LYON.epw --out DIR

The room of chapter 5 (4 m x 5 m x 3 m, half of the facade glazed) with the walls, gains and air of
Table 15, without heating or cooling; the demo's blind at 55 degrees before double low-e glazing.
Adaptive comfort of ASHRAE 55 from 8 to 18 h, every day of the year (Figure 69).

Writes `comfort_by_orientation.csv` and `.png`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs import variants
from scenes.heat.study import ThermalYear, run_study
from scenes.heat.study_file import StudyFile
from tests.validation.reference_room import EXTERIOR_FINISH, FINISH, INSULATION, MASSIVE, MASSIVE_THIN, ORIENTATIONS
from tests.validation.systems import blind_before_glazing
from thermal.zone import Layer

TILT_DEG = 55.0
HOURS = (8, 18)
BANDS = {"80 %": "ASHRAE 55 80 %", "90 %": "ASHRAE 55 90 %"}
WINDOW = {"x": 0.0, "sill": 0.9, "width": 4.0, "height": 1.5}  # half of 4 m x 3 m


def study(weather: Path, bsdf: Path, facing_deg: float, samples: int) -> StudyFile:
    """The study file of the room facing one way."""

    def layers(*stack: Layer) -> list[dict[str, float]]:
        return [
            {
                "thickness": s.thickness,
                "conductivity": s.conductivity,
                "density": s.density,
                "heat_capacity": s.heat_capacity,
            }
            for s in stack
        ]

    inner, slab = layers(FINISH, MASSIVE_THIN, FINISH), layers(FINISH, MASSIVE, FINISH)
    front = layers(EXTERIOR_FINISH, INSULATION, MASSIVE, FINISH)
    sides = ("back", "left", "right")
    return StudyFile.model_validate(
        {
            "weather": weather,
            "box": {
                "width": 4.0,
                "depth": 5.0,
                "height": 3.0,
                "facing_deg": facing_deg,
                "window": [WINDOW],
                "adjacency": dict.fromkeys((*sides, "floor", "ceiling"), "adiabatic"),
                "construction": {"front": front, "floor": slab, "ceiling": slab} | dict.fromkeys(sides, inner),
            },
            "system": [{"bsdf": bsdf}],
            "gains": {"equipment_w_m2": 8.0, "persons": 1.0, "occupied": HOURS},
            "comfort": {"mean_radiant": "room centre"},
            "trace": {"patch_samples": samples, "sensor_samples": samples},
        }
    )


def shares(year: ThermalYear) -> dict[str, float]:
    """Percent of the hours from 8 to 18 that are comfortable; degree hours beyond the 80 % band."""
    hours = 365 * (HOURS[1] - HOURS[0])
    summary = year.summary
    found = {f"comfortable {name}": 100 * summary[f"comfortable_h {band}"] / hours for name, band in BANDS.items()}
    for side in ("warm", "cold"):
        found[f"degree hours {side}"] = summary[f"degree_hours_{side} {BANDS['80 %']}"]
    return found | {"operative max": summary["operative_max_c"]}


def compare(weather: Path, out: Path, *, samples: int = 4096) -> pd.DataFrame:
    """One row per orientation."""
    variants.activate()
    bsdf = blind_before_glazing(out, TILT_DEG)
    rows = []
    for name, facing in ORIENTATIONS.items():
        (year,), _ = run_study(study(weather, bsdf, facing, samples), lambda label, share: None)
        rows.append({"orientation": name, "facing": facing} | shares(year))
    return pd.DataFrame(rows).sort_values("facing").reset_index(drop=True)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Bars of both bands by orientation, clockwise from north."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    at = np.arange(len(table))
    for shift, name, colour in ((-0.2, "80 %", "#4878a8"), (0.2, "90 %", "#a8c4e0")):
        values = table[f"comfortable {name}"]
        bars = axes.bar(at + shift, values, 0.38, color=colour, label=f"{name} acceptability")
        axes.bar_label(bars, fmt="%.1f", fontsize=8, padding=2)
    axes.set_xticks(at, table["orientation"])
    axes.set_ylabel("comfortable hours, 8 to 18 h [%]")
    axes.set_ylim(0, 1.2 * table[[f"comfortable {n}" for n in BANDS]].to_numpy().max())
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, ncols=2, loc="upper right")
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main(*, weather: Path, out: Path, samples: int = 4096) -> pd.DataFrame:
    """Run the eight orientations and write table and figure."""
    out.mkdir(parents=True, exist_ok=True)
    table = compare(weather, out, samples=samples)
    table.round(3).to_csv(out / "comfort_by_orientation.csv", index=False)
    draw(table, out / "comfort_by_orientation.png")
    return table.round(1)
