"""View: eye, direction of each pixel of its picture, and Radiance's syntax.

Pictures are arrays [ny, nx]; row 0 is the top, column 0 the left of the picture.  Image coordinates
(x to the right, y up) run from 0 to 1 over the picture; pixel (row, column) has its centre at
x = (column + 1/2)/nx, y = 1 - (row + 1/2)/ny.

Source: Radiance `rpict` manual (view options) and the projection formulas of its `image.c` (facts).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import check_number

KINDS = {
    "v": "perspective",
    "l": "parallel",
    "c": "cylindrical",
    "h": "hemispherical",
    "a": "angular",
    "s": "planispheric",
}
LETTERS = {kind: letter for letter, kind in KINDS.items()}
MOST_SHIFT = 1000.0  # of a picture, in its own sizes
WIDEST_DEG = {"perspective": 180, "hemispherical": 180, "angular": 360, "planispheric": 360}

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class View:
    """Projection of a picture.  Hashable; vectors are stored as tuples of three numbers."""

    kind: str = "perspective"
    position: Triple = (0.0, 0.0, 0.0)  # [3] eye [m]
    direction: Triple = (0.0, 1.0, 0.0)  # [3] unit, line of sight
    up: Triple = (0.0, 0.0, 1.0)  # [3] unit, not parallel to `direction`
    horizontal_deg: float = 45.0
    vertical_deg: float = 45.0
    width: int = 800  # [px]
    height: int = 800  # [px]
    shift: float = 0.0  # of the picture to the right, in picture widths
    lift: float = 0.0  # of the picture upwards, in picture heights
    fore: float = 0.0  # [m] clipping plane, kept for the header only
    aft: float = 0.0  # [m] clipping plane, kept for the header only

    def __post_init__(self) -> None:
        if self.kind not in LETTERS:
            raise ValueError(f"view kind {self.kind!r}: expected one of {', '.join(LETTERS)}")
        direction, up = _unit(self.direction, "direction"), _unit(self.up, "up")
        if np.linalg.norm(np.cross(direction, up)) < 1e-9:
            raise ValueError("the view's up vector is parallel to its direction")
        object.__setattr__(self, "position", _triple(self.position, "position"))
        object.__setattr__(self, "direction", _triple(direction, "direction"))
        object.__setattr__(self, "up", _triple(up, "up"))
        if self.width < 1 or self.height < 1:
            raise ValueError(f"a picture of {self.width} x {self.height} pixels")
        if not max(abs(self.shift), abs(self.lift)) <= MOST_SHIFT:
            raise ValueError(f"a view shifted by {self.shift:g}, {self.lift:g} pictures")
        widest = WIDEST_DEG.get(self.kind, np.inf)
        open_end = self.kind in ("perspective", "planispheric")
        for name in ("horizontal_deg", "vertical_deg"):
            size = float(getattr(self, name))
            object.__setattr__(self, name, size)
            if not 0 < size <= widest or (open_end and size == widest):
                raise ValueError(f"{self.kind} view with {name} {size:g}: illegal size")

    @property
    def is_fisheye(self) -> bool:
        """Whether equal angles, or equal projected areas, have equal sizes in the picture."""
        return self.kind in ("angular", "hemispherical")

    @property
    def covers_hemisphere(self) -> bool:
        """Whether it is a fisheye of at least the hemisphere, which glare evaluation needs."""
        return self.is_fisheye and min(self.horizontal_deg, self.vertical_deg) >= 180

    @property
    def is_disc(self) -> bool:
        """Whether it is a fisheye of exactly the hemisphere, whose picture is a disc."""
        return self.is_fisheye and self.horizontal_deg == self.vertical_deg == 180


def _triple(vector: ArrayLike, name: str) -> Triple:
    vector = np.asarray(vector, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise ValueError(f"the view's {name} is not three numbers")
    x, y, z = map(float, vector)
    return x, y, z


def _unit(vector: ArrayLike, name: str) -> NDArray[np.float64]:
    """A vector scaled to length 1 with Radiance's arithmetic, so that rays agree to the last bit.

    Whether the square of a ray comes out above 1 by rounding decides how evalglare groups pixels.
    """
    x, y, z = _triple(vector, name)
    square = x * x + (y * y + z * z)
    if square == 0:
        raise ValueError(f"the view's {name} has no length")
    scale = 2.0 - (square + 1.0) * 0.5 if abs(square - 1) <= 1e-6 else 1.0 / np.sqrt(square)
    return np.array([x * scale, y * scale, z * scale])


def fisheye(position: ArrayLike, direction: ArrayLike, size: int = 800, **changes: Any) -> View:
    """Upright 180 degree angular fisheye (`-vta -vh 180 -vv 180`) for glare evaluation."""
    check_number("size", size, 1, whole=True)
    eye, towards = _triple(position, "position"), _triple(direction, "direction")
    plain = View("angular", eye, towards, (0, 0, 1), 180, 180, size, size)
    return replace(plain, **changes)


def fitted(view: View, size: int) -> View:
    """The view with square pixels, `size` of them along its longer side."""
    half_x, half_y = _half_sizes(view)
    lengths = {
        "perspective": (np.tan(half_x), np.tan(half_y)),
        "parallel": (view.horizontal_deg, view.vertical_deg),  # which are lengths [m]
        "cylindrical": (half_x, np.tan(half_y)),
        "hemispherical": (np.sin(half_x), np.sin(half_y)),
        "angular": (half_x, half_y),
        "planispheric": (np.tan(half_x / 2), np.tan(half_y / 2)),
    }[view.kind]
    width, height = (max(1, round(size * a / max(lengths))) for a in lengths)
    return replace(view, width=width, height=height)


@lru_cache(maxsize=8)  # rays are computed some at a time
def frame(view: View) -> NDArray[np.float64]:
    """Rows right, up, forward [3, 3] of the picture in the world; not to be written to."""
    forward = np.asarray(view.direction)
    right = _unit(np.cross(forward, view.up), "direction across")
    rows = np.stack([right, np.cross(right, forward), forward])
    rows.flags.writeable = False
    return rows


def rays(view: View, x: ArrayLike, y: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    """Unit vectors [..., 3] at image coordinates x, y [...] in 0..1, and whether they exist.

    Returns:
        directions [..., 3] in the world, zero where the projection has none; exists [...] bool.
    """
    x, y = np.asarray(x, float) + (view.shift - 0.5), np.asarray(y, float) + (view.lift - 0.5)
    shape = np.broadcast_shapes(x.shape, y.shape)
    sideways, upwards, forwards, exists, scales = _PROJECTIONS[view.kind](view, x, y)
    right, up, forward = frame(view)
    directions = np.empty((*shape, 3))
    for axis in range(3):  # in this order the sums have Radiance's rounding
        part = sideways * (right[axis] * scales[0]) + upwards * (up[axis] * scales[1])
        directions[..., axis] = part + forwards * forward[axis]
    if view.kind in ("perspective", "cylindrical"):
        directions /= np.sqrt(np.einsum("...k,...k->...", directions, directions))[..., None]
    exists = np.broadcast_to(exists, shape)
    if not exists.all():
        directions.reshape(-1, 3)[np.flatnonzero(~exists)] = 0.0  # faster than by a mask
    return directions, exists


def pixel_rays(
    view: View, pixels: NDArray[np.int64], across: ArrayLike, down: ArrayLike
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Unit vectors [..., 3] through points in pixels, and whether they exist, as `rays`.

    Args: pixels: [...] row * width + column; across, down: [...] from their left, top corner, 0..1.
    """
    row = pixels // view.width
    x = (pixels - row * view.width + np.asarray(across, float)) / view.width
    return rays(view, x, 1.0 - (row + np.asarray(down, float)) / view.height)


