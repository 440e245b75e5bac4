"""Sentences that other parts of the program made in English, in the page's language.

What a building's file lacks is said where it is read, long before there is a page, and files and
logs keep it in English.  The texts below have fields for what differs; a sentence that fits none
stays as it is.
"""

from __future__ import annotations

import re
from functools import cache

from scenes.language.catalogue import N_, decimal, gettext

LISTS = {"reasons": "; ", "storeys": ", "}  # fields that hold several such sentences
WORDS = ("verdict", "names", "name", "system", "source", "band", "other", "model", "file", "site")
NUMBER = r"[\d.]+(?: %)?"  # what the other fields hold
FIELD = re.compile(r"\\\{(\w+)\\\}")
HEARD = (
    N_("usable"),
    N_("usable with care"),
    N_("not usable"),
    N_("no rooms"),
    N_("no glass looks out"),
    N_("rooms found from geometry"),
    N_("none looks out of a room"),
    N_("none: the file has no spaces, and no room was found between its walls"),
    N_("Model: {verdict}: {reasons}"),
    N_("usable with care: {reasons}"),
    N_("not usable: {reasons}"),
    N_("THE FILE IS CUT OFF at its end: an unknown part of the building is lost"),
    N_("only {share} of the glass that looks out is used"),
    N_("{share} of the glass that looks out is used"),
    N_("{area} m2 of glass assumed"),
    N_("{area} m2 transparent but no glass"),
    N_("{area} m2 openings without a window closed"),
    N_("{area} m2 of glass with no sky or ground in sight"),
    N_("{some} of {all} spaces are no rooms"),
    N_("{count} pairs of spaces overlap"),
    N_("{count} rooms with open edges"),
    N_("{count} found from geometry ({storeys})"),
    N_("{some} of {all} spaces ({storeys})"),
    N_("{used} of {all} m2 that looks out used ({share}; {some} of {every} windows)"),
    N_("{area} m2 assumed"),
    N_("{area} m2 with no sky or ground in sight"),
    N_("{area} m2 above rooms that are too low"),
    N_("{area} m2 with no room behind"),
    N_("storey {name} has no rooms and {area} m2 of glass unused"),
    N_("{name} {some} of {all}"),
    N_("{names} and {count} more"),
    N_("Windows {names}: {system}, from {source}."),
    N_("Window {names}: {system}, from {source}."),
    N_("{name}: no BSDF, a clear glazing of {panes} pane(s) after Roos et al. 2001."),
    N_("{name}: {count} pane(s) of uncoated glass by Fresnel's equations."),
    N_("{name}: solar transmittance {tau} from U and g (Arasteh et al. 2009)."),
    N_("{name} has no {band} band: its {other} band stands in for it."),
    N_("{name}: window model: {model}."),
    N_("--cfs fills the windows: [[system]] of {file} is not used."),
    N_(
        "{name} holds several shading states; without --operation the first of each window "
        "({names}) holds all year."
    ),
    N_(
        "The building's site ({north} N, {east} E) is far from the weather station {site} "
        "({other_north} N, {other_east} E): the sun is the weather station's."
    ),
)


@cache
def _patterns() -> tuple[tuple[re.Pattern[str], str], ...]:
    found = []
    for text in HEARD:
        found.append((re.compile(FIELD.sub(_group, re.escape(text))), text))
    return tuple(found)


def _group(field: re.Match[str]) -> str:
    name = field[1]
    return f"(?P<{name}>{'.+?' if name in WORDS or name in LISTS else NUMBER})"


def heard(text: str) -> str:
    """A sentence in the page's language; as it is where no text of `HEARD` fits it."""
    for pattern, key in _patterns():
        fits = pattern.fullmatch(text)
        if fits:
            return gettext(key, **{name: _field(name, v) for name, v in fits.groupdict().items()})
    return text


def heard_list(text: str, separator: str) -> str:
    """A sentence, or several in a row, in the page's language."""
    whole = heard(text)
    return separator.join(map(heard, text.split(separator))) if whole == text else whole


def _field(name: str, value: str) -> str:
    if name in LISTS:
        return LISTS[name].join(map(heard, value.split(LISTS[name])))
    if name == "verdict":
        return heard(value)
    return value if name in WORDS else decimal(value)
