"""What a person feels: PMV by ISO 7730, SET by Gagge's two-node model; compiled.

Both are judged by pythermalcomfort in the tests.  A run does without that package, whose import
takes as long as a room's year.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal.records import ENTRY, inlined

FloatArray = NDArray[np.float64]
MET = 58.15  # [W/m2] ISO 7730
MET_SET = 58.2  # [W/m2] of the two-node model, and what else it counts with:
BODY_AREA, BODY_MASS = 1.8258, 70.0  # [m2], [kg]
NEUTRAL_SKIN, NEUTRAL_CORE, NEUTRAL_BLOOD = 33.7, 36.8, 6.3  # [degC], [degC], [l/(m2 h)]
MOST_BLOOD, MOST_SWEAT = 90.0, 500.0  # [l/(m2 h)], [g/(m2 h)]
STEFAN = 5.6697e-8  # [W/(m2 K4)]
LEWIS = 2.2  # [K/torr] at one atmosphere
SETTLED = 0.01  # [K] of the clothing


@compiled(**ENTRY)
def fill_pmv(
    air: FloatArray, mrt: FloatArray, speed: FloatArray, humidity: FloatArray,
    met: float, clo: float, pmv: FloatArray,
) -> None:  # fmt: skip
    """Predicted mean vote [H] of air and mean radiant temperature, speed, humidity [%].

    Source: ISO 7730:2005, annex D.
    """
    insulation, heat = 0.155 * clo, MET * met
    thin = insulation <= 0.078
    area = 1.0 + 1.29 * insulation if thin else 1.05 + 0.645 * insulation
    for h in range(air.size):
        vapour = humidity[h] * 10.0 * np.exp(16.6536 - 4030.183 / (air[h] + 235.0))  # [Pa]
        forced, kelvin = 12.1 * np.sqrt(speed[h]), air[h] + 273.0
        radiant = ((mrt[h] + 273.0) / 100.0) ** 4
        p1 = insulation * area
        p2, p3, p4 = 3.96 * p1, 100.0 * p1, p1 * kelvin
        p5 = 308.7 - 0.028 * heat + p2 * radiant
        guess = kelvin + (35.5 - air[h]) / (3.5 * (6.45 * insulation + 0.1))
        x, before, film = guess / 100.0, guess / 50.0, forced
        for _ in range(150):
            if abs(x - before) <= 0.00015:
                break
            before = 0.5 * (before + x)
            film = max(2.38 * abs(100.0 * before - kelvin) ** 0.25, forced)
            x = (p5 + p4 * film - p2 * before**4) / (100.0 + p3 * film)
        lost = 3.05e-3 * (5733.0 - 6.99 * heat - vapour)  # through the skin
        lost += 0.42 * max(heat - MET, 0.0)  # by sweating
        lost += 1.7e-5 * heat * (5867.0 - vapour) + 0.0014 * heat * (34.0 - air[h])  # breathing
        lost += 3.96 * area * (x**4 - radiant) + area * film * (100.0 * x - 273.0 - air[h])
        pmv[h] = (0.303 * np.exp(-0.036 * heat) + 0.028) * (heat - lost)


@inlined
def _saturation(temperature: float) -> float:
    """Pressure of saturated vapour [torr]."""
    return np.exp(18.6686 - 4030.183 / (temperature + 235.0))


@inlined
def _film(speed: float, met: float) -> float:
    """Convection at the body [W/(m2 K)]."""
    walking = 5.66 * (met - 0.85) ** 0.39 if met > 0.85 else 0.0
    return max(3.0, 8.600001 * speed**0.53, walking)


@inlined
def _clothed(
    skin: float, air: float, mrt: float, film: float, clo: float, layer: float, around: float
) -> tuple[float, float, float]:
    """Radiant film, resistance of the air layer and operative temperature as clothing settles.

    layer, around: resistance and operative temperature of the minute before.
    """
    cloth, area, radiant = 0.155 * clo, 1.0 + 0.15 * clo, 0.0
    clothing = (layer * skin + cloth * around) / (layer + cloth)
    for _ in range(150):
        radiant = 4.0 * 0.95 * STEFAN * (0.5 * (clothing + mrt) + 273.15) ** 3 * 0.73  # standing
        layer = 1.0 / (area * (radiant + film))
        around = (radiant * mrt + film * air) / (radiant + film)
        before = clothing
        clothing = (layer * skin + cloth * around) / (layer + cloth)
        if abs(clothing - before) <= SETTLED:
            break
    return radiant, layer, around


@inlined
def _after_an_hour(
    air: float, mrt: float, speed: float, vapour: float, met: float, clo: float
) -> tuple[float, float, float, float]:
    """Skin [degC], its heat [W/m2], its wetted share and the radiant film after 59 minutes."""
    film, area, cloth = _film(speed, met), 1.0 + 0.15 * clo, 0.155 * clo
    work = met * MET_SET
    wettest = 0.59 * speed**-0.08 if clo > 0 else 0.38 * speed**-0.29
    wet_resistance = 1.0 / (LEWIS * area * film) + cloth / (LEWIS * (0.45 if clo > 0 else 1.0))
    skin, core, blood, share, made = NEUTRAL_SKIN, NEUTRAL_CORE, NEUTRAL_BLOOD, 0.1, work
    neutral_body = 0.1 * NEUTRAL_SKIN + 0.9 * NEUTRAL_CORE
    evaporated, dry, wet, radiant = 0.1 * met, 0.0, 0.0, 4.7
    layer, around = 1.0 / (area * (4.7 + film)), (4.7 * mrt + film * air) / (4.7 + film)
    breath = 0.0023 * work * (44.0 - vapour) + 0.0014 * work * (34.0 - air)
    for _ in range(59):
        radiant, layer, around = _clothed(skin, air, mrt, film, clo, layer, around)
        dry = (skin - around) / (layer + cloth)
        inward = (core - skin) * (5.28 + 1.163 * blood)
        per_minute = BODY_AREA / (0.97 * BODY_MASS * 60.0)
        core, skin = (
            core + (made - inward - breath) * per_minute / (1.0 - share),
            skin + (inward - dry - evaporated) * per_minute / share,
        )
        cold = max(NEUTRAL_SKIN - skin, 0.0)
        blood = NEUTRAL_BLOOD + 120.0 * max(core - NEUTRAL_CORE, 0.0)
        blood = max(min(blood / (1.0 + 0.5 * cold), MOST_BLOOD), 0.5)
        warm = max(share * skin + (1.0 - share) * core - neutral_body, 0.0)
        sweat = 0.68 * min(170.0 * warm * np.exp(max(skin - NEUTRAL_SKIN, 0.0) / 10.7), MOST_SWEAT)
        most = (_saturation(skin) - vapour) / wet_resistance
        most = 0.001 if most == 0.0 else most
        wet = 0.06 + 0.94 * sweat / most
        evaporated = wet * most
        if wet > wettest:
            wet, part = wettest, (wettest - 0.06) / 0.94
            evaporated = part * most + 0.06 * (1.0 - part) * most
        if most < 0.0:
            wet, evaporated = wettest, 0.0
        made = work + 19.4 * cold * max(NEUTRAL_CORE - core, 0.0)  # shivering
        share = 0.0417737 + 0.7451833 / (blood + 0.585417)
    return skin, dry + evaporated, wet, radiant


@compiled(**ENTRY)
def fill_set(
    air: FloatArray, mrt: FloatArray, speed: FloatArray, humidity: FloatArray,
    met: float, clo: float, found: FloatArray,
) -> None:  # fmt: skip
    """Standard effective temperature [H] [degC]: of still air in which a skin loses as much.

    Source: Gagge, Fobelets and Berglund 1986, ASHRAE Transactions 92(2B):709; ASHRAE 55-2020,
    normative appendix D, at sea level.
    """
    film = _film(0.0, met)  # of the standard environment
    usual = 1.52 / (met + 0.6944) - 0.1835  # [clo] of the activity
    area = 1.0 + 0.25 * usual
    for h in range(air.size):
        moving, vapour = max(speed[h], 0.1), 0.01 * humidity[h] * _saturation(air[h])
        skin, heat, wet, radiant = _after_an_hour(air[h], mrt[h], moving, vapour, met, clo)
        both = film + radiant
        bare = 1.0 / (1.0 + 0.155 * area * both * usual)
        through = 0.45 * film / both * (1.0 - bare) / (film / both - bare * 0.45)
        dry = 1.0 / (1.0 / (area * both) + 0.155 * usual)
        moist = wet / (1.0 / (LEWIS * area * film) + 0.155 * usual / (LEWIS * through))
        x = skin - heat / dry
        for _ in range(50):
            half = 0.5 * _saturation(x)
            left = heat - dry * (skin - x) - moist * (_saturation(skin) - half)
            step = left / (dry + moist * half * 4030.183 / (x + 235.0) ** 2)
            x -= step
            if abs(step) < 1e-6:
                break
        found[h] = x
