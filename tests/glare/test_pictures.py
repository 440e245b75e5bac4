"""Pictures to look at: their scale, their tone mapping, their colours."""

from __future__ import annotations

import numpy as np
import pytest
from glare_pictures import AHEAD, PICTURES
from matplotlib.image import imread

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import in_picture_order
from mitsuba_cfs.images.hdr import luminance
from scenes import pictures


def test_scale_ends_are_round_and_hold_the_picture():
    values = np.geomspace(40, 7000, 10000).reshape(100, 100)
    assert pictures.scale_limits(values) == (10.0, 10000.0)
    assert pictures.scale_limits(np.zeros((3, 3))) == (1.0, 100.0)
    low, high = pictures.scale_limits(np.full((9, 9), 500.0))
    assert low <= 500 <= high and high / low >= 100


def test_tone_mapping_keeps_order_and_hue():
    grey = pictures.tone_mapped(np.geomspace(1, 1e5, 256).reshape(16, 16))
    assert grey.shape == (16, 16, 3) and np.all(np.diff(grey[..., 0].ravel().astype(int)) >= 0)
    assert grey.max() == 255 and grey.min() < 30
    red = pictures.tone_mapped(np.array([[[2.0, 0.5, 0.5], [0.5, 0.5, 0.5]]]))
    assert red[0, 0, 0] > red[0, 0, 1] and len(set(red[0, 1].tolist())) == 1
    assert not pictures.tone_mapped(np.zeros((2, 2))).any()


def test_a_bright_blue_is_paler_and_does_not_turn_cyan():
    blue = np.array([0.4, 0.7, 2.0])
    red, green, top = (pictures.tone_mapped(np.array([[blue, 0.01 * blue, 3 * blue]] * 3))[0, 0] / 255.0) ** 2.2
    # grey is mixed in: what the channels have more than the least keeps its proportion
    assert (green - red) / (top - red) == pytest.approx(0.3 / 1.6, abs=0.03) and top == pytest.approx(1.0, abs=0.01)


def test_falsecolour_shows_one_colour_for_one_luminance(tmp_path):
    path = tmp_path / "a.png"
    halves = np.where(np.arange(100)[:, None] < 50, 30.0, 3000.0) * np.ones((100, 100))
    pictures.write_falsecolour(path, halves, title="halves", limits=(10, 10000))
    shown = imread(path)
    top, bottom = (shown[int(f * len(shown)), shown.shape[1] // 3, :3] for f in (0.3, 0.7))
    assert top[2] > top[0] and bottom[0] > bottom[2]  # blue is dark, red is bright


def test_check_picture_colours_what_glares(tmp_path):
    result = evaluate(PICTURES["sun through blinds"](AHEAD), AHEAD)
    radiance = pictures.check_radiance(result)
    coloured = np.ptp(radiance, axis=-1) > 1e-9 * radiance.max(axis=-1)
    assert np.array_equal(coloured, result.labels > 0)
    assert np.allclose(luminance(radiance), in_picture_order(result.luminance), rtol=1e-12)
    pictures.write_check_picture(tmp_path / "a.png", result)
    assert imread(tmp_path / "a.png").shape[2] == 4
    one = pictures.check_radiance(result, (1.0, 0.0, 0.0))
    assert np.all(one[result.labels > 0][:, 1:] == 0)


def test_colours_of_neighbours_differ():
    colours = pictures.source_colours(12)
    distance = np.linalg.norm(colours[1:] - colours[:-1], axis=1)
    assert distance.min() > 0.4


def test_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(DataError, match="cannot be written"):
        pictures.write_tone_mapped(tmp_path / "none" / "a.png", np.ones((3, 3)))
