"""Radiance as the judge: the helpers of the benchmarks, and the weights of its channels."""

from __future__ import annotations

from tests.benchmarks.radiance import (
    environment,
    polygon,
    read_float_matrix,
    run,
    sensors_text,
    write_group,
    write_sky,
    write_surfaces,
)

LUMINANCE = (47.435, 119.93, 11.635)  # of R, G, B: 179 lm/W times 0.265, 0.670, 0.065

__all__ = [
    "LUMINANCE",
    "environment",
    "polygon",
    "read_float_matrix",
    "run",
    "sensors_text",
    "write_group",
    "write_sky",
    "write_surfaces",
]
