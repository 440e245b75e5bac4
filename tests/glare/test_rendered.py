"""Glare of 50 pictures rendered by Radiance against evalglare: the issue's own limits."""

from __future__ import annotations

import pytest
from rendered_rooms import CASES, Renderer
from test_against_evalglare import assert_agree

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.hdr import read_hdr

pytestmark = [pytest.mark.peer, pytest.mark.slow]
SIZE = 240


@pytest.fixture(scope="module")
def renderer(radiance_bin, tmp_path_factory) -> Renderer:
    return Renderer(radiance_bin, tmp_path_factory.mktemp("rooms"))


@pytest.mark.parametrize(("scene", "view"), CASES)
def test_rendered_room(scene, view, renderer, evalglare):
    path = renderer.picture(scene, view, SIZE)
    picture = read_hdr(path)
    assert_agree(evaluate(picture.luminance, picture.view), evalglare(path))
