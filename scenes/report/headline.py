"""The headline figures of a room: what a client reads first, each with its meaning in words."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mitsuba_cfs.glare.classes import hour_not_exceeded, level_of, mean_error
from scenes.language.catalogue import N_, decimal, gettext, ngettext
from scenes.language.numbers import percent, rounded, semicolons, significant, spoken
from scenes.provision_levels import provision_levels
from scenes.report.names import quantity
from scenes.report.tables import GLARE_WORDS, glare_class, step_hours
from scenes.results import MAP_ERROR, RoomYear, RunResult

WARM_C = 26.0  # operative temperature above which hours are counted
PROTECTION = {  # DGP of EN 17037's levels, the best first
    "high": N_("high: at most 0.35"),
    "medium": N_("medium: at most 0.40"),
    "minimum": N_("minimum: at most 0.45"),
    "none": N_("above 0.45"),
}
LEVEL_WORDS = {"high": N_("high"), "medium": N_("medium"), "minimum": N_("minimum"), "none": N_("none")}
LM_83, EN_17037 = "LM-83", "EN 17037"  # standards of limits
GOOD, FAIR, POOR, PLAIN = "good", "fair", "poor", "plain"
GLARE_OF_PICTURES, GLARE_OF_YEAR = "glare of pictures", "glare of the year"


@dataclass(frozen=True, slots=True)
class Card:
    """One headline figure."""

    label: str
    value: str
    unit: str
    words: str
    verdict: str = ""  # a word or two, beside a mark of the grade
    grade: str = PLAIN  # good, fair, poor, plain
    meaning: str = ""
    meter: float | None = None  # 0..100, drawn as a bar
    traced: bool = False  # its error is that of the illuminances
    error: str = ""  # standard error of this figure, where it is known
    worth: float = 0.0  # orders rooms by this figure: the more the better
    standard: str = ""  # whose limit the verdict is of
    code: str = ""  # GLARE_OF_PICTURES, GLARE_OF_YEAR: figures of the same matter


def cards(result: RunResult, room: RoomYear) -> tuple[Card, ...]:
    """All headline figures that this room's results hold."""
    found = [
        _spatial_autonomy(room),
        _sunlight(room),
        _autonomy(room),
        _provision(room),
        _glare(result, room),
        _protection(room),
        _warm_hours(room),
        _comfort(room),
        _peak(room),
    ]
    return tuple(card for card in found if card is not None)


def room_metric(room: RoomYear, *names: str) -> float | None:
    """The first room metric of these names."""
    key = named_like(room.daylight.room_metrics, *names)
    value = None if key is None else room.daylight.room_metrics[key]
    return None if value is None else float(value)


def sensor_column(room: RoomYear, *names: str) -> str | None:
    """The first column of the sensor metrics of these names."""
    return named_like(room.daylight.sensor_metrics, *names)


def named_like(keys: Iterable[str], *names: str) -> str | None:
    """The first key that is one of the names, or that goes on after it with no letter."""
    for name in names:
        for pattern in (rf"{name}$", rf"{name}(?![a-z])"):
            for key in keys:
                if re.match(pattern, key, re.IGNORECASE):
                    return key
    return None


def occupied(room: RoomYear) -> pd.Series:
    """Which hours count for comfort [H]; all of them where the results do not say."""
    comfort = room.heat.comfort
    if "occupied" in comfort:
        return comfort["occupied"].astype(bool)
    return pd.Series(True, index=comfort.index)


def heated(room: RoomYear) -> str:
    """Whether the room is heated and cooled, as a sentence."""
    if room.operation is None:
        return gettext("Without heating and cooling.")
    heating, cooling = (room.operation.summary[f"{n}_kwh"] > 0 for n in ("heating", "cooling"))
    if heating and cooling:
        return gettext("With heating and cooling.")
    if heating:
        return gettext("With heating.")
    return gettext("With cooling.") if cooling else gettext("Without heating and cooling.")


def cooled(room: RoomYear) -> bool:
    """Whether the room is cooled by machine, for which adaptive comfort does not hold (ASHRAE 55, EN 16798-1)."""
    return room.operation is not None and room.operation.summary["cooling_kwh"] > 0


def applicable(comfort: pd.DataFrame) -> pd.Series:
    """Hours [H] whose weather the comfort model covers."""
    if "applicable" in comfort:
        return comfort["applicable"].astype(bool)
    if "comfort_c" in comfort:
        return comfort["comfort_c"].notna()
    return pd.Series(True, index=comfort.index)


