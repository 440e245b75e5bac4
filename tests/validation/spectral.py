"""Light by wavelength against Radiance: melanopic EDI, DER and CCT behind several windows, in three rooms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.shoebox import shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs.bsdf.angular import spectral_tables, specular_matrices
from mitsuba_cfs.bsdf.en410 import solar_value
from mitsuba_cfs.bsdf.glazing import BRONZE_SHAPE, CLEAR_ABOVE, CLEAR_SHAPE
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.spectral_factor import SlatLight, SpectralFactor
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, read_spectral_pane, spectral_transmittance
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.spectral_light import Detection, spectral_light
from mitsuba_cfs.sky.annual import AnnualSky, given_sky
from mitsuba_cfs.spectra.channels import Channels
from mitsuba_cfs.spectra.daylight import OVERCAST_K, daylight_components, daylight_shares, sun_spectra
from mitsuba_cfs.spectra.detectors import NANOMETRES, colour_temperature, detected, equivalent_daylight, visible_mean
from mitsuba_cfs.surfaces import Surfaces
from scenes.bsdf_generation import generated_file
from scenes.fenestration.thermal_file import reflectance_of_code
from tests.radiance import polygon, run

FABRIC = np.interp(NANOMETRES, [380, 500, 540, 780], [0.05, 0.05, 0.4, 0.4])  # amber
# Panes of the IGSDB, from outside to inside, and a fabric indoors, or the colour of slats outdoors.  Product 7407
# is no part of ../shared/data: github.com/LBNL-ETA/frads has it in Examples/dynamic_shading_control_daylight_dimming
WINDOWS: dict[str, tuple[tuple[str, ...], NDArray[np.float64] | str | None]] = {
    "clear": (("CLEAR_3.DAT",), None),
    "green float": (("913.json",), None),
    "three panes of green float": (("913.json",) * 3, None),
    "electrochromic, clear": (("frads_igsdb_product_7406.json", "CLEAR_3.DAT"), None),
    "electrochromic at 6 %, clear": (("igsdb_product_7407.json", "CLEAR_3.DAT"), None),
    "blue, coated, and clear": (("nfrc_9962.json", "CLEAR_3.DAT"), None),
    "clear, amber fabric": (("CLEAR_3.DAT",), FABRIC),
    "red blind, clear": (("CLEAR_3.DAT",), "#b04a3a"),
}
BLIND: dict[str, Any] = {"depth_mm": 80.0, "spacing_mm": 72.0, "tilt_deg": 45.0}  # outdoors, flat slats
BLIND_BEHIND = 0.05  # from the glass to the middle of the slats [m]
BLIND_BEYOND = 1.0  # slats on each side of the window [m], whose BSDF is that of endless ones
SKY_AND_GROUND = (
    "skyfunc glow sky_glow 0 0 4 1 1 1 0 sky_glow source sky 0 0 4 0 0 1 180 "
    "skyfunc glow ground_glow 0 0 4 1 1 1 0 ground_glow source ground 0 0 4 0 0 -1 180\n"
)
ALTITUDE, AZIMUTH = 35.0, 170.0  # of the sun [degrees], from north by east
BANDS = 20  # of the peer's single run, which is enough where no pane is coloured
RANGES = 4  # runs of the peer for 20 bands of 5 nm each
MOST_BANDS = 24  # of a run of the peer's build: the others are bands that neighbours share
GAP = 1e-4  # between panes [m]: what leaves a wider one past its rim has met the inner panes alone
# Diffuse reflectances of the room's faces that are not neutral
ROOMS: dict[str, dict[str, NDArray[np.float64]]] = {
    "neutral": {},
    "red wall, wooden floor": {
        "left": np.interp(NANOMETRES, [570.0, 620.0], [0.05, 0.7]),
        "floor": np.interp(NANOMETRES, [380.0, 780.0], [0.08, 0.5]),
    },
    "yellow walls, blue carpet": {
        **dict.fromkeys(("left", "right"), np.interp(NANOMETRES, [450.0, 530.0], [0.1, 0.75])),
        "floor": np.interp(NANOMETRES, [380.0, 460.0, 520.0, 640.0, 780.0], [0.08, 0.18, 0.1, 0.04, 0.25]),
    },
}
POINTS = np.array([[2.0, 3.0, 0.8], [2.0, 3.0, 1.2], [2.0, 3.0, 1.2]])
NORMALS = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
EVERY_5_NM = Channels(tuple(np.arange(380.0, 781.0, 5.0).tolist()))  # as the peer's
HEADER = (
    "| panes | sky | point | EDI [lx] | Radiance | difference % | DER | difference % "
    "| CCT, difference [K] | [1/MK] | u'v' |",
    "|---|---|---|---|---|---|---|---|---|---|---|",
)
NAMES = ("desk", "eye towards the window", "eye along the window")


@dataclass(frozen=True)
class Window:
    """What fills the window."""

    panes: list[SpectralPane]
    fabric: NDArray[np.float64] | None = None  # transmittance and reflectance [N], diffuse; None: none
    slats: str | None = None  # colour of a blind outdoors, sRGB; None: none

    @staticmethod
    def of(name: str, data: Path) -> Window:
        """One of `WINDOWS`."""
        files, shade = WINDOWS[name]
        panes = [read_spectral_pane(data / file) for file in files]
        return Window(panes, slats=shade) if isinstance(shade, str) else Window(panes, shade)

    @property
    def factor(self) -> SpectralFactor:
        """Its spectrum by angle."""
        if self.slats is not None:
            panes = SpectralFactor.of_panes(self.panes)
            return replace(panes, mirrored=None, slats=coloured_blind(self.slats)[1])
        shade = () if self.fabric is None else (self.fabric, self.fabric)
        return SpectralFactor.of_panes(self.panes, *shade)


@cache
def coloured_blind(colour: str) -> tuple[KlemsBsdf, SlatLight]:
    """Visible BSDF of the slats, and their light by wavelength, as `cfs bsdf generate` makes them."""
    names = ("product", "geometry", "period_mm", "openness", "radius_mm", "index", "solar", "visible")
    options: dict[str, Any] = {
        **dict.fromkeys(names),
        **dict.fromkeys(("thickness_mm", "specular", "roughness", "cull"), 0.0),
        **{"basis": "full", "tensor_tree": None, "isotropic": False, "paths": 131_072, "seed": 0, "name": ""},
        **BLIND,
    }
    file, _, light = generated_file(sheet_colour=colour, shape="venetian", **options)
    assert light is not None
    bsdf = file.bands["Visible"]
    assert isinstance(bsdf, KlemsBsdf)
    return bsdf, light


@dataclass(frozen=True)
class Light:
    """Melanopic EDI [lx], DER and CCT [K] of the points [S]."""

    edi: NDArray[np.float64]
    ratio: NDArray[np.float64]
    kelvin: NDArray[np.float64]
    uv: NDArray[np.float64]  # [S, 2] CIE 1976 u', v'

    @staticmethod
    def of(received: NDArray[np.float64]) -> Light:
        """From what detectors receive [S, 9]."""
        edi, (x, y, z) = equivalent_daylight(received[:, 5]), received[:, -3:].T
        uv = np.stack([4 * x, 9 * y], axis=1) / (x + 15 * y + 3 * z)[:, None]
        return Light(edi, edi / received[:, 0], colour_temperature(received[:, -3:])[0], uv)


def main(
    *,
    data: Path = Path("../shared/data/bsdf/products_spectral"),
    bounces: int = 20,
    divisions: int = 5000,
    repeats: int = 4,
    only: str = "",
    sky: str = "",
    room: str = "neutral",
    parts: int = RANGES,
) -> str:
    """The tables of docs/evidence_daylight.md; only: of one of `WINDOWS`; sky: of one; room: one of `ROOMS`.

    Windows whose files are not in the folder of data are left out.  parts: ranges of wavelength of
    the peer, of 20 bands each.
    """
    rows = [*HEADER]
    for name, (files, _) in WINDOWS.items():
        if only not in ("", name) or not all((data / file).exists() for file in files):
            continue
        window = Window.of(name, data)
        for kind in ("overcast", "sun"):
            if sky in ("", kind):
                own = ours(window, kind, room)
                peers = radiances(window, kind, bounces, divisions, room, repeats, parts)
                rows += [f"| {name} | {kind} | {point} | {compared(own, peers, s)} |" for s, point in enumerate(NAMES)]
    return "\n".join(rows)


def compared(own: Light, peers: Light, s: int) -> str:
    """Cells of a point s: of the peer the mean of its repeats, with that mean's standard error.

    Args: peers: of the points, repeat after repeat.
    """
    edi, ratio, kelvin = (values[s :: len(NAMES)] for values in (peers.edi, peers.ratio, peers.kelvin))
    apart = float(np.hypot(*(own.uv[s] - peers.uv[s :: len(NAMES)].mean(axis=0))))
    mired = 1e6 / own.kelvin[s] - (1e6 / kelvin).mean()
    cells = (
        f"{own.edi[s]:.1f}",
        f"{edi.mean():.1f}",
        _difference(100 * own.edi[s] / edi.mean(), 100 * edi / edi.mean(), 1),
        f"{own.ratio[s]:.4f}",
        _difference(100 * own.ratio[s] / ratio.mean(), 100 * ratio / ratio.mean(), 2),
        _difference(own.kelvin[s], kelvin, 0),
        f"{mired:+.1f}" if np.isfinite(mired) else "none",
        f"{apart:.4f}",
    )
    return " | ".join(cells)


def _difference(own: float, peers: NDArray[np.float64], digits: int) -> str:
    """A difference from the mean, and the mean's standard error."""
    if not np.isfinite(own - peers.mean()):
        return "none"
    difference = f"{own - peers.mean():+.{digits}f}"
    if len(peers) == 1:
        return difference
    return f"{difference} ± {peers.std(ddof=1) / np.sqrt(len(peers)):.{digits}f}"


