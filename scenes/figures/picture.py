"""Arrays of colours as pictures inside the page: data URIs."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def png_uri(rgba: NDArray[np.uint8]) -> str:
    """Colours [ny, nx, 3 or 4] as a PNG data URI, at most 256 colours kept exactly."""
    if rgba.shape[-1] == 3:
        packed = rgba.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)
        colours, index = np.unique(packed, return_inverse=True)
    if rgba.shape[-1] == 3 and len(colours) <= 256:
        picture = Image.fromarray(index.reshape(rgba.shape[:2]).astype(np.uint8))
        palette = colours[:, None] >> np.array([16, 8, 0], dtype=np.uint32) & 255
        picture.putpalette(palette.astype(np.uint8).tobytes())
    else:
        picture = Image.fromarray(np.ascontiguousarray(rgba))
    return _uri(picture, "png", optimize=True)


def photo_uri(rgb: NDArray[np.uint8], quality: int = 88) -> str:
    """Colours [ny, nx, 3] as a JPEG data URI, for pictures with noise."""
    return _uri(Image.fromarray(np.ascontiguousarray(rgb)), "jpeg", quality=quality)


def _uri(picture: Image.Image, kind: str, **options: object) -> str:
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return bytes_uri(stream.getvalue(), f"image/{kind}")


def bytes_uri(content: bytes, kind: str) -> str:
    """Bytes of a media type as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def reduced(values: NDArray[Any], factor: int) -> NDArray[Any]:
    """Means over blocks of `factor` x `factor` pixels of [ny, nx, ...]; a ragged edge is cut."""
    if factor <= 1:
        return values
    ny, nx = (n // factor for n in values.shape[:2])
    cut = values[: ny * factor, : nx * factor]
    return cut.reshape(ny, factor, nx, factor, *values.shape[2:]).mean(axis=(1, 3))
