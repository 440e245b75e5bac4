"""Periodic layers as scenes for Radiance's genBSDF."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.periodic import PeriodicLayer


def write_radiance(layer: PeriodicLayer, path: str | PathLike[str], columns: int, rows: int) -> None:
    """Write columns x rows cells as a Radiance scene for genBSDF.

    In Radiance's BSDF frame: x to the left, y up, z into the room, all of the layer at z <= 0.
    """
    triangles, material = layer.tile(columns, rows)
    triangles = triangles - [0.0, 0.0, layer.depth_range[0]]
    with open(path, "w", encoding="ascii") as file:
        file.writelines(_radiance_lines(layer, triangles * [-1, 1, -1], material))


def _radiance_lines(layer: PeriodicLayer, triangles: NDArray[np.float64], material: NDArray[np.int64]) -> Iterator[str]:
    for index, sheet in enumerate(layer.materials):
        alike = sheet.reflectance_front == sheet.reflectance_back
        if sheet.transmittance or sheet.index or sheet.straight or sheet.back_is_black or not alike:
            raise ValueError(f"material {sheet.name}: only opaque sheets alike on both sides")
        colour = np.array(sheet.reflectance_front) / (1 - sheet.specular)
        red, green, blue = colour if len(colour) == 3 else (colour[0],) * 3
        yield f"void plastic m{index} 0 0 5 {red:.9g} {green:.9g} {blue:.9g} "
        yield f"{sheet.specular:.9g} {sheet.roughness:.9g}\n"
    for index, (corners, sheet) in enumerate(zip(triangles, material, strict=True)):
        numbers = " ".join(f"{value:.9g}" for value in corners.ravel())
        yield f"m{sheet} polygon p{index} 0 0 9 {numbers}\n"
