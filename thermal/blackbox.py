"""Kuhn's Blackbox: a fenestration system as two virtual layers, from measurable data.

    T_e --R_e-- [outer layer, alpha_o] --R-- [inner layer, alpha_i] --R_i-- T_i

With g, U, R_e and R_i of one measuring condition (q_i = g - tau, alpha = 1 - tau - rho):

    R = 1/U - R_e - R_i      alpha_i = (q_i/U - alpha R_e)/R      alpha_o = alpha - alpha_i

In the room balance the films are those of the hour and R may depend on temperature; the layer
absorptances stay.  At the measuring condition U and g come back exactly.

Source: Kuhn et al. 2011, Energy and Buildings 43:19-27, whose primes mark the measuring condition.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace

import numpy as np
from numba.extending import register_jitable
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range
from thermal.records import INLINED

R_OUTER = 0.04  # [m2 K/W] EN 673:2011 / ISO 6946 outer film
R_INNER = 0.13  # [m2 K/W] EN 673:2011 / ISO 6946 inner film
MEASUREMENT_SLACK = 0.15  # absorptance that measuring errors and film assumptions may explain

SLOPE = 0.0065  # of U with the mean layer temperature [1/K] (Fener)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class LayerResistance:
    """Resistance between the two layers: "constant", "linear U", "surface" or "table", and coefficients.

    constant   R = c0                                                          [m2 K/W]
    linear U   R = 1/(c0 + c1 (T_m - 10)) - c2         c2 = R_e + R_i of the measurement
    surface    1/R = c0 + c1 x + c2 d + c3 d^2 + c4 x d + c5 x^2
    table      1/R linear between the points of a grid: first value, step and number of T_m, the same
               of d, then 1/R, T_m by T_m
    with T_m the mean of the two layers [degC], x = T_m - 10, d = |T_inner - T_outer|.
    """

    kind: str
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        counts = {"constant": 1, "linear U": 3, "surface": 6}
        known = self.kind in (*counts, "table")
        require(known, "layer resistance", f"{self.kind!r} is not of {[*counts, 'table']}")
        got = len(self.coefficients)
        expected = counts.get(self.kind, got)
        require(got == expected, "layer resistance", f"expected {expected} coefficients, got {got}")
        nominal = float(self.at(10.0, 5.0))
        require(nominal > 0, "layer resistance", f"R_s must be positive, got {nominal:.3g} m2 K/W")

    def at(self, mean_c: ArrayLike, difference: ArrayLike) -> NDArray[np.float64]:
        """R [m2 K/W] at the mean layer temperature [degC] and the difference between them [K]."""
        x, d = np.asarray(mean_c, dtype=float) - 10.0, np.abs(np.asarray(difference, dtype=float))
        c = self.coefficients
        if self.kind == "table":
            values = np.array(c)
            one_by_one = np.vectorize(lambda mean, apart: table_conductance(values, mean, apart), otypes=[float])
            return 1.0 / one_by_one(x + 10.0, d)
        if self.kind == "constant":
            return np.full(np.broadcast(x, d).shape, c[0])
        if self.kind == "linear U":
            return 1.0 / (c[0] + c[1] * x) - c[2] + 0.0 * d
        return 1.0 / (c[0] + c[1] * x + c[2] * d + c[3] * d**2 + c[4] * x * d + c[5] * x**2)


TABLE_HEAD = 6  # numbers of a "table" before its conductances


@register_jitable(**INLINED)
def table_conductance(c: NDArray[np.float64], mean_c: float, difference: float) -> float:
    """1/R [W/(m2 K)] of a "table"; beyond its grid that of the edge."""
    rows, columns = int(c[2]), int(c[5])
    y = min(max((mean_c - c[0]) / c[1], 0.0), rows - 1.0)
    x = min(max((difference - c[3]) / c[4], 0.0), columns - 1.0)
    i, j = min(int(y), rows - 2), min(int(x), columns - 2)
    y, x = y - i, x - j
    at = TABLE_HEAD + i * columns + j
    low = (1.0 - x) * c[at] + x * c[at + 1]
    high = (1.0 - x) * c[at + columns] + x * c[at + columns + 1]
    return (1.0 - y) * low + y * high


@dataclass(frozen=True, slots=True)
class ShadeNode:
    """A shade outside or on the room side of panes, and the air between; see `shaded_window`."""

    exterior: bool
    width: float  # [m] of the gap beside it
    height: float  # [m]
    tilt: float  # [rad] from horizontal
    impedance: float  # of its openings (ISO 15099:2003, 7.4.2)
    exchange: float  # longwave between it and the pane beside it, of that between black faces
    pane_weight: float  # of that pane in what the longwave of the shade's side sees
    emissivity: float  # of both to that side
    panes: LayerResistance  # between outermost and innermost face of the panes
    sun: tuple[float, ...]  # [N - 1] of the sun that each pane absorbs, the share of the innermost
    # heat of the three nodes that goes indoors: shade and panes, or panes and shade, outside first
    inward: tuple[float, float, float]
    # the whole window as two layers with the shade's film of the dark state
    two_layers: LayerResistance
    film: float  # [m2 K/W]


@dataclass(frozen=True, slots=True)
class Fenestration:
    """A fenestration system between two films, as the room balance needs it.

    The extra conductances and the report weight are 0 and 1 in plain Kuhn.  They close the model
    for shades that also lose heat to the air behind them; see `with_realised_films`.
    """

    name: str
    u_value: float  # [W/(m2 K)] at the measuring condition
    r_outer: float = R_OUTER  # [m2 K/W] films of the measurement
    r_inner: float = R_INNER
    resistance: LayerResistance | None = None  # None: constant, from U
    extra_outer: float = 0.0  # [W/(m2 K)] outer layer to outdoor air, besides the film
    extra_inner: float = 0.0  # [W/(m2 K)] inner layer to room air, besides the film
    inner_report: float = 1.0  # share of (T_inner - T_room) that the visible face shows
    emissivity_in: float = 0.84
    emissivity_out: float = 0.84
    shade: ShadeNode | None = None  # a node of its own beside the panes, which are two more
    layer_resistance: LayerResistance = field(init=False)

    def __post_init__(self) -> None:
        item = f"fenestration {self.name}"
        require_range(self.u_value, 0.1, 7.0, f"{item}: U", "W/(m2 K)")
        require_range(self.r_outer, 1e-3, 1.0, f"{item}: R_e", "m2 K/W")
        require_range(self.r_inner, 1e-3, 1.0, f"{item}: R_i", "m2 K/W")
        r = 1.0 / self.u_value - self.r_outer - self.r_inner
        if self.resistance is None:
            require(r > 0, item, f"U = {self.u_value:g} leaves no resistance between the layers")
            object.__setattr__(self, "layer_resistance", LayerResistance("constant", (r,)))
        else:
            object.__setattr__(self, "layer_resistance", self.resistance)
        for name in ("extra_outer", "extra_inner"):
            require_range(getattr(self, name), 0.0, 200.0, f"{item}: {name}", "W/(m2 K)")
        require_range(self.emissivity_in, 0.0, 1.0, f"{item}: inside emissivity")
        require_range(self.emissivity_out, 0.0, 1.0, f"{item}: outside emissivity")
        require_range(self.inner_report, 0.0, 1.5, f"{item}: inner report weight")

    def inward_shares(self) -> tuple[float, float, float]:
        """Shares of the heat absorbed in the outer, middle and inner layer that go indoors.

        With the films of the measurement; without a shade of its own there is no middle layer.
        """
        if self.shade is not None:
            return self.shade.inward
        return self.u_value * self.r_outer, 0.0, 1.0 - self.u_value * self.r_inner

    def in_series(self) -> Fenestration:
        """As two layers: a shade with the film that it has in the dark."""
        if self.shade is None:
            return self
        plain = replace(self, resistance=self.shade.two_layers, shade=None)
        film = "r_outer_realised" if self.shade.exterior else "r_inner_realised"
        return with_realised_films(plain, **{film: self.shade.film})


@dataclass(frozen=True, slots=True)
class LayerAbsorptances:
    """Solar absorptances of the two layers, per direction; of the three with a `ShadeNode`."""

    outer: NDArray[np.float64]  # [...]
    inner: NDArray[np.float64]  # [...]
    clipped: float  # largest absorptance that had to be moved to stay between 0 and alpha
    middle: NDArray[np.float64] | float = 0.0  # [...] of the pane beside the shade

    def two_layers(self, system: Fenestration) -> LayerAbsorptances:
        """Those of Kuhn's two layers with U and films of a system: as much goes indoors."""
        if system.shade is None:
            return self
        nodes = self.outer, self.middle, self.inner
        q_i = sum(share * node for share, node in zip(system.shade.inward, nodes, strict=True))
        alpha = self.outer + self.middle + self.inner
        low, high = system.u_value * system.r_outer, 1.0 - system.u_value * system.r_inner
        inner = np.clip((q_i - low * alpha) / (high - low), 0.0, alpha)
        return LayerAbsorptances(alpha - inner, inner, self.clipped)


