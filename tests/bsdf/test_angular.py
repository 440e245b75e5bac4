"""Exact angular functions of specular systems: tables, Roos, panes; in the sun's way and paths."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.bsdf.angular import (
    AngularTable,
    check_specular,
    glass_table,
    roos_table,
    specular_matrices,
    stack_table,
)
from mitsuba_cfs.bsdf.glazing import Glazing, Pane, glazing_values, pane_values, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.errors import DataError

DEGREES = np.array([0.0, 30, 60, 75, 80, 85, 88])
THETA = np.radians(DEGREES)
COATED = Pane("coated", 0.61, 0.08, 0.12, coated=True)
FLOAT = Pane("float", 0.89, 0.08, 0.08)


def klems_of(table: AngularTable) -> KlemsBsdf:
    """What a file of Klems matrices knows of it: means over patches."""
    omega = KLEMS_FULL.projected_solid_angles()
    tau = table.patch_means(KLEMS_FULL)
    front, back = (
        table.patch_means(KLEMS_FULL, values, 1.0) for values in (table.reflectance_front, table.reflectance_back)
    )
    through, front, back = (np.diag(values / omega) for values in (tau, front, back))
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, front, back)


def towards(theta):
    import mitsuba as mi

    sine = np.sin(theta)
    return mi.Vector3f(np.stack([0.6 * sine, -0.8 * sine, np.cos(theta)]).astype(np.float32))


def test_a_stack_of_one_is_the_pane_and_of_clear_ones_passes_by_either_polarisation():
    for pane in (COATED, FLOAT):
        tau, front, _ = pane_values(pane, THETA)
        table = stack_table([pane])
        assert table.transmitted(THETA) == pytest.approx(tau, abs=2e-4)
        assert table.reflected("front", THETA) == pytest.approx(front, abs=2e-4)
    # m panes that absorb nothing: r = 2 m s / (1 + (2 m - 1) s) of a surface reflectance s, by
    # either polarisation (Stokes 1862; Born and Wolf 1.6)
    index = 1.5
    normal = ((index - 1) / (index + 1)) ** 2
    one = 2 * normal / (1 + normal)
    table = stack_table([Pane("ideal", 1 - one, one, one)] * 2)
    inner = np.sqrt(1 - (np.sin(THETA) / index) ** 2)
    s = ((np.cos(THETA) - index * inner) / (np.cos(THETA) + index * inner)) ** 2
    p = ((index * np.cos(THETA) - inner) / (index * np.cos(THETA) + inner)) ** 2
    expected = np.mean([1 - 4 * r / (1 + 3 * r) for r in (s, p)], axis=0)
    assert table.transmitted(THETA) == pytest.approx(expected, abs=2e-4)


def test_glass_passes_fresnels_shares_and_absorbs_along_its_way():
    """Of either polarisation (1 - r)^2 a / (1 - r^2 a^2), a of the way inside (Radiance, 3.2)."""
    for index, through in ((1.52, 0.96), (1.5, 1.0)):
        cosine = np.cos(THETA)
        inner = np.sqrt(1 - (np.sin(THETA) / index) ** 2)
        s = ((cosine - index * inner) / (cosine + index * inner)) ** 2
        p = ((index * cosine - inner) / (index * cosine + inner)) ** 2
        a = through ** (1 / inner)
        passed = np.mean([(1 - r) ** 2 * a / (1 - (r * a) ** 2) for r in (s, p)], axis=0)
        back = [r + r * (1 - r) ** 2 * a**2 / (1 - (r * a) ** 2) for r in (s, p)]
        table = glass_table([(through, index)])
        assert table.transmitted(THETA) == pytest.approx(passed, abs=2e-4)
        for side in ("front", "back"):
            assert table.reflected(side, THETA) == pytest.approx(np.mean(back, axis=0), abs=2e-4)


def test_a_turned_stack_reflects_its_other_side():
    a, b = (stack_table([COATED, FLOAT]), stack_table([FLOAT, Pane("coated", 0.61, 0.12, 0.08, coated=True)]))
    assert a.transmitted(THETA) == pytest.approx(b.transmitted(THETA), abs=1e-9)
    assert a.reflected("front", THETA) == pytest.approx(b.reflected("back", THETA), abs=1e-9)
    assert abs(a.reflected("front", 0.0) - a.reflected("back", 0.0)) > 0.01


def test_a_table_of_five_degrees_keeps_what_it_came_from():
    whole = stack_table([COATED, FLOAT])
    theta = np.radians(np.arange(0, 90, 5))
    table = AngularTable(theta, whole.transmitted(theta))
    at = np.radians([52.5, 62.5, 72.5, 82.5])
    assert table.transmitted(at) == pytest.approx(whole.transmitted(at), rel=0.01)
    assert table.transmitted(np.pi / 2) == 0


@pytest.mark.parametrize(
    ("theta", "tau", "words"),
    [((0, 60), (0.8, 1.2), "share"), ((10, 60), (0.8, 0.5), "from 0"), ((0, 95), (0.8, 0), "90")],
)
def test_a_table_that_cannot_be_is_refused(theta, tau, words):
    with pytest.raises(ValueError, match=words):
        AngularTable(np.radians(theta), np.array(tau, dtype=float))
    with pytest.raises(ValueError, match="more than all"):
        AngularTable(np.radians([0.0, 60]), np.array([0.8, 0.5]), np.array([0.3, 0.4]))


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("name", ["coated", "roos"])
def test_the_sun_and_paths_have_the_function_at_every_angle(name):
    """Klems data alone are 7 to 37 % off at 85 and 88 degrees."""
    from mitsuba_cfs.methods.optics import BsdfOptics

    unit = Glazing("unit", 0.65, 0.12, 0.10, category=6)
    table = stack_table([COATED, FLOAT]) if name == "coated" else roos_table(unit)
    exact = table.transmitted(THETA)
    bare, known = BsdfOptics(klems_of(table)), BsdfOptics(klems_of(table), angular=table)
    for optics, least, most in ((bare, 0.05, 1.0), (known, 0.0, 1e-3)):
        for beam in (optics.scattering.through, optics.paths.straight):
            off = np.abs(beam(towards(THETA)).numpy() / exact - 1).max()
            assert least <= off <= most
    assert known.transmission == pytest.approx(bare.transmission, abs=1e-4)
    assert known.reflection == pytest.approx(bare.reflection, abs=1e-4)
    away = known.paths.mirrored(towards(THETA)).numpy()  # outwards: it meets the back
    assert away == pytest.approx(table.reflected("back", THETA), abs=1e-3)
    assert known.paths.bsdf is None  # nothing is left that scatters


def test_roos_is_the_formula():
    unit = Glazing("unit", 0.7, 0.12, 0.13)
    tau, _, back = glazing_values(unit, THETA)
    assert roos_table(unit).transmitted(THETA) == pytest.approx(tau, abs=2e-4)
    assert roos_table(unit).reflected("back", THETA) == pytest.approx(back, abs=2e-4)


@pytest.mark.parametrize("scalar", [False, True])
def test_the_plugins_beam_is_the_function(variant, scalar):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin

    table = stack_table([COATED, FLOAT])
    if scalar:
        mi.set_variant("scalar_rgb")
    try:
        entry = klems_plugin(specular_klems(FLOAT, KLEMS_FULL), angular=table)
        bsdf, context = mi.load_dict(entry), mi.BSDFContext()
        for degrees in (20.0, 86.0):
            theta = np.radians(degrees)
            known = [float(0.6 * np.sin(theta)), float(0.8 * np.sin(theta)), float(np.cos(theta))]
            found = bsdf.straight_on(context, mi.Vector3f(known), True)
            found = float(found if scalar else found.numpy()[0])
            assert found == pytest.approx(float(table.transmitted(theta)), rel=2e-3)
    finally:
        if scalar:
            mi.set_variant(variant)


ENGINE = """
import json, sys, pywincalc
from pathlib import Path
standard = Path(pywincalc.__file__).parent / "standards" / "prEN_410.std"
system = pywincalc.GlazingSystem(
    optical_standard=pywincalc.load_standard(str(standard)),
    solid_layers=[pywincalc.parse_json_file(sys.argv[1])],
)
found = []
for angle in json.loads(sys.argv[2]):
    front = system.optical_method_results("PHOTOPIC", angle, 0).system_results.front
    found.append([front.transmittance.direct_direct, front.reflectance.direct_direct])