def room_scene(room: str = "neutral") -> tuple[DaylightScene, NDArray[np.float64]]:
    """A box of 4 x 6 x 3 m with a window to the south, and the reflectance of its surfaces [F, N].

    The eye of the scene is the last of the points.
    """
    colours = ROOMS[room]
    visible = {side: float(visible_mean(spectrum)) for side, spectrum in colours.items()}
    space = shoebox(reflectance=visible).spaces[0]
    spectra = [colours.get(face.name, np.full(len(NANOMETRES), face.reflectance("visible"))) for face in space.faces]
    view = fisheye(tuple(POINTS[-1]), tuple(NORMALS[-1]), 16)
    interior, groups = interior_surfaces(space, "visible"), window_groups(space)
    return DaylightScene(interior, Surfaces.none(), groups, POINTS[:-1], NORMALS[:-1], view), np.array(spectra)


def hour(kind: str) -> AnnualSky:
    """An overcast sky, a clear one, or its sun alone."""
    height, azimuth = np.radians([ALTITUDE, AZIMUTH])
    towards = [np.sin(azimuth) * np.cos(height), np.cos(azimuth) * np.cos(height), np.sin(height)]
    beam, diffuse = (0.0, 200.0) if kind == "overcast" else (800.0, 50.0)
    sky = given_sky([towards], [beam], [diffuse], 4, day_of_year=1, ground="gendaylit")
    return replace(sky, whole=sky.sun_alone()) if kind == "sun" else sky


