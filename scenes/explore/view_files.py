"""The data files of a view: what its states share, and each state's patterns and codes."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.picture_year.year import PictureYear
from scenes.explore.packing import packed, write_data

HOURS_A_FILE = 400  # whose codes are loaded together: about a month of daylight


def view_facts(view: View) -> dict[str, Any]:
    """The projection as the page takes it."""
    return {
        "kind": view.kind, "direction": view.direction, "up": view.up,
        "horizontal": view.horizontal_deg, "vertical": view.vertical_deg,
        "width": view.width, "height": view.height,
    }  # fmt: skip


def view_arrays(year: PictureYear) -> dict[str, Any]:
    """What the pictures of all states share."""
    return {
        "pixels": packed(year.pixels, "i4"),
        "row": packed(year.row, "i4"),
        "share": packed(year.share, "f4"),
        "blind": packed(np.packbits(_blind(year), bitorder="little"), "u1"),
    }


def write_pictures(folder: Path, name: str, year: PictureYear) -> None:
    """Write a state's model and the files of its hours' codes, `name`_0, `name`_1 and so on."""
    codes = []
    for number, first in enumerate(range(0, len(year.codes), HOURS_A_FILE)):
        some = year.codes[first : first + HOURS_A_FILE]
        codes.append({"first": first, "sizes": [len(code) for code in some]})
        text = base64.b64encode(b"".join(some)).decode("ascii")
        write_data(folder / f"{name}_{number}.js", text)
    facts = {"codes": codes, "rows_step": year.rows.step, "windows_step": year.windows.step}
    write_data(folder / f"{name}.js", {"facts": facts, "arrays": _model_arrays(year)})


def _model_arrays(year: PictureYear) -> dict[str, Any]:
    lit = [hour for hour, discs in enumerate(year.discs) for _ in discs]
    rows = [[*d.direction, d.luminance, d.solid_angle] for discs in year.discs for d in discs]
    arrays = {
        "window": packed(year.window, "i4"),
        "floor": packed(year.floor, "f4"),
        "disc_hour": packed(lit, "i4"),
        "disc": packed(np.array(rows, dtype=float), "f4"),
    }
    for i, (name, patterns) in enumerate((("rows", year.rows), ("windows", year.windows))):
        arrays |= {
            f"{name}_typical": packed(patterns.typical, "f4"),
            f"{name}_pattern": packed(patterns.pattern, "i2"),
            f"{name}_scale": packed(year.scale[i], "f4"),
            f"{name}_amounts": packed(year.amounts[i], "i2"),
            f"{name}_amount_step": packed(year.amount_step[i], "f4"),
        }
    return arrays


def _blind(year: PictureYear) -> NDArray[np.bool_]:
    """Pixels [n] that are not near themselves by rounding, as evalglare has it; see `glare.scan`.

    A browser's cosines may differ in the last digit, which would change how pixels are grouped.
    """
    x, y, z = pixel_directions(year.view)[0].reshape(-1, 3)[year.pixels].T
    return x * x + y * y + z * z > 1.0
