"""Spoilt files, the same ones each time: bytes changed, cut out, repeated, put in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

PIECES = (
    b"-1e999",
    b"NaN",
    b"null",
    b"[]",
    b"{}",
    b'""',
    b"0",
    b"\xff\xfe",
    b"<",
    b"&x;",
    b"1e300",
)


def mutations(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """`count` spoilt copies of a file."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        spoilt = bytearray(content)
        for _ in range(int(random.integers(1, 4))):
            at = int(random.integers(len(spoilt)))
            match int(random.integers(5)):
                case 0:
                    spoilt[at] = int(random.integers(256))
                case 1:
                    del spoilt[at : at + int(random.integers(1, 200))]
                case 2:
                    spoilt[at:at] = PIECES[int(random.integers(len(PIECES)))]
                case 3:
                    spoilt = spoilt[: max(at, 1)]
                case _:
                    numbers = [i for i in range(at, min(at + 400, len(spoilt)))
                               if 48 <= spoilt[i] <= 57]  # fmt: skip
                    if numbers:
                        piece = PIECES[int(random.integers(len(PIECES)))]
                        spoilt[numbers[0] : numbers[0] + 1] = piece
        yield bytes(spoilt)
