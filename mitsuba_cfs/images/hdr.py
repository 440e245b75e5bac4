"""Radiance pictures (.hdr, .pic): reading and writing, with VIEW= and EXPOSURE= as Radiance does.

The pixels of a file are radiance times every EXPOSURE in its header (there may be several); a
reader divides by their product.  Luminance [cd/m2] = 179 (0.265 R + 0.670 G + 0.065 B), or the Y of
an XYZ picture, which is in photometric units.  Header lines that start with a tab belong to the
pictures that this one was made from, and do not apply to this one.

Source: Radiance file format notes and the behaviour of `getinfo`, `pvalue`, `vwrays` (tested).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, write_bytes
from mitsuba_cfs.images import rgbe as codec
from mitsuba_cfs.images.view import View, format_view, view_changes

EFFICACY = 179.0  # [lm/W] Radiance's luminous efficacy of white
# of Radiance's primaries (0.640, 0.330), (0.290, 0.600), (0.150, 0.060), white (0.3333, 0.3333)
LUMINANCE_WEIGHTS = (0.26510582, 0.67010582, 0.06478836)

FORMATS = {"32-bit_rle_rgbe": "rgb", "32-bit_rle_xyze": "xyz"}
MOST_PIXELS = 1 << 28  # of a picture: 16384 x 16384
LARGEST = 1e15  # of a pixel [W/m2/sr] or [cd/m2]: a hundred thousand times the sun
VIEW_PROGRAMS = ("VIEW=", "rpict", "rview", "rvu", "rpiece", "pinterp")


@dataclass(frozen=True, slots=True)
class Picture:
    """A Radiance picture, upright: row 0 is its top, column 0 its left."""

    pixels: NDArray[
        np.float32
    ]  # [ny, nx, 3] radiance [W/m2/sr] (or XYZ [cd/m2]), exposure taken out
    view: View | None  # None where the header has no valid view
    exposure: float  # product of the file's EXPOSURE lines
    header: tuple[str, ...]  # lines of the header
    colours: str = "rgb"  # "rgb" or "xyz"

    @property
    def luminance(self) -> NDArray[np.float64]:
        """Luminance [ny, nx] [cd/m2]."""
        return luminance(self.pixels, self.colours)

    @property
    def misplaced_exposure(self) -> bool:
        """Whether an EXPOSURE entry follows a tab (`pcomb`): the exposure is unknown."""
        return any("EXPOSURE=" in line and "\t" in line for line in self.header)


def luminance(pixels: ArrayLike, colours: str = "rgb") -> NDArray[np.float64]:
    """Luminance [...] [cd/m2] of radiance [..., 3] [W/m2/sr], or of X, Y, Z [..., 3] [cd/m2]."""
    pixels = np.asarray(pixels)
    if colours == "xyz":
        return pixels[..., 1].astype(float)
    return EFFICACY * (pixels @ np.asarray(LUMINANCE_WEIGHTS))


def read_hdr(path: str | PathLike[str]) -> Picture:
    """Picture of a Radiance file in any orientation and encoding, RGB or XYZ.

    Raises:
        DataError: no such file, not a Radiance picture, one that ends too early, is too large, or
            has pixels above `LARGEST`.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise DataError(f"cannot be read ({reason(error)})", file=path) from None
    header, resolution, start = _header(data, path)
    signs, shape, transposed = _orientation(resolution, path)
    if shape[0] * shape[1] > MOST_PIXELS or 4 * shape[0] > len(data) - start:
        message = f"{resolution!r:.60}: more pixels than {len(data)} bytes or this program can hold"
        raise DataError(message, file=path, field="resolution")
    rgbe = np.empty((*shape, 4), dtype=np.uint8)
    lines = codec.decode_scanlines(np.frombuffer(data, dtype=np.uint8)[start:], rgbe)
    if lines < shape[0]:
        raise DataError(
            f"the data ends or is damaged in scanline {lines + 1} of {shape[0]}",
            file=path,
            field="pixels",
        )
    rgbe = rgbe[:: signs[0], :: signs[1]]
    rgbe = np.ascontiguousarray(rgbe.swapaxes(0, 1) if transposed else rgbe)
    exposure, correction = _exposure(header, path)
    pixels = codec.pixels_from_rgbe(rgbe)
    with np.errstate(over="ignore", invalid="ignore"):
        pixels *= (1.0 / (exposure * correction)).astype(np.float32)
    if not pixels.max() <= LARGEST:  # nor NaN: 0 times an infinite exposure
        message = f"holds {pixels.max():g}; expected at most {LARGEST:g}"
        raise DataError(message, file=path, field="pixels")
    view = _view(header, width=rgbe.shape[1], height=rgbe.shape[0])
    return Picture(pixels, view, exposure, header, _colours(header, path))


