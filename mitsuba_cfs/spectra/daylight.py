"""Spectra of the sun and of the sky by hour.

sky    CIE daylight (D-series) of a correlated colour temperature that follows the luminance of
       each patch where the sky is clear and is 6514 K where it is overcast
sun    Bird and Riordan's beam through the hour's air mass and water vapour
ground under the whole daylight of the hour, neutral by default

With "spectrl2" a clear sky has the spectrum of Bird and Riordan's diffuse light on a horizontal plane,
in all its patches; the overcast sky stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.spectra.detectors import NANOMETRES, detected

FloatArray = NDArray[np.float64]
OVERCAST_K = 6514.0  # correlated colour temperature of an overcast sky
LEAST_K, MOST_K = 4000.0, 25000.0  # that CIE's daylight is defined for
# Of the standard spectra of ASTM G173-03
WATER_CM, OZONE_CM, AEROSOL_500NM, PRESSURE_PA = 1.42, 0.34, 0.084, 101325.0
LOWEST_SUN = 0.05  # sine of the altitude below which its colour stays as there (87 degrees zenith)
TABLE_STEPS = 1 << 14  # of mired, in which the components are tabulated: steps of 0.013
SKY_SPECTRA = ("cie", "spectrl2")  # of the clear sky
COMPONENT_ERROR = 1e-3  # largest part of the skies' spectra that their components leave out


def sky_temperature(luminance: ArrayLike, clear: ArrayLike) -> NDArray[np.floating]:
    """Correlated colour temperature of sky of a luminance [cd/m2] [K]; clear: 0 overcast to 1.

    Between clear and overcast, reciprocal temperatures are mixed (our choice).

    Source: Chain, Dumortier, Fontoynont 1999, Solar Energy 65, 285-295, as quoted by
    frudawski.de/specsky.
    """
    mired = -132.1 + 59.77 * np.log10(np.maximum(luminance, 1.0))
    mired = np.clip(mired, 1e6 / MOST_K, 1e6 / LEAST_K)
    share = np.asarray(clear)
    return np.asarray(1e6 / (share * (mired - 1e6 / OVERCAST_K) + 1e6 / OVERCAST_K))


def daylight_shares(temperature: ArrayLike) -> FloatArray:
    """Shares 1, M_1, M_2 [3, ..] of the components of CIE daylight of a temperature [K].

    Source: CIE 015:2018, 4.1.2.
    """
    from colour.temperature import CCT_to_xy_CIE_D  # a second, which only colour takes

    x, y = np.moveaxis(np.asarray(CCT_to_xy_CIE_D(np.asarray(temperature))), -1, 0)
    m = 0.0241 + 0.2562 * x - 0.7341 * y
    first = (-1.3515 - 1.7703 * x + 5.9114 * y) / m
    second = (0.0300 - 31.4424 * x + 30.0717 * y) / m
    return np.stack([np.ones_like(first), first, second])


@cache
def daylight_components() -> FloatArray:
    """Spectra S_0, S_1, S_2 of CIE daylight [3, N]."""
    from colour.colorimetry.datasets import illuminants

    tables = illuminants.SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES
    return np.stack(
        [np.interp(NANOMETRES, tables[name].wavelengths, tables[name].values) for name in ("S0", "S1", "S2")]
    )


def sun_spectra(height: ArrayLike, water_cm: ArrayLike = WATER_CM) -> FloatArray:
    """Relative spectra [L, N] of the sun's beam by the sine of its altitude [L]; see `clear_spectra`."""
    return clear_spectra(height, water_cm)[0]


def clear_spectra(height: ArrayLike, water_cm: ArrayLike = WATER_CM) -> tuple[FloatArray, FloatArray]:
    """Spectra [L, N] of the sun's beam and of the clear sky's diffuse light on a horizontal plane.

    Ozone, aerosol and pressure are those of ASTM G173.

    Args: height: sine of the sun's altitude [L].

    Source: Bird and Riordan 1986 (`pvlib.spectrum.spectrl2`).
    """
    import pvlib

    sine = np.atleast_1d(np.clip(np.asarray(height, dtype=float), LOWEST_SUN, 1.0))
    zenith = np.degrees(np.arccos(sine))
    water = np.broadcast_to(np.asarray(water_cm, dtype=float), zenith.shape)
    spectrum = pvlib.spectrum.spectrl2(
        apparent_zenith=zenith,
        aoi=zenith,
        surface_tilt=0.0,
        ground_albedo=0.2,
        surface_pressure=PRESSURE_PA,
        precipitable_water=water,
        ozone=OZONE_CM,
        relative_airmass=pvlib.atmosphere.get_relative_airmass(zenith),
        aerosol_turbidity_500nm=AEROSOL_500NM,
        dayofyear=np.ones_like(zenith),
    )

    def every_nanometre(name: str) -> FloatArray:
        columns = np.reshape(spectrum[name], (-1, len(zenith))).T
        return np.stack([np.interp(NANOMETRES, spectrum["wavelength"], column) for column in columns])

    return every_nanometre("dni"), every_nanometre("dhi")


