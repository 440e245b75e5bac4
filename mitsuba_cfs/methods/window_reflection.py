"""Light that windows reflect, back into the room and onto the outdoors in front of them.

V T D s lacks it, because its windows are black from both sides:

    L' = L + R W L + (R W)^2 L + ...
    I' = I + X R_f I + (X R_f)^2 I + ...

L = T I is the luminance of the windows, I = D s the luminance in front of them; W and X are what
the windows see of the room and of the outdoors that they light, R and R_f their reflection to
either side on the same patches.  A mirror image keeps its direction to a patch.  Light that leaves
the room and comes back is left out: 0.1 to 0.4 % beside fins, by path tracing.

`optics` are those of the window parts [Q], each in its state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, with_exchange
from mitsuba_cfs.trace.kernels.estimate import Estimate

# of reflection in the windows: a fifth is below 0.001 in a bright room with a front of glass
ORDERS = 4
OUTDOOR_ORDERS = 2  # fins send back a tenth of what panes reflect, which is a seventh

Array = TypeVar("Array", NDArray[np.float32], NDArray[np.float64], NDArray[np.floating])


def reflects(optics: Sequence[SystemOptics]) -> bool:
    """Whether any of the systems reflects light of the room."""
    return any(o.reflection is not None and o.reflection.any() for o in optics)


def reflects_outdoors(matrices: PhaseMatrices, optics: Sequence[SystemOptics]) -> bool:
    """Whether any of the systems reflects light onto something outdoors."""
    if not len(matrices.scene.exterior.triangles):
        return False
    return any(o.outdoor_reflection is not None and o.outdoor_reflection.any() for o in optics)


def with_exchange_of(matrices: PhaseMatrices, optics: Sequence[SystemOptics]) -> PhaseMatrices:
    """The matrices with W and X as far as the systems reflect."""
    return with_exchange(matrices, indoors=reflects(optics), outdoors=reflects_outdoors(matrices, optics))


def reflected_luminance(
    exchange: NDArray[np.float64],
    optics: Sequence[SystemOptics],
    luminance: NDArray[np.floating],
    in_sun: tuple[NDArray[np.floating], NDArray[np.floating]] | None = None,
) -> NDArray[np.float64]:
    """Luminance [Q, K, H] that reflection of the room's light adds to that of the windows.

    Args:
        exchange: W [Q, K, Q * K].
        luminance: of the windows [Q, K, H].
        in_sun: the part of it that is the sun's beam [Q, K, H], and the luminance of the room in
            that beam outside the windows [Q * K, H], by shadow rays: few paths of W would meet the
            sun's patch.
    """
    added: NDArray[np.float64] = np.zeros(luminance.shape)
    source: NDArray[np.floating] = luminance
    met: NDArray[np.floating] = added
    if in_sun is not None:  # below 0 by rounding alone
        source, met = np.maximum(luminance - in_sun[0], 0), in_sun[1].reshape(luminance.shape)
    for _ in range(ORDERS):
        flat = source.reshape(-1, luminance.shape[-1])
        before, back = exchange @ flat + met, np.zeros_like(added)
        for q, one in enumerate(optics):
            if one.reflection is not None:
                back[q] = one.reflection @ before[q]
        added, source, met = added + back, back, np.zeros_like(met)
    return added


def sensor_reflection(
    view: NDArray[np.float64], exchange: NDArray[np.float64], optics: Sequence[SystemOptics]
) -> NDArray[np.float32]:
    """V (R W + (R W)^2 + ...) [S, Q * K]: light of the sensors by reflection in windows.

    In single precision: the noise of W is a hundred thousand times its rounding.
    """
    width = exchange.shape[-1]
    flat = exchange.reshape(width, width).astype(np.float32)
    order: NDArray[np.float32] = view.reshape(-1, width).astype(np.float32)
    total = np.zeros_like(order)
    for _ in range(ORDERS):
        order = np.matmul(_by_part(optics, _reflection, order), flat, dtype=np.float32)
        total += order
    return total


def by_way_of_outdoors(
    exchange: NDArray[np.float64], optics: Sequence[SystemOptics], shares: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Shares [n, Q * K] of the luminance outside the windows, by their reflection outdoors.

    F (X R_f + (X R_f)^2 + ...)

    Args:
        exchange: X [q, K, q * K].
        shares: F [n, Q * K] of what comes to the windows otherwise.
    """
    order = shares.reshape(len(shares), -1)
    outer = len(exchange) * KLEMS_FULL.size
    flat, total = exchange.reshape(outer, -1), np.zeros(order.shape)
    for _ in range(OUTDOOR_ORDERS):
        sent = order[:, :outer] @ flat
        order = _by_part(optics[: len(exchange)], _outdoor_reflection, sent)
        total[:, :outer] += order
    return total


