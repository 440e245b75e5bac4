"""Panes by wavelength: files of Optics and of the IGSDB, stacks of panes, band averages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.en410 import solar_value, visible_value
from mitsuba_cfs.bsdf.glazing import BRONZE_SHAPE, CLEAR_ABOVE, CLEAR_SHAPE
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import pane_shares

FloatArray = NDArray[np.float64]
EMISSIVITY = 0.84  # of glass, where a file states none
SPECTRA = ("EN 410", "ASTM G173 direct", "ASTM G173 global")  # of the sun


@dataclass(frozen=True, slots=True)
class SpectralPane:
    """A pane at normal incidence by wavelength; front is outdoors."""

    name: str
    wavelength_nm: FloatArray  # [N] rising
    transmittance: FloatArray  # [N]
    reflectance_front: FloatArray  # [N]
    reflectance_back: FloatArray  # [N]
    thickness: float  # [m]
    conductivity: float = 1.0  # [W/(m K)]
    emissivity: tuple[float, float] = (EMISSIVITY, EMISSIVITY)
    infrared_transmittance: float = 0.0
    coated: bool = False

    def turned(self) -> SpectralPane:
        """The pane the other way round."""
        return SpectralPane(
            self.name, self.wavelength_nm, self.transmittance, self.reflectance_back,
            self.reflectance_front, self.thickness, self.conductivity, self.emissivity[::-1],
            self.infrared_transmittance, self.coated,
        )  # fmt: skip


def read_spectral_pane(path: str | PathLike[str]) -> SpectralPane:
    """The pane of an Optics (IGDB) text file or of an IGSDB product's JSON file.

    Raises: `DataError` that names the file and what is missing.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror}", file=path) from None
    if text.lstrip().startswith("{") and '"' in text.lstrip()[:40]:
        return _igsdb_pane(text, path)
    return _optics_pane(text, path)


def _igsdb_pane(text: str, path: Path) -> SpectralPane:
    """The pane of an IGSDB product."""
    try:
        product = json.loads(text)
        if product["measured_data"]["thickness"] is None and product.get("composition"):
            raise DataError("is a shade or a product of parts, not a pane", file=path)
        measured, rows = product["measured_data"], product["spectral_data"]["spectral_data"]
        table = np.array([[row["wavelength"], row["T"], row["Rf"], row["Rb"]] for row in rows])
        sides = [measured[f"emissivity_{side}"] for side in ("front", "back")]
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise DataError(f"is no IGSDB product with spectral data ({error})", file=path) from None
    return _pane(
        table, path, name=product.get("name") or path.stem, millimetres=measured["thickness"],
        conductivity=measured.get("conductivity"), emissivity=sides,
        infrared=measured.get("tir_front"),
        coated=str(product.get("coated_side") or "Neither").lower() not in ("neither", "n/a", "na"),
    )  # fmt: skip


_HEADER = re.compile(r"^\{(?P<content>.*)\}(?P<value>.*)$")


def _optics_pane(text: str, path: Path) -> SpectralPane:
    """The pane of an Optics text file: headers in braces, then wavelength, T, Rf, Rb."""
    headers, rows = {}, []
    for line in text.splitlines():
        header = _HEADER.match(line.strip())
        if header:
            key, _, value = header["content"].partition(":")
            headers[key.strip().lower()] = (value.strip() or header["value"]).strip()
        elif line.strip():
            try:
                rows.append([float(word) for word in line.split()[:4]])
            except ValueError:
                raise DataError(f"is no spectral row: {line.strip()[:40]!r}", file=path) from None
    if not rows or {len(row) for row in rows} != {4}:
        raise DataError("expected rows of wavelength, T, Rf, Rb", file=path)
    if "nano" in headers.get("units, wavelength units", "").lower():
        rows = [[row[0] / 1000.0, *row[1:]] for row in rows]
    numbers = re.findall(r"[\d.]+", headers.get("emissivity, front back", ""))
    coated = headers.get("coated side", "neither").lower() not in ("neither", "n/a", "")
    return _pane(
        np.array(rows), path, name=headers.get("product name") or path.stem,
        millimetres=_number(headers.get("thickness")), emissivity=[float(n) for n in numbers[:2]],
        conductivity=_number(headers.get("conductivity")), coated=coated,
        infrared=_number(headers.get("ir transmittance", "").partition("=")[2]),
    )  # fmt: skip


