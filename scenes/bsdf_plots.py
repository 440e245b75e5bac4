"""Polar plots of a BSDF's two hemispheres for light from one direction."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical

THETA_STEP_DEG, PHI_STEP_DEG = 0.5, 1.0
DECADES = 4  # of the colour scale, below the largest value


def plot_hemispheres(bsdf: Bsdf, incident: NDArray[np.float64], title: str) -> Figure:
    """Figure of the BSDF [1/sr] by outgoing direction; `incident` [3] in the window frame.

    Seen from outside: up is up, right is right, polar angle as radius.
    """
    theta = np.radians(np.arange(THETA_STEP_DEG / 2, 90, THETA_STEP_DEG))
    phi = np.radians(np.arange(0, 360, PHI_STEP_DEG) + PHI_STEP_DEG / 2)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    half = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    outwards = 1.0 if incident[2] > 0 else -1.0
    sides = {"reflected": outwards, "transmitted": -outwards}
    values = {
        kind: bsdf_values(bsdf, incident, half * [1, 1, sign]).reshape(t.shape)
        for kind, sign in sides.items()
    }
    highest = max(value.max() for value in values.values())
    norm = LogNorm(max(highest, 1e-9) / 10**DECADES, max(highest, 1e-9))
    figure = Figure(figsize=(11, 5.4), layout="constrained", dpi=130)
    axes = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    edges = np.radians(np.arange(0, 360 + PHI_STEP_DEG, PHI_STEP_DEG))
    rings = np.arange(0, 90 + THETA_STEP_DEG, THETA_STEP_DEG)
    for axis, (kind, value) in zip(axes, values.items(), strict=True):
        share = direct_hemispherical(bsdf, _block(kind, outwards), incident)[0]
        shown = axis.pcolormesh(
            edges, rings, np.maximum(value, norm.vmin), norm=norm, cmap="inferno", shading="flat"
        )
        axis.set_title(f"{kind}: {100 * share:.1f} %")
        axis.set_yticks([30, 60, 90], ["30°", "60°", "90°"], color="grey")
        axis.set_xticks(np.radians([0, 90, 180, 270]), ["right", "up", "left", "down"])
        axis.grid(alpha=0.3)
        toward = 1 if kind == "reflected" else -1  # the light, or straight on
        at = np.arctan2(toward * incident[1], toward * incident[0])
        marker, label = ("o", "the light") if kind == "reflected" else ("x", "straight on")
        theta_deg = np.degrees(np.arccos(abs(incident[2])))
        axis.plot(at, theta_deg, marker, mfc="none", mec="cyan", ms=9, label=label)
        axis.legend(loc="lower left", bbox_to_anchor=(-0.15, -0.1))
    figure.colorbar(shown, ax=axes, label="BSDF [1/sr]", shrink=0.85)
    figure.suptitle(f"{title}; seen from outside")
    return figure


def _block(kind: str, outwards: float) -> str:
    side = "front" if outwards > 0 else "back"
    return f"{'reflection' if kind == 'reflected' else 'transmission'}_{side}"
