"""The fenestration systems of the case studies, made by the virtual goniophotometer."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.glazing import specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial
from mitsuba_cfs.bsdf.screens import woven_screen
from mitsuba_cfs.bsdf.xml import BsdfFile, write_bsdf_xml
from tests.demo.make_blind import (
    BEFORE_BLIND,
    BLIND,
    BLIND_TOTAL,
    GLAZING_U,
    INNER_FILM,
    OUTER_FILM,
    PANES,
    thermal_values,
)

PATHS = 16384  # of the goniophotometer, for each incident patch and side
# The dissertation does not say which shade: a light fabric, about a fifth of the light passes
SHADE = SlatMaterial("white fabric", (0.65,), (0.65,), transmittance=(0.12,))
OPENNESS = 0.10  # of the shade: what normal light passes
MESH, THREAD = 0.001, 0.0004  # its spacing and thickness [m]


def blind_before_glazing(folder: Path, tilt_deg: float) -> Path:
    """BSDF file of the dissertation's blind outside of double low-e glazing; U and g beside it."""
    layer = venetian_blind(BLIND, depth=0.080, radius=0.104, spacing=0.072, tilt=np.radians(tilt_deg))
    return _before_glazing(folder / f"blind_{tilt_deg:.0f}.xml", layer, f"blind {tilt_deg:.0f}")


def shade_before_glazing(folder: Path) -> Path:
    """BSDF file of a woven shade outside of the glazing; U and g beside it."""
    layer = woven_screen(SHADE, spacing=MESH, openness=OPENNESS, thickness=THREAD)
    return _before_glazing(folder / "shade.xml", layer, "exterior shade")


def glazing(folder: Path) -> Path:
    """BSDF file of the double low-e glazing by itself; U and g beside it."""
    systems = {
        band: combine_layers([specular_klems(pane, KLEMS_FULL) for pane in panes]) for band, panes in PANES.items()
    }
    path = folder / "glazing.xml"
    bands = {band: system.bsdf for band, system in systems.items()}
    write_bsdf_xml(BsdfFile(bands, name="double low-e glazing"), path)
    solar = systems["Solar"]
    # EN 410: the heat of the outer pane passes the gap, that of the inner pane only its film
    inward = np.array([OUTER_FILM * GLAZING_U, 1 - INNER_FILM * GLAZING_U])
    through = solar.bsdf.direct_hemispherical(solar.bsdf.transmission_front)
    g = through + inward @ solar.absorptance_front
    path.with_suffix(".toml").write_text(f"u_value = {GLAZING_U:.3f}\ng_value = {g[0]:.4f}\n", encoding="utf-8")
    return path


def _before_glazing(path: Path, layer: PeriodicLayer, name: str) -> Path:
    shade = generate_klems(layer, samples=PATHS, seed=1).bsdf[0]
    systems = {
        band: combine_layers([shade, *(specular_klems(pane, KLEMS_FULL) for pane in panes)])
        for band, panes in PANES.items()
    }
    bands = {band: system.bsdf for band, system in systems.items()}
    write_bsdf_xml(BsdfFile(bands, name=f"{name}, double low-e glazing"), path)
    values = thermal_values(systems["Solar"], BEFORE_BLIND, BLIND_TOTAL)
    path.with_suffix(".toml").write_text(values, encoding="utf-8")
    return path
