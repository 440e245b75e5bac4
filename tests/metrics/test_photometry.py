"""Photometry of luminaires: both file formats, and their light in a room against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from bim.electric_light import Luminaire, lamp_light
from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import read_photometry

GAMMA = np.arange(0.0, 91.0, 5.0)


def ies(c, gamma, values, *, lumens=-1.0, factor=1.0, watts=20.0, kind=1) -> str:
    numbers = "\n".join(" ".join(f"{v:.6g}" for v in row) for row in values)
    angles = " ".join(map(str, gamma)) + "\n" + " ".join(map(str, c))
    return (
        "IESNA:LM-63-2002\n[TEST] none\n[LUMINAIRE] Downlight\nTILT=NONE\n"
        f"1 {lumens} {factor} {len(gamma)} {len(c)} {kind} 2 0 0 0\n1.0 1.0 {watts}\n"
        f"{angles}\n{numbers}\n"
    )


def ldt(symmetry, planes, gamma, values, *, lumens=1000.0, watts=20.0) -> str:
    step = 360.0 / planes
    head = [
        "maker",
        2,
        symmetry,
        planes,
        step,
        len(gamma),
        5,
        "report",
        "Downlight",
        "1",
        "x.ldt",
        "date",
        100,
        0,
        0,
        80,
        0,
        0,
        0,
        0,
        0,
        100,
        100,
        1.0,
        0,
        1,
    ]
    lamps = [1, "LED", lumens, "830", "80", watts]
    ratios = [0.5] * 10
    c = [step * n for n in range(planes)]
    return "\n".join(map(str, [*head, *lamps, *ratios, *c, *gamma, *np.ravel(values)])) + "\n"


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_cosine_has_its_flux_in_both_formats(tmp_path) -> None:
    """I0 cos(gamma) gives pi I0 lumens."""
    row = 1000.0 * np.cos(np.radians(GAMMA))
    for one in (
        read_photometry(written(tmp_path, "a.ies", ies([0.0], GAMMA, [row]))),
        read_photometry(written(tmp_path, "a.ldt", ldt(1, 24, GAMMA, row, lumens=1000.0))),
    ):
        assert one.name == "Downlight" and one.watts == 20.0
        assert one.lumens == pytest.approx(np.pi * 1000.0, rel=0.005)
        assert one.intensity([0, 0, -1.0]) == pytest.approx(1000.0)
        assert one.intensity([np.sqrt(0.75), 0, -0.5]) == pytest.approx(500.0)
        assert one.intensity([0, 0, 1.0]) == 0.0
    doubled = ies([0.0], GAMMA, [row], factor=2.0)
    assert read_photometry(written(tmp_path, "b.ies", doubled)).lumens == pytest.approx(2 * np.pi * 1000.0, rel=0.005)


def test_planes_are_completed_by_symmetry(tmp_path) -> None:
    """An intensity that grows with the angle from C0: each symmetry mirrors it."""
    down = np.cos(np.radians(GAMMA))

    def at(photometry, c_deg):
        c, g = np.radians(c_deg), np.radians(40.0)
        return float(photometry.intensity([np.sin(g) * np.cos(c), np.sin(g) * np.sin(c), -np.cos(g)]))

    quarter = [down * (100 + c) for c in (0.0, 45.0, 90.0)]
    full = np.cos(np.radians(40.0))
    for one in (
        read_photometry(written(tmp_path, "q.ies", ies([0.0, 45.0, 90.0], GAMMA, quarter))),
        read_photometry(written(tmp_path, "q.ldt", ldt(4, 8, GAMMA, quarter))),
    ):
        for c in (45.0, 135.0, 225.0, 315.0):
            assert at(one, c) == pytest.approx(145 * full, rel=1e-5), c
        assert at(one, 90.0) == at(one, 270.0) == pytest.approx(190 * full, rel=1e-5)
    half = [down * (100 + c) for c in (0.0, 45.0, 90.0, 135.0, 180.0)]
    for one in (
        read_photometry(written(tmp_path, "h.ies", ies([0, 45, 90, 135, 180], GAMMA, half))),
        read_photometry(written(tmp_path, "h.ldt", ldt(2, 8, GAMMA, half))),
    ):
        assert at(one, 135.0) == at(one, 225.0) == pytest.approx(235 * full, rel=1e-5)
    c = np.arange(90.0, 271.0, 45.0)
    half = [down * (100 + v) for v in c]
    one = read_photometry(written(tmp_path, "r.ies", ies(c, GAMMA, half)))
    assert at(one, 225.0) == at(one, 315.0) == pytest.approx(325 * full, rel=1e-5)
    assert at(one, 0.0) == at(one, 180.0) == pytest.approx(280 * full, rel=1e-5)
    side = [down * (300 + c) for c in (-90.0, -45.0, 0.0, 45.0, 90.0)]  # from C270 over C0 to C90
    one = read_photometry(written(tmp_path, "s.ldt", ldt(3, 8, GAMMA, side)))
    assert at(one, 45.0) == at(one, 135.0) == pytest.approx(345 * full, rel=1e-5)
    assert at(one, 270.0) == pytest.approx(210 * full, rel=1e-5)
    assert at(one, 315.0) == at(one, 225.0) == pytest.approx(255 * full, rel=1e-5)
    whole = [down * (100 + c) for c in np.arange(0.0, 360.0, 45.0)]
    one = read_photometry(written(tmp_path, "w.ldt", ldt(0, 8, GAMMA, whole)))
    assert at(one, 225.0) == pytest.approx(325 * full, rel=1e-5) and at(one, 315.0) != at(one, 45.0)


def isotropic(tmp_path):
    gamma = np.arange(0.0, 181.0, 5.0)
    return read_photometry(written(tmp_path, "i.ies", ies([0.0], gamma, [np.full(37, 100.0)])))


def test_direct_light_is_that_of_a_point(tmp_path) -> None:
    """E = I cos^3 / h^2 on a level plane."""
    space = shoebox(6.0, 6.0, 3.0).spaces[0]
    lamp = Luminaire(isotropic(tmp_path), (3.0, 3.0, 2.8))
    points = np.array([[3.0, 3.0, 0.8], [4.5, 3.0, 0.8]])
    light = lamp_light(space, [lamp], points, paths=8)
    cosine = 2.0 / np.hypot(2.0, 1.5)
    assert light.direct == pytest.approx([25.0, 25.0 * cosine**3])


def test_a_cube_of_even_reflectance_keeps_its_flux(tmp_path) -> None:
    """A point in the middle of a cube: E of each face is flux / (6 A (1 - rho))."""
    rho, side = 0.6, 3.0
    cube = shoebox(side, side, side, windows=(), reflectance={"wall": rho, "floor": rho, "ceiling": rho}).spaces[0]
    photometry = isotropic(tmp_path)
    middle = (np.arange(12) + 0.5) * side / 12
    points = np.array([(x, y, 1e-3) for x in middle for y in middle])
    light = lamp_light(cube, [Luminaire(photometry, (1.5, 1.5, 1.5))], points, paths=64)
    assert photometry.lumens == pytest.approx(4 * np.pi * 100.0, rel=1e-3)
    expected = photometry.lumens / (6 * side**2 * (1 - rho))
    lost = rho**13  # of paths that are cut off
    assert light.mean == pytest.approx(expected, abs=4 * light.standard_error + expected * lost)
    assert light.standard_error < 0.01 * expected


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.ies", "IESNA\n", "no line TILT="),
        ("a.ies", ies([0.0], GAMMA, [np.ones(19)], kind=2), "type B"),
        ("a.ies", ies([0.0], GAMMA, [np.ones(18)]), "expected 19 intensities"),
        ("a.ies", ies([0.0, 30.0], GAMMA, np.ones((2, 19))), "no symmetry"),
        ("a.ies", ies([0.0], GAMMA, [np.ones(19)]).replace("NONE", "lamp.til"), "not read"),
        ("a.ies", ies([0.0], GAMMA, [np.full(19, np.nan)]), "'nan' is no number"),
        ("a.ies", ies([0.0], GAMMA, [np.ones(19)], kind=7), "unknown type"),
        ("a.ies", "TILT=NONE\n1 1 1 19 -2 1\n", "ends before its angles"),
        ("a.ies", ies([], GAMMA, [np.ones(19)]), "0 horizontal angles"),
        ("a.ldt", "maker\n1\n", "ends before line 3"),
        ("a.ldt", ldt(0, 8, GAMMA, np.ones(19)), "ends before line"),
        ("a.ldt", ldt(1, 8, GAMMA, np.ones(19)).replace("\n0\n1\n1\nLED", "\n0\n2\n1\nLED"), "2 sets"),
        ("a.ldt", ldt(7, 8, GAMMA, np.ones(19)), "symmetry 7"),
        ("a.uld", "", "as .ies or .ldt"),
    ],
)
def test_what_is_not_read_is_refused(tmp_path, name, text, words) -> None:
    with pytest.raises(DataError, match=words):
        read_photometry(written(tmp_path, name, text))
