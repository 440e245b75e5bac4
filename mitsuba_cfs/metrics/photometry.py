"""Luminous intensity of luminaires from IES LM-63 (.ies) and EULUMDAT (.ldt) files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

FloatArray = NDArray[np.float64]
TYPE_C = 1  # of LM-63: vertical angle from nadir, horizontal angle around the vertical
# EULUMDAT's Isym: planes that the file holds, of M in all, and how the others follow
SYMMETRIES = {0: "none", 1: "axis", 2: "C0-C180", 3: "C90-C270", 4: "both"}
HEAD_LINES = 26  # of EULUMDAT before its sets of lamps
BRIGHTEST = 1e9  # of an intensity [cd] and a power [W]: a lighthouse has 1e6 to 1e7 cd
AFTER_LAMPS = 10  # ratios of direct light by room index


@dataclass(frozen=True, slots=True)
class Photometry:
    """Type C photometry of a luminaire: intensity by direction, light and power."""

    name: str
    gamma_deg: FloatArray  # [V] from straight down, 0 to 180
    c_deg: FloatArray  # [C] around the vertical, from C0 (+x) anticlockwise; 0 to 360, both included
    candela: FloatArray  # [C, V]
    watts: float  # of lamps and gear; 0: not stated

    @property
    def lumens(self) -> float:
        """Light of the luminaire: the integral of its intensity [lm]."""
        down = np.radians(self.gamma_deg)
        ring = np.trapezoid(self.candela, np.radians(self.c_deg), axis=0)
        fine = np.linspace(down[0], down[-1], 20 * len(down))
        return float(np.trapezoid(np.interp(fine, down, ring) * np.sin(fine), fine))

    def intensity(self, directions: ArrayLike) -> FloatArray:
        """Intensity [...] [cd] towards directions [..., 3] in its frame: x at C0, z up.

        Linear between the angles of the file; 0 beyond those that it holds.
        """
        from scipy.interpolate import RegularGridInterpolator  # 0.2 s, for rooms with luminaires only

        d = np.asarray(directions, dtype=float)
        gamma = np.degrees(np.arccos(np.clip(-d[..., 2], -1.0, 1.0)))
        around = np.degrees(np.arctan2(d[..., 1], d[..., 0])) % 360.0
        between = RegularGridInterpolator(
            (self.c_deg, self.gamma_deg), self.candela, bounds_error=False, fill_value=0.0
        )
        values: FloatArray = between(np.stack([around, gamma], axis=-1))
        return values.reshape(gamma.shape)


def read_photometry(path: Path) -> Photometry:
    """The photometry of an .ies or .ldt file.

    Raises: `DataError` for another file, and for what is not read: LM-63's types A and B, tilted
        lamps of a file of their own, EULUMDAT of a format that is none.
    """
    try:
        text = path.read_text("latin-1")
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    kind = path.suffix.lower()
    if kind not in (".ies", ".ldt"):
        raise DataError("expected a luminaire as .ies or .ldt", file=path)
    return _lm63(text, path) if kind == ".ies" else _eulumdat(text, path)


def _number(text: str, path: Path) -> float:
    """A finite number.

    Raises: `DataError`.
    """
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise DataError(f"{text[:40]!r} is no number", file=path)
    return value


def _count(value: float, what: str, path: Path) -> int:
    """A number of `what`, from 1 to 10,000.

    Raises: `DataError`.
    """
    if not 1 <= value <= 10_000 or value != int(value):
        raise DataError(f"{value:g} {what}: expected a whole number from 1", file=path)
    return int(value)


def _lm63(text: str, path: Path) -> Photometry:
    """IES LM-63-1986 to -2002."""
    lines = text.splitlines()
    row = next((n for n, line in enumerate(lines) if line.strip().startswith("TILT=")), None)
    if row is None:
        raise DataError("has no line TILT=", file=path)
    name = next((line.partition("]")[2].strip() for line in lines[:row] if line.startswith("[LUMINAIRE]")), path.stem)
    words = [word for line in lines[row + 1 :] for word in line.replace(",", " ").split()]
    numbers = [_number(word, path) for word in words]
    tilt = lines[row].strip()[5:].strip().upper()
    if tilt == "INCLUDE" and len(numbers) > 1:
        numbers = numbers[2 + 2 * _count(numbers[1], "angles of tilt", path) :]
    elif tilt != "NONE":
        raise DataError(f"TILT={tilt}: factors of another file are not read", file=path)
    if len(numbers) < 13:
        raise DataError("ends before its angles", file=path)
    multiplier = numbers[2]
    vertical = _count(numbers[3], "vertical angles", path)
    horizontal = _count(numbers[4], "horizontal angles", path)
    if numbers[5] != TYPE_C:
        kind = {2: "type B", 3: "type A"}.get(int(numbers[5]), "an unknown type")
        raise DataError(f"photometry of {kind}: only type C is read", file=path)
    factor, watts = multiplier * numbers[10] * numbers[11], numbers[12]
    angles = numbers[13:]
    gamma = np.array(angles[:vertical])
    c = np.array(angles[vertical : vertical + horizontal])
    values = np.array(angles[vertical + horizontal :][: vertical * horizontal])
    if len(values) != vertical * horizontal:
        raise DataError(f"expected {vertical * horizontal} intensities", file=path)
    return _around(name, gamma, c, factor * values.reshape(horizontal, vertical), watts, path)


def _around(name: str, gamma: FloatArray, c: FloatArray, candela: FloatArray, watts: float, path: Path) -> Photometry:
    """The photometry with planes all around, of those from 0 to 0, 90, 180 or 360 degrees."""
    last = c[-1]
    if len(c) == 1:
        c, candela = np.array([0.0, 360.0]), np.repeat(candela, 2, axis=0)
    elif c[0] == 90.0 and last == 270.0:  # C270 to C90 are their mirror image
        c, candela = _ring(np.concatenate([c, 540.0 - c]), np.concatenate([candela, candela]))
    else:
        if last not in (90.0, 180.0, 360.0) or c[0] != 0.0:
            raise DataError(f"planes from {c[0]:g} to {last:g} degrees are no symmetry", file=path)
        while c[-1] < 360.0:
            c = np.concatenate([c, 2 * c[-1] - c[::-1][1:]])
            candela = np.concatenate([candela, candela[::-1][1:]])
    rising = np.all(np.diff(gamma) > 0) and np.all(np.diff(c) > 0)
    if not rising or not (candela >= 0).all():
        raise DataError("angles do not rise, or an intensity is negative", file=path)
    if candela.max() > BRIGHTEST or not 0 <= watts <= BRIGHTEST:
        raise DataError(f"expected an intensity and a power from 0 to {BRIGHTEST:g} cd and W", file=path)
    return Photometry(name, gamma, c, candela, watts)


def _ring(c: FloatArray, candela: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Planes in the order of their angles, each once, from 0 to 360 degrees."""
    angles, first = np.unique(np.round(c % 360.0, 6), return_index=True)
    return np.append(angles, 360.0), candela[[*first, first[0]]]


