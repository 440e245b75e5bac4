"""Arrays that are mostly zero, or of one value where they are not: a bit for each entry, and the values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class PackedArray:
    """An array in single precision, packed without loss."""

    shape: tuple[int, ...]
    bits: NDArray[np.int8]  # of eight entries each: which are not 0
    values: NDArray[np.float32]  # of these; a single one where all are equal

    @classmethod
    def of(cls, array: NDArray[Any]) -> PackedArray:
        """From an array of numbers or of truth values."""
        flat = np.ascontiguousarray(array).ravel()
        values = flat[flat != 0].astype(np.float32)
        if len(values) and (values == values[0]).all():
            values = values[:1]
        return cls(array.shape, np.packbits(flat != 0).view(np.int8), values)

    @property
    def empty(self) -> bool:
        """Whether all entries are 0."""
        return not len(self.values)

    def whole(self) -> NDArray[np.float32]:
        """The array."""
        size = math.prod(self.shape)
        flat = np.unpackbits(self.bits.view(np.uint8), count=size).astype(np.float32)
        if not self.empty:
            flat[flat != 0] = self.values
        return flat.reshape(self.shape)

    def arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """The arrays that it consists of, by names that begin with `name`."""
        return {f"{name} shape": np.array(self.shape), f"{name} bits": self.bits, f"{name} values": self.values}

    @classmethod
    def of_arrays(cls, data: Mapping[str, NDArray[Any]], name: str) -> PackedArray:
        """From the arrays of `arrays`; `KeyError` where they are missing."""
        shape = tuple(int(n) for n in data[f"{name} shape"])
        return cls(shape, data[f"{name} bits"], data[f"{name} values"])
