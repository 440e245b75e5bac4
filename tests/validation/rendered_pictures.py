r"""The same room rendered by Radiance and by this project: vertical illuminance and DGP.

    python -m tests.validation rendered_pictures \
        [--systems glass blind tree] [--json FILE]

Room of the dissertation's Table 1 seen from 2 m behind its south window, at twelve positions of the
sun; clear glass, and the demo's blind as Klems matrices (`BSDF`) and as tensor tree (`aBSDF`).
Both programs get the sky on the same Reinhart patches and the sun as a disc of 0.533 degrees.
rpict renders 16 pixels for each of the picture's.  Radiance's Ev is rtrace's, of a point and
without an ambient cache; its DGP is that of rpict's glare sources with this Ev (evalglare's `-i`),
that of mitsuba-cfs of the picture alone.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_tensor_tree
from mitsuba_cfs.bsdf.glazing import uncoated_values
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic
from mitsuba_cfs.bsdf.plugin import klems_plugin
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_matrix, sky_series
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE, is_up
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.trace.kernels.scattering import AngularBeam
from mitsuba_cfs.trace.paths.scene import PathOptics, PathTracingScene, Sky, path_optics
from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture
from scenes.cost import room
from tests.benchmarks import radiance
from tests.benchmarks.annual_product import SYSTEM, WEATHER
from tests.validation.rendered_scene import RenderedScene, show_rows

EYE, DIRECTION = (1.8, 2.0, 1.2), (0.0, -1.0, 0.0)
SIZE = 200  # [px] of the pictures
SAMPLES = 32
SUBDIVISION = 4
MONTHS, TIMES = (12, 3, 6), (9, 11, 13, 15)  # of the twelve suns; the month's clearest day
INDEX, TRANSMISSIVITY = 1.52, 0.90  # of Radiance's `glass`: refractive index; inner transmittance
TREE_LEVELS, TREE_SAMPLES = 4, 65536
CACHED = "-ps 1 -pa 0 -ss 4 -ab 4 -ad 256 -as 0 -aa 0.25 -ar 16 -lr 8 -lw 1e-3"  # of the pictures
POINT = "-u+ -ss 1 -ab 8 -ad 32768 -aa 0 -lr 20 -lw 1e-9"  # of Ev, so many times:
POINTS = 8


@dataclass(frozen=True)
class Moment:
    """The sky of an hour."""

    name: str
    patches: NDArray[np.float64]  # [P] of sky and ground [cd/m2]
    sun: NDArray[np.float64]  # [3]
    sun_luminance: float  # [cd/m2]


@dataclass(frozen=True)
class Outcome:
    """Both programs' figures of a picture."""

    system: str
    moment: str
    altitude_deg: float
    ev_rtrace: float
    ev_rtrace_error: float  # its standard error [lx]
    ev: float  # ours, from the picture
    dgp_rpict: float
    dgp: float
    sources_rpict: int
    sources: int
    seconds_rpict: float
    seconds: float


def moments(weather: Weather) -> list[Moment]:
    """Twelve sunny hours: of each month and time the day with the strongest sun."""
    series = sky_series(weather)
    patches = sky_matrix(weather, SUBDIVISION, parts="sky")
    up = is_up(series.sun)
    found = []
    for month in MONTHS:
        for time_of_day in TIMES:
            mine = (weather.times.month == month) & (weather.midpoints.hour == time_of_day) & up
            hour = int(np.argmax(np.where(mine, series.direct_normal, -1.0)))
            sun = series.sun[hour]
            name = f"{weather.midpoints[hour]:%d %b %H:%M}"
            luminance = series.direct_normal[hour] / SUN_SOLID_ANGLE
            found.append(Moment(name, patches[:, hour], sun, float(luminance)))
    return found


class PicturedSystem:
    """A window's system for both programs."""

    def __init__(self, name: str, folder: Path) -> None:
        """Write its file into the folder and load it."""
        self.name = name
        if name == "glass":
            self.material = f"void glass window\n0\n0\n3{3 * f' {TRANSMISSIVITY}'}\n"
            cosine = np.linspace(0, 1, 256)
            tau, rho = uncoated_values(*_normal_values(), np.arccos(cosine))
            mirror = AngularBeam(rho)
            self.system = PathOptics(None, AngularBeam(tau), (mirror, mirror))
        elif name == "blind":
            (folder / "blind.xml").write_bytes(SYSTEM.read_bytes())
            self.material = "void BSDF window\n6 0 blind.xml 0 0 1 .\n0\n0\n"
            bsdf = read_bsdf_xml(SYSTEM).band("Visible")
            self.system = PathOptics(mi.load_dict(klems_plugin(bsdf)))
        else:
            if not (folder / "tree.xml").exists():
                write_bsdf_xml(blind_tree(), folder / "tree.xml")
            self.material = "void aBSDF window\n5 tree.xml 0 0 1 .\n0\n0\n"
            self.system = path_optics(read_bsdf_xml(folder / "tree.xml").band("Visible"))


