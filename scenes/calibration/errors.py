"""What errors of DGP to expect of each method and metric, from those measured here against paths.

The table ships with the program and names the script, the date and the cases that it is of: hours
with the sun in view, or without.  What is expected of another room and system is the mean of the
squares of the cases' errors, weighted by how near their traits lie, and of a share s of hours with
the sun in view

    e^2 = s e_sun^2 + (1 - s) e_no_sun^2
    e_sun^2 = sum w e_c^2 / sum w,    w = exp(-(d_c / d)^2 / 2),    d the distance of the nearest
                                                                    case, `WIDTH` at the least

Squares, for a large error nearby is to be feared: by the mean of logarithms one promise in ten that
a system held out would keep an error was broken.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from scenes.calibration.traits import Traits

FILE = Path(__file__).with_name("errors.json")
LEAST = 0.003  # an error below it is the judge's noise, or DGP at its end
WIDTH = 0.5  # of the weights, in scales of the traits
FAR = 2.0  # from the nearest case: nothing like it was measured
Pair = tuple[str, str]  # method and metric


@dataclass(frozen=True, slots=True)
class MeasuredCase:
    """The errors of one system in one room."""

    room: str
    system: str
    traits: Traits
    errors: dict[str, float]  # by "method metric": relative root mean square error of DGP


@dataclass(frozen=True, slots=True)
class MeasuredErrors:
    """The errors of all cases, and where they come from."""

    script: str
    made: str  # date
    cases: tuple[MeasuredCase, ...]

    @classmethod
    def read(cls, path: Path) -> MeasuredErrors:
        """The table of a file; `DataError` where it cannot be read."""
        try:
            table = json.loads(path.read_text(encoding="utf-8"))
            cases = [
                MeasuredCase(**case | {"traits": Traits(**case["traits"])})
                for case in table["cases"]
            ]
            return cls(table["script"], table["made"], tuple(cases))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(
                f"is no table of measured errors ({reason(error)})", file=path
            ) from error

    def expected(self, traits: Traits) -> dict[Pair, float]:
        """Expected relative error of DGP of each method and metric."""
        seen, aside = (self._of_hours(replace(traits, sun=sun)) for sun in (1.0, 0.0))
        share = traits.sun
        return {
            pair: float(np.sqrt(share * seen[pair] ** 2 + (1 - share) * aside[pair] ** 2))
            for pair in seen
        }

    def _of_hours(self, traits: Traits) -> dict[Pair, float]:
        """The expected errors of hours that all have the sun in view, or all have not."""
        cases = [case for case in self.cases if case.traits.sun == traits.sun] or self.cases
        distance = replace(self, cases=tuple(cases)).distances(traits)
        width = max(WIDTH, float(distance.min()))
        weight = np.exp(-0.5 * (distance / width) ** 2)
        found = {}
        for pair in cases[0].errors:
            squares = [max(case.errors[pair], LEAST) ** 2 for case in cases]
            method, metric = pair.rsplit(" ", 1)
            found[method, metric] = float(np.sqrt(weight @ squares / weight.sum()))
        return found

    def of_all(self, traits: Iterable[Traits]) -> dict[Pair, float]:
        """Root mean squares of what is expected of several."""
        each = [self.expected(one) for one in traits]
        return {pair: float(np.sqrt(np.mean([e[pair] ** 2 for e in each]))) for pair in each[0]}

    def distances(self, traits: Traits) -> np.ndarray:
        """How far the traits of each case lie [N]."""
        place = traits.place()
        return np.array([np.linalg.norm(case.traits.place() - place) for case in self.cases])

    def origin(self, traits: Iterable[Traits]) -> str:
        """Where the errors come from, in a sentence's part; the nearest case of each."""
        traits = list(traits)
        each = [
            self.distances(replace(one, sun=sun))
            for one in traits
            for sun in ([0.0] if one.sun == 0 else [0.0, 1.0])
        ]
        nearest = [int(np.argmin(distance)) for distance in each]
        far = max(float(distance.min()) for distance in each)
        names = dict.fromkeys(
            f"{self.cases[i].system} {self.cases[i].room}" for i in sorted(set(nearest))
        )
        words = ", ".join(list(names)[:3]) + (" and others" if len(names) > 3 else "")
        said = (
            f"errors measured against paths on {self.made} ({self.script}, {len(self.cases)} "
            f"cases; nearest: {words})"
        )
        return said if far < FAR else f"{said}; NOTHING LIKE IT was measured"


@cache
def measured_errors() -> MeasuredErrors:
    """The table that ships with the program."""
    return MeasuredErrors.read(FILE)
