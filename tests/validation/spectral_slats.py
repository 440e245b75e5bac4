"""Slats as Klems data and as geometry, beside Radiance with both: what the patches' means change, without colour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator

from mitsuba_cfs.bsdf.angular import spectral_tables, specular_matrices
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.spectral_factor import ANGLES, SpectralFactor
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_light import illuminance_of_all
from mitsuba_cfs.methods.point_in_time import PathLight, path_illuminance
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.spectra.daylight import OVERCAST_K, daylight_components, daylight_shares, sun_spectra
from mitsuba_cfs.spectra.detectors import NANOMETRES, detected, visible_mean
from mitsuba_cfs.surfaces import Surfaces
from scenes.bsdf_generation import LEVELS, described_layer
from scenes.fenestration.thermal_file import reflectance_of_code
from tests.radiance import polygon, run
from tests.validation import spectral
from tests.validation.spectral import BLIND, EVERY_5_NM, NAMES, NORMALS, POINTS, Light, Window, hour, room_scene

GREYS = (0.43, 0.2, 0.06)  # of red, green and blue in one run of the peer
SHOWN = (0, 2)  # of these
LUMENS = 179.0  # of a watt, Radiance's
PATHS = 1 << 21  # of each sensor, to slats as geometry
SEEDS = 4
SKIES = ("overcast", "sun")
Array = NDArray[np.float64]


def main(
    *,
    data: Path = Path("../shared/data/bsdf/products_spectral"),
    bounces: int = 20,
    divisions: int = 20_000,
    repeats: int = 8,
    red: bool = False,
) -> str:
    """The tables of docs/evidence_daylight.md; red: slats of the blind's colour, as geometry on both sides."""
    window = Window.of("red blind, clear", data)
    if red:
        return _red(window, bounces, divisions, repeats)
    rows = [
        "| slats | sky | point | Radiance, slats [lx] | Radiance, Klems % | Klems % | slats % |",
        "|---|---|---|---|---|---|---|",
    ]
    systems = _grey_systems(window)
    for kind in SKIES:
        judge = _peer_slats(window, kind, bounces, divisions, repeats)  # [n, S, greys]
        for k in SHOWN:
            lit, error = _mean(judge[..., k])
            klems = _mean(_peer_klems(window, systems[k], kind, bounces, divisions // 2, repeats))
            own = _own_klems(systems[k], kind)
            slats = _mean(own_slats(window, kind, GREYS[k]))
            for s, point in enumerate(NAMES):
                cells = (
                    f"{lit[s]:.2f} ± {100 * error[s] / lit[s]:.1f} %",
                    _percent(klems[0][s] / lit[s], klems[1][s] / lit[s]),
                    _percent(own[s] / lit[s], 0.0),
                    _percent(slats[0][s] / lit[s], slats[1][s] / lit[s]),
                )
                rows.append(f"| {GREYS[k]:g} | {kind} | {point} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _red(window: Window, bounces: int, divisions: int, repeats: int) -> str:
    """Coloured slats as geometry on both sides, in the neutral room."""
    rows = [*spectral.HEADER]
    for kind in SKIES:
        own = red_slats(window, kind)
        peers = spectral.radiances(window, kind, bounces, divisions, "neutral", repeats, 1)
        rows += [
            f"| red slats, clear | {kind} | {p} | {spectral.compared(own, peers, s)} |" for s, p in enumerate(NAMES)
        ]
    return "\n".join(rows)


def red_slats(window: Window, kind: str) -> Light:
    """The light of coloured slats as geometry, from paths at a few reflectances.

    That of a wavelength is a polynomial of the slats' reflectance there.
    """
    reflectance = reflectance_of_code(str(window.slats))
    levels = float(reflectance.max()) * LEVELS
    at_levels = np.array([own_slats(window, kind, grey).mean(axis=0) for grey in levels])  # [n, S]
    weights = BarycentricInterpolator(levels, np.eye(len(levels)))(reflectance)  # [N, n]
    sky = daylight_shares(OVERCAST_K) @ daylight_components()
    if kind == "sun":
        sky = sun_spectra(np.sin(np.radians(spectral.ALTITUDE)))[0]
    panes = np.sin(2 * ANGLES) @ SpectralFactor.of_panes(window.panes).transmittance
    power = (weights @ at_levels) * (spectral.unit(sky) * panes / visible_mean(panes))[:, None]
    flat = detected(np.ones(len(NANOMETRES)))[0]  # [lx] of a spectrum of 1
    return Light.of(EVERY_5_NM.power(power.T / flat) @ EVERY_5_NM.detection.T)


def _percent(ratio: float, error: float) -> str:
    text = f"{100 * (ratio - 1):+.1f}"
    return f"{text} ± {100 * error:.1f}" if error else text


def _mean(values: Array) -> tuple[Array, Array]:
    """Mean of repeats [n, S], and its standard error."""
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))


def _grey_systems(window: Window) -> list[KlemsBsdf]:
    """Klems data of grey slats and the pane, as `cfs bsdf generate` and `combine` make them."""
    names = ("product", "geometry", "period_mm", "openness", "radius_mm", "index", "solar")
    options: dict[str, Any] = {**dict.fromkeys(names), **dict.fromkeys(("thickness_mm", "specular", "roughness"), 0.0)}
    layer = described_layer(shape="venetian", visible=GREYS[0], notes=[], levels=GREYS, **options, **BLIND)
    slats = generate_klems(layer, KLEMS_FULL, samples=131_072, seed=0).bsdf[2:]
    pane = specular_matrices(spectral_tables(window.panes)["Visible"])
    return [combine_layers([one, pane]).bsdf for one in slats]


def _own_klems(system: KlemsBsdf, kind: str) -> Array:
    """Illuminance of the points by the five-phase method [S]."""
    sampling = Sampling(sensor_samples=1 << 18, patch_samples=1 << 14, sun_points=1 << 13)
    light: Any = daylight(room_scene()[0], [[BsdfOptics(system)]], hour(kind), sampling=sampling)
    return illuminance_of_all(light, None)[:, 0]


def own_slats(window: Window, kind: str, grey: float) -> Array:
    """Illuminance of the points by path tracing to slats as geometry [n, S]."""
    scene, _ = room_scene()
    facade, slats = spectral.blind_polygons(scene)
    corners = np.concatenate([facade, slats])
    triangles = corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    reflectance = np.repeat([0.0, grey], [2 * len(facade), 2 * len(slats)])
    outdoors = Surfaces(triangles, reflectance, np.arange(len(triangles)) // 2)
    table = spectral_tables(window.panes)["Visible"]
    optics = BsdfOptics(specular_matrices(table), angular=table)
    scene = DaylightScene(scene.interior, outdoors, scene.groups, POINTS, NORMALS)
    found = []
    for seed in range(SEEDS):
        sampling = Sampling(hour_samples=PATHS // SEEDS, seed=seed)
        found.append(path_illuminance(PathLight(scene, [[optics]], hour(kind), sampling))[0][:, 0])
    return np.array(found)


def _peer_slats(window: Window, kind: str, bounces: int, divisions: int, repeats: int) -> Array:
    """Radiance's illuminance of the points with slats as `plastic` [n, S, greys]."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        spectral.peer_scene(folder, replace(window, slats=None), kind, "neutral", (380.0, 780.0))
        paint = "void plastic slat\n0\n0\n5 {:g} {:g} {:g} 0 0\n".format(*GREYS)
        (folder / "blind.rad").write_text(spectral.blind_of(room_scene()[0], paint), "utf-8")
        (folder / "glass.rad").write_text(_glass(window), "utf-8")
        return _traced(folder, kind, bounces, divisions, repeats)


def _peer_klems(window: Window, system: KlemsBsdf, kind: str, bounces: int, divisions: int, repeats: int) -> Array:
    """The same with slats and pane as a `BSDF` of Klems data [n, S]."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        spectral.peer_scene(folder, replace(window, slats=None), kind, "neutral", (380.0, 780.0))
        write_bsdf_xml(BsdfFile({"Visible": system}, name="slats"), folder / "slats.xml")
        parts = ["void BSDF system\n6 0 slats.xml 0 0 1 .\n0\n0\n"]
        parts += [polygon("system", f"pane{k}", one) for k, one in enumerate(_panes(towards_room=True))]
        (folder / "glass.rad").write_text("\n".join(parts), "utf-8")
        return _traced(folder, kind, bounces, divisions, repeats)[..., 1]


def _glass(window: Window) -> str:
    """The pane as grey `glass`."""
    own = float(spectral.transmissivity(SpectralFactor.of_panes(window.panes).visible[0]))
    parts = [f"void glass pane\n0\n0\n3 {own:.6g} {own:.6g} {own:.6g}\n"]
    return "\n".join(parts + [polygon("pane", f"pane{k}", one) for k, one in enumerate(_panes())])


def _panes(*, towards_room: bool = False) -> list[Array]:
    """Triangles of the window, whose normals point outdoors or towards the room."""
    group = room_scene()[0].groups[0]
    found = []
    for one in np.concatenate([each.triangles for each in group.windows]):
        outdoors = np.cross(one[1] - one[0], one[2] - one[0]) @ group.frame[2] > 0
        found.append(one[::-1] if outdoors == towards_room else one)
    return found


def _traced(folder: Path, kind: str, bounces: int, divisions: int, repeats: int) -> Array:
    """Illuminance of the points in the scene of a folder [n, S, 3], under a grey sky."""
    (folder / "sky.rad").write_text(spectral.perez_sky(folder, kind), "utf-8")
    run("oconv sky.rad room.rad glass.rad blind.rad > scene.oct", folder)
    lines = "".join(" ".join(f"{v:g}" for v in (*p, *n)) + "\n" for p, n in zip(POINTS, NORMALS, strict=True))
    options = spectral.peer_options(bounces, divisions)
    text = run(f"rtrace {options} -ss 1 -st 0 scene.oct", folder, (lines * repeats).encode()).decode()
    values = np.array([[float(v) for v in line.split()] for line in text.splitlines()])
    return LUMENS * values.reshape(repeats, len(POINTS), 3)
