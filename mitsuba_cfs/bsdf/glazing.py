"""Clear panes and stacks of them: transmittance, reflectance, absorptance by angle of incidence.

The simple window model gives them from U and g. Source: Arasteh, Kohler, Griffith 2009, "Modeling
windows in EnergyPlus with simple performance indices", LBNL-2804E; as EnergyPlus'
WindowMaterial:SimpleGlazingSystem (Engineering Reference, "Simple Window Model"). Between U of 3.4
and 4.5 W/(m2 K) values are linear in U.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.gloss import polarised_shares

# coefficients in cos(theta) of the transmittance of clear and bronze glass relative to normal
# incidence, and of transmittance + reflectance: the shape that coated panes are given
# (Finlayson, Arasteh, Huizenga, Rubin, Reilly 1993, "WINDOW 4.0: documentation of calculation
# procedures", LBL-33943; EnergyPlus Engineering Reference, "Angular Properties for Coated Glass")
CLEAR_SHAPE = ((-0.0015, 3.355, -3.840, 1.460, 0.0288), (0.999, -0.563, 2.043, -2.532, 1.054))
BRONZE_SHAPE = ((-0.002, 2.813, -2.341, -0.05725, 0.599), (0.997, -1.868, 6.513, -7.862, 3.225))
CLEAR_ABOVE = 0.645  # normal transmittance above which a coated pane has the clear shape


@dataclass(frozen=True)
class Pane:
    """One pane in one band: its values at normal incidence; front is outdoors."""

    name: str
    transmittance: float
    reflectance_front: float
    reflectance_back: float
    coated: bool = False

    def __post_init__(self) -> None:
        values = (self.transmittance, self.reflectance_front, self.reflectance_back)
        worst = self.transmittance + max(self.reflectance_front, self.reflectance_back)
        if min(values) < 0 or worst > 1 + 1e-9:
            raise ValueError(f"pane {self.name}: expected shares of 1, got {values}")
        if not self.coated and self.reflectance_front != self.reflectance_back:
            raise ValueError(f"pane {self.name}: uncoated glass is alike on both sides")


def pane_values(pane: Pane, theta: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] at angles of incidence `theta` [rad]."""
    if not pane.coated:
        tau, rho = uncoated_values(pane.transmittance, pane.reflectance_front, theta)
        return tau, rho, rho
    return coated_values(pane.transmittance, pane.reflectance_front, pane.reflectance_back, theta)


