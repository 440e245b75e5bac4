"""Sunlight that slats reflect once and twice into the room, against the radiosity of two endless strips."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.spectra.detectors import NANOMETRES
from scenes.bsdf_generation import LEVELS, slat_light

pytestmark = pytest.mark.usefixtures("variant")
DEPTH, SPACING, TILT = 0.08, 0.072, np.radians(45.0)
STRIPS, PLACES = 200, 6  # of a slat, and directions of a patch in each angle
Array = NDArray[np.float64]

# In the plane across the slats x points to the room and z up; a slat rises to the room.
ALONG = DEPTH * np.array([np.cos(TILT), np.sin(TILT)])
UP = np.array([-np.sin(TILT), np.cos(TILT)])  # normal of its upper side
LOWER = np.linspace(-0.5, 0.5, 2 * STRIPS + 1)[1::2, None] * ALONG  # middles of the strips of the lower slat
ABOVE = np.array([0.0, SPACING])


def sunlit(profile: float) -> Array:
    """Irradiance of the strips of an upper side by the sun, over that of the slats' plane; the slat above shades."""
    travel = np.array([np.cos(profile), -np.sin(profile)])
    reached = np.linalg.solve(np.stack([ALONG, travel], axis=1), (LOWER - ABOVE).T)
    shaded = (np.abs(reached[0]) < 0.5) & (reached[1] > 0)
    return np.where(shaded, 0.0, -(travel @ UP) / travel[0])


def to_room() -> Array:
    """Flux per area of the plane into the room [upper or under side, up or down, strips], of a radiosity of 1."""
    heights = np.linspace(0.0, SPACING, STRIPS + 1)[:-1] + SPACING / STRIPS / 2
    edge = 0.5 * ALONG + np.stack([np.zeros(STRIPS), heights], axis=1)
    flux = np.zeros((2, 2, STRIPS))
    for elevation in np.radians(np.arange(-89.5, 90.0)):
        travel = np.array([np.cos(elevation), np.sin(elevation)])
        for side, base in enumerate((np.zeros(2), ABOVE)):
            along, way = np.linalg.solve(np.stack([ALONG, travel], axis=1), (edge - base).T)
            hit = (way > 1e-9) & (np.abs(along) < 0.5)
            strips = ((along[hit] + 0.5) * STRIPS).astype(int)
            np.add.at(flux[side, int(elevation < 0)], strips, np.cos(elevation) / 2 * np.radians(1.0) / STRIPS)
    return flux


def orders(profiles: Array) -> Array:
    """Shares of sunlight into the room after one and two reflections without loss [n, up or down], their mean."""
    between = LOWER[None] + ABOVE - LOWER[:, None]
    distance = np.linalg.norm(between, axis=2)
    exchange = np.clip(between @ UP / distance, 0.0, None) ** 2 / (2 * distance) * DEPTH / STRIPS
    once = np.mean([sunlit(profile) for profile in profiles], axis=0)
    upper, under = to_room()
    return np.array([upper @ once, under @ (exchange.T @ once)])


def test_light_reflected_once_and_twice_is_that_of_two_strips() -> None:
    levels = 0.5 * LEVELS
    slats = plastic("slat", *levels)
    layer = venetian_blind(slats, depth=DEPTH, spacing=SPACING, tilt=TILT, radius=np.inf, thickness=0.0)
    passed = [one.transmission_front for one in generate_klems(layer, samples=8192).bsdf]
    shares = slat_light(passed, levels.tolist(), np.full(len(NANOMETRES), 0.5)).shares

    incident, upwards = KLEMS_FULL.incident_directions(), KLEMS_FULL.outgoing_directions()[:, 1]
    omega, u = KLEMS_FULL.projected_solid_angles(), (np.arange(PLACES) + 0.5) / PLACES
    profiles = np.arctan2(incident[:, 1], incident[:, 2])
    some = np.flatnonzero((profiles > np.radians(28)) & (profiles < np.radians(55)))
    assert len(some) > 10
    own, down, expected = np.zeros(2), 0.0, np.zeros(2)
    for k in some:
        lit = shares[:2, :, k] * passed[-1][:, k] * omega
        own += omega[k] * lit.sum(axis=1)
        down += omega[k] * lit[0, upwards < -1e-6].sum()
        theta, phi = KLEMS_FULL.angles_within(KLEMS_FULL.opposite()[k], *np.meshgrid(u, u))
        inwards = np.arctan2(np.sin(theta) * np.sin(phi), np.cos(theta))
        expected += omega[k] * orders(np.abs(inwards.ravel())).sum(axis=1)
    expected *= [0.5, 0.25]
    assert own == pytest.approx(expected, rel=0.02)  # four standard errors of the paths
    assert abs(down) < 0.002 * own[0]  # what is reflected once goes up
