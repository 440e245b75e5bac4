"""Energy conservation of a BSDF: small excess is noted, large excess is refused."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.errors import DataError

ENERGY_LIMIT = 1.01  # share of a hemisphere's light above which a file is refused
DIRECTION_LIMIT = 1.5  # times as much, of a single direction: no noise of a measurement
ENERGY_SLACK = 1e-3  # above 1 by which rounded files may be


def check_energy(bsdf: Bsdf, limit: float, *, file: str | PathLike[str], band: str) -> tuple[str, ...]:
    """Notes on energy conservation; `DataError` where a side scatters more light than it receives.

    Grazing directions of measured and computed data often do so by a few per cent, and contain
    little of the light: they are noted.  Refused is a side that scatters more than `limit` of the
    light of a uniform hemisphere, or of any direction more than 1.5 times that.
    """
    notes = []
    for side in ("front", "back"):
        either: Any = bsdf  # whose blocks are of its kind
        blocks = {n: either.direct_hemispherical(b) for n, b in bsdf.blocks().items()}
        shares = {n.replace("_", " "): share for n, share in blocks.items() if n.endswith(side)}
        if len(shares) == 2:
            shares[f"transmission and reflection {side}"] = bsdf.scattered(side)
        for name, share in shares.items():
            if gains_energy(bsdf, share, limit):
                where = int(np.argmax(share))
                what = f"direction {where} scatters {100 * share[where]:.1f} % of its light"
                raise DataError(f"incident {what}", file=file, element=band, field=name)
        whole = bsdf.scattered(side)
        if whole.max() > limit:
            notes.append(f"{band} {side}: {excess(whole, limit - 1)}; used as they are")
    return tuple(notes)


def gains_energy(bsdf: Bsdf, share: NDArray[np.float64], limit: float) -> bool:
    """Whether the scattered `share` [incident] of the light is implausibly large."""
    mean = np.average(share, weights=bsdf.incident_weights(len(share)))
    return bool(mean > limit or share.max() > DIRECTION_LIMIT * limit)


def excess(share: NDArray[np.float64], slack: float) -> str:
    """Number of directions that scatter more than they receive, and the largest share."""
    worst = int(np.argmax(share))
    return (
        f"{np.count_nonzero(share > 1 + slack)} of {len(share)} directions scatter more than they "
        f"get, direction {worst} {100 * share[worst]:.1f} %"
    )
