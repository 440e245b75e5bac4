"""`cfs picture`: the demo's office in every format, other views, and what cannot be."""

from __future__ import annotations

import re

import numpy as np
import pytest

from mitsuba_cfs.images.hdr import read_hdr
from mitsuba_cfs.images.view import fitted, parse_view
from mitsuba_cfs.sky.epw import read_epw, write_wea
from scenes import cli
from scenes.demo import WEATHER
from tests.conftest import REPOSITORY

OFFICE = REPOSITORY / "docs/tutorials/office.rad"
pytestmark = pytest.mark.usefixtures("variant")


def test_one_picture_in_every_format(tmp_path, capsys):
    from tests.images.exr_reader import read_exr

    files = [tmp_path / f"desk{suffix}" for suffix in (".hdr", ".exr", ".png")]
    outs = [word for file in files for word in ("--out", str(file))]
    call = ["picture", "--at", "03-15 13:30", "--size", "48", "--samples", "2"]
    assert cli.run([*call, *outs]) == 0
    assert "48 x 48 pixels, Ev" in capsys.readouterr().out
    picture = read_hdr(files[0])
    exact, view = read_exr(files[1])
    # a view's line keeps nine digits, a pixel eight bits
    assert picture.view.position == pytest.approx(view.position, abs=1e-6)
    assert picture.luminance == pytest.approx(exact, rel=0.01, abs=0.01 * float(np.median(exact)))
    assert exact.max() > 500 and files[2].stat().st_size > 10_000


def test_a_colour_picture_has_three_bands_and_the_same_luminance(tmp_path):
    from mitsuba_cfs.images.hdr import luminance
    from tests.images.exr_reader import read_exr

    call = ["picture", "--at", "06-21 12:30", "--size", "32", "--samples", "4"]
    grey, colour = tmp_path / "grey.exr", tmp_path / "colour.exr"
    assert cli.run([*call, "--out", str(grey)]) == 0
    picture = ["--out", str(tmp_path / "colour.png")]
    assert cli.run([*call, "--colour", "--out", str(colour), *picture]) == 0
    pixels = read_exr(colour)[0]
    assert pixels.shape == (32, 32, 3)
    assert luminance(pixels) == pytest.approx(read_exr(grey)[0], rel=1e-4)
    lit = pixels[pixels[..., 1] > 0]
    assert np.ptp(lit[:, 2] / lit[:, 0]) > 0.2, "sky and sunlit ground have one colour"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--at", "13-40 12:00", "--out", "a.hdr"], "expected month, day and hour"),
        (["--at", "03-15 12:00", "--out", "a.jpg"], "expected one of .hdr"),
        (["--at", "03-15 12:00", "--out", "none/a.hdr"], "no such folder"),
        (["--at", "03-15 12:00", "--out", "a.hdr", "--view", "none.vf"], "cannot be read"),
        (["--at", "03-15 12:00", "--out", "a.hdr", "--view", "-vta -vh 400"], "illegal size"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["picture", *words]) != 0
    said = capsys.readouterr().err.strip()
    assert message in said and "\n" not in said
    assert not list(tmp_path.iterdir())


def test_light_needs_a_wea_and_heat_an_epw(tmp_path, capsys):
    epw, wea = read_epw(WEATHER), tmp_path / "city.wea"
    write_wea(epw, wea)
    call = ["picture", "--at", "06-21 12:30", "--size", "32", "--samples", "4", "--weather"]
    shown = {}
    for file in (str(wea), str(WEATHER)):
        assert cli.run([*call, file, "--out", str(tmp_path / "a.png")]) == 0
        shown[file] = capsys.readouterr().out
    assert "city.wea states no dew point: that of Radiance's programs, 11.0" in shown[str(wea)]
    values = [float(re.search(r"Ev ([\d,]+) lx", text)[1].replace(",", "")) for text in shown.values()]
    assert values[0] == pytest.approx(values[1], rel=0.05) and values[0] != values[1]
    run = ["run", "--weather", str(wea), "--out", str(tmp_path / "out"), str(OFFICE)]
    assert cli.run(run) != 0
    assert "city.wea: is a WEA file, which has no temperatures" in capsys.readouterr().err


def test_pixels_of_a_view_are_square():
    wide = fitted(parse_view("-vtv -vp 0 0 1 -vd 0 1 0 -vh 90 -vv 53.1301"), 400)
    assert (wide.width, wide.height) == (400, 200)
    tall = fitted(parse_view("-vta -vp 0 0 1 -vd 0 1 0 -vh 90 -vv 180"), 400)
    assert (tall.width, tall.height) == (200, 400)