def _header(data: bytes, path: str | PathLike[str]) -> tuple[tuple[str, ...], str, int]:
    """Header lines, the resolution line, and where the pixels start."""
    if not data.startswith(b"#?"):
        raise DataError("not a Radiance picture: it does not start with #?RADIANCE", file=path)
    end = data.find(b"\n\n")
    newline = data.find(b"\n", end + 2)
    if end < 0 or newline < 0:
        raise DataError("the header has no end (blank line) or no resolution", file=path)
    lines = data[:end].decode("latin-1").splitlines()
    resolution = data[end + 2 : newline].decode("latin-1").strip()
    return tuple(line.rstrip("\r") for line in lines), resolution, newline + 1


def _orientation(
    resolution: str, path: str | PathLike[str]
) -> tuple[tuple[int, int], tuple[int, int], bool]:
    """Steps along lines and pixels that set a picture upright, its stored shape, if X is first."""
    words = resolution.split()
    axes = [word[-1:] for word in words[::2]]
    try:
        shape = int(words[1]), int(words[3])
    except (IndexError, ValueError):
        shape = (0, 0)
    known = sorted(axes) == ["X", "Y"] and all(w in ("+X", "-X", "+Y", "-Y") for w in words[::2])
    if not known or min(shape) < 1:
        raise DataError(
            f"expected a resolution like -Y 800 +X 800, found {resolution!r:.60}",
            file=path,
            field="resolution",
        )
    upright = {"-Y": 1, "+Y": -1, "+X": 1, "-X": -1}
    return (upright[words[0]], upright[words[2]]), shape, axes[0] == "X"


def _exposure(
    header: tuple[str, ...], path: str | PathLike[str]
) -> tuple[float, NDArray[np.float64]]:
    """Product of EXPOSURE= lines, and of COLORCORR= lines [3]."""
    exposure, correction = 1.0, np.ones(3)
    for line in header:
        name, _, value = line.partition("=")
        try:
            if name == "EXPOSURE":
                exposure *= float(value.split()[0])
            elif name == "COLORCORR":
                red, green, blue = map(float, value.split()[:3])
                correction = correction * (red, green, blue)
        except (IndexError, ValueError):
            raise DataError(f"not a number: {value!r:.60}", file=path, field=name) from None
    if not (0 < exposure < np.inf and np.all((correction > 0) & (correction < np.inf))):
        raise DataError(
            f"expected a positive factor, found {exposure:g}", file=path, field="EXPOSURE"
        )
    return exposure, correction


def _view(header: tuple[str, ...], width: int, height: int) -> View | None:
    """View of the header's lines; later lines override earlier ones."""
    changes: dict[str, Any] = {}
    for line in header:
        program = line.split(None, 1)[0].rsplit("/", 1)[-1] if line[:1].strip() else ""
        if program.startswith(VIEW_PROGRAMS):
            changes |= view_changes(line.removeprefix("VIEW="))
    try:
        return View(width=width, height=height, **changes) if changes else None
    except ValueError:
        return None


def _colours(header: tuple[str, ...], path: str | PathLike[str]) -> str:
    formats = [line[7:].strip() for line in header if line.startswith("FORMAT=")]
    if formats and formats[-1] not in FORMATS:
        raise DataError(f"unknown pixel format {formats[-1]!r:.60}", file=path, field="FORMAT")
    return FORMATS[formats[-1]] if formats else "rgb"


def write_hdr(
    path: str | PathLike[str],
    pixels: ArrayLike,
    view: View | None = None,
    *,
    exposure: float = 1.0,
    colours: str = "rgb",
    comments: tuple[str, ...] = (),
) -> None:
    """Write a Radiance picture (run-length coded), whole or not at all.

    Args:
        pixels: luminance [ny, nx] [cd/m2], written as grey; or radiance [ny, nx, 3] [W/m2/sr].
        view: for the VIEW= line.
        exposure: the file holds radiance times this factor; readers divide by it.
        colours: meaning of the three channels, "rgb" or "xyz".
        comments: lines for the header, for example the command that made the picture.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim == 2:
        grey = pixels / EFFICACY
        pixels, colours = np.repeat(grey[..., None], 3, axis=-1), "rgb"
    if pixels.ndim != 3 or pixels.shape[-1] != 3:
        raise ValueError(f"pixels of shape {pixels.shape}: expected [ny, nx] or [ny, nx, 3]")
    if not np.all(np.isfinite(pixels)) or pixels.min(initial=0.0) < 0:
        raise ValueError("a Radiance picture cannot hold negative, infinite or NaN pixels")
    height, width = pixels.shape[:2]
    lines = ["#?RADIANCE", *(line for text in comments for line in text.splitlines())]
    if view is not None:
        if (view.height, view.width) != (height, width):
            view = replace(view, height=height, width=width)
        lines.append("VIEW= " + format_view(view))
    if exposure != 1.0:
        lines.append(f"EXPOSURE={exposure:.9g}")
    written = {name: key for key, name in FORMATS.items()}[colours]
    lines += [f"FORMAT={written}", "", f"-Y {height} +X {width}", ""]
    body = codec.encode_scanlines(codec.rgbe_from_pixels(pixels * exposure))
    write_bytes(path, "\n".join(lines).encode("latin-1", "replace") + body)