def water_vapour_cm(dry_bulb_c: ArrayLike, relative_humidity: ArrayLike) -> FloatArray:
    """Precipitable water of the atmosphere [cm] by air at the ground; humidity 0 to 1.

    Source: Gueymard 1994 (`pvlib.atmosphere.gueymard94_pw`).
    """
    import pvlib

    percent = 100.0 * np.asarray(relative_humidity, dtype=float)
    return np.asarray(pvlib.atmosphere.gueymard94_pw(np.asarray(dry_bulb_c, dtype=float), percent))


@dataclass(frozen=True, slots=True)
class SpectralSky:
    """Spectra of the skies and suns of hours L.

    The radiance of a patch is the sum over the components of `amount` times the component; the
    ground's is its luminance times `ground`.
    """

    components: FloatArray  # [k, N]
    amount: NDArray[np.float32]  # [k, P, L] of each component, the ground first and 0
    horizontal: FloatArray  # [L, N] irradiance of a horizontal plane outdoors [W/(m2 nm)]
    ground: FloatArray  # [L, N] the same per lumen
    ground_luminance: FloatArray  # [L] [cd/m2]
    sun: FloatArray  # [L, N] spectrum of the beam per lumen [W/(lm nm)]


def spectral_sky(
    luminance: NDArray[np.floating],
    weights: NDArray[np.floating],
    beam: FloatArray,
    height: FloatArray,
    water_cm: ArrayLike = WATER_CM,
    clear: str = "cie",
    *,
    ground: FloatArray | None = None,
) -> SpectralSky:
    """The spectra of sky, ground and sun of hours.

    Args:
        luminance: [P, L] of ground and sky without the sun, the ground first [cd/m2].
        weights: [P] projected solid angles of the patches for a horizontal plane; the ground's 0.
        beam: [L] normal illuminance of the sun [lx]; height: [L] sine of its altitude.
        clear: spectrum of a clear sky, one of `SKY_SPECTRA`.
        ground: reflectance [N] of any scale; its luminance is that of `luminance`.  None: neutral.
    """
    horizontal = beam * np.maximum(height, 0.0)
    weights = np.asarray(weights, dtype=np.float32)  # as the luminances of the year
    sky = weights @ luminance
    share = horizontal / np.maximum(horizontal + sky, 1e-9)
    sun, whole_sky = clear_spectra(height, water_cm)
    if clear == "spectrl2":
        components, amount = _of_hours(luminance, share, whole_sky)
    else:
        components, amount = daylight_components(), _by_luminance(luminance, share)
    amount[:, 0] = 0.0
    sun /= detected(sun)[:, :1]
    diffuse = np.stack([weights @ one for one in amount], axis=-1) @ components
    whole = diffuse + horizontal[:, None] * sun
    reflected, of_sun = (whole, sun) if ground is None else (whole * ground, sun * ground)
    lumens = detected(reflected)[:, :1]
    per_lumen = np.divide(reflected, lumens, out=of_sun / detected(of_sun)[:, :1], where=lumens > 0)
    return SpectralSky(components, amount, whole, per_lumen, np.asarray(luminance[0], dtype=float), sun)


def _by_luminance(luminance: NDArray[np.floating], share: FloatArray) -> NDArray[np.float32]:
    """Amounts [3, P, L] of the components of CIE daylight; share: of the sun in the light [L]."""
    per_lumen = detected(daylight_components())[:, 0].astype(np.float32)
    # shares depend on one number: a table is much faster than the patches of all hours
    steps = np.linspace(1e6 / MOST_K, 1e6 / LEAST_K, TABLE_STEPS)
    table = daylight_shares(1e6 / steps)
    table = (table / (per_lumen @ table)).astype(np.float32)
    number = 1e6 / sky_temperature(luminance, share.astype(np.float32)) - steps[0]
    number *= (TABLE_STEPS - 1) / (steps[-1] - steps[0])
    nearest = np.rint(number).astype(np.int32)
    amount = np.empty((len(table), *luminance.shape), dtype=np.float32)
    for own, values in zip(amount, table, strict=True):
        np.multiply(values[nearest], luminance, out=own)
    return amount


def _of_hours(
    luminance: NDArray[np.floating], share: FloatArray, clear: FloatArray
) -> tuple[FloatArray, NDArray[np.float32]]:
    """Components [k, N] and amounts [k, P, L] of skies of one spectrum in each hour.

    Between clear [L, N] and overcast, spectra are mixed by the sun's share of the light (our choice).
    """
    overcast = daylight_shares(OVERCAST_K) @ daylight_components()
    spectra = share[:, None] * (clear / detected(clear)[:, :1])
    spectra += (1 - share)[:, None] * (overcast / detected(overcast)[0])
    left, size, right = np.linalg.svd(spectra, full_matrices=False)
    count = 1
    while count < len(size):
        rest = spectra - (left[:, :count] * size[:count]) @ right[:count]
        if np.abs(rest).max() <= COMPONENT_ERROR * spectra.max():
            break
        count += 1
    of_hours = (left[:, :count] * size[:count]).astype(np.float32)  # [L, k]
    amount = np.asarray(luminance, dtype=np.float32)[None] * of_hours.T[:, None]
    return right[:count], amount
