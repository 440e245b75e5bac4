"""Glass and open doorways between rooms: window groups that face another room, not the outdoors.

A doorway is a pane of transmittance 1. A room without windows passes light on: each room receives
light from rooms that are at most as many panes away from the nearest window, and these from rooms
that are fewer panes away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.defaults import GLASS_REFLECTANCE, ROOM_REFLECTANCE
from bim.doorways import THINNEST, light_sources, panes_between, panes_to_windows, reveals_between, wall_depth
from bim.model import Building, Element, Face, Space
from bim.to_tracer import element_surfaces, exterior_surfaces, furnished_surfaces, reflectance_groups, window_groups
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.methods.light import SeasonalLight, group_shares
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics, SystemOptics, straight_transmittance
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import AdjacentRoom, DaylightScene
from mitsuba_cfs.notes import Note
from mitsuba_cfs.surfaces import SurfaceGroups, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.scattering import AngularScattering
from scenes.fenestration.resolver import StatedValues, glazing_system
from scenes.fenestration.systems import States
from scenes.room.windows import room_windows

CLEAR = 0.88  # visible transmittance of glass without a value: a float pane of 6 mm, EN 410
PANE = "glass between rooms"  # name of a pane in the scene of the room beyond, where it is opaque


@dataclass(frozen=True, slots=True)
class InnerGlass:
    """The window groups of a room that face other rooms, with the scenes of these rooms."""

    interior: Surfaces  # the room without this glass
    groups: tuple[WindowGroup, ...]  # axis I
    optics: tuple[tuple[SystemOptics, ...], ...]  # [I], each of one state
    beyond: tuple[AdjacentRoom, ...]  # [I]
    names: tuple[str, ...]  # [I] labels of the rooms beyond
    area: float  # of the glass [m2]
    open_area: float  # of the doorways [m2]
    faces: frozenset[str]  # names of the room's faces that the glass replaces
    by_groups: SurfaceGroups  # of the interior
    spectra: tuple[SpectralFactor, ...]  # [I] of the light of the rooms beyond


def inner_glass(building: Building, space: Space, systems: Mapping[str, States]) -> InnerGlass | None:
    """Glass and doorways of a room to rooms with daylight; None without any.

    The windows of these rooms are in their first state, the glass is a clear pane of its stated
    transmittance, a doorway transmits everything. The wall's thickness is a tube of reveals beyond
    the glass.

    Args: systems: of the windows of all these rooms, by their GUID.
    """
    away = panes_to_windows(building)
    return _inner_glass(building, space, systems, away, away.get(space.guid, -1) + 1)


def _inner_glass(
    building: Building, space: Space, systems: Mapping[str, States], away: Mapping[str, int], below: int
) -> InnerGlass | None:
    """Inner glass to rooms fewer than `below` panes away from a window."""
    panes, used = [], []
    dark = AngularScattering(np.zeros(2), np.zeros(2))  # the sun is part of the sky patches
    for other in light_sources(building, space, away, below):
        pairs = panes_between(building.spaces, space)[other.guid]
        onward = _inner_glass(building, other, systems, away, away[other.guid])
        scene, through, spectrum = _room_beyond(building, other, pairs, systems, onward)
        used += [face for face, _ in pairs]
        for optics, group in _groups(space, [face for face, _ in pairs]):
            matrix_optics = MatrixOptics(optics.transmission, dark, reflection=optics.reflection)
            beam = np.diag(optics.transmission)
            named = replace(group, name=f"{group.name}, to {other.label}")
            beyond = AdjacentRoom(
                scene, tuple(one.transmission for one in through), tuple(map(straight_transmittance, through)), beam
            )
            panes.append((named, (matrix_optics,), beyond, other.label, spectrum))
    if not panes:
        return None
    names = frozenset(face.name for face in used)
    rest = replace(space, faces=tuple(face for face in space.faces if face.name not in names))
    areas = [sum(f.area for f in used if f.pane.is_open == is_open) for is_open in (False, True)]
    groups, optics, beyond_, labels, spectra = map(tuple, zip(*panes, strict=True))
    interior, by_groups = furnished_surfaces(rest), reflectance_groups(rest)
    return InnerGlass(interior, groups, optics, beyond_, labels, *areas, names, by_groups, spectra)


def borrowed_share(space: Space, light: PhaseLight | SeasonalLight, inner: InnerGlass | None) -> str:
    """A sentence on the share of the sensors' light over the year that inner glass gives."""
    if inner is None:
        return ""
    first, sums = len(light.scene.outdoor_groups), group_shares(light)
    share = float(sums[first:].sum() / max(sums.sum(), 1e-9))
    return Note(
        "Room {room} receives {share:.0f} % of its daylight through {glass:.1f} m2 of inner glass "
        "and {open:.1f} m2 of open doorways from {rooms}; their sun is averaged over sky patches, "
        "their blinds are in the first state, and the heat balance of a room alone omits it.",
        room=space.label,
        share=100 * share,
        glass=inner.area,
        open=inner.open_area,
        rooms=", ".join(dict.fromkeys(inner.names)),
    )


