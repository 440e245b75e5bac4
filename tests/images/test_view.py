"""Views: closed forms of the projections, and Radiance's own rays."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.images.view import (
    View,
    fisheye,
    fitted,
    format_view,
    parse_view,
    pixel_directions,
    pixel_rays,
    pixel_solid_angles,
    rays,
)

ASYMMETRIC = "-vp 1 2 3 -vd 1 -0.4 0.3 -vu 0.1 0 1 -vs 0 -vl 0"
VIEWS = {
    "angular": f"-vta {ASYMMETRIC} -vh 180 -vv 180",
    "angular narrow": f"-vta {ASYMMETRIC} -vh 90 -vv 60",
    "hemispherical": f"-vth {ASYMMETRIC} -vh 180 -vv 180",
    "perspective": f"-vtv {ASYMMETRIC} -vh 60 -vv 40",
    "shifted": "-vtv -vp 1 2 3 -vd 1 -0.4 0.3 -vu 0 0 1 -vs 0.3 -vl -0.2 -vh 60 -vv 40",
    "cylindrical": f"-vtc {ASYMMETRIC} -vh 200 -vv 60",
    "planispheric": f"-vts {ASYMMETRIC} -vh 180 -vv 180",
}


def radiance(program: str) -> str:
    """The path of a Radiance program; the test is skipped without it."""
    pyradiance = pytest.importorskip("pyradiance")
    path = Path(pyradiance.__file__).parent / "bin" / program
    return str(path) if path.exists() else shutil.which(program) or pytest.skip(f"no {program}")


@pytest.mark.peer
@pytest.mark.parametrize("name", VIEWS)
def test_pixel_directions_are_those_of_vwrays(name, tmp_path):
    view = parse_view(VIEWS[name], width=31, height=24)
    vf = tmp_path / "view.vf"
    vf.write_text(f"rvu {VIEWS[name]}\n")
    command = [radiance("vwrays"), "-ff", "-pa", "0", "-x", "31", "-y", "24", "-vf", str(vf)]
    out = subprocess.run(command, capture_output=True, check=True).stdout
    theirs = np.frombuffer(out, "<f4").reshape(24, 31, 6)
    x, y = (np.arange(31) + 0.5) / 31, 1 - (np.arange(24) + 0.5) / 24
    ours, exists = rays(view, x[None, :], y[:, None])
    there = np.abs(theirs[..., 3:]).sum(-1) > 0
    assert np.array_equal(exists, there)
    # 4-byte floats: 6e-8 relative
    assert np.allclose(ours[exists], theirs[exists][:, 3:], atol=2e-7)
    assert np.allclose(theirs[exists][:, :3], view.position, atol=1e-6)


def test_top_left_pixel_looks_up_and_left():
    directions, counts = pixel_directions(fisheye((0, 0, 0), (0, 1, 0), 40))
    assert directions[10, 5, 0] < 0 < directions[10, 5, 2]
    assert not counts[0, 0] and counts[20, 20]
    assert np.allclose(np.linalg.norm(directions[counts], axis=-1), 1)


def test_solid_angles_are_those_of_all_views_of_one_projection() -> None:
    here = fisheye((0, 0, 1.2), (0, 1, 0), 12)
    there = fisheye((3, 1, 0.5), (1, 0.2, 0), 12)
    omega = pixel_solid_angles(here)
    assert pixel_solid_angles(there) is omega and not omega.flags.writeable
    other = pixel_solid_angles(fisheye((0, 0, 1.2), (0, 1, 0), 12, kind="hemispherical"))
    assert other.shape == omega.shape and not np.array_equal(other, omega)


@pytest.mark.parametrize("kind", ["angular", "hemispherical"])
def test_fisheye_solid_angles_fill_the_hemisphere(kind):
    view = fisheye((0, 0, 0), (0, 1, 0), 400, kind=kind)
    omega = pixel_solid_angles(view)
    directions, counts = pixel_directions(view)
    cosine = directions @ np.asarray(view.direction)
    lost = 2 * np.pi - omega[counts].sum()
    # the rim cuts through pixels; a hemispherical picture has no solid angle for those, up to
    # the radius 1 - sqrt(2)/200, where cos(theta) = 0.119
    assert abs(lost) < 2e-4 * 2 * np.pi if kind == "angular" else 0 < lost < 0.119 * 2 * np.pi
    # their share of the projected hemisphere is cos^2: at most 0.0141
    assert (omega * cosine)[counts].sum() == pytest.approx(np.pi, rel=0.015)


def test_solid_angles_of_a_perspective_are_those_of_a_rectangle():
    view = View("perspective", horizontal_deg=70, vertical_deg=50, width=90, height=60)
    a, b = np.tan(np.radians(35)), np.tan(np.radians(25))
    closed = 4 * np.arcsin(a * b / np.sqrt((1 + a * a) * (1 + b * b)))
    assert pixel_solid_angles(view).sum() == pytest.approx(closed, rel=1e-9)


@pytest.mark.parametrize("name", VIEWS)
def test_format_and_parse_are_inverse(name):
    view = parse_view(VIEWS[name], 31, 24)
    again = parse_view("VIEW= " + format_view(view), 31, 24)
    assert again.kind == view.kind and again.shift == view.shift
    assert np.allclose(again.direction, view.direction, atol=1e-8)  # nine digits are written
    assert (again.horizontal_deg, again.vertical_deg) == (view.horizontal_deg, view.vertical_deg)


def test_what_is_not_said_is_radiances_default():
    view = parse_view("-vta -vh 180 -vv 180")
    assert view.direction == (0, 1, 0) and view.up == (0, 0, 1) and view.position == (0, 0, 0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing here", "no view option"),
        ("-vth -vh 190 -vv 190", "illegal size"),
        ("-vta -vd 0 0 1 -vh 180 -vv 180", "parallel"),
        ("-vta -vd 0 0 0 -vh 180 -vv 180", "no length"),
    ],
)
def test_impossible_views_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        parse_view(text)


@pytest.mark.parametrize(
    ("kind", "across", "along", "covers", "disc"),
    [
        ("angular", 180, 180, True, True),
        ("hemispherical", 180, 180, True, True),
        ("angular", 220, 200, True, False),
        ("angular", 180, 90, False, False),
        ("perspective", 170, 170, False, False),
        ("planispheric", 200, 200, False, False),
    ],
)
def test_which_views_cover_the_hemisphere_before_the_eye(
    kind: str, across: float, along: float, covers: bool, disc: bool
) -> None:
    view = View(kind, horizontal_deg=across, vertical_deg=along)
    assert (view.covers_hemisphere, view.is_disc) == (covers, disc)


def test_rays_through_points_of_pixels_are_those_of_the_whole_picture():
    view = fisheye((0, 0, 0), (0, 1, 0), 8)
    across, up = (np.arange(8) + 0.25) / 8, 1 - (np.arange(8)[:, None] + 0.75) / 8
    whole, exists = rays(view, *np.broadcast_arrays(across, up))
    pixels = np.array([3 * 8 + 5, 4 * 8 + 2])
    found, there = pixel_rays(view, pixels, 0.25, 0.75)
    np.testing.assert_allclose(found, whole.reshape(-1, 3)[pixels])
    np.testing.assert_array_equal(there, exists.ravel()[pixels])


def test_the_smallest_picture_has_one_pixel():
    one = fisheye((0, 0, 0), (0, 1, 0), 1)
    assert (one.width, one.height, one.up, one.horizontal_deg) == (1, 1, (0, 0, 1), 180)
    with pytest.raises(ValueError, match="size"):
        fisheye((0, 0, 0), (0, 1, 0), 0)


def test_a_picture_has_so_many_pixels_along_its_longer_side():
    """By the tangent of half the angle in perspective, by the angle in an angular view."""
    for kind, longer, shorter, ratio in (("v", 90, 60, np.tan(np.radians(30))), ("a", 180, 120, 120 / 180)):
        text = f"-vt{kind} -vp 0 0 0 -vd 0 1 0 -vu 0 0 1 -vh {{}} -vv {{}}"
        wide, high = (fitted(parse_view(text.format(*pair)), 300) for pair in ((longer, shorter), (shorter, longer)))
        assert (wide.width, wide.height) == (300, round(300 * ratio))
        assert (high.width, high.height) == (wide.height, wide.width)


def test_a_parallel_view_has_a_ray_everywhere_along_its_direction():
    view = parse_view("-vtl -vp 0 0 0 -vd 0 1 0 -vu 0 0 1 -vh 2 -vv 2", width=3, height=3)
    directions, exists = rays(view, np.array([0.1, 0.5, 0.9]), np.array([0.2, 0.5, 1.0]))
    assert exists.all()
    np.testing.assert_allclose(directions, [(0.0, 1.0, 0.0)] * 3)


def test_pixels_across_the_rim_of_a_hemisphere_have_no_solid_angle():
    """Of a hemispherical picture a pixel counts whole or not at all: its corners lie within the unit circle."""
    size = 40
    omega = pixel_solid_angles(fisheye((0, 0, 0), (0, 1, 0), size, kind="hemispherical"))
    edges = np.abs(np.linspace(-1, 1, size + 1))
    farthest = np.maximum(edges[:-1], edges[1:])
    corner = np.hypot(farthest[:, None], farthest)
    assert (omega[corner < 1 - 1e-9] > 0).all() and (omega[corner > 1 + 1e-9] == 0).all()
