r"""Rooms by the light of November 2026 and by today's: a small picture for each fault.

    python -m tests.validation before_after --out docs/figures [--only mirrors bands ...]

Only what an option, other data or a plain rule that is still in the code can do as it was done is
drawn.  Pairs of five-phase pictures of an office of 4 x 6 x 3 m, with their DGP and Ev: glass
outdoors that scatters ("mirrors"), one system for all windows ("bands"), the sun's beam that the
room reflects by the window's patches ("beam"), the beam of a tensor tree as wide as a cell
("tree"), windows black from the room ("windows"), the ground of another sky model ("ground").
Curves: DGP by the picture's size, with the sun's disc in the pixels and apart ("disc"); one D for a
whole window below a slab ("overhang"); the transmittance of a pane beyond the last ring's middle
("grazing").
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs.bsdf.glazing import Pane, pane_values
from mitsuba_cfs.bsdf.klems_peak import specular_exponent, through_peak
from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
from tests.validation.before_after_rooms import (
    DARK,
    PAIRS,
    SENSOR_DEPTHS,
    Drawn,
    glass,
    lit,
    office,
    picture,
    sky,
)
from tests.validation.before_after_rooms import overhang as overhang_room

RANGE = (30.0, 3e4)  # of the colours [cd/m2]
SUN_SIZES = (100, 150, 200, 300, 400, 600, 800)  # [px]
SHOWN = 300  # [px] of the picture that is cut out
CUT = 6  # [px] on each side of the sun
HOUR_SAMPLES = 1 << 16  # paths of a sensor
GRAZING_DEG = np.linspace(60.0, 89.5, 119)
FLOAT = Pane("float", 0.89, 0.08, 0.08)


def pair(name: str, figure) -> str:
    """A pair of pictures; what they say in a line."""
    from matplotlib.colors import LogNorm

    figure.set_size_inches(4.6, 2.4)
    axes, said = figure.subplots(1, 2), []
    for axis, word, drawn in zip(axes, ("before", "now"), PAIRS[name](), strict=True):
        values, glare = picture(drawn)
        shown = axis.imshow(
            np.where(values > 0, values, np.nan), norm=LogNorm(*RANGE), cmap="turbo"
        )
        axis.set_axis_off()
        text = f"{word}: Ev {glare.Ev:,.0f} lx, DGP {glare.dgp:.3f}"
        axis.set_title(text, fontsize=7)
        said.append(text)
    _colours(figure, shown, axes)
    return "; ".join(said)


def disc(figure) -> str:
    """DGP over the pixels of a picture, with the sun in a dark window; its pixels at one size."""
    from matplotlib.colors import LogNorm

    figure.set_size_inches(5.6, 2.4)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.5))
    rated: dict[str, list[float]] = {"pixels": [], "source": []}
    for size in SUN_SIZES:
        whole, found = sun_rated(size)
        for rule, dgp in found.items():
            rated[rule].append(dgp)
        if size == SHOWN:
            y, x = np.unravel_index(np.argmax(whole), whole.shape)
            cut = whole[y - CUT : y + CUT + 1, x - CUT : x + CUT + 1]
            shown = left.imshow(cut, norm=LogNorm(1e2, 1e9), cmap="turbo")
    left.set_axis_off()
    left.set_title(f"the sun at {SHOWN} pixels", fontsize=7)
    _colours(figure, shown, [left])
    for rule, word in (("pixels", "before: in its pixels"), ("source", "now: a source")):
        right.plot(SUN_SIZES, rated[rule], "o-", markersize=3, label=word)
    _labelled(right, "pixels across", "DGP")
    return "; ".join(f"{rule} {np.round(dgp, 4).tolist()}" for rule, dgp in rated.items())


def sun_rated(size: int) -> tuple[NDArray[np.float32], dict[str, float]]:
    """A picture with the sun in a dark window, and its DGP by the rule of the sun's disc."""
    drawn = Drawn(office(size=size), [glass(DARK)], sky((0.13, -1.0, 0.22), 800.0, 100.0))
    shown, hour, view = (
        pictures_in_state(lit(drawn), np.array([0]), [0]),
        np.array([0]),
        drawn.scene.view,
    )
    values, discs = shown.without_disc(hour)
    bare, whole = (full_picture(v[0], shown.pixels, view) for v in (values, shown.values(hour)))
    own = cfs.evaluate(bare, view, disc=discs[0]).dgp
    return whole, {"pixels": cfs.evaluate(whole, view).dgp, "source": own}


