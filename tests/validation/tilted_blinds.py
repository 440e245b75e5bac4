"""An exterior blind at several slat tilts before the demo's glazing, as BSDF files of a family.

Slats and panes are those of `tests.demo.make_blind`; each tilt is traced by this project's virtual
goniophotometer.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.glazing import specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.xml import BsdfFile, write_bsdf_xml
from scenes.demo import VENETIAN_BLIND
from tests.demo.make_blind import BEAM, BEFORE_BLIND, BLIND, BLIND_TOTAL, PANES, thermal_values

GLAZING = Path(VENETIAN_BLIND).with_name("glazing.xml")
WIDTH, SPACING, RADIUS = 0.080, 0.072, 0.104  # [m]


def write_blind(folder: Path, tilt_deg: float, samples: int) -> Path:
    """The BSDF file of the blind at a tilt, with its thermal file beside it."""
    path = folder / f"blind_{tilt_deg:04.1f}.xml"
    layer = venetian_blind(BLIND, depth=WIDTH, radius=RADIUS, spacing=SPACING, tilt=np.radians(tilt_deg))
    blind = generate_klems(layer, samples=samples, seed=1).bsdf[0]
    systems = {
        band: combine_layers([blind, *(specular_klems(pane, KLEMS_FULL) for pane in pair)])
        for band, pair in PANES.items()
    }
    file = BsdfFile({band: system.bsdf for band, system in systems.items()}, name=path.stem)
    write_bsdf_xml(file, path, digits=5)
    text = thermal_values(systems["Solar"], BEFORE_BLIND, BLIND_TOTAL) + BEAM
    path.with_suffix(".toml").write_text(text, encoding="utf-8")
    return path


def family_tables(files: Iterable[Path], tilts_deg: Iterable[float]) -> str:
    """The `[[system]]` tables: glazing without the blind, then the blind at each tilt."""
    blinds = "".join(
        f'[[system]]\nbsdf = "{file}"\ntilt_deg = {tilt}\n' for file, tilt in zip(files, tilts_deg, strict=True)
    )
    return f'[[system]]\nbsdf = "{GLAZING}"\n{blinds}'
