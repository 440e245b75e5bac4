"""The first sentences of a report: which rooms and systems meet which limits, and which fail."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import colon, inside, listed, rounded, semicolons
from scenes.report.headline import GLARE_OF_PICTURES, POOR, Card

MOST_NAMED = 4  # rooms or systems that are named in one sentence


@dataclass(frozen=True, slots=True)
class Judged:
    """A room, or a case of a study, with the figures that a rule limits."""

    name: str
    cards: tuple[Card, ...]

    @property
    def failed(self) -> tuple[Card, ...]:
        """The figures whose limit is not met."""
        return tuple(card for card in self.cards if card.grade == POOR)

    @property
    def met(self) -> int:
        """The number of limits that are met."""
        return len(self.cards) - len(self.failed)


def judged(name: str, cards: Sequence[Card]) -> Judged:
    """The figures among the headline figures of a room or case whose limit is that of a standard.

    The highest DGP of some pictures has none: EN 17037 limits the glare of the year.
    """
    return Judged(name, tuple(card for card in cards if card.verdict and card.code != GLARE_OF_PICTURES))


def limits_counted(cases: Sequence[Judged]) -> str:
    """A sentence on the limits that the answers count, by their standard; empty where none has one."""
    labels: dict[str, list[str]] = {}
    for card in (card for case in cases for card in case.cards if card.standard):
        known = labels.setdefault(card.standard, [])
        known += [] if card.label in known else [card.label]
    parts = [colon(standard, listed([inside(label) for label in own])) for standard, own in labels.items()]
    return gettext("Limits counted: {parts}.", parts=semicolons(parts)) if parts else ""


def rooms_answer(rooms: Sequence[Judged]) -> str:
    """One sentence on the limits met by the rooms of a run; empty where no figure is limited."""
    rooms = [room for room in rooms if room.cards]
    if not rooms:
        return ""
    if len(rooms) == 1:
        return _alone(rooms[0])
    failing = [room for room in rooms if room.failed]
    if not failing:
        return gettext("Every room meets every limit.")
    met = len(rooms) - len(failing)
    if not met:
        head = gettext("No room meets every limit.")
    else:
        head = gettext("{met} of {all} rooms meet every limit.", met=met, all=len(rooms))
    if len(failing) <= MOST_NAMED:
        return f"{head} {semicolons([_fails(room, _names) for room in failing])}."
    counts = Counter(card.label for room in failing for card in room.failed)
    lines = [
        ngettext("{label} in {count} room", "{label} in {count} rooms", number, label=label)
        for label, number in counts.most_common()
    ]
    return f"{head} " + gettext("Not met: {parts}.", parts=semicolons(lines))


def systems_answer(cases: Sequence[Judged], energy_kwh: Sequence[float | None]) -> str:
    """Which of the cases of a room meets the most limits, what each fails, and its energy.

    Args: energy_kwh: heating, cooling and lighting of each case; None where unknown or none.
    """
    pairs = [(case, e) for case, e in zip(cases, energy_kwh, strict=True) if case.cards]
    if not pairs:
        return ""
    if len(pairs) == 1:
        return _alone(pairs[0][0])
    order = sorted(pairs, key=lambda one: (len(one[0].failed), math.inf if one[1] is None else one[1]))
    fewest = len(order[0][0].failed)
    best = [case for case, _ in order if len(case.failed) == fewest]
    others = [case for case, _ in order if len(case.failed) > fewest]
    parts = [_best(best, fewest)]
    for case in others[:MOST_NAMED]:
        parts.append(_fails(case) + ".")
    if len(others) > MOST_NAMED:
        more = len(others) - MOST_NAMED
        parts.append(ngettext("{count} other fails some.", "{count} others fail some.", more))
    return " ".join([*parts, *_energy(order, best)])


def summary_answer(groups: Sequence[Sequence[Judged]]) -> str:
    """In how many of many rooms each system meets every limit.

    Args: groups: the cases of each room.
    """
    counts: dict[str, list[int]] = {}
    for cases in groups:
        for case in cases:
            if case.cards:
                counts.setdefault(case.name, []).append(not case.failed)
    order = sorted(counts.items(), key=lambda one: -sum(one[1]) / len(one[1]))
    parts = [
        gettext("{name} in {met} of {all} rooms", name=name, met=sum(met), all=len(met))
        for name, met in order[:MOST_NAMED]
    ]
    return gettext("Every limit is met by {parts}.", parts=semicolons(parts)) if parts else ""


def met_cell(case: Judged) -> str:
    """The limits met, for a table of rooms by systems, and those that are not."""
    if not case.cards:
        return ""
    count = gettext("{met} of {limits}", met=case.met, limits=len(case.cards))
    if not case.failed:
        return count
    return gettext("{count}; fails {failed}", count=count, failed=_names(case.failed))


def _best(best: Sequence[Judged], fewest: int) -> str:
    shown, more = [case.name for case in best[:MOST_NAMED]], len(best) - MOST_NAMED
    if more > 0:
        shown.append(ngettext("{count} other", "{count} others", more))
    names = listed(shown)
    count = len(best[0].cards)
    if not fewest:
        return ngettext("{names} meets every limit.", "{names} meet every limit.", len(best), names=names)
    if not best[0].met:
        return gettext("No system meets any of the limits.")
    facts = {"names": names, "met": best[0].met, "limits": count}
    if len(best) == 1:
        return gettext(
            "No system meets all limits. {names} meets the most, {met} of {limits}, and fails {failed}.",
            **facts,
            failed=_values(best[0].failed),
        )
    parts = [_fails(case) for case in best[:MOST_NAMED]]
    return gettext(
        "No system meets all limits. {names} meet the most, {met} of {limits}: {parts}.",
        **facts,
        parts=semicolons(parts),
    )


def _energy(order: Sequence[tuple[Judged, float | None]], best: Sequence[Judged]) -> list[str]:
    """The energy of the best case beside the least of all."""
    known = {case.name: energy for case, energy in order if energy}
    if len(known) != len(order):
        return []
    least, first = min(known, key=known.__getitem__), best[0].name
    facts = {"name": first, "energy": rounded(known[first], 0)}
    if least == first:
        return [gettext("{name} needs the least heating, cooling and lighting energy: {energy} kWh a year.", **facts)]
    return [
        gettext(
            "{name} needs {energy} kWh of heating, cooling and lighting a year; the least is {lowest} kWh ({least}).",
            **facts,
            lowest=rounded(known[least], 0),
            least=least,
        )
    ]


def _alone(room: Judged) -> str:
    if not room.failed:
        return ngettext("{names} meets every limit.", "{names} meet every limit.", 1, names=room.name)
    return gettext(
        "{name} meets {met} of {limits} limits and fails {failed}.",
        name=room.name,
        met=room.met,
        limits=len(room.cards),
        failed=_values(room.failed),
    )


def _names(cards: Sequence[Card]) -> str:
    return listed([with_standard(inside(card.label), card) for card in cards])


def with_standard(label: str, card: Card) -> str:
    """The label of a figure with the standard that limits it."""
    return f"{label} ({card.standard})" if card.standard else label


def _values(cards: Sequence[Card]) -> str:
    """Each figure with its value."""
    values = [(c, f"{inside(c.value)} {c.unit}".strip()) for c in cards]
    return listed([f"{inside(c.label)} ({colon(c.standard, text) if c.standard else text})" for c, text in values])


def _fails(case: Judged, figures: Callable[[Sequence[Card]], str] = _values) -> str:
    return gettext("{name} fails {failed}", name=case.name, failed=figures(case.failed))
