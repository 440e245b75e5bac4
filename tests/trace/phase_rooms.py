"""Glass and a diffuser by their matrices, and rooms lit through them by five phases."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import illuminance
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky

K = KLEMS_FULL.size
OMEGA = KLEMS_FULL.projected_solid_angles()
POINTS = np.array([[1.8, 1.0, 0.8], [1.8, 0.3, 0.8], [1.0, 3.0, 0.8]])
UP = np.tile([0.0, 0.0, 1.0], (3, 1))


def glass_transmittance(cosine):
    """Of clear glass: it falls fast at grazing incidence, as 1 - (1 - cos)^5 does."""
    return 0.6 * (1 - (1 - np.clip(cosine, 0, 1)) ** 5)


def glass():
    """T and the sun's way of glass that a file knows at the middles of its patches."""
    from mitsuba_cfs.methods.optics import MatrixOptics
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

    tau = glass_transmittance(KLEMS_FULL.incident_directions()[:, 2])
    return MatrixOptics(np.diag(tau), KlemsScattering(KLEMS_FULL, np.zeros((K, K)), tau))


def diffuser(tau: float):
    from mitsuba_cfs.methods.optics import MatrixOptics
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

    block = np.full((K, K), tau / np.pi)
    return MatrixOptics(block * OMEGA, KlemsScattering(KLEMS_FULL, block, np.zeros(K)))


def traced(interior, exterior, groups, points, normals=None, **sampling):
    """The matrices of a room, none of them traced yet; sensors look up by default."""
    from mitsuba_cfs.methods.scene import DaylightScene, Sampling

    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1)) if normals is None else normals
    scene = DaylightScene(interior, exterior, groups, points, normals)
    return phase_matrices(scene, Sampling(patch_samples=4096, **sampling))


def lit(matrices, systems, sky, state=None):
    """Illuminance [S, L] of a room with systems by group and state."""

    return illuminance(phase_light(matrices, systems, sky), state)


def sun_series(sky: ReinhartSky, patches, diffuse: float = 0.0) -> AnnualSky:
    """Suns at the middles of patches, 1e5 lx each, and a uniform sky and ground [cd/m2]."""
    spread = np.zeros((sky.size, len(patches)))
    spread[patches, np.arange(len(patches))] = 1e5 / sky.solid_angles[patches]
    hours = np.arange(len(patches))
    towards, strength = sky.directions[patches], np.full(len(patches), 1e5)
    return AnnualSky(spread + diffuse, towards, strength, hours, len(patches), spread)