def layer_absorptances(
    transmittance: ArrayLike,
    reflectance: ArrayLike,
    g_value: ArrayLike,
    u_value: float,
    *,
    r_outer: float = R_OUTER,
    r_inner: float = R_INNER,
    item: str = "fenestration",
) -> LayerAbsorptances:
    """Absorptances of the outer and inner layer, from data of one measuring condition.

    Values a little out of range come from measuring errors, or from a film R_i that an interior
    shade does not have; they are clipped so that the total stays, and the log says by how much.

    Args:
        transmittance, reflectance, g_value: [...] solar, per direction (or diffuse).
        u_value: [W/(m2 K)]; r_outer, r_inner: [m2 K/W] films at which g and U were measured.

    Raises: `ThermalInputError` for g below the transmittance, R not positive, values out of range.

    Source: Kuhn et al. 2011; the dissertation's eq. (21) ff. with its misprints put right.
    """
    tau, rho, g = (np.asarray(v, dtype=float) for v in (transmittance, reflectance, g_value))
    require_range(u_value, 0.1, 7.0, f"{item}: U", "W/(m2 K)")
    r = 1.0 / u_value - r_outer - r_inner
    require(r > 0, f"{item}: R_s", f"must be positive, got {r:.3g} m2 K/W at U = {u_value:g}")
    for values, label in ((tau, "transmittance"), (rho, "reflectance"), (g, "g")):
        require(bool(np.all((values >= 0) & (values <= 1))), f"{item}: {label}", "outside 0 to 1")
    excess = float(np.max(tau + rho, initial=0.0)) - 1.0
    require(excess <= 0.02, f"{item}: absorptance", f"tau + rho exceeds 1 by {excess:.3f}")
    worst = np.unravel_index(np.argmax(tau - g), np.shape(tau - g))
    least, stated = (float(np.broadcast_to(v, np.shape(tau - g))[worst]) for v in (tau, g))
    message = f"{stated:g} is below the solar transmittance {least:.3f}, the least that g can be"
    require(least - stated <= 0.01, f"{item}: g", message)
    alpha, q_i = np.maximum(1.0 - tau - rho, 0.0), np.maximum(g - tau, 0.0)
    inner = (q_i / u_value - alpha * r_outer) / r
    kept = np.clip(inner, 0.0, alpha)
    clipped = float(np.max(np.abs(inner - kept), initial=0.0))
    message = f"a layer's absorptance is out of range by {clipped:.3f}"
    require(clipped <= MEASUREMENT_SLACK, f"{item}: g and U", message)
    if clipped > 1e-6:
        _log.warning("%s: %s; clipped", item, message)
    return LayerAbsorptances(outer=alpha - kept, inner=kept, clipped=clipped)


