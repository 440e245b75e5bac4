r"""The beam of a tensor tree by Radiance's `aBSDF` and by this project: twelve suns, Ev and DGP.

    python -m tests.validation tree_peak [--tree BLIND.xml | --layer fabric] \
        [--levels 5] [--every 1] [--size 120] [--json FILE]

The room and the suns of `rendered_pictures` behind the tensor tree of a file, or behind one made
here of a layer: the dissertation's blind at 40 degrees, or a dark fabric of which 3 % is open.
Besides Ev and DGP of both programs' pictures, ours by paths and by five phases, the share of the
sun that passes straight on: in the tree, and between the layer's own slats or threads.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.evaluate import klems_of
from mitsuba_cfs.bsdf.generate import TracedLayer, follow, generate_tensor_tree
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic
from mitsuba_cfs.bsdf.screens import woven_screen
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.glare.annual import full_picture
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.sampling import lattice_2d
from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture
from scenes.cost import room
from tests.benchmarks.annual_product import WEATHER
from tests.validation import rendered_pictures as rendered
from tests.validation.rendered_scene import show_rows

SLAT_RAYS = 1 << 16
PATHS = 1 << 32  # of a tree, over all pairs of incident and outgoing cells
POINTS = 4  # times that rtrace finds Ev
POINT = "-u+ -ss 1 -ab 8 -ad 16384 -aa 0 -lr 20 -lw 1e-9"


@dataclass(frozen=True)
class Outcome:
    """Both programs' figures of a moment."""

    moment: str
    altitude_deg: float
    beam: float  # share of the sun's light, of the tree
    beam_of_layer: float | None
    ev_rtrace: float
    ev_rtrace_error: float
    ev: float  # of the picture by paths
    ev_five_phase: float
    dgp_rpict: float
    dgp_rpict_error: float  # from halves of its pixels
    dgp: float
    dgp_error: float  # from two seeds
    dgp_five_phase: float


def fabric(reflectance: float = 0.2) -> PeriodicLayer:
    """A dark fabric, 3 % open."""
    thread = plastic("thread", reflectance)
    return woven_screen(thread, spacing=1e-3, openness=0.03, thickness=5e-5)


LAYERS = {"blind": rendered.blind_layer, "fabric": fabric}  # by reflectance


def layer_tree(layer: str, levels: int) -> BsdfFile:
    """A layer's tensor trees."""
    samples = PATHS >> 4 * levels
    trees, _ = generate_tensor_tree(LAYERS[layer](), levels, samples=samples, seed=1)
    return BsdfFile({"Visible": trees[0]}, name=layer, manufacturer="mitsuba-cfs", thickness=0.0)


def outcomes(
    tree: Path | None, layer: str, levels: int, chosen: list[rendered.Moment], view: View, folder: Path
) -> Iterator[Outcome]:
    """Every moment in both programs."""
    file = folder / "tree.xml"
    if tree is None:
        write_bsdf_xml(layer_tree(layer, levels), file)
    else:
        file.write_bytes(tree.read_bytes())
    fenestration = rendered.PicturedSystem("tree", folder)
    peer = replace(rendered.rendered_room(folder, fenestration), of_points=POINT)
    bsdf = read_bsdf_xml(file).band("Visible")
    optics, group = cfs.BsdfOptics(klems_of(bsdf), bsdf), room.window_groups()[0]
    lit = PathTracingScene(room.room(), room.NOTHING, [group], [fenestration.system])
    phases = five_phase(optics, chosen, view)
    for moment, third in zip(chosen, phases, strict=True):
        local = group.frame @ moment.sun
        sky = Sky(moment.patches, moment.sun, moment.sun_luminance)
        ours = [point_in_time_picture(lit, sky, view, samples=rendered.SAMPLES, seed=s) for s in (0, 1)]
        rendered.set_moment(peer, moment)
        ev, ev_error = peer.eye_illuminance(view, POINTS)
        halves = peer.halves(view)
        theirs = np.mean(halves, axis=0)
        np.savez(folder / f"{moment.name}.npz", ours=ours[0], theirs=theirs, five_phase=third)
        rated = [evaluate(p, view, illuminance=ev).dgp for p in (theirs, *halves)]
        own = [evaluate(p, view) for p in ours]
        through = optics.scattering.through(mi.Vector3f(*map(float, local)))
        yield Outcome(
            moment.name,
            float(np.degrees(np.arcsin(moment.sun[2]))),
            float(np.ravel(through.numpy())[0]),
            None if tree is not None else beam_between(layer, local),
            ev,
            ev_error,
            float(np.mean([one.Ev for one in own])),
            evaluate(third, view).Ev,
            rated[0],
            abs(rated[1] - rated[2]) / 2,
            float(np.mean([one.dgp for one in own])),
            abs(own[0].dgp - own[1].dgp) / 2,
            evaluate(third, view).dgp,
        )


