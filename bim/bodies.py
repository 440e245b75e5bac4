"""Which bodies a ray goes through, from where to where, as they are drawn in real files.

Bodies that touch have two faces in one place, layers of one element too; some are drawn inside out
and some lack a side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from bim.enclosure import touching_parts
from bim.rays import RayMesh
from mitsuba_cfs.surfaces import area_vectors

SAME_PLACE = 1e-5  # faces nearer than this along a ray are in one place [m]
OPEN = 1e-4  # share of a closed part's area that its faces may fail to cancel by
THINNEST = 5e-4  # what a ray is in for less is grazed [m]

Face = tuple[float, int, bool]  # distance along the ray [m], triangle, whether it leads into a body


@dataclass(frozen=True, slots=True)
class Part:
    """One body of an element that a ray goes through."""

    item: int  # number of the body's representation item in the file
    start: float  # [m]
    stop: float  # infinite where the ray does not come out within its reach
    triangle: int  # first triangle met, index into the mesh


@dataclass(frozen=True, slots=True)
class Span:
    """One element that a ray goes through, its bodies that touch as one."""

    element: int
    start: float  # [m]
    stop: float  # infinite where the ray does not come out within its reach
    triangle: int  # first triangle met, index into the mesh
    parts: tuple[Part, ...]  # by where the ray enters them

    def endless(self) -> Span:
        """The same as one that the ray does not come out of."""
        return replace(self, stop=np.inf, parts=(*self.parts[:-1], replace(self.parts[-1], stop=np.inf)))

    def since(self, start: float) -> Span:
        """The part from a distance on [m]."""
        parts = tuple(Part(p.item, max(p.start, start), p.stop, p.triangle) for p in self.parts if p.stop > start)
        return Span(self.element, start, self.stop, self.triangle, parts)

    def moved(self, by: float) -> Span:
        """The same, all distances less by that [m]."""
        parts = tuple(Part(p.item, p.start - by, p.stop - by, p.triangle) for p in self.parts)
        return Span(self.element, self.start - by, self.stop - by, self.triangle, parts)


@dataclass(frozen=True, slots=True)
class Bodies:
    """The triangles of many elements, those of one element in a row."""

    mesh: RayMesh
    element: NDArray[np.int64]  # [N] element of each triangle, rising
    item: NDArray[np.int64]  # [N] representation item of each triangle
    # [N] whether a triangle is of a closed body that is drawn inside out
    turned: NDArray[np.bool_] = field(init=False)
    vectors: NDArray[np.float64] = field(init=False)  # [N, 3] area vectors [m2]

    def __post_init__(self) -> None:
        body = self.element * (self.item.max(initial=0) + 1) + self.item  # bodies that touch share corners
        object.__setattr__(self, "turned", _inside_out(self.mesh.triangles, body))
        object.__setattr__(self, "vectors", area_vectors(self.mesh.triangles))

    def along(self, origin: NDArray[np.float64], direction: NDArray[np.float64], reach: float) -> list[Span]:
        """The elements that a ray is in within its reach [m], by where it enters them.

        Where a side of a body is not drawn, it begins or ends where its triangles do, if that is
        within reach.
        """
        distance, hit = self.mesh.all_hits(origin, direction, reach)
        into = self.vectors[hit] @ direction < 0
        met: dict[int, dict[int, list[Face]]] = {}  # by element and item
        faces = zip(distance.tolist(), hit.tolist(), into.tolist(), strict=True)
        for number, item, face in zip(self.element[hit].tolist(), self.item[hit].tolist(), faces, strict=True):
            met.setdefault(number, {}).setdefault(item, []).append(face)
        spans: list[Span] = []
        for number in sorted(met):
            parts: list[Part] = []
            for item in sorted(met[number]):
                of_body = met[number][item]
                distinct = _distinct(of_body)
                if _depths(distinct)[0] > 0:  # the ray begins inside, or the body is inside out
                    distinct = _distinct([(at, k, inwards ^ bool(self.turned[k])) for at, k, inwards in of_body])
                parts += self._parts(number, item, distinct, origin, direction, reach=reach)
            spans += _joined(number, parts)
        return sorted(spans, key=lambda span: (span.start, span.stop))

    def _parts(
        self,
        number: int,
        item: int,
        faces: Sequence[Face],
        origin: NDArray[np.float64],
        direction: NDArray[np.float64],
        *,
        reach: float,
    ) -> Iterator[Part]:
        """Where a ray is in one body, or in bodies that are one item of the file."""
        depths = _depths(faces)
        first, start, far = faces[0][1], 0.0, np.inf
        if depths[0] > 0 or depths[-1] > 0:
            first_row, last_row = self._rows(number)
            own = self.item[first_row:last_row] == item
            corners = self.mesh.triangles[first_row:last_row][own].reshape(-1, 3)
            along = (corners - origin) @ direction
            start, far = max(start, float(along.min())), float(along.max())
        for before, after, (distance, triangle, _) in zip(depths, depths[1:], faces, strict=False):
            if before == 0:
                first, start = triangle, distance
            elif after == 0 and distance - start > THINNEST:
                yield Part(item, start, distance, first)
        if depths[-1] > 0:
            yield Part(item, start, far if far <= reach else np.inf, first)

    def _rows(self, number: int) -> tuple[int, int]:
        """The first of an element's triangles, and the first of the next's."""
        first, last = np.searchsorted(self.element, [number, number + 1]).tolist()
        return first, last


def _joined(number: int, parts: list[Part]) -> list[Span]:
    """An element's bodies along a ray as one where they touch."""
    spans: list[Span] = []
    for part in sorted(parts, key=lambda part: (part.start, part.stop)):
        if spans and part.start - spans[-1].stop <= SAME_PLACE:
            before = spans.pop()
            stop, with_it = max(before.stop, part.stop), (*before.parts, part)
            spans.append(replace(before, stop=stop, parts=with_it))
        else:
            spans.append(Span(number, part.start, part.stop, part.triangle, (part,)))
    return spans


def _distinct(faces: Sequence[Face]) -> list[Face]:
    """Faces of one body along a ray, those in one place once each way, the way in first."""
    kept: dict[tuple[int, bool], Face] = {}
    place, before = 0, faces[0][0]
    for face in faces:
        place += face[0] - before > SAME_PLACE
        before = face[0]
        kept.setdefault((place, not face[2]), face)
    return [kept[key] for key in sorted(kept)]


def _depths(faces: Sequence[Face]) -> list[int]:
    """In how many bodies of an element a ray is, before the first face and after each."""
    steps = list(accumulate((1 if into else -1 for _, _, into in faces), initial=0))
    least = min(steps)
    return [step - least for step in steps]


def _inside_out(triangles: NDArray[np.float64], body: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether each triangle [N, 3, 3] of a body [N] is of a closed part of it whose normals point inwards [N]."""
    part, vectors = touching_parts(triangles, body), area_vectors(triangles)

    def sums(values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sums [parts, k] of values [N, k]."""
        return np.stack([np.bincount(part, column) for column in values.T], axis=1)

    areas = sums(np.linalg.norm(vectors, axis=1, keepdims=True))[:, 0]
    is_closed = np.linalg.norm(sums(vectors), axis=1) < OPEN * areas
    middle = sums(triangles.mean(axis=1)) / np.bincount(part)[:, None]
    # a . (b x c) / 6 of each tetrahedron with the middle
    volume = sums(np.einsum("ij,ij->i", triangles[:, 0] - middle[part], vectors)[:, None])[:, 0] / 3
    return (is_closed & (volume < 0))[part]
