"""Reinhart patches: counts, solid angles, the lookup, and the order of `reinhart.cal`."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from mitsuba_cfs.sky.patches import ReinhartSky

SIZES = {1: 146, 2: 578, 4: 2306, 6: 5186}


@pytest.mark.parametrize("mf", SIZES)
def test_closed_forms(mf):
    sky = ReinhartSky(mf)
    assert sky.size == SIZES[mf] == len(sky.directions) == len(sky.solid_angles)
    assert sky.row_counts.sum() == sky.size - 1
    np.testing.assert_allclose(sky.solid_angles[1:].sum(), 2 * np.pi, rtol=1e-13)
    assert sky.solid_angles[0] == 2 * np.pi  # the ground
    np.testing.assert_allclose(np.linalg.norm(sky.directions, axis=1), 1, rtol=1e-14)
    # the cosine at the centres of the rows overstates pi by 1 - cos(h/2): 1 % for MF:1
    expected = np.pi * (2 - np.cos(sky.row_height / 2))
    np.testing.assert_allclose(sky.horizontal_weights.sum(), expected, rtol=1e-13)


@pytest.mark.parametrize("mf", SIZES)
def test_each_centre_is_in_its_own_patch(mf):
    sky = ReinhartSky(mf)
    np.testing.assert_array_equal(sky.index(sky.directions), np.arange(sky.size))


@pytest.mark.parametrize("mf", SIZES)
def test_share_of_random_directions_is_the_solid_angle(mf):
    rng = np.random.default_rng(7)
    count = 400_000
    z, turn = rng.random(count), 2 * np.pi * rng.random(count)
    level = np.sqrt(1 - z**2)
    sky = ReinhartSky(mf)
    found = np.bincount(
        sky.index(np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)), minlength=sky.size
    )
    expected = count * sky.solid_angles[1:] / (2 * np.pi)
    chi_square = np.sum((found[1:] - expected) ** 2 / expected)
    # chi-square of n degrees of freedom: mean n, variance 2n; 5 sigma
    assert abs(chi_square - (sky.size - 2)) < 5 * np.sqrt(2 * sky.size)
    assert found[0] == 0


def test_axes_and_edges():
    sky = ReinhartSky(1)
    assert sky.index([0, 1, 0.01]) == 1  # north, on the horizon
    assert sky.index([-0.01, 1, 0.01]) == 1  # the first patch is centred on north
    assert sky.index([1, 0, 0.01]) == 1 + round(30 / 4 + 0.01)  # east comes before south
    assert sky.index([0, 0, 3.0]) == 145
    assert sky.index([0, 1, -1e-9]) == 0
    assert sky.index(np.broadcast_to([0, 0, -1], (2, 3, 3))).shape == (2, 3)


@pytest.mark.parametrize("wrong", [0, -1, 1.5, True])
def test_subdivision_is_checked(wrong):
    with pytest.raises(ValueError, match="subdivision"):
        ReinhartSky(wrong)


@pytest.mark.peer
@pytest.mark.parametrize("mf", SIZES)
def test_lookup_is_that_of_reinhart_cal(mf, radiance):
    rng = np.random.default_rng(mf)
    directions = rng.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    command = [radiance / "rcalc", "-id3", "-od", "-e", f"MF:{mf}", "-f", "reinhart.cal"]
    command += ["-e", "Dx=$1;Dy=$2;Dz=$3", "-e", "$1=rbin"]
    run = subprocess.run(
        command,
        input=directions.tobytes(),
        capture_output=True,
        check=True,
        env={"RAYPATH": str(radiance.parent / "lib")},
    )
    theirs = np.frombuffer(run.stdout).astype(int)
    np.testing.assert_array_equal(ReinhartSky(mf).index(directions), theirs)


@pytest.mark.peer
@pytest.mark.parametrize("mf", SIZES)
def test_centres_and_solid_angles_are_those_of_reinsrc_cal(mf, radiance):
    sky = ReinhartSky(mf)
    command = [radiance / "rcalc", "-id1", "-od", "-e", f"MF:{mf}", "-f", "reinsrc.cal"]
    command += ["-e", "Rbin=$1", "-e", "$1=Dx;$2=Dy;$3=Dz;$4=Romega"]
    run = subprocess.run(
        command,
        input=np.arange(1.0, sky.size - 1).tobytes(),  # the zenith's own centre is set apart there
        capture_output=True,
        check=True,
        env={"RAYPATH": str(radiance.parent / "lib")},
    )
    theirs = np.frombuffer(run.stdout).reshape(-1, 4)
    np.testing.assert_allclose(sky.directions[1:-1], theirs[:, :3], atol=1e-12)
    np.testing.assert_allclose(sky.solid_angles[1:-1], theirs[:, 3], rtol=1e-12)


@pytest.mark.parametrize("subdivision", [1, 2, 4])
def test_the_zenith_lies_in_the_last_patch(subdivision):
    sky = ReinhartSky(subdivision)
    assert sky.index([[0.0, 0.0, 1.0], [1e-12, 0.0, 2.0]]).tolist() == [sky.size - 1] * 2
