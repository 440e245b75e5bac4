"""What `auto` expects of a method: traits of a room and its system, and errors measured of such."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import Glazing, glazing_values, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import Surfaces
from scenes.calibration.errors import (
    FILE,
    MeasuredCase,
    MeasuredErrors,
    Traits,
    hidden_sky,
    measured_errors,
    sun_in_view,
    system_traits,
)
from scenes.cost import room

CLEAR = Glazing("clear", 0.78, 0.14, 0.14)
GLASS = specular_klems(CLEAR, KLEMS_FULL)
K = KLEMS_FULL.size


def scattering(share: float, beam: float = 0.0) -> KlemsBsdf:
    block = np.full((K, K), share / np.pi)
    block += np.diag(beam / KLEMS_FULL.projected_solid_angles())
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block)


def test_a_systems_traits_are_its_beam_and_how_far_it_turns_light():
    beam, spread, dark, tree = system_traits(GLASS)
    assert (beam, spread, tree) == (3.0, 0.0, 0.0)
    theta = np.arcsin(np.sqrt((np.arange(512) + 0.5) / 512))  # even in cos(theta) d_omega
    diffuse = glazing_values(CLEAR, theta)[0].mean()
    assert 10**-dark == pytest.approx(diffuse, rel=1e-3)
    beam, spread, dark, tree = system_traits(scattering(0.3))
    assert (beam, tree) == (0.0, 0.0) and 10**-dark == pytest.approx(0.3)
    # diffuse in, diffuse out: the mean over two cosine hemispheres is a closed form of neither; by
    # a million pairs it is 63.2 degrees
    random = np.random.default_rng(0)
    r, phi = np.sqrt(random.random((2, 1_000_000))), 2 * np.pi * random.random((2, 1_000_000))
    way = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r**2)])
    angle = np.arccos(np.clip((way[:, 0] * way[:, 1]).sum(axis=0), -1, 1))
    assert spread == pytest.approx(np.sqrt((angle**2).mean()), abs=0.02)
    half = system_traits(scattering(0.1, 0.1))[0]
    assert half == pytest.approx(np.log10(500), abs=0.02)


def test_a_tensor_tree_is_known_for_one():
    """A diffuser of 0.4 as one leaf: the traits of its Klems matrices, and a tree."""
    leaf = TensorTree(4, np.zeros(1, dtype=np.int64), np.array([0.4 / np.pi]))
    beam, spread, dark, tree = system_traits(TensorTreeBsdf(leaf, leaf))
    assert tree == 1.0
    assert (beam, spread, dark) == pytest.approx(system_traits(scattering(0.4))[:3], abs=0.01)


def test_the_sun_in_view_and_the_hidden_sky_of_a_room():
    groups = room.window_groups()  # to the south: outward is -y
    eye, ahead = (1.8, 2.0, 1.2), (0.0, -1.0, 0.0)
    low = np.array([[0.0, -1.0, 0.2], [0.0, -1.0, 2.0], [0.0, 1.0, 0.2], [0.1, -1.0, 0.3]])
    low /= np.linalg.norm(low, axis=1)[:, None]
    shining = np.array([True, True, True, False])
    assert sun_in_view(groups, eye, ahead, low, shining) == 0.25  # the first; others high, behind
    assert sun_in_view(groups, eye, (0.0, 1.0, 0.0), low, shining) == 0.0  # looks away
    assert hidden_sky(groups, Surfaces.none()) == 0.0
    far = 1000.0
    quad = np.array([[-far, -5, 0], [far, -5, 0], [far, -5, far], [-far, -5, far]], dtype=float)
    wall = Surfaces(quad[[[0, 1, 2], [0, 2, 3]]], np.zeros(2), np.zeros(2, dtype=np.int64))
    assert hidden_sky(groups, wall) == pytest.approx(1.0, abs=0.01)


def cases() -> MeasuredErrors:
    pairs = ("three-phase DGP", "five-phase DGP")
    table = []
    for name, beam, three in (("glass", 3.0, 0.3), ("shade", 0.0, 0.01)):
        errors = dict(zip(pairs, (three, 0.02), strict=True))
        table.append(MeasuredCase("room", name, Traits(beam, 0.0, 0.0, 0.0, 0.0, 0.0), errors))
        lit = dict(zip(pairs, (2 * three, 0.04), strict=True))
        table.append(MeasuredCase("sun", name, Traits(beam, 0.0, 0.0, 0.0, 1.0, 0.0), lit))
    return MeasuredErrors("python -m a.script", "2026-11-22", tuple(table))


def test_what_is_expected_is_that_of_the_nearest_and_says_of_which():
    table = cases()
    near = Traits(2.9, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert table.expected(near)["three-phase", "DGP"] == pytest.approx(0.3, rel=0.01)
    between = table.expected(Traits(1.5, 0.0, 0.0, 0.0, 0.0, 0.0))["three-phase", "DGP"]
    assert between == pytest.approx(np.sqrt((0.3**2 + 0.01**2) / 2), rel=1e-6)  # half way
    sunny = table.expected(Traits(3.0, 0.0, 0.0, 0.0, 0.25, 0.0))["three-phase", "DGP"]
    assert sunny == pytest.approx(0.3 * np.sqrt(0.75 + 0.25 * 4), rel=0.01)  # of the hours' squares
    both = table.of_all([near, Traits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)])["three-phase", "DGP"]
    assert both == pytest.approx(np.sqrt((0.3**2 + 0.01**2) / 2), rel=0.01)
    said = table.origin([near])
    for word in ("2026-11-22", "a.script", "4 cases", "glass room"):
        assert word in said
    assert "NOTHING LIKE IT" not in said
    assert "NOTHING LIKE IT" in table.origin([Traits(0.0, 0.0, 0.0, 1.0, 0.0, 1.0)])


def test_a_table_that_cannot_be_read_is_one_clear_line(tmp_path):
    path = tmp_path / "errors.json"
    path.write_text("{}")
    with pytest.raises(DataError, match="is no table of measured errors"):
        MeasuredErrors.read(path)


def test_the_table_that_ships_names_its_script_and_predicts_systems_held_out():
    """Each system left out in turn: what is promised of it is kept, and is no mere excess."""
    from tests.validation.method_errors import broken_promises, held_out

    table = measured_errors()
    assert table == MeasuredErrors.read(FILE) and "method_errors" in table.script
    assert len({case.system for case in table.cases}) >= 5
    ratios = held_out(table)
    for pair, found in ratios.items():
        assert 0.5 < np.median(found) < 5, pair  # of errors that span two decades
    broken, asked = broken_promises(table)
    assert broken < 0.02 * asked
