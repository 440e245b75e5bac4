"""The verdict at the head of a report: the question, three sentences, results and limits."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.indices import DGP_IN_DARK, DGP_PER_LUX
from mitsuba_cfs.notes import Note
from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import colon, month_name, percent, rounded, semicolons, share, significant, spoken
from scenes.report.answer import judged, rooms_answer, with_standard
from scenes.report.glare_figures import sun_words
from scenes.report.headline import FAIR, GOOD, POOR, WARM_C, Card, dgp_error, heated, moves, occupied
from scenes.report.method import METHODS
from scenes.report.names import rooms_counted, systems_counted
from scenes.report.sensitivity import bands_sentence, sensitivity_sentence
from scenes.report.tables import GLARE_WORDS, Column, Table, glare_class, step_hours
from scenes.results import ExploredRoom, LuminancePicture, RoomYear, RunResult

MOST_ROOMS = 6  # whose figures are shown one by one on the page of the verdict
WORST = 2  # rooms that are named where there are more
GRADES = (GOOD, FAIR, POOR)

Named = tuple[str, RoomYear, Sequence[Card]]  # a room or case, its results, its headline figures


@dataclass(frozen=True, slots=True)
class LimitTables:
    """Tables of the page of the verdict: one shown, one folded below it."""

    shown: Table
    folded: Table | None  # every figure of every room; None: it is shown


def limits(rooms: Sequence[Named], of: str) -> LimitTables:
    """The figures that a rule limits, with the error of each where it is known.

    Args: of: what the names are of, in the page's language.
    """
    every = _every(rooms, of)
    if len(rooms) <= MOST_ROOMS:
        return LimitTables(every, None)
    return LimitTables(_by_figure(rooms), every)


def _every(rooms: Sequence[Named], of: str) -> Table:
    columns = (
        Column(of, numeric=False),
        Column(gettext("Quantity"), numeric=False),
        Column(gettext("Value"), numeric=False, short=True),
        Column(gettext("Rating"), numeric=False),
        Column(gettext("Standard error"), numeric=False),
    )
    rows = tuple(
        (name, with_standard(card.label, card), _value(card), card.verdict, _error(room, card))
        for name, room, own in rooms
        for card in own
        if card.verdict
    )
    return Table(gettext("Results and limits of the standards"), columns, rows)


def _by_figure(rooms: Sequence[Named]) -> Table:
    """A row for each figure: how many meet what, which are the worst, the error of the worst."""
    columns = (
        Column(gettext("Quantity"), numeric=False),
        Column(gettext("Rooms by rating"), numeric=False),
        Column(gettext("Worst rooms"), numeric=False),
        Column(gettext("Standard error of the worst"), numeric=False),
    )
    rows = []
    judged = [(name, room, card) for name, room, own in rooms for card in own if card.verdict]
    for label in dict.fromkeys(card.label for _, _, card in judged):
        result = sorted((one for one in judged if one[2].label == label), key=lambda one: one[2].worth)
        counts = Counter((GRADES.index(card.grade), card.verdict) for _, _, card in result)
        meets = semicolons([colon(str(counts[key]), key[1]) for key in sorted(counts)])
        worst = semicolons([colon(name, _value(card)) for name, _, card in result[:WORST]])
        rows.append((with_standard(label, result[0][2]), meets, worst, _error(*result[0][1:])))
    return Table(gettext("Results and limits of the standards"), columns, tuple(rows))


def _value(card: Card) -> str:
    return f"{card.value} {card.unit}".strip()


def _error(room: RoomYear, card: Card) -> str:
    if card.error:
        return card.error
    if card.unit == "DGP":
        worst = max(room.glare.pictures, key=lambda picture: picture.glare["dgp"])
        if worst.glare["dgp"] >= 1.0:
            return gettext("none: DGP ends at 1")
        return plus_minus(worst).strip() or gettext("unknown")
    if card.traced:
        light = float(np.mean(room.daylight.relative_error))
        return gettext("± {share} % of each illuminance, from ray tracing", share=share(light))
    return gettext("unknown")


def plus_minus(picture: LuminancePicture) -> str:
    """The standard error of a picture's DGP; empty where it is not known, or where DGP is limited to 1."""
    error = picture.glare.get("dgp_standard_error", float("nan"))
    return "" if error != error or picture.glare["dgp"] >= 1.0 else f" {dgp_error(error)}"


NO_THERMAL_DATA = re.compile(r"\{system\}: no [Ug]-value given;")  # of `thermal.gvalue`
MOST_NAMES = 4  # of systems in the first sentence, of rooms in that on shading
LIT_LX = 300.0  # illuminance of daylight autonomy


@dataclass(frozen=True, slots=True)
class Verdict:
    """The summary on one page."""

    question: str
    answers: tuple[tuple[str, str], ...]  # room (empty: all), which limits are met
    sentences: tuple[tuple[str, str], ...]  # heading, text
    limits: LimitTables
    by_room: Table | None = None  # of a study: limits met by room and system


