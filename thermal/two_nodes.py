"""The two-node model of pythermalcomfort for the hours of a year, in one compiled loop.

The package calls its compiled model of one hour from Python, which takes longer than the model
itself. `thermal.comfort` imports this module when it needs it.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from pythermalcomfort.models.two_nodes_gagge import _gagge_two_nodes_optimized as two_nodes
from pythermalcomfort.psychrometrics import p_sat_torr

from mitsuba_cfs.compiled import compiled

FloatArray = NDArray[np.float64]


def set_of_hours(
    air_c: FloatArray,
    mrt_c: FloatArray,
    speed: FloatArray,
    humidity: FloatArray,
    metabolic_rate: float,
    clothing: float,
) -> FloatArray:
    """SET [...] [degC] as of pythermalcomfort's `set_tmp`, neither rounded nor limited; the hours by all cores.

    Args: of one shape; humidity: relative [%]; metabolic_rate in met, clothing in clo.
    """
    vapour = humidity * p_sat_torr(air_c) / 100
    flat = [np.ravel(values).astype(float) for values in (air_c, mrt_c, speed, vapour)]
    threads = os.cpu_count() or 1
    parts = (np.array_split(values, threads) for values in flat)

    def of_part(*hours: FloatArray) -> FloatArray:
        return _set(*hours, float(metabolic_rate), float(clothing))

    with ThreadPoolExecutor(threads) as pool:
        return np.concatenate([*pool.map(of_part, *parts)]).reshape(air_c.shape)


@compiled(nogil=True)
def _set(
    air_c: FloatArray, mrt_c: FloatArray, speed: FloatArray, vapour_torr: FloatArray, met: float, clo: float
) -> FloatArray:
    """SET of each hour, standing, with the package's defaults for the body."""
    result = np.empty(air_c.size)
    for i in range(air_c.size):
        about = (air_c[i], mrt_c[i], speed[i], met, clo, vapour_torr[i])
        result[i] = two_nodes(*about, 0.0, 1.8258, 101325, "standing", False, 90, 500, False)[0]
    return result
