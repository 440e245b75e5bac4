"""Arrays of colours as pictures inside the page: data URIs."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def png_uri(rgba: NDArray[np.uint8]) -> str:
    """Colours [ny, nx, 3 or 4] as a PNG data URI, at most 256 colours as numbers of a palette."""
    channels = rgba.shape[-1]
    packed = np.zeros((*rgba.shape[:2], 4), dtype=np.uint8)
    packed[..., :channels] = rgba
    colours, index = np.unique(packed.view(np.uint32), return_inverse=True)
    if len(colours) > 256:
        return _uri(Image.fromarray(np.ascontiguousarray(rgba)), "png", optimize=True)
    picture = Image.fromarray(index.reshape(rgba.shape[:2]).astype(np.uint8))
    palette = colours.view(np.uint8).reshape(-1, 4)
    picture.putpalette(palette[:, :3].tobytes())
    alpha = {"transparency": palette[:, 3].tobytes()} if channels == 4 else {}
    return _uri(picture, "png", optimize=True, **alpha)


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