def uncoated_values(
    transmittance: ArrayLike, reflectance: ArrayLike, theta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance [..] of a plain pane of glass at `theta` [rad].

    The means of `polarised_values`.
    """
    tau, rho = polarised_values(transmittance, reflectance, theta)
    return tau.mean(axis=0), rho.mean(axis=0)


def polarised_values(
    transmittance: ArrayLike, reflectance: ArrayLike, theta: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transmittance and reflectance [2, ..] of a plain pane of glass for either polarisation.

    Refractive index and absorption are those that give the two values at normal incidence; then
    `mitsuba_cfs.gloss.polarised_shares`.

    Source: EnergyPlus Engineering Reference, "Angular properties for uncoated glass"; Furler 1991.
    """
    tau, rho = np.asarray(transmittance, dtype=float), np.asarray(reflectance, dtype=float)
    beta = tau**2 - rho**2 + 2 * rho + 1
    surface = (beta - np.sqrt(beta**2 - 4 * (2 - rho) * rho)) / (2 * (2 - rho))  # of one face
    root = np.sqrt(np.clip(surface, 1e-9, 0.9))
    index = (1 + root) / (1 - root)
    inner = np.where(rho > 1e-6, (rho - surface) / np.maximum(surface * tau, 1e-12), tau)
    cosine = np.cos(np.asarray(theta, dtype=float))
    return polarised_shares(cosine, index, np.clip(inner, 1e-9, 1.0))


def coated_values(
    transmittance: ArrayLike,
    reflectance_front: ArrayLike,
    reflectance_back: ArrayLike,
    theta: ArrayLike,
    *,
    clear: bool | None = None,
) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] of a coated pane at `theta` [rad].

    tau = tau_n t(theta), rho = rho_n (1 - r(theta)) + r(theta), with the shape of clear or bronze
    glass for t and r; the measured values are kept at normal incidence.

    Args: clear: whether the shape is that of clear glass; by default where tau_n is above
        `CLEAR_ABOVE`.
    """
    clear = bool(np.all(np.greater(transmittance, CLEAR_ABOVE))) if clear is None else clear
    shape = CLEAR_SHAPE if clear else BRONZE_SHAPE
    angles = np.asarray(theta, dtype=float)
    cosine = np.cos(angles)
    t = np.clip(np.polynomial.polynomial.polyval(cosine, shape[0]), 0, 1)
    r = np.clip(np.polynomial.polynomial.polyval(cosine, shape[1]) - t, 0, 1)
    t, r = np.where(angles == 0.0, 1.0, t), np.where(angles == 0.0, 0.0, r)
    tau = np.asarray(transmittance) * t
    rho = [np.asarray(n) * (1 - r) + r for n in (reflectance_front, reflectance_back)]
    return tau, *(np.minimum(value, 1 - tau) for value in rho)


def roos_factor(theta: ArrayLike, *, panes: int, category: float) -> NDArray[np.float64]:
    """Factor [..] by which a glazing's transmittance (or g) falls from normal incidence to `theta`.

    f = 1 - a z^alpha - b z^beta - c z^gamma, z = theta / 90 degrees.

    Args:
        panes: 1 to 3.
        category: how strongly coated the glazing is, from 1 to 10; 4 is uncoated.

    Source: Roos, Polato, van Nijnatten, Hutchins, Olive, Anderson 2001, "Angular-dependent optical
    properties of low-e and solar control windows", Solar Energy 69 (Suppl.).
    """
    if not (1 <= panes <= 3 and 1 <= category <= 10):
        raise ValueError(f"expected 1 to 3 panes, category 1 to 10, got {panes} and {category}")
    z = np.asarray(theta, dtype=float) / (np.pi / 2)
    a, b = 8.0, 0.25 / category
    c = 1 - a - b
    alpha = 5.2 + 0.7 * category
    gamma = (5.26 + 0.06 * panes) + (0.73 + 0.04 * panes) * category
    return np.clip(1 - a * z**alpha - b * z**2 - c * z**gamma, 0, 1)


@dataclass(frozen=True)
class Glazing:
    """A whole glazing unit in one band, by its manufacturer's values at normal incidence."""

    name: str
    transmittance: float
    reflectance_front: float
    reflectance_back: float
    panes: int = 2
    category: float = 4.0  # Roos' q

    def __post_init__(self) -> None:
        values = (self.transmittance, self.reflectance_front, self.reflectance_back)
        worst = self.transmittance + max(self.reflectance_front, self.reflectance_back)
        if min(values) < 0 or worst > 1:
            raise ValueError(f"glazing {self.name}: expected shares of 1, got {values}")


