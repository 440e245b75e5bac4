"""Sky matrices [P, H]: the luminance or radiance of every sky patch in every time step.

Luminance of the ground up to the horizon, without modelled surroundings:

`reflected`   diffuse reflection of sky and sun, rho E_gh / pi (gendaymtx)
`gendaylit`   gendaylit's: its share of the sky is that of a CIE sky of the same zenith luminance
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky import sun as sun_module
from mitsuba_cfs.sky.options import GROUNDS, PARTS, SUN_PATCHES
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.perez import PerezSky, perez_sky, relative_luminance
from mitsuba_cfs.sky.weather import Weather

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

OVERCAST = 0.777778  # horizontal illuminance over pi times the zenith luminance, CIE overcast sky
CLEAR_FROM = 6.0  # clearness
# the same times F2, in (altitude - pi/4) / (pi/4)
CLEAR_SKY = (2.766521, 0.547665, -0.369832, 0.009237, 0.059229)
INTERMEDIATE_SKY = (3.5556, -2.7152, -1.3081, 1.0660, 0.60227)


def reflected_ground(global_horizontal: FloatArray, reflectance: float | FloatArray) -> FloatArray:
    """Luminance [H] of a diffuse plain, rho E_gh / pi."""
    return reflectance / np.pi * global_horizontal


def gendaylit_ground(
    zenith: FloatArray,
    direct_horizontal: FloatArray,
    clearness: FloatArray,
    sun: FloatArray,
    reflectance: float | FloatArray,
) -> FloatArray:
    """Luminance [H] of the ground by gendaylit, rho (L_z n + E_dh / pi).

    n is that of the CIE overcast sky at clearness 1, of the intermediate one below 6, else of the
    clear one.  `reflected` gives 0.99 to 2.2 times as much over a year of Geneva.

    Args:
        zenith: [H] luminance of the sky's zenith [cd/m2].
        direct_horizontal: [H] illuminance of the ground by the sun [lx].
        clearness: [H] Perez's epsilon; sun: [H, 3] unit vectors to it.

    Source: Radiance `gendaylit.c`, `gensky.c`.
    """
    height = np.arcsin(np.clip(sun[:, 2], 0.0, 1.0))
    from_zenith = np.pi / 2 - height
    x = (height - np.pi / 4) / (np.pi / 4)
    clear = 0.274 * (0.91 + 10.0 * np.exp(-3.0 * from_zenith) + 0.45 * sun[:, 2] ** 2)
    between = (2.739 + 0.9891 * np.sin(0.3119 + 2.6 * height)) * np.exp(-from_zenith * (0.4441 + 1.48 * height))
    factor = np.where(
        clearness >= CLEAR_FROM, polyval(x, CLEAR_SKY) / clear / np.pi, polyval(x, INTERMEDIATE_SKY) / between / np.pi
    )
    factor = np.where(clearness <= 1.0, OVERCAST, factor)
    return reflectance * (zenith * factor + direct_horizontal / np.pi)


FloatArray = NDArray[np.float64]

BANDS = ("visible", "solar")
DARK = 1e-4  # [W/m2] gendaymtx's night: direct normal plus diffuse at or below it
DEFAULT_ALBEDO = 0.2  # gendaymtx's
DEFAULT_DEW_POINT_C = 11.0  # gendaymtx's, for files without one
CHUNK_BYTES = 2**20  # size of one temporary array: it stays in the cache, four times the speed


@dataclass(frozen=True, slots=True)
class SkySeries:
    """The Perez sky and the sun of H moments, in one band (lx and cd/m2, or W/m2 and W/m2/sr)."""

    sun: FloatArray  # [H, 3] unit vectors to the sun
    model: PerezSky  # shape of the sky's luminance
    diffuse_horizontal: FloatArray  # [H] illuminance [lx] or irradiance [W/m2]
    direct_normal: FloatArray  # [H] illuminance [lx] or irradiance [W/m2]

    @property
    def global_horizontal(self) -> FloatArray:
        """Horizontal illuminance or irradiance [H] of sky and sun."""
        return self.diffuse_horizontal + self.direct_normal * np.maximum(self.sun[:, 2], 0.0)

    def luminance(self, directions: FloatArray, hours: NDArray[np.int64]) -> FloatArray:
        """Sky luminance or radiance [N, h] of directions [N, 3] at some of the moments.

        Scaled so that the diffuse horizontal value comes out on the patches of MF:6.
        """
        fine = ReinhartSky(6)
        level = self._relative(fine.directions[1:], hours)
        scale = self.diffuse_horizontal[hours] / (fine.horizontal_weights[1:] @ level)
        return self._relative(np.asarray(directions, dtype=float), hours) * scale

    def patches(self, sky: ReinhartSky, hours: NDArray[np.int64]) -> FloatArray:
        """Patch luminance or radiance [P - 1, h], without ground and sun.

        Scaled so that the sum over patches gives the diffuse horizontal value exactly.
        """
        level = self._relative(sky.directions[1:], hours)
        total = sky.horizontal_weights[1:] @ level
        if np.any(total <= 0):  # no light by the model: a uniform sky, as in gendaymtx
            level[:, total <= 0] = 1.0
            total = sky.horizontal_weights[1:] @ level
        level *= self.diffuse_horizontal[hours] / total
        return level

    def ground(self, hours: NDArray[np.int64], reflectance: FloatArray, model: str) -> FloatArray:
        """Luminance or radiance [h] of the ground by one of `GROUNDS`."""
        if model not in GROUNDS:
            raise ValueError(f"ground: expected one of {GROUNDS}, got {model!r}")
        if model == "reflected":
            return reflected_ground(self.global_horizontal[hours], reflectance)
        zenith = self.luminance(np.array([[0.0, 0.0, 1.0]]), hours)[0]
        direct = self.direct_normal[hours] * np.maximum(self.sun[hours, 2], 0.0)
        clearness, sun = self.model.clearness[hours], self.sun[hours]
        return gendaylit_ground(zenith, direct, clearness, sun, reflectance)

    def _relative(self, directions: FloatArray, hours: NDArray[np.int64]) -> FloatArray:
        cosine = np.clip(directions @ self.model.sun[hours].T, -1.0, 1.0)
        return relative_luminance(self.model.coefficients[:, hours], directions[:, 2], cosine)


def series_for_suns(
    sun: ArrayLike,
    direct_normal: ArrayLike,
    diffuse_horizontal: ArrayLike,
    band: str = "visible",
    *,
    day_of_year: ArrayLike,
    dew_point_c: ArrayLike = DEFAULT_DEW_POINT_C,
) -> SkySeries:
    """Perez sky under given suns.

    Args:
        sun: [H, 3] unit vectors to it.
        direct_normal, diffuse_horizontal: [H] irradiances [W/m2].
        day_of_year: [H] or one, for the distance to the sun.
        dew_point_c: [H] or one, for the luminous efficacies.
    """
    if band not in BANDS:
        raise ValueError(f"band: expected one of {BANDS}, got {band!r}")
    towards = np.atleast_2d(np.asarray(sun, dtype=float))
    direct, diffuse = (np.asarray(a, dtype=float) for a in (direct_normal, diffuse_horizontal))
    if towards.shape[1:] != (3,) or {direct.shape, diffuse.shape} != {(len(towards),)}:
        raise ValueError(
            f"suns {towards.shape}, irradiances {direct.shape}, {diffuse.shape}: expected [H, 3], [H], [H]"
        )
    model = perez_sky(direct, diffuse, towards, day_of_year=day_of_year, dew_point_c=dew_point_c)
    dark = direct + diffuse <= DARK
    if band == "visible":
        direct, diffuse = direct * model.direct_efficacy, diffuse * model.diffuse_efficacy
    return SkySeries(towards, model, np.where(dark, 0.0, diffuse), np.where(dark, 0.0, direct))


def sky_series(
    weather: Weather,
    band: str = "visible",
    *,
    sun_model: str = "spa",
    rotation_deg: float = 0.0,
    measured_illuminance: bool = False,
    towards: FloatArray | None = None,
) -> SkySeries:
    """Sun and Perez sky in the middle of each interval; options as for `sky_matrix`.

    Args: towards: `sun_directions` of the weather [H, 3], where they are known.
    """
    if towards is None:
        towards = sun_module.sun_directions(weather, model=sun_model)
    series = series_for_suns(
        sun_module.rotated(towards, rotation_deg),
        weather.direct_normal,
        weather.diffuse_horizontal,
        band,
        day_of_year=weather.midpoints.day_of_year.to_numpy(),
        dew_point_c=_dew_point(weather),
    )
    if band != "visible" or not measured_illuminance:
        return series
    direct, diffuse = weather.direct_normal_illuminance, weather.diffuse_horizontal_illuminance
    if direct is None or diffuse is None:
        raise ValueError(f"the weather of {weather.site} has no illuminance")
    dark = weather.direct_normal + weather.diffuse_horizontal <= DARK
    return replace(series, diffuse_horizontal=np.where(dark, 0.0, diffuse), direct_normal=np.where(dark, 0.0, direct))


def _dew_point(weather: Weather) -> FloatArray:
    """Dew point [H] [deg C], the mean of three hours up to and with each, as gendaymtx takes it."""
    dew = weather.dew_point_c
    if dew is None:
        return np.full(len(weather.times), DEFAULT_DEW_POINT_C)
    span = max(1, round(3 / weather.step_h))
    padded = np.concatenate([np.full(span - 1, dew[0]), dew])
    return np.convolve(padded, np.full(span, 1 / span), mode="valid")


def sky_matrix(
    weather: Weather,
    subdivision: int = 1,
    band: str = "visible",
    parts: str = "all",
    *,
    sun_model: str = "spa",
    sun_patches: int = SUN_PATCHES,
    rotation_deg: float = 0.0,
    ground_reflectance: float | FloatArray | None = None,
    ground: str = "reflected",
    measured_illuminance: bool = False,
    sun_up_only: bool = False,
    hours: ArrayLike | None = None,
    dtype: type = np.float64,
    progress: Progress = silent,
) -> NDArray[np.floating]:
    """Perez sky on Reinhart patches [P, H]: luminance [cd/m2], or radiance [W/m2/sr] if `solar`.

    The illuminance (irradiance) of a plane is the sum over patches of value, solid angle and
    cosine.  Patch 0 is the ground: its reflection of sky and sun, uniform over its hemisphere.

    Args:
        parts: `all`; `sky` without the sun (its light on the ground stays, as in `gendaymtx -s`);
            `sun`: the direct sun alone, no ground (`gendaymtx -d`).  `all` = `sky` + `sun`.
        sun_model: see `mitsuba_cfs.sky.sun`.
        sun_patches: the sun is spread over so many nearest patches (1: only the nearest), weighted
            by 1/(1.002 - cosine of the distance), each share divided by the patch's solid angle.
        rotation_deg: turns sun and sky counter-clockwise seen from above, as `gendaymtx -r`.
        ground_reflectance: one or [H]; the weather's albedo unless given.
        ground: `reflected` or `gendaylit`, see `mitsuba_cfs.sky.matrix`.
        measured_illuminance: use the file's illuminances rather than Perez's efficacies.
        sun_up_only: leave out the time steps where `sun_up` is false.
        hours: only these time steps, by their numbers.

    Raises: `ValueError` for an unknown option, or illuminances that the weather does not have.
    """
    series = sky_series(
        weather, band, sun_model=sun_model, rotation_deg=rotation_deg, measured_illuminance=measured_illuminance
    )
    reflectance = weather.albedo if ground_reflectance is None else ground_reflectance
    chosen = sun_module.is_up(series.sun) if sun_up_only else np.ones(len(series.sun), dtype=bool)
    return series_matrix(
        series,
        np.flatnonzero(chosen) if hours is None else hours,
        subdivision,
        parts,
        sun_patches=sun_patches,
        ground_reflectance=reflectance,
        ground=ground,
        dtype=dtype,
        progress=progress,
    )


def series_matrix(
    series: SkySeries,
    hours: ArrayLike,
    subdivision: int = 1,
    parts: str = "all",
    *,
    sun_patches: int = SUN_PATCHES,
    ground_reflectance: float | FloatArray = DEFAULT_ALBEDO,
    ground: str = "reflected",
    dtype: type = np.float64,
    progress: Progress = silent,
) -> NDArray[np.floating]:
    """Some moments [h] of a series on Reinhart patches [P, h]; options as for `sky_matrix`."""
    if parts not in PARTS:
        raise ValueError(f"parts: expected one of {PARTS}, got {parts!r}")
    sky, hours = ReinhartSky(subdivision), np.asarray(hours, dtype=np.int64)
    reflectance = np.broadcast_to(ground_reflectance, (len(series.sun),))
    lit = np.flatnonzero((series.diffuse_horizontal + series.direct_normal)[hours] > 0)
    result: NDArray[np.floating] = np.zeros((sky.size, len(hours)), dtype=dtype)
    size = max(1, CHUNK_BYTES // (8 * sky.size))
    for start in range(0, 0 if parts == "sun" else len(lit), size):
        columns = lit[start : start + size]
        h = hours[columns]
        result[0, columns] = series.ground(h, reflectance[h], ground)
        result[1:, columns] = series.patches(sky, h)
        progress("sky matrix", (start + len(columns)) / len(lit))
    if parts != "sky":
        h = hours[lit]
        patch, share = sun_on_patches(sky, series.sun[h], series.direct_normal[h], sun_patches)
        result[patch, lit[:, None]] += share
    return result


@cache
def _patch_tree(subdivision: int) -> cKDTree:
    """The patches above the horizon by their directions, for their neighbours."""
    from scipy.spatial import cKDTree  # 0.2 s, where skies are computed

    return cKDTree(ReinhartSky(subdivision).directions[1:])


def sun_on_patches(
    sky: ReinhartSky, sun: FloatArray, direct: FloatArray, count: int = SUN_PATCHES
) -> tuple[NDArray[np.int64], FloatArray]:
    """The `count` patches nearest to the sun [h, count], and the luminance or radiance of each.

    Args: direct: [h] illuminance or irradiance normal to the sun.
    """
    if not 1 <= count < sky.size:
        raise ValueError(f"sun_patches: expected 1 or more, got {count}")
    distance, nearest = _patch_tree(sky.subdivision).query(sun, range(1, count + 1))
    weight = 1.0 / (0.002 + distance**2 / 2.0)  # 1.002 less the cosine, of unit vectors
    weight *= (direct / weight.sum(axis=1))[:, None]
    patch = nearest + 1
    return patch, weight / sky.solid_angles[patch]


def sun_up(weather: Weather, *, sun_model: str = "spa") -> NDArray[np.bool_]:
    """Time steps [H] with any of the sun's disc above the horizon (`gendaymtx -u`)."""
    return sun_module.is_up(sun_module.sun_directions(weather, model=sun_model))


