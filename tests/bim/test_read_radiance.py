"""Radiance scene files: primitives, commands, materials; judged by Radiance's own programs."""

from __future__ import annotations

import numpy as np
import pytest

import bim
from bim.radiance.scene import read_radiance
from mitsuba_cfs.errors import CfsError, DataError
from mitsuba_cfs.surfaces import triangle_areas
from tests.bim.bim_fuzz import mutations, refusals
from tests.conftest import REPOSITORY
from tests.radiance import run

GREY = "void plastic grey\n0\n0\n5 .5 .5 .5 0 0\n"
SQUARE = "grey polygon square\n0\n0\n12 0 0 0  1 0 0  1 1 0  0 1 0\n"


def write(folder, text, name="scene.rad"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def area(things):
    return sum(triangle_areas(thing.triangles).sum() for thing in things)


def of_own(scene):
    """Sorted corners of every polygon, with name and material."""
    return [
        (thing.name, thing.material.name, np.unique(thing.triangles.reshape(-1, 3).round(6), axis=0))
        for thing in scene.objects
    ]


def test_a_polygon_keeps_its_front_and_its_material(tmp_path):
    (thing,) = read_radiance(write(tmp_path, "# a comment\n" + GREY + SQUARE)).objects
    assert thing.name == "square"
    assert thing.material.diffuse == pytest.approx(0.5)
    normals = np.cross(*np.diff(thing.triangles, axis=1).swapaxes(0, 1))
    assert np.allclose(normals / np.linalg.norm(normals, axis=1)[:, None], [0, 0, 1])


def test_units_of_length_become_metres(tmp_path):
    path = write(tmp_path, GREY + SQUARE)
    assert area(read_radiance(path, scale=0.01).objects) == pytest.approx(1e-4)


def test_a_polygon_with_a_hole_on_a_seam_has_its_area(tmp_path):
    corners = "0 0 0  4 0 0  4 3 0  0 3 0  0 0 0  1 1 0  1 2 0  2 2 0  2 1 0  1 1 0"
    text = f"{GREY}grey polygon wall\n0\n0\n30 {corners}\n"
    (thing,) = read_radiance(write(tmp_path, text)).objects
    assert area([thing]) == pytest.approx(11.0)
    middles = thing.triangles.mean(axis=1)
    assert not ((np.abs(middles[:, :2] - 1.5) < 0.5).all(axis=1)).any()


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ("sphere s\n0\n0\n4 1 2 3 0.5", np.pi),
        ("bubble s\n0\n0\n4 1 2 3 0.5", np.pi),
        ("cylinder s\n0\n0\n7 0 0 0 0 0 2 0.5", 2 * np.pi),
        ("tube s\n0\n0\n7 0 0 0 0 0 2 0.5", 2 * np.pi),
        ("cone s\n0\n0\n8 0 0 0 0 0 1 1 0", np.pi * np.sqrt(2)),
        ("ring s\n0\n0\n8 1 1 1 0 0 1 0.5 1", 0.75 * np.pi),
    ],
)
def test_round_shapes_have_their_area_and_front(tmp_path, shape, expected):
    (thing,) = read_radiance(write(tmp_path, f"{GREY}grey {shape}\n")).objects
    assert area([thing]) == pytest.approx(expected, rel=5e-3)
    triangles = thing.triangles
    vectors = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    if shape.startswith("ring"):
        assert (vectors[:, 2] > 0).all()
        return
    volume = np.einsum("ij,ij->", vectors, triangles.mean(axis=1) - triangles.mean(axis=(0, 1)))
    assert (volume < 0) == shape.startswith(("bubble", "tube"))


MOVES = [
    "-t 1 2 3 -rz 30 -s 2",
    "-rx 20 -ry 35 -mx",
    "-a 3 -t 2 0 0 -a 2 -t 0 3 0 -i 1 -rz 90",
    "-n copy -i 3 -rz 10 -t 0 0 1",
]


@pytest.mark.parametrize("options", MOVES)
def test_xform_moves_as_radiance_does(tmp_path, options):
    pytest.importorskip("pyradiance")
    triangle = "grey polygon t\n0\n0\n9 0 0 0  1 0 0  0.2 0.7 0.3\n"
    write(tmp_path, triangle, "part.rad")
    ours = read_radiance(write(tmp_path, f"{GREY}!xform {options} part.rad\n"))
    text = run(f"xform {options} part.rad", tmp_path).decode()
    theirs = read_radiance(write(tmp_path, GREY + text, "their.rad"))
    _same_corners(ours, theirs)