def ours(window: Window, kind: str, room: str) -> Light:
    """The project's own, from the photopic light of the window's visible band."""
    scene, reflectance = room_scene(room)
    light = photopic_light(window, hour(kind), scene)
    return received(light, window, EVERY_5_NM, reflectance)


def received(light: PhaseLight, window: Window, channels: Channels, reflectance: NDArray[np.float64]) -> Light:
    """The light of the points by some bands."""
    wanted = [Detection(channels.detection)]
    [values] = spectral_light(light, [[window.factor]], channels, wanted, reflectance=reflectance).received
    return Light.of(values[..., 0].T.astype(np.float64))


def photopic_light(window: Window, sky: AnnualSky, scene: DaylightScene) -> PhaseLight:
    """The photopic light of the points in an hour."""
    table = spectral_tables(window.panes)["Visible"]
    system = BsdfOptics(specular_matrices(table), angular=table)
    if window.fabric is not None:
        share = float(visible_mean(window.fabric))
        block = np.full((KLEMS_FULL.size,) * 2, share / np.pi)
        sheet = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block, block, block)
        system = BsdfOptics(combine_layers([specular_matrices(table), sheet]).bsdf)
    if window.slats is not None:
        system = BsdfOptics(combine_layers([coloured_blind(window.slats)[0], specular_matrices(table)]).bsdf)
    sampling = Sampling(sensor_samples=1 << 16, patch_samples=1 << 14, sun_points=1 << 13)
    light = daylight(scene, [[system]], sky, sampling=sampling)
    assert isinstance(light, PhaseLight)
    return light


