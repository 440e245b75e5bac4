"""Radiance pictures (.hdr, .pic): reading and writing, with VIEW= and EXPOSURE= as Radiance does.

The pixels of a file are radiance times every EXPOSURE in its header (there may be several); a
reader divides by their product.  Luminance [cd/m2] = 179 (0.265 R + 0.670 G + 0.065 B), or the Y of
an XYZ picture, which is in photometric units.  Header lines that start with a tab belong to the
pictures that this one was made from, and do not apply to this one.

A pixel is (r, g, b, e): value = (m + 1/2) 2^(e - 136), or 0 where e = 0.  A scanline is stored
flat, in the old code (1, 1, 1, n repeats the last pixel), or, for widths of 8 to 32767, in the new:
2, 2, width high, width low, then each of the four planes as runs (128 + n, byte) and literals.

Sources: G. Ward, "Real Pixels", Graphics Gems II (1991); Radiance file format notes and the
behaviour of `getinfo`, `pvalue`, `vwrays` (tested).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.compiled import compiled
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, write_bytes
from mitsuba_cfs.images.view import View, format_view, view_changes

SHORTEST, LONGEST = 8, 32767  # widths that the new run-length code can hold


def pixels_from_rgbe(rgbe: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Values [..., 3] of four-byte pixels [..., 4]."""
    scale = np.ldexp(np.float32(1.0), np.arange(256) - 136).astype(np.float32)
    scale[0] = 0.0
    values = rgbe[..., :3].astype(np.float32)
    values += np.float32(0.5)
    values *= scale[rgbe[..., 3]][..., None]
    return values


