"""`cfs run --inner-glass`: a room without windows behind a glazed partition, from its IFC file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bim import read_ifc
from bim.model import Building
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system
from scenes.room.inner_glass import inner_glass, lit_neighbours
from scenes.room.windows import in_all_windows
from tests.bim.small_ifc import DEPTH, FRAME, HEIGHT, WIDTH, box_model

MIDDLE, THICK = 3.0, 0.2  # of the partition: where it begins and how thick it is [m]
PLACE = (0.5, 0.3, 3.0, 2.2)  # x, sill, width, height of its window [m]
GLASS_AREA = (PLACE[2] - 2 * FRAME) * (PLACE[3] - 2 * FRAME)


@pytest.fixture(scope="module")
def two_rooms(tmp_path_factory) -> Path:
    """The small room cut by a glazed partition: one room with the window, a dark one behind."""
    small, _ = box_model(space=False)
    grey = small.style("partition", 0.5)
    wall = small.box("IfcWall", "partition", (0, MIDDLE, 0), (WIDTH, THICK, HEIGHT), grey)
    x, sill, width, height = PLACE
    opening = small.box(
        "IfcOpeningElement", "hole", (x, MIDDLE - 0.1, sill), (width, THICK + 0.2, height)
    )
    import ifcopenshell.api.feature

    ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)
    glass, frame, y = small.style("inner", 0.9, 0.8), small.style("sash", 0.7), MIDDLE + THICK / 2
    window = small.box("IfcWindow", "P1", (x + FRAME, y - 0.01, sill + FRAME),
                       (width - 2 * FRAME, 0.02, height - 2 * FRAME), glass)  # fmt: skip
    small.show(window, [
        ((x, y - 0.03, sill), (FRAME, 0.06, height), frame),
        ((x + width - FRAME, y - 0.03, sill), (FRAME, 0.06, height), frame),
        ((x + FRAME, y - 0.03, sill), (width - 2 * FRAME, 0.06, FRAME), frame),
        ((x + FRAME, y - 0.03, sill + height - FRAME), (width - 2 * FRAME, 0.06, FRAME), frame),
        ((x + FRAME, y - 0.01, sill + FRAME), (width - 2 * FRAME, 0.02, height - 2 * FRAME), glass),
    ])  # fmt: skip
    ifcopenshell.api.feature.add_filling(small.model, opening=opening, element=window)
    small.box("IfcSpace", "lit", (0, 0, 0), (WIDTH, MIDDLE, HEIGHT))
    back = MIDDLE + THICK
    small.box("IfcSpace", "dark", (0, back, 0), (WIDTH, DEPTH - back, HEIGHT))
    path = tmp_path_factory.mktemp("inner") / "two.ifc"
    small.model.write(str(path))
    return path


@pytest.fixture(scope="module")
def building(two_rooms: Path) -> Building:
    """The same, read."""
    return read_ifc(two_rooms)


def test_the_pane_is_a_face_of_both_rooms(building: Building) -> None:
    dark, lit = building.space("dark"), building.space("lit")
    assert lit_neighbours(building, dark) == [lit]
    assert lit_neighbours(building, lit) == []
    for room in (dark, lit):
        area = sum(face.area for face in room.faces if face.pane is not None)
        assert area == pytest.approx(GLASS_AREA, rel=1e-3)


def test_the_dark_room_looks_into_the_lit_one_through_a_closed_reveal(building: Building) -> None:
    dark, lit = building.space("dark"), building.space("lit")
    found = inner_glass(building, dark, in_all_windows(lit, read_system(VENETIAN_BLIND)))
    assert found is not None and found.area == pytest.approx(GLASS_AREA, rel=1e-3)
    (group,), (room,) = found.groups, found.beyond
    np.testing.assert_allclose(group.frame[2], [0, -1, 0], atol=1e-9)
    reveal = 2 * (PLACE[2] + PLACE[3] - 4 * FRAME) * THICK
    total = room.scene.interior.areas.sum()
    faces = sum(face.area for face in lit.faces)
    assert total == pytest.approx(faces + reveal, rel=1e-3)


@pytest.mark.slow
def test_run_computes_a_room_without_windows_and_says_what_it_borrows(
    two_rooms: Path, tmp_path: Path
) -> None:
    from scenes.cli import cfs

    call = ["run", str(two_rooms), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND),
            "--quick", "--size", "32", "--space", "dark"]  # fmt: skip
    without = CliRunner().invoke(cfs, [*call, "--out", str(tmp_path / "closed")])
    assert without.exit_code != 0 and "has no window" in str(without.exception)
    result = CliRunner().invoke(cfs, [*call, "--inner-glass", "--out", str(tmp_path / "open")])
    assert result.exit_code == 0, result.exception or result.output
    assert "borrows 100 % of its daylight through 5.6 m2 of glass from lit" in result.output
