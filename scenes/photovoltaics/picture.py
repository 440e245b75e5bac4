"""A picture of the building with its modules coloured by what each group of cells receives."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

from bim.rays import ray_mesh
from mitsuba_cfs.files import replacing
from mitsuba_cfs.surfaces import area_vectors
from scenes.figures.scale import ColourScale
from scenes.photovoltaics.study import PvResult

WIDTH, HEIGHT = 1400, 900
MARGIN = 1.6  # of the picture over the modules' extent
GREY = 205  # of what is no module, lit from the front
SKY = 248
THROUGH = 0.6  # opacity of a module that something hides
ASIDE = np.radians(25.0)  # of the view from straight before a facade
AMBIENT = 0.55  # share of the shading that does not depend on the direction


def irradiation_picture(result: PvResult, towards: NDArray[np.float64]) -> NDArray[np.uint8]:
    """An orthographic picture [HEIGHT, WIDTH, 3], seen from the direction `towards` [3].

    Modules carry the annual irradiation of their groups of cells, everything else is grey; they
    are drawn over whatever obstructs them.
    """
    elements = result.building.elements
    triangles = np.concatenate([element.triangles for element in elements])
    owner = np.repeat([e.guid for e in elements], [len(e.triangles) for e in elements])
    number = {module.guid: k for k, module in enumerate(result.modules)}
    module_of = np.array([number.get(guid, -1) for guid in owner])
    origins, w = _rays(result, triangles, towards)
    distance, hit = ray_mesh(triangles).first_hits(origins, np.tile(-w, (len(origins), 1)))
    normals = area_vectors(triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    shade = AMBIENT + (1 - AMBIENT) * np.abs(normals @ _light(w))
    colour = np.full((len(origins), 3), float(SKY))
    seen = hit >= 0
    colour[seen] = GREY * shade[hit[seen], None]
    indices = np.flatnonzero(module_of >= 0)
    behind, face = ray_mesh(triangles[indices]).first_hits(origins, np.tile(-w, (len(origins), 1)))
    face = np.where(face >= 0, indices[face], -1)
    values, scale = cell_irradiation(result), irradiation_scale(result)
    for k, module in enumerate(result.modules):
        active = (face >= 0) & (module_of[face] == k) & (normals[face] @ module.normal > 0.9)
        active = np.flatnonzero(active)
        if not len(active) or module.normal @ w <= 0:
            continue
        points = origins[active] - behind[active, None] * w
        nearest = np.linalg.norm(points[:, None] - module.points, axis=-1).argmin(axis=1)
        shown = scale.rgba(values[result.irradiance.module == k][nearest])[:, :3]
        hidden = distance[active] < behind[active] - 1e-6
        opacity = np.where(hidden, THROUGH, 1.0)[:, None]
        colour[active] = opacity * shown + (1 - opacity) * colour[active]
    return colour.round().astype(np.uint8).reshape(HEIGHT, WIDTH, 3)


def cell_irradiation(result: PvResult) -> NDArray[np.float64]:
    """Annual irradiation in the plane of every group of cells [S] [kWh/m2]."""
    return result.irradiance.plain.sum(axis=1, dtype=float) * result.weather.step_h / 1000


def irradiation_scale(result: PvResult) -> ColourScale:
    """Round limits about all groups of cells."""
    values = cell_irradiation(result)
    low, high = np.floor(values.min() / 100) * 100, np.ceil(values.max() / 100) * 100
    high = max(high, low + 100)
    return ColourScale(float(low), float(high), "irradiation", "kWh/m2", colours="inferno")


def view_directions(result: PvResult) -> list[tuple[str, NDArray[np.float64]]]:
    """Names and directions to look from, so that every facade with modules is seen."""
    chosen: list[NDArray[np.float64]] = []
    normals = np.stack([m.normal for m in result.modules])
    flat = normals * [1, 1, 0]
    upright = flat[np.linalg.norm(flat, axis=1) > 0.5]
    if not len(upright):
        upright = np.array([[0.0, -1.0, 0.0]])
    left = upright
    while len(left) and len(chosen) < 4:
        mean = left.mean(axis=0)
        first = left[np.argmax(left @ mean)]
        group = left[left @ first > 0.2 * np.linalg.norm(first)]
        towards = group.mean(axis=0)
        x, y, _ = towards / np.linalg.norm(towards)
        c, s = np.cos(ASIDE), np.sin(ASIDE)
        chosen.append(np.array([c * x - s * y, s * x + c * y, 0.6]))
        left = left[left @ towards < 0.2 * np.linalg.norm(towards)]
    names = []
    for towards in chosen:
        azimuth = np.degrees(np.arctan2(towards[0], towards[1])) % 360
        names.append((f"from_{round(azimuth):03d}", towards / np.linalg.norm(towards)))
    return names


def write_irradiation_picture(path: Path, result: PvResult, towards: NDArray[np.float64]) -> None:
    """PNG of `irradiation_picture` with its scale."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = irradiation_scale(result)
    figure, axes = plt.subplots(figsize=(14, 8), dpi=110)
    axes.imshow(irradiation_picture(result, towards))
    axes.set_axis_off()
    azimuth = np.degrees(np.arctan2(towards[0], towards[1])) % 360
    axes.set_title(f"Annual irradiation of the modules, seen from {azimuth:.0f} degrees")
    colours = ScalarMappable(Normalize(scale.low, scale.high), scale.colours)
    figure.colorbar(colours, ax=axes, label="kWh/m² a", fraction=0.025, pad=0.01)
    with replacing(path) as part:
        figure.savefig(part, bbox_inches="tight")
    plt.close(figure)


def _rays(
    result: PvResult, triangles: NDArray[np.float64], towards: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origins [HEIGHT * WIDTH, 3] outside the model and the unit direction back to them."""
    w = np.asarray(towards, dtype=float) / np.linalg.norm(towards)
    u = np.cross([0.0, 0.0, 1.0], w)
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    points = np.concatenate([module.outline for module in result.modules])
    flat = np.stack([points @ u, points @ v], axis=1)
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    extent = (flat.max(axis=0) - flat.min(axis=0)) / [WIDTH, HEIGHT]
    pixel = MARGIN * max(extent.max(), 1e-3)
    x = middle[0] + (np.arange(WIDTH) + 0.5 - WIDTH / 2) * pixel
    y = middle[1] - (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) * pixel
    far = (triangles.reshape(-1, 3) @ w).max() + 1.0
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return grid[:, :1] * u + grid[:, 1:] * v + far * w, w


def _light(w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction of the light that shades the picture: from above, beside the viewer."""
    side = np.cross([0.0, 0.0, 1.0], w)
    light = w + 0.6 * side + [0.0, 0.0, 0.7]
    return light / np.linalg.norm(light)
