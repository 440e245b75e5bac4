"""Radiance's `xform`: moves, turns, scales, mirrors and arrays of objects.

Source: the manual page `xform(1)`: transformations apply in the order given; `-i n` repeats what
follows; `-a n` puts n copies, each moved once more, the first not at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.radiance.primitives import count_of, number_of

MOVES = {"-t": 3, "-rx": 1, "-ry": 1, "-rz": 1, "-s": 1, "-mx": 0, "-my": 0, "-mz": 0}
MOST_COPIES = 1_000_000


@dataclass(frozen=True, slots=True)
class Xform:
    """The options of one `xform` line."""

    copies: tuple[NDArray[np.float64], ...]  # [4, 4] each: world = matrix @ (x, y, z, 1)
    files: tuple[str, ...]  # empty: the objects come through the pipe
    modifier: str | None = None  # in place of the objects' own
    prefix: str = ""
    is_inverted: bool = False  # surfaces are turned round


def read_xform(words: tuple[str, ...]) -> Xform:
    """The options of `xform`.

    Raises: `ValueError` for what it does not know.
    """
    stages: list[tuple[str, int, list[NDArray[np.float64]]]] = [("-i", 1, [])]
    modifier, prefix, inverted = None, "", False
    at = 1
    while at < len(words) and words[at].startswith("-"):
        option = words[at]
        if option in ("-m", "-n"):
            value = _value(words, at)
            modifier, prefix = (value, prefix) if option == "-m" else (modifier, value)
            at += 2
        elif option in ("-i", "-a"):
            stages.append((option, count_of(_value(words, at)), []))
            at += 2
        elif option in MOVES:
            numbers = [_number(w, option) for w in words[at + 1 : at + 1 + MOVES[option]]]
            if len(numbers) < MOVES[option]:
                raise ValueError(f"{option} takes {MOVES[option]} numbers")
            stages[-1][2].append(_move(option, numbers))
            at += 1 + MOVES[option]
        elif option in ("-c", "-e", "-I"):
            inverted |= option == "-I"
            at += 1
        else:
            raise ValueError(f"option {option} is not known")
    copies = tuple(_copies(stages))
    return Xform(copies, words[at:], modifier, prefix, inverted)


def _copies(stages: list[tuple[str, int, list[NDArray[np.float64]]]]) -> Iterator[NDArray]:
    count = math.prod(n for kind, n, _ in stages if kind == "-a")
    if max(count, *(n for kind, n, _ in stages if kind == "-i")) > MOST_COPIES:
        raise ValueError(f"{count} copies are more than {MOST_COPIES}")
    copies = [np.eye(4)]
    for kind, times, moves in stages:
        once = np.eye(4)
        for move in moves:
            once = move @ once
        powers = [np.linalg.matrix_power(once, k) for k in (range(times) if kind == "-a" else [times])]
        copies = [power @ before for before in copies for power in powers]
    return iter(copies)


def _move(option: str, numbers: list[float]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    if option == "-t":
        matrix[:3, 3] = numbers
    elif option == "-s":
        if numbers[0] == 0:
            raise ValueError("-s takes a factor that is not 0")
        matrix[:3, :3] *= numbers[0]
    elif option.startswith("-m"):
        axis = "xyz".index(option[2])
        matrix[axis, axis] = -1.0
    else:
        axis, angle = "xyz".index(option[2]), np.radians(numbers[0])
        j, k = (axis + 1) % 3, (axis + 2) % 3
        matrix[j, j] = matrix[k, k] = np.cos(angle)
        matrix[k, j], matrix[j, k] = np.sin(angle), -np.sin(angle)
    return matrix


def _value(words: tuple[str, ...], at: int) -> str:
    if at + 1 >= len(words):
        raise ValueError(f"{words[at]} takes a value")
    return words[at + 1]


def _number(word: str, option: str) -> float:
    try:
        return number_of(word)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
