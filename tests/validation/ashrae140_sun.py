"""Sun through the windows of the ASHRAE 140 cases: optics of the glass, shade, first hits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.glazing import Pane, hemispherical_mean, pane_optics, stack
from tests.validation.ashrae140_cases import NORMALS, SEEN_FROM, Opening, opening_rooms
from tests.validation.facade_sun import FacadeSun, SunSteps, facade_sun
from tests.validation.room_exchange import spread_evenly
from tests.validation.sunlit_facade import diffuse_lit_share, lit_share
from tests.validation.sunlit_room import BeamTable, diffuse_hits
from thermal.blackbox import (
    R_INNER,
    R_OUTER,
    Fenestration,
    LayerResistance,
    fit_conductance_surface,
    layer_absorptances,
)
from thermal.climate import Solar
from thermal.glazing import GLASS_CONDUCTIVITY, Gap, en410_g_value, en673_u_value
from thermal.zone import Zone

FloatArray = NDArray[np.float64]
ANGLES = np.radians(np.linspace(0.0, 90.0, 91))
PANE = (0.003048, 0.834, 0.075)  # thickness [m], tau and rho at normal incidence
LOW_E = (0.452, 0.359, 0.397)  # tau, rho outside and inside; the coating faces the gap
LOW_E_THICKNESS = 0.00318
ARGON_GAP = Gap(0.012, (("argon", 1.0),), (0.047, 0.84))
AIR_GAP = Gap(0.012, (("air", 1.0),), (0.84, 0.84))


@dataclass(frozen=True, slots=True)
class AshraeGlazing:
    """A glazing of the standard: the Blackbox and its optics per angle of `ANGLES`."""

    fenestration: Fenestration
    tau: FloatArray  # [91]
    outer: FloatArray  # [91] absorptance of the outer layer
    inner: FloatArray  # [91]
    diffuse: tuple[float, float, float]  # tau, outer and inner absorptance
    back: tuple[float, float, float]  # rho, outer and inner absorptance for light of the room


def glass(kind: str) -> AshraeGlazing:
    """The double (600), low-e (660) or single (670) glazing, through U, g and the Blackbox."""
    thickness, tau, rho = PANE
    clear = pane_optics(Pane("clear", tau, rho, rho), ANGLES)
    low_e = pane_optics(Pane("low-e", *LOW_E, coated=True), ANGLES)
    panes = {"single": [clear], "double": [clear, clear]}.get(kind, [low_e])
    thick = [thickness] * len(panes)
    gap = AIR_GAP
    if kind == "low-e":
        panes, thick, gap = [*panes, clear], [LOW_E_THICKNESS, thickness], ARGON_GAP
    optics, behind = stack(panes), stack([pane.turned() for pane in panes[::-1]])
    if len(panes) == 2:
        u = en673_u_value(thick, [gap], emissivity_in=0.84)
        resistance = double_glazing_resistance((thick[0], thick[1]), gap)
    else:
        u, resistance = 1.0 / (R_OUTER + R_INNER + thickness), None
    between = [1.0 / u - R_OUTER - R_INNER]
    films = {"outer_film": 1.0 / R_OUTER, "inner_film": 1.0 / R_INNER}
    share, back = (_in_two(o.absorptance) for o in (optics, behind))
    g = en410_g_value(optics.tau, share, between, **films)
    layers = layer_absorptances(optics.tau, optics.rho_front, g, u, item=f"{kind} glazing")
    mean = {
        k: float(hemispherical_mean(v, ANGLES))
        for k, v in (
            ("tau", optics.tau),
            ("outer", layers.outer),
            ("inner", layers.inner),
            ("back", optics.rho_back),
            ("back outer", back[:, 1]),
            ("back inner", back[:, 0]),
        )
    }
    fenestration = Fenestration(f"{kind} glazing", u, resistance=resistance)
    return AshraeGlazing(
        fenestration,
        optics.tau,
        layers.outer,
        layers.inner,
        (mean["tau"], mean["outer"], mean["inner"]),
        (mean["back"], mean["back outer"], mean["back inner"]),
    )


def _in_two(absorptance: FloatArray) -> FloatArray:
    """Absorptances [91, 2] of two layers: one pane is halved."""
    return absorptance if absorptance.shape[1] == 2 else np.repeat(absorptance / 2, 2, axis=1)


@dataclass(frozen=True, slots=True)
class Transmitted:
    """Light through the windows of one facade at the steps T."""

    beam: FloatArray  # [T] [W/m2] of window
    diffuse: FloatArray  # [T]
    outer: FloatArray  # [T] absorbed [W/m2]
    inner: FloatArray  # [T]
    first: FloatArray  # [T, 6] first hits [W] in the order of `SEEN_FROM`


def transmitted(opening: Opening, sun: FacadeSun, pane: AshraeGlazing, *, depth: float | None = None):
    """What the windows of a facade let through and absorb, shaded by their devices."""
    lit = sun.beam > 0
    share = np.zeros(len(sun.beam))
    rectangles = opening.windows
    weight = np.array([np.ptp(x) * np.ptp(y) for x, y in rectangles])
    weight = weight / weight.sum()
    sky_share = ground_share = 0.0
    for rectangle, w in zip(rectangles, weight, strict=True):
        share[lit] += w * lit_share(rectangle, opening.devices, sun.local[lit])
        above, below = diffuse_lit_share(rectangle, opening.devices)
        sky_share, ground_share = sky_share + w * above, ground_share + w * below
    theta = np.arccos(np.clip(sun.local[:, 2], 0.0, 1.0))
    beam = sun.beam * share
    around = np.where(lit, share, sky_share)
    # circumsolar light is shaded as the sun is, and passes the glass as diffuse light (EnergyPlus)
    sky = (sun.sky - sun.circumsolar) * sky_share + sun.circumsolar * around
    diffuse = np.maximum(sky, 0.0) + sun.ground * ground_share
    at = [np.interp(theta, ANGLES, v) for v in (pane.tau, pane.outer, pane.inner)]
    through, spread = beam * at[0], diffuse * pane.diffuse[0]
    first = np.zeros((len(beam), 6))
    for room, w in zip(opening_rooms(opening, depth), weight, strict=True):
        area = opening.area * w
        first += area * spread[:, None] * diffuse_hits(room)
        first[lit] += area * through[lit, None] * BeamTable(room)(sun.local[lit])
    return Transmitted(
        through, spread, beam * at[1] + diffuse * pane.diffuse[1], beam * at[2] + diffuse * pane.diffuse[2], first
    )


def zone_solar(
    zone: Zone,
    openings: tuple[Opening, ...],
    steps: SunSteps,
    pane: AshraeGlazing,
    *,
    depth: float | None = None,
    irradiance: dict[str, FacadeSun] | None = None,
) -> tuple[Solar, tuple[Transmitted, ...]]:
    """The sun's work in a box zone, and what each facade's windows let through."""
    names = [s.name for s in zone.surfaces]
    suns = irradiance or box_irradiance(steps)
    light = tuple(transmitted(o, suns[o.facade], pane, depth=depth) for o in openings)
    hits = np.zeros((len(steps.direct_normal), len(names) + len(openings)))
    for opening, through in zip(openings, light, strict=True):
        for column, name in enumerate(SEEN_FROM[opening.facade]):
            hits[:, names.index(name)] += through.first[:, column]
    area = np.array([s.area for s in zone.surfaces] + [o.area for o in openings])
    rho = np.array([1 - s.absorptance_in for s in zone.surfaces] + [pane.back[0]] * len(openings))
    kept = spread_evenly(hits, rho, area)
    at_glass = kept[:, len(names) :] / np.array([o.area for o in openings]) / (1 - pane.back[0])
    facade = np.stack([suns[n].total if n in suns else np.zeros(len(hits)) for n in names], axis=1)
    return Solar(
        absorbed_outer=np.stack([t.outer for t in light], axis=1) + at_glass * pane.back[1],
        absorbed_inner=np.stack([t.inner for t in light], axis=1) + at_glass * pane.back[2],
        inside=kept[:, : len(names)],
        facade=facade,
    ), light


def box_irradiance(steps: SunSteps) -> dict[str, FacadeSun]:
    """Irradiance of the four facades and the roof."""
    return {name: facade_sun(steps, np.array(normal)) for name, normal in NORMALS.items() if name != "floor"}


def double_glazing_resistance(
    panes: tuple[float, float], gap: Gap, *, conductivity: float = GLASS_CONDUCTIVITY
) -> LayerResistance:
    """R(T_m, dT) between the faces of a double glazing, fitted to EN 673's gap over temperatures.

    Args: panes: thicknesses [m], outside and inside.
    """
    mean, difference = (a.ravel() for a in np.meshgrid(np.linspace(-15.0, 50.0, 14), np.linspace(1.0, 45.0, 12)))
    solid = sum(panes) / conductivity
    resistance = [
        solid + 1.0 / gap.conductance(d, mean_temperature=m + 273.15) for m, d in zip(mean, difference, strict=True)
    ]
    return fit_conductance_surface(mean, difference, np.array(resistance))