def overhang(figure) -> str:
    """Illuminance below a slab over the distance from the window, by three phases and by paths."""
    figure.set_size_inches(5.6, 2.4)
    drawn, said = overhang_room(), []
    traced = (
        cfs.phase_matrices(drawn.scene, cfs.Sampling(window_parts=parts), five_phase=False)
        for parts in (1, 0)
    )
    before, now = (
        cfs.illuminance(cfs.phase_light(one, drawn.systems, drawn.sky))[:, 0] for one in traced
    )
    many = cfs.Sampling(hour_samples=HOUR_SAMPLES)
    paths = cfs.illuminance(cfs.PathLight(drawn.scene, drawn.systems, drawn.sky, many))[:, 0]
    left, right = figure.subplots(1, 2)
    left.plot(SENSOR_DEPTHS, paths, "k", linewidth=2.5, alpha=0.4, label="paths")
    for word, lux in (("before: one D", before), ("now: parts", now)):
        left.plot(SENSOR_DEPTHS, lux, label=word)
        right.plot(SENSOR_DEPTHS, lux / paths, label=word)
        said.append(f"{word} {np.round(lux / paths, 3).tolist()}")
    _labelled(left, "from the window [m]", "illuminance [lx]")
    _labelled(right, "from the window [m]", "over paths")
    return "; ".join(said)


def grazing(figure) -> str:
    """Transmittance of float glass by its Klems matrix over the angle, beside the exact one."""
    import mitsuba as mi

    figure.set_size_inches(5.6, 2.4)
    theta, basis = np.radians(GRAZING_DEG), cfs.KLEMS_FULL
    peak = through_peak(cfs.specular_klems(FLOAT, basis).transmission_front, basis)
    local = np.stack([np.sin(theta) * 0.6, np.sin(theta) * 0.8, np.cos(theta)])
    exact, said = pane_values(FLOAT, theta)[0], []
    left, right = figure.subplots(1, 2)
    left.plot(GRAZING_DEG, exact, "k", linewidth=2.5, alpha=0.4, label="Fresnel")
    ways = ("before: linear", None), ("now", specular_exponent(peak, basis))
    for word, exponent in ways:
        way = KlemsScattering(basis, peak.scattered, peak.transmittance, exponent)
        tau = way.through(mi.Vector3f(local.astype(np.float32))).numpy()
        left.plot(GRAZING_DEG, tau, label=word)
        right.plot(GRAZING_DEG, 100 * (tau / exact - 1), label=word)
        at = [int(np.abs(GRAZING_DEG - one).argmin()) for one in (80, 85, 88)]
        said.append(f"{word} {np.round(100 * (tau / exact - 1)[at], 1).tolist()} %")
    _labelled(left, "angle of incidence [degrees]", "transmittance")
    _labelled(right, "angle of incidence [degrees]", "over exact - 1 [%]")
    return "; ".join(said)


CURVES: dict[str, Callable[..., str]] = {
    "disc": disc, "overhang": overhang, "grazing": grazing,
}  # fmt: skip


def _colours(figure, shown, axes) -> None:
    bar = figure.colorbar(shown, ax=axes, shrink=0.8)
    bar.set_label("cd/m2", fontsize=7)
    bar.ax.tick_params(labelsize=7)


def _labelled(axis, across: str, up: str) -> None:
    axis.set_xlabel(across, fontsize=7)
    axis.set_ylabel(up, fontsize=7)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=7)


def draw(name: str, file: Path) -> str:
    """Write a picture; what it says in a line."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    said = CURVES[name](figure) if name in CURVES else pair(name, figure)
    figure.savefig(file, dpi=100)
    return f"{name}: {said}"


def main(arguments: list[str] | None = None) -> None:
    """Draw the pictures."""
    names = [*PAIRS, *CURVES]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        print(draw(name, options.out / f"office_{name}.png"), flush=True)


if __name__ == "__main__":
    main()
