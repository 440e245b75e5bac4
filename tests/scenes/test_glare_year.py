"""A year of glare in a room: views, resumption, what a run refuses, and what it writes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.commands.dgp import command
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.room_views import turned
from scenes.year_of_glare.options import YearOptions

INSIDE = "-vta -vp 1.46 3.2 1.2 -vd 0 -1 0 -vh 180 -vv 180"


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory):
    """A cache of matrices of these tests alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CFS_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def year(variant, tmp_path_factory):
    """The demo's office with two directions, and 16 of its hours; the data of the blind alone."""
    from scenes.year_of_glare.year import read_year

    blind = tmp_path_factory.mktemp("blind") / "blind.xml"
    blind.write_bytes(VENETIAN_BLIND.read_bytes())
    options = YearOptions(OFFICE, WEATHER, blind, directions=2, size=64, samples=2, worst=1)
    whole = read_year(options)
    count = len(whole.sky.lit)
    return replace(whole, sky=whole.sky.part(np.arange(5, count, count // 16)[:16]))


def test_views_are_rated_and_written_and_a_second_run_takes_them_up(year, tmp_path, monkeypatch):
    from scenes.year_of_glare import outputs
    from scenes.year_of_glare import year as module

    folder = tmp_path / "out"
    kept = folder / outputs.KEPT
    kept.mkdir(parents=True)
    found = list(module.rate_views(year, kept))
    rows = [outputs.write_view(year, each, folder) for each in found]
    table = outputs.write_summary(year, rows, folder)
    assert len(found) == 2 and len(found[0].ratings) == 16
    towards, away = (each.ratings.dgp.to_numpy() for each in found)
    assert towards.mean() > away.mean() + 0.01  # the window is behind the second
    read = pd.read_parquet(folder / "eye001_1.parquet")
    assert np.array_equal(read.dgp.to_numpy(), towards)
    assert table.hours_of_use.tolist() == [3650, 3650]
    assert {p.suffix for p in folder.iterdir() if p.is_file()} == {".png", ".parquet", ".csv", ".json"}

    def never(*_arguments, **_options):
        raise AssertionError("rated again")

    for rating in ("hourly_glare", "sunny_hour_dgp_error", "glare_with"):
        monkeypatch.setattr(module, rating, never)
    quick = replace(year, options=replace(year.options, worst=0))
    again = list(module.rate_views(quick, kept))
    assert np.array_equal(again[0].ratings.dgp.to_numpy(), towards)
    assert [each.effects for each in again] == [each.effects for each in found]
    assert found[0].effects["hours_both_ways"] == 16
    other = replace(quick, digest="another input")
    with pytest.raises(AssertionError, match="rated again"):
        list(module.rate_views(other, kept))


@pytest.mark.parametrize("metric", ["eDGP", "sDGP"])
def test_simplified_metrics_are_near_dgp_where_a_room_has_no_sun_in_view(year, metric, tmp_path):
    from scenes.year_of_glare.year import rate_views

    options = replace(year.options, metric=metric, worst=0)
    one = replace(year, options=options, views=year.views[:1], digest=metric)
    dgp, found = (
        next(iter(rate_views(y, tmp_path))).ratings
        for y in (replace(one, options=replace(options, metric="DGP"), digest="DGP"), one)
    )
    # the pictures' 4,096 pixels: E_v of picture and sensor within 5 % and 5e-5 DGP/lx of 3,000 lx
    if metric == "eDGP":
        assert found.dgp.to_numpy() == pytest.approx(dgp.dgp.to_numpy(), abs=0.01)
    else:  # 0.184 against 0.159 and sources
        assert found.dgp.to_numpy() == pytest.approx(dgp.dgp.to_numpy(), abs=0.05)
        assert found.Ev.to_numpy() == pytest.approx(dgp.Ev.to_numpy(), rel=0.08)


def test_directions_turn_counter_clockwise():
    assert turned(np.array([1.0, 0, 0]), np.pi / 2) == pytest.approx([0, 1, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("view", "message"),
    [
        ("-vta -vp 40 3 1.2 -vd 0 1 0 -vh 180 -vv 180", "not in the room"),
        ("-vtv -vp 1.46 3.2 1.2 -vd 0 1 0 -vh 60 -vv 60", "expected a fisheye"),
        ("-vta -vp 1.46 3.2 1.2 -vd 0 1 0 -vh 120 -vv 180", "120 x 180 degrees"),
        ("nowhere.vf", "cannot be read"),
    ],
)
def test_views_that_mean_nothing_are_refused(view, message):
    from bim.building_file import chosen_spaces
    from bim.ifc.building import read_ifc
    from scenes.year_of_glare.views import chosen_views

    building = read_ifc(OFFICE)
    space = chosen_spaces(building, (), OFFICE)[0]
    options = YearOptions(OFFICE, WEATHER, VENETIAN_BLIND, size=64)
    assert chosen_views(building, space, replace(options, views=(INSIDE,)))[0].view.width == 64
    with pytest.raises(DataError, match=message):
        chosen_views(building, space, replace(options, views=(view,)))


def test_wrong_words_and_a_strange_folder_end_with_one_line(tmp_path, capsys):
    both = ["--out", str(tmp_path / "a"), "--view", INSIDE, "--grid", "1"]
    assert "not with --grid" in CliRunner().invoke(command, both).output
    hours = ["--out", str(tmp_path / "a"), "--occupied", "8", "8"]
    assert "expected two different hours" in CliRunner().invoke(command, hours).output
    (tmp_path / "letter.txt").write_text("mine")
    assert run(["dgp", "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr().err.strip()
    assert "holds other files" in printed and "\n" not in printed
