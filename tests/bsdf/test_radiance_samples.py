"""Radiance's own samples follow our values: chi-square over cells of both hemispheres."""

from __future__ import annotations

import bsdf_radiance as radiance
import numpy as np
import pytest
from scipy.stats import chi2

from mitsuba_cfs.bsdf.evaluate import bsdf_values, outgoing_disk
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import disk_to_square, square_to_disk
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.directions import outgoing_azimuth
from tests.conftest import OWN_BLIND

COUNT, WIDTH, FINE = 40_000, 8, 8  # samples; cells along a square's side, and points in a cell
FILES = (
    "klems_full/SquareSlat_genBSDF.xml",
    "klems_full/bcl_cl_Tn0.88_blinds.xml",
    "derived_klems_half_quarter/blinds_20deg_klems_half.xml",
    "tensortree/pyradiance_room_blindsT3.xml",
    "tensortree/blinds_20deg_t45.xml",
)


def square_cells(directions):
    """Cell [side, 8 x 8] of the outgoing square."""
    square = disk_to_square(outgoing_disk(directions))
    cell = np.minimum((square * WIDTH).astype(int), WIDTH - 1)
    return ((directions[:, 2] < 0) * WIDTH + cell[:, 0]) * WIDTH + cell[:, 1]


def square_shares(bsdf, incident):
    """Share of the light [2 x 8 x 8] in each cell, from 64 points of it."""
    axis = (np.arange(WIDTH * FINE) + 0.5) / (WIDTH * FINE)
    disk = square_to_disk(np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2))
    z = np.sqrt(np.maximum(1 - (disk**2).sum(axis=1), 0))
    shares = []
    for sign in (1, -1):
        outgoing = np.stack([-disk[:, 0], disk[:, 1], sign * z], -1)
        values = bsdf_values(bsdf, incident, outgoing).reshape(WIDTH, FINE, WIDTH, FINE)
        shares.append(values.mean(axis=(1, 3)) * np.pi / WIDTH**2)
    return np.ravel(shares)


def patch_cells(bsdf: KlemsBsdf, directions):
    """Cell [side, patch] of a Klems basis."""
    theta = np.arccos(np.clip(abs(directions[:, 2]), 0, 1))
    patch = bsdf.basis_out.index(theta, outgoing_azimuth(directions))
    return (directions[:, 2] < 0) * bsdf.basis_out.size + patch


def patch_shares(bsdf: KlemsBsdf, incident):
    """Share of the light [2 K] in each patch."""
    area = bsdf.basis_out.projected_solid_angles()
    sides = (bsdf.basis_out.outgoing_directions(front=front) for front in (True, False))
    return np.concatenate([bsdf_values(bsdf, incident, out) * area for out in sides])


@pytest.mark.peer
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["front", "back"])
@pytest.mark.parametrize("name", [OWN_BLIND, *FILES])
def test_radiance_samples_by_our_values(bsdf_file, name, side):
    path = bsdf_file(name)
    bsdf = read_bsdf_xml(path).band("Visible")
    incident = np.array([0.36, 0.48, 0.8 * side])
    drawn = radiance.to_window(radiance.samples(path, radiance.to_window(incident), COUNT))
    assert np.abs(np.linalg.norm(drawn, axis=1) - 1).max() < 1e-4
    if isinstance(bsdf, KlemsBsdf):
        shares, cells = patch_shares(bsdf, incident), patch_cells(bsdf, drawn)
    else:
        shares, cells = square_shares(bsdf, incident), square_cells(drawn)
    expected = COUNT * shares / shares.sum()
    observed = np.bincount(cells, minlength=len(expected))
    used = expected > 5
    statistic = ((observed - expected)[used] ** 2 / expected[used]).sum()
    assert chi2.sf(statistic, used.sum() - 1) > 1e-3