def _eulumdat(text: str, path: Path) -> Photometry:
    """EULUMDAT: candela per 1000 lm of the lamps, times these."""
    lines = [line.strip() for line in text.splitlines()]

    def number(row: int) -> float:
        if row >= len(lines):
            raise DataError(f"ends before line {row + 1}", file=path)
        return _number(lines[row], path)

    symmetry, step, sets = number(2), number(4), number(25)
    if symmetry not in SYMMETRIES:
        raise DataError(f"symmetry {symmetry:g}: expected 0 to 4", file=path)
    planes, angles = _count(number(3), "planes", path), _count(number(5), "angles", path)
    if sets != 1:
        raise DataError(f"{sets:g} sets of lamps: one is read", file=path)
    lumens, watts = abs(number(HEAD_LINES + 2)), number(HEAD_LINES + 5)
    first = HEAD_LINES + 6 + AFTER_LAMPS
    c = np.array([number(first + n) for n in range(planes)])
    gamma = np.array([number(first + planes + n) for n in range(angles)])
    held = {0: planes, 1: 1, 2: planes // 2 + 1, 3: planes // 2 + 1, 4: planes // 4 + 1}
    count = held[int(symmetry)]
    start = first + planes + angles
    values = np.array([number(start + n) for n in range(count * angles)]).reshape(count, angles)
    values = values * number(23) * lumens / 1000.0
    name = lines[8] or path.stem
    if int(symmetry) == 1:
        return _around(name, gamma, np.zeros(1), values, watts, path)
    if int(symmetry) == 3:  # from C270 over C0 to C90
        turned = np.arange(count) * step - 90.0
        both = np.concatenate([values, values])
        ring, both = _ring(np.concatenate([turned, 180.0 - turned]), both)
        return _around(name, gamma, ring, both, watts, path)
    if int(symmetry) == 0:
        return _around(name, gamma, np.append(c, 360.0), np.append(values, values[:1], axis=0), watts, path)
    return _around(name, gamma, c[:count], values, watts, path)
