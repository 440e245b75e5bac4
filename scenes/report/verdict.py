"""The verdict at the head of a report: what was asked, three sentences, figures against limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.report.glare_figures import sun_words
from scenes.report.headline import WARM_C, Card, heated, occupied
from scenes.report.numbers import percent, rounded, share, significant
from scenes.report.tables import Column, Table, glare_class, spoken, step_hours
from scenes.results import ExploredRoom, LuminancePicture, RoomYear, RunResult

LIT_LX = 300.0  # illuminance of daylight autonomy
# DGP is BY_LIGHT times the illuminance at the eye, a term of the sources, and NO_LIGHT
BY_LIGHT, NO_LIGHT = 5.87e-5, 0.159


@dataclass(frozen=True, slots=True)
class Verdict:
    """One page for who reads no more."""

    asked: str
    sentences: tuple[tuple[str, str], ...]  # heading, text
    limits: Table


def verdict(result: RunResult, cards: Sequence[Sequence[Card]]) -> Verdict:
    """The verdict of a run.

    Args: cards: the headline figures of each room.
    """
    names = [room.space.label for room in result.spaces]
    rooms = names[0] if len(names) == 1 else f"{len(names)} rooms"
    systems = [f"“{one['system']}”" for one in result.manifest.get("fenestration", ())]
    system = " and ".join(systems) or result.manifest.get("system") or "what fills its windows"
    asked = (
        f"Daylight, glare and temperatures of {rooms} of {result.building.name or 'the building'} "
        f"in a year of {result.manifest.get('site') or 'the given weather'}, with {system}, "
        f"by the {result.method} method."
    )
    sentences = (
        ("Glare", _glare(result)),
        ("Warmth", _warmth(result)),
        ("Shading", _shading(result)),
    )
    return Verdict(asked, sentences, _limits(result, cards))


def _glare(result: RunResult) -> str:
    """Why it glares at its worst."""
    found = [(p.glare["dgp"], room, p) for room in result.spaces for p in room.glare.pictures]
    if not found:
        return "No picture was made, so that glare is not known."
    dgp, room, picture = max(found, key=lambda one: one[0])
    value = rounded(dgp, 2) + _plus_minus(picture)
    where = f"{room.space.label}, {spoken(result.times[picture.hour])}"
    if glare_class(dgp) == "imperceptible":
        return (
            f"No picture has more than imperceptible glare; the highest DGP is {value} ({where})."
        )
    text = f"Of {len(found)} pictures the worst" if len(found) > 1 else "The one picture made"
    text += f" has {glare_class(dgp)} glare, DGP {value} ({where}): "
    text += f"{sun_words(result, picture.hour)}, and {_cause(picture)}."
    if room.annual_glare is not None and occupied(room).any():
        year = room.annual_glare["dgp"].fillna(0.0).to_numpy()[occupied(room).to_numpy()]
        text += f" DGP is above 0.40 in {percent(100 * float((year > 0.40).mean()))} % of the "
        text += "occupied hours."
    return text


def _cause(picture: LuminancePicture) -> str:
    """Which term of DGP is the larger."""
    glare = picture.glare
    if "ev" not in glare:
        return "bright surfaces are in view"
    by_light = BY_LIGHT * glare["ev"]
    by_sources = glare["dgp"] - NO_LIGHT - by_light
    light = f"{significant(glare['ev'], 2)} lx at the eye"
    count = int(glare.get("sources", 0))
    many = f"{count} bright sources" if count > 1 else "a bright source"
    if by_sources > by_light:
        return f"{many} in view weigh more than the {light} ({_parts(by_sources, by_light)})"
    if count == 0 or by_sources <= 0:
        return f"the {light} are all of it"
    return f"the {light} weigh more than {many} in view ({_parts(by_light, by_sources)})"


def _parts(one: float, other: float) -> str:
    """Two shares of what DGP has beyond its value without light."""
    part = round(100 * one / (one + other))
    return f"{part} to {100 - part} %"


def _warmth(result: RunResult) -> str:
    """When it is too warm."""
    rooms = [room for room in result.spaces if "operative_c" in room.heat.temperatures]
    if not rooms:
        return "Temperatures were not computed."
    hours = [_warm_hours(room) for room in rooms]
    room, warm = max(zip(rooms, hours, strict=True), key=lambda one: one[1].sum())
    if not warm.any():
        return f"No occupied hour is above {WARM_C:.0f} °C. {heated(room)}"
    times, step = room.heat.temperatures.index, step_hours(room.heat.temperatures.index)
    months = np.bincount(times.month[warm], minlength=13)
    month = times[warm][times.month[warm] == months.argmax()][0]
    total, peak = occupied(room).sum() * step, room.heat.operative_c
    highest = f"{rounded(float(peak.max()), 1)} °C, {spoken(peak.idxmax())}"
    return (
        f"{room.space.label} is above {WARM_C:.0f} °C in {rounded(warm.sum() * step, 0)} of its "
        f"{rounded(total, 0)} occupied hours, most of them in {month:%B}; the highest operative "
        f"temperature is {highest}. {heated(room)}"
    )


def _warm_hours(room: RoomYear) -> NDArray[np.bool_]:
    return (room.heat.operative_c.to_numpy() > WARM_C) & occupied(room).to_numpy()


def _shading(result: RunResult) -> str:
    """What the shading costs in daylight."""
    moved = [r for r in result.spaces if r.operation is not None and len(r.operation.states) > 1]
    if not moved:
        return "What fills the windows stays in one state all year: all figures are of that state."
    parts = []
    for room in moved:
        drawn = room.operation.hours["shading_state"].to_numpy() > 0
        used = occupied(room).to_numpy() & (room.daylight.illuminance.max(axis=1) > 0)
        part = percent(100 * float(drawn[used].mean())) if used.any() else "0"
        text = f"in {room.space.label} it is drawn in {part} % of the occupied daylight hours"
        if room.explored is not None:
            open_share, as_run = _autonomies(room, room.explored)
            text += f", which lowers daylight autonomy from {percent(open_share)} to "
            text += f"{percent(as_run)} %"
        parts.append(text)
    rest = "" if any(r.explored for r in moved) else " --explore tells what that costs in daylight."
    words = "; ".join(parts)
    return f"{words[:1].upper()}{words[1:]}.{rest}".replace(
        "it is drawn", "the shading is drawn", 1
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


def _limits(result: RunResult, cards: Sequence[Sequence[Card]]) -> Table:
    return limits_table(
        [(r.space.label, r, own) for r, own in zip(result.spaces, cards, strict=True)]
    )


def limits_table(rooms: Sequence[tuple[str, RoomYear, Sequence[Card]]], of: str = "Room") -> Table:
    """The figures that a rule limits, with the error of each where it is known.

    Args: rooms: name, results and headline figures; of: what the names are of.
    """
    columns = (
        Column(of, numeric=False), Column("Figure", numeric=False),
        Column("Value", numeric=False, short=True), Column("Against the limit", numeric=False),
        Column("Standard error", numeric=False),
    )  # fmt: skip
    rows = []
    for name, room, own in rooms:
        for card in own:
            if card.verdict:
                value = f"{card.value} {card.unit}".strip()
                line = (name, card.label, value, card.verdict, _error(room, card))
                rows.append(line)
    return Table("Figures against the limits of the standards", columns, tuple(rows))


def _error(room: RoomYear, card: Card) -> str:
    if card.unit == "DGP":
        worst = max(room.glare.pictures, key=lambda picture: picture.glare["dgp"])
        return _plus_minus(worst).strip() or "not known"
    if card.label in (
        "Spatial daylight autonomy",
        "Daylight provision",
        "Annual sunlight exposure",
    ):
        light = float(np.mean(room.daylight.relative_error))
        return f"± {share(light)} % of each illuminance, from the tracing"
    return "not known"


def _plus_minus(picture: LuminancePicture) -> str:
    """The standard error of a picture's DGP; empty where it is not known."""
    error = picture.glare.get("dgp_standard_error", float("nan"))
    return "" if error != error else f" ± {max(error, 1e-4):.1g}"
