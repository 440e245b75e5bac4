"""Glare of pictures: closed forms, what does not depend on how it is asked, and bad pictures."""

from __future__ import annotations

import numpy as np
import pytest
from glare_pictures import AHEAD, PICTURES, VIEWS, disc, room, window

from mitsuba_cfs.glare.areas import Zones
from mitsuba_cfs.glare.evaluation import GlareOptions, Task, evaluate
from mitsuba_cfs.glare.glare_view import GlareView, in_picture_order, in_scan_order
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View, parse_view


def test_a_uniform_picture():
    result = evaluate(np.full((220, 220), 100.0), AHEAD)
    # the rim of the fisheye cuts through pixels: 2e-4 of the hemisphere
    assert result.Ev == pytest.approx(100 * np.pi, rel=5e-4)
    assert result.mean_luminance == pytest.approx(100, rel=1e-6)
    assert result.background_luminance == pytest.approx(100, rel=5e-4)
    assert result.count == 0 and result.ugr == 0 and result.vcp == 100
    assert result.dgp == pytest.approx(5.87e-5 * result.Ev + 0.159, abs=1e-12)
    assert result.sdgp == pytest.approx(6.22e-5 * result.Ev + 0.184, abs=1e-12)


def test_one_disc_by_hand():
    radius, towards = 0.1, np.array([0.3, 1.0, 0.2])
    result = evaluate(disc(AHEAD, np.full((220, 220), 100.0), towards, radius, 1e4), AHEAD)
    towards /= np.linalg.norm(towards)
    omega = 2 * np.pi * (1 - np.cos(radius))
    assert result.count == 1
    # pixels of 0.0143 rad: the border of the disc is off by parts of a pixel
    assert result.sources.solid_angle[0] == pytest.approx(omega, rel=0.03)
    assert result.sources.luminance[0] == pytest.approx(1e4, rel=1e-6)
    # the direction is that of the pixel that holds the centre: off by a pixel's diagonal at most
    assert result.direction[0] @ towards > np.cos(0.0143 * np.sqrt(2))
    assert result.sigma[0] == pytest.approx(np.arccos(towards[1]), abs=0.0143 * np.sqrt(2))
    assert result.Ev_direct == pytest.approx(1e4 * omega * towards[1], rel=0.03)
    assert result.labels.shape == (220, 220)
    rows, columns = np.nonzero(result.labels)
    assert rows.mean() < 110 < columns.mean()  # up and to the right, in picture order


def test_sources_within_the_search_radius_are_one():
    def count(angle: float, **changes) -> int:
        picture = np.full((220, 220), 50.0)
        for x in (0.0, np.tan(angle)):
            picture = disc(AHEAD, picture, (x, 1, 0), 0.03, 8000)
        return evaluate(picture, AHEAD, **changes).count

    assert count(0.12) == 1  # gap of 0.06 rad, less than half of 0.2
    assert count(0.20) == 2
    assert count(0.20, search_radius=0.4) == 1
    assert count(0.12, search_radius=0.05) == 2


def test_a_precomputed_view_gives_the_same():
    geometry = GlareView(VIEWS["askew"])
    picture = PICTURES["sun through blinds"](VIEWS["askew"])
    once, again = evaluate(picture, VIEWS["askew"]), evaluate(picture, geometry)
    assert once.dgp == again.dgp and once.ugr == again.ugr
    assert evaluate(picture, geometry).dgp == once.dgp  # and nothing is kept from one to the next


def test_world_turned_with_the_view_changes_nothing():
    turned = View("angular", (0, 0, 0), (1, 0, 0), (0, 0, 1), 180, 180, 220, 220)
    picture = window(AHEAD, room(AHEAD), 6000)
    assert evaluate(picture, turned).dgp == pytest.approx(evaluate(picture, AHEAD).dgp, rel=1e-9)


def test_brighter_is_not_less_glaring():
    geometry = GlareView(AHEAD)
    picture = window(AHEAD, room(AHEAD), 4000)
    dgp = [evaluate(picture * factor, geometry).dgp for factor in (0.25, 0.5, 1, 1.5, 2)]
    assert np.all(np.diff(dgp) > 0)


def test_edgp_is_dgp_where_everything_is_direct():
    picture = PICTURES["sun in view"](AHEAD) * 0.2
    whole = evaluate(picture, AHEAD)
    direct = np.where(whole.labels > 0, picture, 0.0)
    found = evaluate(direct, AHEAD, illuminance=whole.Ev)
    assert found.dgp == pytest.approx(whole.dgp, rel=1e-9)


def test_orders_of_a_picture_are_inverse():
    picture = np.arange(12).reshape(3, 4)
    assert np.array_equal(in_picture_order(in_scan_order(picture)), picture)
    assert in_scan_order(picture)[0, 0] == picture[-1, 0]