@pytest.mark.parametrize(
    "command",
    [
        "genbox grey box 1 2 3",
        "genbox grey box 1 2 3 -i",
        "genprism grey p 5 0 0  2 0  2 1  1 1  1 2 -l 0 0 1.5",
        "genprism grey p 5 0 0  1 2  1 1  2 1  2 0 -l 0 0 1.5",
        "genprism grey p 3 0 0  2 0  1 1 -l 0.2 0 -1 -e",
        "genbox grey box 1 2 3 | xform -t 1 1 1 -rz 45",
    ],
)
def test_generators_make_what_radiance_makes(tmp_path, command):
    pytest.importorskip("pyradiance")
    ours = read_radiance(write(tmp_path, f"{GREY}!{command}\n"))
    text = run(command, tmp_path).decode()
    text = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    theirs = read_radiance(write(tmp_path, GREY + text, "their.rad"))
    _same_corners(ours, theirs)


def _same_corners(ours, theirs):
    assert len(ours.objects) == len(theirs.objects)
    left = list(theirs.objects)
    for mine in ours.objects:
        vector = _vector(mine)
        match = [
            other
            for other in left
            if np.allclose(_vector(other), vector, atol=1e-5) and np.allclose(_middle(other), _middle(mine), atol=1e-5)
        ]
        assert match, mine.name
        left = [other for other in left if other is not match[0]]


def _vector(thing):
    t = thing.triangles
    return np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]).sum(axis=0)


def _middle(thing):
    return np.average(thing.triangles.mean(axis=1), axis=0, weights=triangle_areas(thing.triangles))


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        ("plastic m\n0\n0\n5 .5 .4 .3 .1 .05", {"diffuse": 0.9 * 0.42, "mirrored": 0.1}),
        ("plastic m\n0\n0\n5 .5 .5 .5 .2 .6", {"diffuse": 0.6, "mirrored": 0.0}),
        ("metal m\n0\n0\n5 .5 .5 .5 .8 .05", {"diffuse": 0.1, "mirrored": 0.4}),
        ("trans m\n0\n0\n7 .8 .8 .8 .1 0 .5 .25", {"diffuse": 0.36, "transmitted": 0.27, "straight": 0.09}),
        ("mirror m\n0\n0\n3 .9 .9 .9", {"mirrored": 0.9}),
        ("glass m\n0\n0\n3 .9 .9 .9", {"transmissivity": 0.9, "index": 1.52, "mirrored": 0.04258 * (1 + 0.9 * 0.8252)}),
        ("dielectric m\n0\n0\n5 .9 .9 .9 1.33 0", {"transmissivity": 0.9, "index": 1.33}),
    ],
)
def test_materials_reflect_and_pass_by_their_formulas(tmp_path, material, expected):
    text = f"void {material}\n{SQUARE.replace('grey', 'm')}"
    found = read_radiance(write(tmp_path, text)).objects[0].material
    mirrored = found.gloss.at_normal if found.gloss else 0.0
    values = {name: mirrored if name == "mirrored" else getattr(found, name) for name in expected}
    assert values == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("material", ["BSDF m\n6 0.1 blind.xml 0 0 1 .\n0\n0", "aBSDF m\n5 blind.xml 0 0 1 .\n0\n0"])
def test_a_bsdf_names_its_file(tmp_path, material):
    text = f"void {material}\n{SQUARE.replace('grey', 'm')}"
    (thing,) = read_radiance(write(tmp_path, text)).objects
    assert thing.material.bsdf == "blind.xml"
    assert not thing.material.is_opaque


def test_a_facade_of_glass_mirrors_and_nothing_passes(tmp_path):
    text = GREY + SQUARE + "void glass pane\n0\n0\n3 .9 .9 .9\n" + SQUARE.replace("grey", "pane")
    scene = read_radiance(write(tmp_path, text))
    assert not bim.opaque_surfaces(scene).glossy
    assert bim.opaque_surfaces(scene, ["pane"]).glossy == [1]


def test_the_last_definition_before_a_surface_counts_and_an_alias_leads_on(tmp_path):
    darker = GREY.replace(".5 .5 .5", ".2 .2 .2")
    other = "void alias other grey\n" + SQUARE.replace("grey", "other")
    scene = read_radiance(write(tmp_path, GREY + SQUARE + darker + SQUARE + other))
    assert [thing.material.diffuse for thing in scene.objects] == pytest.approx([0.5, 0.2, 0.2])
    assert len(scene.of_modifiers(["other"])) == 1


