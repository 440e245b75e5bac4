"""Pictures inside a page hold the colours that they were made of."""

from __future__ import annotations

import base64
import io

import numpy as np
import pytest
from PIL import Image

from scenes.figures.picture import png_uri


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("colours", [1, 3, 256, 300])
def test_a_picture_keeps_its_colours(channels, colours):
    random = np.random.default_rng(colours)
    palette = random.integers(0, 256, (colours, channels), dtype=np.uint8)
    shown = palette[random.permutation(np.arange(40 * 30) % colours).reshape(40, 30)]
    content = base64.b64decode(png_uri(shown).removeprefix("data:image/png;base64,"))
    picture = Image.open(io.BytesIO(content))
    assert (picture.mode == "P") == (colours <= 256)
    assert np.array_equal(np.asarray(picture.convert("RGB" if channels == 3 else "RGBA")), shown)
