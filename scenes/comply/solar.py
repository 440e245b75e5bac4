"""Sentences on how much of the sun's heat the windows' systems let in: g_tot, maybe its class."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from mitsuba_cfs.notes import Note
from scenes.comply.blinds import DEFAULT_NAME
from scenes.fenestration.ratings import system_ratings
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_system import thermal_system
from thermal.errors import ThermalInputError
from thermal.ratings import CLASSES, ThermalRating

STANDARD = "ISO 52022-3, reference"  # the method that is named where a system's layers are known


def solar_sentences(systems: Mapping[str, States]) -> Iterator[str]:
    """Of each state of the windows' systems: g_tot at normal incidence and EN 14501's class.

    LM-83's default shade is a figure for light alone: it has no heat to be rated.
    """
    distinct = {id(state): state for states in systems.values() for state in states}
    for system in distinct.values():
        if DEFAULT_NAME in system.name:
            continue
        try:
            yield solar_sentence(system)
            yield from thermal_system(system).notes
        except ThermalInputError as error:
            yield Note(
                "{system}: g_tot is unknown: {reason}.", system=system.name, reason=error.message
            )


def solar_sentence(system: FenestrationSystem) -> str:
    """A system's g_tot, the method that gives it, and EN 14501's class of it.

    Raises: `ThermalInputError` where U, g and the BSDF do not go together.
    """
    heat = thermal_system(system)
    found = {rating.method: rating for rating in system_ratings(system, heat)}
    rating: ThermalRating = found.get(STANDARD) or found["heat balance"]
    limits = ", ".join(f"{limit:.2f}" for limit in CLASSES["g"])
    source = Note("as in the heat balance") if rating.method == "heat balance" else rating.method
    return Note(
        "{system}: g_tot {g:.2f} at normal incidence ({source}), class {solar_class} for the "
        "limits {limits} of EN 14501 (not verified).",
        system=system.name,
        g=rating.g_value,
        source=source,
        solar_class=rating.solar_class("g"),
        limits=limits,
    )
