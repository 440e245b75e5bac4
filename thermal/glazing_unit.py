"""A glazing unit layer by layer: panes, shades, blinds and the gaps between them.

Slats, threads and holes of a shade become one layer with an emissivity on each side, a longwave
transmittance and the openings that air passes through.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thermal.errors import require, require_range
from thermal.gases import gas_fractions
from thermal.layer_balance import CLOSED, FORCED, INDOORS, LOOP, OUTDOORS, SIGMA, UnitArrays

AIR = (("air", 1.0),)
LEAST_OPENING = 1e-6  # [m2] for one that is shut


@dataclass(frozen=True, slots=True)
class Openings:
    """Openings of a shade to the air flow: at its edges [m], and through the shade.

    ISO 15099's areas are these: the width of each edge times its length; `front` is the effective
    open share of the shade's area (see `thermal.glazing_unit`).
    """

    top: float = 0.0  # [m] wide, along the upper edge
    bottom: float = 0.0
    left: float = 0.0
    right: float = 0.0
    front: float = 0.0  # share of the area

    def __post_init__(self) -> None:
        for name in ("top", "bottom", "left", "right"):
            require_range(getattr(self, name), 0.0, 1.0, f"opening {name}", "m")
        require_range(self.front, 0.0, 1.0, "opening front")

    def impedance(self, gap: float, width: float, height: float) -> float:
        """Z_in + Z_out of a gap [m] at a shade of that width and height [m].

        Z = (A_gap/(0.6 A_eq) - 1)^2, A_eq = A_bottom + A_top (A_left + A_right + A_front) /
        (2 (A_bottom + A_top)), and the other way round.  Source: ISO 15099:2003, 7.4.2.
        """
        top, bottom = (max(a * width, LEAST_OPENING) for a in (self.top, self.bottom))
        others = (self.left + self.right + self.front * width) * height
        through = 0.5 * others / (top + bottom)
        ends = (bottom + top * through, top + bottom * through)
        return sum((gap * width / (0.6 * area) - 1.0) ** 2 for area in ends)


@dataclass(frozen=True, slots=True)
class GlazingLayer:
    """One layer: a pane, or a shade with its openings; front is outdoors."""

    thickness: float  # [m]
    conductivity: float = 1.0  # [W/(m K)]
    emissivity: tuple[float, float] = (0.84, 0.84)  # front, back
    infrared_transmittance: float = 0.0
    openings: Openings | None = None  # None: a pane, which closes the gap
    # transmittance, front and back reflectance of a pane for the sun at normal incidence
    solar: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        require_range(self.thickness, 1e-6, 0.5, "layer thickness", "m")
        require_range(self.conductivity, 1e-4, 500.0, "layer conductivity", "W/(m K)")
        require_range(self.infrared_transmittance, 0.0, 1.0, "layer infrared transmittance")
        for side, value in zip(("front", "back"), self.emissivity, strict=True):
            require_range(value, 1e-4, 1.0, f"layer emissivity, {side}")
            total = value + self.infrared_transmittance
            require(total <= 1.0 + 1e-9, f"layer, {side}", f"absorbs and passes {total:g} of 1")
        if self.solar is not None:
            tau, front, back = self.solar
            least, most = min(self.solar), tau + max(front, back)
            fits = least >= 0 and most <= 1.0 + 1e-9
            require(fits, "layer, solar", f"expected shares of 1, got {self.solar}")


@dataclass(frozen=True, slots=True)
class GasGap:
    """Gas space on the room side of a layer: width, gas, forced air flow."""

    width: float  # [m]
    gas: tuple[tuple[str, float], ...] = AIR  # (name, volume fraction)
    blown: tuple[float, float] | None = None  # speed [m/s] and inlet temperature [degC]

    def __post_init__(self) -> None:
        require_range(self.width, 5e-4, 1.0, "gap width", "m")
        gas_fractions(self.gas)


@dataclass(frozen=True, slots=True)
class Environment:
    """The air and the radiation on one side of a glazing."""

    air_c: float
    convection: float | None  # [W/(m2 K)]; None: still room air, after ISO 15099, 8.3.2.2
    radiant_c: float | None = None  # None: as the air
    emissivity: float = 1.0

    @property
    def radiosity(self) -> float:
        """Longwave that it sends to the glazing [W/m2]."""
        celsius = self.air_c if self.radiant_c is None else self.radiant_c
        return self.emissivity * SIGMA * (celsius + 273.15) ** 4


@dataclass(frozen=True, slots=True)
class GlazingUnit:
    """Layers from outside to inside and the gaps between them."""

    layers: tuple[GlazingLayer, ...]
    gaps: tuple[GasGap, ...] = ()
    height: float = 1.5  # [m]
    width: float = 1.0
    tilt_deg: float = 90.0  # from horizontal

    def __post_init__(self) -> None:
        require(len(self.layers) > 0, "glazing", "has no layers")
        fits = len(self.gaps) == len(self.layers) - 1
        require(fits, "glazing", f"{len(self.layers)} layers, {len(self.gaps)} gaps between them")
        require_range(self.height, 0.05, 50.0, "glazing height", "m")
        require_range(self.width, 0.05, 50.0, "glazing width", "m")
        require_range(self.tilt_deg, 0.0, 180.0, "glazing tilt", "degrees")
        shades = [layer.openings is not None for layer in self.layers]
        require(not all(shades), "glazing", "has no pane: a shade alone closes nothing")
        beside = any(a and b for a, b in pairwise(shades))
        require(not beside, "glazing", "two adjacent shades: their gap is not modelled")

    @property
    def shade_place(self) -> str:
        """Position of the shade: "none", "external", "internal" or "integrated"."""
        shades = [layer.openings is not None for layer in self.layers]
        if shades[-1] and len(shades) > 1:
            return "internal"
        if shades[0] and len(shades) > 1:
            return "external"
        return "integrated" if any(shades) else "none"

    def arrays(self, outdoor: Environment, indoor: Environment) -> UnitArrays:
        """The unit and its surroundings as the kernel takes them."""
        layers, gaps = self.layers, self.gaps
        air, impedance = self._air()
        films = [(e.air_c + 273.15, e.convection) for e in (outdoor, indoor)]
        require(outdoor.convection is not None, "outdoor film", "must be given [W/(m2 K)]")
        place = (self.height, np.radians(self.tilt_deg), outdoor.radiosity, indoor.radiosity)
        blown = [(0.0, 273.15) if g.blown is None else g.blown for g in gaps]
        return UnitArrays(
            np.array([layer.conductivity / layer.thickness for layer in layers]),
            np.array([layer.emissivity for layer in layers]),
            np.array([layer.infrared_transmittance for layer in layers]),
            np.array([gap.width for gap in gaps]),
            np.array([*(gas_fractions(gap.gas) for gap in gaps), gas_fractions(AIR)]),
            air,
            impedance,
            np.array([(v, t + 273.15) for v, t in blown]).reshape(-1, 2),
            np.array(place),
            np.array([(t, -1.0 if h is None else h) for t, h in films]),
        )

    def _air(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the air of each gap comes from [G], and the impedance of its openings [G]."""
        air = np.full(len(self.gaps), CLOSED, dtype=np.int64)
        impedance = np.zeros(len(self.gaps))
        last = len(self.layers) - 1
        for i, layer in enumerate(self.layers):
            if layer.openings is None:
                continue
            for g in (i - 1, i):
                if 0 <= g < last:
                    z = layer.openings.impedance(self.gaps[g].width, self.width, self.height)
                    impedance[g] = z
            if i == 0 and last > 0:
                air[0] = OUTDOORS
            elif i == last and last > 0:
                air[-1] = INDOORS
            else:
                air[i - 1] = LOOP
        for g, gap in enumerate(self.gaps):
            if gap.blown is not None:
                require(air[g] != LOOP, "gap", "air cannot be blown through one beside a shade")
                air[g] = FORCED
        return air, impedance


