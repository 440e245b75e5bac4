"""Bodies and files that end or hold up a process: checked first, named, left out, the rest read."""

from __future__ import annotations

import os
import signal
import time
import zipfile

import numpy as np
import pytest

import bim.enclosure
import bim.ifc.building
import bim.ifc.head
import bim.ifc.rooms_from_geometry
import bim.ifc.survey
import bim.isolated_solids
from bim.enclosure import rooms_enclosed_by
from bim.ifc.building import read_ifc
from bim.ifc.rooms_from_geometry import first_rooms_enclosed as search
from bim.ifc.survey import _surveyed as survey_one
from bim.isolated_solids import _boundary as boundary
from bim.isolated_solids import _space as space_here
from bim.mesh_repair import closed_faces
from bim.rooms import room_pieces
from bim.solids import solid_of
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.processes import ProcessEnded, answer_apart, each_apart
from tests.bim.small_ifc import HEIGHT, WALL, WIDTH, box_model, box_room
from tests.bim.test_enclosure import box, room
from tests.issues import of_code

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def ends_by_a_signal(tell) -> None:
    tell("7 of 9")
    os.kill(os.getpid(), signal.SIGSEGV)


def works_for_ever(tell) -> None:
    tell("started")
    time.sleep(60)


def adds(a, b, tell) -> int:
    if b is None:
        raise ValueError("no second number")
    return a + b


def number_of_process(tell) -> int:
    return os.getpid()


def dies_of_a_post(elements, attempts, tell):
    """Stands for a library that ends its process on one body: the one that is tall and thin."""
    for index, element in enumerate(elements):
        tell(f"{index} {len(elements)}")
        if np.ptp(element.reshape(-1, 3), axis=0)[:2].max() < 0.2:
            os.kill(os.getpid(), signal.SIGSEGV)
    return search(elements, attempts, tell)


def dies_of_its_name(path):
    if path.name == "bad.ifc":
        os.kill(os.getpid(), signal.SIGKILL)
    return survey_one(path)


def test_process_apart_answers_raises_dies_and_is_stopped():
    assert answer_apart(adds, 1, 2, limit_s=60) == 3
    with pytest.raises(ValueError, match="no second number"):
        answer_apart(adds, 1, None, limit_s=60)
    with pytest.raises(ProcessEnded, match="SIGSEGV") as died:
        answer_apart(ends_by_a_signal, limit_s=60)
    assert died.value.last == "7 of 9"
    with pytest.raises(ProcessEnded, match="not finished after 4 s"):
        answer_apart(works_for_ever, limit_s=4)


def dies_of_three(number):
    if number == 3:
        os.kill(os.getpid(), signal.SIGSEGV)
    return 10 * number


def test_item_that_ends_its_process_costs_no_other_item():
    first, third, last = each_apart(dies_of_three, [1, 3, 5], limit_s=60)
    assert (first, last) == (10, 50)
    assert isinstance(third, ProcessEnded) and "SIGSEGV" in str(third)


def test_process_apart_stays_for_the_next_task():
    assert answer_apart(number_of_process, limit_s=60) == answer_apart(number_of_process, limit_s=60)
    assert answer_apart(number_of_process, limit_s=60) != os.getpid()


def dies_of_a_recess(room, attachments):
    """Stands for a library that ends its process where a window's recess is united with a room."""
    if attachments:
        os.kill(os.getpid(), signal.SIGSEGV)
    return room_pieces(room, attachments)


def boundary_that_dies(item):
    bim.isolated_solids.room_pieces = dies_of_a_recess
    return boundary(item)


def gaps_that_die(item):
    os.kill(os.getpid(), signal.SIGSEGV)


def space_that_dies(body):
    """Of the room that begins at y = 3."""
    if body[..., 1].min() > 2:
        os.kill(os.getpid(), signal.SIGSEGV)
    return space_here(body)


