"""Figures against the standards' limits: of a few rooms each, of many by what they meet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenes.language.catalogue import decimal, gettext
from scenes.language.numbers import colon, semicolons, share
from scenes.report.headline import FAIR, GOOD, POOR, Card
from scenes.report.tables import Column, Table
from scenes.results import LuminancePicture, RoomYear

MOST_ROOMS = 6  # whose figures stand each for itself on the page of the verdict
WORST = 3  # rooms that are named where there are more
GRADES = (GOOD, FAIR, POOR)

Named = tuple[str, RoomYear, Sequence[Card]]  # a room or case, its results, its headline figures


@dataclass(frozen=True, slots=True)
class LimitTables:
    """What stands on the page of the verdict, and what is folded below it."""

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
        Column(of, numeric=False), Column(gettext("Quantity"), numeric=False),
        Column(gettext("Value"), numeric=False, short=True),
        Column(gettext("Limit"), numeric=False),
        Column(gettext("Standard error"), numeric=False),
    )  # fmt: skip
    rows = tuple(
        (name, card.label, _value(card), card.verdict, _error(room, card))
        for name, room, own in rooms
        for card in own
        if card.verdict
    )
    return Table(gettext("Results and limits of the standards"), columns, rows)


def _by_figure(rooms: Sequence[Named]) -> Table:
    """A row for each figure: how many meet what, which are the worst, the error of the worst."""
    columns = (
        Column(gettext("Quantity"), numeric=False), Column(gettext("Rooms by limit"), numeric=False),
        Column(gettext("Worst rooms"), numeric=False),
        Column(gettext("Standard error of the worst"), numeric=False),
    )  # fmt: skip
    rows = []
    judged = [(name, room, card) for name, room, own in rooms for card in own if card.verdict]
    for label in dict.fromkeys(card.label for _, _, card in judged):
        found = sorted(
            (one for one in judged if one[2].label == label), key=lambda one: one[2].worth
        )
        counts = Counter((GRADES.index(card.grade), card.verdict) for _, _, card in found)
        meets = semicolons([colon(str(counts[key]), key[1]) for key in sorted(counts)])
        worst = semicolons([colon(name, _value(card)) for name, _, card in found[:WORST]])
        rows.append((label, meets, worst, _error(*found[0][1:])))
    return Table(gettext("Results and limits of the standards"), columns, tuple(rows))


def _value(card: Card) -> str:
    return f"{card.value} {card.unit}".strip()


def _error(room: RoomYear, card: Card) -> str:
    if card.unit == "DGP":
        worst = max(room.glare.pictures, key=lambda picture: picture.glare["dgp"])
        return plus_minus(worst).strip() or gettext("unknown")
    if card.traced:
        light = float(np.mean(room.daylight.relative_error))
        return gettext("± {share} % of each illuminance, from ray tracing", share=share(light))
    return gettext("unknown")


def plus_minus(picture: LuminancePicture) -> str:
    """The standard error of a picture's DGP; empty where it is not known."""
    error = picture.glare.get("dgp_standard_error", float("nan"))
    return "" if error != error else decimal(f" ± {max(error, 1e-4):.1g}")
