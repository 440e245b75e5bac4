"""`cfs run --inner-glass`: a room without windows behind a glazed partition, from its IFC file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bim import read_ifc
from bim.doorways import opened, source_rooms
from bim.model import Building
from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.detectors import NANOMETRES, visible_mean
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system, with_see_through
from scenes.room.inner_glass import CLEAR, inner_glass
from scenes.room.windows import in_all_windows, room_windows
from tests.bim import test_passages as passages
from tests.bim.small_ifc import DEPTH, FRAME, HEIGHT, WIDTH, SmallIfc, box_model
from tests.issues import texts
from tests.validation import inner_glass_ifc

MIDDLE, THICK = 3.0, 0.2  # of a partition: where it begins and how thick it is [m]
PLACE = (0.5, 0.3, 3.0, 2.2)  # x, sill, width, height of a partition's window [m]
GLASS_AREA = (PLACE[2] - 2 * FRAME) * (PLACE[3] - 2 * FRAME)


def glazed_rooms(path: Path, rooms: dict[str, float]) -> Path:
    """The small room cut by glazed partitions; each room and where it begins, the first at 0."""
    small, _ = box_model(space=False)
    begin = list(rooms.values())
    for name, y0, y1 in zip(rooms, begin, [*begin[1:], DEPTH + THICK], strict=True):
        small.box("IfcSpace", name, (0, y0, 0), (WIDTH, y1 - THICK - y0, HEIGHT))
    for number, y in enumerate(begin[1:], 1):
        glazed_partition(small, f"P{number}", y - THICK)
    small.model.write(str(path))
    return path


def glazed_partition(small: SmallIfc, name: str, low: float) -> None:
    """A partition that begins at a depth, with a window."""
    import ifcopenshell.api.feature

    grey = small.style("partition", 0.5)
    wall = small.box("IfcWall", "partition", (0, low, 0), (WIDTH, THICK, HEIGHT), grey)
    x, sill, width, height = PLACE
    opening = small.box("IfcOpeningElement", "hole", (x, low - 0.1, sill), (width, THICK + 0.2, height))
    ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)
    glass, frame, y = small.style("inner", 0.9, 0.8), small.style("sash", 0.7), low + THICK / 2
    window = small.box(
        "IfcWindow", name, (x + FRAME, y - 0.01, sill + FRAME), (width - 2 * FRAME, 0.02, height - 2 * FRAME), glass
    )
    small.show(
        window,
        [
            ((x, y - 0.03, sill), (FRAME, 0.06, height), frame),
            ((x + width - FRAME, y - 0.03, sill), (FRAME, 0.06, height), frame),
            ((x + FRAME, y - 0.03, sill), (width - 2 * FRAME, 0.06, FRAME), frame),
            ((x + FRAME, y - 0.03, sill + height - FRAME), (width - 2 * FRAME, 0.06, FRAME), frame),
            ((x + FRAME, y - 0.01, sill + FRAME), (width - 2 * FRAME, 0.02, height - 2 * FRAME), glass),
        ],
    )
    ifcopenshell.api.feature.add_filling(small.model, opening=opening, element=window)


@pytest.fixture(scope="module")
def two_rooms(tmp_path_factory) -> Path:
    """One room with the window, a dark one behind."""
    path = tmp_path_factory.mktemp("inner") / "two.ifc"
    return glazed_rooms(path, {"lit": 0.0, "dark": MIDDLE + THICK})


@pytest.fixture(scope="module")
def three_rooms(tmp_path_factory) -> Building:
    """One room with the window, two dark ones behind each other."""
    path = tmp_path_factory.mktemp("inner") / "three.ifc"
    return read_ifc(glazed_rooms(path, {"lit": 0.0, "dark": 2.2, "last": 4.2}))


@pytest.fixture(scope="module")
def building(two_rooms: Path) -> Building:
    """The same, read."""
    return read_ifc(two_rooms)


def test_the_pane_is_a_face_of_both_rooms(building: Building) -> None:
    dark, lit = building.space("dark"), building.space("lit")
    assert source_rooms(building, dark) == [lit]
    assert source_rooms(building, lit) == []
    for room in (dark, lit):
        area = sum(face.area for face in room.faces if face.pane is not None)
        assert area == pytest.approx(GLASS_AREA, rel=1e-3)


def test_the_dark_room_looks_into_the_lit_one_through_a_closed_reveal(building: Building) -> None:
    dark, lit = building.space("dark"), building.space("lit")
    found = inner_glass(building, dark, in_all_windows(lit, read_system(VENETIAN_BLIND)))
    assert found is not None and found.area == pytest.approx(GLASS_AREA, rel=1e-3)
    (group,), (room,), ((pane,),) = found.groups, found.beyond, found.optics
    assert room.beam[0] == pane.transmission[0, 0] == pytest.approx(CLEAR, rel=0.01)
    np.testing.assert_allclose(group.frame[2], [0, -1, 0], atol=1e-9)
    reveal = 2 * (PLACE[2] + PLACE[3] - 4 * FRAME) * THICK
    total = room.scene.interior.areas.sum()
    faces = sum(face.area for face in lit.faces)
    assert total == pytest.approx(faces + reveal, rel=1e-3)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_a_peak_that_the_user_calls_a_lobe_is_no_beam_of_the_lit_room(building, share) -> None:
    """The sky beyond two panes was seen through any peak."""
    blind = read_system(VENETIAN_BLIND)
    lit = building.space("lit")
    systems = in_all_windows(lit, with_see_through(blind, share))
    (beyond,) = inner_glass(building, building.space("dark"), systems).beyond
    peak = through_peak(blind.visible.transmission_front, KLEMS_FULL).transmittance
    assert peak.max() > 0.1
    np.testing.assert_allclose(beyond.straight[0], share * peak, atol=1e-6)


def test_light_goes_through_a_dark_room_to_the_one_behind_it(three_rooms: Building) -> None:
    lit, dark, last = (three_rooms.space(name) for name in ("lit", "dark", "last"))
    assert source_rooms(three_rooms, last) == [dark, lit]
    assert source_rooms(three_rooms, dark) == [lit]
    assert source_rooms(three_rooms, lit) == []
    systems = in_all_windows(lit, read_system(VENETIAN_BLIND))
    found = inner_glass(three_rooms, last, systems)
    (beyond,) = found.beyond
    (before,) = beyond.scene.adjacent
    assert len(beyond.scene.groups) == 1 and len(beyond.transmission) == 1
    np.testing.assert_allclose(beyond.transmission[0], found.optics[0][0].transmission)
    (blind,) = room_windows(lit, systems).optics()[0]
    np.testing.assert_allclose(before.transmission[0], blind.transmission)
    # neither of the dark room's two panes is among its opaque faces, one is glass to the last room
    faces = sum(face.area for face in dark.faces) - GLASS_AREA
    reveal = 2 * (PLACE[2] + PLACE[3] - 4 * FRAME) * THICK
    assert beyond.scene.interior.areas.sum() == pytest.approx(faces + reveal, rel=1e-3)


@pytest.fixture(scope="module")
def doorway(tmp_path_factory) -> Path:
    """A room with the window, and a dark one behind an open doorway."""
    small = passages.two_rooms(thick=THICK)
    passages.partition(small, passages.SOUTH, THICK, passages.DOORWAY)
    path = tmp_path_factory.mktemp("inner") / "doorway.ifc"
    small.model.write(str(path))
    return path


def test_a_doorway_passes_everything_into_the_dark_room(doorway: Path) -> None:
    building = read_ifc(doorway)
    dark, lit = building.space("dark"), building.space("lit")
    assert source_rooms(building, dark) == [lit]
    found = inner_glass(building, dark, in_all_windows(lit, read_system(VENETIAN_BLIND)))
    assert found is not None and (found.area, found.open_area) == (0, pytest.approx(2.1))
    (group,), (room,), ((pane,),) = found.groups, found.beyond, found.optics
    np.testing.assert_array_equal(room.beam, 1)
    np.testing.assert_array_equal(pane.transmission, np.eye(145))
    assert pane.reflection is None
    np.testing.assert_allclose(group.frame[2], [0, -1, 0], atol=1e-9)
    reveal = 2 * (passages.DOORWAY[2] + passages.DOORWAY[3]) * THICK
    faces = sum(face.area for face in lit.faces)
    assert room.scene.interior.areas.sum() == pytest.approx(faces + reveal, rel=1e-6)


def test_a_doorway_gives_back_what_a_room_does_not_absorb(doorway: Path) -> None:
    """Sumpner's sphere: of the light in it a room loses (1 - rho) A to walls and a to the doorway.

    In balance what comes in, P, is what is lost: P = M / rho ((1 - rho)(A - a) + a) for radiosity
    M of a mean surface; M a comes back.
    """
    building = read_ifc(doorway)
    (face,) = [f for f in opened(building).space("lit").faces if f.pane is not None]
    dark = building.space("dark")
    area = np.array([f.area for f in dark.faces])
    mean = area @ [f.reflectance("visible") for f in dark.faces] / area.sum()
    lost = (1 - mean) * (area.sum() - 2.1) + 2.1
    back = mean * 2.1 / lost
    assert face.reflectance_visible == pytest.approx(back, rel=1e-9)
    (closed,) = [f for f in building.space("lit").faces if f.pane is not None]
    assert closed.reflectance_visible == 0.5 and face.reflectance_visible < 0.05


def test_issues_of_an_opened_building_ask_for_nothing_that_is_so(two_rooms: Path) -> None:
    building = read_ifc(two_rooms)
    asked = texts(building).count("--inner-glass lets daylight pass")
    assert asked and texts(opened(building)).count(": daylight passes") == asked
    assert "--inner-glass" not in texts(opened(building))


@pytest.mark.slow
@pytest.mark.usefixtures("variant")
def test_light_through_a_doorway_is_that_of_paths_in_both_rooms(doorway: Path) -> None:
    """Paths see both rooms at once, and so the light that goes back; 3 % is the bar."""
    building = opened(read_ifc(doorway))
    scene = inner_glass_ifc.borrowing_scene(building, building.space("dark"))
    paths = np.mean([inner_glass_ifc.by_paths(scene, 1 << 18, seed) for seed in range(2)], axis=0)
    found = np.mean([inner_glass_ifc.by_phases(scene, seed) for seed in range(2)], axis=0)
    print(found, paths)
    assert found.mean() == pytest.approx(paths.mean(), rel=0.03)
    np.testing.assert_allclose(found, paths, rtol=0.06)


@pytest.mark.slow
def test_run_computes_a_room_without_windows_and_says_what_it_borrows(two_rooms: Path, tmp_path: Path) -> None:
    from scenes.cli import cfs

    call = [
        "run",
        str(two_rooms),
        "--weather",
        str(WEATHER),
        "--cfs",
        str(VENETIAN_BLIND),
        "--quick",
        "--size",
        "32",
        "--space",
        "dark",
    ]
    without = CliRunner().invoke(cfs, [*call, "--out", str(tmp_path / "closed")])
    assert without.exit_code != 0 and "has no window" in str(without.exception)
    result = CliRunner().invoke(cfs, [*call, "--inner-glass", "--out", str(tmp_path / "open")])
    assert result.exit_code == 0, result.exception or result.output
    assert (
        "receives 100 % of its daylight through 5.6 m2 of inner glass and 0.0 m2 of open doorways "
        "from lit" in result.output
    )


def test_light_through_inner_glass_has_the_colour_of_the_windows_beyond(three_rooms: Building) -> None:
    """Red windows: the light of the room behind, and of the one behind that, is red."""
    lit, last = three_rooms.space("lit"), three_rooms.space("last")
    red = np.interp(NANOMETRES, [560.0, 620.0], [0.05, 0.5])
    spectrum = SpectralFactor.of_panes((), red)
    tinted = replace(read_system(VENETIAN_BLIND), spectrum=spectrum)
    channels = channels_of(9)
    expected = channels.mean(red) / visible_mean(red)
    for name in ("dark", "last"):
        found = inner_glass(three_rooms, three_rooms.space(name), in_all_windows(lit, tinted))
        (one,) = found.spectra
        assert one.of_patches(channels).straight[:, 0] == pytest.approx(expected)
    neutral = inner_glass(three_rooms, last, in_all_windows(lit, read_system(VENETIAN_BLIND)))
    assert neutral.spectra[0].of_patches(channels).straight == pytest.approx(1.0)


def test_two_windows_of_different_colours_mix_by_the_light_that_they_pass() -> None:
    red = np.interp(NANOMETRES, [560.0, 620.0], [0.05, 0.5])
    both = SpectralFactor.of_diffuse_light([SpectralFactor.of_panes((), red), SpectralFactor.neutral()], [1.0, 3.0])
    assert both.transmittance[0] / both.visible[0] == pytest.approx(0.25 * red / visible_mean(red) + 0.75)
