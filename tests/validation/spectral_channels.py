"""Few bands of wavelength against 81 on the same paths: a room behind several panes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.spectra.channels import CHANNEL_SETS, channels_of
from tests.validation.spectral import WINDOWS, Light, Window, hour, photopic_light, received, room_scene

EVERY_5_NM = max(CHANNEL_SETS)
SKIES = ("overcast", "clear", "sun")


def main(*, data: Path = Path("../shared/data/bsdf/products_spectral")) -> str:
    """The table of docs/spectral.md: largest errors of three points under three skies.

    Windows whose files are not in the folder of data are left out.
    """
    rows = ["| window | bands | melanopic EDI % | DER % | CCT [K] |", "|---|---|---|---|---|"]
    scene, reflectance = room_scene()
    for name, (files, _) in WINDOWS.items():
        if not all((data / file).exists() for file in files):
            continue
        window = Window.of(name, data)
        found: dict[int, list[Light]] = {count: [] for count in CHANNEL_SETS}
        for sky in SKIES:
            light = photopic_light(window, hour(sky), scene)
            for count, of_skies in found.items():
                of_skies.append(received(light, window, channels_of(count), reflectance))
        exact = found.pop(EVERY_5_NM)
        for count, own in found.items():
            edi = max(_most(a.edi / b.edi - 1) for a, b in zip(own, exact, strict=True))
            ratio = max(_most(a.ratio / b.ratio - 1) for a, b in zip(own, exact, strict=True))
            kelvin = max(_most(a.kelvin - b.kelvin) for a, b in zip(own, exact, strict=True))
            rows.append(f"| {name} | {count} | {100 * edi:.2f} | {100 * ratio:.2f} | {kelvin:.0f} |")
    return "\n".join(rows)


def _most(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max())
