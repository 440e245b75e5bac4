"""A room's picture in colour: its hour, colours and shading state, and where there is none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bim.colours import hue_of
from bim.model import Space
from bim.names import folder_names
from bim.templates import same_hues, template_rooms
from bim.to_tracer import band_scenes
from mitsuba_cfs.images.hdr import luminance, read_hdr
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.sky.annual import annual_sky
from scenes.result_folder import ResultFolder
from scenes.results import GlareResults, LuminancePicture
from scenes.room import glare
from scenes.room.glare import brightest_picture, with_colour
from scenes.room.surface_spectra import SurfaceTable, in_stated_colours, room_reflectance
from scenes.room.windows import in_all_windows, room_windows
from scenes.run.outputs import write_results
from tests.report.synthetic import run_result
from tests.scenes.small_box import BOX, ROOM, SMALL
from tests.scenes.test_equal_rooms import moved

VIEW = fisheye([1.5, 3.0, 1.2], [0.0, -1.0, 0.0], 32)
RED = hue_of((0.6, 0.1, 0.1))


def painted(room: Space, kind: str = "wall") -> Space:
    faces = tuple(replace(f, hue=RED) if f.kind == kind else f for f in room.faces)
    return replace(room, faces=faces)


def pictures() -> GlareResults:
    """Pictures of three hours; most light is at the eye in the second."""
    rng = np.random.default_rng(1)
    made = [
        LuminancePicture(h, rng.uniform(50, 5000, (32, 32)).astype(np.float32), {"ev": ev})
        for h, ev in ((1740, 900.0), (4116, 2500.0), (4118, 1200.0))
    ]
    return GlareResults(VIEW, tuple(made))


def coloured(room: Space, weather, states, hour: int = 4116, state: int = 0) -> GlareResults:
    windows = room_windows(room, in_all_windows(room, *states))
    building = replace(BOX, spaces=(room,))
    return with_colour(
        pictures(),
        band_scenes(building, room, windows.groups, VIEW),
        windows.optics_by_colour(windows.optics()),
        annual_sky(weather, 1, hours=[hour]),
        state=[state] * len(windows.groups),
        sampling=SMALL.sampling,
        progress=lambda *_: None,
    )


def test_the_brightest_picture_keeps_its_luminance_and_gets_the_rooms_colours(variant, weather, glass) -> None:
    found = coloured(painted(ROOM), weather, (glass,))
    assert found.pictures and found.colour is not None
    assert found.colour.hour == brightest_picture(found).hour == 4116
    pixels = found.colour.radiance
    assert luminance(pixels) == pytest.approx(found.pictures[1].luminance, rel=1e-4)
    # walls left and right of the view; between them ceiling above and floor below
    side, grey = pixels[14:18, 3:5], coloured(ROOM, weather, (glass,)).colour.radiance[14:18, 3:5]
    assert np.median(side[..., 0] / side[..., 2]) > 3 * np.median(grey[..., 0] / grey[..., 2])


def test_stated_colours_of_surfaces_are_in_the_picture(variant, weather, glass) -> None:
    windows = room_windows(ROOM, in_all_windows(ROOM, glass))
    options = SimpleNamespace(sampling=SMALL.sampling, sky={})
    light: Any = SimpleNamespace(light=SimpleNamespace(systems=windows.optics()))
    state = np.zeros((len(weather.midpoints), len(windows.groups)), dtype=np.int64)
    seen = []
    for tables in ((), (SurfaceTable(select="wall", colour="#b04a3a"),)):
        operation = SimpleNamespace(surface=tables)
        room: Any = SimpleNamespace(
            building=BOX, space=ROOM, windows=windows, weather=weather, options=options, operation=operation
        )
        side = glare.coloured(room, light, state, pictures()).colour.radiance[14:18, 3:5]
        seen.append(np.median(side[..., 0] / side[..., 2]))
    assert seen[1] > 3 * seen[0]


def test_a_stated_colour_is_the_hue_of_its_surfaces_alone() -> None:
    tables = SurfaceTable(select="wall", colour="#b04a3a"), SurfaceTable(select="ground", colour="#00ff00")
    red = hue_of([((v / 255 + 0.055) / 1.055) ** 2.4 for v in (0xB0, 0x4A, 0x3A)])
    dark = replace(ROOM, faces=tuple(replace(face, reflectance_visible=0.14) for face in ROOM.faces))
    for before, after in zip(dark.faces, in_stated_colours(dark, tables).faces, strict=True):
        # the smooth spectrum of the colour ends at 380 and 780 nm
        assert after.hue == (pytest.approx(red, rel=0.02) if before.kind == "wall" else before.hue)
        assert after.reflectance("visible") == before.reflectance("visible")


def test_a_bright_surface_has_the_paler_hue_of_its_light_by_wavelength() -> None:
    tables = (SurfaceTable(select="wall", colour="#b04a3a"),)
    bright = replace(ROOM, faces=tuple(replace(face, reflectance_visible=0.8) for face in ROOM.faces))
    spectra, _ = room_reflectance(bright, tables)
    assert spectra is not None and spectra.max() == pytest.approx(1.0)
    for face, spectrum in zip(in_stated_colours(bright, tables).faces, spectra, strict=False):
        if face.kind == "wall":
            blue, red = spectrum[70], spectrum[270]  # 450 and 650 nm
            assert 0.9 * blue < 0.8 * face.hue[2] < 1.1 * blue and 0.9 * red < 0.8 * face.hue[0] < 1.1 * red


def test_the_hours_shading_state_holds(variant, weather, glass, milk) -> None:
    """Through glass the sky is blue beside the ground; what scatters mixes both."""
    clear_view, mixed = (coloured(ROOM, weather, (glass, milk), state=state).colour.radiance for state in (0, 1))
    window = slice(12, 20), slice(12, 20)
    blue = [(p[..., 2] / p[..., 0])[window] for p in (clear_view, mixed)]
    assert np.ptp(blue[0]) > 1.5 * np.ptp(blue[1])


def test_what_would_be_grey_has_no_picture(variant, weather, glass) -> None:
    """Grey surfaces under an overcast sky; in colour they would have one there too."""
    beam, diffuse = weather.direct_normal, weather.diffuse_horizontal
    overcast = int(np.flatnonzero((beam == 0) & (diffuse > 100))[0])
    assert coloured(ROOM, weather, (glass,), overcast).colour is None
    assert coloured(painted(ROOM), weather, (glass,), overcast).colour is not None
    assert coloured(ROOM, weather, (glass,)).colour is not None, "a clear sky has its own colour"


def test_rooms_of_other_colours_are_told_apart() -> None:
    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    assert len(template_rooms([ROOM, painted(twin)])) == 1, "they reflect as much light"
    assert same_hues(ROOM, twin) and same_hues(painted(ROOM), painted(twin))
    assert not same_hues(ROOM, painted(twin))
    assert not same_hues(painted(ROOM), painted(twin, "floor"))


def test_the_picture_is_written_beside_the_others(tmp_path: Path) -> None:
    result = run_result(picture_size=48, pictures=2)
    write_results(result, ResultFolder(tmp_path / "out", "run"))
    names = folder_names([room.space for room in result.spaces])
    for room, name in zip(result.spaces, names, strict=True):
        (file,) = (tmp_path / "out" / name).glob("view_*_colour.hdr")
        assert file.with_suffix(".png").stat().st_size > 5_000
        colour = room.glare.colour
        assert f"{result.times[colour.hour]:%m-%d_%Hh}" in file.name
        shown = read_hdr(file)
        assert shown.luminance == pytest.approx(luminance(colour.radiance), rel=0.02, abs=1.0)