def _spatial_autonomy(room: RoomYear) -> Card | None:
    value = room_metric(room, "sda")
    if value is None:
        return None
    grade, verdict = (
        (GOOD, gettext("preferred (75 % or more)"))
        if value >= 75
        else (FAIR, gettext("acceptable (55 % or more)"))
        if value >= 55
        else (POOR, gettext("below 55 % (LM-83)"))
    )
    words = gettext("of the work plane has 300 lx of daylight in at least half of the occupied hours")
    card = _of_plane(value, gettext("Spatial daylight autonomy"), words, "sda300_50", (grade, verdict))
    own = room_metric(room, "sda300_50_standard_error")
    error = "" if own is None else points_error(own)
    return replace(card, worth=value, error=error, standard=LM_83)


def points_error(value: float) -> str:
    """The standard error of a percentage [percentage points]."""
    if value < 0.05:
        return gettext("± less than 0.1 percentage points, from ray tracing")
    return gettext("± {points} percentage points, from ray tracing", points=significant(value, 2))


def _sunlight(room: RoomYear) -> Card | None:
    value = room_metric(room, "ase")
    if value is None:
        return None
    grade, verdict = (GOOD, gettext("at most 10 % (LM-83)")) if value <= 10 else (POOR, gettext("above 10 % (LM-83)"))
    words = gettext("of the work plane receives more than 1000 lx of direct sun in more than 250 occupied hours a year")
    label = gettext("Annual sunlight exposure")
    return replace(_of_plane(value, label, words, "ase1000_250", (grade, verdict)), worth=-value, standard=LM_83)


def _of_plane(value: float, label: str, words: str, key: str, judged: tuple[str, str]) -> Card:
    """A share of the work plane [%], its grade and verdict; key: of its quantity."""
    grade, verdict = judged
    meaning = quantity(key).meaning
    return Card(label, percent(value), "%", words, verdict, grade, meaning, value, traced=True)


def _autonomy(room: RoomYear) -> Card | None:
    column = sensor_column(room, "da300", "da_300", "da")
    if column is None:
        return None
    values = room.daylight.sensor_metrics[column].to_numpy(dtype=float)
    words = gettext(
        "of the occupied hours have 300 lx of daylight, averaged over the work plane (sensors: {least} to {most} %)",
        least=percent(values.min()),
        most=percent(values.max()),
    )
    meaning = quantity("da300").meaning
    mean = float(values.mean())
    return Card(gettext("Daylight autonomy"), percent(mean), "%", words, meaning=meaning, meter=mean)


def moves(room: RoomYear) -> bool:
    """Whether the room's shading moves between states."""
    return room.operation is not None and len(room.operation.states) > 1


def _provision(room: RoomYear) -> Card | None:
    """The level of EN 17037, with the two illuminances that decide it, and in which state of the shading."""
    metrics = room.daylight.room_metrics
    q = quantity("en17037_level")
    level = metrics.get("en17037_level")
    if level is None:
        return None
    index, levels = int(level), provision_levels()
    target, least = metrics.get("en17037_target_lx"), metrics.get("en17037_minimum_lx")
    words = gettext("level of daylight provision (EN 17037)")
    if target is not None and least is not None:
        words = gettext(
            "level of daylight provision (EN 17037): in half of the daylight hours, half of the "
            "room reaches {target} lx and 95 % of it {least} lx",
            target=significant(target),
            least=significant(least),
        )
    reached = levels[max(index - 1, 0)]
    limits = {"target": f"{reached.target:g}", "least": f"{reached.minimum:g}"}
    verdict = (
        gettext("{target} and {least} lx", **limits) if index else gettext("below {target} and {least} lx", **limits)
    )
    shading = gettext("shading as it moves") if moves(room) else gettext("one state of the shading")
    verdict = f"{verdict} ({shading})"
    grade = (POOR, FAIR, GOOD, GOOD)[index]
    return Card(
        gettext("Daylight provision"),
        q.values[index].capitalize(),
        "",
        words,
        verdict,
        grade,
        q.meaning,
        traced=True,
        worth=index,
        standard=EN_17037,
    )


def _glare(result: RunResult, room: RoomYear) -> Card | None:
    pictures = room.glare.pictures
    if not pictures:
        return None
    worst = max(pictures, key=lambda picture: picture.glare["dgp"])
    dgp = worst.glare["dgp"]
    word = glare_class(dgp)
    grade = {"imperceptible": GOOD, "perceptible": FAIR}.get(word, POOR)
    words = ngettext(
        "daylight glare probability of the picture, {hour}",
        "highest daylight glare probability of {count} pictures, {hour}",
        len(pictures),
        hour=spoken(result.times[worst.hour]),
    )
    return Card(
        gettext("Highest glare"),
        rounded(dgp, 2),
        "DGP",
        words,
        gettext(GLARE_WORDS[word]),
        grade,
        quantity("dgp").meaning,
        min(100 * dgp, 100),
        worth=-dgp,
        code=GLARE_OF_PICTURES,
    )


