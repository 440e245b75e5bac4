"""Template rooms: alike up to a shift, not up to a turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bim.model import Face, Space, Window
from bim.shoebox import WindowRectangle, shoebox
from bim.templates import template_rooms

ONE = WindowRectangle(0.5, 0.9, 1.2, 1.5, frame=0.05)


def shifted(space: Space, shift) -> Space:
    def moved(part: Face | Window):
        return replace(part, triangles=part.triangles + shift)

    return replace(
        space,
        faces=tuple(moved(face) for face in space.faces[::-1]),  # their order does not matter
        windows=tuple(moved(window) for window in space.windows),
    )


def test_shifted_rooms_are_one_and_turned_rooms_are_not():
    room = shoebox(windows=(ONE,), recess=0.2).spaces[0]
    above = shifted(room, np.array([4.3, 0.002, 3.2]))
    turned = shoebox(windows=(ONE,), recess=0.2, facing_deg=90).spaces[0]
    groups = template_rooms([room, turned, above])
    assert [[space is one for space in (room, turned, above)] for (one, *_) in groups] == [
        [True, False, False],
        [False, True, False],
    ]
    assert groups[0] == (room, above)


def test_differences_that_matter_keep_rooms_apart():
    room = shoebox(windows=(ONE,)).spaces[0]
    others = [
        shoebox(windows=(replace(ONE, x=0.52),)).spaces[0],
        shoebox(windows=(ONE,), reflectance={"floor": 0.21}).spaces[0],
        shoebox(windows=(ONE,), adjacency={"back": "ground"}).spaces[0],
        shoebox(4.02, windows=(ONE,)).spaces[0],
    ]
    assert len(template_rooms([room, *others])) == 5