# Projections: coordinates x, y from the centre to the parts of the ray along right, up and forward,
# where there is one, and the lengths of right and up.  Their results need only broadcast.


def _half_sizes(view: View) -> tuple[float, float]:
    return np.radians(view.horizontal_deg) / 2, np.radians(view.vertical_deg) / 2


# Direction x, y, z of the points of a picture, whether they are in the view, width and height
Projected = tuple[Any, Any, Any, Any, tuple[float, float]]


def _perspective(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    half_x, half_y = _half_sizes(view)
    scales = (2 * np.tan(half_x), 2 * np.tan(half_y))
    return x, y, 1.0, True, scales


def _parallel(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    return 0.0, 0.0, 1.0, True, (1.0, 1.0)


def _cylindrical(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    azimuth, (_, half_y) = x * np.radians(view.horizontal_deg), _half_sizes(view)
    scales = (1.0, 2 * np.tan(half_y))
    return np.sin(azimuth), y, np.cos(azimuth), True, scales


def _hemispherical(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    # The largest number below 1 for the sine of a right angle, as in Radiance's vector arithmetic:
    # corners of pixels on the rim (3-4-5 triangles) then exist, and rays agree to the last bit.
    below = np.nextafter(1.0, 0.0)
    across, along = (2 * np.minimum(np.sin(half), below) for half in _half_sizes(view))
    square = x * x * (across * across) + y * y * (along * along)
    return x, y, np.sqrt(np.maximum(1.0 - square, 0.0)), square <= 1.0, (across, along)


def _angular(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    x = x * ((1.0 / 180.0) * view.horizontal_deg)
    y = y * ((1.0 / 180.0) * view.vertical_deg)
    square = x * x + y * y
    half_turns = np.sqrt(square)
    forwards = np.cos(np.pi * half_turns)
    scale = np.sqrt(1.0 - forwards * forwards)
    away = half_turns > 1e-6
    scale = np.divide(scale, half_turns, where=away, out=np.full_like(scale, np.pi))
    return x * scale, y * scale, forwards, square <= 1.0, (1.0, 1.0)


def _planispheric(view: View, x: NDArray[Any], y: NDArray[Any]) -> Projected:
    half_x, half_y = _half_sizes(view)
    x, y = x * 2 * np.tan(half_x / 2), y * 2 * np.tan(half_y / 2)
    square = x * x + y * y
    forwards = (1.0 - square) / (1.0 + square)
    return x * (1.0 + forwards), y * (1.0 + forwards), forwards, True, (1.0, 1.0)


_PROJECTIONS = {
    "perspective": _perspective,
    "parallel": _parallel,
    "cylindrical": _cylindrical,
    "hemispherical": _hemispherical,
    "angular": _angular,
    "planispheric": _planispheric,
}


def pixel_directions(view: View) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Unit vectors [ny, nx, 3] through the pixels' centres, and the pixels [ny, nx] that count.

    A pixel counts where the projection has a ray and, for an angular fisheye, where that ray does
    not point behind the eye (a 180 degree angular fisheye has rays up to 127 degrees in its
    corners, which no glare index uses).
    """
    x = (np.arange(view.width) + 0.5) / view.width
    y = (np.arange(view.height)[::-1] + 0.5) / view.height
    directions, counts = rays(view, x[None, :], y[:, None])
    if view.kind == "angular":
        counts = counts & (directions @ np.asarray(view.direction) >= 0.0)
    return directions, counts


def pixel_solid_angles(view: View) -> NDArray[np.float64]:
    """Solid angle [ny, nx] [sr] of the spherical quadrilateral between each pixel's four corners.

    omega = (sum of the four angles between the planes through neighbouring sides) - 2 pi;
    0 where one of the corners has no ray (outer rim of a hemispherical picture).

    Returns: not to be written to: it is that of all views of one projection.
    """
    return _pixel_solid_angles(replace(view, position=(0, 0, 0), direction=(0, 1, 0), up=(0, 0, 1), fore=0, aft=0))


@lru_cache(maxsize=2)
def _pixel_solid_angles(view: View) -> NDArray[np.float64]:
    x = np.arange(view.width + 1) / view.width
    y = np.arange(view.height + 1)[::-1] / view.height
    if view.shift or view.lift:
        angles = _solid_angles(view, x, y)
    else:
        rows, columns = (view.height + 1) // 2, (view.width + 1) // 2
        quarter = _solid_angles(view, x[: columns + 1], y[: rows + 1])
        left = np.concatenate([quarter, quarter[: view.height // 2][::-1]])
        angles = np.concatenate([left, left[:, : view.width // 2][:, ::-1]], axis=1)
    angles.flags.writeable = False
    return angles


def _solid_angles(view: View, x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.float64]:
    """Solid angles between lines x [n] from left to right and y [m] from top to bottom."""
    corners, exists = rays(view, x[None, :], y[:, None])
    along = _unit_or_zero(_cross(corners[:, :-1], corners[:, 1:]))  # [m, n-1, 3] rightwards
    across = _unit_or_zero(_cross(corners[1:], corners[:-1]))  # [m-1, n, 3] upwards
    left, right, top, bottom = across[:, :-1], across[:, 1:], along[:-1], along[1:]
    omega = np.full(left.shape[:2], 2 * np.pi)
    for one, other in ((left, top), (top, -right), (right, bottom), (bottom, -left)):
        cosine = np.einsum("ijk,ijk->ij", one, other)
        omega -= np.arccos(np.clip(cosine, -1.0, 1.0))
    whole = exists[:-1, :-1] & exists[:-1, 1:] & exists[1:, :-1] & exists[1:, 1:]
    return np.where(whole & (omega > 0), omega, 0.0)


def _cross(one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Cross product [..., 3]: half the time of NumPy's for long arrays."""
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    d, e, f = other[..., 0], other[..., 1], other[..., 2]
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=-1)


def _unit_or_zero(vectors: NDArray[Any]) -> NDArray[Any]:
    length = np.sqrt(np.einsum("...k,...k->...", vectors, vectors))[..., None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


_SIZES = {"h": "horizontal_deg", "v": "vertical_deg", "s": "shift", "l": "lift", "o": "fore", "a": "aft"}
_VECTORS = {"p": "position", "d": "direction", "u": "up"}


def view_changes(text: str) -> dict[str, Any]:
    """The fields of `View` that a line in Radiance's view syntax sets; unknown words are left."""
    words, at = text.split(), 0
    result: dict[str, Any] = {}
    while at < len(words):
        word, at = words[at], at + 1
        if not word.startswith("-v") or len(word) < 3:
            continue
        letter = word[2]
        if letter == "t" and len(word) == 4 and word[3] in KINDS:
            result["kind"] = KINDS[word[3]]
        elif len(word) == 3 and letter in _SIZES and (numbers := _numbers(words, at, 1)):
            result[_SIZES[letter]] = numbers[0]
        elif len(word) == 3 and letter in _VECTORS and (numbers := _numbers(words, at, 3)):
            result[_VECTORS[letter]] = numbers
    return result


def _numbers(words: list[str], at: int, count: int) -> tuple[float, ...] | None:
    try:
        numbers = tuple(float(word) for word in words[at : at + count])
    except ValueError:
        return None
    return numbers if len(numbers) == count else None


def parse_view(text: str, width: int = 800, height: int = 800) -> View:
    """The view that Radiance's syntax describes (`-vta -vp 0 0 1.2 -vd 0 1 0 -vh 180 -vv 180`).

    Radiance's defaults apply to missing options: a perspective of 45 degrees from the origin to +y.
    `ValueError` where the text sets nothing or the view cannot be.
    """
    changes = view_changes(text)
    if not changes:
        raise ValueError(f"no view option in {text.strip()!r}")
    return View(width=width, height=height, **changes)


def format_view(view: View) -> str:
    """The view in Radiance's syntax, for a `VIEW=` line, a view file or a command."""
    words = [f"-vt{LETTERS[view.kind]}"]
    for letter, name in _VECTORS.items():
        words.append(f"-v{letter} " + " ".join(f"{value:.9g}" for value in getattr(view, name)))
    words += [f"-v{letter} {getattr(view, name):.9g}" for letter, name in _SIZES.items()]
    return " ".join(words)