def glazing_values(glazing: Glazing, theta: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Transmittance, front and back reflectance [..] of a glazing unit at `theta` [rad].

    Transmittance after Roos; the absorptance stays as at normal incidence up to 75 degrees and
    decreases to zero at 90 (Kuhn 2006, "Solar control: a general evaluation method for facades with
    venetian blinds or other solar control systems", Energy and Buildings 38).
    """
    theta = np.asarray(theta, dtype=float)
    factor = roos_factor(theta, panes=glazing.panes, category=glazing.category)
    tau = glazing.transmittance * factor
    kept = np.clip((np.pi / 2 - theta) / np.radians(15), 0, 1)
    reflectances = []
    for rho in (glazing.reflectance_front, glazing.reflectance_back):
        absorbed = (1 - glazing.transmittance - rho) * kept
        reflectances.append(1 - tau - absorbed)
    return tau, *reflectances


def specular_klems(pane: Pane | Glazing, basis: KlemsBasis, *, subdivision: int = 64) -> KlemsBsdf:
    """The Klems matrices of a pane or glazing that neither scatters nor bends: diagonal.

    Values are means over each ring, in cos(theta) d_omega.
    """
    sine2 = np.sin(basis.theta_bounds) ** 2
    step = (np.arange(subdivision) + 0.5) / subdivision
    theta = np.arcsin(np.sqrt(sine2[:-1, None] + np.diff(sine2)[:, None] * step))
    if isinstance(pane, Pane):
        values = pane_values(pane, theta)
    else:
        values = glazing_values(pane, theta)
    tau, rho_front, rho_back = (
        np.diag(value.mean(axis=1)[basis.rings] / basis.projected_solid_angles()) for value in values
    )
    return KlemsBsdf(basis, basis, tau, tau, rho_front, rho_back)


LOW_U, HIGH_U = 3.4, 4.5  # [W/(m2 K)] below: insulating glazing, above: single panes
ROUNDING = 1e-9  # that transmittance and reflectance together stay below 1
STEEP_U = 5.85  # above it the inner film in winter follows another line


def solar_transmittance(u_value: float, g_value: float) -> float:
    """Solar transmittance at normal incidence of a glazing of that U [W/(m2 K)] and g."""

    def high() -> float:
        if g_value < 0.7206:
            return 0.939998 * g_value**2 + 0.20332 * g_value
        return 1.30415 * g_value - 0.30515

    def low() -> float:
        if g_value <= 0.15:
            return 0.41040 * g_value
        return 0.085775 * g_value**2 + 0.963954 * g_value - 0.084958

    return min(_between(u_value, low, high), g_value)


def solar_reflectance(u_value: float, g_value: float, transmittance: float) -> float:
    """Solar reflectance at normal incidence: rho = 1 - tau - (g - tau)/N, not below 0.

    N is the inward share of the absorption in one layer in the middle, with summer film
    coefficients.
    """
    gain = g_value - transmittance
    inner = 1 / _between(
        u_value,
        lambda: 199.8208128 * gain**3 - 90.639733 * gain**2 + 19.737055 * gain + 6.766575,
        lambda: 29.436546 * gain**3 - 21.943415 * gain**2 + 9.945872 * gain + 7.426151,
    )
    outer = 1 / _between(u_value, lambda: 5.763355 * gain + 20.541528, lambda: 2.225824 * gain + 20.57708)
    layer = max(_layer_resistance(u_value), 0.0)
    inwards = (outer + 0.5 * layer) / (outer + layer + inner)
    return float(np.clip(1 - transmittance - gain / inwards, 0.0, 1.0 - transmittance - ROUNDING))


def visible_reflectances(transmittance: float) -> tuple[float, float]:
    """Front and back visible reflectance at normal incidence for a visible transmittance."""
    powers = transmittance ** np.arange(4)
    front = float(powers @ (0.2399, -0.4169, 0.4277, -0.0622))
    back = float(powers @ (0.4547, -1.2299, 1.6531, -0.7409))
    most = max(1.0 - transmittance - ROUNDING, 0.0)
    return min(front, most), min(back, most)


def _layer_resistance(u_value: float) -> float:
    """1/U without the films of winter [m2 K/W]."""
    inner = 0.359073 * np.log(u_value) + 6.949915
    if u_value >= STEEP_U:
        inner = 1.788041 * u_value - 2.886625
    return float(1 / u_value - 1 / inner - 1 / (0.025342 * u_value + 29.163853))


def _between(u_value: float, low: Callable[[], float], high: Callable[[], float]) -> float:
    """The value for insulating glazing, for single panes, or between them."""
    return float(np.interp(u_value, [LOW_U, HIGH_U], [low(), high()]))


FloatArray = NDArray[np.float64]
HEMISPHERE = np.radians(np.linspace(0.0, 89.0, 60))  # angles of diffuse light
LEAST_PASSED = 1e-3  # transmittance below which nothing follows from what passed


@dataclass(frozen=True, slots=True)
class PaneOptics:
    """Transmittance, front and back reflectance of a pane; any shape, such as per angle."""

    tau: FloatArray  # [...]
    rho_front: FloatArray  # [...]
    rho_back: FloatArray  # [...]

    def turned(self) -> PaneOptics:
        """The pane seen from its other side."""
        return PaneOptics(self.tau, self.rho_back, self.rho_front)


@dataclass(frozen=True, slots=True)
class StackOptics:
    """A stack of n panes, for light that meets the first one; `rho_back` for the other side."""

    tau: FloatArray  # [...]
    rho_front: FloatArray  # [...]
    rho_back: FloatArray  # [...]
    absorptance: FloatArray  # [..., n] of each pane


def pane_optics(pane: Pane, theta: ArrayLike) -> PaneOptics:
    """A pane at angles of incidence [...] [rad], see `glazing.pane_values`."""
    return PaneOptics(*pane_values(pane, theta))


def stack(panes: Sequence[PaneOptics]) -> StackOptics:
    """Panes from outside to inside as one glazing, all reflections between them counted.

    Intensities are added, so each polarisation or wavelength needs its own index in the
    arrays where it matters.

    Source: EN 410:2011, formulas (1) to (4), extended pane by pane.
    """
    if not panes:
        raise ValueError("expected at least one pane")
    first = panes[0]
    tau, front, back = first.tau, first.rho_front, first.rho_back
    absorbed, from_inside = [1 - tau - front], [1 - tau - back]
    for pane in panes[1:]:
        # two mirrors at 90 degrees transmit nothing: the denominator is 0 there
        bounce = 1 / np.maximum(1 - back * pane.rho_front, 1e-12)
        inward, kept = tau * bounce, 1 - pane.tau - pane.rho_front
        outward = inward * pane.rho_front
        absorbed = [a + outward * i for a, i in zip(absorbed, from_inside, strict=True)]
        absorbed.append(inward * kept)
        returned = pane.tau * bounce
        from_inside = [i * returned for i in from_inside]
        from_inside.append(1 - pane.tau - pane.rho_back + returned * back * kept)
        front = front + tau * outward
        tau, back = inward * pane.tau, pane.rho_back + returned * back * pane.tau
    return StackOptics(tau, front, back, np.stack(absorbed, axis=-1))


def hemispherical_mean(values: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Mean over the hemisphere of values [T, ...] given at angles [T] [rad] from 0 to pi/2.

    2 int value sin cos dtheta, as for a uniform sky.
    """
    weight = np.diff(np.sin(np.asarray(theta, dtype=float)) ** 2)
    v = np.asarray(values, dtype=float)
    return np.tensordot(weight, 0.5 * (v[1:] + v[:-1]), axes=(0, 0)) / weight.sum()


def absorbed_by_layers(
    layers: Sequence[Pane | None], transmittance: ArrayLike, reflectance: ArrayLike, theta: ArrayLike
) -> FloatArray:
    """Absorptance of every layer [K, N] of a system; its sum is 1 - tau - rho of the system.

    The panes on the outer side of the shade absorb part of the beam and of the light that the shade
    reflects, (rho - rho_o)/tau_o,dif.  The panes on its room side absorb in
    proportion to the transmission: tau a_i/tau_i,dif.  The shade absorbs the rest.

    Args:
        layers: from outside to inside; None is a shade, of which there is at most one.
        transmittance, reflectance: [K] of the whole system, direction to hemisphere.
        theta: angles of incidence [K] [rad].
    """
    tau, rho, angles = (np.asarray(v, dtype=float) for v in (transmittance, reflectance, theta))
    total = np.maximum(1.0 - tau - rho, 0.0)
    shades = [i for i, layer in enumerate(layers) if layer is None]
    if len(shades) > 1:
        raise ValueError("expected at most one shade")
    panes = [layer for layer in layers if layer is not None]
    if not shades:
        absorbed = _stacked(panes, angles).absorptance
        return absorbed * (total / np.maximum(absorbed.sum(axis=1), 1e-12))[:, None]
    outer = _before(panes[: shades[0]], rho, angles)
    inner = _behind(panes[shades[0] :], tau)
    others = np.concatenate([outer, inner], axis=1)
    # measured optics and the panes' may not quite agree: the shade never gets less than nothing
    scale = np.minimum(1.0, total / np.maximum(others.sum(axis=1), 1e-12))
    outer, inner = outer * scale[:, None], inner * scale[:, None]
    shade = total - outer.sum(axis=1) - inner.sum(axis=1)
    return np.concatenate([outer, np.maximum(shade, 0.0)[:, None], inner], axis=1)


def _before(panes: Sequence[Pane], rho: FloatArray, theta: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes outside the shade."""
    if not panes:
        return np.zeros((len(theta), 0))
    beam = _stacked(panes, theta)
    passed, absorbed = _diffuse(panes[::-1], from_room=True)
    back = np.maximum(rho - beam.rho_front, 0.0) / max(passed, LEAST_PASSED)
    return beam.absorptance + np.minimum(back, 1.0)[:, None] * absorbed[::-1]


def _behind(panes: Sequence[Pane], tau: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes inside the shade, which light meets diffuse."""
    if not panes:
        return np.zeros((len(tau), 0))
    passed, absorbed = _diffuse(panes)
    return tau[:, None] * absorbed / max(passed, LEAST_PASSED)


def _diffuse(panes: Sequence[Pane], *, from_room: bool = False) -> tuple[float, FloatArray]:
    """Transmittance and absorptances [n] for diffuse light, as it meets the panes in turn."""
    stacked = _stacked(panes, HEMISPHERE, from_room=from_room)
    passed = hemispherical_mean(stacked.tau, HEMISPHERE)
    return float(passed), hemispherical_mean(stacked.absorptance, HEMISPHERE)


def _stacked(panes: Sequence[Pane], theta: FloatArray, *, from_room: bool = False) -> StackOptics:
    optics = [pane_optics(pane, theta) for pane in panes]
    return stack([optic.turned() for optic in optics] if from_room else optics)
