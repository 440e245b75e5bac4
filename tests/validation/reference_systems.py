"""The four fenestration systems of the reference set: their optics and their closures.

A closure turns the same measurable data into the two-layer model:

    kuhn      plain Kuhn: nominal films 0.04 and 0.13, R constant from U
    linear    the same with U linear in temperature (Fener)
    surface   R(T_m, dT) in place of a constant
    films     R(T_m, dT), and the resistances that the system's faces really have
    layers    our own ISO 15099: U, g, R(T_m, dT) and films from the layers; the set's tau and rho
    typical   U and g at normal incidence, tau and rho, position of the shade: as a study has them
    gap       the same and the gas gap
    by direction   the same as typical, with g by direction
    constant, linear U   the same as typical, with R constant and U linear as stated models

All but `layers` take U and g of WINDOW's engine, `kuhn` to `films` g by direction.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.glazing import hemispherical_mean
from mitsuba_cfs.directions import incident_azimuth
from scenes.fenestration.thermal_system import sun_in_layers
from tests.validation.ashrae140_sun import ANGLES, glass
from thermal.blackbox import (
    R_INNER,
    R_OUTER,
    Fenestration,
    LayerAbsorptances,
    LayerResistance,
    layer_absorptances,
    linear_u,
    with_realised_films,
)
from thermal.closure import Closure
from thermal.glazing import Gap
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, sheet_layer, venetian_layer
from thermal.window_model import WindowModel, window_model

FloatArray = NDArray[np.float64]
SYSTEMS = ("dgu", "ext_blind", "ext_shade", "int_shade")
STATED = ("typical", "gap", "by direction", "constant", "linear U")  # from g at normal incidence
CLOSURES = ("kuhn", "linear", "surface", "films", "layers", *STATED)
WIDTH = 3.0  # [m] of the set's window
GAP = Gap(0.016, (("argon", 0.9), ("air", 0.1)), (0.84, 0.05))  # of the set's glazing
REALISED_STATE = 0  # of the U list: 0/20 degC
PLACES = {"dgu": "none", "int_shade": "internal", "ext_blind": "external", "ext_shade": "external"}


@dataclass(frozen=True, slots=True)
class Optics:
    """Solar properties per direction (rotationally symmetric: per angle), and for diffuse light."""

    theta: FloatArray  # [K] [rad]
    phi: FloatArray | None  # [K] [rad] incident azimuth, or None
    tau: FloatArray  # [K]
    rho: FloatArray  # [K]
    g: FloatArray  # [K]
    diffuse: FloatArray  # [2, 3] tau, rho, g for light from the sky and from the ground
    scatter: FloatArray | None  # [K, K] flux transmitted into each outgoing direction, per incident
    back: dict[str, float]  # room side: tau, rho, and the share of absorbed light per layer


@dataclass(frozen=True, slots=True)
class ReferenceSystem:
    """A fenestration system with one closure: thermal data, layer absorptances, optics."""

    fenestration: Fenestration
    optics: Optics
    direct: LayerAbsorptances  # [K]
    diffuse: LayerAbsorptances  # [2] sky, ground
    back_layers: tuple[float, float]  # room-side absorptances of the outer and inner layer


def clear_double() -> ReferenceSystem:
    """The clear double glazing of `glass("double")` as a system of the reference room."""
    pane = glass("double")
    tau, outer, inner = pane.diffuse
    rho = 1.0 - tau - outer - inner
    share = {"rho_back": pane.back[0]}
    diffuse = np.array([[tau, rho, 0.0]] * 2)  # g is not needed any more
    dark = np.zeros_like(ANGLES)
    optics = Optics(ANGLES, None, pane.tau, dark, dark, diffuse, None, share)
    both = LayerAbsorptances(np.full(2, outer), np.full(2, inner), 0.0)
    direct = LayerAbsorptances(pane.outer, pane.inner, 0.0)
    # light that the glass passes as beam: `reference_room` knows clear glass by this name
    plain = pane.fenestration
    fenestration = Fenestration("dgu", plain.u_value, resistance=plain.resistance)
    return ReferenceSystem(fenestration, optics, direct, both, (pane.back[1], pane.back[2]))


def read_optics(folder: Path, name: str) -> Optics:
    """Optics of a system of the reference set, as WINDOW's engine computed them."""
    data = json.loads((folder / f"blackbox_{name}.json").read_text())
    back = json.loads((folder / "blackbox_back.json").read_text())[name]
    if name == "ext_blind":
        return _klems_optics(folder, back)
    rows = sorted(data["angular"], key=lambda row: row["theta"])
    if data["cfs"] != "dgu":  # by matrices of the Klems basis: 75 and 80 degrees repeat others' rows
        rows = [row for row in rows if row["theta"] not in (75, 80)]
        rows = [row | {"theta": 82.5} if row["theta"] == 85 else row for row in rows]
    theta, tau, rho, g = (np.array([r[k] for r in rows]) for k in ("theta", "tau", "rho", "g"))
    d = data["diffuse"]
    both = np.array([[d["tau"], d["rho"], d["g"]]] * 2)
    return Optics(np.radians(theta), None, tau, rho, g, both, None, back)


