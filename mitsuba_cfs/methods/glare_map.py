"""DGP of many eyes in many directions without pictures: their illuminance, the windows, the sun's disc.

    DGP = 5.87e-5 E_v + 0.092 log10(1 + C / E_v^1.87) + 0.159
    C = sum over window patches of L^2 omega / P^2 + the same of the sun's disc

E_v is that of vertical sensors by the five-phase method.  L is the luminance of each patch of the
Klems basis of each window part, without the sun's straight beam; patches above 2,000 cd/m2 are
glare sources.  A disc counts with the share of it that the eye sees, and with the transmittance of
its window.  Sunlit surfaces of the room and mirrors in it are no glare sources here.

Source: Jones 2019, "Fast climate-based glare analysis and spatial mapping", Building Simulation
2019, whose sources are the patches of the sky; DGP of Wienold and Christoffersen 2006,
doi:10.1016/j.enbuild.2006.03.017.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.glare.indices import ADAPTATION, DGP_IN_DARK, DGP_OF_CONTRAST, DGP_PER_LUX
from mitsuba_cfs.glare.position_index import position_index
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.coefficients import direct_sensor_matrix
from mitsuba_cfs.methods.light import ByPhases, seasons_of
from mitsuba_cfs.methods.optics import combinations, hourly_states, in_state
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    illuminance_of_all,
    luminance_without_beam,
    phase_light,
    with_sensor_light,
)
from mitsuba_cfs.methods.phase_matrices import as_five_phase, with_sensors
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.scattering import through_beams
from mitsuba_cfs.trace.sun.sun_discs import visible_suns

SOURCE = 2000.0  # least luminance of a glare source [cd/m2]
RIM = 0.05  # least cosine to the line of sight that a patch is divided by
SENSOR_SAMPLES = 4096  # paths of an eye in one direction, at most
SUN_POINTS = 128  # on each window group, for the sunlight that it scatters, at most
Array = NDArray[np.float64]


def glare_of_eyes(
    light: ByPhases,
    eyes: ArrayLike,
    directions: ArrayLike,
    state: NDArray[np.int64] | None = None,
    *,
    progress: Progress = silent,
) -> NDArray[np.float32]:
    """DGP of eyes in each of some directions in every hour of the light's sky [E, N, L].

    Args:
        eyes: [E, 3] [m]; directions: [N, 3] unit vectors, the same at each eye.
        state: [G, L] of each window group in each hour, or [L] of all; the first by default.
    """
    eyes, directions = (np.atleast_2d(np.asarray(a, dtype=float)) for a in (eyes, directions))
    rows = hourly_states(state, light.systems, light.sky)
    dgp = np.zeros((len(eyes), len(directions), rows.shape[1]), dtype=np.float32)
    seasons = seasons_of(light)
    for i, (one, hours) in enumerate(seasons):
        if not isinstance(one, PhaseLight):
            raise ValueError("path tracing has no matrices: expected the light of a phase method")
        steps = part(progress, i / len(seasons), (i + 1) / len(seasons), "glare map")
        dgp[..., hours] = _of_season(one, eyes, directions, rows[:, hours], steps)
    return dgp


def _of_season(
    light: PhaseLight, eyes: Array, directions: Array, rows: NDArray[np.int64], progress: Progress
) -> NDArray[np.float32]:
    light = _light_of_eyes(light, eyes, directions, progress)
    progress("glare map", 0.7)
    lit = illuminance_of_all(light, rows)
    contrast = _windows(light, eyes, directions, rows)
    contrast += _suns(light, eyes, directions, rows).reshape(len(lit), -1)
    progress("glare map", 1.0)
    return probability(lit, contrast).astype(np.float32).reshape(len(eyes), len(directions), -1)


def probability(illuminance: Array, contrast: Array) -> Array:
    """DGP [...], at most 1, of illuminances at the eye [lx] and sums L^2 omega / P^2; 0.159 in the dark.

    Source: as of `mitsuba_cfs.glare.indices.daylight_glare_probability`, of many at once.
    """
    power = np.where(illuminance > 0, illuminance, np.inf) ** ADAPTATION
    dgp = DGP_PER_LUX * illuminance + DGP_OF_CONTRAST * np.log10(1 + contrast / power) + DGP_IN_DARK
    return np.minimum(np.where(illuminance > 0, dgp, DGP_IN_DARK), 1.0)


def _light_of_eyes(light: PhaseLight, eyes: Array, directions: Array, progress: Progress) -> PhaseLight:
    """The light of vertical sensors [E * N] by the five-phase method."""
    points, normals = np.repeat(eyes, len(directions), axis=0), np.tile(directions, (len(eyes), 1))
    own = replace(light.scene, points=points, normals=normals, view=None, by_groups=None)
    sampling = light.sampling
    fewer = replace(
        sampling,
        sensor_samples=min(sampling.sensor_samples, SENSOR_SAMPLES),
        sun_points=min(sampling.sun_points, SUN_POINTS),
    )
    matrices = replace(
        light.matrices,
        scene=own,
        sampling=fewer,
        sensors=None,
        direct_sensors=None,
        sensors_by_reflectance=(),
        view=None,
        direct_view=None,
        adjacent_shown=None,
    )
    matrices = with_sensors(as_five_phase(matrices))
    of_eyes = phase_light(matrices, light.systems, light.sky, reflected=light.reflected, progress=progress)
    return with_sensor_light(of_eyes)


def _windows(light: PhaseLight, eyes: Array, directions: Array, rows: NDArray[np.int64]) -> Array:
    """Sum of L^2 omega / P^2 over the windows' patches that are glare sources [E * N, L]."""
    matrices = light.matrices
    direct = direct_sensor_matrix(matrices)
    local = KLEMS_FULL.incident_directions()
    weight = np.zeros(direct.shape, dtype=np.float32)
    for q, group in enumerate(matrices.parts.groups):
        towards = local @ group.frame
        cosine = np.maximum(directions @ towards.T, RIM)  # [N, K]
        position = np.stack([position_index(towards, fisheye(eyes[0], way)) for way in directions])
        weight[:, q] = direct[:, q] / np.tile(cosine * position**2, (len(eyes), 1))
    contrast = np.zeros((len(direct), rows.shape[1]))
    for kind, hours in combinations(rows):
        sky = light.sky.part(hours)
        for q, optics in enumerate(light.optics(kind)):
            L = luminance_without_beam(matrices, q, optics, sky)
            contrast[:, hours] += weight[:, q] @ np.where(L > SOURCE, L * L, 0)
    return contrast