def test_room_whose_booleans_end_the_process_is_named_and_the_others_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.isolated_solids, "_boundary", boundary_that_dies)
    small, _ = box_model(space=False)
    for name, y in (("A", 0.0), ("B", 3.0)):
        small.box("IfcSpace", name, (0.0, y, 0.0), (WIDTH, 3.0, HEIGHT))
    small.box("IfcWall", "between", (0.0, 2.9, 0.0), (WIDTH, 0.2, HEIGHT))
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    assert [space.name for space in building.spaces] == ["B"]
    (named,) = of_code(building, "room-not-closed")
    assert "SIGSEGV" in named.values["reason"]
    assert named.values["room"] == "A" and named.effect.lost == "room"


def test_walls_whose_distance_ends_the_process_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.isolated_solids, "_gaps", gaps_that_die)
    path = tmp_path / "model.ifc"
    box_room().write(str(path))
    building = read_ifc(path)
    assert len(building.spaces) == 1
    assert of_code(building, "wall-distance-not-computed")


def two_spaces(path, **more):
    """A file with two rooms side by side, the second one drawn a little into the first."""
    small, _ = box_model(space=False)
    for name, y, depth in (("A", 0.0, 3.2), ("B", 3.0, 3.0)):
        small.box("IfcSpace", name, (0.0, y, 0.0), (WIDTH, depth, HEIGHT))
    small.model.write(str(path))
    return read_ifc(path, **more)


def test_space_whose_solid_ends_the_process_is_named_and_the_others_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.isolated_solids, "_space", space_that_dies)
    building = two_spaces(tmp_path / "model.ifc")
    assert [space.name for space in building.spaces] == ["A"]
    (named,) = of_code(building, "space-not-computed")
    assert "SIGSEGV" in named.values["reason"]
    assert named.values["room"] == "B" and named.effect.lost == "room"


@pytest.mark.parametrize(
    ("function", "code", "values"),
    [
        ("_solid", "body-not-computed", {"element": "IfcWall south"}),
        ("_shared", "overlap-not-computed", {"room": "A"}),
        ("_united", "rooms-not-joined", {"rooms": ("A", "B")}),
    ],
)
def test_boolean_that_ends_the_process_is_named(tmp_path, monkeypatch, function, code, values):
    monkeypatch.setattr(bim.isolated_solids, function, gaps_that_die)
    building = two_spaces(tmp_path / "model.ifc", join=["A + B"])
    (named, *_) = (i for i in of_code(building, code) if values.items() <= i.values.items())
    assert "SIGSEGV" in named.values["reason"]
    assert building.spaces


def test_wall_whose_opening_ends_the_process_is_left_out_and_named(tmp_path, monkeypatch):
    path = tmp_path / "model.ifc"
    small, _ = box_model()
    small.box("IfcWall", "before", (-1.0, -WALL - 0.3, 0.0), (6.0, 0.2, 3.0))
    small.model.write(str(path))
    assert of_code(read_ifc(path), "element-cut-open")
    monkeypatch.setattr(bim.isolated_solids, "_opened", gaps_that_die)
    (named,) = of_code(read_ifc(path), "element-not-cut-open")
    assert named.values["reason"].startswith("a library ended its process by signal SIGSEGV")


@pytest.mark.parametrize(("error", "left_out"), [(RoomError, True), (ValueError, False)])
def test_only_a_room_error_leaves_a_room_out(tmp_path, monkeypatch, error, left_out):
    def fails(*arguments):
        raise error("planted")

    monkeypatch.setattr(bim.ifc.building, "faces_and_windows", fails)
    path = tmp_path / "model.ifc"
    box_room().write(str(path))
    if left_out:
        assert read_ifc(path).spaces == ()
    else:
        with pytest.raises(ValueError, match="planted"):
            read_ifc(path)


def without_number(corners):
    corners[3, 2] = np.nan


def a_thousand_kilometres_long(corners):
    corners[3, 2] = 1e6