def _klems_optics(folder: Path, back: dict[str, float]) -> Optics:
    z = np.load(folder / "blackbox_ext_blind_klems.npz")
    theta, phi, weight = np.radians(z["theta"]), np.radians(z["phi"]), z["lam"]
    halves = _halves(folder, phi, np.stack([z["tau"], z["rho"], z["g"]]))
    scatter = z["T_front_bsdf"] * weight[:, None]
    if (
        np.abs(scatter.sum(axis=0) - z["tau"]).max()
        > np.abs((z["T_front_bsdf"].T * weight[:, None]).sum(axis=0) - z["tau"]).max()
    ):
        scatter = z["T_front_bsdf"].T * weight[:, None]
    return Optics(theta, phi, z["tau"], z["rho"], z["g"], halves, scatter, back)


def _halves(folder: Path, phi: FloatArray, columns: FloatArray) -> FloatArray:
    """Means [2, C] of values [C, K] of the blind over the light of the sky and of the ground."""
    weight = np.load(folder / "blackbox_ext_blind_klems.npz")["lam"]
    above, below = np.sin(phi) < -1e-9, np.sin(phi) > 1e-9
    level = 0.5 * (~above & ~below)
    shares = [weight * (half + level) for half in (above, below)]
    return np.array([columns @ share / share.sum() for share in shares])


def at_directions(values: FloatArray, optics: Optics, local: FloatArray) -> FloatArray:
    """A property [K] at directions [T, 3] to the light in the window frame, interpolated."""
    theta = np.arccos(np.clip(local[:, 2], 0.0, 1.0))
    if optics.phi is None:
        return np.interp(theta, optics.theta, values)
    phi = incident_azimuth(local)
    rings = np.unique(optics.theta.round(6))
    per_ring = []
    for ring in rings:
        mine = np.flatnonzero(np.abs(optics.theta - ring) < 1e-5)
        order = mine[np.argsort(optics.phi[mine])]
        per_ring.append(np.interp(phi, optics.phi[order], values[order], period=2 * np.pi))
    stack = np.stack(per_ring)
    at = np.clip(np.searchsorted(rings, theta) - 1, 0, len(rings) - 2)
    f = np.clip((theta - rings[at]) / (rings[at + 1] - rings[at]), 0.0, 1.0)
    step = np.arange(len(theta))
    value = stack[at, step] * (1 - f) + stack[at + 1, step] * f
    grazing = np.clip((np.pi / 2 - theta) / (np.pi / 2 - rings[-1]), 0.0, 1.0)
    return value * np.where(theta > rings[-1], grazing, 1.0)


def layers(name: str) -> GlazingUnit:
    """The layers of a system as REFERENCE.md of the set states them."""
    clear = GlazingLayer(0.006, 0.9, (0.84, 0.84), solar=(0.775, 0.071, 0.071))
    low_e = GlazingLayer(0.006, 0.9, (0.05, 0.84), solar=(0.600, 0.220, 0.170))
    panes, argon = (clear, low_e), GasGap(GAP.width, GAP.gas)
    if name == "dgu":
        return GlazingUnit(panes, (argon,), width=WIDTH)
    wide = 0.05 if name == "int_shade" else 0.1
    edges = (wide,) * 4
    if name == "ext_blind":
        shade = venetian_layer(0.08, 0.072, 45.0, slat_thickness=0.00045, edges=edges)
    else:
        shade = sheet_layer(0.0, thickness=0.0005, conductivity=0.15, edges=edges)
    if name == "int_shade":
        return GlazingUnit((*panes, shade), (argon, GasGap(wide)), width=WIDTH)
    return GlazingUnit((shade, *panes), (GasGap(wide), argon), width=WIDTH)


def _of_layers(folder: Path, name: str, optics: Optics) -> tuple[WindowModel, Optics]:
    """Window model and optics with g, all from the layers."""

    return _modelled(folder, name, optics, Closure("layers", unit=layers(name)), None)


def _of_stated(folder: Path, name: str, optics: Optics, u_value: float, closure: str) -> tuple[WindowModel, Optics]:
    """Window model and optics with g by direction, from U and g at normal incidence alone."""
    model = {"by direction": "typical", "linear U": "linear"}.get(closure, closure)
    stated = Closure(model, gap=GAP if model == "gap" else None)
    window, found = _modelled(folder, name, optics, stated, u_value)
    return window, optics if closure == "by direction" else found