SEGMENTS = 5  # of a slat (ISO 15099:2003, 7.3)
ANGLES = 90  # of the integral over a hemisphere
# Effective front opening c1 (A cos^c2)^c3 and thickness of a blind; c1 A^c2 of other shades
BLIND = (0.016, -0.63, 0.53, 0.043)
SHEET = (0.078, 1.2)

Edges = tuple[float, float, float, float]  # [m] open at top, bottom, left, right


def venetian_layer(
    slat_width: float,
    slat_spacing: float,
    slat_tilt_deg: float,
    *,
    slat_thickness: float = 0.0005,
    conductivity: float = 160.0,
    emissivity: tuple[float, float] = (0.9, 0.9),
    edges: Edges = (0.0, 0.0, 0.0, 0.0),
) -> GlazingLayer:
    """A blind of flat horizontal slats as a layer.

    Args: emissivity: of the slats' upper and lower sides; slat_tilt_deg: 0 is horizontal, positive
        lowers the outer edge; edges: widths of the openings around it [m].

    Source: ISO 15099:2003, 7.3; open area: Hart, Goudey, Curcija 2018, "Impact of room-side
        shading on the thermal performance of glazing" (the fits of WINDOW).
    """
    require_range(slat_width, 1e-3, 2.0, "slat width", "m")
    require_range(slat_spacing, 1e-3, 2.0, "slat spacing", "m")
    require_range(slat_tilt_deg, -90.0, 90.0, "slat tilt", "degrees")
    tilt = np.radians(slat_tilt_deg)
    passed, sides = _slat_longwave(slat_width, slat_spacing, tilt, emissivity)
    cosine, sine = float(np.cos(tilt)), float(abs(np.sin(tilt)))
    across = slat_width * cosine + slat_thickness * sine
    blocked = slat_thickness * slat_width / max(across, 1e-9)
    open_share = max(1.0 - blocked / (slat_spacing + slat_thickness), 0.0)
    c1, c2, c3, c4 = BLIND
    front = c1 * (open_share * max(cosine, 1e-3) ** c2) ** c3
    return GlazingLayer(max(c4 * across, 1e-5), conductivity, sides, passed, Openings(*edges, min(front, 1.0)))