def test_an_alias_has_the_patterns_that_it_names_or_inherits_those_of_the_material(tmp_path):
    half = "void brightfunc half\n2 .5 .\n0\n0\n"
    text = half + GREY + GREY.replace("void plastic grey", "half plastic dim")
    for modifier, name, reference in (("half", "one", "grey"), ("void", "two", "dim"), ("inherit", "three", "dim")):
        text += f"{modifier} alias {name} {reference}\n" + SQUARE.replace("grey", name)
    diffuse = [one.material.diffuse for one in read_radiance(write(tmp_path, text)).objects]
    assert diffuse == pytest.approx([0.25, 0.5, 0.25])


def test_the_back_of_a_mirror_is_black(tmp_path):
    text = "void mirror glare\n0\n0\n3 .9 .9 .9\n" + SQUARE.replace("grey", "glare")
    front, back = read_radiance(write(tmp_path, text)).objects
    assert front.material.gloss.at_normal == pytest.approx(0.9)
    assert back.material.gloss is None and back.material.diffuse == 0
    assert back.normal == pytest.approx(-front.normal)
    apart = (back.triangles[0, 0] - front.triangles[0, 0]) @ front.normal
    assert -1e-3 < apart < 0
    with pytest.raises(DataError, match=r"mirror glare: its other material grey is not computed"):
        read_radiance(write(tmp_path, GREY + text.replace("glare\n0", "glare\n1 grey")))


def test_what_is_not_used_is_named_once_with_its_count(tmp_path):
    text = (
        GREY
        + "void brightfunc clouds\n2 bright clouds.cal\n0\n0\n"
        + GREY.replace("void", "clouds").replace("grey", "painted")
        + 2 * SQUARE.replace("grey", "painted")
        + "void glow sun\n0\n0\n4 1 1 1 0\nsun source sky\n0\n0\n4 0 0 1 180\n"
        + "void mixfunc half\n4 grey grey half half.cal\n0\n0\n"
        + 3 * SQUARE.replace("grey", "half")
    )
    scene = read_radiance(write(tmp_path, text))
    assert len(scene.objects) == 2
    assert [(issue.code, issue.values["type"]) for issue in scene.issues] == [
        ("material-patterns-left-out", ""),
        ("primitives-not-read", "source"),
        ("surfaces-not-read", "mixfunc"),
    ]
    last = scene.issues[2].values
    assert (last["count"], last["first"]) == (3, "square")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (SQUARE, "scene.rad:1: polygon square: its modifier grey is not defined before it"),
        (GREY + SQUARE[:-9], "scene.rad:5: no Radiance scene: ends before its numbers"),
        (GREY + SQUARE.replace("12 0", "x 0"), "scene.rad:5: no Radiance scene: the count"),
        (GREY + SQUARE.replace("12 0", "12 nan"), "scene.rad:5: no Radiance scene: a number"),
        (GREY.replace(".5 .5 .5", "2 2 2") + SQUARE, "plastic grey: reflects or passes more"),
        ("!rm -rf x\n", "scene.rad:1: !rm: is not run"),
        ("!xform a.rad; rm x\n", "only programs and their pipes are read, no shell"),
        ("!genbox grey b 1 2 3 -r .1\n", "!genbox: option -r is not read"),
        ("!xform -t 1 2 part.rad\n", "-t: a number below 1e+30 is expected, got 'part.rad'"),
        ("!xform /etc/passwd\n", "/etc/passwd: an absolute path"),
        ("!xform ../other.rad\n", "../other.rad: lies outside the scene's folder"),
        ("!xform missing.rad\n", "missing.rad: cannot be read"),
        ("!xform scene.rad\n", "scene.rad calls itself"),
        ("!xform -a 99999 -a 99999 scene.rad\n", "copies are more than"),
        ("\0\1", "is no text"),
        ("#?RADIANCE\noconv a.rad\nFORMAT=Radiance_octree\n\n\0", "is an octree"),
    ],
)
def test_what_cannot_be_read_is_told_in_one_line(tmp_path, text, told):
    with pytest.raises(DataError) as caught:
        read_radiance(write(tmp_path, text))
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_damaged_files_end_in_one_line(tmp_path):
    whole = GREY + SQUARE + "!genbox grey b 1 2 3 | xform -t 1 0 0 -a 3 -rz 20\n" + SQUARE
    rng = np.random.default_rng(7)
    scraps = ["", " ", "\n", "!", "#", "-1", "1e400", '"', "polygon", "alias", "void", "9" * 12]
    for _ in range(400):
        text = list(whole)
        for _ in range(int(rng.integers(1, 4))):
            place = int(rng.integers(len(text)))
            text[place : place + int(rng.integers(1, 20))] = scraps[int(rng.integers(len(scraps)))]
        path = write(tmp_path, "".join(text))
        try:
            read_radiance(path)
        except CfsError as error:
            assert "\n" not in str(error)