def _groups(space: Space, faces: Sequence[Face]) -> list[tuple[SystemOptics, WindowGroup]]:
    """Panes of a room in groups of one orientation and one transmittance, with their optics."""
    by_tau: dict[float | None, list[Any]] = {}
    for face in faces:
        tau = None if face.pane.is_open else face.pane.visible_transmittance or CLEAR
        by_tau.setdefault(tau, []).append(face.pane)
    groups = []
    for tau, panes in by_tau.items():
        optics: SystemOptics = MatrixOptics(np.eye(KLEMS_FULL.size))
        if tau is not None:
            glass = glazing_system(StatedValues(tau, None, None, None, 1), "the model")
            optics = BsdfOptics(glass.visible, glass.fine, glass.angular)
        of_tau = window_groups(replace(space, windows=tuple(panes)))
        groups += [(optics, group) for group in of_tau]
    return groups


def _room_beyond(
    building: Building,
    room: Space,
    pairs: Sequence[tuple[Face, Face]],
    systems: Mapping[str, States],
    onward: InnerGlass | None,
) -> tuple[DaylightScene, list[SystemOptics], SpectralFactor]:
    """The scene of a room beyond panes, the optics of all glass that lights it, and the colour of that light."""
    open_ = {back.name for _, back in pairs} | (set() if onward is None else onward.faces)
    opaque = [face for face in room.faces if face.name not in open_]
    glass = [
        _piece(face, PANE, face.triangles, back.reflectance_visible if back.pane.is_open else GLASS_REFLECTANCE)
        for face, back in pairs
    ]
    reveals = [
        _piece(
            face, "reveal", reveals_between(face, wall_depth(face, back)).reshape(-1, 3, 3), ROOM_REFLECTANCE["reveal"]
        )
        for face, back in pairs
        if wall_depth(face, back) > THINNEST
    ]
    windows = room_windows(room, systems)
    scene = DaylightScene(
        element_surfaces([*opaque, *room.furniture, *glass, *reveals]),
        exterior_surfaces(building, room),
        (*windows.groups, *(() if onward is None else onward.groups)),
        adjacent=() if onward is None else onward.beyond,
    )
    optics = [states[0] for states in (*windows.optics(), *(() if onward is None else onward.optics))]
    spectra = [states[0].spectrum or SpectralFactor.neutral() for states in windows.systems]
    spectra += () if onward is None else onward.spectra
    # of diffuse light outdoors
    amounts = [
        group.area * float(KLEMS_FULL.projected_solid_angles() @ one.transmission.sum(axis=1))
        for group, one in zip(scene.groups, optics, strict=True)
    ]
    return scene, optics, SpectralFactor.of_diffuse_light(spectra, amounts)


def _piece(face: Face, name: str, triangles: NDArray[np.float64], reflectance: float) -> Element:
    """A surface of the room beyond at the pane of a face."""
    return Element(face.pane.guid, name, "IfcWindow", triangles, reflectance, reflectance)