def sheet_layer(
    openness: float,
    *,
    thickness: float = 0.0005,
    conductivity: float = 0.15,
    emissivity: tuple[float, float] = (0.9, 0.9),
    infrared_transmittance: float | None = None,
    edges: Edges = (0.0, 0.0, 0.0, 0.0),
) -> GlazingLayer:
    """A woven shade, screen or film with a share of open area as a layer.

    Args: openness: share of the sheet that is open, for air; emissivity: of the material;
        infrared_transmittance: None takes the open share.
    """
    require_range(openness, 0.0, 1.0, "openness")
    passed = openness if infrared_transmittance is None else infrared_transmittance
    sides = tuple(max(e * (1.0 - passed), 1e-4) for e in emissivity)
    front = SHEET[0] * openness ** SHEET[1]
    openings = Openings(*edges, front)
    return GlazingLayer(thickness, conductivity, (sides[0], sides[1]), passed, openings)


def perforated_layer(hole: float, spacing: float, *, thickness: float = 0.0006, **sheet: object) -> GlazingLayer:
    """A sheet with round holes of a diameter [m] on a square grid [m] as a layer.

    Longwave passes the holes by the view factor of their two ends.
    """
    require(0 < hole < spacing, "perforated shade", "expected a hole smaller than its spacing")
    openness = np.pi * hole**2 / (4.0 * spacing**2)
    x = 2.0 + (2.0 * thickness / hole) ** 2
    passed = float(openness * 0.5 * (x - np.sqrt(x * x - 4.0)))
    return sheet_layer(
        float(openness),
        thickness=thickness,
        infrared_transmittance=passed,
        **sheet,  # type: ignore[arg-type]
    )


