r"""Rooms by the light of November 2026 and by today's: a small pair of pictures for each fault.

    python -m scenes.evidence.validation.before_after --out docs/figures [--only mirrors bands ...]

Only what an option or other data can still do as it was done is drawn: glass outdoors that scatters
("mirrors"), one system for all windows ("bands"), one D for a whole window ("overhang"), windows
black from the room ("windows"), the ground of another sky model ("ground").  Office of 4 x 6 x 3 m,
five-phase pictures; DGP and Ev are those of the pictures.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from bim.defaults import CLEAR_GLAZING, GLASS_REFLECTANCE
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs.methods.optics import GivenOptics, States

SIZE = 110  # [px]
SAMPLES = 8  # paths of a pixel
RANGE = (30.0, 3e4)  # of the colours [cd/m2]
CLEAR = cfs.Glazing("clear", 0.78, 0.14, 0.14)
DARK = cfs.Glazing("dark", 0.10, 0.1, 0.1)


@dataclass(frozen=True)
class Drawn:
    """A room, what fills its windows, and an hour."""

    scene: cfs.DaylightScene
    systems: Sequence[States]
    sky: cfs.AnnualSky
    window_parts: int = 0  # of the window; 0: as many as the error asks for


def glass(of: cfs.Glazing = CLEAR) -> States:
    """One state of a glazing."""
    return [cfs.BsdfOptics(cfs.specular_klems(of, cfs.KLEMS_FULL))]


def sky(sun: tuple[float, float, float], direct: float, diffuse: float, **more) -> cfs.AnnualSky:
    """One hour, 21 June.

    Args: sun: towards it; direct, diffuse: irradiances [W/m2].
    """
    towards = np.array([sun]) / np.linalg.norm(sun)
    return cfs.given_sky(towards, [direct], [diffuse], day_of_year=172, **more)


def office(
    facing_deg: float = 180.0, windows: Sequence[WindowRectangle] = (), exterior=None
) -> cfs.DaylightScene:
    """The room with its eye 3 m behind the window; a group for each window."""
    chosen = {"windows": windows} if windows else {}
    space = shoebox(4.0, 6.0, 3.0, facing_deg=facing_deg, **chosen).spaces[0]
    window = space.windows[0]
    eye = window.centre - 3.0 * window.normal
    view = cfs.fisheye((eye[0], eye[1], 1.2), tuple(window.normal), SIZE)
    groups = [
        cfs.WindowGroup(surface.name, (surface,))
        for group in window_groups(space)
        for surface in group.windows
    ]
    groups.sort(key=lambda group: group.name)
    outdoors = cfs.Surfaces.none() if exterior is None else exterior
    return cfs.DaylightScene(interior_surfaces(space), outdoors, groups, view=view)


def plate(corners: Sequence[tuple], reflectance: float, gloss: cfs.Gloss | None) -> cfs.Surfaces:
    """A quadrilateral outdoors."""
    a, b, c, d = map(np.array, corners)
    return cfs.Surfaces(
        np.array([[a, b, c], [a, c, d]], dtype=float), np.full(2, reflectance),
        np.zeros(2, dtype=np.int64), (), (gloss,) if gloss is not None else (),
    )  # fmt: skip


def mirrors() -> tuple[Drawn, Drawn]:
    """A north office before a sunlit facade of glass, 12 m away: 15 % scattered, and mirrored."""
    corners = [(-15, 12, 0), (-15, 12, 14), (20, 12, 14), (20, 12, 0)]
    noon = sky((0.2, -1.0, 1.1), 800.0, 100.0)
    pair = ((GLASS_REFLECTANCE, None), (0.0, CLEAR_GLAZING))
    house = office(0.0)
    facades = (plate(_turned(corners), *one) for one in pair)
    scenes = (replace(house, exterior=beside(house.interior, facade)) for facade in facades)
    before, now = (Drawn(scene, [glass()], noon) for scene in scenes)
    return before, now


def beside(house: cfs.Surfaces, facade: cfs.Surfaces) -> cfs.Surfaces:
    """The house as it stands outdoors, and a facade of one surface before it."""
    number = int(house.surface.max()) + 1
    gloss = (*(None,) * number, facade.gloss[0]) if facade.gloss else ()
    return cfs.Surfaces(
        np.concatenate([house.triangles, facade.triangles]),
        np.concatenate([house.reflectance, facade.reflectance]),
        np.concatenate([house.surface, facade.surface + number]),
        (),
        gloss,
    )


def _turned(corners: Sequence[tuple]) -> list[tuple]:
    """Before a window to the north of the room that the shoebox puts at the origin."""
    return [(x - 4, y, z) for x, y, z in corners]


def bands() -> tuple[Drawn, Drawn]:
    """Three bands of panes, clear below, dark before the eye, clear above; before: the mean."""
    windows = [WindowRectangle(0.3, sill, 3.4, 0.7) for sill in (0.2, 1.0, 1.8)]
    scene, noon = office(windows=windows), sky((0.2, -1.0, 1.0), 800.0, 100.0)
    mean = cfs.Glazing("mean", (2 * 0.78 + 0.10) / 3, 0.13, 0.13)
    return (
        Drawn(scene, [glass(mean)] * 3, noon),
        Drawn(scene, [glass(), glass(DARK), glass()], noon),
    )


def overhang() -> tuple[Drawn, Drawn]:
    """A slab 2 m deep over the window, overcast: one D, and as many as the error asks for."""
    slab = plate([(-1, -2, 2.75), (5, -2, 2.75), (5, 0, 2.75), (-1, 0, 2.75)], 0.3, None)
    drawn = Drawn(office(exterior=slab), [glass()], sky((0.0, -0.1, 1.0), 0.0, 150.0))
    return replace(drawn, window_parts=1), drawn


def windows() -> tuple[Drawn, Drawn]:
    """The window black to the light of the room, and with its glass."""
    now = Drawn(office(), [glass()], sky((0.2, -1.0, 1.0), 800.0, 100.0))
    (optics,) = glass()
    black = GivenOptics(optics.transmission, optics.scattering, optics.paths)
    return replace(now, systems=[[black]]), now


def ground() -> tuple[Drawn, Drawn]:
    """The plain to the horizon by gendaylit, and as it reflects a fifth of sun and sky."""
    before, now = (
        Drawn(office(), [glass()], sky((0.9, 0.3, 0.7), 800.0, 100.0, ground=name))
        for name in ("gendaylit", "reflected")
    )
    return before, now


PAIRS: dict[str, Callable[[], tuple[Drawn, Drawn]]] = {
    "mirrors": mirrors, "bands": bands, "overhang": overhang, "windows": windows, "ground": ground,
}  # fmt: skip


def picture(drawn: Drawn) -> tuple[NDArray[np.float32], cfs.GlareResult]:
    """The picture of the hour and its glare."""
    sampling = cfs.Sampling(view_samples=SAMPLES, window_parts=drawn.window_parts)
    traced, view = cfs.PhaseScene(drawn.scene, sampling), drawn.scene.view
    light = cfs.PhaseSystems(traced, drawn.systems).light(drawn.sky)
    shown = light.pictures(np.array([0]), [0] * len(drawn.systems))
    found = np.zeros(view.width * view.height, dtype=np.float32)
    found[shown.pixels] = shown.values(np.array([0]))[0]
    found = found.reshape(view.height, view.width)
    return found, cfs.evaluate(found, view)


def draw(name: str, file: Path) -> str:
    """Write the pair; what it says in a line."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.colors import LogNorm

    figure, axes = plt.subplots(1, 2, figsize=(4.6, 2.4), layout="constrained")
    said = []
    for axis, word, drawn in zip(axes, ("before", "now"), PAIRS[name](), strict=True):
        values, glare = picture(drawn)
        shown = axis.imshow(
            np.where(values > 0, values, np.nan), norm=LogNorm(*RANGE), cmap="turbo"
        )
        axis.set_axis_off()
        text = f"{word}: Ev {glare.Ev:,.0f} lx, DGP {glare.dgp:.3f}"
        axis.set_title(text, fontsize=7)
        said.append(text)
    bar = figure.colorbar(shown, ax=axes, shrink=0.8)
    bar.set_label("cd/m2", fontsize=7)
    bar.ax.tick_params(labelsize=7)
    figure.savefig(file, dpi=100)
    plt.close(figure)
    return f"{name}: {'; '.join(said)}"


def main(arguments: list[str] | None = None) -> None:
    """Draw the pairs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--only", nargs="+", choices=PAIRS, default=list(PAIRS))
    options = parser.parse_args(arguments)
    for name in options.only:
        print(draw(name, options.out / f"office_{name}.png"), flush=True)


if __name__ == "__main__":
    main()
