"""CIE skies against gensky's formulas run by Radiance, and against their printed properties."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from mitsuba_cfs.sky.cie import GENERAL_SKIES, KINDS, cie_patches, relative_luminance
from mitsuba_cfs.sky.patches import ReinhartSky

FINE = ReinhartSky(6)
HEMISPHERE = FINE.directions[1:]
HIGH = HEMISPHERE[HEMISPHERE[:, 2] > 0.3]  # where gensky does not blend in its ground


def sun_at(altitude_deg: float, azimuth_deg: float) -> np.ndarray:
    alt, azi = np.radians([altitude_deg, azimuth_deg])
    return np.array([np.cos(alt) * np.sin(azi), np.cos(alt) * np.cos(azi), np.sin(alt)])


@pytest.mark.peer
@pytest.mark.parametrize(
    ("kind", "option"), [("overcast", "-c"), ("clear", "-s"), ("intermediate", "-i"), ("uniform", "-u")]
)
@pytest.mark.parametrize(("altitude", "azimuth"), [(40.0, 210.0), (15.0, 100.0), (70.0, 300.0)])
def test_distribution_is_that_of_gensky(kind, option, altitude, azimuth, radiance):
    """skybright.cal, run on the arguments that gensky wrote, without its ground's blend."""
    command = [radiance / "gensky", "-ang", str(altitude), str(azimuth - 180), option]
    text = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    arguments = [float(word) for word in text.split("skybright.cal\n0\n")[1].split()][1:]
    names = dict(zip(("A1", "A2", "A3", "A4", "A5", "A6", "A7"), arguments, strict=False))
    if kind in ("clear", "intermediate"):
        np.testing.assert_allclose(arguments[4:7], sun_at(altitude, azimuth), atol=1e-6)
    constants = ";".join(f"{name}:{value}" for name, value in names.items())
    given = "A4:1;A5:0;A6:0;A7:1;" if "A5" not in names else ""
    functions = {"overcast": "cloudysky", "clear": "sunnysky", "intermediate": "intersky", "uniform": "unifsky"}
    program = "Acos(x):if(x-1,0,if(-1-x,PI,acos(x)));" + given + constants
    command = [radiance / "rcalc", "-id3", "-od", "-e", program, "-f", "skybright.cal"]
    run = subprocess.run(
        [*command, "-e", f"Dx=$1;Dy=$2;Dz=$3;$1={functions[kind]}"],
        input=HIGH.tobytes() + np.array([0, 0, 1.0]).tobytes(),
        capture_output=True,
        check=True,
        env={"RAYPATH": str(radiance.parent / "lib")},
    )
    theirs = np.frombuffer(run.stdout)
    ours = relative_luminance(kind, HIGH, sun_at(altitude, azimuth))
    # the sun's direction is printed with six digits, so the angle to it is 1e-5 off nearby, and
    # the brightness 3 exp(-3 gamma) times ten of that
    np.testing.assert_allclose(ours, theirs[:-1] / theirs[-1], rtol=1e-4)


def test_overcast_sky_has_its_closed_form():
    """Zenith three times the horizon; horizontal illuminance 7 pi/9 of the zenith's luminance."""
    top, bottom = relative_luminance("overcast", [[0, 0, 1.0], [1.0, 0, 0]])
    assert top == pytest.approx(1) and bottom == pytest.approx(1 / 3)
    patches = cie_patches("overcast", FINE, 10_000.0)
    # the zenith's luminance from patches of 2 degrees
    assert patches[-1] == pytest.approx(10_000 * 9 / (7 * np.pi), rel=2e-4)
    assert patches[0] == pytest.approx(0.2 * 10_000 / np.pi)
    assert cie_patches("overcast", FINE, 1.0)[0] == pytest.approx(0.2 / np.pi)  # of the sky alone
    np.testing.assert_allclose(FINE.horizontal_weights @ patches, 10_000)


@pytest.mark.parametrize("kind", [*KINDS, *range(1, 16)])
def test_every_sky_gives_its_horizontal_illuminance(kind):
    sky = ReinhartSky(1)
    patches = cie_patches(kind, sky, 20_000.0, sun=sun_at(35, 120), direct_horizontal=5_000.0)
    assert np.all(patches > 0)
    assert sky.horizontal_weights @ patches == pytest.approx(20_000)
    assert patches[0] == pytest.approx(0.2 * 25_000 / np.pi)
    assert relative_luminance(kind, [[0, 0, 1.0]], sun_at(35, 120))[0] == pytest.approx(1)


def test_general_skies_keep_their_meaning():
    """ISO 15469: type 5 is uniform; 1 is nearly the overcast; 12 is the clear sky."""
    sun = sun_at(40, 180)
    np.testing.assert_allclose(relative_luminance(5, HEMISPHERE, sun), 1.0)
    horizon = [[0.0, 1.0, 0.0]]
    one, overcast = (relative_luminance(kind, horizon, sun) for kind in (1, "overcast"))
    np.testing.assert_allclose(one, 1 / (1 + 4 * np.exp(-0.7)), rtol=1e-12)
    np.testing.assert_allclose(one, overcast, rtol=0.01)  # both a third of the zenith
    clear = relative_luminance("clear", HIGH, sun)
    np.testing.assert_allclose(relative_luminance(12, HIGH, sun), clear, rtol=0.01)
    assert len(GENERAL_SKIES) == 15


