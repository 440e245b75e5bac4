"""Luminance pictures to look at: falsecolour with its scale, tone-mapped, glare sources marked."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize, hsv_to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imsave
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from mitsuba_cfs.files import replacing
from mitsuba_cfs.glare.areas import angles_to
from mitsuba_cfs.glare.evaluation import GlareResult
from mitsuba_cfs.glare.glare_view import in_picture_order
from mitsuba_cfs.images.hdr import EFFICACY, LUMINANCE_WEIGHTS
from scenes.language.catalogue import NARROW_SPACE, decimal, gettext, ngettext
from scenes.language.numbers import rounded, significant

COLOURS = "turbo"
DARKEST, KEY = 1.0, 0.18  # [cd/m2] lower end of the falsecolour scale; middle grey of a print
DPI = 150
TITLE = {"fontsize": 9, "loc": "left", "y": 1.0}  # without y each title's place is looked for


def scale_limits(luminance: NDArray[Any]) -> tuple[float, float]:
    """Round ends [cd/m2] of a logarithmic scale that holds a picture: two to five decades."""
    lit = luminance[np.isfinite(luminance) & (luminance > 0)]
    if not lit.size:
        return DARKEST, 100 * DARKEST
    high = 10.0 ** np.ceil(np.log10(max(np.percentile(lit, 99.9), 10 * DARKEST)))
    low = 10.0 ** np.floor(np.log10(max(np.percentile(lit, 2), high / 1e5)))
    return min(low, high / 100), high


def write_falsecolour(
    path: Path,
    luminance: NDArray[Any],
    *,
    title: str = "",
    limits: tuple[float, float] | None = None,
    logarithmic: bool = True,
    seen: NDArray[np.bool_] | None = None,
) -> None:
    """Write luminance [ny, nx] [cd/m2] as falsecolour with its scale (PNG).

    Args:
        limits: ends of the scale [cd/m2]; without them round numbers that hold the picture.
        seen: [ny, nx] pixels to show; the others stay white.
    """
    low, high = limits or scale_limits(luminance if seen is None else luminance[seen])
    shown = np.maximum(luminance, low) if logarithmic else luminance
    frame = _falsecolour_frame(luminance.shape, low, high, logarithmic)
    frame.write(path, np.ma.masked_array(shown, None if seen is None else ~seen), title)


class _FalsecolourFrame:
    """A figure with a scale, drawn once, and in it the place of a picture and its title."""

    def __init__(self, shape: tuple[int, int], norm: Normalize) -> None:
        self._figure = _figure(shape)
        self._axes = self._figure.add_axes((0.02, 0.02, 0.78, 0.90))
        self._image = self._axes.imshow(np.full(shape, norm.vmin), cmap=COLOURS, norm=norm, interpolation="nearest")
        self._axes.set_axis_off()
        self._draw_scale(logarithmic=isinstance(norm, LogNorm))

    def _draw_scale(self, *, logarithmic: bool) -> None:
        bar = self._figure.colorbar(self._image, cax=self._figure.add_axes((0.83, 0.08, 0.035, 0.78)))
        bar.ax.set_title("cd/m²", **TITLE)
        bar.ax.tick_params(labelsize=8)
        if logarithmic:
            bar.ax.yaxis.set_major_locator(LogLocator(10, subs=(1.0, 3.0), numticks=20))
            bar.minorticks_off()  # a quarter of the time of the picture, without a number beside one
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _mark(value)))
        self._axes.set_visible(False)
        self._canvas = FigureCanvasAgg(self._figure)
        self._canvas.draw()
        self._scale = self._canvas.copy_from_bbox(self._figure.bbox)
        self._axes.set_visible(True)

    def write(self, path: Path, values: NDArray[Any], title: str) -> None:
        """Write the frame with a picture [ny, nx] and a title (PNG)."""
        self._image.set_data(values)
        self._axes.set_title(title, **TITLE)
        self._canvas.restore_region(self._scale)
        self._axes.draw(self._canvas.get_renderer())
        with replacing(path) as part:
            imsave(part, self._canvas.buffer_rgba(), dpi=DPI, format="png")


@lru_cache(maxsize=8)  # the pictures of a run share a few; making one takes as long as drawing it
def _falsecolour_frame(shape: tuple[int, int], low: float, high: float, logarithmic: bool) -> _FalsecolourFrame:
    """The frame of pictures of a shape, with a scale from low to high."""
    return _FalsecolourFrame(shape, (LogNorm if logarithmic else Normalize)(low, high, clip=True))


def tone_mapped(pixels: NDArray[Any], *, white: float | None = None) -> NDArray[np.uint8]:
    """sRGB bytes [ny, nx, 3] of radiance [ny, nx, 3] or luminance [ny, nx].

    The log-average becomes middle grey; what is `white` times brighter (default: the 99.5th
    percentile) and more becomes white.  A colour too bright for the screen is paler, in its hue.

    Source: Reinhard et al. (2002), Photographic tone reproduction, global operator (4).
    """
    luminance = _luminance(pixels)
    curve = _tone_curve(luminance, white)
    mapped = curve(luminance)
    if pixels.ndim == 2:
        linear = np.repeat(mapped[..., None], 3, axis=-1)
    else:
        ratio = np.divide(mapped, luminance, where=luminance > 0, out=np.zeros_like(mapped))
        linear = _shown(EFFICACY * pixels * ratio[..., None], mapped[..., None])
    return _srgb(linear)


def _shown(linear: NDArray[Any], luminance: NDArray[Any]) -> NDArray[Any]:
    """Linear sRGB [ny, nx, 3] of 1 at most, mixed with as much grey of its luminance [ny, nx, 1] as that takes."""
    most = linear.max(axis=-1, keepdims=True)
    share = np.where(most > 1.0, (1.0 - luminance) / np.maximum(most - luminance, 1e-12), 1.0)
    return np.asarray(luminance + share * (linear - luminance))


def _luminance(pixels: NDArray[Any]) -> NDArray[Any]:
    return pixels if pixels.ndim == 2 else EFFICACY * (pixels @ np.asarray(LUMINANCE_WEIGHTS))


def _tone_curve(luminance: NDArray[Any], white: float | None = None) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """What luminance becomes in a print of the picture, 0..1; see `tone_mapped`."""
    lit = luminance[luminance > 0]
    if not lit.size:
        return np.zeros_like
    factor = KEY / np.exp(np.mean(np.log(np.maximum(lit, lit.max() * 1e-9))))
    if white is None:
        white = max(float(np.percentile(factor * luminance, 99.5)), 1.0)

    def curve(values: NDArray[Any]) -> NDArray[Any]:
        scaled = factor * values
        return np.minimum(scaled * (1 + scaled / white**2) / (1 + scaled), 1.0)

    return curve


def _srgb(linear: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of linear light 0..1 in sRGB's transfer curve (IEC 61966-2-1)."""
    linear = np.clip(linear, 0.0, 1.0)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255 * curve + 0.5).astype(np.uint8)