def box(folder):
    """A room 4 x 6 x 3 m with a pane in its south wall; the pane's corners as given."""
    pane = "pane polygon p\n0\n0\n12 1 0 1  3 0 1  3 0 2  1 0 2\n"
    hole = "1 0 1  1 0 2  3 0 2  3 0 1  1 0 1"
    wall = f"grey polygon w\n0\n0\n30 0 0 0  4 0 0  4 0 3  0 0 3  0 0 0  {hole}\n"
    sides = [
        "0 0 0 0 6 0 4 6 0 4 0 0",
        "0 0 3 4 0 3 4 6 3 0 6 3",
        "0 6 0 0 6 3 4 6 3 4 6 0",
        "0 0 0 0 0 3 0 6 3 0 6 0",
        "4 0 0 4 6 0 4 6 3 4 0 3",
    ]
    text = GREY + "void glass pane\n0\n0\n3 .9 .9 .9\n" + wall + pane
    text += "".join(f"grey polygon s{i}\n0\n0\n12 {side}\n" for i, side in enumerate(sides))
    return write(folder, text)


@pytest.mark.parametrize("turned", [False, True])
def test_an_aperture_faces_the_sky_whichever_way_it_was_drawn(tmp_path, turned):
    path = box(tmp_path)
    if turned:
        text = path.read_text()
        path.write_text(text.replace("1 0 1  3 0 1  3 0 2  1 0 2", "1 0 2  3 0 2  3 0 1  1 0 1"))
    (window,) = bim.scene_windows(read_radiance(path), ["pane"])
    assert window.normal == pytest.approx([0, -1, 0])
    assert window.area == pytest.approx(2)


def test_the_room_may_have_glass_on_its_other_side(tmp_path):
    text = box(tmp_path).read_text()
    path = write(tmp_path, text.replace("grey polygon s2", "pane polygon s2"))
    windows = bim.scene_windows(read_radiance(path), ["pane"])
    assert [tuple(w.normal.round(6)) for w in windows] == [(0, -1, 0), (0, 1, 0)]


def test_a_pane_in_the_open_has_no_outdoors(tmp_path):
    text = "void glass pane\n0\n0\n3 .9 .9 .9\n" + SQUARE.replace("grey", "pane").replace(
        "1 0 0  1 1 0  0 1 0", "1 0 0  1 0 1  0 0 1"
    )
    with pytest.raises(DataError, match="which one is outdoors"):
        bim.scene_windows(read_radiance(write(tmp_path, text)), ["pane"])


def test_glass_passes_what_radiance_says():
    """The manual's formula of the transmissivity that gives a transmittance straight on."""
    tn = 0.88
    tau = (np.sqrt(0.8402528435 + 0.0072522239 * tn * tn) - 0.9166530661) / 0.0036261119 / tn
    pane = bim.RadianceMaterial("pane", "glass", transmissivity=tau)
    passed, mirrored = bim.glass_shares(pane)
    assert passed[-1] == pytest.approx(tn, abs=2e-6)
    assert passed[0] == pytest.approx(0, abs=1e-9)
    assert mirrored[0] == pytest.approx(1)
    assert (passed + mirrored).max() <= 1 + 1e-9


def test_no_glass_has_no_transmittance():
    with pytest.raises(DataError, match="cloth: is trans, not glass"):
        bim.glass_shares(bim.RadianceMaterial("cloth", "trans"))


def test_random_bytes_give_one_line(tmp_path):
    whole = (REPOSITORY / "docs" / "tutorials" / "office.rad").read_bytes()
    refused = refusals(tmp_path / "spoilt.rad", mutations(whole, 120), read_radiance)
    assert 60 < refused < 120
