"""Chapter 4 of the dissertation remade: Blackbox against EnergyPlus, 128 cases.

    python -m tests.validation energyplus --reference DIR --epw DIR --out DIR

Climates outside the reference set are run by EnergyPlus here and now (peer program needed):
`--climates Reykjavik Sydney Malaga Lyon --orientations S E N W --no-sensitivity`.  Other closures:
`--closures kuhn typical gap`, see `reference_systems`.

Writes `energyplus.json` (every figure), `cases.csv` (each case) and the figures.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from tests.validation import energyplus_figures, energyplus_sensitivity, reference_systems
from tests.validation.energyplus_cases import ALL_FILES, EPW_FILES, EnergyPlusCase, pairs
from tests.validation.energyplus_statistics import (
    Classification,
    case_row,
    comfort_classification,
    pooled,
    weather_correlations,
)
from tests.validation.reference_room import ORIENTATIONS

CLOSURES = ("kuhn", "linear", "films", "layers")
BANDS = ("ASHRAE 55 90 %", "ASHRAE 55 80 %")


def compare(
    reference: Path, epw: Path, climates: Sequence[str], orientations: Sequence[str], closures: Sequence[str] = CLOSURES
) -> tuple[pd.DataFrame, dict[str, object]]:
    """One row per case and closure, and the correlations and comfort counts."""
    weathers = {name: read_epw(epw / ALL_FILES[name]) for name in climates}
    rows, kept = [], []
    comfort: dict[tuple[str, str, str], Classification] = {}
    for theirs, ours in pairs(reference, epw, closures=closures, climates=climates, orientations=orientations):
        outdoor = weathers[theirs.climate].dry_bulb_c
        for case in ours:
            rows.append(case_row(case, theirs))
            position = "internal" if case.system == "int_shade" else "external or none"
            for band in BANDS:
                key = (case.model, position, band)
                counts = comfort_classification(case, theirs, outdoor, band)
                comfort[key] = comfort[key] + counts if key in comfort else counts
        kept.append((theirs, ours))
    found = {
        "comfort": [_comfort_row(key, counts) for key, counts in comfort.items()],
        "correlations": _correlations(kept, weathers, closures),
    }
    return pd.DataFrame(rows), found


def _comfort_row(key: tuple[str, str, str], counts: Classification) -> dict[str, object]:
    model, position, band = key
    return {
        "model": model,
        "position": position,
        "band": band,
        **asdict(counts),
        "agreement": counts.agreement,
        "true positive rate": counts.true_positive_rate,
        "true negative rate": counts.true_negative_rate,
    }


def _correlations(
    kept: list[tuple[EnergyPlusCase, list[EnergyPlusCase]]], weathers: dict, closures: Sequence[str]
) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    for index, model in enumerate(closures):
        for position in ("external or none", "internal"):
            chosen = [
                (theirs, ours[index])
                for theirs, ours in kept
                if (theirs.system == "int_shade") == (position == "internal")
            ]
            table = weather_correlations([o for _, o in chosen], [t for t, _ in chosen], weathers)
            rows += [{"model": model, "position": position} | r for r in table.to_dict("records")]
    return rows


def study(
    reference: Path,
    epw: Path,
    climates: Sequence[str],
    orientations: Sequence[str],
    *,
    closures: Sequence[str] = CLOSURES,
    sensitivity: bool = True,
) -> tuple[pd.DataFrame, dict[str, object]]:
    """All that the command writes: the cases, and the summary as plain data."""
    cases, summary = compare(reference, epw, climates, orientations, closures)
    for label, by in (("system", "system"), ("orientation", "orientation"), ("climate", "climate")):
        table = pooled(cases, ["model", by]).reset_index()
        summary[f"by {label}"] = table.to_dict("records")
    summary["by position and orientation"] = _by_position(cases, "orientation")
    summary["by position and climate"] = _by_position(cases, "climate")
    summary["pooled"] = pooled(cases, ["model"]).reset_index().to_dict("records")
    if sensitivity:
        kappa = energyplus_sensitivity.kappa_study(reference, epw, climates, orientations)
        wrong = energyplus_sensitivity.measurement_study(reference, epw, climates, orientations)
        summary["kappa"] = kappa.reset_index().to_dict("records")
        summary["measurement"] = wrong.reset_index().to_dict("records")
    return cases, summary


def _by_position(cases: pd.DataFrame, by: str) -> list[dict[str, object]]:
    inside = cases["system"].eq("int_shade")
    marked = cases.assign(position=inside.map({True: "internal", False: "external or none"}))
    return pooled(marked, ["model", "position", by]).reset_index().to_dict("records")


def main(
    *,
    reference: Path,
    epw: Path,
    out: Path,
    climates: Annotated[Sequence[str], ALL_FILES] = tuple(EPW_FILES),
    orientations: Sequence[str] = tuple(ORIENTATIONS),
    closures: Annotated[Sequence[str], reference_systems.CLOSURES] = tuple(CLOSURES),
    no_sensitivity: bool = False,
) -> None:
    """Run the comparison and write its results."""
    start = time.perf_counter()
    cases, summary = study(reference, epw, climates, orientations, closures=closures, sensitivity=not no_sensitivity)
    summary["seconds"] = time.perf_counter() - start
    out.mkdir(parents=True, exist_ok=True)
    cases.to_csv(out / "cases.csv", index=False)
    (out / "energyplus.json").write_text(json.dumps(summary, indent=1))
    energyplus_figures.write_figures(summary, out)
    table = pd.DataFrame(summary["by system"]).round(3).to_string(index=False)
    sys.stdout.write(table + "\n")
