"""The closed state of blinds for IES LM-83: what is given, held by the window, or default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, States

DEFAULT_TRANSMITTANCE = 0.05  # diffuse, of a shade of which nothing is known: LM-83-12, 2.2.7
DEFAULT_NAME = Note("LM-83's default shade")


def open_and_closed(systems: Mapping[str, States], closed: FenestrationSystem | None) -> dict[str, States]:
    """The open and the closed state of each window, by its GUID; equal ones stay the same object.

    Open is the first state.  Closed is what is given, else the window's last state, else the
    default shade behind the open state.
    """
    known: dict[tuple[int, ...], States] = {}
    for states in systems.values():
        key = tuple(map(id, states))
        if key not in known:
            last = states[-1] if len(states) > 1 else None
            known[key] = (states[0], closed or last or with_default_shade(states[0]))
    return {guid: known[tuple(map(id, states))] for guid, states in systems.items()}


def with_default_shade(system: FenestrationSystem) -> FenestrationSystem:
    """A system with a shade behind it that passes 5 % diffusely and reflects nothing.

    For light alone: the solar band stays that of the open system.
    """
    visible = combine_layers([system.visible, diffuse_shade(DEFAULT_TRANSMITTANCE)]).bsdf
    return replace(
        system,
        name=Note("{system} with {shade}", system=system.name, shade=DEFAULT_NAME),
        visible=visible,
        tree=None,
        source=Note("{source}, behind it {shade} (5 % diffuse)", source=system.source, shade=DEFAULT_NAME),
    )


def diffuse_shade(transmittance: float) -> KlemsBsdf:
    """A layer that passes light evenly to all directions; what it does not pass it absorbs."""
    shape = (KLEMS_FULL.size, KLEMS_FULL.size)
    passed = np.full(shape, transmittance / KLEMS_FULL.projected_solid_angles().sum())
    none = np.zeros(shape)
    return KlemsBsdf(
        KLEMS_FULL,
        KLEMS_FULL,
        transmission_front=passed,
        transmission_back=passed,
        reflection_front=none,
        reflection_back=none,
    )
