"""Problems in the order of their weight in the result, alike ones counted once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bim.model import Problem

NUMBER = re.compile(r"\d+(?:[.,]\d+)*")
LOST = {"room": 2, "window": 1}


@dataclass(frozen=True, slots=True)
class Ranked:
    """Problems that are alike: how many, how much glass they concern, and the first of them."""

    count: int
    glass: float  # [m2]
    first: Problem

    @property
    def what(self) -> str:
        """What the problem is; of several the first as an example."""
        return self.first.what if self.count == 1 else f"{self.count} times: {self.first.what}"


def ranked(problems: Sequence[Problem]) -> list[Ranked]:
    """Problems by area of glass, then lost rooms and windows, then by number."""
    groups: dict[tuple[str, str, str], list[Problem]] = {}
    for problem in problems:
        groups.setdefault(_kind(problem), []).append(problem)
    found = [
        Ranked(len(g), sum(p.glass for p in g), max(g, key=lambda problem: problem.glass))
        for g in groups.values()
    ]
    return sorted(found, key=lambda r: (-r.glass, -LOST.get(r.first.lost, 0), -r.count))


def _kind(problem: Problem) -> tuple[str, str, str]:
    """What alike problems share: their texts without the element's name and without numbers."""
    if problem.kind:
        return problem.kind, "", problem.lost
    said = problem.what.split(": ", 1)[-1]
    return NUMBER.sub("#", said), NUMBER.sub("#", problem.consequence), problem.lost