def _number(text: str | None) -> float | None:
    try:
        return float(text or "")
    except ValueError:
        return None


def _pane(
    table: FloatArray,
    path: Path,
    *,
    name: str,
    millimetres: float | None,
    conductivity: float | None,
    emissivity: Sequence[float | None],
    infrared: float | None,
    coated: bool,
) -> SpectralPane:
    """The pane of a table [N, 4] of wavelengths [um] and shares."""
    if not millimetres:
        raise DataError("states no thickness", file=path)
    table = table[np.argsort(table[:, 0], kind="stable")]
    if np.any(np.diff(table[:, 0]) <= 0):
        raise DataError("names a wavelength twice", file=path)
    worst = float(np.max(table[:, 1] + table[:, 2:].max(axis=1)))
    if table[:, 1:].min() < -1e-3 or worst > 1.02:
        raise DataError(f"T + R reaches {worst:.3f}: expected shares of 1", file=path)
    front, back = [*(e or EMISSIVITY for e in emissivity), EMISSIVITY, EMISSIVITY][:2]
    return SpectralPane(
        name, np.round(1000.0 * table[:, 0], 3), *np.clip(table[:, 1:], 0.0, 1.0).T,
        millimetres / 1000.0, conductivity or 1.0, (front, back), infrared or 0.0, coated,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class BandValues:
    """A glazing in one band, per angle of incidence [A]."""

    transmittance: FloatArray  # [A]
    reflectance_front: FloatArray  # [A]
    reflectance_back: FloatArray  # [A]
    absorptance: FloatArray  # [A, n] of each pane, for light from outside


def spectral_glazing(
    panes: Sequence[SpectralPane],
    theta: ArrayLike = 0.0,
    *,
    spectrum: str | FloatArray = SPECTRA[0],
) -> Mapping[str, BandValues]:
    """Panes from outside to inside as one glazing in "Solar" and "Visible", by wavelength.

    Every wavelength goes through all panes and back before it is averaged: a coated pane behind a
    clear one meets other light than the sun's.

    Args: theta: angles of incidence [A] [rad]; spectrum: of the sun, of `SPECTRA` or as rows of
        wavelength [nm] and irradiance [M, 2]; visible is always D65 and V(lambda).

    Source: EN 410:2011, 5.2 and 5.3; angles as `glazing.pane_values`.
    """
    angles = np.atleast_1d(np.asarray(theta, dtype=float))
    nm = np.unique(np.concatenate([pane.wavelength_nm for pane in panes]))
    nm = nm[(nm >= 280.0) & (nm <= 4100.0)]
    stacked = _stack([_at_angles(pane, nm, angles) for pane in panes])
    found = {}
    for band in ("Solar", "Visible"):
        average = visible_average if band == "Visible" else solar_average(spectrum)
        tau, front, back, absorbed = (_averaged(nm, values, average) for values in stacked)
        found[band] = BandValues(tau, front, back, absorbed)
    return found


def visible_average(nm: FloatArray, value: FloatArray) -> float:
    """Mean of spectral data [N] by D65 and V(lambda)."""
    return visible_value(nm, value)


Average = Callable[[FloatArray, FloatArray], float]


def solar_average(spectrum: str | FloatArray) -> Average:
    """What averages spectral data [N] over the sun: EN 410's shares or a spectrum by trapezoids."""
    if isinstance(spectrum, str) and spectrum == "EN 410":
        return solar_value
    if isinstance(spectrum, str) and spectrum not in SPECTRA:
        raise ValueError(f"spectrum {spectrum!r} is not of {', '.join(SPECTRA)}")
    nm, sun = _g173(spectrum.split()[-1]) if isinstance(spectrum, str) else spectrum.T

    def average(given: FloatArray, value: FloatArray) -> float:
        return float(np.trapezoid(np.interp(nm, given, value) * sun, nm) / np.trapezoid(sun, nm))

    return average


@cache
def _g173(kind: str) -> tuple[FloatArray, FloatArray]:
    """Wavelengths [nm] from 300 to 2500 and irradiance of ASTM G173-03, air mass 1.5."""
    from pvlib.spectrum import get_reference_spectra

    table = get_reference_spectra(standard="ASTM G173-03").loc[300.0:2500.0]
    return table.index.to_numpy(dtype=float), table[kind].to_numpy(dtype=float)


def _averaged(nm: FloatArray, values: FloatArray, average: Average) -> FloatArray:
    """Averages [A, ...] of values [N, A, ...]."""
    flat = values.reshape(len(nm), -1)
    return np.array([average(nm, column) for column in flat.T]).reshape(values.shape[1:])


def _at_angles(pane: SpectralPane, nm: FloatArray, theta: FloatArray) -> tuple[FloatArray, ...]:
    """Transmittance, front and back reflectance [N, A] of a pane."""
    tau, front, back = (
        np.interp(nm, pane.wavelength_nm, values)[:, None]
        for values in (pane.transmittance, pane.reflectance_front, pane.reflectance_back)
    )
    if pane.coated:
        sunlit = solar_value(pane.wavelength_nm, pane.transmittance)
        shape = CLEAR_SHAPE if sunlit > CLEAR_ABOVE else BRONZE_SHAPE
        return _coated((tau, front, back), theta, shape)
    return _uncoated(tau, 0.5 * (front + back), theta)


def _coated(
    values: tuple[FloatArray, ...], theta: FloatArray, shape: tuple[tuple[float, ...], ...]
) -> tuple[FloatArray, ...]:
    """Values of clear or bronze glass by angle, scaled; the normal's are kept as measured."""
    tau, front, back = values
    cosine = np.cos(theta)[None, :]
    t = np.clip(np.polynomial.polynomial.polyval(cosine, shape[0]), 0.0, 1.0)
    r = np.clip(np.polynomial.polynomial.polyval(cosine, shape[1]) - t, 0.0, 1.0)
    t, r = np.where(theta == 0.0, 1.0, t), np.where(theta == 0.0, 0.0, r)
    passed = tau * t
    return passed, *(np.minimum(rho * (1 - r) + r, 1 - passed) for rho in (front, back))


def _uncoated(tau: FloatArray, rho: FloatArray, theta: FloatArray) -> tuple[FloatArray, ...]:
    """Fresnel for both polarisations, index and absorption from tau and rho at the normal."""
    beta = tau**2 - rho**2 + 2 * rho + 1
    surface = (beta - np.sqrt(beta**2 - 4 * (2 - rho) * rho)) / (2 * (2 - rho))
    root = np.sqrt(np.clip(surface, 1e-9, 0.9))
    index = (1 + root) / (1 - root)
    inner = np.where(rho > 1e-6, (rho - surface) / np.maximum(surface * tau, 1e-12), tau)
    cosine = np.cos(np.minimum(theta, np.radians(89.999)))[None, :]
    tau, rho = pane_shares(cosine, index, np.clip(inner, 1e-9, 1.0))
    return tau, rho, rho


def _stack(panes: Sequence[tuple[FloatArray, ...]]) -> tuple[FloatArray, ...]:
    """tau, rho_front, rho_back [N, A] and absorptances [N, A, n] of panes one behind the other."""
    tau, front, back = panes[0]
    absorbed, from_inside = [1 - tau - front], [1 - tau - back]
    for t, f, b in panes[1:]:
        bounce = 1 / (1 - back * f)
        absorbed = [a + tau * bounce * f * i for a, i in zip(absorbed, from_inside, strict=True)]
        absorbed.append(tau * bounce * (1 - t - f))
        returned = t * bounce
        from_inside = [i * returned for i in from_inside]
        from_inside.append(1 - t - b + returned * back * (1 - t - f))
        front = front + tau * tau * bounce * f
        tau, back = tau * bounce * t, b + returned * back * t
    return tau, front, back, np.stack(absorbed, axis=-1)