def woven_layer(diameter: float, spacing: float, **sheet: object) -> GlazingLayer:
    """A fabric of crossed threads of a diameter and spacing [m] as a layer.

    Longwave passes by the mean over the hemisphere of (1 - d/(s cos a)) (1 - d/(s cos b)), a and b
    the profile angles across the threads.
    """
    require(0 < diameter < spacing, "woven shade", "expected threads thinner than their spacing")
    ratio = diameter / spacing
    theta = (np.arange(ANGLES) + 0.5) * np.pi / 2 / ANGLES
    phi = (np.arange(ANGLES) + 0.5) * np.pi / 2 / ANGLES
    t, p = np.meshgrid(np.tan(theta), phi, indexing="ij")
    across = [np.sqrt(1.0 + (t * f(p)) ** 2) for f in (np.sin, np.cos)]  # 1/cos of profile angles
    open_ = np.maximum(1.0 - ratio * across[0], 0.0) * np.maximum(1.0 - ratio * across[1], 0.0)
    weight = np.sin(2.0 * theta)
    passed = float(weight @ open_.mean(axis=1) / weight.sum())
    layer = sheet_layer((1.0 - ratio) ** 2, infrared_transmittance=passed, **sheet)  # type: ignore[arg-type]
    return replace(layer, thickness=2.0 * diameter) if "thickness" not in sheet else layer


def _slat_longwave(
    width: float, spacing: float, tilt: float, emissivity: tuple[float, float]
) -> tuple[float, tuple[float, float]]:
    """Longwave transmittance of a blind, and its emissivities outdoors and towards the room.

    Diffuse exchange in the space between two slats: the lower slat's upper side and the upper
    slat's lower side in segments, the openings to both sides.
    """
    down, up = np.array([np.cos(tilt), np.sin(tilt)]), np.array([0.0, spacing])
    along = np.linspace(0.0, width, SEGMENTS + 1)[:, None] * down
    # from outdoors (x = 0) to the room; positive tilt: the outer edge is the lower one
    strips = [(along[i], along[i + 1]) for i in range(SEGMENTS)]
    strips += [(along[i + 1] + up, along[i] + up) for i in range(SEGMENTS)]
    strips += [(up, along[0]), (along[-1], along[-1] + up)]
    factors = _between(strips)
    n = 2 * SEGMENTS
    rho = np.repeat([1.0 - emissivity[0], 1.0 - emissivity[1]], SEGMENTS)
    solve = np.linalg.inv(np.eye(n) - rho[:, None] * factors[:n, :n])
    results = []
    for source, other in ((n, n + 1), (n + 1, n)):
        leaving = solve @ (rho * factors[:n, source])
        lengths = np.array([np.linalg.norm(b - a) for a, b in strips])
        arrives = [
            factors[face, :n] @ leaving + (factors[face, source] if face != source else 0.0) for face in (other, source)
        ]
        scale = lengths[[other, source]] / lengths[source]
        results.append([float(a * s) for a, s in zip(arrives, scale, strict=True)])
    passed = 0.5 * (results[0][0] + results[1][0])
    emissivities = [max(1.0 - passed - reflected, 1e-4) for _, reflected in results]
    return passed, (emissivities[0], emissivities[1])


Strip = tuple[NDArray[np.float64], NDArray[np.float64]]


def _between(strips: list[Strip]) -> NDArray[np.float64]:
    """View factors [N, N] of infinitely long strips that face each other, by crossed strings."""
    n = len(strips)
    factors = np.zeros((n, n))

    def far(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
        return float(np.hypot(*(a - b)))

    for i, (a, b) in enumerate(strips):
        for j, (c, d) in enumerate(strips):
            if i != j:
                seen = far(a, c) + far(b, d) - far(a, d) - far(b, c)
                factors[i, j] = max(seen, 0.0) / (2.0 * far(a, b))
    return factors