def write_tone_mapped(path: Path, pixels: NDArray[Any], *, scale: bool = False, title: str = "") -> None:
    """Write radiance [ny, nx, 3] or luminance [ny, nx] as a picture for the eye (PNG).

    Args:
        scale: with a bar of greys that tells their luminance, and a title.
    """
    if not scale:
        with replacing(path) as part:
            imsave(part, tone_mapped(pixels))
        return
    luminance = _luminance(pixels)
    low, high = scale_limits(luminance)
    steps = np.geomspace(high, low, 256)
    greys = np.repeat(_tone_curve(luminance)(steps)[:, None, None], 3, axis=2)
    figure = _figure(luminance.shape)
    axes = figure.add_axes((0.02, 0.02, 0.78, 0.90))
    axes.imshow(tone_mapped(pixels), interpolation="nearest")
    axes.set_axis_off()
    axes.set_title(title, **TITLE)
    bar = figure.add_axes((0.83, 0.08, 0.035, 0.78))
    bar.set_title("cd/m²", **TITLE)
    bar.imshow(_srgb(greys), extent=(0, 1, 0, 1), aspect="auto")
    marks = 10.0 ** np.arange(np.log10(low), np.log10(high) + 0.5)
    bar.set_yticks(np.log(marks / low) / np.log(high / low), [_mark(m) for m in marks])
    bar.set_xticks([])
    bar.yaxis.tick_right()
    bar.tick_params(labelsize=8)
    _save(figure, path)