@pytest.mark.parametrize("kind", ["clear", 12, "intermediate"])
def test_a_sky_with_a_sun_is_brightest_there(kind):
    sun = sun_at(40, 90)
    level = relative_luminance(kind, HIGH, sun)
    assert np.degrees(np.arccos(HIGH[np.argmax(level)] @ sun)) < 12
    with pytest.raises(ValueError, match="needs the direction"):
        relative_luminance(kind, HIGH)


def test_unknown_kinds():
    for wrong in ("cloudy", 0, 17):
        with pytest.raises(ValueError, match="kind"):
            relative_luminance(wrong, HIGH, sun_at(40, 90))
    with pytest.raises(ValueError, match="not negative"):
        cie_patches("overcast", FINE, -1.0)


ISO_15469 = """
1 4 -.7 0 -1 0, 2 4 -.7 2 -1.5 .15, 3 1.1 -.8 0 -1 0, 4 1.1 -.8 2 -1.5 .15, 5 0 -1 0 -1 0,
6 0 -1 2 -1.5 .15, 7 0 -1 5 -2.5 .3, 8 0 -1 10 -3 .45, 9 -1 -.55 2 -1.5 .15,
10 -1 -.55 5 -2.5 .3, 11 -1 -.55 10 -3 .45, 12 -1 -.32 10 -3 .45, 13 -1 -.32 16 -3 .3,
14 -1 -.15 16 -3 .3, 15 -1 -.15 24 -2.8 .15
"""


@pytest.mark.parametrize("row", ISO_15469.split(","))
def test_standard_skies_by_the_formula_of_the_standard(row):
    """phi(Z) f(chi)/(phi(0) f(Z_s)) of ISO 15469, equations 1 to 5, one direction at a time."""
    number, a, b, c, d, e = map(float, row.split())
    sun = sun_at(33.0, 140.0)

    def phi(cosine):
        return 1 + a * np.exp(b / cosine)

    def f(chi):
        return 1 + c * (np.exp(d * chi) - np.exp(d * np.pi / 2)) + e * np.cos(chi) ** 2

    for altitude, azimuth in ((10.0, 30.0), (55.0, 150.0)):
        towards = sun_at(altitude, azimuth)
        chi = np.arccos(towards @ sun)
        by_hand = phi(towards[2]) * f(chi) / (phi(1.0) * f(np.radians(90.0 - 33.0)))
        assert relative_luminance(int(number), [towards], sun)[0] == pytest.approx(by_hand)


@pytest.mark.parametrize("row", ISO_15469.split(","))
def test_gradation_of_the_horizon_is_one(row):
    """exp(b/cos Z) is 0 there; at the sun itself the indicatrix is that of angle 0."""
    number, a, b, c, d, e = map(float, row.split())
    sun = sun_at(33.0, 140.0)

    def f(chi):
        return 1 + c * (np.exp(d * chi) - np.exp(d * np.pi / 2)) + e * np.cos(chi) ** 2

    whole = (1 + a * np.exp(b)) * f(np.radians(57.0))
    horizon, at_sun = relative_luminance(int(number), [sun_at(0.0, 140.0), sun], sun)
    assert horizon == pytest.approx(f(np.radians(33.0)) / whole, rel=1e-9)
    gradation = 1 + a * np.exp(b / np.sin(np.radians(33.0)))
    assert at_sun == pytest.approx(gradation * f(0.0) / whole, rel=1e-7)


def test_the_direction_of_the_sun_itself_is_a_number():
    """The cosine of the angle to it rounds above one in some directions."""
    random = np.random.default_rng(4).normal(size=(300, 3))
    suns = np.abs(random / np.linalg.norm(random, axis=1, keepdims=True))
    assert any(sun @ sun > 1.0 for sun in suns)
    for kind in ("clear", "intermediate", 12):
        for sun in suns:
            assert np.isfinite(relative_luminance(kind, [sun, -sun], sun)).all()


def test_clear_and_intermediate_skies_by_the_formulas_of_gensky():
    """skybright.cal: 0.91 + 10 exp(-3 chi) + 0.45 cos^2 chi; Nakamura's intermediate sky."""
    sun, towards = sun_at(33.0, 140.0), sun_at(55.0, 200.0)
    z, zs, chi = np.radians(35.0), np.radians(57.0), np.arccos(towards @ sun)

    def f(angle):
        return 0.91 + 10 * np.exp(-3 * angle) + 0.45 * np.cos(angle) ** 2

    clear = f(chi) * (1 - np.exp(-0.32 / np.cos(z))) / (f(zs) * (1 - np.exp(-0.32)))
    assert relative_luminance("clear", [towards], sun)[0] == pytest.approx(clear)

    def between(z, chi):
        level = (1.35 * np.sin(5.631 - 3.59 * z) + 3.12) * np.sin(4.396 - 2.6 * zs) + 6.37 - z
        return level * np.exp(-chi * 0.563 * ((2.629 - z) * (1.562 - zs) + 0.812))

    found = relative_luminance("intermediate", [towards], sun)[0]
    assert found == pytest.approx(between(z, chi) / between(0.0, zs))
    with pytest.raises(ValueError, match="not negative"):
        cie_patches("overcast", FINE, 1.0, direct_horizontal=-0.5)
    dark = cie_patches("overcast", FINE, 0.0, direct_horizontal=np.pi, ground_reflectance=0.5)
    assert dark[0] == pytest.approx(0.5) and not dark[1:].any()
