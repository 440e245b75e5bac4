"""Figures against closed forms: ticks, colours, carpets, plans, curves, meshes."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import shapely
from matplotlib import colormaps

from bim.model import Element
from bim.sensors import sensor_grid
from bim.shoebox import WindowRectangle, shoebox
from scenes.figures.carpet import carpet, class_carpet, day_grid, month_ticks
from scenes.figures.chart import BOX, box, line
from scenes.figures.plan import plan, plan_frame, window_from_above
from scenes.figures.scale import ColourScale, log_values, plain, relative_luminance, round_limits, round_values
from scenes.language.numbers import percent
from scenes.report.glare_figures import luminance_scale, outline
from scenes.report.model3d import building_box, model3d, outline_edges
from scenes.report.room import state_carpets
from scenes.results import LuminancePicture
from tests.report.synthetic import run_result, slab


def test_ticks_are_round_and_inside() -> None:
    assert round_values(0, 100, 5).tolist() == [0, 20, 40, 60, 80, 100]
    assert round_values(-3, 34, 6).tolist() == [0, 5, 10, 15, 20, 25, 30]
    assert log_values(30, 10000).tolist() == [30, 100, 300, 1000, 3000, 10000]
    assert not np.signbit(round_values(-10, 10, 4)).tolist()[2], "a negative zero"
    assert plain(-12000) == "−12\u202f000"


@pytest.mark.parametrize("values", [[0.3, 0.31], [-2.2, 31.4], [0, 406], [5.0, 5.0], [1e-3, 7e4]])
def test_limits_hold_all_values_at_ticks_of_the_axis(values) -> None:
    low, high = round_limits(values)
    assert low <= min(values) and high >= max(values)
    ticks = round_values(low, high, 6)
    np.testing.assert_allclose([ticks[0], ticks[-1]], [low, high], atol=1e-9 * (high - low))


@pytest.mark.parametrize("name", ["viridis", "cividis"])
def test_numbers_can_be_read_on_every_colour(name) -> None:
    scale = ColourScale(0, 1, "x", "", colours=name)
    for value in np.linspace(0, 1, 201):
        light = sorted([relative_luminance(scale.rgba([value])[0]), float(scale.ink(value) == "#fff")])
        # black and white meet at sqrt(21) = 4.58 to 1; WCAG 2.2 asks for 4.5
        assert (light[1] + 0.05) / (light[0] + 0.05) >= 4.5


def test_colours_grow_lighter_with_the_value_and_end_at_the_limits() -> None:
    scale = ColourScale(10, 1000, "x", "lx", logarithmic=True)
    assert scale.fraction([10, 100, 1000, 1e6]) == pytest.approx([0, 0.5, 1, 1])
    values = np.geomspace(10, 1000, 60)
    assert np.all(np.diff([relative_luminance(c) for c in scale.rgba(values)]) > 0)
    assert scale.rgba([np.nan])[0, 3] == 0


@pytest.mark.parametrize("year", [2023, 2024])
def test_carpet_puts_each_hour_in_its_cell(year) -> None:
    times = pd.date_range(f"{year}-01-01 00:30", f"{year}-12-31 23:30", freq="h")
    grid = day_grid(times, np.arange(len(times)))
    assert grid.shape == (24, 366 if year == 2024 else 365)
    when = pd.Timestamp(f"{year}-03-05 14:30")
    assert grid[23 - 14, when.day_of_year - 1] == times.get_loc(when)
    assert not np.isnan(grid).any()
    ticks = month_ticks(times)
    assert [t.label + t.rest for t in ticks][:3] == ["Jan", "Feb", "Mar"]
    assert ticks[0].at == pytest.approx(100 * 15.5 / grid.shape[1])


@pytest.mark.parametrize("name", ["viridis", "cividis", "turbo"])
def test_colours_are_those_of_matplotlib(name) -> None:
    scale = ColourScale(0.0, 10.0, "x", "lx", colours=name)
    values = np.linspace(-1, 11, 4001)
    assert np.array_equal(scale.rgba(values), colormaps[name](scale.fraction(values), bytes=True))


def test_carpet_of_quarter_hours_and_of_a_few_days() -> None:
    times = pd.date_range("2023-05-30 00:07:30", periods=4 * 96, freq="15min")
    values = np.arange(len(times))
    grid = day_grid(times, values)
    assert grid.shape == (96, 4)
    assert grid[::-1].T.ravel().tolist() == values.tolist()
    assert [t.label + t.rest for t in month_ticks(times)] == ["30 May", "31 May", "1 Jun", "2 Jun"]


def test_numbers_under_the_pointer_are_those_of_the_picture() -> None:
    times = pd.date_range("2023-01-01 00:30", periods=48, freq="h")
    values = np.where(np.arange(48) % 5 == 0, np.nan, np.linspace(-3, 40, 48))
    scale = ColourScale(0, 40, "t", "°C")
    chart = carpet(times, values, scale, title="t", explanation="", digits=1)
    coded = np.reshape(chart.carpet["values"], (24, 2))
    grid = day_grid(times, values)
    assert np.array_equal(coded == -32768, np.isnan(grid))
    known = ~np.isnan(grid)
    # half of the last digit shown
    np.testing.assert_allclose(coded[known] / 10, grid[known], atol=0.05 + 1e-9)


def test_classes_have_the_colours_of_the_legend() -> None:
    times = pd.date_range("2023-01-01 00:30", periods=24, freq="h")
    legend = (("#102030", "a"), ("#aabbcc", "b"))
    chart = class_carpet(times, np.arange(24) % 3 - 1, legend, title="t", explanation="")
    coded = np.array(chart.carpet["values"])
    assert coded[::-1].tolist() == [-1, 0, 1] * 8
    assert chart.classes == legend


def test_paths_scale_and_break() -> None:
    assert line([0, 5, 10], [1, 2, 3], (0, 10), (1, 3)) == "M0.0 1000.0L500.0 500.0L1000.0 0.0"
    assert line([0, 5, 10], [1, np.nan, 3], (0, 10), (1, 3)) == "M0.0 1000.0M1000.0 0.0"
    assert box(1, 2, 0, 5, (0, 4), (0, 10)) == ("M250.0 1000.0L500.0 1000.0L500.0 500.0L250.0 500.0Z")
    assert BOX == 1000.0


@pytest.mark.parametrize("facing", [180.0, 217.0])
def test_plan_shows_outline_recess_windows_and_cells(facing) -> None:
    opening = WindowRectangle(0.5, 0.9, 3.0, 1.8)
    space = shoebox(4.0, 6.0, 3.0, windows=(opening,), facing_deg=facing, recess=0.25).spaces[0]
    points, _ = sensor_grid(space, 0.5)
    frame = plan_frame(space, points)
    # coordinates of a cut are rounded to 1e-7 m
    assert frame.outline.area == pytest.approx(4 * 6 + 3 * 0.25, abs=1e-4)
    for turn in range(3):  # whichever corner the triangles begin with
        turned = np.roll(space.windows[0].triangles, turn, axis=1)
        ends = window_from_above(replace(space.windows[0], triangles=turned))
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(3.0)
    assert shapely.union_all(shapely.polygons(frame.cells)).area == pytest.approx(0.25 * len(points), rel=1e-6)
    drawn = plan(frame, np.arange(len(points)), ColourScale(0, 100, "x", "%"), title="", explanation="")
    assert drawn.body.count('class="cell"') == len(points)
    assert drawn.body.count('class="window"') == 1
    with pytest.raises(ValueError, match="values for"):
        plan(frame, [1.0], drawn.scale, title="x", explanation="")


def test_skylight_is_drawn_as_an_area() -> None:
    opening = WindowRectangle(1.0, 2.0, 2.0, 1.0, side="ceiling")
    space = shoebox(windows=(opening,)).spaces[0]
    frame = plan_frame(space, sensor_grid(space)[0])
    assert shapely.Polygon(frame.windows[0]).area == pytest.approx(2.0)


def test_box_has_twelve_edges_and_a_square_four() -> None:
    cube = slab([0, 0, 0], [1, 2, 3])
    edges = outline_edges(cube)
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert sorted(lengths) == pytest.approx([1] * 4 + [2] * 4 + [3] * 4)
    assert len(outline_edges(cube[:2])) == 4


def test_a_building_is_its_rooms_and_what_touches_them() -> None:
    """The attic above the room and the roof on it, not the terrain, nor a tree 5 m away."""
    parts = (
        ("IfcWall", [0, 0, 3.2], [4, 6, 6]),
        ("IfcRoof", [-0.5, -0.5, 6], [4.5, 6.5, 7]),
        ("IfcSite", [-50, -50, -1], [50, 50, 0]),
        ("IfcBuildingElementProxy", [9, 0, 0], [10, 1, 9]),
    )
    elements = tuple(
        Element(f"{i}", kind, kind, slab(low, high), 0.3, 0.3) for i, (kind, low, high) in enumerate(parts)
    )
    box = building_box(shoebox(4.0, 6.0, 3.0, elements=elements))
    np.testing.assert_allclose(box, [[-0.5, -0.5, 0], [4.5, 6.5, 7]], atol=1e-9)
    model = model3d(run_result(picture_size=32, pictures=1))
    rooms = np.concatenate([s.shell for s in run_result(picture_size=32, pictures=1).building.spaces]).reshape(-1, 3)
    low, high = (np.array(corner) + model.centre for corner in model.whole)
    assert np.all(low <= rooms.min(axis=0) + 1e-3) and np.all(high >= rooms.max(axis=0) - 1e-3)


def test_mesh_keeps_positions_to_a_step_and_every_sensor() -> None:
    result = run_result(picture_size=32, pictures=1)
    model = model3d(result)
    walls = next(b for b in model.batches if b["room"] == 1 and b["kind"] == "wall")
    points = np.frombuffer(base64.b64decode(walls["t"]), "<i2").reshape(-1, 3) * model.unit
    points = points + model.centre
    kinds = ("wall", "reveal")
    faces = [f.triangles for f in result.spaces[1].space.faces if f.kind in kinds]
    reveals_last = sorted(faces, key=lambda t: len(t))
    expected = np.concatenate(reveals_last).reshape(-1, 3)
    assert len(points) == len(expected)
    # half a step each way, in every coordinate; compared as sets, for faces are regrouped
    for axis in range(3):
        np.testing.assert_allclose(np.sort(points[:, axis]), np.sort(expected[:, axis]), atol=0.51 * model.unit)
    assert model.unit < 0.001
    sensors = sum(len(room.daylight.points) for room in result.spaces)
    assert len(model.sensors["room"]) == sensors
    colours = [base64.b64decode(layer.colours) for layer in model.layers]
    assert all(len(rgb) == 3 * sensors for rgb in colours)


def test_wide_terrain_leaves_the_rooms_their_steps() -> None:
    """Terrain of 20 km: 16 bits of it are half a metre, and a room of metres is a line."""
    result = run_result(picture_size=32, pictures=1)
    ground = slab([-1e4, -1e4, -3.0], [1e4, 1e4, -2.9])
    terrain = Element("g", "ground", "IfcSite", ground, 0.3, 0.3)
    building = replace(result.building, elements=(*result.building.elements, terrain))
    model = model3d(replace(result, building=building))
    assert model.unit < 0.02
    (shown,) = [b for b in model.batches if b["kind"] == "outdoors" and b["storey"] == 0]
    points = np.frombuffer(base64.b64decode(shown["t"]), "<i2").reshape(-1, 3) * model.unit
    assert 200 < np.abs(points[:, :2]).max() < 700


def test_outline_bridges_slits_but_not_rooms() -> None:
    mask = np.zeros((60, 60), bool)
    mask[20:37:4, 10:50] = True  # slats, slits of three pixels
    rim = outline(mask)
    assert not rim[22:35, 20:40].any(), "slits are outlined one by one"
    assert rim[20, 20:40].all()
    apart = np.zeros((60, 60), bool)
    apart[5:15, 5:15] = apart[40:50, 40:50] = True
    assert not outline(apart)[20:35, 20:35].any()


def test_scale_of_luminance_holds_a_small_bright_source_of_one_picture() -> None:
    dim, glaring = np.full((100, 100), 50.0), np.full((100, 100), 50.0)
    glaring[:5, :5] = 60_000.0  # a quarter of a per cent of the picture
    scale = luminance_scale([LuminancePicture(0, a, {"dgp": 0.2}) for a in (dim, dim, glaring)])
    assert (scale.low, scale.high) == pytest.approx((100_000 / 3000, 100_000))
    dark = luminance_scale([LuminancePicture(0, np.zeros((9, 9)), {"dgp": 0.2})])
    assert (dark.low, dark.high) == (1.0, 1000.0)


def test_each_group_of_windows_has_its_carpet_of_states() -> None:
    result = run_result(picture_size=32, pictures=1)
    room = next(one for one in result.spaces if one.operation is not None)
    assert [chart.title for chart in state_carpets(result, room)] == ["Shading state"]
    states = room.operation.shading.states
    shading = replace(
        room.operation.shading,
        groups=("S", "door"),
        rules=("irradiance", "any"),
        states=np.column_stack([states, 2 - states]),
        views=2 * room.operation.shading.views,
    )
    two = replace(room, operation=replace(room.operation, shading=shading))
    south, door = state_carpets(result, two)
    assert (south.title, door.title) == ("Shading state: S", "Shading state: door")
    assert "irradiance" in south.explanation and "several rules" in door.explanation
    lit = result.sun[:, 2] > 0
    for chart, column in ((south, states), (door, 2 - states)):
        share = 100 * np.mean(column[lit] == 2)
        assert f"closed <70°>: {percent(share)} %" in str(chart)
