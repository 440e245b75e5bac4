"""The verdict at the head of a report: what was asked, three sentences, figures against limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.language.catalogue import month_name, said
from scenes.report.glare_figures import sun_words
from scenes.report.headline import WARM_C, Card, heated, occupied
from scenes.report.limits import LimitTables, limits, plus_minus
from scenes.report.numbers import counted, percent, rounded, significant
from scenes.report.tables import glare_class, spoken, step_hours
from scenes.results import ExploredRoom, LuminancePicture, RoomYear, RunResult

MOST_NAMES = 4  # of systems in the first sentence, of rooms in that on shading
LIT_LX = 300.0  # illuminance of daylight autonomy
# DGP is BY_LIGHT times the illuminance at the eye, a term of the sources, and NO_LIGHT
BY_LIGHT, NO_LIGHT = 5.87e-5, 0.159


@dataclass(frozen=True, slots=True)
class Verdict:
    """One page for who reads no more."""

    asked: str
    sentences: tuple[tuple[str, str], ...]  # heading, text
    limits: LimitTables


def verdict(result: RunResult, cards: Sequence[Sequence[Card]]) -> Verdict:
    """The verdict of a run.

    Args: cards: the headline figures of each room.
    """
    names = [room.space.label for room in result.spaces]
    used = result.manifest.get("fenestration", ())
    systems = list(dict.fromkeys(f"“{one['system']}”" for one in used))
    asked = said(
        "Daylight, glare and temperatures of {rooms} of {building} in a year of {weather}, with "
        "{systems}, by the {method} method.",
        rooms=names[0] if len(names) == 1 else counted(len(names), "room"),
        building=result.building.name or said("the building"),
        weather=result.manifest.get("site") or said("the given weather"),
        systems=_systems(systems)
        or result.manifest.get("system")
        or said("what fills its windows"),
        method=said(result.method),
    )
    sentences = (
        (said("Glare"), _glare(result)),
        (said("Warmth"), _warmth(result)),
        (said("Shading"), _shading(result)),
    )
    named = [(r.space.label, r, own) for r, own in zip(result.spaces, cards, strict=True)]
    return Verdict(asked, sentences, limits(named, said("Room")))


def _systems(names: Sequence[str]) -> str:
    """All of them, or how many where they are more than a line holds."""
    return ", ".join(names) if len(names) <= MOST_NAMES else counted(len(names), "system")


def _glare(result: RunResult) -> str:
    """Why it glares at its worst."""
    found = [(p.glare["dgp"], room, p) for room in result.spaces for p in room.glare.pictures]
    if not found:
        return said("No picture was made, so that glare is not known.")
    dgp, room, picture = max(found, key=lambda one: one[0])
    value = rounded(dgp, 2) + plus_minus(picture)
    where = f"{room.space.label}, {spoken(result.times[picture.hour])}"
    if glare_class(dgp) == "imperceptible":
        return said(
            "No picture has more than imperceptible glare; the highest DGP is {dgp} ({where}).",
            dgp=value,
            where=where,
        )
    text = said(
        "Of {count} pictures the worst has {glare}, DGP {dgp} ({where}): {sun}, and {cause}."
        if len(found) > 1
        else "The one picture made has {glare}, DGP {dgp} ({where}): {sun}, and {cause}.",
        count=len(found),
        glare=said(f"{glare_class(dgp)} glare"),
        dgp=value,
        where=where,
        sun=sun_words(result, picture.hour),
        cause=_cause(picture),
    )
    if room.annual_glare is not None and occupied(room).any():
        year = room.annual_glare["dgp"].fillna(0.0).to_numpy()[occupied(room).to_numpy()]
        text += " " + said(
            "DGP is above 0.40 in {share} % of the occupied hours.",
            share=percent(100 * float((year > 0.40).mean())),
        )
    return text


def _cause(picture: LuminancePicture) -> str:
    """Which term of DGP is the larger."""
    glare = picture.glare
    if "ev" not in glare:
        return said("bright surfaces are in view")
    by_light = BY_LIGHT * glare["ev"]
    by_sources = glare["dgp"] - NO_LIGHT - by_light
    lux = significant(glare["ev"], 2)
    count = int(glare.get("sources", 0))
    many = counted(count, "bright source")
    if by_sources > by_light:
        return said(
            "{sources} in view weigh more than the {lux} lx at the eye ({parts})",
            sources=many,
            lux=lux,
            parts=_parts(by_sources, by_light),
        )
    if count == 0 or by_sources <= 0:
        return said("the {lux} lx at the eye are all of it", lux=lux)
    return said(
        "the {lux} lx at the eye weigh more than {sources} in view ({parts})",
        sources=many,
        lux=lux,
        parts=_parts(by_light, by_sources),
    )


def _parts(one: float, other: float) -> str:
    """Two shares of what DGP has beyond its value without light."""
    part = round(100 * one / (one + other))
    return said("{one} to {other} %", one=part, other=100 - part)


def _warmth(result: RunResult) -> str:
    """When it is too warm."""
    rooms = [room for room in result.spaces if "operative_c" in room.heat.temperatures]
    if not rooms:
        return said("Temperatures were not computed.")
    hours = [_warm_hours(room) for room in rooms]
    room, warm = max(  # of rooms too warm in as many hours, the hottest
        zip(rooms, hours, strict=True),
        key=lambda one: (one[1].sum(), one[0].heat.operative_c.max()),
    )
    if not warm.any():
        none = said("No occupied hour is above {limit} °C.", limit=f"{WARM_C:.0f}")
        return f"{none} {heated(room)}"
    times, step = room.heat.temperatures.index, step_hours(room.heat.temperatures.index)
    months = np.bincount(times.month[warm], minlength=13)
    month = times[warm][times.month[warm] == months.argmax()][0]
    total, peak = occupied(room).sum() * step, room.heat.operative_c
    text = said(
        "{room} is above {limit} °C in {hours} of its {total} occupied hours, most of them in "
        "{month}; the highest operative temperature is {peak} °C, {hour}.",
        room=room.space.label,
        limit=f"{WARM_C:.0f}",
        hours=rounded(warm.sum() * step, 0),
        total=rounded(total, 0),
        month=month_name(month.month),
        peak=rounded(float(peak.max()), 1),
        hour=spoken(peak.idxmax()),
    )
    return f"{text} {heated(room)}"


def _warm_hours(room: RoomYear) -> NDArray[np.bool_]:
    return (room.heat.operative_c.to_numpy() > WARM_C) & occupied(room).to_numpy()


def _shading(result: RunResult) -> str:
    """What the shading costs in daylight."""
    moved = [r for r in result.spaces if r.operation is not None and len(r.operation.states) > 1]
    if not moved:
        return said(
            "What fills the windows stays in one state all year: all figures are of that state."
        )
    drawn = [_drawn(room) for room in moved]
    cost = [None if r.explored is None else _autonomies(r, r.explored) for r in moved]
    found = list(zip(moved, drawn, cost, strict=True))
    if len(moved) > MOST_NAMES:
        found.sort(key=lambda one: -one[1])
        parts = [
            said(
                "In {rooms} the shading is drawn in {least} to {most} % of the occupied daylight "
                "hours, most in {room}.",
                rooms=counted(len(moved), "room"),
                least=percent(min(drawn)),
                most=percent(max(drawn)),
                room=found[0][0].space.label,
            )
        ]
        found = found[:1]  # what it costs where it is drawn most
    else:
        parts = []
    parts += [_shading_of(*one) for one in found if not parts or one[2] is not None]
    if not any(r.explored for r in moved):
        parts.append(said("--explore tells what that costs in daylight."))
    return " ".join(parts)


def _drawn(room: RoomYear) -> float:
    """Occupied hours with daylight in which the shading is not in its first state [%]."""
    if room.operation is None:
        return 0.0
    states = room.operation.hours["shading_state"].to_numpy()
    used = occupied(room).to_numpy() & (room.daylight.illuminance.max(axis=1) > 0)
    return 100 * float((states[used] > 0).mean()) if used.any() else 0.0


def _shading_of(room: RoomYear, drawn: float, cost: tuple[float, float] | None) -> str:
    facts = {"room": room.space.label, "share": percent(drawn)}
    if cost is None:
        return said(
            "In {room} the shading is drawn in {share} % of the occupied daylight hours.", **facts
        )
    return said(
        "In {room} the shading is drawn in {share} % of the occupied daylight hours, which lowers "
        "daylight autonomy from {most} to {least} %.",
        **facts,
        most=percent(cost[0]),
        least=percent(cost[1]),
    )


def _autonomies(room: RoomYear, explored: ExploredRoom) -> tuple[float, float]:
    """Daylight autonomy [%], mean of the sensors, with the shading open and as operated."""
    used = occupied(room).to_numpy()
    total = max(int(used.sum()), 1)
    lit = used[explored.lit]
    state, light = explored.operated[explored.lit], np.stack(explored.illuminance)
    as_run = light[state, :, np.arange(len(state))]  # [L, S]
    found = [(one[lit] >= LIT_LX).sum(axis=0).mean() for one in (light[0].T, as_run)]
    return 100 * float(found[0]) / total, 100 * float(found[1]) / total