def rgbe_from_pixels(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """Four-byte pixels [..., 4] of values [..., 3], cut off so that reading back has no bias."""
    pixels = np.asarray(pixels, dtype=np.float64)
    largest = pixels.max(axis=-1)
    lit = largest > 1e-32
    mantissa, exponent = np.frexp(np.where(lit, largest, 1.0))
    scale = np.where(lit, mantissa * 256.0 / np.where(lit, largest, 1.0), 0.0)
    rgbe = np.empty((*pixels.shape[:-1], 4), dtype=np.uint8)
    rgbe[..., :3] = np.minimum(pixels * scale[..., None], 255.0)
    rgbe[..., 3] = np.where(lit, exponent + 128, 0)
    return rgbe


@compiled(nogil=True)
def decode_scanlines(data: NDArray[np.uint8], rgbe: NDArray[np.uint8]) -> int:
    """Fill rgbe [lines, width, 4] from the bytes `data`; the number of whole lines that it held."""
    lines, width = rgbe.shape[0], rgbe.shape[1]
    at, size = 0, data.shape[0]
    for line in range(lines):
        if at + 4 > size:
            return line
        new = SHORTEST <= width <= LONGEST and data[at] == 2 and data[at + 1] == 2 and data[at + 2] < 128
        if new:
            if (data[at + 2] << 8 | data[at + 3]) != width:
                return line
            at = _decode_planes(data, at + 4, rgbe[line])
        else:
            at = _decode_old(data, at, rgbe[line])
        if at < 0:
            return line
    return lines


@compiled(nogil=True)
def _decode_planes(data: NDArray[np.uint8], at: int, scanline: NDArray[np.uint8]) -> int:
    """Read the four planes of one line; the place after them, or -1 where the data ends or lies."""
    width, size = scanline.shape[0], data.shape[0]
    for plane in range(4):
        column = 0
        while column < width:
            if at + 1 >= size:
                return -1
            count = int(data[at])
            at += 1
            run = count > 128
            if run:
                count -= 128
            if count == 0 or column + count > width or at + (1 if run else count) > size:
                return -1
            for step in range(count):
                scanline[column + step, plane] = data[at if run else at + step]
            at += 1 if run else count
            column += count
    return at


@compiled(nogil=True)
def _decode_old(data: NDArray[np.uint8], at: int, scanline: NDArray[np.uint8]) -> int:
    """Read one flat or old-coded line; the place after it, or -1 where the data ends or lies."""
    width, size = scanline.shape[0], data.shape[0]
    column, shift = 0, 0
    while column < width:
        if at + 4 > size:
            return -1
        repeat = data[at] == 1 and data[at + 1] == 1 and data[at + 2] == 1
        if repeat:
            count = int(data[at + 3]) << shift
            if column == 0 or column + count > width or shift > 24:
                return -1
            for step in range(count):
                scanline[column + step] = scanline[column - 1]
            column += count
            shift += 8
        else:
            scanline[column] = data[at : at + 4]
            column += 1
            shift = 0
        at += 4
    return at


@compiled(nogil=True)
def _encode(rgbe: NDArray[np.uint8], out: NDArray[np.uint8]) -> int:
    """Write the lines of rgbe [lines, width, 4] into `out` in the new code; the bytes used."""
    lines, width = rgbe.shape[0], rgbe.shape[1]
    at = 0
    for line in range(lines):
        out[at], out[at + 1], out[at + 2], out[at + 3] = 2, 2, width >> 8, width & 255
        at += 4
        for plane in range(4):
            column = 0
            while column < width:
                start, run = column, 0
                while start < width:  # find the next run of four or more equal bytes
                    run = 1
                    while (
                        start + run < width and run < 127 and rgbe[line, start + run, plane] == rgbe[line, start, plane]
                    ):
                        run += 1
                    if run >= 4:
                        break
                    start += run
                    run = 0
                while column < start:
                    count = min(start - column, 128)
                    out[at] = count
                    for step in range(count):
                        out[at + 1 + step] = rgbe[line, column + step, plane]
                    at += 1 + count
                    column += count
                if run >= 4:
                    out[at], out[at + 1] = 128 + run, rgbe[line, start, plane]
                    at += 2
                    column += run
    return at


def encode_scanlines(rgbe: NDArray[np.uint8]) -> bytes:
    """The bytes of rgbe [lines, width, 4]: run-length coded where the width allows, else flat."""
    rgbe = np.ascontiguousarray(rgbe)
    lines, width, _ = rgbe.shape
    if not SHORTEST <= width <= LONGEST:
        return rgbe.tobytes()
    out = np.empty(lines * (4 + 4 * (width + width // 64 + 2)), dtype=np.uint8)
    return out[: _encode(rgbe, out)].tobytes()


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

    pixels: NDArray[np.float32]  # [ny, nx, 3] radiance [W/m2/sr] (or XYZ [cd/m2]), exposure taken out
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
    lines = decode_scanlines(np.frombuffer(data, dtype=np.uint8)[start:], rgbe)
    if lines < shape[0]:
        raise DataError(f"the data ends or is damaged in scanline {lines + 1} of {shape[0]}", file=path, field="pixels")
    rgbe = rgbe[:: signs[0], :: signs[1]]
    rgbe = np.ascontiguousarray(rgbe.swapaxes(0, 1) if transposed else rgbe)
    exposure, correction = _exposure(header, path)
    pixels = pixels_from_rgbe(rgbe)
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


def _orientation(resolution: str, path: str | PathLike[str]) -> tuple[tuple[int, int], tuple[int, int], bool]:
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
            f"expected a resolution like -Y 800 +X 800, found {resolution!r:.60}", file=path, field="resolution"
        )
    upright = {"-Y": 1, "+Y": -1, "+X": 1, "-X": -1}
    return (upright[words[0]], upright[words[2]]), shape, axes[0] == "X"


def _exposure(header: tuple[str, ...], path: str | PathLike[str]) -> tuple[float, NDArray[np.float64]]:
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
        raise DataError(f"expected a positive factor, found {exposure:g}", file=path, field="EXPOSURE")
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
    body = encode_scanlines(rgbe_from_pixels(pixels * exposure))
    write_bytes(path, "\n".join(lines).encode("latin-1", "replace") + body)
