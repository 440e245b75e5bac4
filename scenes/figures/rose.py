"""Plans with a rose at each eye: wedges in the directions of view, filled by the share of the hours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from scenes.figures.plan import UNIT, PlanFrame, drawn

WIDEST = np.radians(50)  # of a wedge: an eye with few directions has no full circle
GAP = 0.92  # of the angle between two directions that a wedge fills
LEAST_SHARE = 0.04  # radius of a wedge that nothing exceeds, over the largest


@dataclass(frozen=True, slots=True)
class RosePlan:
    """A plan with roses, and the limits that their colours stand for."""

    title: str
    explanation: str
    view_box: str  # min x, min y, width, height
    ratio: float  # width over height
    body: str  # SVG inside
    limits: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RoseWedge:
    """One direction of an eye."""

    position: NDArray[np.float64]  # [2] of the eye [m]
    direction: NDArray[np.float64]  # [2] that it looks in
    shares: tuple[float, ...]  # [n] of the hours, falling: above the first limit, the second, ...
    words: str  # shown under the pointer


def roses(
    frame: PlanFrame, wedges: Sequence[RoseWedge], radius: float, directions: int
) -> tuple[tuple[str, float], str]:
    """View box, ratio and SVG of a plan with wedges whose areas are the shares of hours.

    The wedge of each limit lies on that of the one before; its class is `above0`, `above1`, ...

    Args: radius: of a share of 1 [m]; directions: of an eye.
    """
    half = min(2 * np.pi / max(directions, 1) * GAP, WIDEST) / 2
    parts = []
    for wedge in wedges:
        shapes = [_sector(wedge, LEAST_SHARE * radius, half, "no-glare")]
        for number, share in enumerate(wedge.shares):
            if share > 0:
                length = radius * max(np.sqrt(share), LEAST_SHARE)
                shapes.append(_sector(wedge, length, half, f"above{number}"))
        whole = _sector(wedge, radius, half, "reach")
        title = f"<title>{escape(wedge.words)}</title>"
        parts.append(f'<g class="wedge">{title}{whole}{"".join(shapes)}</g>')
    return drawn(frame, parts)


def _sector(wedge: RoseWedge, length: float, half: float, name: str) -> str:
    """A sector of a circle round the eye."""
    middle = float(np.arctan2(wedge.direction[1], wedge.direction[0]))
    x, y = wedge.position
    ends = [(x + length * np.cos(angle), y + length * np.sin(angle)) for angle in (middle - half, middle + half)]
    (x1, y1), (x2, y2) = ends
    r = UNIT * length
    return (
        f'<path class="{name}" d="M{UNIT * x:.1f} {-UNIT * y:.1f}L{UNIT * x1:.1f} {-UNIT * y1:.1f}'
        f'A{r:.1f} {r:.1f} 0 0 0 {UNIT * x2:.1f} {-UNIT * y2:.1f}Z"/>'
    )
