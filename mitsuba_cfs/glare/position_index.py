"""Position index: weight of a glare source away from the line of sight.

sigma is the angle between the source and the line of sight, tau the angle between the vertical and
the plane that holds both, so that tau = 0 straight above and 180 degrees straight below.

Source: Guth's index as fitted in the IES Lighting Handbook, above the line of sight; Iwata and
Osterhaus (2010) in the form of CIE 2010 below it; Kim, Han and Kim (2009) as an alternative.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.images.view import View, frame

LARGEST = 16.0  # of the Guth and Iwata index


def guth_index(sigma: ArrayLike, tau: ArrayLike) -> NDArray[np.float64]:
    """Guth's position index above the line of sight.

    ln P = (35.2 - 0.31889 tau - 1.22 exp(-2 tau/9)) 1e-3 sigma
           + (21 + 0.26667 tau - 0.002963 tau^2) 1e-5 sigma^2, angles in degrees.

    Args:
        sigma, tau: [...] angles [rad].
    """
    s, t = np.degrees(sigma), np.degrees(tau)
    linear = 35.2 - 0.31889 * t - 1.22 * np.exp(-2 * t / 9)
    square = 21 + 0.26667 * t - 0.002963 * t * t
    return np.exp(linear * 1e-3 * s + square * 1e-5 * s * s)


def iwata_index(sigma: ArrayLike, tau: ArrayLike) -> NDArray[np.float64]:
    """Position index below the line of sight, for sigma < 90 degrees.

    P = exp(0.00649 beta + 0.00021 beta^2), tan beta = tan sigma sqrt(1 + 0.3225 cos^2 tau).

    Args:
        sigma, tau: [...] angles [rad].
    """
    beta = np.arctan(np.tan(sigma) * np.sqrt(1 + 0.3225 * np.cos(tau) ** 2))
    b = np.degrees(beta)
    return np.exp(6.49e-3 * b + 21e-5 * b * b)


def kim_index(sigma: ArrayLike, tau: ArrayLike) -> NDArray[np.float64]:
    """Kim's position index over the whole field of view.

    Args:
        sigma, tau: [...] angles [rad].
    """
    s, t = np.degrees(sigma), np.degrees(tau)
    middle = -0.000009 * t**3 + 0.0014 * t**2 + 0.0866 * t + 21.633
    width = -0.000009 * t**3 + 0.0013 * t**2 + 0.0853 * t + 8.772
    return np.exp((s - middle) / width)


def view_angles(directions: ArrayLike, view: View) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """sigma, tau [...] [rad] and whether below the line of sight, of unit directions [..., 3].

    tau is measured from the view's up vector as it was given, not from its part across the line of
    sight: in a tilted view the two differ, and evalglare takes the former.
    """
    directions = np.asarray(directions, dtype=float)
    _, up, forward = frame(view)
    cosine = np.clip(directions @ forward, -1.0, 1.0)
    safe = np.where(cosine != 0, cosine, 1e-12)
    across = directions / safe[..., None] - forward
    length = np.sqrt(np.einsum("...k,...k->...", across, across))
    upwards = np.divide(across @ np.asarray(view.up), length, where=length > 0, out=0 * length)
    tau = np.arccos(np.clip(upwards, -1.0, 1.0))
    return np.arccos(cosine), tau, directions @ up < 0


def position_index(directions: ArrayLike, view: View, *, model: str = "guth") -> NDArray[np.float64]:
    """Position index [...] of sources in unit directions [..., 3], at most 16.

    Args:
        model: "guth" (with Iwata's form below the line of sight) or "kim" (not limited to 16).
    """
    sigma, tau, below = view_angles(directions, view)
    if model == "kim":
        return kim_index(sigma, tau)
    if model != "guth":
        raise ValueError(f"position index {model!r}: expected 'guth' or 'kim'")
    # just behind the eye, where the centre of a source at the rim can fall, tan(sigma) changes sign
    # and Iwata's form drops from 9.8 to 3; evalglare has it so, and DGP must be the same
    index = np.where(below, iwata_index(sigma, tau), guth_index(sigma, tau))
    return np.minimum(index, LARGEST)