def _protection(room: RoomYear) -> Card | None:
    """EN 17037's protection from glare, of the year's occupied hours."""
    if room.annual_glare is None or not occupied(room).any():
        return None
    dgp = room.annual_glare["dgp"].fillna(0.0).to_numpy()[occupied(room).to_numpy()]
    seen = hour_not_exceeded(dgp)
    noise = mean_error(room.annual_glare.get("dgp_standard_error", ()))
    if room.glare_map is None:
        words = gettext(
            "protection from glare (EN 17037): DGP exceeds {dgp} in at most 5 % of the occupied hours",
            dgp=rounded(seen, 2),
        )
        return protection_card(level_of(seen), noise, words, -seen)
    seats = float(room.glare_map.not_exceeded.max())
    level = max(level_of(seen), level_of(seats - MAP_ERROR), key=list(PROTECTION).index)
    words = gettext(
        "protection from glare (EN 17037): DGP exceeded in at most 5 % of the occupied hours: {seen} at the view "
        "point, {seats} ± {error} at the worst seat of the glare map",
        seen=rounded(seen, 2),
        seats=rounded(seats, 2),
        error=decimal(f"{MAP_ERROR:g}"),
    )
    return protection_card(level, noise, words, -max(seen, seats - MAP_ERROR))


def protection_card(level: str, noise: float | None, words: str = "", worth: float | None = None) -> Card:
    """EN 17037's protection from glare by its level: high, medium, minimum or none.

    Args: noise: standard error of an hour's DGP from the tracing; None where it is not known.
    """
    order = len(PROTECTION) - 1 - list(PROTECTION).index(level)
    return Card(
        gettext("Protection from glare"),
        gettext(LEVEL_WORDS[level]).capitalize(),
        "",
        words,
        gettext(PROTECTION[level]),
        (POOR, FAIR, GOOD, GOOD)[order],
        quantity("dgp").meaning,
        error="" if noise is None else gettext("{error} of an hour's DGP", error=dgp_error(noise)),
        worth=float(order) if worth is None else worth,
        standard=EN_17037,
        code=GLARE_OF_YEAR,
    )


def dgp_error(value: float) -> str:
    """The standard error of a DGP, with as many digits as a DGP is worth."""
    return gettext("± less than 0.001") if value < 1e-3 else decimal(f"± {value:.1g}")


def _warm_hours(room: RoomYear) -> Card | None:
    temperatures = room.heat.temperatures
    if "operative_c" not in temperatures:
        return None
    used = occupied(room).to_numpy()
    step = step_hours(temperatures.index)
    warm = (temperatures["operative_c"].to_numpy() > WARM_C) & used
    hours, total = float(warm.sum()) * step, float(used.sum()) * step
    share = 100 * hours / total if total else float("nan")
    words = gettext(
        "of the {total} occupied hours ({share} %) have an operative temperature above {limit} °C.",
        limit=f"{WARM_C:.0f}",
        share=percent(share),
        total=rounded(total, 0),
    )
    words += f" {heated(room)}"
    meaning = quantity("operative_c").meaning
    return Card(gettext("Overheating hours"), rounded(hours, 0), "h", words, meaning=meaning, meter=share)


def _comfort(room: RoomYear) -> Card | None:
    comfort = room.heat.comfort
    columns = comfort_columns(comfort)
    used = occupied(room)
    if not columns or not used.any() or cooled(room):
        return None
    widest = columns[-1]
    value = 100 * float(comfort.loc[used, widest].mean())
    words = gettext("of the occupied hours: adaptive comfort “{band}”", band=quantity(widest).label)
    outside = 100 * float((~applicable(comfort))[used].mean())
    if outside > 0.5:
        outdoors = gettext(
            "{share} % are outside the range of the model and count as uncomfortable", share=percent(outside)
        )
        words = semicolons([words, outdoors])
    meaning = quantity(widest).meaning
    return Card(gettext("Adaptive comfort"), percent(value), "%", words, meaning=meaning, meter=value)


def comfort_columns(comfort: pd.DataFrame) -> list[str]:
    """The boolean columns of comfort, from the strictest limits to the widest."""
    names = [name for name in comfort if name.startswith("within_")]
    return sorted(names, key=lambda name: float(comfort[name].mean()))


def _peak(room: RoomYear) -> Card | None:
    temperatures = room.heat.temperatures
    if not {"air_c", "operative_c"} <= set(temperatures):
        return None
    air, operative = temperatures["air_c"], temperatures["operative_c"]
    words = gettext(
        "highest operative temperature ({hour}); air temperature from {low} to {high} °C.",
        hour=spoken(operative.idxmax()),
        high=rounded(float(air.max()), 1),
        low=rounded(float(air.min()), 1),
    )
    words += f" {heated(room)}"
    return Card(
        gettext("Peak temperature"),
        rounded(float(np.max(operative)), 1),
        "°C",
        words,
        meaning=quantity("operative_c").meaning,
    )