@pytest.mark.parametrize("value", [np.nan, -1.0, np.inf])
def test_impossible_pixels_are_counted(value):
    picture = np.full((220, 220), 100.0)
    picture[3, 4:6] = value
    with pytest.raises(ValueError, match="2 negative, infinite or NaN"):
        evaluate(picture, AHEAD)


def test_wrong_calls():
    with pytest.raises(ValueError, match="shape"):
        evaluate(np.ones((10, 10)), AHEAD)
    with pytest.raises(ValueError, match="parallel"):
        GlareView(View("parallel", horizontal_deg=3, vertical_deg=3))
    with pytest.raises(ValueError, match="lies outside"):
        evaluate(np.ones((220, 220)), AHEAD, task=Task(220, 3, 0.5))
    for wrong in ({"background": "other"}, {"search_radius": 0}, {"illuminance": -1.0}):
        with pytest.raises(ValueError, match="expected"):
            GlareOptions(**wrong)
    with pytest.raises(ValueError, match="field_of_view"):
        evaluate(np.ones((220, 220)), AHEAD, field_of_view="one eye")


def test_solid_angles_of_a_lifted_view_are_where_the_pixels_are():
    """evalglare takes those of the picture turned upside down: 0.029 sr here."""
    view = parse_view("-vta -vh 120 -vv 120 -vd 0 1 0 -vl 0.25 -vs 0.1", 200, 160)
    picture = disc(view, room(view), (0.2, 1, -0.4), 0.1, 9000)
    omega = evaluate(picture, view).sources.solid_angle
    assert omega == pytest.approx(2 * np.pi * (1 - np.cos(0.1)), rel=0.03)  # cut into pixels


def test_each_bright_pixel_is_a_source_by_raytools_sum():
    picture = disc(AHEAD, np.full((220, 220), 100.0), (0.3, 1.0, 0.2), 0.1, 1e4)
    picture = disc(AHEAD, picture, (0.3, 1.0, 0.2), 0.05, 4e4)
    one, each = (evaluate(picture, AHEAD, grouping=name) for name in ("evalglare", "pixels"))
    geometry = GlareView(AHEAD)
    L, omega, P = in_scan_order(picture), geometry.solid_angle, geometry.guth
    bright = (L > 2000) & geometry.valid
    expected = float((L**2 * omega / P**2)[bright].sum())
    assert each.contrast == pytest.approx(expected, rel=1e-6)
    assert each.count == np.count_nonzero(bright) and one.count == 1
    # the mean of two luminances, squared, is less than the mean of their squares
    assert one.contrast < 0.8 * each.contrast
    assert one.Ev == each.Ev and one.Ev_direct == pytest.approx(each.Ev_direct, rel=1e-12)
    assert "evalglare" in one.options.rule and "raytools" in each.options.rule


def test_the_disc_counts_where_it_is_seen_and_bright():
    towards = np.array([0.3, 1.0, 0.2]) / np.linalg.norm([0.3, 1.0, 0.2])
    picture = np.full((220, 220), 100.0)
    dim, bright = (SunDisc(towards, L, 6e-5) for L in (1500.0, 1e6))
    bare = evaluate(picture, AHEAD)
    rated = evaluate(picture, AHEAD, discs=(dim,))
    assert rated.count == 0 and rated.discs == ()
    assert rated.Ev - bare.Ev == pytest.approx(1500 * 6e-5 * towards[1], rel=1e-6)
    for grouping in ("evalglare", "pixels"):
        rated = evaluate(picture, AHEAD, discs=(bright,), grouping=grouping)
        assert rated.count == 1 and rated.largest_luminance == 1e6
        assert rated.Ev_direct == pytest.approx(1e6 * 6e-5 * towards[1], rel=1e-9)
        assert rated.background_luminance == pytest.approx(bare.background_luminance, rel=1e-9)
        row, column = (int(i[0]) for i in np.nonzero(rated.labels))
        assert row < 110 < column
    # 80 degrees to the side: outside the 51 that both eyes see
    aside = SunDisc(np.array([np.sin(1.4), np.cos(1.4), 0]), 1e6, 6e-5)
    assert evaluate(picture, AHEAD, discs=(aside,), field_of_view="both eyes").count == 0
    assert evaluate(picture, AHEAD, discs=(aside,)).count == 1


def test_rules_that_are_none_are_refused():
    for wrong in ({"grouping": "heaps"}, {"sun": "moon"}):
        with pytest.raises(ValueError, match="expected"):
            GlareOptions(**wrong)
    with pytest.raises(ValueError, match="zones"):
        GlareOptions(grouping="pixels", zones=Zones(1, 1, 0.1))