def _modelled(
    folder: Path, name: str, optics: Optics, closure: Closure, u_value: float | None
) -> tuple[WindowModel, Optics]:
    """As a study has it, g at normal incidence stated where U is."""
    order = np.argsort(optics.theta, kind="stable")  # the first direction is the normal
    window = window_model(
        optics.tau[order],
        optics.rho[order],
        optics.theta[order],
        PLACES[name],
        closure,
        absorbed=sun_in_layers,
        u_value=u_value,
        item=name,
        g_normal=None if u_value is None else float(optics.g[order[0]]),
    )
    g, absorbed = np.empty_like(optics.g), window.absorbed
    g[order] = window.data.g_value
    if absorbed is not None:
        window = replace(window, absorbed=absorbed[np.argsort(order)])
    return window, _with_g(folder, optics, g)


def _with_g(folder: Path, optics: Optics, g: FloatArray) -> Optics:
    """Optics with g [K] by direction, and its means over the light of sky and ground."""
    diffuse = optics.diffuse.copy()
    diffuse[:, 2] = _of_diffuse(folder, optics, g)
    return replace(optics, g=g, diffuse=diffuse)


def _of_diffuse(folder: Path, optics: Optics, values: FloatArray) -> FloatArray:
    """Means [2] of values [K] over the light of sky and ground."""
    if optics.phi is None:
        return np.full(2, hemispherical_mean(values, optics.theta))
    return _halves(folder, optics.phi, values[None])[:, 0]


def system(
    folder: Path, name: str, closure: str, optics: Optics | None = None, *, u_value: float | None = None
) -> ReferenceSystem:
    """A system of the reference set with one of the closures; other optics or U where given."""
    if closure not in CLOSURES:
        raise ValueError(f"closure {closure!r} is not of {', '.join(CLOSURES)}")
    optics = read_optics(folder, name) if optics is None else optics
    data = json.loads((folder / f"blackbox_{name}.json").read_text())
    fit = json.loads((folder / "blackbox_R.json").read_text())[f"{name}_fit"]
    state = data["U"][REALISED_STATE]
    u = state["U"] if u_value is None else u_value
    emissivity = 0.84 if name in ("dgu", "ext_blind", "ext_shade") else 0.9
    outside = 0.9 if name.startswith("ext") else 0.84
    resistance = {"kuhn": None, "linear": linear_u(u)}.get(closure, LayerResistance("surface", tuple(fit)))
    plain = Fenestration(name, u, R_OUTER, R_INNER, resistance, emissivity_in=emissivity, emissivity_out=outside)
    window = None
    if closure in STATED:
        window, optics = _of_stated(folder, name, optics, u, closure)
    if closure == "layers":
        window, optics = _of_layers(folder, name, optics)
    if window is not None:
        u = window.data.u_value
        plain = window.closure.close(replace(plain, u_value=u, resistance=None))
    if closure == "films":
        plain = with_realised_films(
            plain,
            r_inner_realised=state["R_i"] if name == "int_shade" else None,
            r_outer_realised=state["R_e"] if name.startswith("ext") else None,
        )
    if window is not None and plain.shade is not None:
        direct = window.absorptances(optics.tau, optics.rho, optics.g, plain, item=name)
        nodes = direct.outer, direct.inner, np.asarray(direct.middle)
        outer, inner, middle = (_of_diffuse(folder, optics, one) for one in nodes)
        diffuse = LayerAbsorptances(outer, inner, 0.0, middle)
    else:
        films = {"r_outer": plain.r_outer, "r_inner": plain.r_inner, "item": name}
        direct = layer_absorptances(optics.tau, optics.rho, optics.g, u, **films)
        diffuse = layer_absorptances(*optics.diffuse.T, u, **films)
    return ReferenceSystem(plain, optics, direct, diffuse, _back_layers(data, optics, plain))


def _back_layers(data: dict, optics: Optics, f: Fenestration) -> tuple[float, float]:
    """Room-side absorptances of the two layers, by the inward fractions of the real panes."""
    alpha = np.array(optics.back["alpha_back_layers"])
    if data["cfs"] == "dgu":
        alpha = alpha[::-1]  # the engine lists a specular system's back side the other way round
    inward = np.array(data["N_inward_fractions"])
    outer, _, behind = f.inward_shares()
    inner = np.clip((inward - outer) / (behind - outer), 0.0, 1.0)
    return float(alpha @ (1 - inner)), float(alpha @ inner)
