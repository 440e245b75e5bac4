"""A fenestration system from the BSDF files of its layers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.resample import klems_of
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError


def combined_file(paths: Sequence[Path], name: str = "") -> tuple[BsdfFile, pd.DataFrame]:
    """The layers' system in the bands that all files have, and what each layer absorbs.

    Tensor trees and other bases are brought to the Klems full basis.

    Returns: the file, and one row for each band, side that the light comes from, incident patch
        and layer with its absorptance.
    Args: paths: the exterior layer first.
    """
    files = [read_bsdf_xml(path) for path in paths]
    bands = [band for band in files[0].bands if all(band in file.bands for file in files[1:])]
    if not bands:
        raise DataError("has no band that all the other layers have", file=paths[0])
    systems, tables = {}, []
    for band in bands:
        system = combine_layers([klems_of(file.band(band)) for file in files])
        systems[band] = system.bsdf
        for side, shares in (
            ("front", system.absorptance_front),
            ("back", system.absorptance_back),
        ):
            layer, patch = np.indices(shares.shape)
            tables.append(
                pd.DataFrame(
                    {
                        "band": band,
                        "side": side,
                        "patch": patch.ravel() + 1,
                        "layer": [str(paths[k]) for k in layer.ravel()],
                        "absorptance": shares.ravel(),
                    }
                )
            )
    thicknesses = [file.thickness for file in files]
    combined = BsdfFile(
        systems,
        name=name or " + ".join(f.name or p.stem for f, p in zip(files, paths, strict=True)),
        thickness=None if None in thicknesses else float(sum(thicknesses)),
        emissivity_front=files[0].emissivity_front,
        emissivity_back=files[-1].emissivity_back,
    )
    return combined, pd.concat(tables, ignore_index=True)
