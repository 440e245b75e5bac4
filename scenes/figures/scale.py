"""Colour scales and ticks: what a number is worth on an axis or as a colour."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray

from bim.colours import linear_of_display, luminance
from scenes.language.catalogue import decimal

GRADIENT_STOPS = 16
STEPS = 256  # of a map of colours
EQUAL_CONTRAST = 0.05 * (21**0.5 - 1)  # luminance on which black and white contrast alike


@cache
def _table(colours: str) -> NDArray[np.uint8]:
    """Colours [STEPS, 4] of a map; matplotlib makes it anew at every call, in a millisecond."""
    return colormaps[colours](np.arange(STEPS), bytes=True)


@dataclass(frozen=True, slots=True)
class Tick:
    """One mark of an axis: where it stands and what it says (the rest is left out on phones)."""

    at: float  # [%] of the axis
    label: str
    rest: str = ""
    line: bool = True


@dataclass(frozen=True, slots=True)
class ColourScale:
    """Numbers from `low` to `high` as colours of a perceptually even map, clipped beyond."""

    low: float
    high: float
    label: str
    unit: str
    logarithmic: bool = False
    colours: str = "viridis"  # viridis and cividis are even in lightness and safe for colour vision

    def __post_init__(self) -> None:
        if not self.high > self.low or (self.logarithmic and self.low <= 0):
            raise ValueError(f"colour scale {self.label}: from {self.low} to {self.high}")

    def fraction(self, values: ArrayLike) -> NDArray[np.float64]:
        """Place of the values on the scale, 0..1; NaN stays NaN."""
        values = np.asarray(values, dtype=float)
        low, high = self.low, self.high
        if self.logarithmic:
            values = np.log(np.maximum(values, low))
            low, high = np.log(low), np.log(high)
        return np.clip((values - low) / (high - low), 0.0, 1.0)

    def rgba(self, values: ArrayLike) -> NDArray[np.uint8]:
        """Colours [..., 4]; NaN is transparent."""
        fraction = np.asarray(self.fraction(values))
        steps = np.minimum((np.nan_to_num(fraction) * STEPS).astype(int), STEPS - 1)
        colours = _table(self.colours)[steps]
        colours[..., 3] = np.where(np.isnan(fraction), 0, 255)
        return colours

    def hex(self, value: float) -> str:
        """The colour of one value for CSS and SVG."""
        red, green, blue, alpha = self.rgba([value])[0]
        return f"#{red:02x}{green:02x}{blue:02x}" if alpha else "none"

    def ink(self, value: float) -> str:
        """Black or white, whichever contrasts more with the value's colour: at least 4.58 to 1."""
        return "#000" if relative_luminance(self.rgba([value])[0]) > EQUAL_CONTRAST else "#fff"

    @property
    def gradient(self) -> str:
        """The scale as a CSS gradient, low to high."""
        stops = colormaps[self.colours](np.linspace(0, 1, GRADIENT_STOPS), bytes=True)[:, :3]
        return "linear-gradient(90deg," + ",".join(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in stops) + ")"

    @property
    def ticks(self) -> tuple[Tick, ...]:
        """Round numbers along the scale."""
        if self.logarithmic:
            values = log_values(self.low, self.high)
        else:
            values = round_values(self.low, self.high, 5)
        at = 100 * self.fraction(values)
        return tuple(Tick(float(a), plain(v)) for a, v in zip(at, values, strict=True))


def relative_luminance(colour: ArrayLike) -> float:
    """Relative luminance 0..1 of an sRGB colour [3 or 4] of bytes (WCAG 2.2)."""
    return luminance(linear_of_display((np.asarray(colour, dtype=float)[:3] / 255.0).tolist()))


def round_values(low: float, high: float, count: int = 6) -> NDArray[np.float64]:
    """About `count` multiples of 1, 2 or 5 times a power of ten from `low` to `high`."""
    span = high - low
    if not span > 0:
        return np.array([low])
    raw = span / max(count, 1)
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * min((1, 2, 5, 10), key=lambda factor: abs(np.log(factor * power / raw)))
    first = np.ceil(low / step - 1e-9)
    last = np.floor(high / step + 1e-9)
    return np.arange(first, last + 1) * step + 0.0  # no negative zero


def _tidy(value: float) -> float:
    """The number without the noise of its last digits."""
    return float(f"{value:.12g}")


def log_values(low: float, high: float) -> NDArray[np.float64]:
    """Of 1, 3, 10, 30, 100, ... those from `low` to `high`; tens only over many decades."""
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    factors = (1, 3) if np.log10(high / low) <= 3.1 else (1,)
    values = np.sort(np.array([f * 10.0**d for d in decades for f in factors]))
    return values[(values >= low * 0.999) & (values <= high * 1.001)]


def plain(value: float) -> str:
    """A tick's number: no exponent, no needless zeros, thousands set apart."""
    text = f"{value:,.10g}" if abs(value) < 1e10 else f"{value:g}"
    return decimal(("−" + text[1:] if text.startswith("-") else text).replace(",", "\u202f"))


def axis_ticks(low: float, high: float, count: int = 6) -> tuple[Tick, ...]:
    """Round ticks of a linear axis."""
    values = round_values(low, high, count)
    at = 100 * (values - low) / (high - low)
    return tuple(Tick(float(a), plain(round(v, 10))) for a, v in zip(at, values, strict=True))


def round_limits(values: ArrayLike, count: int = 6, *, margin: float = 0.0) -> tuple[float, float]:
    """Limits of an axis that hold all finite values, at round numbers."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()) - margin, float(finite.max()) + margin
    if high - low < 1e-9:
        low, high = low - 0.5, high + 0.5
    for _ in range(4):  # wider limits may ask for a wider step
        steps = round_values(low, high, count)
        step = steps[1] - steps[0] if len(steps) > 1 else high - low
        low = _tidy(np.floor(low / step + 1e-9) * step)
        high = _tidy(np.ceil(high / step - 1e-9) * step)
    return low, high