print(json.dumps(found), flush=True)
"""


@pytest.mark.peer
def test_a_pane_of_the_igsdb_is_windows_at_every_angle(real_data):
    """Fresnel of the mean over the spectrum against the mean of Fresnel at each wavelength."""
    from mitsuba_cfs.bsdf.spectral_pane import read_pane_file

    path = real_data / "bsdf/products_spectral/igsdb_product_364.json"
    words = [sys.executable, "-c", ENGINE, str(path), json.dumps(DEGREES.tolist())]
    answer = subprocess.run(words, capture_output=True, text=True, timeout=60)
    tau, rho = np.array(json.loads(answer.stdout)).T
    table = stack_table([read_pane_file(path).visible_pane()])
    assert table.transmitted(THETA) == pytest.approx(tau, abs=1e-3)
    assert table.reflected("front", THETA) == pytest.approx(rho, abs=1e-3)


def test_a_function_of_the_angle_belongs_to_a_bsdf_without_scattering():
    """The same pane fits; another transmittance, and a sheet that scatters all, are refused."""
    pane, other = Pane("p", 0.8, 0.08, 0.08), Pane("q", 0.6, 0.08, 0.08)
    bsdf, table = specular_klems(pane, KLEMS_FULL), stack_table([pane])
    check_specular(bsdf, table, Path("a.xml"))
    check_specular(bsdf, None, Path("a.xml"))
    with pytest.raises(DataError, match=r"a.xml: angular: passes 0\.5. of diffuse light"):
        check_specular(bsdf, stack_table([other]), Path("a.xml"))
    even = np.full((KLEMS_FULL.size,) * 2, 0.3 / np.pi)
    sheet = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, even, even, even, even)
    with pytest.raises(DataError, match="scatters 100 % of what it passes"):
        check_specular(sheet, table, Path("a.xml"))


def test_means_over_patches_are_taken_at_all_of_their_places():
    """Of cos(theta) in the first patch, 5 degrees wide: 2/3 (c1^3 - c2^3)/(c1^2 - c2^2)."""
    angles = np.radians(np.arange(0.0, 91.0, 1.0))
    table = AngularTable(angles, np.cos(angles))
    c1, c2 = 1.0, np.cos(np.radians(5.0))
    by_hand = 2 / 3 * (c1**3 - c2**3) / (c1**2 - c2**2)
    assert table.patch_means(KLEMS_FULL)[0] == pytest.approx(by_hand, rel=1e-4)


def test_light_that_meets_two_systems_is_their_mean_by_share():
    """Shares 0, 1/4 and 1 of tables of 0.8 and 0.4; the back stays that of the first."""
    theta = np.radians([0.0, 30.0, 60.0])
    one, other = (
        AngularTable(theta, *(np.full(3, value) for value in values)) for values in ((0.8, 0.1, 0.15), (0.4, 0.5, 0.55))
    )
    mixed = one.mixed(other, np.array([0.0, 0.25, 1.0]))
    assert mixed.transmittance == pytest.approx([0.8, 0.7, 0.4])
    assert mixed.reflectance_front == pytest.approx([0.1, 0.2, 0.5])
    assert mixed.reflectance_back == pytest.approx([0.15] * 3)
    assert AngularTable(theta, one.transmittance).mixed(other, np.zeros(3)).reflected("front", 0.0) is None


def test_a_table_may_end_at_or_before_grazing():
    """Values at 90 degrees are the table's own; without them nothing passes, all is reflected."""
    theta = np.radians([0.0, 45.0, 89.8])
    short = AngularTable(theta, np.array([0.8, 0.7, 0.1]), np.array([0.1, 0.2, 0.8]))
    assert short.transmitted(np.pi / 2) == 0
    assert short.reflected("front", np.pi / 2) == 1
    whole = AngularTable(np.radians([0.0, 45.0, 90.0]), np.array([0.8, 0.7, 0.1]))
    assert whole.transmitted(np.pi / 2) == pytest.approx(0.1)
    assert whole.reflected("front", 0.0) is None


