"""Colour of a picture: the hour's sun, sky and ground in three bands, and what they colour.

Colours are linear sRGB over luminance: neutral is (1, 1, 1).  The hour is balanced: what reflects
all bands alike is neutral under its whole daylight on a horizontal plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.colour import WHITE, relative_rgb
from mitsuba_cfs.images.hdr import EFFICACY, LUMINANCE_WEIGHTS
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.point_in_time import path_tracing_room
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.spectra.daylight import sky_temperature, sun_spectra
from mitsuba_cfs.spectra.detectors import detected
from mitsuba_cfs.trace.paths.scene import Sky
from mitsuba_cfs.trace.pictures.point_in_time import colour_picture

FEWER = 8  # paths of the luminance for one of a band: colour varies less than light
NEUTRAL = 0.02  # greatest share by which a band of what is called grey differs from its luminance
SMOOTHING_STEPS = (1, 2, 4, 8)  # pixels between the places that are averaged
ALIKE = 0.1  # of the logarithm of luminances that belong together


@dataclass(frozen=True, slots=True)
class DaylightColour:
    """Colours of an hour's daylight, balanced."""

    sun: NDArray[np.float64]  # [3]
    patches: NDArray[np.float64]  # [P, 3] the ground first


def daylight_colour(sky: AnnualSky, hour: int) -> DaylightColour:
    """The colours of sun, ground and sky in one of the hours L.

    The sky's correlated colour temperature follows its luminance where it is clear and is 6514 K
    where it is overcast; between, reciprocal temperatures are mixed by the beam's share of the
    horizontal illuminance (our choice).  The sun is its beam through ASTM G173's atmosphere; the
    ground is grey under both.

    Source: Chain, Dumortier, Fontoynont 1999, Solar Energy 65, 285-295, as quoted by
    frudawski.de/specsky; Bird and Riordan 1986 (`pvlib.spectrum.spectrl2`).
    """
    luminance = np.asarray(sky.without_sun(hour), dtype=float)
    weights = ReinhartSky.of_size(len(luminance)).horizontal_weights
    height = max(float(sky.direction[hour][2]), 0.0)
    beam, diffuse = float(sky.illuminance[hour]) * height, luminance * weights
    share = beam / max(beam + diffuse.sum(), 1e-9)
    sun = sun_colour(height)
    patches = daylight_rgb(sky_temperature(luminance, share))
    whole = beam * sun + diffuse @ patches
    white = whole / np.maximum(whole @ np.asarray(LUMINANCE_WEIGHTS), 1e-9)
    patches[0] = white  # the ground
    return DaylightColour(sun / white, patches / white)


def daylight_rgb(temperature: ArrayLike) -> NDArray[np.float64]:
    """Linear sRGB over luminance [..., 3] of CIE daylight of a colour temperature [K]."""
    from colour.temperature import CCT_to_xy_CIE_D  # a second, which only colour takes

    x, y = np.moveaxis(np.asarray(CCT_to_xy_CIE_D(np.asarray(temperature))), -1, 0)
    return rgb_over_luminance(x / y, (1 - x - y) / y)


def sun_colour(height: float) -> NDArray[np.float64]:
    """Linear sRGB over luminance [3] of the sun's beam, by the sine of its altitude."""
    x, y, z = detected(sun_spectra(height))[0, -3:]
    return rgb_over_luminance(x / y, z / y)


def rgb_over_luminance(x: ArrayLike, z: ArrayLike) -> NDArray[np.float64]:
    """Linear sRGB over luminance of X / Y and Z / Y."""
    x, z = np.asarray(x) / WHITE[0], np.asarray(z) / WHITE[2]
    return relative_rgb(x, np.ones_like(x), z)