def source_colours(count: int) -> NDArray[np.float64]:
    """Colours [count, 3] of glare sources: neighbours in number are far apart in hue."""
    number = np.arange(count)
    hue = (0.33 + 0.61803399 * number) % 1.0
    paleness = 0.9 - 0.35 * ((number // 5) % 2)
    return hsv_to_rgb(np.stack([hue, paleness, np.ones(count)], axis=-1))


def check_radiance(
    result: GlareResult, uniform: tuple[float, float, float] | None = None, *, show_task: bool = False
) -> NDArray[np.float64]:
    """Radiance [ny, nx, 3] of a check picture: grey, sources coloured, every luminance kept.

    Args:
        uniform: one colour for all sources; without it each has its own.
        show_task: the task area in blue.
    """
    luminance, labels = in_picture_order(result.luminance), result.labels
    colours = source_colours(result.count) if uniform is None else [uniform] * result.count
    palette = np.vstack([np.ones(3), np.asarray(colours, float).reshape(-1, 3), (0, 0, 1)])
    palette /= (palette @ np.asarray(LUMINANCE_WEIGHTS))[:, None]
    if show_task and (task := result.options.task) is not None:
        within = 2 * angles_to(task.x, task.y, result.geometry) <= task.angle
        labels = np.where(in_picture_order(within), len(palette) - 1, labels)
    return luminance[..., None] / EFFICACY * palette[labels]


def write_check_picture(path: Path, result: GlareResult, *, title: str = "") -> None:
    """Write a picture with the glare sources coloured and numbered, and what they amount to."""
    luminance, labels = in_picture_order(result.luminance), result.labels
    grey = tone_mapped(luminance).astype(float) / 255
    palette = np.vstack([np.ones(3), source_colours(result.count)])
    shade = np.where(labels[..., None] > 0, 0.35 + 0.65 * grey, grey)
    shown = shade * palette[labels]
    shown[~in_picture_order(result.geometry.valid)] = 1.0
    figure = _figure(luminance.shape)
    axes = figure.add_axes((0.02, 0.02, 0.78, 0.90))
    axes.imshow(shown, interpolation="nearest")
    axes.set_axis_off()
    axes.set_title(title or f"DGP {rounded(result.dgp, 3)}", **TITLE)
    outline = [withStroke(linewidth=2.5, foreground="white")]
    sources, height = result.sources, result.geometry.view.height
    largest = np.argsort(-(sources.luminance**2) * sources.solid_angle / result.position**2)[:12]
    for i in largest:
        x, y = sources.x[i], height - 1 - sources.y[i]
        axes.text(x, y, str(i + 1), ha="center", va="center", fontsize=8, path_effects=outline)
    _list_sources(figure, result, largest)
    _save(figure, path)


def _list_sources(figure: Figure, result: GlareResult, largest: NDArray[Any]) -> None:
    """The sources beside the picture, the most glaring first."""
    sources, colours = result.sources, source_colours(result.count)
    counted = ngettext("{count} glare source", "{count} glare sources", result.count)
    figure.text(0.81, 0.92, f"E_v {rounded(result.Ev, 0)} lx\n{counted}", fontsize=8, va="top")
    for line, i in enumerate(largest):
        y = 0.83 - 0.062 * line
        figure.text(0.81, y, "■", color=colours[i], fontsize=9)
        luminance, size = rounded(sources.luminance[i], 0), significant(sources.solid_angle[i])
        text = f"{i + 1}  {luminance} cd/m²\n    {size} sr"
        figure.text(0.835, y, text, fontsize=6.5, va="center")
    if result.count > len(largest):
        smaller = gettext("and {rest} smaller", rest=result.count - len(largest))
        figure.text(0.81, 0.05, smaller, fontsize=7)


def _mark(value: float) -> str:
    """A luminance at a scale's mark."""
    return decimal(f"{value:,.6g}".replace(",", NARROW_SPACE))


def _figure(shape: tuple[int, ...]) -> Figure:
    """A figure in the picture's proportions, with room for a title and a scale."""
    height, width = shape[:2]
    size = 6.4 * np.sqrt(np.clip(width / height, 0.25, 4.0))
    figure = Figure(figsize=(size, size * height / width * 0.78 / 0.90), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Figure, path: Path) -> None:
    with replacing(path) as part:
        figure.savefig(part)
