"""ASHRAE 140 case 960: a heavy sunspace before a light room, a common wall between them."""

from __future__ import annotations

import numpy as np

from tests.validation import ashrae140_cases as cases
from tests.validation import ashrae140_sun
from tests.validation.facade_sun import SunSteps
from thermal.balance import BalanceOptions, ZoneResult, simulate_zones
from thermal.climate import Climate, Solar
from thermal.emitters import IdealLoads
from thermal.zone import Gains, OpaqueSurface, Zone

SUNSPACE_DEPTH = 2.0


def zones(fenestration) -> tuple[Zone, Zone]:
    """The back room and the sunspace."""
    opening = cases.cases()["900"].openings[0]
    deep, shallow = cases.DEPTH * cases.HEIGHT, SUNSPACE_DEPTH * cases.HEIGHT
    wide, slab = cases.WIDTH * cases.HEIGHT, cases.WIDTH * cases.DEPTH
    south = np.array(cases.NORMALS["south"])
    back = tuple(
        cases.surface(name, area, cases.LIGHT)
        for name, area in (("north", wide), ("east", deep), ("west", deep), ("floor", slab), ("roof", slab))
    )
    common = OpaqueSurface("common", wide, cases.COMMON_WALL, south, "sunspace", "north", absorptance_in=0.6)
    small = cases.WIDTH * SUNSPACE_DEPTH
    front = tuple(
        cases.surface(name, area, cases.HEAVY)
        for name, area in (
            ("south", wide - opening.area),
            ("east", shallow),
            ("west", shallow),
            ("floor", small),
            ("roof", small),
        )
    )
    north = OpaqueSurface("north", wide, cases.COMMON_WALL, -south, "back", "common", absorptance_in=0.6)
    return (
        Zone(
            "back",
            wide * cases.DEPTH,
            (*back, common),
            infiltration_ach=0.5,
            gains=Gains(80.0, 120.0),
            loads=IdealLoads(20.0, 27.0),
        ),
        Zone(
            "sunspace",
            wide * SUNSPACE_DEPTH,
            (*front, north),
            (cases.window(opening, fenestration),),
            infiltration_ach=0.5,
        ),
    )


def run(climate: Climate, steps: SunSteps, options: BalanceOptions, step_s: float) -> tuple[ZoneResult, ...]:
    """The year of the back room and the sunspace."""
    pane = ashrae140_sun.glass("double")
    back, front = zones(pane.fenestration)
    suns = ashrae140_sun.box_irradiance(steps)
    opening = cases.cases()["900"].openings[0]
    sunny, _ = ashrae140_sun.zone_solar(front, (opening,), steps, pane, depth=SUNSPACE_DEPTH, irradiance=suns)
    rows = len(steps.direct_normal)
    dark = Solar(
        absorbed_outer=np.zeros((rows, 0)),
        absorbed_inner=np.zeros((rows, 0)),
        inside=np.zeros((rows, len(back.surfaces))),
        facade=np.stack([suns[s.name].total if s.name in suns else np.zeros(rows) for s in back.surfaces], axis=1),
    )
    return simulate_zones([back, front], climate, [dark, sunny], step_s=step_s, options=options)
