"""Charts as data: axes with ticks in percent, marks as SVG paths in a box of 1000 x 1000.

The page stretches the box to the room there is and sets the labels as text beside it, so that
type stays readable from a phone to a print.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.figures.scale import ColourScale, Tick

BOX = 1000.0


@dataclass(frozen=True, slots=True)
class ChartMark:
    """One SVG path of a chart and its entry in the legend."""

    path: str
    style: str  # CSS class: colour and dash
    label: str = ""  # empty: not in the legend
    filled: bool = False


@dataclass(frozen=True, slots=True)
class Readout:
    """Numbers that the page shows under the pointer: one row per series over equal x steps."""

    x: tuple[str, ...]  # what each step is called
    series: tuple[tuple[str, tuple[str, ...]], ...]  # name and values as text


@dataclass(frozen=True, slots=True)
class Chart:
    """A chart with axes; the picture, if any, lies under the marks and fills the box."""

    title: str
    explanation: str
    x_label: str
    y_label: str
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    marks: tuple[ChartMark, ...] = ()
    picture: str = ""  # data URI
    scale: ColourScale | None = None
    classes: tuple[tuple[str, str], ...] = ()  # colour and name: legend of a picture of classes
    readout: Readout | None = None
    carpet: dict[str, Any] | None = None  # what the pointer shows on a carpet plot
    height: int = 240  # [px] of the box


def line(x: ArrayLike, y: ArrayLike, x_range: ArrayLike, y_range: ArrayLike) -> str:
    """SVG path through points [N]; broken where y is not finite."""
    px, py = _boxed(x, x_range), BOX - _boxed(y, y_range)
    parts, pen, drawn = [], "M", np.isfinite(px) & np.isfinite(py)
    for a, b, there in zip(px.tolist(), py.tolist(), drawn.tolist(), strict=True):
        if not there:
            pen = "M"
            continue
        parts.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(parts)


def box(x0: float, x1: float, y0: float, y1: float, x_range: ArrayLike, y_range: ArrayLike) -> str:
    """SVG path of a rectangle, for bars."""
    a, b = _boxed([x0, x1], x_range)
    c, d = BOX - _boxed([y0, y1], y_range)
    return f"M{a:.1f} {c:.1f}L{b:.1f} {c:.1f}L{b:.1f} {d:.1f}L{a:.1f} {d:.1f}Z"


def _boxed(values: ArrayLike, limits: ArrayLike) -> NDArray[np.float64]:
    low, high = np.asarray(limits, dtype=float)
    return BOX * (np.asarray(values, dtype=float) - low) / (high - low)
