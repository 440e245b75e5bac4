"""Functions and patterns of Radiance's modifiers, evaluated on a surface.

A pattern's mean over points of a surface is used in place of its course.

Source: "The RADIANCE 5.1 Synthetic Imaging System", 2.2 and 3.3; `rayinit.cal`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bim.radiance.functions import FunctionFile, find_functions, read_functions
from bim.radiance.materials import LUMINANCE, MIXTURE
from bim.radiance.primitives import Definition
from bim.radiance.xform import read_xform
from mitsuba_cfs.surfaces import even_numbers, points_on_triangles

POINTS = 8192  # on a surface, for the mean of a pattern
TURNS = 16  # azimuths of a function by the angle of incidence
EVEN = 1e-6  # greatest difference over a surface of a pattern that is the same everywhere
COMPUTED_PATTERNS = ("brightfunc", "colorfunc")
EXPRESSIONS = {"brightfunc": slice(1), "colorfunc": slice(3), MIXTURE: slice(2, 3)}  # in strings


def pattern_values(
    triangles: NDArray[np.float64],
    normal: NDArray[np.float64],
    patterns: Sequence[Definition],
    angles: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Product of patterns [N, POINTS] at angles of incidence [N], at points of a surface.

    Of a mixture it is the share of its foreground.

    Raises: `DataError` for a function that cannot be evaluated.
    """
    points = points_on_triangles(triangles, even_numbers(POINTS))[0]
    result = np.ones((len(angles), POINTS))
    for one in patterns:
        place = EXPRESSIONS[one.primitive.kind]
        texts = one.primitive.strings[place]
        if not texts:
            raise one.primitive.fault("names no function")
        functions, frame = functions_of(one, one.primitive.strings[place.stop :])
        names = ray_variables(points, frame, normal, normal, angles)
        values = [np.asarray(evaluated(one, functions, text, names)) for text in texts]
        weights = LUMINANCE if len(texts) == 3 else (1.0,)
        grey = sum(w * v for w, v in zip(weights, values, strict=True))
        if not np.isfinite(grey).all():
            raise one.primitive.fault("is no number somewhere on the surface")
        result = result * np.maximum(grey, 0.0)
    return result


def ray_variables(
    points: NDArray[np.float64],
    frame: NDArray[np.float64],
    towards: NDArray[np.float64],
    normal: NDArray[np.float64],
    angles: NDArray[np.float64],
) -> dict[str, NDArray[np.float64]]:
    """Variables of rays [N, n] that meet points [n, 3] at angles of incidence [N].

    Args: towards: normal [3] of the side that the rays come from; normal: of the front.
    """
    count = len(points)
    phi = 2 * np.pi * np.mod(np.arange(count) * (0.5 * (5**0.5 - 1)), 1.0)
    x = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    around = np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * y
    ways = -np.cos(angles)[:, None, None] * towards + np.sin(angles)[:, None, None] * around
    inverse = np.linalg.inv(frame)
    scale = abs(np.linalg.det(frame[:3, :3])) ** (1 / 3)
    local = points @ inverse[:3, :3].T + inverse[:3, 3]
    ways, flat = (v @ (inverse[:3, :3] * scale).T for v in (ways, normal))
    names = {f"P{a}": np.broadcast_to(local[:, i], ways.shape[:2]) for i, a in enumerate("xyz")}
    names |= {f"D{a}": ways[..., i] for i, a in enumerate("xyz")}
    names |= {f"N{a}": np.full(ways.shape[:2], flat[i]) for i, a in enumerate("xyz")}
    names["Rdot"] = -ways @ flat
    names |= {name: np.ones(ways.shape[:2]) for name in ("CrP", "CgP", "CbP")}
    names |= {name: np.zeros(ways.shape[:2]) for name in ("T", "Ts", "DxA", "DyA", "DzA")}
    return names | {f"N{a}P": names[f"N{a}"] for a in "xyz"} | {"RdotP": names["Rdot"]}


def functions_of(definition: Definition, rest: Sequence[str]) -> tuple[FunctionFile, NDArray[np.float64]]:
    """Functions and frame [4, 4] of a primitive, from its file's name and transformation on."""
    primitive, frame = definition.primitive, definition.frame
    if not rest or rest[0] == ".":
        functions = FunctionFile({})
    else:
        path = find_functions(rest[0], primitive.file)
        if path is None:
            raise primitive.fault(f"its function file {rest[0]} is not there")
        functions = read_functions(path)
    if len(rest) > 1:
        try:
            frame = frame @ read_xform(("xform", *rest[1:])).copies[0]
        except ValueError as error:
            raise primitive.fault(f"its transformation: {error}") from None
    return functions, frame


def evaluated(
    definition: Definition, functions: FunctionFile, text: str, names: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Value [..] of an expression of a primitive; `DataError` where it cannot be evaluated."""
    try:
        return functions.value(text, names, definition.primitive.numbers)
    except ValueError as error:
        raise definition.primitive.fault(str(error)) from None