@pytest.mark.parametrize("fault", [without_number, a_thousand_kilometres_long])
def test_vertices_of_no_building_are_handed_to_no_library(fault):
    corners = CORNERS.copy()
    fault(corners)
    assert closed_faces(corners, FACES) is None
    assert solid_of(corners[FACES]) is None


@pytest.mark.parametrize(
    "faces",
    [FACES[:3], [*FACES[:3], [0, 3, 9]], [*FACES, [0, 1, 1]], [*FACES[:3], [0, 2, 3]], FACES[:0]],
    ids=["open", "no such corner", "collapsed", "turned", "none"],
)
def test_faces_that_bound_no_solid_are_handed_to_no_library(faces):
    assert closed_faces(CORNERS, np.reshape(faces, (-1, 3))) is None


@pytest.mark.parametrize("more", [FACES[:2], np.concatenate([FACES[:1], FACES[:1, ::-1]])])
def test_faces_drawn_again_count_once(more):
    faces = closed_faces(CORNERS, np.concatenate([FACES, more]))
    assert sorted(map(tuple, faces)) == sorted(map(tuple, FACES))
    again = np.concatenate([CORNERS[FACES], CORNERS[more]])
    assert solid_of(again).volume == pytest.approx(1 / 6)


def test_element_that_ends_the_search_is_named_and_the_rest_gives_the_room(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.ifc.rooms_from_geometry, "first_rooms_enclosed", dies_of_a_post)
    path = tmp_path / "model.ifc"
    box_room(space=False, post=True).write(str(path))
    building = read_ifc(path)
    (space,) = building.spaces
    assert len(space.windows) == 1
    (named,) = of_code(building, "element-not-in-room-search")
    assert "post" in named.values["element"] and "SIGSEGV" in named.values["reason"]


def test_search_that_takes_too_long_is_stopped_and_named(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.ifc.rooms_from_geometry, "LIMIT_S", 0.0)  # no search is as fast
    path = tmp_path / "model.ifc"
    box_room(space=False).write(str(path))
    building = read_ifc(path)
    assert building.spaces == ()
    (named,) = of_code(building, "room-search-failed")
    assert "not finished after" in named.values["reason"] and named.effect.lost == "room"


def test_more_work_than_the_budget_is_left_undone_and_counted(monkeypatch):
    bent = [*room(), np.concatenate([box((5, 0, 0), (1, 0.1, 1)), box((5, 1, 0), (1, 0.1, 1))])]
    assert rooms_enclosed_by(bent).not_widened == 0
    monkeypatch.setattr(bim.enclosure, "MOST_WIDENED", 20)
    found = rooms_enclosed_by(bent)
    assert (found.not_widened, len(found.rooms)) == (1, 1)
    monkeypatch.setattr(bim.enclosure, "LARGEST_VOID", 11)
    assert rooms_enclosed_by(bent).not_extended == 1


def test_survey_goes_on_after_a_worker_that_died(tmp_path, monkeypatch):
    monkeypatch.setattr(bim.ifc.survey, "_surveyed", dies_of_its_name)
    for name in ("bad.ifc", "good.ifc"):
        box_room(window=False).write(str(tmp_path / name))
    bad, good = bim.ifc.survey.survey([tmp_path / "bad.ifc", tmp_path / "good.ifc"])
    assert "its process was ended" in bad.refused and bad.rooms == 0
    assert (good.refused, good.rooms) == ("", 1)


def test_zipped_model_that_would_unpack_to_gigabytes_is_refused_before(tmp_path, monkeypatch):
    inner, path = tmp_path / "model.ifc", tmp_path / "model.ifczip"
    box_room().write(str(inner))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(inner, "model.ifc")
    assert len(read_ifc(path).spaces) == 1
    monkeypatch.setattr(bim.ifc.head, "LARGEST", inner.stat().st_size - 1)
    monkeypatch.setattr(zipfile.ZipFile, "open", None)
    with pytest.raises(DataError, match=r"model\.ifczip: unpacks to .* GB, more than"):
        read_ifc(path)
