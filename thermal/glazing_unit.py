"""A glazing unit layer by layer: panes, shades, blinds and the gaps between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from thermal.errors import require, require_range
from thermal.gases import gas_fractions
from thermal.layer_balance import CLOSED, FORCED, INDOORS, LOOP, OUTDOORS, SIGMA, UnitArrays

AIR = (("air", 1.0),)
LEAST_OPENING = 1e-6  # [m2] for one that is shut


@dataclass(frozen=True, slots=True)
class Openings:
    """Openings of a shade to the air flow: at its edges [m], and through the shade.

    ISO 15099's areas are these: the width of each edge times its length; `front` is the effective
    open share of the shade's area (see `thermal.shade_layers`).
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