def has_colour(bands: Sequence[DaylightScene], systems: Sequence[Sequence[States]], sky: AnnualSky, hour: int) -> bool:
    """Whether a picture of the scenes by red, green and blue in one of the hours L is not grey.

    It is grey where all surfaces reflect the bands equally, the windows transmit them equally, and
    the hour's daylight is neutral.

    Args: systems: by red, green and blue [3][G][J].
    """
    red = [optics for states in systems[0] for optics in states]
    for tinted in systems[1:]:
        of_band = (optics for states in tinted for optics in states)
        if any(one is not other for one, other in zip(red, of_band, strict=True)):
            return True
    first, *others = bands
    for other in others:
        for one, two in ((first.interior, other.interior), (first.exterior, other.exterior)):
            if not np.array_equal(one.reflectance, two.reflectance):
                return True
    shade = daylight_colour(sky, hour)
    lights = [shade.patches[np.asarray(sky.without_sun(hour)) > 0]]
    if sky.illuminance[hour] > 0:
        lights.append(shade.sun[None])
    return any(np.abs(light - 1).max(initial=0) > NEUTRAL for light in lights)


def coloured_picture(
    luminance: NDArray[np.float32],
    bands: Sequence[DaylightScene],
    systems: Sequence[Sequence[States]],
    sky: AnnualSky,
    hour: int,
    *,
    sampling: Sampling,
    state: Sequence[int] | None = None,
    progress: Progress = silent,
) -> NDArray[np.float32]:
    """Radiance [ny, nx, 3] of a luminance picture [cd/m2] of one hour, in its colours.

    Each pixel keeps its luminance; its colour is that of three bands traced with an eighth of the
    paths each, which share their random numbers.

    Args:
        bands: the scene with its view by red, green and blue.
        systems: of each window group its states, by red, green and blue [3][G][J].
        state: of each window group [G]; the first by default.
    """
    shade = daylight_colour(sky, hour)
    patches, towards = np.asarray(sky.without_sun(hour)), sky.direction[hour]
    disc = float(sky.illuminance[hour]) / SUN_SOLID_ANGLE
    skies = [Sky(patches * shade.patches[:, c], towards, disc * shade.sun[c]) for c in range(3)]
    rgb = colour_picture(
        [path_tracing_room(*own, state) for own in zip(bands, systems, strict=True)],
        skies,
        bands[0].eye,
        samples=max(sampling.picture_samples // FEWER, 1),
        seed=sampling.seed,
        progress=progress,
    )
    return with_luminance(smoothed_colour(rgb, luminance), luminance)


def smoothed_colour(rgb: NDArray[np.floating], luminance: NDArray[np.floating]) -> NDArray[np.float64]:
    """The bands of a picture [ny, nx, 3], averaged where the picture's luminance is nearly alike.

    Few paths leave blotches of colour, where the luminance, of many more paths, shows what belongs
    together.

    Source: Dammertz, Sewtz, Hanika, Lensch 2010, High Performance Graphics, 67-75 (edge-avoiding
    a-trous wavelets).
    """
    spline = np.array([1, 4, 6, 4, 1], dtype=np.float32) / 16
    guide = np.log(np.maximum(luminance, 1e-6)).astype(np.float32) / np.float32(ALIKE)
    bands, (ny, nx) = np.ones((4, *guide.shape), dtype=np.float32), guide.shape
    bands[:3] = np.moveaxis(rgb, -1, 0)  # and ones, which add up to the weights
    for step in SMOOTHING_STEPS:
        edge, total = 2 * step, np.zeros_like(bands)
        border = ((edge, edge), (edge, edge))
        others = np.pad(guide, border, mode="edge")
        lit = np.pad(bands * (luminance > 0), ((0, 0), *border), mode="edge")
        for dy, dx in np.ndindex(5, 5):
            shifted = (slice(dy * step, dy * step + ny), slice(dx * step, dx * step + nx))
            weight = others[shifted] - guide
            np.multiply(weight, -weight, out=weight)
            np.exp(weight, out=weight)
            weight *= spline[dy] * spline[dx]
            total += weight * lit[:, *shifted]
        bands[:3] = total[:3] / np.maximum(total[3], 1e-12)
    return np.moveaxis(bands[:3], 0, -1).astype(float)


def with_luminance(rgb: NDArray[np.floating], luminance: NDArray[np.floating]) -> NDArray[np.float32]:
    """Radiance [ny, nx, 3] of the colours of one picture and the luminance [cd/m2] of another.

    What is black in the first is grey.
    """
    own = rgb @ np.asarray(LUMINANCE_WEIGHTS)
    lit = own > 0
    tint = np.where(lit[..., None], rgb / np.where(lit, own, 1.0)[..., None], 1.0)
    return (tint * luminance[..., None] / EFFICACY).astype(np.float32)
