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
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import klems_of, through_peak
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup

FIELD = 90.0  # [degrees] from the line of sight, that an eye sees
SKY = ReinhartSky(1)  # directions that stand for the sky
DARKEST = 3.0  # decades
LEAST_BEAM = 1e-3  # share: below it there is none
SCALES = (1.0, 1.0, 0.5, 0.5, 0.25, 0.5)  # of each trait: a difference that large is as good as another


@dataclass(frozen=True, slots=True)
class Traits:
    """The traits of one system in one room under some suns."""

    beam: float  # decades that the straight beam's share lies above `LEAST_BEAM`: 0 to 3
    spread: float  # [rad] that light is turned by, root mean square of what is scattered
    dark: float  # decades that the transmittance of diffuse light lies below 1
    tree: float  # 1: a tensor tree is known; 0: Klems matrices alone
    sun: float  # share of the rated hours whose sun shines in a window of the field of view
    obstruction: float  # share of the sky in front of the windows that is hidden

    def place(self) -> NDArray[np.float64]:
        """The traits over their scales [6]: methods err alike where these lie near."""
        return np.array(astuple(self)) / SCALES


def system_traits(bsdf: Bsdf) -> tuple[float, float, float, float]:
    """Beam, spread, dark and tree of a system, of diffuse light from outdoors."""
    tree = isinstance(bsdf, TensorTreeBsdf)
    klems: KlemsBsdf = klems_of(bsdf)
    basis = klems.basis_in
    omega = basis.projected_solid_angles()
    peak = through_peak(klems.filled().transmission_front, basis, klems.see_through)
    beam, scattered = omega @ peak.transmittance, peak.scattered * omega * omega[:, None]
    whole = beam + scattered.sum()
    if not whole > 0:
        return 0.0, 0.0, DARKEST, float(tree)
    turned = basis.outgoing_directions() @ -basis.incident_directions().T
    angle = np.arccos(np.clip(turned, -1, 1))
    spread = np.sqrt((scattered * angle**2).sum() / max(scattered.sum(), 1e-12 * whole))
    spread = float(spread) if scattered.sum() > 1e-3 * whole else 0.0
    dark = float(min(np.log10(omega.sum() / whole), DARKEST))
    above = float(np.log10(max(beam / whole, LEAST_BEAM) / LEAST_BEAM))
    return above, spread, dark, float(tree)


def sun_in_view(
    groups: Sequence[WindowGroup],
    eye: ArrayLike,
    direction: ArrayLike,
    suns: NDArray[np.float64],
    shining: NDArray[np.bool_],
) -> float:
    """Share of the hours whose sun is visible through a window from the eye.

    Obstructions outdoors are left to `hidden_sky`.

    Args: suns: [H, 3] directions; shining: [H].
    """
    ahead = shining & (suns @ np.asarray(direction, float) > np.cos(np.radians(FIELD)))
    met = np.zeros(len(suns), dtype=bool)
    for group in groups:
        for window in group.windows:
            outward = suns @ window.normal > 0
            met |= outward & _meets(np.asarray(eye, float), suns, window.triangles)
    return float(np.mean(met & ahead)) if len(suns) else 0.0


def hidden_sky(groups: Sequence[WindowGroup], exterior: Surfaces) -> float:
    """Share of the sky that surfaces hide from the windows' middles, by projected solid angle."""
    if not len(exterior.triangles):
        return 0.0
    up = SKY.directions[1:]
    hidden, whole = 0.0, 0.0
    for group in groups:
        for window in group.windows:
            weight = SKY.solid_angles[1:] * np.maximum(up @ window.normal, 0) * window.area
            middle = window.triangles.reshape(-1, 3).mean(axis=0) + 1e-3 * window.normal
            seen = weight > 0
            meets = _meets(middle, up[seen], exterior.triangles)
            hidden, whole = hidden + weight[seen][meets].sum(), whole + weight.sum()
    return float(hidden / whole) if whole > 0 else 0.0


def _meets(start: NDArray[np.float64], ways: NDArray[np.float64], triangles: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether rays from a point along `ways` [N, 3] meet any triangle [T, 3, 3]."""
    a, b, c = (triangles[:, i] for i in range(3))
    first, second, to_start = b - a, c - a, start - a
    meets = np.zeros(len(ways), dtype=bool)
    across = np.cross(to_start, first)
    for i, way in enumerate(ways):
        normal = np.cross(way, second)
        scale = (first * normal).sum(-1)
        flat = np.abs(scale) < 1e-12
        scale = np.where(flat, 1.0, scale)
        u = (to_start * normal).sum(-1) / scale
        v = across @ way / scale
        t = (second * across).sum(-1) / scale
        meets[i] = bool(np.any(~flat & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)))
    return meets


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
            cases = [MeasuredCase(**case | {"traits": Traits(**case["traits"])}) for case in table["cases"]]
            return cls(table["script"], table["made"], tuple(cases))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"is no table of measured errors ({reason(error)})", file=path) from error

    def expected(self, traits: Traits) -> dict[Pair, float]:
        """Expected relative error of DGP of each method and metric."""
        seen, aside = (self._of_hours(replace(traits, sun=sun)) for sun in (1.0, 0.0))
        share = traits.sun
        return {pair: float(np.sqrt(share * seen[pair] ** 2 + (1 - share) * aside[pair] ** 2)) for pair in seen}

    def _of_hours(self, traits: Traits) -> dict[Pair, float]:
        """The expected errors of hours that all have the sun in view, or all have not."""
        cases = [case for case in self.cases if case.traits.sun == traits.sun] or self.cases
        distance = replace(self, cases=tuple(cases)).distances(traits)
        width = max(WIDTH, float(distance.min()))
        weight = np.exp(-0.5 * (distance / width) ** 2)
        result = {}
        for pair in cases[0].errors:
            squares = [max(case.errors[pair], LEAST) ** 2 for case in cases]
            method, metric = pair.rsplit(" ", 1)
            result[method, metric] = float(np.sqrt(weight @ squares / weight.sum()))
        return result

    def of_all(self, traits: Iterable[Traits]) -> dict[Pair, float]:
        """Root mean squares of what is expected of several."""
        each = [self.expected(trait) for trait in traits]
        return {pair: float(np.sqrt(np.mean([e[pair] ** 2 for e in each]))) for pair in each[0]}

    def distances(self, traits: Traits) -> np.ndarray:
        """How far the traits of each case lie [N]."""
        place = traits.place()
        return np.array([np.linalg.norm(case.traits.place() - place) for case in self.cases])

    def origin(self, traits: Iterable[Traits]) -> str:
        """Where the errors come from, in a sentence's part; the nearest case of each."""
        traits = list(traits)
        each = [
            self.distances(replace(trait, sun=sun))
            for trait in traits
            for sun in ([0.0] if trait.sun == 0 else [0.0, 1.0])
        ]
        nearest = [int(np.argmin(distance)) for distance in each]
        far = max(float(distance.min()) for distance in each)
        names = dict.fromkeys(f"{self.cases[i].system} {self.cases[i].room}" for i in sorted(set(nearest)))
        words = ", ".join(list(names)[:3]) + (" and others" if len(names) > 3 else "")
        message = (
            f"errors measured against paths on {self.made} ({self.script}, {len(self.cases)} cases; nearest: {words})"
        )
        return message if far < FAR else f"{message}; NOTHING LIKE IT was measured"


@cache
def measured_errors() -> MeasuredErrors:
    """The table that ships with the program."""
    return MeasuredErrors.read(FILE)