def sun_matrix(
    weather: Weather,
    subdivision: int = 6,
    band: str = "visible",
    *,
    sun_model: str = "spa",
    rotation_deg: float = 0.0,
    measured_illuminance: bool = False,
) -> sparse.csc_array:
    """Sun of each time step [P, H] as the luminance (radiance) of a 0.533 degree disc.

    One entry per sunlit step, at the nearest patch: the disc is at that patch's centre, so a
    direct-sun matrix C_ds traced from discs of unit luminance at the centres times this matrix is
    the sun's part of the five-phase method.  As `gendaymtx -5 0.533 -d -m 6`.
    """
    sky = ReinhartSky(subdivision)
    series = sky_series(
        weather, band, sun_model=sun_model, rotation_deg=rotation_deg, measured_illuminance=measured_illuminance
    )
    hours = np.flatnonzero(series.direct_normal > 0)
    size = max(1, CHUNK_BYTES // (8 * sky.size))
    patch = np.empty(len(hours), dtype=np.int64)
    for start in range(0, len(hours), size):
        part = slice(start, start + size)
        patch[part] = 1 + np.argmax(sky.directions[1:] @ series.sun[hours[part]].T, axis=0)
    luminance = series.direct_normal[hours] / sun_module.SUN_SOLID_ANGLE
    shape = (sky.size, len(weather.times))
    return sparse.csc_array((luminance, (patch, hours)), shape=shape)
