"""Polygons of Radiance's generators `genbox` and `genprism`, by their manual pages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bim.radiance.primitives import count_of, number_of

Polygon = tuple[str, NDArray[np.float64]]  # name, corners [n, 3]

# corners of a unit box's sides, counter-clockwise seen from outside
SIDES = {
    "x0": ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)),
    "x1": ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)),
    "y0": ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
    "y1": ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)),
    "z0": ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)),
    "z1": ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}


def genbox(words: tuple[str, ...]) -> tuple[str, list[Polygon]]:
    """Material and sides of `genbox material name x y z [-i]`.

    Raises: `ValueError` for rounded or bevelled boxes, or wrong numbers.
    """
    if len(words) < 6:
        raise ValueError("takes a material, a name and three sizes")
    material, name, *rest = words[1:]
    size = _numbers(rest[:3])
    if set(rest[3:]) - {"-i"}:
        raise ValueError(f"option {next(w for w in rest[3:] if w != '-i')} is not read")
    turn = -1 if "-i" in rest[3:] else 1
    return material, [
        (f"{name}.{side}", np.array(corners, float)[::turn] * size)
        for side, corners in SIDES.items()
    ]


def genprism(words: tuple[str, ...]) -> tuple[str, list[Polygon]]:
    """Material and sides of `genprism material name N x1 y1 .. xN yN [-l x y z] [-c] [-e]`.

    Raises: `ValueError` for rounded prisms, outlines from files, or wrong numbers.
    """
    if len(words) < 4:
        raise ValueError("takes a material, a name, the number of corners and their x and y")
    material, name, count = words[1], words[2], count_of(words[3])
    outline = _numbers(words[4 : 4 + 2 * count])
    if count < 3 or len(outline) < 2 * count:
        raise ValueError(f"expected the x and y of {words[3]} corners, at least three")
    ring = np.column_stack([outline.reshape(-1, 2), np.zeros(count)])
    along, is_open, has_ends, rest = (
        np.array([0.0, 0.0, 1.0]),
        False,
        True,
        list(words[4 + 2 * count :]),
    )
    while rest:
        option = rest.pop(0)
        if option == "-l":
            along, rest = _numbers(rest[:3]), rest[3:]
            if len(along) < 3:
                raise ValueError("-l takes three numbers")
        elif option in ("-c", "-e"):
            is_open, has_ends = is_open or option == "-c", has_ends and option != "-e"
        else:
            raise ValueError(f"option {option} is not read")
    sides = [
        (f"{name}.{i + 1}", np.array([ring[i], ring[i] + along, ring[j] + along, ring[j]]))
        for i, j in ((i, (i + 1) % count) for i in range(count - is_open))
    ]
    ends = [(f"{name}.b", ring), (f"{name}.t", (ring + along)[::-1])] if has_ends else []
    return material, ends + sides


GENERATORS = {"genbox": genbox, "genprism": genprism}


def _numbers(words: tuple[str, ...] | list[str]) -> NDArray[np.float64]:
    return np.array([number_of(word) for word in words])
