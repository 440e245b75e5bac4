"""The up vector of a BSDF: an asymmetric one turned as Radiance turns it, by HBJSON and `.rad`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bim.honeybee.building import read_honeybee
from bim.honeybee.write import write_honeybee
from bim.radiance.layers import up_vector
from bim.radiance.scene import read_radiance
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import DataError
from tests.bim.honeybee_models import opening, two_rooms, write
from tests.radiance import run

SIDE, ROOF = 0, 5  # faces of the office
RINGS = {
    SIDE: [[1.0, 0.0, 0.9], [4.0, 0.0, 0.9], [4.0, 0.0, 2.4], [1.0, 0.0, 2.4]],
    ROOF: [[1.0, 2.0, 3.0], [4.0, 2.0, 3.0], [4.0, 4.0, 3.0], [1.0, 4.0, 3.0]],
}
HONEYBEE = [0.01, 0.01, 1.0]  # honeybee-schema's default
CASES = {
    "wall, default": (SIDE, None),
    "wall on its side": (SIDE, [1, 0, 0]),
    "wall upside down": (SIDE, [0.2, 0.3, -1]),
    "skylight, default": (ROOF, None),
    "skylight, north": (ROOF, [0, 1, 0]),
    "skylight, west": (ROOF, [-1, 0, 0.4]),
}


def asymmetric() -> KlemsBsdf:
    """Each pair of patches has a value of its own, by reciprocity the same from either side."""
    size = KLEMS_FULL.size
    values = np.random.default_rng(3).uniform(0.05, 1.0, (size, size)) * 0.5 / np.pi
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, transmission_front=values).filled()


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("orientation")
    write_bsdf_xml(BsdfFile({"Visible": asymmetric()}), folder / "blind.xml")
    return folder


def model_with(folder: Path, face: int, up, **more) -> dict:
    model = two_rooms()
    modifier = {"type": "BSDF", "identifier": "cfs", "bsdf_data": (folder / "blind.xml").read_text()} | more
    if up is not None:
        modifier["up_orientation"] = up
    model["properties"]["radiance"]["modifiers"].append(modifier)
    properties = {"energy": {}, "radiance": {"modifier": "cfs"}}
    one = opening("Glazed", RINGS[face], properties=properties)
    model["rooms"][0]["faces"][face]["apertures"] = [one]
    return model


def window_of(path: Path):
    return next(w for w in read_honeybee(path).space("Office").windows if w.name == "Glazed")


@pytest.mark.parametrize("case", CASES)
def test_light_behind_a_window_is_that_of_rtrace(folder, tmp_path, case):
    """Radiance [1] behind a BSDF by a small light: f cos(theta) solid angle, within a percent."""
    pytest.importorskip("pyradiance")
    face, up = CASES[case]
    window = window_of(write(model_with(folder, face, up), tmp_path))
    frame = window_frame(window.normal, window.up)
    for light, sight in ((50, 80), (17, 101), (90, 30)):  # incident and outgoing patches
        towards = KLEMS_FULL.incident_directions()[light] @ frame
        leaving = KLEMS_FULL.outgoing_directions()[sight] @ frame
        value = traced(tmp_path, folder, RINGS[face], window, up or HONEYBEE, towards, leaving)
        cosine = towards @ window.normal
        solid_angle = 2 * np.pi * (1 - np.cos(np.radians(0.5)))
        expected = asymmetric().transmission_front[sight, light] * cosine * solid_angle * 1e6
        assert value == pytest.approx(expected, rel=0.01), (case, light, sight)


def traced(tmp_path, folder, ring, window, up, towards, leaving) -> float:
    """Value of a ray against the light that leaves, by rtrace; the front of the pane is indoors."""
    corners = " ".join(f"{x:g}" for point in ring for x in point)
    side = np.array(ring)
    normal = np.cross(side[1] - side[0], side[2] - side[1])
    if normal @ window.normal > 0:
        corners = " ".join(f"{x:g}" for point in ring[::-1] for x in point)
    text = (
        f"void BSDF cfs\n6 0 {folder / 'blind.xml'} {' '.join(map(str, up))} .\n0\n0\n"
        f"cfs polygon pane\n0\n0\n12 {corners}\n"
        "void light lamp\n0\n0\n3 1e6 1e6 1e6\n"
        f"lamp source sun\n0\n0\n4 {' '.join(f'{x:.9g}' for x in towards)} 1\n"
    )
    (tmp_path / "scene.rad").write_text(text)
    start = window.centre + 0.5 * leaving
    ray = " ".join(f"{x:.9g}" for x in (*start, *-leaving))
    options = "-h -ab 0 -ss 0 -dj 0 -st 0 -dc 1 -dt 0"
    out = run(f"oconv scene.rad > scene.oct && rtrace {options} scene.oct", tmp_path, ray.encode())
    return float(out.split()[1])


@pytest.mark.parametrize("case", CASES)
def test_both_readers_have_the_same_up_vector(folder, tmp_path, case):
    face, up = CASES[case]
    window = window_of(write(model_with(folder, face, up), tmp_path))
    corners = " ".join(f"{x:g}" for point in RINGS[face] for x in point)
    path = tmp_path / "scene.rad"
    path.write_text(
        f"void BSDF cfs\n6 0 {folder / 'blind.xml'} {' '.join(map(str, up or HONEYBEE))} .\n0\n0\n"
        f"cfs polygon pane\n0\n0\n12 {corners}\n"
    )
    (pane,) = read_radiance(path).objects
    np.testing.assert_allclose(window.up, up_vector(pane), atol=1e-9)


def test_a_transformation_turns_the_up_vector(folder, tmp_path):
    model = model_with(folder, ROOF, [0, 1, 0], transform="-rz 90")
    np.testing.assert_allclose(window_of(write(model, tmp_path)).up, [-1, 0, 0], atol=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_an_export_keeps_the_orientation(folder, tmp_path, case):
    face, up = CASES[case]
    path = write(model_with(folder, face, up), tmp_path)
    before = window_of(path)
    write_honeybee(read_honeybee(path), tmp_path / "again.hbjson")
    after = window_of(tmp_path / "again.hbjson")
    np.testing.assert_allclose(window_frame(after.normal, after.up), window_frame(before.normal, before.up), atol=1e-5)


@pytest.mark.parametrize(
    ("face", "up", "more", "field"),
    [
        (SIDE, [0, 1, 0], {}, "up_orientation"),
        (ROOF, [0, 0, 1], {}, "up_orientation"),
        (SIDE, [0, 0, 0], {}, "up_orientation"),
        (SIDE, "north", {}, "up_orientation"),
        (SIDE, [0, None, 1], {}, "up_orientation"),
        (SIDE, None, {"function_file": "up.cal"}, "function_file"),
        (SIDE, None, {"transform": "-twist 3"}, "transform"),
    ],
)
def test_an_impossible_up_vector_is_refused_with_its_field(folder, tmp_path, face, up, more, field):
    with pytest.raises(DataError, match=rf"(Glazed|cfs): {field}: "):
        read_honeybee(write(model_with(folder, face, up, **more), tmp_path))


def test_states_with_different_up_vectors_are_refused(folder, tmp_path):
    model = model_with(folder, SIDE, [0, 0, 1])
    modifiers = model["properties"]["radiance"]["modifiers"]
    turned = json.loads(json.dumps(modifiers[-1])) | {"identifier": "turned", "up_orientation": [1, 0, 0]}
    modifiers.append(turned)
    window = model["rooms"][0]["faces"][SIDE]["apertures"][0]
    window["properties"]["radiance"] |= {"dynamic_group_identifier": "south", "states": [{}, {"modifier": "turned"}]}
    with pytest.raises(DataError, match="Glazed: states: BSDF turned has another up_orientation"):
        read_honeybee(write(model, tmp_path))