def radiances(
    window: Window, kind: str, bounces: int, divisions: int, room: str, repeats: int = 1, parts: int = RANGES
) -> Light:
    """Radiance's: spectra as its own primitives, each pane a `glass`, the fabric a `trans`, slats `plastic`.

    Of the points, repeat after repeat, whose random numbers differ.
    """
    runs = []  # in the bands of the ranges, from blue to red
    with TemporaryDirectory() as name:
        folder = Path(name)
        lines = "".join(" ".join(f"{v:g}" for v in (*p, *n)) + "\n" for p, n in zip(POINTS, NORMALS, strict=True))
        lines *= repeats
        for first, last in ranges(parts):
            low, high = edges(parts)[[first, last]]
            peer_scene(folder, window, kind, room, (low, high))
            options = f"{peer_options(bounces, divisions)} -cs {last - first} -co+"
            command = f"rtrace {options} -cw {low:g} {high:g} scene.oct"
            text = run(command, folder, lines.encode()).decode()
            values = np.array([[float(v) for v in line.split()] for line in text.splitlines()])
            if values[0].size != last - first:
                raise ValueError(f"rtrace gave {values[0].size} values a point")
            runs.append(values[:, ::-1] * 400.0 / parts / BANDS)
    # a spectrum of 1 has 179 lm/W in Radiance
    flat = detected(np.ones(len(NANOMETRES)))[0]
    channels = Channels(tuple(edges(parts).tolist()))
    return Light.of(joined(runs, ranges(parts)) @ channels.detection.T * 179.0 / flat)


