"""`cfs glare`: the lines of evalglare for the same flags, folders, pictures, and bad input."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from glare_pictures import PICTURES, VIEWS

from mitsuba_cfs.images.hdr import luminance, read_hdr, write_hdr
from scenes.cli import run

FLAGS = [
    "-d",
    "",
    "-D",
    "-V",
    "-d -b 1500 -r 0.1 -Y 20000",
    "-d -t 110 70 0.6 -b 4",
    "-d -T 110 70 0.6",
    "-d -x -q 1",
    "-d -i 2500",
    "-d -C l+ -i 200",
    "-d -G 2",
    "-d -B 0.3",
    "-d -vth -vh 180 -vv 180 -vd 0 1 0.1",
    "-d -I 3000 150 60",
]


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "room.hdr"
    write_hdr(path, PICTURES["sun through blinds"](VIEWS["askew"]), VIEWS["askew"])
    return path


def words(line: str) -> list[str | float]:
    """A printed line taken apart at blanks and commas, numbers as numbers."""
    found: list[str | float] = []
    for word in line.replace(",", " ").split():
        try:
            found.append(float(word))
        except ValueError:
            found.append(word)
    return found


def assert_same_lines(ours: list[str], theirs: list[str]) -> None:
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        a, b = words(one), words(other)
        assert [type(word) for word in a] == [type(word) for word in b], one
        for x, y in zip(a, b, strict=True):
            # six decimals, and evalglare's four-byte numbers (1e-7)
            assert x == y or x == pytest.approx(y, rel=1e-6, abs=2e-6), one


@pytest.mark.peer
@pytest.mark.parametrize("flags", FLAGS)
def test_prints_what_evalglare_prints(flags, picture, radiance_bin, capfd):
    import subprocess

    command = [radiance_bin / "evalglare", *flags.split(), picture]
    theirs = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    assert run(["glare", *flags.split(), str(picture)]) == 0
    assert_same_lines(capfd.readouterr().out.splitlines(), theirs.splitlines())


@pytest.mark.peer
def test_band_and_zones_of_radiances_own_test(real_data, radiance_bin, capfd):
    import subprocess

    path = next((real_data / "hdr").glob("evalglare_testimage*.hdr"))
    flags = "-L 400 500 0.6 1.2 -B 0.4 -b 2500 -d".split()
    command = [radiance_bin / "evalglare", *flags, path]
    theirs = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert run(["glare", *flags, str(path)]) == 0
    ours = capfd.readouterr().out.splitlines()
    assert_same_lines(ours[:2], theirs[:2])  # band and inner zone
    # evalglare prints the number of pixels of the inner zone for the outer one
    assert_same_lines([ours[2].rsplit(" ", 1)[0]], [theirs[2].rsplit(" ", 1)[0]])
    # and adds the illuminance of a cut source to the newest one; the rest of a row is the same
    for one, other in zip(ours[4:-1], theirs[4:-1], strict=True):
        assert_same_lines([" ".join(one.split()[:16])], [" ".join(other.split()[:16])])


@pytest.mark.peer
def test_mask_and_pgsv(picture, tmp_path, radiance_bin, capfd):
    import subprocess

    mask = tmp_path / "mask.hdr"
    inside = np.zeros((VIEWS["askew"].height, VIEWS["askew"].width))
    inside[60:120, 60:150] = 10
    write_hdr(mask, inside, VIEWS["askew"])
    flags = ["-A", str(mask), "-t", "110", "60", "0.5"]
    command = [radiance_bin / "evalglare", *flags, picture]
    theirs = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert run(["glare", *flags, str(picture)]) == 0
    assert_same_lines(capfd.readouterr().out.splitlines()[:1], theirs[:1])


@pytest.mark.peer
@pytest.mark.parametrize("cut", ["1", "2"])
def test_cut_field_of_view_is_evalglares(cut, picture, tmp_path, radiance_bin):
    import subprocess

    ours, theirs = tmp_path / "ours.hdr", tmp_path / "theirs.hdr"
    command = [radiance_bin / "evalglare", "-c", theirs, "-g", cut, picture]
    subprocess.run(command, capture_output=True, check=False)
    assert run(["glare", "-g", cut, "-c", str(ours), str(picture)]) == 0
    a, b = read_hdr(ours).luminance, read_hdr(theirs).luminance
    assert np.array_equal(a > 0, b > 0)


def test_folder_table_and_pictures(picture, tmp_path, capfd):
    other = picture.with_name("dark.hdr")
    write_hdr(other, PICTURES["no source"](VIEWS["ahead"]), VIEWS["ahead"])
    table, drawn, checked = tmp_path / "t.csv", tmp_path / "drawn", tmp_path / "checked"
    arguments = [str(picture.parent), "--csv", str(table), "--png", str(drawn), "-c", str(checked)]
    assert run(["glare", *arguments]) == 0
    out = capfd.readouterr().out.splitlines()
    assert out[0].endswith("dark.hdr: imperceptible") and len(out) == 4
    rows = pd.read_csv(table)
    assert list(rows["class"]) == ["imperceptible", "intolerable"] and rows["sources"][0] == 0
    names = sorted(p.name for p in drawn.glob("*.png"))
    assert names == [
        "dark.png",
        "dark_falsecolour.png",
        "dark_sources.png",
        "room.png",
        "room_falsecolour.png",
        "room_sources.png",
    ]
    check = read_hdr(checked / "room_check.hdr")
    assert check.view == read_hdr(picture).view


def test_check_picture_keeps_every_luminance(picture, tmp_path, capfd):
    check = tmp_path / "check.hdr"
    assert run(["glare", "-c", str(check), "-T", "110", "60", "0.4", str(picture)]) == 0
    before, after = read_hdr(picture), read_hdr(check)
    shown = after.luminance > 0
    # the dim channels of a saturated colour are cut to eight bits of the bright one
    assert np.allclose(after.luminance[shown], before.luminance[shown], rtol=0.08)
    blue = after.pixels[..., 2] > 5 * after.pixels[..., 0]
    assert blue[220 - 60, 110] and luminance(after.pixels).shape == (220, 220)


def rewrite(path, before: bytes, after: bytes) -> str:
    path.write_bytes(path.read_bytes().replace(before, after, 1))
    return str(path)


def test_bad_input_gives_one_clear_line(picture, tmp_path, capfd):
    def line(*arguments: str) -> str:
        code = run(["glare", *arguments])
        captured = capfd.readouterr()
        lines = captured.err.strip().splitlines()
        assert code != 0 and not captured.out and len(lines) == 1, lines
        return lines[0]

    name = str(picture)
    assert "none.hdr" in line(str(tmp_path / "none.hdr"))
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "no .hdr" in line(str(empty))
    assert "-b needs FACTOR" in line("-b", "much", name)
    assert "unknown option -Z" in line("-Z", name)
    assert "lies outside" in line("-t", "500", "10", "0.5", name)
    assert "-vt, -vh and -vv" in line("-vh", "180", name)
    assert "-G 5" in line("-G", "5", name)
    assert "-g needs" in line("-g", "1", name)
    original = picture.read_bytes()
    assert "no valid view" in line(rewrite(picture, b"VIEW= -vta", b"VIEWS -xta"))
    picture.write_bytes(original)
    assert "parallel" in line(rewrite(picture, b"-vta", b"-vtl"))
    picture.write_bytes(original)
    assert "EXPOSURE" in line(rewrite(picture, b"VIEW=", b"\tEXPOSURE=2\nVIEW="))
    picture.write_bytes(original[:-2000])
    assert "scanline" in line(name)


def test_black_corners_under_a_perspective_view(picture, capfd):
    view = VIEWS["ahead"]
    write_hdr(picture, PICTURES["no source"](view) * 0.01, view)
    name = rewrite(picture, b"-vta", b"-vtv")
    name = rewrite(picture, b"-vh 180 -vv 180", b"-vh 100 -vv 100")
    assert run(["glare", name]) == 1
    assert "black corners" in capfd.readouterr().err
    assert run(["glare", "-f", name]) == 0
    assert "perspective" in capfd.readouterr().err


def test_cropped_and_narrow_pictures_are_told(tmp_path, capfd):
    path = tmp_path / "a.hdr"
    view = VIEWS["ahead"]
    write_hdr(path, PICTURES["clear sky"](view)[:100], view)
    assert run(["glare", str(path)]) == 0
    assert "cropped" in capfd.readouterr().err
    write_hdr(path, PICTURES["clear sky"](VIEWS["narrow"]), VIEWS["narrow"])
    assert run(["glare", str(path)]) == 0
    assert "less than 180" in capfd.readouterr().err
    assert run(["glare", "-i", "900", str(path)]) == 0
    assert "less than 180" not in capfd.readouterr().err
