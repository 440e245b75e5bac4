"""An eye outside the room or in its walls is refused by every command that takes a view."""

from __future__ import annotations

import pytest

from scenes import cli
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.bim.small_ifc import box_room

# the room spans x 0 to 4, y 0 to 6, z 0 to 3 m; its walls are 0.3 m thick, its window to the south
OUTSIDE = {
    "300 m away": "-vp 300 3 1.2 -vd 0 -1 0",
    "in the wall": "-vp -0.1 3 1.2 -vd 0 -1 0",
    "on the wall's face": "-vp 0.0 3 1.2 -vd 1 0 0",
    "above the ceiling": "-vp 2 3 3.1 -vd 0 -1 0",
    "under the floor": "-vp 2 3 -0.1 -vd 0 -1 0",
    "in the window's frame": "-vp 0.55 -0.15 1.2 -vd 0 1 0",
}
KINDS = {"fisheye": "-vta -vh 180 -vv 180", "perspective": "-vtv -vh 60 -vv 60"}


@pytest.fixture
def room(tmp_path):
    folder = tmp_path / "model"
    folder.mkdir()
    box_room().write(str(folder / "room.ifc"))
    return folder / "room.ifc"


YEAR = ["dgp", "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND)]


def picture(room, view: str, out) -> int:
    call = [
        "picture",
        str(room),
        "--weather",
        str(WEATHER),
        "--at",
        "06-21 12:00",
        "--size",
        "16",
        "--samples",
        "1",
        "--cfs",
        str(VENETIAN_BLIND),
    ]
    return cli.run([*call, "--view", view, "--out", str(out)])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("place", OUTSIDE)
def test_a_picture_from_outside_the_room_is_refused(room, place, kind, tmp_path, capsys):
    view = f"{KINDS[kind].split()[0]} {OUTSIDE[place]} {' '.join(KINDS[kind].split()[1:])}"
    assert picture(room, view, tmp_path / "a.hdr") == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "is not in the room R1 Room" in said and "x 0.00 to 4.00 m" in said
    assert not (tmp_path / "a.hdr").exists()


def test_a_year_of_glare_from_outside_the_room_is_refused(room, tmp_path, capsys):
    view = f"-vta {OUTSIDE['on the wall' + chr(39) + 's face']} -vh 180 -vv 180"
    assert cli.run([*YEAR, str(room), "--view", view, "--out", str(tmp_path / "out")]) == 1
    assert "is not in the room R1 Room" in capsys.readouterr().err


def test_a_parallel_view_is_refused_instead_of_one_colour(room, tmp_path, capsys):
    assert picture(room, "-vtl -vp 2 3 1.2 -vd 0 -1 0 -vh 2 -vv 2", tmp_path / "a.hdr") == 1
    assert "parallel view (-vtl) is not traced" in capsys.readouterr().err