def joined(runs: Sequence[NDArray[np.float64]], places: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """One spectrum [n, bands] of runs, whose random numbers differ, scaled to each other by the bands they share.

    Its sum is that of the runs as they are, each up to the middle of what it shares.
    """
    scale = np.ones(len(runs[0]))
    raw, scaled, begin = [], [], 0
    for k, (values, (first, last)) in enumerate(zip(runs, places, strict=True)):
        end = (last + places[k + 1][0]) // 2 if k + 1 < len(runs) else last
        if k:
            before, shared = runs[k - 1], places[k - 1][1] - first
            scale = scale * before[:, -shared:].sum(axis=1) / values[:, :shared].sum(axis=1)
        raw.append(values[:, begin - first : end - first])
        scaled.append(raw[-1] * scale[:, None])
        begin = end
    whole = np.concatenate(scaled, axis=1)
    return np.asarray(whole * (sum(part.sum(axis=1) for part in raw) / whole.sum(axis=1))[:, None])


def peer_options(bounces: int, divisions: int) -> str:
    """Options of `rtrace`: paths of its own that end by chance alone."""
    return f"-u+ -I+ -h -ab {bounces} -aa 0 -ad {divisions} -as 0 -lr -{3 * bounces} -lw 1e-7 -dj 0 -dc 1 -dt 0"


def edges(parts: int = RANGES) -> NDArray[np.float64]:
    """Of the peer's bands [nm]."""
    return np.linspace(380.0, 780.0, parts * BANDS + 1)


def ranges(parts: int = RANGES) -> list[tuple[int, int]]:
    """Bands from and to of the peer's runs."""
    if parts == 1:
        return [(0, BANDS)]
    starts = np.linspace(0, parts * BANDS - MOST_BANDS, parts).round().astype(int).tolist()
    return [(first, first + MOST_BANDS) for first in starts]


def peer_scene(folder: Path, window: Window, kind: str, room: str, nm: tuple[float, float], gap: float = GAP) -> None:
    """Write sky.rad, room.rad, glass.rad and their scene.oct for a range of wavelengths; gap: between panes [m]."""
    scene, reflectance = room_scene(room)
    (folder / "room.rad").write_text(_surfaces(scene.interior, reflectance), "utf-8")
    (folder / "pane.cal").write_text(PANE_CAL, "utf-8")
    (folder / "sky.rad").write_text(_sky(perez_sky(folder, kind), kind, window.panes), "utf-8")
    (folder / "glass.rad").write_text(_glass(scene, window, *nm, gap), "utf-8")
    blind = "" if window.slats is None else blind_of(scene, _coloured_paint(window.slats))
    (folder / "blind.rad").write_text(blind, "utf-8")
    run("oconv sky.rad room.rad glass.rad blind.rad > scene.oct", folder)


def blind_polygons(scene: DaylightScene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The facade round the window and the slats outside it, corners of rectangles [n, 4, 3] each."""
    corners = np.concatenate([each.triangles for each in scene.groups[0].windows]).reshape(-1, 3)
    (left, front, low), (right, _, high) = corners.min(axis=0), corners.max(axis=0)
    west, east, bottom, top = left - BLIND_BEYOND, right + BLIND_BEYOND, low - BLIND_BEYOND, high + BLIND_BEYOND
    sides = [
        (west, bottom, left, top),
        (right, bottom, east, top),
        (left, bottom, right, low),
        (left, high, right, top),
    ]
    y = front - 10 * GAP
    facade = [[[a, y, b], [c, y, b], [c, y, d], [a, y, d]] for a, b, c, d in sides]
    depth, step = BLIND["depth_mm"] / 1000, BLIND["spacing_mm"] / 1000
    tilt, y = np.radians(BLIND["tilt_deg"]), front - BLIND_BEHIND
    dy, dz = 0.5 * depth * np.cos(tilt), 0.5 * depth * np.sin(tilt)
    slats = [
        [[west, y - dy, z - dz], [east, y - dy, z - dz], [east, y + dy, z + dz], [west, y + dy, z + dz]]
        for z in np.arange(bottom, top, step)
    ]
    return np.array(facade), np.array(slats)


def blind_of(scene: DaylightScene, paint: str) -> str:
    """Slats of a `plastic` outdoors, and a black facade, which sends no light to them."""
    facade, slats = blind_polygons(scene)
    parts = [paint, "void plastic black\n0\n0\n5 0 0 0 0 0\n"]
    parts += [polygon("black", f"facade{i}", corners) for i, corners in enumerate(facade)]
    parts += [polygon("slat", f"slat{i}", corners) for i, corners in enumerate(slats)]
    return "\n".join(parts)


def _coloured_paint(colour: str) -> str:
    """The `plastic` of slats of a colour."""
    return _spectrum("paint", reflectance_of_code(colour)) + "\npaint plastic slat\n0\n0\n5 1 1 1 0 0\n"


def _surfaces(surfaces: Surfaces, reflectance: NDArray[np.float64]) -> str:
    """Triangles as `plastic` of the spectra of their surfaces [F, N]."""
    parts = [
        f"{_spectrum(f'colour{f}', spectrum)}\ncolour{f} plastic surface{f}\n0\n0\n5 1 1 1 0 0\n"
        for f, spectrum in enumerate(reflectance)
    ]
    for i, (f, triangle) in enumerate(zip(surfaces.surface, surfaces.triangles, strict=True)):
        parts.append(polygon(f"surface{f}", f"triangle{i}", triangle))
    return "\n".join(parts)


def transmissivity(tau: ArrayLike) -> NDArray[np.float64]:
    """Radiance's transmissivity of a pane's transmittance at normal incidence, n = 1.52."""
    tau = np.asarray(tau, dtype=float)
    root = np.sqrt(0.8402528435 + 0.0072522239 * tau**2)
    return np.asarray((root - 0.9166530661) / 0.0036261119 / tau)


def _spectrum(name: str, values: NDArray[np.float64]) -> str:
    """A primitive `spectrum` of values [N]."""
    text = " ".join(f"{v:.6g}" for v in values)
    return f"void spectrum {name}\n0\n0\n{len(values) + 2} 380 780 {text}\n"


def unit(spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """A spectrum with the luminance of a flat one of 1."""
    return spectrum * detected(np.ones(len(NANOMETRES)))[0] / detected(spectrum)[0]


def perez_sky(folder: Path, kind: str) -> str:
    """The grey sky of `gendaylit`: the overcast sky, or the sun alone."""
    (folder / "sky.cal").write_text(SKY_CAL, "utf-8")
    azimuth = AZIMUTH - 180.0  # gendaylit's: west of south
    beam, diffuse = (0.0, 200.0) if kind == "overcast" else (800.0, 50.0)
    made = run(f"gendaylit -ang {ALTITUDE} {azimuth} -W {beam} {diffuse}", folder).decode()
    text = "\n".join(line for line in made.splitlines() if not line.startswith("#"))
    start = text.index("void brightfunc skyfunc")
    if kind == "overcast":
        return f"{text[start:].replace('skybright perezlum', 'above sky')}\n{SKY_AND_GROUND}"
    return text[:start]


def _sky(grey: str, kind: str, panes: Sequence[SpectralPane]) -> str:
    """A sky of `perez_sky`, coloured.

    Shadow rays of Radiance do not go to and fro between panes: the sun's spectrum has that share.
    """
    if kind == "overcast":
        overcast = unit(daylight_shares(OVERCAST_K) @ daylight_components())
        return f"{_spectrum('day', overcast)}\n{grey.replace('void brightfunc', 'day brightfunc')}"
    cosine = np.cos(np.radians(ALTITUDE)) * np.cos(np.radians(AZIMUTH - 180.0))
    alone = [spectral_transmittance([pane], NANOMETRES, np.arccos(cosine))[0] for pane in panes]
    together = spectral_transmittance(panes, NANOMETRES, np.arccos(cosine))[0]
    share = together / np.maximum(np.prod(alone, axis=0), 1e-9)
    sun = unit(sun_spectra(np.sin(np.radians(ALTITUDE)))[0]) * share
    return _spectrum("beam", sun) + grey.replace("void light", "beam light")


# perezlum.cal mixes sky and ground near the horizon, where slats let light pass; here each ends there
SKY_CAL = """{ diffuse normalization, ground, coefficients of the Perez model, direction of the sun }
above = if(Dz, A1 * (1 + A3*exp(A4/if(Dz - .01, Dz, .01))) * (1 + A5*exp(A6*gamma) + A7*cosgamma*cosgamma), A2);
cosgamma = Dx*A8 + Dy*A9 + Dz*A10;
gamma = acos(if(cosgamma - 1, 1, cosgamma));
"""


# Radiance multiplies the spectrum of a `glass` into its transmittance whatever the angle: only the
# three colours of the material itself get the longer way of oblique light.  This function has it: T
# of a pane of transmissivity tn by wavelength over that of the material's own transmissivity.
# A coated pane has t(theta) of WINDOW 4's polynomials, as ours.
PANE_CAL = """{ arguments: wavelengths from and to, own transmissivity, coefficients in cos(theta),
table every 5 nm of tn, or of the coated pane's transmittance }
n : 1.52;
c = abs(Rdot);
c2 = sqrt(1 - (1 - c*c)/(n*n));
sq(x) = x*x;
re = sq((c - n*c2)/(c + n*c2));
rm = sq((1/c - n/c2)/(1/c + n/c2));
T(r, t) = (1-r)*(1-r)*t/(1 - r*r*t*t);
both(tn) = .5*(T(re, tn^(1/c2)) + T(rm, tn^(1/c2)));
between(f, a, b) = (1-f)*a + f*b;
at(x) = between(x - floor(x), arg(9 + floor(x)), arg(10 + floor(x)));
pane(nm) = both(at((nm - 380)/5)) / both(arg(3));
shape = arg(4) + c*(arg(5) + c*(arg(6) + c*(arg(7) + c*arg(8))));
coated(nm) = at((nm - 380)/5) * if(shape, shape, 0) / both(arg(3));
"""


def _glass(scene: DaylightScene, window: Window, low: float, high: float, gap: float) -> str:
    """Panes as `glass`, a gap apart; what is innermost is in the window's plane.

    Radiance evaluates a `specfunc` at few wavelengths of its range, so that it has that of the run
    [nm].
    """
    parts, innermost = [], 0
    if window.fabric is not None:
        innermost = 1
        parts.append(_spectrum("dye", 2 * window.fabric))
        parts.append("dye trans layer0\n0\n0\n7 1 1 1 0 0 0.5 0\n")
    for i, pane in enumerate(reversed(window.panes), start=innermost):
        every = np.arange(380.0, 786.0, 5.0)
        table = np.interp(every, pane.wavelength_nm, pane.transmittance)
        own = transmissivity(SpectralFactor.of_panes([pane]).visible[0])
        shape = np.zeros(5)
        if pane.coated:
            clear = solar_value(pane.wavelength_nm, pane.transmittance) > CLEAR_ABOVE
            shape = np.array(CLEAR_SHAPE[0] if clear else BRONZE_SHAPE[0])
        else:
            table = transmissivity(table)
        values = " ".join(f"{v:.6g}" for v in (own, *shape, *table))
        function = "coated" if pane.coated else "pane"
        parts.append(
            f"void specfunc tint{i}\n2 {function} pane.cal\n0\n{8 + len(every)} {low:g} {high:g} {values}\n"
            f"tint{i} glass layer{i}\n0\n0\n3 {own:.6g} {own:.6g} {own:.6g}\n"
        )
    for i in range(innermost + len(window.panes)):
        for group in scene.groups:
            for each in group.windows:
                for k, triangle in enumerate(each.triangles):
                    moved = triangle + gap * i * group.frame[2]
                    parts.append(polygon(f"layer{i}", f"sheet{i}_{k}", moved))
    return "\n".join(parts)
