"""The sun of a room's windows as few sums of their irradiance by direction."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from scenes.room.solar import SeasonalOutdoors, absorbed_shares, directional_sums

G, F, L, P, K = 2, 3, 4, 5, KLEMS_FULL.size
AREA = np.array([1.5, 4.0])


def traced(rng: np.random.Generator) -> SimpleNamespace:
    """D of two groups of windows."""
    return SimpleNamespace(
        scene=SimpleNamespace(groups=[1, 2]),
        parts=SimpleNamespace(of_groups=lambda values: values),
        daylight=SimpleNamespace(values=rng.random((G, K, P))),
    )


def test_what_is_asked_of_the_windows_irradiance_is_what_its_directions_give() -> None:
    """Few sums before many hours; here direction by direction, hour by hour."""
    rng = np.random.default_rng(0)
    outdoors = SeasonalOutdoors([traced(rng)], np.zeros(L, dtype=np.int64))
    skies = SimpleNamespace(solar=rng.random((P, L)).astype(np.float32), lit=np.arange(L))
    absorbed = rng.random((G, K, F + G))
    names = "outer", "inner", "middle"
    sides = [SimpleNamespace(**{name: rng.random(K) for name in names}) for _ in range(G)]
    heats = [
        SimpleNamespace(absorptances=side, back_reflectance=back) for side, back in zip(sides, (0.1, 0.2), strict=True)
    ]
    T, omega = rng.random((G, K, K)), KLEMS_FULL.projected_solid_angles()
    incident = omega[:, None] * (outdoors.first.daylight.values @ skies.solar)  # [G, K, L]
    entering = np.stack([t / omega @ i for t, i in zip(T, incident, strict=True)])
    entering *= omega[:, None] * AREA[:, None, None]
    expected = (
        np.einsum("gkf,gkl->fl", absorbed, entering),
        np.stack([side.outer @ i for side, i in zip(sides, incident, strict=True)]),
        np.stack([side.inner @ i for side, i in zip(sides, incident, strict=True)]),
        np.stack([side.middle @ i for side, i in zip(sides, incident, strict=True)]),
        np.stack([AREA @ incident.sum(axis=1), entering.sum(axis=(0, 1))]),
    )
    for shares, values in zip(absorbed_shares(heats, T, AREA, absorbed), expected, strict=True):
        np.testing.assert_allclose(directional_sums(outdoors, skies, shares), values, rtol=1e-5)


def test_beside_the_sun_all_light_meets_one_hemispherical_value() -> None:
    rng = np.random.default_rng(1)
    outdoors = SeasonalOutdoors([traced(rng)], np.zeros(L, dtype=np.int64))
    sky, sun = rng.random((P, L)), np.zeros((P, L))
    sun[2] = rng.random(L)
    skies = SimpleNamespace(solar=sky + sun, lit=np.arange(L))
    shares, omega = rng.random((3, G, K)), KLEMS_FULL.projected_solid_angles()
    daylight = outdoors.first.daylight.values
    of_sun = np.einsum("ngk,gkl->nl", shares * omega, daylight @ sun)
    falls = np.einsum("k,gkl->gl", omega, daylight @ sky)
    expected = of_sun + (shares @ omega / omega.sum()) @ falls
    np.testing.assert_allclose(directional_sums(outdoors, skies, shares, sun), expected, rtol=1e-5)
    by_direction = directional_sums(outdoors, skies, shares)
    assert np.abs(by_direction / expected - 1.0).max() > 0.005