def five_phase(optics: cfs.BsdfOptics, chosen: list[rendered.Moment], view: View) -> list[NDArray[np.float32]]:
    """Pictures of the moments by five phases; the sun also lies on the patch that it stands in."""
    reinhart, n = ReinhartSky(rendered.SUBDIVISION), len(chosen)
    towards = np.array([moment.sun for moment in chosen])
    strength = np.array([moment.sun_luminance for moment in chosen]) * SUN_SOLID_ANGLE
    patches = np.stack([moment.patches for moment in chosen], axis=1)
    sun, stands = np.zeros_like(patches), reinhart.index(towards)
    sun[stands, np.arange(n)] = strength / reinhart.solid_angles[stands]
    sky = cfs.AnnualSky(patches + sun, towards, strength, np.arange(n), 8760, sun=sun)
    scene = cfs.DaylightScene(room.room(), room.NOTHING, room.window_groups(), view=view)
    traced = cfs.phase_matrices(scene, cfs.Sampling(subdivision=rendered.SUBDIVISION))
    shown = pictures_in_state(cfs.phase_light(traced, [[optics]], sky), np.arange(n), [0])
    values = shown.values(np.arange(n))
    return [full_picture(row, shown.pixels, view) for row in values]


def beam_between(layer: str, local: NDArray[np.float64]) -> float:
    """Share of a beam from a direction in the window's frame that meets nothing of the layer."""
    black = TracedLayer(LAYERS[layer](0.0))  # what is met is lost
    lane = dr.arange(mi.UInt32, SLAT_RAYS)
    start = lattice_2d(lane, mi.UInt32(0), 0)
    direction = mi.Vector3f(*map(float, -local)) + dr.zeros(mi.Vector3f, SLAT_RAYS)
    _, weights = follow(black, start, direction, mi.Mask(True), mi.PCG32(size=SLAT_RAYS))
    return float(weights[0].numpy().mean())


def line(row: Outcome) -> str:
    """A row of the table."""
    between = "" if row.beam_of_layer is None else f"{row.beam_of_layer:.4f}"
    return (
        f"| {row.moment} | {row.altitude_deg:.0f} | {row.beam:.4f} | {between} | "
        f"{row.ev_rtrace:,.0f} ± {row.ev_rtrace_error:.0f} | {row.ev:,.0f} "
        f"({100 * (row.ev / row.ev_rtrace - 1):+.1f} %) | {row.ev_five_phase:,.0f} "
        f"({100 * (row.ev_five_phase / row.ev_rtrace - 1):+.1f} %) | "
        f"{row.dgp_rpict:.4f} ± {row.dgp_rpict_error:.4f} | {row.dgp:.4f} ± {row.dgp_error:.4f} "
        f"({row.dgp - row.dgp_rpict:+.4f}) | {row.dgp_five_phase:.4f} "
        f"({row.dgp_five_phase - row.dgp_rpict:+.4f}) |"
    )


def main(
    *,
    tree: Annotated[Path | None, "BSDF XML"] = None,
    layer: Annotated[str, LAYERS, "where there is no file"] = "blind",
    levels: Annotated[int, "of the layer's tree"] = 5,
    every: Annotated[int, "moments from one to the next"] = 1,
    size: Annotated[int, "[px]"] = 120,
    json_: Path | None = None,
) -> None:
    """Print the table."""
    variants.activate()
    chosen = rendered.moments(cfs.read_epw(WEATHER))[::every]
    view = fisheye(rendered.EYE, rendered.DIRECTION, size)
    show_rows(json_, lambda folder: outcomes(tree, layer, levels, chosen, view, folder), line)