def _suns(light: PhaseLight, eyes: Array, directions: Array, rows: NDArray[np.int64]) -> Array:
    """L^2 omega / P^2 of the sun's discs as the eyes see them [E, N, L]."""
    scene, sky = light.scene, light.sky
    contrast = np.zeros((len(eyes), len(directions), len(sky.lit)))
    shining = np.flatnonzero((sky.illuminance > 0) & (sky.direction[:, 2] > 0))
    if not len(shining):
        return contrast
    outdoors = scene.outdoor_groups
    seen = visible_suns(
        scene.interior,
        scene.exterior,
        scene.groups,
        eyes,
        sky.direction[shining],
        seed=light.sampling.seed,
        scenes=light.matrices.scenes,
    )
    for way in seen:
        square = np.zeros((len(outdoors), len(shining)))  # of the transmittance
        for kind, among in combinations(rows[:, shining]):
            scattering = [optics.scattering for optics in in_state(light.systems, kind)[: len(outdoors)]]
            square[:, among] = through_beams(outdoors, scattering, way.directions[among]) ** 2
        seen_square = np.einsum("gsq,gq->sq", way.share[: len(outdoors)], square)
        strength = seen_square * sky.illuminance[shining] ** 2 / SUN_SOLID_ANGLE
        for n, direction in enumerate(directions):
            index = position_index(way.directions, fisheye(eyes[0], direction))
            front = way.directions @ direction > 0
            contrast[:, n, shining] += strength * np.where(front, 1 / index**2, 0)
    return contrast
