"""A fenestration system from its panes alone: no BSDF file is needed where nothing scatters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mitsuba_cfs.bsdf.angular import ANGLES, AngularTable, specular_matrices, stack_table
from mitsuba_cfs.bsdf.glazing import Pane
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, spectral_glazing
from mitsuba_cfs.notes import Note
from scenes.fenestration.layer_tables import GlazingLayerTable, spectral_panes
from scenes.fenestration.systems import FenestrationSystem

BANDS = ("Visible", "Solar")


def system_of_panes(layers: Sequence[GlazingLayerTable]) -> FenestrationSystem:
    """The system of panes from outside to inside, light of both bands by its angle of incidence.

    Panes that all come from files are computed wavelength by wavelength, others band by band: an
    uncoated one by Fresnel's equations, one whose sides differ as coated
    (`mitsuba_cfs.bsdf.angular.stack_table`).
    """
    name = "panes " + ", ".join(_named(layer) for layer in layers)
    panes = spectral_panes(layers)
    if panes:
        notes, tables = [], _by_wavelength(panes)
    else:
        notes = [
            Note(
                "{system}: layer {number} has no visible values; its solar values are used.",
                system=name,
                number=number,
            )
            for number, layer in enumerate(layers, start=1)
            if layer.pane is None and layer.visible is None
        ]
        tables = {band: stack_table([_pane(one, band) for one in layers]) for band in BANDS}
    visible, solar = (specular_matrices(tables[band]) for band in BANDS)
    return FenestrationSystem(
        name, visible, solar, shading_position="none", notes=tuple(notes),
        angular=tables["Visible"], panes=panes,
    )  # fmt: skip


def _by_wavelength(panes: Sequence[SpectralPane]) -> dict[str, AngularTable]:
    found = spectral_glazing(panes, ANGLES)
    return {
        band: AngularTable(
            ANGLES,
            *(
                np.clip(values, 0.0, 1.0)
                for values in (one.transmittance, one.reflectance_front, one.reflectance_back)
            ),
        )
        for band, one in found.items()
    }


def _pane(layer: GlazingLayerTable, band: str) -> Pane:
    """The pane in a band, by the values at normal incidence that its table or its file states."""
    values = layer.solar
    if band == "Visible" and layer.visible is not None:
        values = layer.visible
    elif layer.pane is not None and (band == "Visible" or values is None):
        one = spectral_glazing([layer.spectral()])[band]
        values = tuple(
            float(value[0])
            for value in (one.transmittance, one.reflectance_front, one.reflectance_back)
        )
    tau, front, back = values
    return Pane(_named(layer), tau, front, back, coated=front != back)


def _named(layer: GlazingLayerTable) -> str:
    return f"{1e3 * layer.thickness:g} mm" if layer.pane is None else layer.pane.stem
