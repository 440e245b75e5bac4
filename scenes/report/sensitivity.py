"""What inputs do to results, in words: those that matter most, bands, how likely rules are met."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from scenes.language.catalogue import N_, gettext
from scenes.language.numbers import significant
from scenes.results import RoomYear, RunResult
from scenes.uncertain_inputs import INPUTS

NAMED = 3  # inputs
# Figures that are named: of the light the first that is there, and of the heat
SENTENCES = {
    "da300": N_("Daylight autonomy ({value} %, mean of the sensors) depends most on {inputs}."),
    "cooling_kwh": N_("Cooling ({value} kWh) depends most on {inputs}."),
    "heating_kwh": N_("Heating ({value} kWh) depends most on {inputs}."),
    "highest_operative_c": N_("The highest operative temperature ({value} °C) depends most on {inputs}."),
}
EFFECT_UNITS = {"da300": N_("points"), "cooling_kwh": "kWh", "heating_kwh": "kWh", "highest_operative_c": "K"}
LIGHT, LOADS = "da300", ("cooling_kwh", "heating_kwh")


def sensitivity_sentence(result: RunResult) -> str:
    """The three inputs that matter most for daylight and for heat; "" without sensitivities."""
    tables = [room.sensitivities for room in result.spaces if room.sensitivities is not None]
    if not tables:
        return ""
    several = len(tables) > 1
    effects = pd.concat([table.assign(effect=table["effect"].abs()) for table in tables])
    means = effects.groupby(["figure", "input"], sort=False)[["figure_value", "effect"]].mean()
    known = set(means.index.get_level_values("figure"))
    loads = [name for name in LOADS if name in known]
    heat = max(loads, key=lambda name: means.loc[name, "figure_value"].mean()) if loads else "highest_operative_c"
    sentences = [_sentence(name, means.loc[name]) for name in (LIGHT, heat) if name in known]
    if several:
        sentences.append(gettext("These are means of the rooms; each room's sensitivities.csv has all of its figures."))
    return " ".join(sentences)


def _sentence(figure: str, of_inputs: pd.DataFrame) -> str:
    most = of_inputs.sort_values("effect", ascending=False, kind="stable").head(NAMED)
    value = significant(float(of_inputs["figure_value"].iloc[0]), 3)
    return gettext(SENTENCES[figure], value=value, inputs=_listed(figure, most))


def _listed(figure: str, inputs: pd.DataFrame) -> str:
    named: Sequence[str] = [
        gettext(
            "{input} (±{deviation}: ±{effect} {unit})",
            input=gettext(INPUTS[str(key)].label),
            deviation=_with_unit(INPUTS[str(key)].deviation, INPUTS[str(key)].unit),
            effect=significant(float(row["effect"]), 2),
            unit=gettext(EFFECT_UNITS[figure]) if figure == LIGHT else EFFECT_UNITS[figure],
        )
        for key, row in inputs.iterrows()
    ]
    return ", ".join(named)


def _with_unit(value: float, unit: str) -> str:
    shown = {"deg": "°", "": ""}.get(unit, f" {unit}")
    return f"{significant(value, 2)}{shown}"


MOST_ROOMS = 3  # whose bands are written out
RULE_WORDS = {
    "lm83_accepted": N_("sDA of at least 55 % (LM-83)"),
    "en17037_minimum": N_("daylight provision of EN 17037, level minimum"),
    "en17037_glare": N_("DGP above 0.40 in at most 5 % of the occupied hours (EN 17037)"),
}


def bands_sentence(result: RunResult) -> str:
    """Bands of daylight and heat, and how likely rules are met; "" without bands."""
    rooms = [room for room in result.spaces if room.bands is not None]
    sentences = [_bands_of(room) for room in rooms[:MOST_ROOMS]]
    if len(rooms) > MOST_ROOMS:
        sentences.append(gettext("The bands of the other rooms are in their bands.csv and bands_verdicts.csv."))
    return " ".join(sentences)


def _bands_of(room: RoomYear) -> str:
    if room.bands is None:
        return ""
    figures = room.bands.figures.set_index("figure")
    loads = [name for name in LOADS if name in figures.index]
    heat = max(loads, key=lambda name: float(figures.loc[name, "value"])) if loads else "highest_operative_c"
    parts = [
        gettext(
            BAND_WORDS[name],
            low=significant(float(figures.loc[name, "p5"]), 3),
            median=significant(float(figures.loc[name, "median"]), 3),
            high=significant(float(figures.loc[name, "p95"]), 3),
        )
        for name in (LIGHT, heat)
        if name in figures.index
    ]
    text = gettext("{room}: {bands}.", room=room.space.label, bands="; ".join(parts))
    return " ".join([text, *(_likely(row) for _, row in room.bands.verdicts.iterrows())])


BAND_WORDS = {
    "da300": N_("daylight autonomy {median} % (90 % band {low} to {high})"),
    "cooling_kwh": N_("cooling {median} kWh (90 % band {low} to {high})"),
    "heating_kwh": N_("heating {median} kWh (90 % band {low} to {high})"),
    "highest_operative_c": N_("highest operative temperature {median} °C (90 % band {low} to {high})"),
}


def _likely(verdict: pd.Series) -> str:
    facts = {"rule": gettext(RULE_WORDS[str(verdict["rule"])]), "times": f"{verdict['met_percent']:.0f}"}
    if not verdict["decided_by"]:
        return gettext("{rule}: met in {times} of 100 cases.", **facts)
    return gettext(
        "{rule}: met in {times} of 100 cases; what would make it surer: {input}, {share} % of the variance.",
        **facts,
        input=gettext(INPUTS[str(verdict["decided_by"])].label),
        share=f"{verdict['decided_percent']:.0f}",
    )
