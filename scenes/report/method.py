"""What was done, in words: the method of a run as the reader of its report is told."""

from __future__ import annotations

import numpy as np

from scenes.language.catalogue import said
from scenes.report.numbers import rounded, share
from scenes.results import RunResult

TRACED = (
    "Rays traced with Mitsuba 3 give how much of each direction of light leaving the window "
    "reaches each sensor (view matrix V) and how much of each patch of sky and ground reaches the "
    "window (daylight matrix D). With the transmission matrix T of the fenestration (from its "
    "BSDF, the table of how it sends light on from every direction into every direction) and the "
    "sky of each hour s, the illuminance is V T D s."
)
SKIES = (
    "Skies follow Perez's all-weather model from the direct and diffuse irradiance of the weather "
    "file."
)
LIGHT = {  # sentences
    "three-phase": ("The three-phase method.", TRACED, SKIES),
    "five-phase": (
        "The five-phase method.",
        TRACED,
        "What of it comes straight from the sun is taken out and traced anew with the sun's true "
        "disc of 0.53 degrees through the window's BSDF, its through beam kept apart: "
        "V T D s - V_d T D_d s_d + C_ds s_sun.",
        SKIES,
    ),
    "point-in-time": (
        "Point-in-time path tracing: in every hour with daylight paths are traced with Mitsuba 3 "
        "from each sensor through the window's BSDF to the sky and to the sun's true disc of 0.53 "
        "degrees, with all reflections, also from the window's back.",
        SKIES,
    ),
}
PICTURES = {
    "three-phase": "by the same matrices, the sun spread over the directions of the BSDF's table",
    "five-phase": (
        "by the same method: the sun's disc, its beam on surfaces and its light scattered in the "
        "window are looked for in each pixel"
    ),
    "point-in-time": "by paths from each pixel",
}
PATCHES = (
    "or the 10 to 15 degrees over which the directions of the fenestration's table average the sun"
)
SCATTER = "or the directions over which the fenestration's table averages what it scatters"


def method_words(result: RunResult) -> list[tuple[str, str]]:
    """Heading and text of each part of the method."""
    rooms = result.spaces
    worst = share(max(float(r.daylight.relative_error.max()) for r in rooms))
    mean = share(float(np.mean([r.daylight.relative_error.mean() for r in rooms])))
    bars = said(
        "Traced numbers scatter; the spread of independent repetitions gives their relative "
        "standard error: two times out of three the exact value is nearer than this, 19 times out "
        "of 20 nearer than twice this. For the annual mean illuminance it is {mean} % as a mean "
        "over all sensors and {worst} % at the worst. It covers the tracing only: not the weather "
        "file, the sky model, the reflectances taken, {blurred}.",
        mean=mean,
        worst=worst,
        blurred=said(PATCHES if result.method == "three-phase" else SCATTER),
    )
    found = [
        (said("Light"), " ".join(said(sentence) for sentence in LIGHT[result.method])),
        (said("Error bars"), bars + _glare_error(result)),
    ]
    if any("ase1000_250" in room.daylight.room_metrics for room in rooms):
        sun = said(
            "Annual sunlight exposure counts what comes straight from the sun through the window, "
            "scattered in it or not, without reflections in the room."
        )
        if _controlled(result):
            sun += " " + said("It is that of the most open shading state.")
        found.append((said("Direct sun"), sun))
    sources = _sources(result)
    if sources:
        found.append((said("Fenestration"), sources))
    found.append((said("Glare"), _glare(result)))
    found.append((said("Heat"), _heat(result)))
    twins = [room.space.label for room in rooms if room.template]
    if twins:
        text = said(
            "Of rooms equal in shape, orientation, materials, windows and surroundings one is "
            "computed; its light is given for the others too ({rooms})."
            if _coupled(result)
            else "Of rooms equal in shape, orientation, materials, windows and surroundings one is "
            "computed; its results are given for the others too ({rooms}).",
            rooms=", ".join(twins),
        )
        found.append((said("Equal rooms"), text))
    return found


def _glare_error(result: RunResult) -> str:
    """The standard error of DGP from the noise of pictures, where it is known."""
    errors = [p.glare["dgp_standard_error"] for r in result.spaces for p in r.glare.pictures]
    errors += [
        float(error)
        for room in result.spaces
        if room.annual_glare is not None
        for error in room.annual_glare["dgp_standard_error"].dropna()
    ]
    known = np.array([error for error in errors if not np.isnan(error)])
    if not len(known):
        return ""
    typical, most = (
        rounded(error, 4) if error >= 5e-5 else said("below {limit}", limit=rounded(1e-4, 4))
        for error in (np.sqrt(np.mean(known**2)), known.max())
    )
    return " " + said(
        "The standard error of DGP, from pictures of halves of the paths, is {typical} (root mean "
        "square of the hours), at the worst {most}.",
        typical=typical,
        most=most,
    )


def _sources(result: RunResult) -> str:
    """Where each system comes from; empty where that is not known."""
    tables = [values for room in result.spaces for values in room.heat.fenestration]
    sources = {
        said("{system}, from {source}.", system=t["system"], source=t["source"])
        for t in tables
        if t.get("source")
    }
    return " ".join(sorted(sources))


def _controlled(result: RunResult) -> bool:
    return any(room.operation is not None and len(room.operation.states) > 1
               for room in result.spaces)  # fmt: skip


def _glare(result: RunResult) -> str:
    text = said(
        "Luminance pictures of 180 degrees are made for the chosen hours, {how}; bright areas "
        "found in them and the light at the eye give the daylight glare probability (Wienold and "
        "Christoffersen 2006).",
        how=said(PICTURES[result.method]),
    )
    rule = next((room.glare.rule for room in result.spaces if room.glare.rule), "")
    if rule:
        text += " " + said("Glare sources: {rule}.", rule=rule)
    if any(room.annual_glare is not None for room in result.spaces):
        text += " " + said(
            "The same was done for every hour with the sun up; EN 17037 asks that DGP exceeds its "
            "limit in no more than 5 % of the hours of use."
        )
    return text


def _coupled(result: RunResult) -> bool:
    """Whether heat flows between the rooms computed."""
    return len(result.spaces) > 1 and bool(result.manifest.get("options", {}).get("coupled_heat"))


def _heat(result: RunResult) -> str:
    sentences = [
        "The daylight matrix in the solar band gives the solar radiation passing into the room and "
        "absorbed in the window, whose two layers take and give heat by its U and g (Kuhn's "
        "Blackbox).",
        "The sky of heat has three parts with the irradiances that Perez found on tilted planes: "
        "an even dome, light around the sun and a band at the horizon.",
        "A balance of the room's surfaces and air every ten minutes, with the gains, outdoor air "
        "and set points of the operation file, gives temperatures."
        if any(room.operation is not None for room in result.spaces)
        else "A balance of the room's surfaces and air every ten minutes, without heating or "
        "cooling, gives temperatures.",
        "Comfort follows from the operative temperature and the running mean of the outdoor "
        "temperature.",
    ]
    if _coupled(result):
        sentences.append(
            "The rooms computed are balanced together: heat flows through what lies between."
        )
    elif len(result.spaces) > 1:
        sentences.append(
            "Each room is balanced alone, with rooms of its own temperature around it."
        )
    if _controlled(result):
        sentences.append("Each hour's shading state holds for light, glare and heat together.")
    return " ".join(said(sentence) for sentence in sentences)
