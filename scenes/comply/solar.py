"""Sentences on how much of the sun's heat the windows' systems let in: g_tot, maybe its class."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

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
        except ThermalInputError as error:
            yield f"{system.name}: g_tot is not known: {error.message}."


def solar_sentence(system: FenestrationSystem) -> str:
    """A system's g_tot, the method that gives it, and EN 14501's class of it.

    Raises: `ThermalInputError` where U, g and the BSDF do not go together.
    """
    heat = thermal_system(system)
    found = {rating.method: rating for rating in system_ratings(system, heat)}
    rating: ThermalRating = found.get(STANDARD) or found["heat balance"]
    limits = ", ".join(f"{limit:.2f}" for limit in CLASSES["g"])
    source = "as the heat balance takes it" if rating.method == "heat balance" else rating.method
    return " ".join(
        (
            f"{system.name}: g_tot {rating.g_value:.2f} at normal incidence ({source}), "
            f"class {rating.solar_class('g')} if EN 14501's limits are {limits}, which could not "
            "be checked.",
            *heat.notes,
        )
    )