def node_absorptances(by_layer: ArrayLike, shade: ShadeNode, more: ArrayLike = 0.0) -> LayerAbsorptances:
    """Absorptances of a shade, the outermost and the innermost pane, from those of all layers.

    A pane between both divides its heat by the resistances to either side.

    Args:
        by_layer: [..., N] solar, outermost first.
        more: [...] what the stated g has over that of these layers; so much more goes indoors
            where absorbed sun moves from the outer node to the inner (less: back), then from the
            middle one.
    """
    layers = np.asarray(by_layer, dtype=float)
    panes = layers[..., 1:] if shade.exterior else layers[..., :-1]
    share, left = np.array(shade.sun), np.broadcast_to(more, layers.shape[:-1]).copy()
    outside, inside = panes @ (1.0 - share), panes @ share
    if shade.exterior:
        outer, middle, inner = layers[..., 0].copy(), outside, inside
    else:
        outer, middle, inner = outside, inside, layers[..., -1].copy()
    low, between, high = shade.inward
    up = np.clip(left / (high - low), 0.0, outer)
    outer, inner, left = outer - up, inner + up, left - up * (high - low)
    up = np.clip(left / (high - between), 0.0, middle)
    middle, inner, left = middle - up, inner + up, left - up * (high - between)
    down = np.clip(-left / (high - low), 0.0, inner)
    outer, inner, left = outer + down, inner - down, left + down * (high - low)
    down = np.clip(-left / (between - low), 0.0, middle)
    outer, middle, left = outer + down, middle - down, left + down * (between - low)
    clipped = float(np.max(np.abs(left), initial=0.0))
    return LayerAbsorptances(outer, inner, clipped, middle)


def linear_u(u_value: float, *, slope: float = SLOPE, reference_c: float = 10.0) -> LayerResistance:
    """R from a U-value that grows linearly with the mean layer temperature (Fener: 0.65 %/K)."""
    per_kelvin = u_value * slope
    at_ten = u_value + per_kelvin * (10.0 - reference_c)
    return LayerResistance("linear U", (at_ten, per_kelvin, R_OUTER + R_INNER))


