"""Shades drawn outside or inside a window whose BSDF contains them already.

An IfcShadingDevice, or a proxy or covering that its name calls a curtain or a blind, counts as the
drawn shade of a window where it hangs in the window's plane and
fills it: all of it lies within `REACH` of the glass, on either side, and its outline, with the
gaps between slats closed, covers `COVERS` of the glass or more.  An overhang and a fin reach
further or cover a strip only; neighbours stand further away.  The limits are our own judgement:
the air gap of a blind or roller shade is 0.05 to 0.3 m, slats lie 0.02 to 0.2 m apart, and a blind
that is a third down is drawn as such.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Building, Element, Window
from bim.names import plain_text
from bim.planes import plane_through
from bim.report.issue import Issue

SHADES = "IfcShadingDevice"
NAMED = ("IfcBuildingElementProxy", "IfcCovering")  # shades where their name says so
SHADE_NAME = re.compile(
    r"curtain(?! ?wall)|drape|(?<![^\W_])blinds?(?![^\W_])|jalousie|rollo(?![^\W_])|raff?store"
    r"|rolll?ad|vorhang(?!fassade)|gardin|lamellenvorhang|rideau(?! ?mur)|persian|cortina|venezian"
    r"|gordijn|zonwering|zaves|zaluzi|roleta|zaslon|verho|カーテン|ブラインド|штор|жалюзи"
)
REACH = 0.5  # of the farthest part from the plane of the glass [m]
GAP = 0.3  # between slats that are closed to an outline [m]
COVERS = 0.3  # share of the glass


def without_drawn_shades(building: Building, shaded: Collection[str]) -> tuple[Building, tuple[Issue, ...]]:
    """The building without the drawn shades of windows, and a issue for each with its area.

    Args: shaded: GUIDs of the windows whose BSDF holds a shade.
    """
    windows = [window for window in building.windows if window.guid in shaded]
    devices: dict[str, list[Element]] = {}
    for element in building.elements:
        if _is_shade(element) and not element.is_kept:
            devices.setdefault(element.guid, []).append(element)
    issues = []
    for guid, parts in devices.items():
        triangles = np.concatenate([part.triangles for part in parts])
        outlines = [(window, _outline(triangles, window)) for window in windows]
        own = [(window, outline) for window, outline in outlines if not outline.is_empty]
        if not own:
            continue
        area = max(outline.area for _, outline in own)
        values = {
            "element": f"{parts[0].ifc_class} {parts[0].name}",
            "area": area,
            "windows": tuple(dict.fromkeys(window.name or window.guid for window, _ in own)),
        }
        issues.append(Issue("shade-drawn-and-in-system", guid, values))
    gone = {issue.where for issue in issues}
    if not gone:
        return building, ()
    kept = tuple(element for element in building.elements if element.guid not in gone)
    found = tuple(issues)
    return replace(building, elements=kept, issues=(*building.issues, *found)), found


def is_named_shade(name: str) -> bool:
    """Whether a name says curtain or blind."""
    return SHADE_NAME.search(plain_text(name)) is not None


def hangs_at(triangles: NDArray[np.float64], window: Window) -> bool:
    """Whether a body [N, 3, 3] is the drawn shade of a window."""
    return not _outline(triangles, window).is_empty


def _is_shade(element: Element) -> bool:
    named = element.ifc_class.startswith(NAMED) and is_named_shade(element.name)
    return named or element.ifc_class.startswith(SHADES)


def _outline(triangles: NDArray[np.float64], window: Window) -> shapely.Geometry:
    """Outline on the window's plane of a device [N, 3, 3] that shades it; empty if it does not."""
    plane = plane_through(window.triangles[0, 0], window.normal)
    local = plane.to_plane(triangles)
    if np.abs(local[..., 2]).max() > REACH:
        return shapely.Polygon()
    glass = shapely.union_all(_flat(plane.to_plane(window.triangles)))
    # a slat that lies flat is a line seen along the window's normal: its hull, widened, is none
    wide = shapely.union_all(shapely.buffer(_flat(local), GAP / 2, cap_style="square"))
    outline = shapely.buffer(wide, -GAP / 2, join_style="mitre")
    covered = outline.intersection(glass).area >= COVERS * glass.area
    return outline if covered else shapely.Polygon()


def _flat(triangles: Sequence) -> NDArray[Any]:
    """Hulls of triangles [N, 3, 3] on their plane: polygons, or lines where seen from the side."""
    return shapely.convex_hull(shapely.multipoints(np.asarray(triangles)[..., :2]))
