"""A blind that is drawn in the model and held by the BSDF of its window is traced once."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np

from bim.drawn_shades import without_drawn_shades
from bim.model import Building
from bim.report.issue import issue_text
from scenes.fenestration.systems import FenestrationSystem, States

SCATTERED = (
    0.05  # share of the transmitted light beside the straight ray, above it there is a shade
)

_log = logging.getLogger(__name__)


def traced_building(building: Building, systems: Mapping[str, States]) -> Building:
    """The building without the devices that a window's BSDF holds; the log names each.

    Args: systems: of each window, by its GUID.
    """
    held = {id(system): holds_shade(system) for states in systems.values() for system in states}
    shaded = {
        guid for guid, states in systems.items() if any(held[id(system)] for system in states)
    }
    building, issues = without_drawn_shades(building, shaded)
    for issue in issues:
        _log.warning("%s", issue_text(issue).line)
    return building


def holds_shade(system: FenestrationSystem) -> bool:
    """Whether a system holds a shade: by the stated place of its shade, else by its light.

    Clear panes pass light straight on, into one patch for each direction; slats and fabrics
    scatter.  Light of all directions counts as from a uniform sky.
    """
    if system.shading_position is not None:
        return system.shading_position != "none"
    bsdf = system.visible
    omega = bsdf.basis_in.projected_solid_angles()
    flux = bsdf.transmission_front * bsdf.basis_out.projected_solid_angles()[:, None]
    passed = flux.sum(axis=0) @ omega
    straight = np.maximum(flux.max(axis=0), 0.0) @ omega
    return bool(passed > 0 and 1.0 - straight / passed > SCATTERED)