def fit_conductance_surface(mean_c: ArrayLike, difference: ArrayLike, resistance: ArrayLike) -> LayerResistance:
    """R(T_m, dT) fitted by least squares to resistances [m2 K/W] of an ISO 15099 program."""
    x, d = np.asarray(mean_c, float) - 10.0, np.abs(np.asarray(difference, float))
    basis = np.stack([np.ones_like(x), x, d, d**2, x * d, x**2], axis=1)
    conductance = 1.0 / np.asarray(resistance, dtype=float)
    coefficients, *_ = np.linalg.lstsq(basis, conductance, rcond=None)
    return LayerResistance("surface", tuple(float(c) for c in coefficients))


def conductance_table(mean_c: ArrayLike, difference: ArrayLike, conductance: ArrayLike) -> LayerResistance:
    """R(T_m, dT) of a grid, evenly spaced in both.

    Args: conductance: [M, D] at the means [M] [degC] and the differences [D] [K].
    """
    head = []
    for values in (np.asarray(mean_c, float), np.asarray(difference, float)):
        head += [values[0], values[1] - values[0], len(values)]
    return LayerResistance("table", tuple(float(c) for c in (*head, *np.ravel(conductance))))


def with_realised_films(
    plain: Fenestration, *, r_inner_realised: float | None = None, r_outer_realised: float | None = None
) -> Fenestration:
    """The better closure: layer-to-environment resistances that the system really has.

    A shade next to the room (or outdoors) also loses heat to the air behind it.  What its film
    does not carry goes through an extra conductance 1/R_realised - 1/R_nominal to the air.
    The absorptances must then be computed with the realised resistances too.

    Args: realised resistances [m2 K/W] from one ISO 15099 state or a thermographic test.
    """
    r_i = plain.r_inner if r_inner_realised is None else r_inner_realised
    r_o = plain.r_outer if r_outer_realised is None else r_outer_realised
    return Fenestration(
        name=plain.name,
        u_value=plain.u_value,
        r_outer=r_o,
        r_inner=r_i,
        resistance=plain.resistance,
        extra_outer=plain.extra_outer + max(1.0 / r_o - 1.0 / plain.r_outer, 0.0),
        extra_inner=plain.extra_inner + max(1.0 / r_i - 1.0 / plain.r_inner, 0.0),
        inner_report=1.0,
        emissivity_in=plain.emissivity_in,
        emissivity_out=plain.emissivity_out,
    )


def absorbed_at_u(
    system: Fenestration, moved: Fenestration, outer: NDArray[np.float64], inner: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sun absorbed in the two layers of a system of another U: as much in all, and as much of it indoors.

    g stays, as where a system is modelled from g and another U.  With a shade of its own: as it was.
    """
    if system.shade is not None or moved.shade is not None:
        return outer, inner
    (of_outer, _, of_inner), (to_outer, _, to_inner) = system.inward_shares(), moved.inward_shares()
    whole = outer + inner
    inwards = of_outer * outer + of_inner * inner
    changed = np.clip((inwards - to_outer * whole) / (to_inner - to_outer), 0.0, whole)
    return whole - changed, changed


MEASURED_DIFFERENCE = 15.0  # of the air on both sides, EN 673:2011 [K]


def with_u_value(system: Fenestration, u_value: float) -> Fenestration:
    """A system of another U-value: the resistance of its panes is changed at all temperatures.

    The change is that of 1 / U at the measuring condition; films, gaps beside a shade and closures stay.
    """
    change = 1.0 / u_value - 1.0 / system.u_value
    between = MEASURED_DIFFERENCE * (1.0 - system.u_value * (system.r_outer + system.r_inner))
    shade, resistance = system.shade, system.resistance
    if resistance is not None:
        resistance = _with_added(resistance, change, between)
    if shade is not None:
        panes, both = (_with_added(one, change, between) for one in (shade.panes, shade.two_layers))
        shade = replace(shade, panes=panes, two_layers=both)
    return replace(system, u_value=u_value, resistance=resistance, shade=shade)


def _with_added(resistance: LayerResistance, change: float, difference: float) -> LayerResistance:
    """A resistance with so much more [m2 K/W] at 10 degC and a difference.

    A table has it everywhere, as `iso15099_data` of a stated U; others in proportion.
    """
    first, *others = resistance.coefficients
    if resistance.kind == "linear U":
        moved = 1.0 / (1.0 / first + change)
        return LayerResistance(resistance.kind, (moved, others[0] * moved / first, others[1]))
    if resistance.kind == "table":
        grid, conductances = resistance.coefficients[:TABLE_HEAD], resistance.coefficients[TABLE_HEAD:]
        return LayerResistance(resistance.kind, (*grid, *(1.0 / (1.0 / c + change) for c in conductances)))
    nominal = float(resistance.at(10.0, difference))
    factor = (nominal + change) / nominal
    power = 1 if resistance.kind == "constant" else -1  # the others are conductances
    return LayerResistance(resistance.kind, tuple(c * factor**power for c in resistance.coefficients))