def verdict(result: RunResult, cards: Sequence[Sequence[Card]]) -> Verdict:
    """The verdict of a run.

    Args: cards: the headline figures of each room.
    """
    names = [room.space.label for room in result.spaces]
    used = result.manifest.get("fenestration", ())
    systems = list(dict.fromkeys(gettext("“{name}”", name=one["system"]) for one in used))
    question = gettext(
        "Daylight, glare and temperatures in {rooms} of {building}; weather: {weather}; "
        "fenestration: {systems}; method: {method}.",
        rooms=names[0] if len(names) == 1 else rooms_counted(len(names)),
        building=result.building.name or gettext("the building"),
        weather=result.manifest.get("site") or gettext("weather file"),
        systems=_systems(systems) or result.manifest.get("system") or gettext("windows as modelled"),
        method=gettext(METHODS[result.method]),
    )
    sentences = (
        (gettext("Glare"), _glare(result)),
        (gettext("Overheating"), _overheating(result)),
        (gettext("Shading"), _shading(result)),
        *([(gettext("Inputs that matter most"), matter)] if (matter := sensitivity_sentence(result)) else []),
        *([(gettext("How sure"), bands)] if (bands := bands_sentence(result)) else []),
    )
    named = [(r.space.label, r, card) for r, card in zip(result.spaces, cards, strict=True)]
    answer = rooms_answer([judged(name, figures) for name, _, figures in named])
    answers = (("", answer),) if answer else ()
    return Verdict(question, answers, sentences, limits(named, gettext("Room")))


def _systems(names: Sequence[str]) -> str:
    """All of them, or their number where they do not fit on a line."""
    return ", ".join(names) if len(names) <= MOST_NAMES else systems_counted(len(names))


def _glare(result: RunResult) -> str:
    """The worst glare and its cause."""
    found = [(p.glare["dgp"], room, p) for room in result.spaces for p in room.glare.pictures]
    if not found:
        return gettext("Glare is unknown: no picture was computed.")
    dgp, room, picture = max(found, key=lambda one: one[0])
    value = rounded(dgp, 2) + plus_minus(picture)
    where = f"{room.space.label}, {spoken(result.times[picture.hour])}"
    if glare_class(dgp) == "imperceptible":
        return gettext(
            "Glare is imperceptible in all pictures; the highest DGP is {dgp} ({where}).", dgp=value, where=where
        )
    text = ngettext(
        "The picture shows {glare}: DGP {dgp} ({where}; {sun}). {cause}",
        "The worst of {count} pictures shows {glare}: DGP {dgp} ({where}; {sun}). {cause}",
        len(found),
        glare=gettext(GLARE_WORDS[glare_class(dgp)]),
        dgp=value,
        where=where,
        sun=sun_words(result, picture.hour),
        cause=_cause(picture),
    )
    if room.annual_glare is not None and occupied(room).any():
        year = room.annual_glare["dgp"].fillna(0.0).to_numpy()[occupied(room).to_numpy()]
        text += " " + gettext(
            "DGP exceeds 0.40 in {share} % of the occupied hours.", share=percent(100 * float((year > 0.40).mean()))
        )
    return text


def _cause(picture: LuminancePicture) -> str:
    """The larger term of DGP, as a sentence."""
    glare = picture.glare
    if "ev" not in glare:
        return gettext("Bright surfaces are in view.")
    by_light = DGP_PER_LUX * glare["ev"]
    by_sources = glare["dgp"] - DGP_IN_DARK - by_light
    lux = significant(glare["ev"], 2)
    count = int(glare.get("sources", 0))
    if by_sources > by_light:
        parts = _parts(by_sources, by_light)
        if not count:
            return gettext("Causes: bright areas in view ({one} %), {lux} lx at the eye ({other} %).", lux=lux, **parts)
        return ngettext(
            "Causes: {count} bright source in view ({one} %), {lux} lx at the eye ({other} %).",
            "Causes: {count} bright sources in view ({one} %), {lux} lx at the eye ({other} %).",
            count,
            lux=lux,
            **parts,
        )
    if count == 0 or by_sources <= 0:
        return gettext("The {lux} lx at the eye are the only cause.", lux=lux)
    return ngettext(
        "Causes: {lux} lx at the eye ({one} %), {count} bright source in view ({other} %).",
        "Causes: {lux} lx at the eye ({one} %), {count} bright sources in view ({other} %).",
        count,
        lux=lux,
        **_parts(by_light, by_sources),
    )


def _parts(one: float, other: float) -> dict[str, int]:
    """Shares [%] of two terms in what DGP has beyond its value without light."""
    part = round(100 * one / (one + other))
    return {"one": part, "other": 100 - part}


