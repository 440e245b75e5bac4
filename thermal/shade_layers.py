"""Blinds, woven and perforated shades as layers of a glazing: their longwave and their open area.

Slats, threads and holes become one layer with an emissivity on each side, a longwave transmittance
and the openings that air passes through.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermal.errors import require, require_range
from thermal.glazing_unit import GlazingLayer, Openings

SEGMENTS = 5  # of a slat (ISO 15099:2003, 7.3)
ANGLES = 90  # of the integral over a hemisphere
# Effective front opening c1 (A cos^c2)^c3 and thickness of a blind; c1 A^c2 of other shades
BLIND = (0.016, -0.63, 0.53, 0.043)
SHEET = (0.078, 1.2)

Edges = tuple[float, float, float, float]  # [m] open at top, bottom, left, right


def venetian_layer(
    slat_width: float,
    slat_spacing: float,
    slat_tilt_deg: float,
    *,
    slat_thickness: float = 0.0005,
    conductivity: float = 160.0,
    emissivity: tuple[float, float] = (0.9, 0.9),
    edges: Edges = (0.0, 0.0, 0.0, 0.0),
) -> GlazingLayer:
    """A blind of flat horizontal slats as a layer.

    Args: emissivity: of the slats' upper and lower sides; slat_tilt_deg: 0 is horizontal, positive
        lowers the outer edge; edges: widths of the openings around it [m].

    Source: ISO 15099:2003, 7.3; open area: Hart, Goudey, Curcija 2018, "Impact of room-side
        shading on the thermal performance of glazing" (the fits of WINDOW).
    """
    require_range(slat_width, 1e-3, 2.0, "slat width", "m")
    require_range(slat_spacing, 1e-3, 2.0, "slat spacing", "m")
    require_range(slat_tilt_deg, -90.0, 90.0, "slat tilt", "degrees")
    tilt = np.radians(slat_tilt_deg)
    passed, sides = _slat_longwave(slat_width, slat_spacing, tilt, emissivity)
    cosine, sine = float(np.cos(tilt)), float(abs(np.sin(tilt)))
    across = slat_width * cosine + slat_thickness * sine
    blocked = slat_thickness * slat_width / max(across, 1e-9)
    open_share = max(1.0 - blocked / (slat_spacing + slat_thickness), 0.0)
    c1, c2, c3, c4 = BLIND
    front = c1 * (open_share * max(cosine, 1e-3) ** c2) ** c3
    return GlazingLayer(
        max(c4 * across, 1e-5), conductivity, sides, passed, Openings(*edges, min(front, 1.0))
    )


def sheet_layer(
    openness: float,
    *,
    thickness: float = 0.0005,
    conductivity: float = 0.15,
    emissivity: tuple[float, float] = (0.9, 0.9),
    infrared_transmittance: float | None = None,
    edges: Edges = (0.0, 0.0, 0.0, 0.0),
) -> GlazingLayer:
    """A woven shade, screen or film with a share of open area as a layer.

    Args: openness: share of the sheet that is open, for air; emissivity: of the material;
        infrared_transmittance: None takes the open share.
    """
    require_range(openness, 0.0, 1.0, "openness")
    passed = openness if infrared_transmittance is None else infrared_transmittance
    sides = tuple(max(e * (1.0 - passed), 1e-4) for e in emissivity)
    front = SHEET[0] * openness ** SHEET[1]
    openings = Openings(*edges, front)
    return GlazingLayer(thickness, conductivity, (sides[0], sides[1]), passed, openings)


def perforated_layer(
    hole: float, spacing: float, *, thickness: float = 0.0006, **sheet: object
) -> GlazingLayer:
    """A sheet with round holes of a diameter [m] on a square grid [m] as a layer.

    Longwave passes the holes by the view factor of their two ends.
    """
    require(0 < hole < spacing, "perforated shade", "expected a hole smaller than its spacing")
    openness = np.pi * hole**2 / (4.0 * spacing**2)
    x = 2.0 + (2.0 * thickness / hole) ** 2
    passed = float(openness * 0.5 * (x - np.sqrt(x * x - 4.0)))
    return sheet_layer(
        float(openness),
        thickness=thickness,
        infrared_transmittance=passed,
        **sheet,  # type: ignore[arg-type]
    )


def woven_layer(diameter: float, spacing: float, **sheet: object) -> GlazingLayer:
    """A fabric of crossed threads of a diameter and spacing [m] as a layer.

    Longwave passes by the mean over the hemisphere of (1 - d/(s cos a)) (1 - d/(s cos b)), a and b
    the profile angles across the threads.
    """
    require(0 < diameter < spacing, "woven shade", "expected threads thinner than their spacing")
    ratio = diameter / spacing
    theta = (np.arange(ANGLES) + 0.5) * np.pi / 2 / ANGLES
    phi = (np.arange(ANGLES) + 0.5) * np.pi / 2 / ANGLES
    t, p = np.meshgrid(np.tan(theta), phi, indexing="ij")
    across = [np.sqrt(1.0 + (t * f(p)) ** 2) for f in (np.sin, np.cos)]  # 1/cos of profile angles
    open_ = np.maximum(1.0 - ratio * across[0], 0.0) * np.maximum(1.0 - ratio * across[1], 0.0)
    weight = np.sin(2.0 * theta)
    passed = float(weight @ open_.mean(axis=1) / weight.sum())
    layer = sheet_layer((1.0 - ratio) ** 2, infrared_transmittance=passed, **sheet)  # type: ignore[arg-type]
    return replace(layer, thickness=2.0 * diameter) if "thickness" not in sheet else layer


def _slat_longwave(
    width: float, spacing: float, tilt: float, emissivity: tuple[float, float]
) -> tuple[float, tuple[float, float]]:
    """Longwave transmittance of a blind, and its emissivities outdoors and towards the room.

    Diffuse exchange in the space between two slats: the lower slat's upper side and the upper
    slat's lower side in segments, the openings to both sides.
    """
    down, up = np.array([np.cos(tilt), np.sin(tilt)]), np.array([0.0, spacing])
    along = np.linspace(0.0, width, SEGMENTS + 1)[:, None] * down
    # from outdoors (x = 0) to the room; positive tilt: the outer edge is the lower one
    strips = [(along[i], along[i + 1]) for i in range(SEGMENTS)]
    strips += [(along[i + 1] + up, along[i] + up) for i in range(SEGMENTS)]
    strips += [(up, along[0]), (along[-1], along[-1] + up)]
    factors = _between(strips)
    n = 2 * SEGMENTS
    rho = np.repeat([1.0 - emissivity[0], 1.0 - emissivity[1]], SEGMENTS)
    solve = np.linalg.inv(np.eye(n) - rho[:, None] * factors[:n, :n])
    results = []
    for source, other in ((n, n + 1), (n + 1, n)):
        leaving = solve @ (rho * factors[:n, source])
        lengths = np.array([np.linalg.norm(b - a) for a, b in strips])
        arrives = [
            factors[face, :n] @ leaving + (factors[face, source] if face != source else 0.0)
            for face in (other, source)
        ]
        scale = lengths[[other, source]] / lengths[source]
        results.append([float(a * s) for a, s in zip(arrives, scale, strict=True)])
    passed = 0.5 * (results[0][0] + results[1][0])
    emissivities = [max(1.0 - passed - reflected, 1e-4) for _, reflected in results]
    return passed, (emissivities[0], emissivities[1])


Strip = tuple[NDArray[np.float64], NDArray[np.float64]]


def _between(strips: list[Strip]) -> NDArray[np.float64]:
    """View factors [N, N] of infinitely long strips that face each other, by crossed strings."""
    n = len(strips)
    factors = np.zeros((n, n))

    def far(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
        return float(np.hypot(*(a - b)))

    for i, (a, b) in enumerate(strips):
        for j, (c, d) in enumerate(strips):
            if i != j:
                seen = far(a, c) + far(b, d) - far(a, d) - far(b, c)
                factors[i, j] = max(seen, 0.0) / (2.0 * far(a, b))
    return factors