def _normal_values() -> tuple[float, float]:
    """Transmittance and reflectance of the glass at normal incidence, all inner reflections."""
    r, a = ((INDEX - 1) / (INDEX + 1)) ** 2, TRANSMISSIVITY
    tau = (1 - r) ** 2 * a / (1 - (r * a) ** 2)
    return tau, r + r * a * tau


def blind_layer(reflectance: float = 0.55) -> PeriodicLayer:
    """The dissertation's blind at 40 degrees."""
    slats = {"depth": 0.080, "radius": 0.104, "spacing": 0.072, "tilt": np.radians(40)}
    return venetian_blind(plastic("slat", reflectance), **slats)


def blind_tree() -> BsdfFile:
    """Its tensor trees."""
    trees, _ = generate_tensor_tree(blind_layer(), TREE_LEVELS, samples=TREE_SAMPLES, seed=1)
    return BsdfFile({"Visible": trees[0]}, name="blind", manufacturer="mitsuba-cfs", thickness=0.08)


def rendered_room(folder: Path, fenestration: PicturedSystem) -> RenderedScene:
    """The room in a folder, for Radiance."""
    radiance.write_surfaces(room.room(), folder / "room.rad")
    lines = [fenestration.material]
    window = room.window_groups()[0].windows[0]
    for i, triangle in enumerate(window.triangles):  # normals into the room
        lines.append(radiance.polygon("window", f"pane{i}", triangle[::-1]))
    (folder / "window.rad").write_text("\n".join(lines))
    return RenderedScene(folder, "room.rad window.rad", CACHED, POINT)


def set_moment(scene: RenderedScene, moment: Moment) -> None:
    """Compile the scene under the sky of a moment."""
    scene.set_sky(moment.patches, SUBDIVISION, moment.sun, moment.sun_luminance)


def outcomes(systems: list[str], chosen: list[Moment], folder: Path, *, size: int = SIZE) -> Iterator[Outcome]:
    """Render every moment with every system in both programs."""
    view = fisheye(EYE, DIRECTION, size)
    for name in systems:
        fenestration = PicturedSystem(name, folder)
        peer = rendered_room(folder, fenestration)
        lit = PathTracingScene(room.room(), room.NOTHING, room.window_groups(), [fenestration.system])
        for moment in chosen:
            start = time.perf_counter()
            sky = Sky(moment.patches, moment.sun, moment.sun_luminance)
            picture = point_in_time_picture(lit, sky, view, samples=SAMPLES)
            seconds = time.perf_counter() - start
            set_moment(peer, moment)
            start = time.perf_counter()
            theirs = peer.picture(view)
            peer_seconds = time.perf_counter() - start
            np.savez(folder / f"{name} {moment.name}.npz", ours=picture, theirs=theirs)
            ev, ev_error = peer.eye_illuminance(view, POINTS)
            ours = evaluate(picture, view)
            rated = evaluate(theirs, view, illuminance=ev)
            altitude = float(np.degrees(np.arcsin(moment.sun[2])))
            yield Outcome(
                name,
                moment.name,
                altitude,
                ev,
                ev_error,
                ours.Ev,
                rated.dgp,
                ours.dgp,
                rated.count,
                ours.count,
                peer_seconds,
                seconds,
            )


def line(row: Outcome) -> str:
    """A row of the table."""
    return (
        f"{row.system:6} {row.moment} {row.altitude_deg:5.1f} deg  Ev "
        f"{row.ev_rtrace:9.1f} +- {row.ev_rtrace_error:.1f}  "
        f"{row.ev:9.1f} ({100 * (row.ev / row.ev_rtrace - 1):+.2f} %)  DGP "
        f"{row.dgp_rpict:.4f}  {row.dgp:.4f} ({row.dgp - row.dgp_rpict:+.4f})  sources "
        f"{row.sources_rpict} {row.sources}  {row.seconds_rpict:.0f} s {row.seconds:.1f} s"
    )


def main(
    *,
    systems: Sequence[str] = ("glass", "blind", "tree"),
    weather: Path = WEATHER,
    size: int = SIZE,
    every: Annotated[int, "moments from one to the next"] = 1,
    json_: Path | None = None,
) -> None:
    """Print the table."""
    variants.activate()
    chosen = moments(read_epw(weather))[::every]
    show_rows(json_, lambda folder: outcomes(systems, chosen, folder, size=size), line)
