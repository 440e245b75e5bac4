"""Answers of finished pages, and key figures of the variants side by side (`cfs study`)."""

from __future__ import annotations

import csv
import json
from functools import lru_cache
from html.parser import HTMLParser
from pathlib import Path
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
        system, error and values; `quick`: whether it is a preview.
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


class _Answers(HTMLParser):
    """Collects the paragraphs of class "answer", with which a page of results begins."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[str] = []
        self._within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a paragraph."""
        if tag == "p" and ("class", "answer") in attrs:
            self._within = True
            self.found.append("")

    def handle_endtag(self, tag: str) -> None:
        """End it."""
        self._within = self._within and tag != "p"

    def handle_data(self, data: str) -> None:
        """Add its text."""
        if self._within:
            self.found[-1] += data


HEAD = 400_000  # characters of a page in which its answers are
MOST_ANSWERS = 40


def answers(page: Path) -> tuple[str, ...]:
    """The sentences that a report or dossier begins with."""
    status = page.stat()
    return _answers(page, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=200)
def _answers(page: Path, _time: int, _size: int) -> tuple[str, ...]:
    reader = _Answers()
    with page.open(encoding="utf-8", errors="replace") as file:
        reader.feed(file.read(HEAD))
    texts = (" ".join(text.split()) for text in reader.found[:MOST_ANSWERS])
    return tuple(text for text in texts if text)
