"""The method of a run in words, for the reader of its report."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.glare.classes import mean_error
from scenes.language.catalogue import N_, gettext, translated
from scenes.language.numbers import rounded, share
from scenes.report.headline import moves
from scenes.results import RunResult

METHODS = {"three-phase": N_("three-phase"), "five-phase": N_("five-phase"), "point-in-time": N_("point-in-time")}
MATRICES = N_(
    "Mitsuba 3 traces rays for the view matrix V (light that leaves the window in each direction "
    "and reaches a sensor) and the daylight matrix D (light of each patch of sky and ground that "
    "reaches the window). With the transmission matrix T of the fenestration (from its BSDF) and "
    "the sky vector s of each hour, the illuminance is V T D s."
)
SKIES = N_("Skies follow the Perez all-weather model, from the direct and diffuse irradiance of the weather file.")
LIGHT = {  # sentences
    "three-phase": (N_("Three-phase method."), MATRICES, SKIES),
    "five-phase": (
        N_("Five-phase method."),
        MATRICES,
        N_(
            "Its direct sun is replaced by the true solar disc of 0.53°, traced through the BSDF "
            "of the window with the specular beam kept separate: V T D s - V_d T D_d s_d + C_ds "
            "s_sun."
        ),
        SKIES,
    ),
    "point-in-time": (
        N_(
            "Point-in-time path tracing: in every hour with daylight, Mitsuba 3 traces paths from "
            "each sensor through the BSDF of the window to the sky and to the true solar disc of "
            "0.53°, with all interreflections, those from the room side of the window included."
        ),
        SKIES,
    ),
}
PICTURES = {
    "three-phase": N_(
        "Luminance pictures of 180° are computed for the chosen hours with the same matrices; the "
        "sun is spread over the directions of the BSDF. Their bright areas and the illuminance at "
        "the eye give the daylight glare probability (Wienold and Christoffersen 2006)."
    ),
    "five-phase": N_(
        "Luminance pictures of 180° are computed for the chosen hours with the same method; the "
        "solar disc, its beam on surfaces and its light scattered by the window are computed for "
        "each pixel. Their bright areas and the illuminance at the eye give the daylight glare "
        "probability (Wienold and Christoffersen 2006)."
    ),
    "point-in-time": N_(
        "Luminance pictures of 180° are computed for the chosen hours by path tracing from each "
        "pixel. Their bright areas and the illuminance at the eye give the daylight glare "
        "probability (Wienold and Christoffersen 2006)."
    ),
}
HEAT = (
    N_(
        "The daylight matrix in the solar band gives the solar radiation that the window transmits "
        "and absorbs; the two layers of the window model exchange heat according to its U-value "
        "and g-value (Kuhn's Blackbox model)."
    ),
    N_(
        "The sky for heat has the three components of Perez's model for tilted planes: isotropic, "
        "circumsolar and horizon."
    ),
)
CONTROLLED = N_(
    "A heat balance of the room's surfaces and air every ten minutes, with the gains, outdoor air "
    "and set points of the operation file, gives the temperatures."
)
FREE_RUNNING = N_(
    "A heat balance of the room's surfaces and air every ten minutes, without heating and cooling, "
    "gives the temperatures."
)
COMFORT = N_("Comfort follows from the operative temperature and the running mean of the outdoor temperature.")


def method_words(result: RunResult) -> list[tuple[str, str]]:
    """Heading and text of each part."""
    rooms = result.spaces
    worst = share(max(float(r.daylight.relative_error.max()) for r in rooms))
    mean = share(float(np.mean([r.daylight.relative_error.mean() for r in rooms])))
    errors = {"mean": mean, "worst": worst}
    bars = (
        gettext(
            "Ray tracing has random errors. Their relative standard error, from independent "
            "repetitions, is {mean} % on average and {worst} % at most for the annual mean "
            "illuminance of the sensors: 68 % of the errors are smaller, 95 % are smaller than "
            "twice that. It does not cover the weather file, the sky model, the assumed "
            "reflectances or the 10° to 15° over which the BSDF averages the sun.",
            **errors,
        )
        if result.method == "three-phase"
        else gettext(
            "Ray tracing has random errors. Their relative standard error, from independent "
            "repetitions, is {mean} % on average and {worst} % at most for the annual mean "
            "illuminance of the sensors: 68 % of the errors are smaller, 95 % are smaller than "
            "twice that. It does not cover the weather file, the sky model, the assumed "
            "reflectances or the directions over which the BSDF averages scattered light.",
            **errors,
        )
    )
    sentences = [
        (gettext("Light"), " ".join(gettext(sentence) for sentence in LIGHT[result.method])),
        (gettext("Error bars"), bars + _glare_error(result)),
    ]
    if any("ase1000_250" in room.daylight.room_metrics for room in rooms):
        sun = gettext(
            "Annual sunlight exposure counts direct sun through the window, scattered by it or "
            "not, without interreflections in the room."
        )
        if _moved(result):
            sun += " " + gettext("It is for the most open shading state.")
        sentences.append((gettext("Direct sun"), sun))
    sources = _sources(result)
    if sources:
        sentences.append((gettext("Fenestration"), sources))
    sentences.append((gettext("Glare"), _glare(result)))
    sentences.append((gettext("Heat"), _heat(result)))
    twins = [room.space.label for room in rooms if room.template]
    if twins:
        names = ", ".join(twins)
        text = (
            gettext(
                "Of rooms with equal shape, orientation, materials, windows and surroundings, one "
                "is computed; its light also stands for {rooms}.",
                rooms=names,
            )
            if _coupled(result)
            else gettext(
                "Of rooms with equal shape, orientation, materials, windows and surroundings, one "
                "is computed; its results also stand for {rooms}.",
                rooms=names,
            )
        )
        sentences.append((gettext("Equal rooms"), text))
    return sentences


def _glare_error(result: RunResult) -> str:
    """The standard error of DGP from the noise of pictures, where it is known."""
    errors = [p.glare["dgp_standard_error"] for r in result.spaces for p in r.glare.pictures]
    errors += [
        float(error)
        for room in result.spaces
        if room.annual_glare is not None
        for error in room.annual_glare["dgp_standard_error"]
    ]
    mean = mean_error(errors)
    if mean is None:
        return ""
    typical, most = (
        rounded(error, 3) if error >= 5e-4 else gettext("below {limit}", limit=rounded(1e-3, 3))
        for error in (mean, np.nanmax(errors))
    )
    return " " + gettext(
        "The standard error of DGP, from pictures with half of the paths each, is {typical} (root "
        "mean square over the hours) and {most} at most.",
        typical=typical,
        most=most,
    )


def _sources(result: RunResult) -> str:
    """Where each system comes from; empty where that is not known."""
    tables = [values for room in result.spaces for values in room.heat.fenestration]
    sources = {
        gettext("{system}: from {source}.", system=t["system"], source=translated(t["source"]))
        for t in tables
        if t.get("source")
    }
    return " ".join(sorted(sources))


def _moved(result: RunResult) -> bool:
    return any(map(moves, result.spaces))


def _glare(result: RunResult) -> str:
    text = gettext(PICTURES[result.method])
    rule = next((room.glare.rule for room in result.spaces if room.glare.rule), "")
    if rule:
        text += " " + gettext("Glare sources: {rule}.", rule=translated(rule))
    if any(room.annual_glare is not None for room in result.spaces):
        text += " " + gettext(
            "All hours with the sun up are rated in the same way; EN 17037 requires that DGP "
            "exceeds its limit in at most 5 % of the hours of use."
        )
    return text


def _coupled(result: RunResult) -> bool:
    """Whether heat flows between the rooms computed."""
    return len(result.spaces) > 1 and bool(result.manifest.get("options", {}).get("coupled_heat"))


def _heat(result: RunResult) -> str:
    controlled = any(room.operation is not None for room in result.spaces)
    sentences = [*HEAT, CONTROLLED if controlled else FREE_RUNNING, COMFORT]
    if _coupled(result):
        sentences.append(N_("The rooms are balanced together: heat flows through the walls between them."))
    elif len(result.spaces) > 1:
        sentences.append(N_("Each room is balanced alone; adjacent rooms are assumed to have its temperature."))
    if _moved(result):
        sentences.append(N_("The shading state of each hour applies to light, glare and heat alike."))
    return " ".join(gettext(sentence) for sentence in sentences)
