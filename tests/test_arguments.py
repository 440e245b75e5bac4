"""Numbers that cannot be meant are refused by a `ValueError` that names the argument."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import bim
import mitsuba_cfs as cfs
import scenes
import thermal
from mitsuba_cfs.bsdf.blinds import vertical_louvre
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.methods.optics import check_systems

NONE = (math.nan, math.inf, -math.inf, "x", None)  # of any number
NEGATIVE = (*NONE, -1)
COUNT = (*NEGATIVE, 0, 2.5)  # of whole numbers from 1
SHARE = (*NEGATIVE, 1.5)
OPTIONAL = (math.nan, math.inf, "x", -1)
RADIANS = (*NONE, 45.0, -60.0)
SLATS = {"depth": 0.08, "spacing": 0.06, "tilt": 0.2, "thickness": 0.001}
GREY = plastic("grey", 0.5)


def _slats(make: Callable) -> Callable:
    return lambda **values: make(GREY, **{**SLATS, **values})


def _sheet(**values: Any) -> cfs.SlatMaterial:
    return cfs.SlatMaterial("sheet", (0.5,), (0.5,), **values)


def _box(**values: Any) -> None:
    bim.write_epjson(bim.shoebox(), "never.epJSON", **values)


CASES: list[tuple[str, Callable, str, tuple]] = [
    *(
        (make.__name__, _slats(make), name, bad)
        for make in (cfs.venetian_blind, vertical_louvre)
        for name, bad in (
            ("depth", (*NEGATIVE, 0)),
            ("spacing", (*NEGATIVE, 0)),
            ("thickness", NEGATIVE),
            ("tilt", RADIANS),
        )
    ),
    ("SlatMaterial", _sheet, "roughness", NEGATIVE),
    *(("SlatMaterial", _sheet, name, SHARE) for name in ("specular", "straight", "pane")),
    *(
        ("Sampling", cfs.Sampling, name, COUNT)
        for name in (
            "sensor_samples",
            "patch_samples",
            "sun_points",
            "view_samples",
            "outdoor_samples",
            "picture_samples",
            "hour_samples",
            "subdivision",
        )
    ),
    *(("Sampling", cfs.Sampling, name, NEGATIVE) for name in ("window_parts", "memory", "seed")),
    ("Stopping", cfs.Stopping, "batches", (*COUNT, 1)),
    ("Stopping", cfs.Stopping, "max_batches", COUNT),
    *(("Stopping", cfs.Stopping, name, OPTIONAL) for name in ("target_error", "time_limit")),
    *(("GlareOptions", cfs.GlareOptions, name, OPTIONAL) for name in ("threshold", "peak", "illuminance", "age")),
    ("GlareOptions", cfs.GlareOptions, "search_radius", (*NEGATIVE, 0, 12.0)),
    *(
        ("GlareOptions", cfs.GlareOptions, name, ("x", None, 3))
        for name in ("background", "grouping", "sun", "field_of_view", "position_model")
    ),
    ("pane", cfs.pane, "index", (*NEGATIVE, 0.5)),
    ("pane", cfs.pane, "transmissivity", SHARE),
    ("pane", cfs.pane, "panes", COUNT),
    ("fisheye", lambda **v: cfs.fisheye((0, 0, 1), (0, 1, 0), **v), "size", COUNT),
    *(
        (
            "MaterialLayer",
            lambda **v: bim.MaterialLayer(
                **{"name": "a", "thickness": 0.1, "conductivity": 1.0, "density": 1e3, "heat_capacity": 1e3, **v}
            ),
            name,
            (*NEGATIVE, 0),
        )
        for name in ("thickness", "conductivity", "density", "heat_capacity")
    ),
    ("write_epjson", _box, "u_value", OPTIONAL),
    ("write_epjson", _box, "g_value", OPTIONAL),
    ("write_epjson", _box, "air_changes", NEGATIVE),
    *(
        ("BalanceOptions", thermal.BalanceOptions, name, (math.nan, math.inf, -100.0))
        for name in ("outside_film", "cell", "tolerance", "warm_tolerance", "start_c", "warm_days")
    ),
    ("BalanceOptions", thermal.BalanceOptions, "terrain", ("x", None)),
    *(
        ("RoomOptions", scenes.RoomOptions.of, name, bad)
        for name, bad in (
            ("sensor_spacing", (*NEGATIVE, 0)),
            ("sensor_height", NEGATIVE),
            ("sensor_margin", NEGATIVE),
            ("picture_size", COUNT),
            ("floor_per_person", (0, -1)),
        )
    ),
    ("RoomOptions", scenes.RoomOptions, "heat_step_s", (*NEGATIVE, 0, 7200)),
    ("RoomOptions", scenes.RoomOptions, "infiltration_ach", NEGATIVE),
    *(
        ("IdealLoads", thermal.IdealLoads, name, (math.nan, np.array([20.0, math.nan])))
        for name in ("heating_c", "cooling_c")
    ),
]


@pytest.mark.parametrize(
    ("make", "name", "value"),
    [
        pytest.param(make, name, value, id=f"{label}.{name}={value}")
        for label, make, name, bad in CASES
        for value in bad
    ],
)
def test_an_impossible_value_is_refused_by_its_name(make, name, value):
    with pytest.raises(ValueError, match=name):
        make(**{name: value})


@pytest.mark.parametrize("hours", [[3], [-1], [0, 2]])
def test_an_hour_that_a_sky_has_not_is_refused(hours):
    sky = cfs.given_sky([[0, -0.6, 0.8]] * 2, [500] * 2, [100] * 2, 1, day_of_year=1)
    assert len(sky.part([1]).illuminance) == len(sky.part([True, False]).illuminance) == 1
    with pytest.raises(ValueError, match="hours: expected numbers from 0 to 1"):
        sky.part(hours)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: scenes.simulate("house.ifc", None, "city.epw"), "room: expected Room"),
        (lambda: cfs.venetian_blind(0.5, depth=0.08, spacing=0.06, tilt=0.0), "material: expected"),
        (lambda: cfs.SlatMaterial("white", 0.5, 0.5), "reflectance_front: expected Sequence"),
        (lambda: check_systems([[0.5]], [None]), "expected BsdfOptics or AngularOptics, got 0.5"),
    ],
)
def test_an_argument_of_another_type_is_refused_by_its_name(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_lists_are_surfaces_too():
    triangle = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert cfs.Surfaces(triangle, [0.5], [0]).areas == pytest.approx([0.5])


CORNERS = np.array([[1.0, 0, 1], [3, 0, 1], [3, 0, 2.5], [1, 0, 2.5]])


def _quad(corners: Any) -> np.ndarray:
    a, b, c, d = np.asarray(corners, dtype=float)
    return np.array([[a, b, c], [a, c, d]])


def _room(window: Any) -> cfs.DaylightScene:
    floor = cfs.Surfaces(_quad([[0, 0, 0], [4, 0, 0], [4, 6, 0], [0, 6, 0]]), [0.2, 0.2], [0, 0])
    group = cfs.WindowGroup("south", (cfs.WindowSurface("south", _quad(window)),))
    return cfs.DaylightScene(floor, cfs.Surfaces.none(), [group])


def test_a_window_that_faces_its_room_or_is_not_plane_is_refused():
    """Both gave an answer without a word: no light at all, and that of another window."""
    assert np.allclose(_room(CORNERS).groups[0].frame[2], [0, -1, 0])
    with pytest.raises(ValueError, match="window south: its normal points into the room"):
        _room(CORNERS[::-1])
    bent = CORNERS.copy()
    bent[2, 1] = -1.0
    for corners, words in ((bent, "not in one plane"), (CORNERS * [math.nan, 1, 1], "finite")):
        with pytest.raises(ValueError, match=words):
            cfs.WindowSurface("south", _quad(corners))


def test_numbers_that_are_none_are_refused_in_arrays():
    with pytest.raises(ValueError, match="triangles: expected finite"):
        cfs.Surfaces(np.full((1, 3, 3), math.nan), [0.5], [0])
    with pytest.raises(ValueError, match="straight: expected shares"):
        cfs.AngularOptics([0.0, math.nan, 0.7])
    for tau, rho, words in (
        (math.nan, 0.1, "transmittance: expected numbers from 0 to 1"),
        (0.5, math.inf, "reflectance: expected numbers from 0 to 1"),
        (0.8, 0.5, "transmits and reflects more than it receives"),
    ):
        with pytest.raises(ValueError, match=words):
            thermal.thermal_data(tau, rho, u_value=1.1, g_normal=0.85)


def test_a_sky_of_another_subdivision_is_refused():
    matrices = cfs.phase_matrices(_room(CORNERS), cfs.Sampling(patch_samples=16, subdivision=2), needs=())
    sky = cfs.given_sky([[0, -0.6, 0.8]], [500], [100], 1, day_of_year=1)
    with pytest.raises(ValueError, match="sky: has 146 patches, the matrices 578"):
        cfs.phase_light(matrices, [[cfs.AngularOptics([0.0, 0.7, 0.7])]], sky)
    assert len(repr(matrices.daylight)) < 120 and "relative_error=" in repr(matrices.daylight)
