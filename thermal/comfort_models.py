"""Predicted mean vote and standard effective temperature: heat balances of a person, by arrays.

All values of a call are computed together; `metabolic_rate` in met, `clothing` in clo.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
CLO, KELVIN = 0.155, 273.15  # [m2 K/W] of a clo
STEFAN_BOLTZMANN = 5.67e-8
MOST_ROUNDS = 150  # of the clothing's temperature
FILM_ROUNDS, NEWTON_ROUNDS = 5, 8  # of a minute's film, and of SET: settled to 1e-6 K


def predicted_mean_vote(
    air: FloatArray, mrt: FloatArray, speed: FloatArray, humidity: FloatArray, *,
    metabolic_rate: float, clothing: float,
) -> FloatArray:  # fmt: skip
    """PMV [...] of a seated or standing person without external work.

    Args: air, mrt: [...] [degC]; speed: [...] relative [m/s]; humidity: [...] [%].

    Source: ISO 7730:2005, equations (1) to (4) and annex D, with its rounded zero of 273 K.
    """
    met, insulation = 58.15 * metabolic_rate, CLO * clothing
    vapour = 10.0 * humidity * np.exp(16.6536 - 4030.183 / (air + 235.0))  # [Pa]
    larger = 1.0 + 1.29 * insulation if insulation <= 0.078 else 1.05 + 0.645 * insulation
    forced = 12.1 * np.sqrt(speed)
    t_a, t_r = air + 273.0, ((mrt + 273.0) / 100.0) ** 4
    # temperature of the clothing over 100 K: the equation solved for it at the mean of two rounds
    skin = 308.7 - 0.028 * met
    new = (t_a + (35.5 - air) / (3.5 * (6.45 * insulation + 0.1))) / 100.0
    old, film = 2.0 * new, forced
    for _ in range(MOST_ROUNDS):
        unsettled = np.abs(new - old) > 0.00015
        if not unsettled.any():
            break
        middle = np.where(unsettled, 0.5 * (old + new), old)
        film = np.maximum(forced, 2.38 * np.abs(100.0 * middle - t_a) ** 0.25)
        right = skin + insulation * larger * (3.96 * (t_r - middle**4) + film * t_a)
        solved = right / (100.0 + 100.0 * insulation * larger * film)
        old, new = middle, np.where(unsettled, solved, new)
    losses = 3.05e-3 * (5733.0 - 6.99 * met - vapour) + 0.42 * max(met - 58.15, 0.0)
    losses += 1.7e-5 * met * (5867.0 - vapour) + 0.0014 * met * (34.0 - air)
    losses += larger * (3.96 * (new**4 - t_r) + film * (100.0 * new - t_a))
    vote: FloatArray = (0.303 * np.exp(-0.036 * met) + 0.028) * (met - losses)
    return vote


NEUTRAL_SKIN, NEUTRAL_CORE, NEUTRAL_BLOOD = 33.7, 36.8, 6.3  # [degC], [L/(h m2)]
BODY_KG, BODY_M2, BODY_HEAT = 70.0, 1.8258, 0.97  # heat capacity [W h/(kg K)]
LEWIS = 2.2  # [K/Torr] at sea level
MINUTES = 59  # of exposure
STANDING = 0.73  # share of the body's area that radiates
PERMEABLE = 0.45  # clothing to vapour


def _saturation(celsius: FloatArray) -> FloatArray:
    """Vapour pressure of saturated air [Torr]."""
    found: FloatArray = np.exp(18.6686 - 4030.183 / (celsius + 235.0))
    return found


def gagge_set(
    air: FloatArray, mrt: FloatArray, speed: FloatArray, humidity: FloatArray, *,
    metabolic_rate: float, clothing: float,
) -> FloatArray:  # fmt: skip
    """SET [...] [degC]: air of 50 % in which a standard person has skin and heat loss as here.

    Skin and core of a person who stands for an hour exchange heat by blood; skin sweats, vessels
    widen and narrow, muscles shiver.

    Args: as of `predicted_mean_vote`; speed: at least 0.1 m/s.

    Source: Gagge, Fobelets and Berglund 1986, ASHRAE Transactions 92(2B); ANSI/ASHRAE 55-2020,
    normative appendix D.
    """
    moving = np.maximum(speed, 0.1)
    met, r_clo, larger = 58.2 * metabolic_rate, CLO * clothing, 1.0 + 0.15 * clothing
    vapour = 0.01 * humidity * _saturation(air)
    wettest = 0.59 * moving**-0.08 if clothing > 0 else 0.38 * moving**-0.29
    walking = 5.66 * (metabolic_rate - 0.85) ** 0.39 if metabolic_rate > 0.85 else 0.0
    h_c = np.maximum(8.600001 * moving**0.53, max(3.0, walking))
    permeable = PERMEABLE if clothing > 0 else 1.0
    moist = 1.0 / (LEWIS * larger * h_c) + r_clo / (LEWIS * permeable)  # resistance to vapour
    skin, core = np.full_like(air, NEUTRAL_SKIN), np.full_like(air, NEUTRAL_CORE)
    blood, share = np.full_like(air, NEUTRAL_BLOOD), np.full_like(air, 0.1)  # of the skin in mass
    evaporated, heat = np.full_like(air, 0.1 * metabolic_rate), np.full_like(air, met)
    lungs = 0.0023 * met * (44.0 - vapour) + 0.0014 * met * (34.0 - air)
    h_r = np.full_like(air, 4.7)
    for _ in range(MINUTES):
        for _ in range(FILM_ROUNDS):
            operative = (h_r * mrt + h_c * air) / (h_r + h_c)
            layer = 1.0 / (larger * (h_r + h_c))
            clothes = (layer * skin + r_clo * operative) / (layer + r_clo)
            h_r = 3.8 * STEFAN_BOLTZMANN * STANDING * (0.5 * (clothes + mrt) + KELVIN) ** 3
        dry = (skin - operative) / (layer + r_clo)
        to_skin = (core - skin) * (5.28 + 1.163 * blood)
        mass = BODY_HEAT * BODY_KG * 60.0 / BODY_M2
        core = core + (heat - to_skin - lungs) / (mass * (1.0 - share))
        skin = skin + (to_skin - dry - evaporated) / (mass * share)
        warm_skin, cold_skin = (np.maximum(s * (skin - NEUTRAL_SKIN), 0.0) for s in (1.0, -1.0))
        warm_core, cold_core = (np.maximum(s * (core - NEUTRAL_CORE), 0.0) for s in (1.0, -1.0))
        neutral = 0.1 * NEUTRAL_SKIN + 0.9 * NEUTRAL_CORE
        warm = np.maximum(share * skin + (1.0 - share) * core - neutral, 0.0)
        blood = (NEUTRAL_BLOOD + 120.0 * warm_core) / (1.0 + 0.5 * cold_skin)
        blood = np.clip(blood, 0.5, 90.0)
        sweat = 0.68 * np.minimum(170.0 * warm * np.exp(warm_skin / 10.7), 500.0)
        most = (_saturation(skin) - vapour) / moist
        most = np.where(most == 0.0, 1e-3, most)
        wet = 0.06 + 0.94 * sweat / most
        drips = wet > wettest
        part = (wettest - 0.06) / 0.94
        sweat = np.where(drips, part * most, sweat)
        diffused = np.where(drips, 0.06 * (1.0 - part) * most, wet * most - sweat)
        evaporated = np.where(most < 0.0, 0.0, sweat + diffused)
        wet = np.where(drips | (most < 0.0), wettest, wet)
        heat = met + 19.4 * cold_skin * cold_core
        share = 0.0417737 + 0.7451833 / (blood + 0.585417)
    return _standard(skin, dry + evaporated, wet, h_r, max(3.0, walking), metabolic_rate)


def _standard(
    skin: FloatArray, lost: FloatArray, wet: FloatArray, h_r: FloatArray, h_c: float, met: float
) -> FloatArray:
    """Temperature of still air of 50 % in which clothes of the activity lose that heat [W/m2]."""
    clo = 1.52 / (met + 0.6944) - 0.1835
    larger, film = 1.0 + 0.25 * clo, h_c + h_r
    naked = 1.0 / (1.0 + CLO * larger * film * clo)
    ratio = h_c / film
    passes = PERMEABLE * ratio * (1.0 - naked) / (ratio - naked * PERMEABLE)
    dry = 1.0 / (1.0 / (larger * film) + CLO * clo)
    moist = wet / (1.0 / (LEWIS * larger * h_c) + CLO * clo / (LEWIS * passes))
    found: FloatArray = skin - lost / dry
    for _ in range(NEWTON_ROUNDS):
        half = 0.5 * _saturation(found)
        excess = lost - dry * (skin - found) - moist * (_saturation(skin) - half)
        step = excess / (dry + moist * half * 4030.183 / (found + 235.0) ** 2)
        found = found - step
    return found
