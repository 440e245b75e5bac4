"""Luminance pictures made up by formulas, as varied as what glare is rated in."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.images.view import View, fisheye, parse_view, pixel_directions

SIZE = 220


def room(view: View, walls: float = 60.0) -> np.ndarray:
    """A room [ny, nx] with a bright ceiling, a darker floor and a desk."""
    direction, _ = pixel_directions(view)
    up = direction[..., 2]
    luminance = walls * (1 + 0.8 * up + 0.3 * direction[..., 0])
    luminance[(up < -0.3) & (up > -0.5) & (np.abs(direction[..., 0]) < 0.3)] = 2.5 * walls
    return luminance


def window(view: View, luminance: np.ndarray, sky: float, *, slats: int = 0, width: float = 0.8):
    """Put a window towards +y into a picture: a graded sky, slats before it if asked for."""
    direction, _ = pixel_directions(view)
    ahead = np.maximum(direction[..., 1], 1e-6)
    across, along = direction[..., 0] / ahead, direction[..., 2] / ahead
    glass = (np.abs(across) < width) & (along > -0.25) & (along < 0.9) & (direction[..., 1] > 0)
    luminance = np.where(glass, sky * (0.7 + along), luminance)
    if slats:
        shaded = glass & (np.mod(along * slats, 1.0) > 0.35)
        luminance = np.where(shaded, 0.25 * sky * (1 + 0.2 * np.sin(40 * across)), luminance)
    return luminance


def disc(view: View, luminance: np.ndarray, towards, radius: float, value: float) -> np.ndarray:
    """Put a round source of angular radius `radius` [rad] into a picture."""
    direction, _ = pixel_directions(view)
    towards = np.asarray(towards, float) / np.linalg.norm(towards)
    return np.where(direction @ towards > np.cos(radius), value, luminance)


def _angular(text: str, width: int = SIZE, height: int = SIZE) -> View:
    return parse_view(f"-vta -vh 180 -vv 180 {text}", width, height)


AHEAD = fisheye((0, 0, 1.2), (0, 1, 0), SIZE)
VIEWS = {
    "ahead": AHEAD,
    "askew": _angular("-vd 0.4 1 0.1"),
    "tilted": _angular("-vd 0 1 -0.5"),
    "upwards": _angular("-vd -0.3 1 0.6"),
    "odd size": _angular("-vd 0.1 1 0", 201, 201),
    "wide": parse_view("-vta -vh 182 -vv 182 -vd 0 1 0", SIZE, SIZE),
    "narrow": parse_view("-vta -vh 110 -vv 80 -vd 0 1 0", 240, 176),
    "hemispherical": fisheye((0, 0, 1.2), (0.2, 1, 0), SIZE, kind="hemispherical"),
}


def _clear(view):
    return window(view, room(view), 5000)


def _sun(view):
    return disc(view, _clear(view), (0.2, 1, 0.5), 0.02, 2e7)


def _blinds(view):
    return window(view, room(view), 6500, slats=14)


def _blinds_sun(view):
    return disc(view, _blinds(view), (-0.3, 1, 0.35), 0.03, 3e6)


def _overcast(view):
    return window(view, room(view, 25), 2400, width=1.4)


def _lamps(view):
    picture = room(view, 40)
    for x in (-0.5, 0.0, 0.5):
        picture = disc(view, picture, (x, 1, 0.8), 0.06, 9000)
        picture = disc(view, picture, (x, 1, 0.45), 0.03, 70000)
    return picture


def _scattered(view):
    random = np.random.default_rng(view.width)
    picture = room(view, 30)
    for _ in range(45):
        towards = random.normal(size=3) + np.array([0, 1.2, 0])
        picture = disc(view, picture, towards, random.uniform(0.01, 0.06), 10 ** random.uniform(3, 6))
    return picture


def _noise(view):
    picture = _overcast(view)
    return picture * np.random.default_rng(7).lognormal(0, 0.5, picture.shape)


PICTURES = {
    "no source": room,
    "dark": lambda view: 0.02 * room(view),
    "black": lambda view: 0 * room(view),
    "very bright": lambda view: 60 * _clear(view),
    "clear sky": _clear,
    "sun in view": _sun,
    "blinds": _blinds,
    "sun through blinds": _blinds_sun,
    "overcast": _overcast,
    "lamps": _lamps,
    "scattered": _scattered,
    "noisy": _noise,
}

CASES = [(picture, view) for view in ("ahead", "askew", "hemispherical") for picture in PICTURES]
CASES += [
    (picture, view)
    for view in ("tilted", "upwards", "odd size", "wide", "narrow")
    for picture in ("sun in view", "sun through blinds", "scattered")
]