def _overheating(result: RunResult) -> str:
    """Overheating hours of the worst room and the highest temperature."""
    rooms = [room for room in result.spaces if "operative_c" in room.heat.temperatures]
    if not rooms:
        return gettext("Temperatures were not computed.")
    hours = [_warm_hours(room) for room in rooms]
    room, warm = max(  # of rooms too warm in as many hours, the hottest
        zip(rooms, hours, strict=True), key=lambda one: (one[1].sum(), one[0].heat.operative_c.max())
    )
    if not warm.any():
        none = gettext("No occupied hour exceeds {limit} °C.", limit=f"{WARM_C:.0f}")
        return " ".join(filter(None, (none, heated(room), assumed_thermal(result.head.assumed))))
    times, step = room.heat.temperatures.index, step_hours(room.heat.temperatures.index)
    months = np.bincount(times.month[warm], minlength=13)
    month = times[warm][times.month[warm] == months.argmax()][0]
    total, peak = occupied(room).sum() * step, room.heat.operative_c
    text = gettext(
        "{room}: the operative temperature exceeds {limit} °C in {hours} of {total} occupied "
        "hours, "
        "mostly in {month}; the maximum is {peak} °C ({hour}).",
        room=room.space.label,
        limit=f"{WARM_C:.0f}",
        hours=rounded(warm.sum() * step, 0),
        total=rounded(total, 0),
        month=month_name(month.month),
        peak=rounded(float(peak.max()), 1),
        hour=spoken(peak.idxmax()),
    )
    return " ".join(filter(None, (text, heated(room), assumed_thermal(result.head.assumed))))


def assumed_thermal(notes: Iterable[str]) -> str:
    """A sentence that names the systems whose U or g is assumed; empty where all are stated."""
    assumed = (note for note in notes if isinstance(note, Note) and NO_THERMAL_DATA.match(note.template))
    names = list(dict.fromkeys(str(note.values["system"]) for note in assumed))
    if not names:
        return ""
    return gettext("The temperatures rest on assumed U- or g-values: {systems}.", systems=_systems(names))


def _warm_hours(room: RoomYear) -> NDArray[np.bool_]:
    return (room.heat.operative_c.to_numpy() > WARM_C) & occupied(room).to_numpy()


def _shading(result: RunResult) -> str:
    """Hours with the shading in use, and its effect on daylight autonomy."""
    moved = [room for room in result.spaces if moves(room)]
    if not moved:
        return gettext("The shading does not move: all results are for one state.")
    drawn = [_drawn(room) for room in moved]
    cost = [None if r.explored is None else _autonomies(r, r.explored) for r in moved]
    rows = list(zip(moved, drawn, cost, strict=True))
    if len(moved) > MOST_NAMES:
        rows.sort(key=lambda one: -one[1])
        least, most, counted = percent(min(drawn)), percent(max(drawn)), rooms_counted(len(moved))
        if least == most:
            parts = [_in_use(counted, most)]
        else:
            parts = [
                gettext(
                    "{rooms}: the shading is in use in {least} to {most} % of the occupied daylight hours, "
                    "most in {room}.",
                    rooms=counted,
                    least=least,
                    most=most,
                    room=rows[0][0].space.label,
                )
            ]
        rows = rows[:1]  # what it costs where it is drawn most
    else:
        parts = []
    parts += [_shading_of(*one) for one in rows if not parts or one[2] is not None]
    if not any(r.explored for r in moved):
        parts.append(gettext("Use --explore to compute its effect on daylight."))
    return " ".join(parts)


def _drawn(room: RoomYear) -> float:
    """Occupied hours with daylight in which the shading is not in its first state [%]."""
    if room.operation is None:
        return 0.0
    states = room.operation.shading.states.max(axis=1, initial=0)
    used = occupied(room).to_numpy() & (room.daylight.illuminance.max(axis=1) > 0)
    return 100 * float((states[used] > 0).mean()) if used.any() else 0.0


def _in_use(room: str, share: str) -> str:
    return gettext("{room}: the shading is in use in {share} % of the occupied daylight hours.", room=room, share=share)


def _shading_of(room: RoomYear, drawn: float, cost: tuple[float, float] | None) -> str:
    facts = {"room": room.space.label, "share": percent(drawn)}
    if cost is None:
        return _in_use(**facts)
    most, least = map(percent, cost)
    if most == least:
        return gettext(
            "{room}: the shading is in use in {share} % of the occupied daylight hours; daylight "
            "autonomy stays at {most} %.",
            **facts,
            most=most,
        )
    return gettext(
        "{room}: the shading is in use in {share} % of the occupied daylight hours and reduces "
        "daylight autonomy from {most} to {least} %.",
        **facts,
        most=most,
        least=least,
    )


def _autonomies(room: RoomYear, explored: ExploredRoom) -> tuple[float, float]:
    """Daylight autonomy [%], mean of the sensors, with the shading open and as operated."""
    used = occupied(room).to_numpy()
    total = max(int(used.sum()), 1)
    lit = used[explored.lit]
    state, light = explored.operated[explored.lit], np.stack(explored.illuminance)
    as_run = light[state, :, np.arange(len(state))]  # [L, S]
    means = [(one[lit] >= LIT_LX).sum(axis=0).mean() for one in (light[0].T, as_run)]
    return 100 * float(means[0]) / total, 100 * float(means[1]) / total
