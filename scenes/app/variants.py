"""Key figures of the variants side by side, from the table of `cfs study`."""

from __future__ import annotations

import csv
import json
from typing import Any

from scenes.app.project import RESULTS, Project
from scenes.language.catalogue import in_language
from scenes.report.names import quantity

# Columns of `results.csv`; + where more is better, - where less is
FIGURES = {
    "sda300_50": "+", "ase1000_250": "-", "udi_300_3000": "+", "glare_intolerable_h": "-",
    "operative_max_c": "-", "heating_kwh": "-", "cooling_kwh": "-",
    "lighting_kwh": "-",
}  # fmt: skip


def variants(project: Project, language: str = "en") -> dict[str, Any] | None:
    """Rooms by systems with their key figures; None before a comparison.

    Returns: `columns` with label, unit, digits, meaning and which way is better; `rows` with room,
        system, error and values; `quick` and `stale`: whether study file or inputs are newer.
    """
    folder = project.folder / RESULTS / "comparison"
    table = folder / "results.csv"
    if not table.is_file():
        return None
    with table.open(encoding="utf-8", newline="") as file:
        cases = list(csv.DictReader(file))
    shown = [key for key in FIGURES if any(case.get(key) for case in cases)]
    with in_language(language):
        named = [quantity(key) for key in shown]
    record = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    return {
        "columns": [
            {
                "key": key, "label": q.label, "unit": q.unit, "digits": q.digits,
                "meaning": q.meaning, "better": FIGURES[key],
            }
            for key, q in zip(shown, named, strict=True)
        ],
        "rows": [
            {
                "room": case["space"], "system": case["system"], "error": case.get("error", ""),
                "values": [_number(case.get(key, "")) for key in shown],
            }
            for case in cases
        ],
        "quick": bool(record.get("quick")),
    }  # fmt: skip


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
