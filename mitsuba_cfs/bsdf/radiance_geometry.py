"""Reading a layer's cell from a Radiance scene: polygons of opaque `plastic`."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason


def read_radiance_layer(path: str | PathLike[str], period: tuple[float, float]) -> PeriodicLayer:
    """The layer of a Radiance scene in genBSDF's frame (z into the room, y up), [m].

    Red, green and blue are the spectral channels.  `DataError` for anything but a convex polygon of
    opaque `plastic`: other primitives, commands, undefined modifiers.
    """
    materials: dict[str, SlatMaterial] = {}
    triangles, used = [], []
    for modifier, kind, name, numbers in _primitives(path):
        if kind == "plastic":
            materials[name] = _plastic(name, numbers, path)
        elif kind == "polygon":
            if modifier not in materials:
                raise DataError(f"unknown modifier {modifier}", file=path, element=name)
            if len(numbers) < 9 or len(numbers) % 3:
                raise DataError(f"{len(numbers)} coordinates", file=path, element=name)
            corners = np.array(numbers).reshape(-1, 3) * [-1, 1, -1]
            fan = [corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)]
            triangles += fan
            used += [list(materials).index(modifier)] * len(fan)
        else:
            raise DataError(f"expected plastic or polygon, got {kind}", file=path, element=name)
    if not triangles:
        raise DataError("has no polygon", file=path)
    return PeriodicLayer(
        np.array(triangles), np.array(used, dtype=np.int64), tuple(materials.values()), period
    )


def _plastic(name: str, numbers: list[float], path: str | PathLike[str]) -> SlatMaterial:
    if len(numbers) != 5:
        raise DataError(f"plastic with {len(numbers)} numbers", file=path, element=name)
    colour, specular, roughness = np.array(numbers[:3]), numbers[3], numbers[4]
    diffuse = tuple(((1 - specular) * colour).tolist())
    try:
        return SlatMaterial(name, diffuse, diffuse, specular=specular, roughness=roughness)
    except ValueError as error:
        raise DataError(str(error), file=path, element=name) from None


def _primitives(path: str | PathLike[str]) -> list[tuple[str, str, str, list[float]]]:
    """Modifier, type, name and numbers of each primitive of the scene."""
    try:
        text = Path(path).read_text(encoding="ascii")
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    except UnicodeDecodeError:
        raise DataError("is not a Radiance scene", file=path) from None
    lines = [line.split("#")[0] for line in text.splitlines()]
    if any(line.startswith("!") for line in lines):
        raise DataError("holds a command: expand it first (xform)", file=path)
    words, primitives = " ".join(lines).split(), []
    place = 0
    try:
        while place < len(words):
            modifier, kind, name = words[place : place + 3]
            place += 3
            strings = int(words[place])
            place += 1 + strings
            place += 1 + int(words[place])
            count = int(words[place])
            numbers = [float(word) for word in words[place + 1 : place + 1 + count]]
            place += 1 + count
            if len(numbers) != count or not np.isfinite(numbers).all():
                raise ValueError(f"expected {count} numbers")
            primitives.append((modifier, kind, name, numbers))
    except (ValueError, IndexError) as error:
        raise DataError(f"word {place}: {error}", file=path) from None
    return primitives