@pytest.mark.parametrize(("share", "message"), [(0.048, None), (0.3, "scatters 30 %")])
def test_scattering_is_measured_against_all_that_passes(share, message):
    """A share of diffuse light that passes scattered evenly, the rest straight on."""
    omega, size = KLEMS_FULL.projected_solid_angles(), KLEMS_FULL.size
    through = np.diag((1 - share) * 0.6 / omega) + share * 0.6 / np.pi
    dark = np.zeros((size, size))
    bsdf = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, dark, dark)
    table = AngularTable(np.radians([0.0, 90.0]), np.full(2, (1 - share) * 0.6))
    if message is None:
        check_specular(bsdf, table, Path("a.xml"))
    else:
        with pytest.raises(DataError, match=message):
            check_specular(bsdf, table, Path("a.xml"))


def test_a_table_passes_no_more_than_it_gets():
    theta = np.radians([0.0, 90.0])
    AngularTable(theta, np.array([1.0, 0.0]))
    for wrong in ([1.01, 0.0], [-0.01, 0.0]):
        with pytest.raises(ValueError, match="transmittance: expected a share of 1"):
            AngularTable(theta, np.array(wrong))


def test_a_table_that_ends_early_goes_on_to_nothing_passed_and_all_reflected():
    """From 80 to 90 degrees the reflectance rises to 1 there and is not 1 before; means follow it."""
    theta = np.radians([0.0, 60.0, 80.0])
    table = AngularTable(theta, np.array([0.8, 0.7, 0.3]), *[np.array([0.1, 0.15, 0.4])] * 2)
    angles = np.radians(np.linspace(80.0, 90.0, 401))
    for side in ("front", "back"):
        reflected = table.reflected(side, angles)
        assert reflected[-1] == pytest.approx(1.0) and (np.diff(reflected) > 0).all() and reflected[-2] < 1
    assert table.transmitted(np.pi / 2) == pytest.approx(0.0, abs=1e-12)
    filled = specular_matrices(table)
    fine = np.arcsin(np.sqrt(np.linspace(np.sin(np.radians(75)) ** 2, 1.0, 20_001)))
    last = KLEMS_FULL.size - 1
    omega = KLEMS_FULL.projected_solid_angles()[last]
    assert filled.reflection_front[last, last] * omega == pytest.approx(table.reflected("front", fine).mean(), abs=2e-3)
    assert filled.transmission_front[last, last] * omega == pytest.approx(table.transmitted(fine).mean(), abs=2e-3)


def test_an_angle_beyond_the_plane_of_the_glass_is_refused():
    AngularTable(np.radians([0.0, 90.0]), np.array([0.8, 0.0]))
    with pytest.raises(ValueError, match="at most 90 degrees"):
        AngularTable(np.radians([0.0, 90.3]), np.array([0.8, 0.0]))