def returned_from_outdoors(
    exchange: NDArray[np.float64], optics: Sequence[SystemOptics], light: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Luminance [Q * K, h] that comes back to the windows by their reflection outdoors.

    (X R_f + (X R_f)^2 + ...) I, for few hours less work than `by_way_of_outdoors`

    Args: exchange: X [q, K, q * K]; light: I [Q * K, h].
    """
    K, parts, total = KLEMS_FULL.size, len(exchange), np.zeros(light.shape)
    flat, order = exchange.reshape(parts * K, -1), light
    for _ in range(OUTDOOR_ORDERS):
        sent = np.zeros((flat.shape[1], light.shape[1]))
        for q, one in enumerate(optics[:parts]):
            if one.outdoor_reflection is not None:
                rows = slice(q * K, (q + 1) * K)
                sent[rows] = one.outdoor_reflection @ order[rows]
        order = flat @ sent
        total[: parts * K] += order
    return total


def through(optics: Sequence[SystemOptics], shares: Array) -> Array:
    """Shares [n, Q * K] of the windows' luminance as shares of the luminance before them."""
    return _by_part(optics, lambda one: one.transmission, shares)


def variance_by_room(
    view: NDArray[np.float64], exchange: Estimate, optics: Sequence[SystemOptics], luminance: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Variance of the sensors' light [S] by the noise of W, that of its first order.

    Args: view: V [S, Q, K]; exchange: W; luminance: L [Q, K].
    """
    noise = _row_variance(exchange, luminance)
    variance = np.zeros(len(view))
    for q, one in enumerate(optics):
        if one.reflection is not None:
            variance += (view[:, q] @ one.reflection) ** 2 @ noise[q]
    return variance


def variance_by_outdoors(
    shares: NDArray[np.float64], exchange: Estimate, optics: Sequence[SystemOptics], before: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Variance of the sensors' light [S] by the noise of X, that of its first order.

    Args: shares: `ReflectedShares.before` [S, Q * K]; exchange: X; before: I [Q, K].
    """
    sent = np.zeros((len(exchange.values), KLEMS_FULL.size))
    for q, one in enumerate(optics[: len(sent)]):
        if one.outdoor_reflection is not None:
            sent[q] = one.outdoor_reflection @ before[q]
    noise = _row_variance(exchange, sent)
    variance: NDArray[np.float64] = shares[:, : noise.size] ** 2 @ noise.ravel()
    return variance


def _reflection(one: SystemOptics) -> NDArray[np.float64] | None:
    return one.reflection


def _outdoor_reflection(one: SystemOptics) -> NDArray[np.float64] | None:
    return one.outdoor_reflection


def _by_part(
    optics: Sequence[SystemOptics], matrix_of: Callable[[SystemOptics], NDArray[np.float64] | None], shares: Array
) -> Array:
    """Shares [n, Q * K] times a matrix [K, K] of each part's system; 0 where it has none."""
    K, products = KLEMS_FULL.size, np.zeros_like(shares)
    for q, one in enumerate(optics):
        matrix, columns = matrix_of(one), slice(q * K, (q + 1) * K)
        if matrix is not None:
            products[:, columns] = shares[:, columns] @ matrix.astype(shares.dtype)
    return products


def _row_variance(exchange: Estimate, luminance: NDArray[np.floating]) -> NDArray[np.float64]:
    """Variance [Q, K] of the sums of W or X times luminances [Q, K].

    A path ends on one patch of one window, so the entries of a row are taken as independent.
    """
    return exchange.standard_error**2 @ luminance.ravel() ** 2
