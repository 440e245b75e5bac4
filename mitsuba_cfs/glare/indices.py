"""Glare indices of a list of sources: each a pure function, named as in its source.

Sources are given by luminance L [cd/m2], solid angle omega [sr] and position index P, arrays [n].
With no source the indices that rest on sources alone are 0 (VCP: 100), as evalglare has it.
Luminances are in cd/m2, illuminances at the eye in lx.

Source: named at each function; constants as in evalglare 3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

# Constants of DGP as evalglare has them, see `daylight_glare_probability`
DGP_PER_LUX, DGP_OF_CONTRAST, DGP_IN_DARK, ADAPTATION = 5.87e-5, 0.092, 0.159, 1.87


def contrast_term(luminance: ArrayLike, omega: ArrayLike, position: ArrayLike) -> float:
    """sum L^2 omega / P^2, the term that DGP, UGR, UGP and CGI share."""
    L, w, P = (np.asarray(a, dtype=float) for a in (luminance, omega, position))
    return float(np.sum(L * L * w / (P * P)))


def daylight_glare_probability(illuminance: float, contrast: float, *, most: float = 1.0) -> float:
    """DGP = 5.87e-5 E_v + 0.092 log10(1 + sum L^2 omega/(P^2 E_v^1.87)) + 0.159, at most `most`.

    Source: Wienold and Christoffersen (2006); the paper prints 9.18e-2 and 0.16, evalglare computes
    with the constants here.
    """
    if illuminance <= 0:
        return DGP_IN_DARK
    glare = DGP_OF_CONTRAST * math.log10(1 + contrast / illuminance**ADAPTATION)
    return min(DGP_PER_LUX * illuminance + glare + DGP_IN_DARK, most)


def simplified_dgp(illuminance: float) -> float:
    """sDGP = 6.22e-5 E_v + 0.184, at most 1.

    Source: Wienold (2007), Dynamic simulation of blind control strategies for visual comfort.
    Only for scenes without direct sun or its specular reflection in view.
    """
    return min(6.22e-5 * illuminance + 0.184, 1.0)


def low_light_factor(illuminance: float) -> float:
    """exp(0.024 E_v - 4)/(1 + exp(0.024 E_v - 4)) below 1,000 lx, else 1; multiplies DGP.

    Source: Wienold (2012), the low-light correction of evalglare (off by default since 2.14).
    """
    if illuminance >= 1000:
        return 1.0
    return 1.0 / (1.0 + math.exp(4.0 - 0.024 * illuminance))


def age_factor(age: float) -> float:
    """1/(1.1 - 0.5 age/100), age in years; multiplies DGP.

    Source: Wienold (2009), the age correction that evalglare had until 1.17 (withdrawn there for
    lack of statistical evidence); 1 at an age of 20.
    """
    if not 0 <= age < 150:
        raise ValueError(f"age {age:g}: expected years")
    return 1.0 / (1.1 - 0.5 * age / 100.0)


def daylight_glare_index(luminance: ArrayLike, omega: ArrayLike, position: ArrayLike, background: float) -> float:
    """DGI = 10 log10 sum 0.478 L^1.6 (omega/P^2)^0.8/(L_b + 0.07 omega^0.5 L).

    Source: Hopkinson (1972), Chauvel et al. (1982).
    """
    return _daylight_glare_index(luminance, omega, position, background)


def modified_dgi(luminance: ArrayLike, omega: ArrayLike, position: ArrayLike, illuminance: float) -> float:
    """DGI with (E_v/pi)^0.85 for the background luminance. Source: Fisekis et al. (2003)."""
    adaptation = (illuminance / math.pi) ** 0.85
    return _daylight_glare_index(luminance, omega, position, adaptation)


def _daylight_glare_index(luminance: ArrayLike, omega: ArrayLike, position: ArrayLike, background: float) -> float:
    L, w, P = (np.asarray(a, dtype=float) for a in (luminance, omega, position))
    if L.size == 0:
        return 0.0
    terms = 0.478 * L**1.6 * (w / P**2) ** 0.8 / (background + 0.07 * np.sqrt(w) * L)
    return 10 * _log10(float(terms.sum()))


def unified_glare_rating(contrast: float, background: float) -> float:
    """UGR = 8 log10(0.25/L_b sum L^2 omega/P^2); -99 where L_b is not positive.

    Source: CIE 117 (1995).
    """
    if contrast == 0:
        return 0.0
    return 8 * math.log10(0.25 / background * contrast) if background > 0 else -99.0


def experimental_ugr(
    luminance: ArrayLike, omega: ArrayLike, position: ArrayLike, background: float, illuminance: float
) -> float:
    """8 log10(E_v/pi) + 8 log10(sum L omega/P^2 / L_b). Source: Fisekis et al. (2003)."""
    L, w, P = (np.asarray(a, dtype=float) for a in (luminance, omega, position))
    if L.size == 0:
        return 0.0
    lit = float(np.sum(L * w / P**2))
    return 8 * _log10(illuminance / math.pi) + 8 * _log10(_ratio(lit, background))


def unified_glare_probability(contrast: float, background: float) -> float:
    """UGP = 0.26 log10(0.25/L_b sum L^2 omega/P^2). Source: Hirning et al. (2014)."""
    return 0.26 * _log10(0.25 * _ratio(contrast, background)) if contrast > 0 else 0.0


def logistic_ugp(contrast: float, background: float) -> float:
    """UGP = (1 + 2/7 (sum L^2 omega/P^2 / L_b)^-0.2)^-10. Source: Hirning et al. (2017)."""
    if contrast <= 0:
        return 0.0
    return (1.0 + 2.0 / 7.0 * _ratio(contrast, background) ** -0.2) ** -10.0


def cie_glare_index(contrast: float, illuminance: float, direct: float) -> float:
    """CGI = 8 log10(2 (1 + E_d/500)/E_v sum L^2 omega/P^2), E_v = E_d + E_i.

    Source: Einhorn (1979).
    """
    if contrast == 0:
        return 0.0
    return 8 * _log10(2 * (1 + direct / 500) * _ratio(contrast, illuminance))


def discomfort_glare_rating(luminance: ArrayLike, omega: ArrayLike, position: ArrayLike, field: float) -> float:
    """DGR = (sum 0.5 L Q/(P F^0.44))^(n^-0.0914), Q = 20.4 omega + 1.52 omega^0.2 - 0.075.

    F is the average luminance of the field of view. Q is negative below 2.9e-7 sr: where such
    sources outweigh the others there is no glare. Source: IES RQQ (1966).
    """
    L, w, P = (np.asarray(a, dtype=float) for a in (luminance, omega, position))
    if L.size == 0:
        return 0.0
    Q = 20.4 * w + 1.52 * w**0.2 - 0.075
    total = float(np.sum(0.5 * L * Q / (P * field**0.44)))
    return max(total, 0.0) ** (L.size**-0.0914)


def visual_comfort_probability(rating: float) -> float:
    """VCP [%] of a DGR: 50 erf((6.374 - 1.3227 ln DGR)/sqrt 2) + 50; 100 below 20, 0 above 750.

    Source: IES RQQ (1966), Guth (1963).
    """
    if rating < 20:
        return 100.0
    if rating > 750:
        return 0.0
    return 50 * math.erf((6.374 - 1.3227 * math.log(rating)) / math.sqrt(2)) + 50


def veiling_luminance(luminance: ArrayLike, omega: ArrayLike, sigma: ArrayLike) -> float:
    """Poynter's veiling luminance: 5 sum L omega cos(sigma)/sigma, sigma in degrees below.

    Args:
        sigma: [n] angles to the line of sight [rad].
    """
    L, w, s = (np.asarray(a, dtype=float) for a in (luminance, omega, sigma))
    return float(5 * np.sum(L * w * np.cos(s) / (np.degrees(s) + 1e-11)))


def cie_veiling_luminance(illuminance: ArrayLike, sigma: ArrayLike) -> np.ndarray:
    """Veiling luminance [n] [cd/m2] of each source: 10 E/sigma^2, sigma in degrees below.

    Source: Stiles-Holladay, CIE 31 (1976).

    Args:
        illuminance: [n] of each source at the eye [lx].
        sigma: [n] angles to the line of sight [rad].
    """
    return 10 * np.asarray(illuminance) / (np.degrees(sigma) ** 2 + 1e-16)


def _ratio(above: float, below: float) -> float:
    """above/below with the limit that C arithmetic gives: infinite (or none) over zero."""
    if below == 0:
        return math.inf if above > 0 else math.nan
    return above / below


def _log10(value: float) -> float:
    """log10 with its limits: -inf at 0, nan below, inf at inf."""
    if value > 0:
        return math.log10(value)
    return -math.inf if value == 0 else math.nan
