"""A blind as a function of the tilt of its slats: states between those of its files.

    B(tilt) = (1 - w) B(low) + w B(high)        every block of the BSDF, visible and solar

Light, luminance and absorbed sun are linear in the BSDF of a window: they are the mean of those of
the two neighbours with the same weights, and need no tracing.  U and g are linear; the closure is
that of the nearer neighbour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, NeighbourTilts

MOST_TILTS = 91  # states of a family


def tilt_states(systems: Sequence[FenestrationSystem], step_deg: float) -> tuple[FenestrationSystem, ...]:
    """The states of a blind with tilts in steps between those of its systems.

    Args:
        systems: from open to closed; those with a `tilt_deg` are the family, their tilts rise, and
            the others (a raised blind) come first.
        step_deg: of the tilts; those of the systems are among them.

    Raises: `DataError` for systems that are no family, or too many states.
    """
    bare = [one for one in systems if one.tilt_deg is None]
    family = [one for one in systems if one.tilt_deg is not None]
    tilts = [float(one.tilt_deg or 0.0) for one in family]
    if len(family) < 2 or list(systems) != bare + family or np.any(np.diff(tilts) <= 0):
        message = "tilts between systems need two or more with `tilt_deg`, rising, after all others"
        raise DataError(message, field="tilt_step_deg")
    for one in family:
        if one.tree is not None or one.angular is not None:
            message = f"{one.name} is no Klems matrix: tilts between systems are means of matrices"
            raise DataError(message, file=one.file, field="tilt_deg")
    steps = [max(1, round((b - a) / step_deg)) for a, b in pairwise(tilts)]
    if sum(steps) + 1 > MOST_TILTS:
        raise DataError(f"{sum(steps) + 1} tilts, at most {MOST_TILTS}", field="tilt_step_deg")
    states = [*bare, family[0]]
    for low, high, count in zip(family, family[1:], steps, strict=False):
        states += [between_tilts(low, high, number / count) for number in range(1, count)]
        states.append(high)
    return tuple(states)


def between_tilts(low: FenestrationSystem, high: FenestrationSystem, share: float) -> FenestrationSystem:
    """The system between two tilts of a blind; share: of `high`, 0 to 1."""
    tilt = (1 - share) * float(low.tilt_deg or 0.0) + share * float(high.tilt_deg or 0.0)
    nearer = low if share <= 0.5 else high

    def mean(one: float | None, other: float | None) -> float | None:
        return None if one is None or other is None else (1 - share) * one + share * other

    by_patch = None
    if low.g_by_patch is not None and high.g_by_patch is not None:
        by_patch = (1 - share) * low.g_by_patch + share * high.g_by_patch
    return replace(
        nearer,
        name=f"{low.name} to {high.name}, {tilt:g} deg",
        visible=mean_bsdf(low.visible, high.visible, share),
        solar=mean_bsdf(low.solar, high.solar, share),
        u_value=mean(low.u_value, high.u_value),
        g_value=mean(low.g_value, high.g_value),
        g_by_patch=by_patch,
        tilt_deg=tilt,
        recipe=None,
        between=NeighbourTilts(low, high, share),
    )


def mean_bsdf(low: KlemsBsdf, high: KlemsBsdf, share: float) -> KlemsBsdf:
    """The weighted mean of two BSDF, block by block; share: of `high`."""
    others = high.blocks()
    blocks = {
        name: (1 - share) * block + share * others[name] for name, block in low.blocks().items() if name in others
    }
    changed: dict[str, Any] = dict(blocks)
    passed = low.see_through, high.see_through
    if passed[0] is not None and passed[1] is not None:
        changed["see_through"] = (1 - share) * passed[0] + share * passed[1]
    else:
        changed["see_through"] = None  # by the data of the mean
    return replace(low, **changed)


@dataclass(frozen=True, slots=True)
class TiltError:
    """Deviation of a system from the mean of its neighbours in tilt, of the visible light."""

    tilt_deg: float
    spacing_deg: float  # between the neighbours
    transmittance: float  # root mean square over the directions of incidence, absolute
    relative: float  # of the matrix: root of the squares of the difference over those of itself


def tilt_errors(systems: Sequence[FenestrationSystem]) -> tuple[TiltError, ...]:
    """How far each tilt of a family but the outermost is from the mean of its two neighbours.

    The neighbours are about twice as far apart as those between which states are interpolated; the
    error between these is about a third of it (0.28 to 0.39 of the demo's blind).
    """
    family = [one for one in systems if one.tilt_deg is not None and one.between is None]
    errors = []
    for low, one, high in zip(family, family[1:], family[2:], strict=False):
        first, middle, last = (float(s.tilt_deg or 0.0) for s in (low, one, high))
        expected = mean_bsdf(low.visible, high.visible, (middle - first) / (last - first))
        errors.append(
            TiltError(
                middle,
                last - first,
                float(
                    np.sqrt(
                        np.average(
                            (_transmittance(expected) - _transmittance(one.visible)) ** 2,
                            weights=KLEMS_FULL.projected_solid_angles(),
                        )
                    )
                ),
                relative_difference(expected, one.visible),
            )
        )
    return tuple(errors)


def relative_difference(one: KlemsBsdf, other: KlemsBsdf) -> float:
    """Root of the squared differences of two transmissions, over that of the squares of `other`.

    Patches count by their projected solid angles on either side.
    """
    omega = KLEMS_FULL.projected_solid_angles()
    weight = omega[:, None] * omega
    a, b = _block(one), _block(other)
    return float(np.sqrt((weight * (a - b) ** 2).sum() / (weight * b**2).sum()))


def tilt_note(systems: Sequence[FenestrationSystem]) -> tuple[str, ...]:
    """A sentence on the error of tilts between systems; none without any."""
    between = sum(one.between is not None for one in systems)
    errors = tilt_errors(systems)
    if not between:
        return ()
    if not errors:
        return (
            Note(
                "Slat tilts ({count}) are interpolated between two: their error is unknown, which "
                "a third tilt would show.",
                count=between,
            ),
        )
    worst = max(errors, key=lambda one: one.relative)
    return (
        Note(
            "Slat tilts ({count}) are interpolated. At the tilts of the files, interpolation from "
            "the two neighbours is off by at most {transmittance:.3f} of the light (transmittance, "
            "root mean square over directions) and {relative:.0f} % of the BSDF ({tilt:.0f}°, "
            "neighbours {spacing:.0f}° apart); between the files' tilts it is about a third.",
            count=between,
            transmittance=max(one.transmittance for one in errors),
            relative=100 * worst.relative,
            tilt=worst.tilt_deg,
            spacing=worst.spacing_deg,
        ),
    )


def _block(bsdf: KlemsBsdf) -> NDArray[np.float64]:
    if bsdf.transmission_front is None:
        raise ValueError("a system without transmission from outside")
    return bsdf.transmission_front


def _transmittance(bsdf: KlemsBsdf) -> NDArray[np.float64]:
    return bsdf.direct_hemispherical(_block(bsdf))
